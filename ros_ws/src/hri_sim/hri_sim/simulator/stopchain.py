"""The stop chain: from a missing command to a robot at rest, and back.

The robot's speed is scaled by a factor 0...1 that a separation monitor (or, without one, the
planner) sends as a heartbeat. When the heartbeat is older than ``heartbeat_timeout`` during a motion,
or the new plan that the motion needs does not come within ``command_timeout``, the factor ramps to 0:
the robot stops on its path.

Should two nodes send the factor, the least counts: a second one that says 1 must not take from a monitor
what it says. Nobody can tell them apart by their messages, so the least of a ``heartbeat_timeout`` counts,
where one is set.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

from hri_prediction.config import parameter, validate
from hri_prediction.errors import DataError

COMMAND_TIMEOUT_S = 0.1
"""``command_timeout`` of launched runs [s]."""
HEARTBEAT_TIMEOUT_S = 0.032
"""``heartbeat_timeout`` of launched runs with a separation monitor [s]: four of its ticks."""
TOUCHED = "the robot touches a person"
NO_HEARTBEAT = "heartbeat of the speed scale is missing"
"""Why the chain stops when nobody sends the speed scale."""


@dataclass(frozen=True)
class StopChainConfig:
    """When and how fast the speed scale changes."""

    command_timeout: float = parameter(
        0.0,
        "Age of heartbeat or needed plan that stops a motion; 0: plain controller, never",
        unit="s",
        low=0.0,
        high=10.0,
    )
    heartbeat_timeout: float = parameter(
        0.0,
        "Age of the heartbeat that stops a motion, where command_timeout is not 0; 0: the same. The least "
        "scale within it counts. Beside a separation monitor its reaction_time is to cover it",
        unit="s",
        low=0.0,
        high=10.0,
    )
    ramp_down: float = parameter(
        0.07, "Time from full speed to rest; shorter asks more torque", unit="s", low=0.01, high=5.0
    )
    ramp_up: float = parameter(
        0.4, "Time from rest to full speed; longer resumes more gently", unit="s", low=0.01, high=10
    )

    def __post_init__(self) -> None:
        """Check the ranges."""
        validate(self)


class StopChain:
    """Ramped speed scale with watchdogs on the heartbeat and on needed replans.

    Attributes:
        scale: Factor now, 0...1.
        reason: Why it goes to (or is at) rest; empty otherwise.
    """

    def __init__(self, config: StopChainConfig | None = None) -> None:
        self._config = config or StopChainConfig()
        config = self._config
        self._timeout_ns = round(config.command_timeout * 1e9)
        self._heartbeat_timeout_ns = round(
            (config.heartbeat_timeout or config.command_timeout) * 1e9
        )
        self._window_ns = round(config.heartbeat_timeout * 1e9)
        self.reset()

    def reset(self) -> None:
        """Forget all commands: full speed asked for, no heartbeat heard."""
        self.scale = 0.0 if self._timeout_ns else 1.0
        self.reason = ""
        self._said: deque[tuple[int, float]] = deque([(0, 1.0)])
        self._heartbeat_ns: int | None = None
        self._plan_ns: int | None = None
        self._halt = False

    @property
    def halting(self) -> bool:
        """Whether :meth:`halt` is in force."""
        return self._halt

    def command(self, scale: float, now_ns: int) -> None:
        """Take one heartbeat.

        Args:
            scale: Speed scale that is asked for, 0...1.
            now_ns: Time of receipt on the controller's clock [ns].

        Raises:
            DataError: when the scale is no number in 0...1; it then counts as no heartbeat.
        """
        if not (math.isfinite(scale) and 0.0 <= scale <= 1.0):
            raise DataError(f"speed scale {scale}", expected="a number from 0 to 1")
        # Ascending: what was said before and is not less will never be the least again.
        while self._said and (self._said[-1][1] >= scale or self._said[-1][0] > now_ns):
            self._said.pop()
        self._said.append((now_ns, float(scale)))
        self._heartbeat_ns = now_ns

    def leave_out(self, time_ns: int) -> None:
        """Make all that was heard older by a time that this clock leaves out [ns]."""
        self._said = deque((came_ns - time_ns, scale) for came_ns, scale in self._said)
        if self._heartbeat_ns is not None:
            self._heartbeat_ns -= time_ns
        if self._plan_ns is not None:
            self._plan_ns -= time_ns

    def plan_received(self, now_ns: int, *, needs_replan: bool) -> None:
        """A plan took effect; with ``needs_replan`` the next must follow within the timeout."""
        self._plan_ns = now_ns if needs_replan else None
        self._halt = False

    def motion_ended(self) -> None:
        """No plan is needed any more."""
        self._plan_ns = None
        self._halt = False

    def halt(self) -> None:
        """Stop, whatever the commands, until the next plan."""
        self._halt = True

    def update(self, now_ns: int, dt: float, *, moving: bool) -> float:
        """Ramp the scale for one step.

        Args:
            now_ns: Time now [ns].
            dt: Step [s].
            moving: Whether a trajectory is active; without one the scale follows at once.

        Returns:
            The scale, 0...1.
        """
        target = self._target(now_ns)
        if not moving:
            self.scale = target
        elif target < self.scale:
            self.scale = max(target, self.scale - dt / self._config.ramp_down)
        elif target > self.scale:
            self.scale = min(target, self.scale + dt / self._config.ramp_up)
        return self.scale

    def _target(self, now_ns: int) -> float:
        self.reason = ""
        if self._halt:
            self.reason = "stop was asked for"
        elif self._timeout_ns and (
            self._heartbeat_ns is None or now_ns - self._heartbeat_ns > self._heartbeat_timeout_ns
        ):
            self.reason = NO_HEARTBEAT
        elif self._timeout_ns and (
            self._plan_ns is not None and now_ns - self._plan_ns > self._timeout_ns
        ):
            self.reason = "the new plan that the motion needs is missing"
        elif (asked := self._least(now_ns)) == 0.0:
            self.reason = "speed scale is 0"
        else:
            return asked
        return 0.0

    def _least(self, now_ns: int) -> float:
        """The least scale that was said within the heartbeat's timeout, and the last one in any case."""
        while len(self._said) > 1 and now_ns - self._said[0][0] >= self._window_ns:
            self._said.popleft()
        return self._said[0][1]
