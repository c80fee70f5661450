"""A simulated person who takes the hand off a robot that rests because of it, as people do.

Simulated people do not see the robot, and rest where their reach has ended. Where that is on a robot that
has stopped for another reason, the robot would wait for the hand, and the hand for the next reach.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from hri_planner.supervision.touch import TOUCHED
from hri_prediction.ros.conversions import WORLD
from hri_prediction.ros.messages import Cue
from hri_prediction.ros.time import NANO, seconds_to_ns, to_time
from hri_sim.scenario.schema import BACK, PersonSpec, ReachSpec

PERSON = "person"
"""The node that moves simulated people on cue."""
HELD_NS = NANO
"""So long a hand that has come to rest stays on the robot before it is taken back [ns]."""
LEAD_NS = 100_000_000
"""The cue is sent so long before the hand sets out, so that it comes in time [ns]."""
SLOWEST = 1.4
"""So many times its usual duration a reach takes at most, of a person of usual variability."""


def longest_s(person: PersonSpec, duration: float) -> float:
    """How long a person's reach of a nominal duration takes at most [s]."""
    return SLOWEST ** max(person.variability, 1.0) * duration / person.speed_factor


class Withdrawing:
    """Sends hands back to where they came from, each once for each reach of it.

    Args:
        persons: Who is there; of each the arm that reaches.
        send: Publishes a cue.
        tell: Takes a line about it.

    Attributes:
        rests_ns: When the last motion that was cued is over, at the latest [ns].
    """

    def __init__(
        self,
        persons: Sequence[PersonSpec],
        send: Callable[[Cue], None],
        tell: Callable[[str], None],
    ) -> None:
        self._persons = {person.id: person for person in persons}
        self._send, self._tell = send, tell
        self._moved: dict[str, tuple[int, ReachSpec]] = {}
        self._since_ns: int | None = None
        self.rests_ns = 0

    def begin(self, number: int, reach: ReachSpec, cue_ns: int) -> None:
        """A reach begins.

        Args:
            number: As in its cue.
            reach: What it is.
            cue_ns: When it begins [ns].
        """
        self._since_ns = None
        if reach.person_target:
            name = reach.person or next(iter(self._persons))
            self._moved[name] = (number, reach)
            seconds = reach.person_delay + longest_s(self._persons[name], reach.person_duration)
            self.rests_ns = cue_ns + seconds_to_ns(seconds)

    def look(self, now_ns: int, reason: str, nearest: str) -> bool:
        """Look whether a hand is to be taken back; call it often while the robot has a goal.

        Args:
            now_ns: ROS time [ns].
            reason: Why the robot does what it does, as the node that moves it says.
            nearest: What of whom is nearest to it: ``human_part`` of SimState.

        Returns:
            Whether a person was told to, by this call.
        """
        # Of an arm that does not reach, it has the side too.
        name = nearest.rpartition("/")[0]
        if reason != TOUCHED or now_ns < self.rests_ns or name not in self._moved:
            self._since_ns = None
            return False
        if self._since_ns is None:
            self._since_ns = now_ns
        if now_ns - self._since_ns < HELD_NS:
            return False
        number, reach = self._moved.pop(name)
        self._since_ns = None
        cue = Cue(reach=number, person_target=BACK, duration=reach.person_duration)
        cue.header.stamp = to_time(now_ns + LEAD_NS)
        cue.header.frame_id = WORLD
        seconds = longest_s(self._persons[name], reach.person_duration)
        self.rests_ns = now_ns + LEAD_NS + seconds_to_ns(seconds)
        self._send(cue)
        self._tell(
            f"the hand of {name} was left on the robot, which rests for it, and is taken back"
        )
        return True
