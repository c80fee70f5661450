"""A simulated person: where the arm truly is, at any time."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from hri_prediction.arm.geometry import FloatArray
from hri_prediction.errors import PlanningError
from hri_sim.people.motion import HandMotion, Movement, draw_motion
from hri_sim.scenario.schema import PersonSpec


class SimulatedPerson:
    """A seated person who reaches from one place to the next, and rests between.

    Args:
        spec: Who it is.
        seed: Seed of the motor variability of reaches that bring no generator of their own.
    """

    def __init__(self, spec: PersonSpec, seed: int) -> None:
        self.spec = spec
        self.arm = spec.arm
        self._rng = np.random.default_rng(seed)
        self._motions: list[Movement] = []
        self._home = np.array(spec.home)

    @property
    def motions(self) -> tuple[Movement, ...]:
        """All reaches planned so far, in the order of time."""
        return tuple(self._motions)

    @property
    def rests_from_s(self) -> float:
        """When the last planned reach ends [s]; minus infinity before the first."""
        return self._motions[-1].end_s if self._motions else -math.inf

    @property
    def came_from(self) -> FloatArray:
        """Hand tip before the last planned reach (3,) [m]; where it rests, before the first."""
        last = self._motions[-1] if self._motions else None
        return last.sample(last.start_s)[0] if last else self._home

    def plan_reach(
        self,
        target: ArrayLike,
        start_s: float,
        duration: float,
        rng: np.random.Generator | None = None,
    ) -> HandMotion:
        """Add a reach after all earlier ones.

        Args:
            target: Where the hand tip is meant to go (3,) [m], world frame.
            start_s: When it begins [s].
            duration: Usual duration [s], before the person's speed factor and variability.
            rng: Draws the repetition; none: the person's own generator.

        Returns:
            The reach as it will truly happen.

        Raises:
            PlanningError: when the target is out of reach, the duration is not positive, or an
                earlier reach has not ended by then.
        """
        goal = np.array(target, dtype=float)
        if goal.shape != (3,) or not np.isfinite(goal).all():
            raise PlanningError(f"target {target!r}", expected="three finite coordinates in m")
        if not self.arm.can_reach(goal):
            low, high = self.arm.reach
            distance = float(np.linalg.norm(goal - self.spec.shoulder))
            raise PlanningError(
                f"target is {distance:.3f} m from the shoulder of {self.spec.id}",
                expected=f"{low:.3f} to {high:.3f} m",
            )
        if not duration > 0.0:
            raise PlanningError(f"duration = {duration!r} s", expected="a positive time")
        if not (math.isfinite(start_s) and start_s >= self.rests_from_s - 1e-9):
            raise PlanningError(
                f"reach of {self.spec.id} at {start_s:g} s",
                expected=f"a start after the present reach ends at {self.rests_from_s:g} s",
            )
        last = self._motions[-1] if self._motions else None
        motion = draw_motion(
            self.arm,
            last.end if last else self._home,
            goal,
            start_s=start_s,
            duration=duration / self.spec.speed_factor,
            swivel=(last.swivel[1] if last else self.spec.swivel, self.spec.swivel),
            lift=self.spec.lift,
            variability=self.spec.variability,
            rng=self._rng if rng is None else rng,
        )
        self._motions.append(motion)
        return motion

    def forget_ended(self, before_s: float) -> None:
        """Drop reaches that had ended by a time [s], but for the last: nobody asks for what was before."""
        ended = sum(motion.end_s <= before_s for motion in self._motions)
        del self._motions[: max(ended - 1, 0)]

    def divert(self, movement: Movement) -> None:
        """Let the last planned reach become another movement on its way.

        Args:
            movement: What happens instead; it begins when and where that reach does.

        Raises:
            PlanningError: when it begins at another time, or no reach is planned.
        """
        begun = self._motions[-1].start_s if self._motions else None
        if begun is None or movement.start_s != begun:
            raise PlanningError(
                f"{self.spec.id} is diverted to a movement from {movement.start_s:g} s on",
                expected="a planned reach" if begun is None else f"its last reach's {begun:g} s",
            )
        self._motions[-1] = movement

    def truth(self, t_s: ArrayLike) -> FloatArray:
        """Keypoints of the arm, without noise.

        Args:
            t_s: Times, shape (...) [s]; any time is fine, before the first reach and after the
                last one the arm rests.

        Returns:
            Shape (..., 4, 3) [m], world frame; twice continuously differentiable in time.
        """
        time = np.asarray(t_s, dtype=float)
        tip = np.broadcast_to(self._home, (*time.shape, 3))
        swivel = np.full(time.shape, self.spec.swivel)
        for motion in self._motions:
            begun = time >= motion.start_s
            if not begun.any():
                break
            new_tip, new_swivel = motion.sample(time)
            tip = np.where(begun[..., None], new_tip, tip)
            swivel = np.where(begun, new_swivel, swivel)
        return self.arm.posture(tip, swivel)


def nominal_motion_of(
    spec: PersonSpec, start: ArrayLike, target: ArrayLike, start_s: float, duration: float
) -> SimulatedPerson:
    """A person of no variability who makes one reach; for conditions and comparisons.

    Args:
        spec: Who it is; its variability and home are replaced.
        start: Hand tip before the reach (3,) [m].
        target: Hand tip after it (3,) [m].
        start_s: When it begins [s].
        duration: Usual duration [s].

    Raises:
        PlanningError: when the target is out of reach.
    """
    home = tuple(float(value) for value in np.asarray(start, dtype=float))
    person = SimulatedPerson(spec.model_copy(update={"variability": 0.0, "home": home}), seed=0)
    person.plan_reach(target, start_s, duration)
    return person
