"""Contacts of robot and person in a soak, as its bags have them: how fast the robot came at the person.

People do not see the robot here, and may reach into it. So it is not asked whether somebody was touched,
but whether the robot came at them meanwhile, of its own: while its reference moved, or until shortly after.
A robot that holds still, is pushed and swings back does not.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from hri_prediction.bags.reader import BagReader
from hri_sim.faults.own_motion import REST, SWING_S

STATES, REFERENCE = "/sim/state", "/joint_trajectory_controller/reference"
STANDS = 0.02
"""A robot that comes at somebody no faster than that stands [m/s]."""
BEFORE_S = 0.02
"""So long before a contact begins counts: the contact itself slows the robot down [s]."""
PARTS_S = 0.1
"""A contact that begins anew so soon is the same one [s]."""


@dataclass(frozen=True)
class Contact:
    """A contact from its begin to its end.

    Attributes:
        s: When it began, since the first state of all bags [s].
        seconds: How long it lasted [s].
        approach: How fast the robot came at the person at most, of its own [m/s]; negative: it went away.
            Of the parts that overlapped most, and shortly before of those that were to touch first.
        robot_part: Which part of the robot that was.
        human_part: Which of the person.
    """

    s: float
    seconds: float
    approach: float
    robot_part: str
    human_part: str


class ContactWatch:
    """Finds contacts in the states of a simulation.

    Attributes:
        contacts: Those that are over.
    """

    def __init__(self) -> None:
        self.contacts: list[Contact] = []
        self._before: deque[tuple[float, float, str, str]] = deque()
        self._moved_s = -math.inf
        self._begin_s = self._last_s = self._end_s = -math.inf
        self._most: tuple[float, str, str] | None = None

    def reference(self, time_s: float, speed: float) -> None:
        """Take the speed of the fastest joint that the controller asks for [rad/s]."""
        if speed >= REST:
            self._moved_s = time_s

    def state(
        self, time_s: float, clearance: float, approach: float, robot_part: str, human_part: str
    ) -> None:
        """Take a state.

        Args:
            time_s: When [s].
            clearance: Distance of the surfaces [m]; negative where they overlap.
            approach: How fast the robot's nearest point comes at the person's [m/s].
            robot_part: Which part of the robot that is.
            human_part: Which of the person.
        """
        if time_s < self._last_s:  # a simulation that begins anew
            self.close()
            self._before.clear()
            self._moved_s = -math.inf
        self._last_s = time_s
        own = time_s - self._moved_s <= SWING_S
        speed = approach if own else min(approach, 0.0)
        if clearance <= 0.0:
            if self._most is None:
                self._begin_s = time_s
                alike = [row for row in self._before if row[2:] == (robot_part, human_part)]
                self._most = max(
                    [(speed, robot_part, human_part), *(row[1:] for row in alike)],
                    key=lambda row: row[0],
                )
            elif speed > self._most[0]:
                self._most = (speed, robot_part, human_part)
            self._end_s = time_s
        elif time_s - self._end_s > PARTS_S:
            self.close()
        self._before.append((time_s, speed, robot_part, human_part))
        while time_s - self._before[0][0] > BEFORE_S:
            self._before.popleft()

    def close(self) -> None:
        """There are no more states: what lasts is over."""
        if self._most is not None:
            seconds = round(self._end_s - self._begin_s, 3)
            self.contacts.append(Contact(round(self._begin_s, 3), seconds, *self._most))
        self._most = None


def contacts_of(folders: Sequence[Path]) -> list[Contact]:
    """All contacts that some bags of one run have.

    Args:
        folders: Of the bags, in order.

    Raises:
        DataError: a bag cannot be read, or was recorded with other messages.
    """
    found: list[Contact] = []
    origin_ns: int | None = None
    for folder in folders:
        reader = BagReader(folder, allow_unclosed=True)
        watch = ContactWatch()
        topics = [topic for topic in (STATES, REFERENCE) if topic in reader.topics]
        for message in reader.messages(topics):
            origin_ns = message.log_time_ns if origin_ns is None else origin_ns
            time_s = (message.log_time_ns - origin_ns) * 1e-9
            content = message.decode()
            if message.topic == REFERENCE:
                watch.reference(time_s, max(map(abs, content.reference_velocity), default=0.0))
            else:
                watch.state(
                    time_s,
                    content.clearance,
                    content.approach,
                    content.robot_part,
                    content.human_part,
                )
        watch.close()
        found += watch.contacts
    return found


def harmful_above(contact_speed: float) -> float:
    """Speed at which a robot must not come at somebody whom it touches [m/s].

    Args:
        contact_speed: At which it may touch by its monitor's parameters [m/s]; 0: it is to rest.
    """
    return max(contact_speed, STANDS)
