"""Live motion capture node: arms from Qualisys Track Manager, on the topics of every other source."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import Any

from hri_prediction.arm.body_id import BODY_ID_RULE, valid_body_id
from hri_prediction.arm.geometry import SIDES
from hri_prediction.config import parameter, validate
from hri_prediction.errors import ConfigError, HriError
from hri_prediction.live.arm_stream import ArmStream, LiveBody, MarkerLayout
from hri_prediction.live.qtm import QtmFrame
from hri_prediction.live.qtm_client import QtmClient
from hri_prediction.live.stream_clock import StreamClock
from hri_prediction.ros.conversions import message_from_sample
from hri_prediction.ros.messages import HumanArm
from hri_prediction.ros.node import ERROR, OK, CountedPublisher, HriNode, run_node
from hri_prediction.ros.parameters import declare_config
from hri_prediction.ros.qos import SENSOR
from hri_prediction.ros.time import seconds_to_ns
from hri_prediction.ros.tracked import TrackedList
from hri_prediction.tracks.importers.axes import parse_axes
from hri_prediction.tracks.placement import Placement

PERIOD_S = 0.004
"""How often frames that have come are published [s]."""


@dataclass(frozen=True)
class MocapLiveConfig:
    """Where the stream comes from, and which arms are in it."""

    host: str = parameter("127.0.0.1", "Computer that QTM runs on")
    port: int = parameter(22223, "Port of QTM's real-time server, little-endian", low=1, high=65535)
    rate: int = parameter(
        0, "Frames a second that QTM is asked for; 0 for all of the measurement", unit="Hz", low=0
    )
    silence: float = parameter(
        1.0, "Without a frame for so long the connection is made anew", unit="s", low=0.1, high=60.0
    )
    latency: float = parameter(
        0.0,
        "What the fastest frame takes from exposure to arrival; QTM shows its part as latency",
        unit="s",
        low=0.0,
        high=0.2,
    )
    bodies: tuple[str, ...] = parameter(
        ("person1",), "Body id of each arm to be followed; for both arms of a body twice the same"
    )
    maps: tuple[str, ...] = parameter(
        ("",),
        "Markers of each arm, as import_mocap.py --map takes them: shoulder=A,elbow=B,wrist=C+D"
        "[,hand_tip=E]; empty: guessed from the names",
    )
    sides: tuple[str, ...] = parameter(
        ("",), "left or right for each arm; empty where the names of its markers tell"
    )
    accept_guess: bool = parameter(
        False, "Publish with guessed markers; otherwise the guess is only reported"
    )
    axes: str = parameter(
        "auto", "Axes of QTM: auto (as it says), x-up, y-up, z-up, or those behind x,y,z: x,-z,y"
    )
    place: str = parameter(
        "",
        "Laboratory in the world: X,Y,Z,YAW in m and degrees; empty where QTM was calibrated so that "
        "its frame is the world's",
    )

    def __post_init__(self) -> None:
        validate(self)
        named = all(valid_body_id(body) for body in self.bodies)
        if not (self.bodies and named):
            raise ConfigError(f"bodies = {list(self.bodies)}", expected=f"names of {BODY_ID_RULE}")
        for name in ("maps", "sides"):
            values = getattr(self, name)
            if len(values) != len(self.bodies) and any(values):
                raise ConfigError(
                    f"{name} has {len(values)} entries", expected=f"{len(self.bodies)}, as bodies"
                )
        if len(self.bodies) > 1 and not (self.maps and all(self.maps)):
            raise ConfigError("several bodies need maps", expected="one mapping for each body")
        for body in set(self.bodies):
            arms = [index for index, other in enumerate(self.bodies) if other == body]
            sides = [self.sides[index] for index in arms] if any(self.sides) else []
            if len(arms) > 1 and sorted(sides) != list(SIDES):
                raise ConfigError(
                    f"bodies = {list(self.bodies)} with sides = {list(self.sides)}",
                    expected="different bodies, or left and right as the sides of one named twice",
                )

    def live_bodies(self) -> list[LiveBody]:
        """The arms to be followed.

        Raises:
            ConfigError: when a mapping or a side is malformed.
        """
        empty = ("",) * len(self.bodies)
        maps = self.maps if any(self.maps) else empty
        sides = self.sides if any(self.sides) else empty
        return [LiveBody(*each) for each in zip(self.bodies, maps, sides, strict=True)]


class MocapLiveNode(HriNode):
    """Publishes each frame once, stamped with its capture time.

    The bodies are announced as tracked from the start and stay so: that nobody is seen, or that the
    stream is lost, must stop the robot, not free it.

    Raises:
        ConfigError: a parameter is unusable, the time is a simulation's, or qtm-rt is not installed.
    """

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("mocap_live", period_s=PERIOD_S, **kwargs)
        config = declare_config(self, MocapLiveConfig)
        if self.lockstep or self.get_parameter("use_sim_time").value:
            raise ConfigError(
                "live motion capture has the time of the day, not that of a simulation",
                hint="leave use_sim_time away; in lock-step, take the replayer",
            )
        self._config = config
        self._bodies = config.live_bodies()
        self._placement = Placement.parse(config.place) if config.place else Placement()
        if config.axes.strip().lower() != "auto":
            parse_axes(config.axes)
        self._layout: MarkerLayout | None = None
        self._stream: ArmStream | None = None
        self._problem = ""
        self._capture_clock = StreamClock(seconds_to_ns(config.latency))
        self._number: int | None = None
        self._lost = 0
        self._skipped = 0
        self._delay_ns = 0
        self._arms: dict[str, CountedPublisher] = {
            body: self.announce(HumanArm, f"humans/bodies/{body}/arm", SENSOR)
            for body in dict.fromkeys(config.bodies)
        }
        self._list = TrackedList(self, self._arms)
        self._client = QtmClient(
            config.host,
            config.port,
            rate_hz=config.rate,
            silence_s=config.silence,
            clock=self.now_ns,
        )

    def on_tick(self, now_ns: int) -> None:
        """Publish the frames that have come."""
        self._list.say(now_ns)
        for frame in self._client.take():
            if frame.layout is not self._layout:
                self._begin(frame.layout)
            self._publish(frame)
        # The first attempt, while it lasts, is no fault.
        problem = self._stream_problem()
        if problem and (self._client.failures or not self._client.alive):
            self.fault("stream", problem, ERROR)
        if self._problem:
            self.fault("markers", self._problem, ERROR)

    def _stream_problem(self) -> str:
        """Why no frames come; empty while they do."""
        if not self._client.alive:
            return "what receives from QTM has ended; start this node again"
        return self._client.problem

    def _begin(self, layout: MarkerLayout) -> None:
        """A stream begins, perhaps with other markers."""
        self._layout, self._stream, self._problem, self._number = layout, None, "", None
        self._capture_clock.restart()
        try:
            self._stream = ArmStream(
                layout,
                self._bodies,
                self._placement,
                axes=self._config.axes,
                accept_guess=self._config.accept_guess,
            )
        except HriError as error:
            self._problem = str(error)
            return
        log = self.get_logger()
        rate = f" at {layout.rate_hz:g} Hz" if layout.rate_hz else ""
        log.info(f"QTM streams {len(layout.names)} markers{rate}; {self._stream.axes.why}")
        for arm, text in self._stream.mappings.items():
            log.info(f"{arm}: {text}")

    def _publish(self, frame: QtmFrame) -> None:
        if self._number is not None and self._number < frame.number and not self._config.rate:
            self._lost += frame.number - self._number - 1
        self._number = frame.number
        if self._stream is None:
            return
        stamp_ns = self._capture_clock.stamp(frame.source_ns, frame.received_ns)
        if stamp_ns is None:
            self._skipped += 1
            return
        self._delay_ns = frame.received_ns - stamp_ns
        for body, sample in self._stream.samples(frame.positions, stamp_ns):
            self._arms[body].publish(message_from_sample(sample, body))

    def close(self) -> None:
        """End the connection."""
        self._client.close()

    def health(self) -> tuple[bytes, str, dict[str, Any]]:
        """Whether frames come, from where, and how late."""
        figures = {
            "source": f"{self._config.host}:{self._config.port}",
            "streams": self._client.connections,
            "clock restarts": self._capture_clock.restarts,
            "frames lost": self._lost,
            "frames skipped": self._skipped,
            "delay_ms": f"{self._delay_ns / 1e6:.3f}",
        }
        if self._stream is not None:
            figures |= self._stream.mappings
        problem = self._stream_problem() or self._problem
        return (ERROR, problem, figures) if problem else (OK, "streaming", figures)


def main(args: list[str] | None = None) -> int:
    """Publish until Ctrl-C or SIGTERM."""
    return run_node(MocapLiveNode, args)


if __name__ == "__main__":
    sys.exit(main())
