"""What is played back and when: schedules made of bags and track files, without ROS."""

from __future__ import annotations

import bisect
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hri_prediction.arm.body_id import BODY_ID_RULE, valid_body_id
from hri_prediction.bags.arms import ARM_TYPE, TRACKED, TRUE, sample_of
from hri_prediction.bags.cdr import read_stamp, starts_with_stamp
from hri_prediction.bags.metadata import OfferedQos
from hri_prediction.bags.reader import BagReader
from hri_prediction.errors import ConfigError, DataError
from hri_prediction.tracks.files import load_tracks
from hri_prediction.tracks.placement import Placement
from hri_prediction.tracks.track import ArmSample, ArmTrack

TRACKED_TOPIC = "humans/bodies/{}/arm"
TRUE_TOPIC = "sim/bodies/{}/arm"
_SAME_CLOCK_NS = 60 * 10**9


@dataclass(frozen=True)
class ScheduledArm:
    """One pose of one arm.

    Attributes:
        offset_ns: When, from the start of the playback [ns].
        topic: Where.
        body_id: Whose.
        sample: The pose; its stamp is the original one.
        lag_ns: Stamp less ``offset_ns``, kept when stamps are re-based [ns].
    """

    offset_ns: int
    topic: str
    body_id: str
    sample: ArmSample
    lag_ns: int = 0

    @property
    def arm(self) -> tuple[str, str]:
        """Topic and side: both arms of a body come on one topic."""
        return self.topic, self.sample.side


@dataclass(frozen=True)
class ScheduledMessage:
    """One serialised message.

    Attributes:
        offset_ns: When, from the start of the playback [ns].
        topic: Where.
        data: CDR bytes.
        stamped: It begins with a header or a time, which is re-based.
        lag_ns: Stamp less ``offset_ns``, kept when stamps are re-based [ns].
    """

    offset_ns: int
    topic: str
    data: bytes
    stamped: bool
    lag_ns: int = 0


Scheduled = ScheduledArm | ScheduledMessage


@dataclass(frozen=True)
class Playback:
    """A schedule.

    Attributes:
        name: What is played, for people.
        items: By time.
        types: Message type of each topic.
        qos: What was offered on each topic when it was recorded; absent where not known.
        bodies: Ids of the bodies that move.
    """

    name: str
    items: tuple[Scheduled, ...]
    types: dict[str, str]
    qos: dict[str, tuple[OfferedQos, ...]]
    bodies: tuple[str, ...]

    @property
    def first_ns(self) -> int:
        """Original stamp of what is played at offset 0 [ns]; 0 without a pose."""
        poses = (item for item in self.items if isinstance(item, ScheduledArm))
        first = next(poses, None)
        return 0 if first is None else first.sample.stamp_ns - first.lag_ns - first.offset_ns

    @property
    def duration_ns(self) -> int:
        """Time of the last item [ns]."""
        return self.items[-1].offset_ns if self.items else 0

    @property
    def period_ns(self) -> int:
        """Usual time between two poses of one arm [ns]; 4 ms where there is none."""
        poses = [item for item in self.items if isinstance(item, ScheduledArm)]
        times = [item.offset_ns for item in poses if item.arm == poses[0].arm]
        return int(np.median(np.diff(times))) if len(times) > 1 else 4_000_000

    def poses_at(self, *, end: bool) -> tuple[ScheduledArm, ...]:
        """First (or last) pose of each arm on each topic, for holding still."""
        found: dict[tuple[str, str], ScheduledArm] = {}
        for item in self.items:
            if isinstance(item, ScheduledArm) and (end or item.arm not in found):
                found[item.arm] = item
        return tuple(found.values())


