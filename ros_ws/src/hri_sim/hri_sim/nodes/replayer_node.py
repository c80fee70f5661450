"""Replayer node: plays a bag or a track file into the motion capture topics."""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from typing import Any

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from hri_prediction.bags.cdr import with_stamp
from hri_prediction.bags.metadata import OfferedQos
from hri_prediction.bags.schemas import message_class
from hri_prediction.config import parameter, validate
from hri_prediction.errors import ConfigError
from hri_prediction.ros.conversions import message_from_sample
from hri_prediction.ros.messages import Cue, HumanArm
from hri_prediction.ros.node import OK, CountedPublisher, HriNode, run_node
from hri_prediction.ros.parameters import declare_config
from hri_prediction.ros.qos import SENSOR, reliable
from hri_prediction.ros.time import NANO, seconds_to_ns, to_ns
from hri_prediction.ros.tracked import TrackedList
from hri_prediction.tracks.placement import Placement
from hri_prediction.tracks.track import ArmSample
from hri_sim.recording.playback import Player, Scheduled, ScheduledArm, load_playback
from hri_sim.scenario.schema import BACK

PERIOD_S = 0.004
"""How often the schedule is looked at [s]."""
_MAX_HELD = 50
"""Poses that a late tick makes up for while holding still."""


MAX_CUE_DELAY_S = 600.0
"""Longer delays in a cue are taken for mistakes [s]."""

GRID_NS = NANO // 50
"""Recordings are moved in time by multiples of it: instants of the interaction monitor are that far apart
[ns]."""


@dataclass(frozen=True)
class ReplayerConfig:
    """What is played, and how."""

    file: str = parameter("", "Bag folder, .mcap file or track file to play. Required")
    trial: int = parameter(
        -1, "Track of a track file, from 0; -1 plays the first. Bags have no trials", low=-1
    )
    place: str = parameter(
        "", "Where the recording is put: X,Y,Z,YAW in m and degrees; empty leaves it where it is"
    )
    body_id: str = parameter(
        "", "Track file: name of the body (person1 when empty). Bag: the body to play (all)"
    )
    rate: float = parameter(1.0, "Speed; 2 plays in half the time", low=0.01, high=100.0)
    loop: bool = parameter(False, "Begin again at the end")
    start: str = parameter(
        "now",
        "now: play at once; cue: play each time a cue on sim/cue says that the person moves",
        choices=("now", "cue"),
    )
    start_delay: float = parameter(
        0.5, "With start now: time that subscribers have to find the topics", unit="s", low=0.0
    )
    hold: bool = parameter(
        True,
        "Show the first pose before the start and the last one after the end, at the rate of the "
        "recording: a silent source counts as dead",
    )
    truth: bool = parameter(True, "Also publish the arms as the true ones that the scene shows")
    original_stamps: bool = parameter(
        False, "Keep the recorded stamps instead of putting them to the time of playing"
    )
    resample: float = parameter(
        0.0, "Track file: sampling rate to play at; 0 keeps the recorded one", unit="Hz", low=0.0
    )
    topics: tuple[str, ...] = parameter(
        ("",), "Bag: regular expressions of the topics to play instead of the arms; [''] for none"
    )

    def __post_init__(self) -> None:
        validate(self)


