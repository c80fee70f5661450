"""Whether what has been heard is enough to move: what is missing, too old, or must not be used."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

NANO = 1_000_000_000
STANDING_RATE = 0.01
"""A controller that runs at less than this share of full speed stands."""


@dataclass(frozen=True)
class Limits:
    """How old inputs may be.

    Attributes:
        max_joint_age_s: Older joint states, or references of the controller, count as missing [s].
        max_sample_age_s: What is heard of a person counts as missing when its newest sample is older [s].
        require_tracking: Whether nobody moves unless a source says who is tracked.
    """

    max_joint_age_s: float
    max_sample_age_s: float
    require_tracking: bool


@dataclass(frozen=True)
class Controller:
    """What the controller said last.

    Attributes:
        stamp_ns: When [ns].
        active: Whether it follows a trajectory.
        stopping: Whether it is coming to rest, or rests, on its path.
        rate: Rate at which it runs its trajectory, 0...1.
        reason: Why it stops; empty otherwise.
    """

    stamp_ns: int
    active: bool = False
    stopping: bool = False
    rate: float = 1.0
    reason: str = ""

    @property
    def stands(self) -> bool:
        """Whether a stop holds the robot at rest on its path."""
        return self.active and self.stopping and self.rate < STANDING_RATE


@dataclass(frozen=True)
class HeardPerson:
    """What is known of what was heard of a person.

    Attributes:
        stamp_ns: Capture time of its newest sample [ns].
        invalid: Whether it must not be used.
        reason: Why.
    """

    stamp_ns: int
    invalid: bool = False
    reason: str = ""


def worst_of(arms: Iterable[HeardPerson]) -> HeardPerson:
    """What is known of a person of several arms: no more than of the arm that is known least of.

    Args:
        arms: At least one.
    """
    return min(arms, key=lambda arm: (not arm.invalid, arm.stamp_ns))


@dataclass(frozen=True)
class Heard:
    """What was heard last of robot and people.

    Attributes:
        joints_ns: Stamp of the newest joint states [ns]; none before the first.
        controller: What the controller said last; none where no controller speaks.
        controller_fault: Why its newest message cannot be used; empty when it can.
        tracked: Who is tracked; none while nobody has said so.
        people: What was heard of those who are tracked, by body id.
        what: What is heard of people: predictions, or arms.
        unlisted: Why nobody knows who is tracked now; empty when that is known.
    """

    joints_ns: int | None = None
    controller: Controller | None = None
    controller_fault: str = ""
    tracked: tuple[str, ...] | None = None
    people: Mapping[str, HeardPerson] = field(default_factory=dict)
    what: str = "prediction"
    unlisted: str = ""


def joints_problem(heard: Heard, limits: Limits, now_ns: int) -> str:
    """Why nobody knows where the robot is; empty when that is known."""
    if heard.joints_ns is None:
        return "no /joint_states yet"
    age = (now_ns - heard.joints_ns) / NANO
    if age > limits.max_joint_age_s:
        return f"/joint_states are {age:.2f} s old"
    if age < -limits.max_joint_age_s:
        return f"/joint_states are stamped {-age:.2f} s in the future"
    if heard.controller is None:
        # Empty where no controller speaks: plans then begin where the joints are.
        return heard.controller_fault
    # Plans begin where the controller is: extrapolated over a stall, that is a jump.
    age = (now_ns - heard.controller.stamp_ns) / NANO
    if abs(age) > limits.max_joint_age_s:
        why = f": {heard.controller_fault}" if heard.controller_fault else ""
        return f"the controller's reference is {age:.2f} s old{why}"
    return ""


def problem(heard: Heard, limits: Limits, now_ns: int) -> str:
    """Why the robot must not move now; empty when it may."""
    unseen = joints_problem(heard, limits, now_ns)
    if unseen:
        return unseen
    if heard.tracked is None:
        return "nothing says who is tracked" if limits.require_tracking else ""
    for body_id in heard.tracked:
        person = heard.people.get(body_id)
        if person is None:
            return f"no {heard.what} of {body_id} yet"
        if person.invalid:
            return f"the {heard.what} of {body_id} is invalid: {person.reason}"
        age = (now_ns - person.stamp_ns) / NANO
        if age > limits.max_sample_age_s:
            return f"the newest sample behind the {heard.what} of {body_id} is {age:.3f} s old"
        if age < -limits.max_sample_age_s:
            return f"the {heard.what} of {body_id} is stamped {-age:.3f} s in the future"
    return heard.unlisted if limits.require_tracking else ""