class Player:
    """Walks a playback along a clock.

    Args:
        playback: What to play.
        rate: Speed; 2 plays in half the time.
        loop: Begin again at the end.

    Raises:
        ConfigError: when the rate is not positive or there is nothing to play.
    """

    def __init__(self, playback: Playback, *, rate: float = 1.0, loop: bool = False) -> None:
        if not 0.01 <= rate <= 100.0:
            raise ConfigError(f"rate = {rate}", expected="a speed from 0.01 to 100")
        if not playback.items:
            raise ConfigError(f"{playback.name} holds nothing to play")
        self.playback = playback
        self._rate = rate
        self._loop = loop
        self._offsets = [item.offset_ns for item in playback.items]
        self._next = 0
        self._start_ns: int | None = None

    @property
    def start_ns(self) -> int | None:
        """When the present pass begins [ns]; None while stopped."""
        return self._start_ns

    @property
    def finished(self) -> bool:
        """Everything was played."""
        return self._start_ns is not None and self._next >= len(self._offsets)

    @property
    def waiting(self) -> bool:
        """Nothing was played yet since the start, or nothing was started."""
        return self._next == 0

    def start(self, start_ns: int) -> None:
        """Begin a playback at a time [ns], which may lie ahead; one under way ends."""
        self._start_ns = start_ns
        self._next = 0

    def stop(self) -> None:
        """Play nothing until the next start."""
        self._start_ns = None
        self._next = 0

    def due(self, now_ns: int) -> list[tuple[int, Scheduled]]:
        """Items up to now that were not handed out yet, each with its time on the clock [ns]."""
        found: list[tuple[int, Scheduled]] = []
        while self._start_ns is not None:
            elapsed = int((now_ns - self._start_ns) * self._rate)
            end = bisect.bisect_right(self._offsets, elapsed, lo=self._next)
            for item in self.playback.items[self._next : end]:
                found.append((self._start_ns + round(item.offset_ns / self._rate), item))
            self._next = end
            if end < len(self._offsets) or not self._loop:
                break
            # One period between the last and the first item, so that stamps keep increasing.
            length = self.playback.duration_ns + self.playback.period_ns
            self._start_ns += round(length / self._rate)
            self._next = 0
        return found


def load_playback(
    path: str | Path,
    *,
    trial: int | None = None,
    body_id: str = "",
    placement: Placement | None = None,
    topics: Sequence[str] = (),
    truth: bool = True,
    resample_hz: float = 0.0,
) -> Playback:
    """Schedule of a bag or of a track file; which of them it is, is found out.

    Args:
        path: Bag folder, .mcap file, or any file that
            :func:`hri_prediction.tracks.files.load_tracks` reads.
        trial: Track of the file to play, from 0 (the first when not given). Bags have no trials.
        body_id: Name of the body: ``person1`` for a track file when empty. For a bag it chooses
            one body; all when empty.
        placement: Puts the recording into the robot's world.
        topics: Only for bags: regular expressions of the topics to play instead of the arms.
        truth: Also play the poses as the true ones that the scene shows: those of the bag, else
            the tracked ones with gaps held.
        resample_hz: Only for track files: sampling rate to play at [Hz]; 0 keeps the recorded one.

    Raises:
        ConfigError: an option that does not fit the kind of file.
        DataError: the file cannot be read or holds nothing to play.
    """
    if body_id and not valid_body_id(body_id):
        raise ConfigError(f"body id {body_id!r}", expected=BODY_ID_RULE)
    path = Path(path)
    if path.suffix == ".mcap" or path.is_dir():
        if trial is not None:
            raise ConfigError(
                f"{path} is a bag: it has no trials", hint="leave the trial away, or give topics"
            )
        if resample_hz:
            raise ConfigError(f"{path} is a bag: it is played as it was recorded")
        return bag_playback(path, body_id, placement, topics, truth)
    if topics:
        raise ConfigError(f"{path} is no bag: it has no topics to choose from")
    tracks = load_tracks(path)
    number = trial or 0
    if not 0 <= number < len(tracks):
        raise ConfigError(
            f"trial {number} of {path}", expected=f"a number from 0 to {len(tracks) - 1}"
        )
    track = tracks[number]
    if resample_hz:
        track = track.resampled(resample_hz)
    return track_playback(track, body_id or "person1", placement, truth)


def track_playback(
    track: ArmTrack, body_id: str, placement: Placement | None = None, truth: bool = True
) -> Playback:
    """Schedule of one track. Keypoints that were not seen are played as not valid."""
    if placement is not None:
        track = track.transformed(placement)
    offsets = np.round((track.time_s - track.time_s[0]) * 1e9).astype(np.int64)
    names = [TRACKED_TOPIC.format(body_id)] + [TRUE_TOPIC.format(body_id)] * truth
    items: list[ScheduledArm] = []
    held = _Held()
    for offset, points, valid in zip(offsets, track.keypoints, track.valid, strict=True):
        sample = ArmSample(int(offset), points, valid, track.side)
        items.append(ScheduledArm(int(offset), names[0], body_id, sample))
        if truth and (whole := held.whole(sample)) is not None:
            items.append(ScheduledArm(int(offset), names[1], body_id, whole))
    label = " ".join(part for part in (track.subject, track.task, str(track.trial)) if part)
    return Playback(label, tuple(items), dict.fromkeys(names, ARM_TYPE), {}, (body_id,))