class ReplayerNode(HriNode):
    """Plays a schedule on the node's clock.

    The bodies are announced as tracked from the start and stay so when the node ends, also in order: a
    source that is gone must stop the robot, not free it.

    Raises:
        ConfigError: no file given, or a parameter that does not fit it.
        DataError: the file cannot be read or holds nothing to play.
    """

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("replayer", period_s=PERIOD_S, **kwargs)
        config = declare_config(self, ReplayerConfig)
        if not config.file:
            raise ConfigError("parameter file is empty", expected="a bag or a track file")
        self._config = config
        self.playback = load_playback(
            config.file,
            trial=None if config.trial < 0 else config.trial,
            body_id=config.body_id,
            placement=Placement.parse(config.place) if config.place else None,
            topics=[item for item in config.topics if item],
            truth=config.truth,
            resample_hz=config.resample,
        )
        self.player = Player(self.playback, rate=config.rate, loop=config.loop)
        self._first = self.playback.poses_at(end=False)
        self._last = self.playback.poses_at(end=True)
        self._period_ns = round(self.playback.period_ns / config.rate)
        self._next_hold_ns = 0
        self._begun = False
        self._played = False
        self._last_ns = 0
        self._topics = {name: self._publisher(name) for name in self.playback.types}
        self._list = TrackedList(self, self.playback.bodies)
        if config.start == "cue":
            self.listen(Cue, "sim/cue", self._on_cue, reliable(10))

    def _publisher(self, name: str) -> CountedPublisher:
        kind = message_class(self.playback.types[name])
        qos = SENSOR if kind is HumanArm else _offer(self.playback.qos.get(name, ()))
        return self.announce(kind, name, qos)

    @property
    def topics(self) -> list[str]:
        """Full names of the topics that it plays on."""
        return sorted(publisher.topic for publisher in self._topics.values())

    @property
    def finished(self) -> bool:
        """The playback has come to its end."""
        return self.player.finished

    def _on_cue(self, cue: Cue) -> None:
        if not (math.isfinite(cue.delay) and 0.0 <= cue.delay <= MAX_CUE_DELAY_S):
            self.fault("cue", f"cue with a delay of {cue.delay} s ignored")
            return
        if cue.person_target and cue.person_target != BACK:
            begin_ns = to_ns(cue.header.stamp) or self.now_ns()
            self.player.start(begin_ns + seconds_to_ns(cue.delay))

    def on_tick(self, now_ns: int) -> None:
        """Publish what is due."""
        if now_ns < self._last_ns - NANO:
            self.fault("clock", "the clock went back: the playback starts again")
            self._begun, self._next_hold_ns = False, 0
            self.player.stop()
        self._last_ns = now_ns
        self._list.say(now_ns)
        if not self._begun and self._config.start == "now" and now_ns > 0:
            self._begun = True
            start_ns = now_ns + seconds_to_ns(self._config.start_delay)
            # By whole steps of what samples at regular instants: it finds the same as in the recording.
            self.player.start(start_ns + (self.playback.first_ns - start_ns) % GRID_NS)
        for when_ns, item in self.player.due(now_ns):
            self._play(when_ns + item.lag_ns, item)
            self._next_hold_ns = when_ns + self._period_ns
            self._played = True
        if self._config.hold and (self.player.waiting or self.player.finished):
            self._hold(now_ns, self._last if self._played else self._first)

    def _hold(self, now_ns: int, poses: tuple[ScheduledArm, ...]) -> None:
        """Show a pose; the stamps go on at the pace of the recording."""
        if now_ns - self._next_hold_ns > _MAX_HELD * self._period_ns:
            self._next_hold_ns = now_ns
        start = self.player.start_ns if self.player.waiting else None
        while self._next_hold_ns <= now_ns and (start is None or self._next_hold_ns < start):
            for item in poses:
                self._play(self._next_hold_ns, item)
            self._next_hold_ns += self._period_ns

    def _play(self, stamp_ns: int, item: Scheduled) -> None:
        keep = self._config.original_stamps
        if isinstance(item, ScheduledArm):
            sample = item.sample
            if not keep:
                sample = ArmSample(stamp_ns, sample.keypoints, sample.valid, sample.side)
            self._topics[item.topic].publish(message_from_sample(sample, item.body_id))
        elif item.stamped and not keep:
            self._topics[item.topic].publish(with_stamp(item.data, stamp_ns))
        else:
            self._topics[item.topic].publish(item.data)

    def health(self) -> tuple[bytes, str, dict[str, Any]]:
        """What is played, and how far."""
        start = self.player.start_ns
        played = 0.0 if start is None else max(self._last_ns - start, 0) * self._config.rate / NANO
        length = self.playback.duration_ns / NANO
        figures = {
            "file": self._config.file,
            "played_s": f"{min(played, length):.3f}",
            "length_s": f"{length:.3f}",
            "bodies": ", ".join(self.playback.bodies),
        }
        state = "waiting" if self.player.waiting else "ended" if self.finished else "playing"
        return OK, f"{state}: {self.playback.name}", figures


def _offer(profiles: tuple[OfferedQos, ...]) -> QoSProfile:
    """The QoS of the recorded publishers; where they differ, the one that suits all subscribers."""
    best_effort = bool(profiles) and all(q.reliability == "best_effort" for q in profiles)
    latched = bool(profiles) and all(q.durability == "transient_local" for q in profiles)
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=max([10, *(qos.depth for qos in profiles)]),
        reliability=ReliabilityPolicy.BEST_EFFORT if best_effort else ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


def main(args: list[str] | None = None) -> int:
    """Play until Ctrl-C or SIGTERM."""
    return run_node(ReplayerNode, args)


if __name__ == "__main__":
    sys.exit(main())
