"""Contacts between robot and person in a soak, and how fast the robot came at the person in them."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

STANDS = 0.02
"""A robot that comes at somebody no faster than that stands [m/s]."""
BEFORE = 5
"""States up to the first that has a contact of which the fastest counts: the contact itself slows it."""


@dataclass(frozen=True)
class Contact:
    """A contact that has begun.

    Attributes:
        approach: How fast the robot came at the person [m/s]; negative: it went away, or was pushed.
        robot_part: Which part of the robot.
        human_part: Which of the person.
    """

    approach: float
    robot_part: str
    human_part: str


class ContactWatch:
    """Finds where contacts begin in the states of a simulation, 4 ms apart."""

    def __init__(self) -> None:
        self._approaches: deque[float] = deque(maxlen=BEFORE)
        self._touching = False

    def hear(
        self, clearance: float, approach: float, robot_part: str, human_part: str
    ) -> Contact | None:
        """Take a state.

        Args:
            clearance: Distance of the surfaces [m]; negative where they overlap.
            approach: How fast the robot's nearest point comes at the person's [m/s].
            robot_part: Which part of the robot that is.
            human_part: Which of the person.

        Returns:
            A contact, where one begins.
        """
        self._approaches.append(approach)
        touching = clearance <= 0.0
        begins = touching and not self._touching
        self._touching = touching
        return Contact(max(self._approaches), robot_part, human_part) if begins else None


def harmful_above(contact_speed: float) -> float:
    """Speed at which a robot must not come at somebody whom it touches [m/s].

    Args:
        contact_speed: At which it may touch by its monitor's parameters [m/s]; 0: it is to rest.
    """
    return max(contact_speed, STANDS)