def bag_playback(
    path: str | Path,
    body_id: str = "",
    placement: Placement | None = None,
    topics: Sequence[str] = (),
    truth: bool = True,
) -> Playback:
    """Schedule of a bag: its arms, or the topics whose whole name one of ``topics`` matches.

    The arms alone are timed by their stamps, so that the tracking's latency is not played; chosen
    topics are timed by the times at which the recorder received them, stamps keeping their distance
    from these. The offsets count from the earliest of what is played.

    Raises:
        ConfigError: a pattern that is no regular expression.
        DataError: the bag cannot be read, or nothing in it is asked for.
    """
    bag = BagReader(path)
    wanted = _wanted_topics(bag, body_id, topics, truth)
    definitions = bag.definitions
    items: list[Scheduled] = []
    bodies: set[str] = set()
    held: dict[tuple[str, str], _Held] = {}
    true_bodies = {m["body"] for name in wanted if (m := TRUE.match(name))}
    for message in bag.messages(wanted):
        match = TRACKED.match(message.topic) or TRUE.match(message.topic)
        if message.type == ARM_TYPE and match:
            sample = _placed(sample_of(message.decode()), placement)
            when = message.log_time_ns if topics else sample.stamp_ns
            lag = _lag(sample.stamp_ns, when)
            arm = ScheduledArm(when, message.topic, match["body"], sample, lag)
            items.append(arm)
            bodies.add(arm.body_id)
            if truth and TRACKED.match(arm.topic) and arm.body_id not in true_bodies:
                whole = held.setdefault(arm.arm, _Held()).whole(sample)
                if whole is not None:
                    name = TRUE_TOPIC.format(arm.body_id)
                    items.append(replace(arm, topic=name, sample=whole))
        else:
            when = message.log_time_ns
            stamp = None
            if starts_with_stamp(definitions.get(message.type, "")):
                stamp = read_stamp(message.data)
            lag = _lag(when if stamp is None else stamp, when)
            items.append(
                ScheduledMessage(when, message.topic, message.data, stamp is not None, lag)
            )
    if not items:
        raise DataError(f"{path} holds no message of {', '.join(sorted(wanted))}")
    first = min(item.offset_ns for item in items)
    ordered = sorted(
        (replace(item, offset_ns=item.offset_ns - first) for item in items),
        key=lambda item: item.offset_ns,
    )
    types = {name: bag.topics[name].type for name in wanted}
    types |= {item.topic: ARM_TYPE for item in ordered if isinstance(item, ScheduledArm)}
    qos = {name: bag.topics[name].qos for name in wanted}
    return Playback(Path(path).name, tuple(ordered), types, qos, tuple(sorted(bodies)))


def _wanted_topics(
    bag: BagReader, body_id: str, topics: Sequence[str], truth: bool
) -> dict[str, str]:
    """Topics to play, with their types."""
    types = {name: info.type for name, info in bag.topics.items()}
    if topics:
        try:
            patterns = [re.compile(item) for item in topics]
        except re.error as error:
            raise ConfigError(f"topics = {list(topics)}: {error}") from error
        wanted = {n: t for n, t in types.items() if any(p.fullmatch(n) for p in patterns)}
        asked = ", ".join(topics)
    else:
        kinds = (TRACKED, TRUE) if truth else (TRACKED,)
        wanted = {
            name: kind
            for name, kind in types.items()
            if kind == ARM_TYPE
            for pattern in kinds
            if (match := pattern.match(name)) and body_id in ("", match["body"])
        }
        asked = TRACKED_TOPIC.format(body_id or "<id>")
    if not wanted:
        raise DataError(
            f"{bag.path} has no topic {asked}", expected="one of " + ", ".join(sorted(types))
        )
    return wanted


class _Held:
    """Makes whole poses: a keypoint that is not seen stays where it was seen last.

    A scene needs a body somewhere, also while the tracking does not see all of it.
    """

    def __init__(self) -> None:
        self._points = np.full((4, 3), np.nan)

    def whole(self, sample: ArmSample) -> ArmSample | None:
        """The pose with all keypoints; None until each was seen once."""
        self._points[sample.valid] = sample.keypoints[sample.valid]
        if np.isnan(self._points).any():
            return None
        return replace(sample, keypoints=self._points, valid=np.ones(4, dtype=bool))


def _lag(stamp_ns: int, when_ns: int) -> int:
    """Distance of a stamp from the log time; none where the two are of different clocks."""
    lag = stamp_ns - when_ns
    return lag if abs(lag) < _SAME_CLOCK_NS else 0


def _placed(sample: ArmSample, placement: Placement | None) -> ArmSample:
    if placement is None:
        return sample
    return replace(sample, keypoints=placement.apply(sample.keypoints))
