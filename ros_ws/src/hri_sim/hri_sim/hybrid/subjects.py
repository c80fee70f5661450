"""Simulated people for the hybrid predictor: each strays from the optimum of a model in ways of their own.

A person's mean path is the optimum of their own weights (or something else altogether, as the family says),
5 % larger or smaller than measured lengths say, 4 cm aside of where the shoulder is taken to be, and drifts
off by 4 cm until its end, as a trunk does that goes along; each reach strays from that path by 12 mm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import ConfigError
from hri_prediction.geometry.minimum_jerk import minimum_jerk
from hri_prediction.hybrid.body import CONVENTION, BodyArm
from hri_prediction.hybrid.person import Rest, SeenReach
from hri_prediction.motor_control import design
from hri_prediction.motor_control.arm_model import ArmModel
from hri_prediction.motor_control.law import FEATURES, WeightLaw
from hri_prediction.motor_control.ocp import NotConverged, ReachSolver
from hri_prediction.motor_control.problem import ReachProblem
from hri_prediction.motor_control.scaling import scaling_of
from hri_sim.motor_control.people import draw_people

Array = NDArray[np.float64]

FAMILIES = ("optimal", "other_lengths", "via_points", "minimum_jerk", "other_laws")
HAVE_TRUTH = ("optimal", "other_lengths", "other_laws")
"""Families whose mean paths are an optimum, but for how people stray. Others have no true weights."""
START = 4
"""P6 of the thesis' twelve start postures: the hand low before the body."""
TARGETS = (0, 2, 6, 8)
"""T1, T3, T7 and T9: the corners of the board."""
OFFSET_M, DRIFT_M, SCALE = 0.04, 0.04, 0.05
VARIABILITY_M = 0.012
"""Root mean square distance of reaches from their mean path."""
POINTS = 61
_SMOOTH = 0.3
"""Phase over which a reach strays alike."""
_COUPLING = 0.7
_PACE_LOG_SD = 0.1
_HAND_M = 0.08
_FACING_RAD = 0.5 * np.pi
_VIA_M = 0.05
"""How far `via_points` go round."""
_OTHER = 0.15
"""By how much the arms of `other_lengths` are longer or shorter than they seem."""
_CONCENTRATION = 2.0
"""Of weights of `other_laws`: far from the mean of all people, but seldom of one cost alone."""
_ATTEMPTS = 5
_PHASES = np.linspace(0.0, 1.0, POINTS)


@dataclass(frozen=True, eq=False)
class Habit:
    """How a person reaches for one target.

    Attributes:
        tip: Where the target is (3,) [m], from where the shoulder is taken to be.
        alpha: Weights (n,) of the optimum that the path was made of; true ones in `HAVE_TRUTH`.
        mean: Elbow and wrist (POINTS, 6) [m] of the mean path, likewise.
        duration_s: Usual, between the crossings of the onset speed.
    """

    tip: Array
    alpha: Array
    mean: Array
    duration_s: float


@dataclass(frozen=True, eq=False)
class Subject:
    """A simulated person.

    Attributes:
        name: Of the person.
        family: How they move.
        body: Their arm as it is measured.
        costs: What weights are of (n,).
        habits: By name of the target.
    """

    name: str
    family: str
    body: BodyArm
    costs: tuple[str, ...]
    habits: dict[str, Habit]

    @property
    def rest(self) -> Rest:
        """The arm before a reach, the shoulder in the origin."""
        start = np.mean([habit.mean[0] for habit in self.habits.values()], axis=0)
        points = np.zeros((4, 3))
        points[1], points[2] = start[:3], start[3:]
        points[3] = _tip(start, self.body)
        return Rest(self.body, points)

    def reach(self, target: str, rng: np.random.Generator, variability_m: float) -> SeenReach:
        """One reach for a target."""
        habit = self.habits[target]
        values = habit.mean + stray(rng, variability_m)
        duration = habit.duration_s * float(np.exp(rng.normal(0.0, _PACE_LOG_SD)))
        return SeenReach(
            self.body, _PHASES, values, np.zeros(3), _tip(values[0], self.body), habit.tip, duration
        )


def _tip(elbow_wrist: Array, body: BodyArm) -> Array:
    forearm = elbow_wrist[3:] - elbow_wrist[:3]
    found: Array = elbow_wrist[3:] + forearm * (body.hand_m / float(np.linalg.norm(forearm)))
    return found


def stray(rng: np.random.Generator, variability_m: float) -> Array:
    """How one reach strays from its mean path: elbow and wrist (POINTS, 6) [m], smooth over the phase."""
    gap = _PHASES[:, None] - _PHASES[None, :]
    kernel = np.exp(-0.5 * (gap / _SMOOTH) ** 2) + 1e-9 * np.eye(POINTS)
    drawn = np.linalg.cholesky(kernel) @ rng.standard_normal((POINTS, 6))
    wrist = drawn[:, 3:]
    elbow = _COUPLING * wrist + np.sqrt(1.0 - _COUPLING**2) * drawn[:, :3]
    found: Array = variability_m / np.sqrt(3.0) * np.hstack([elbow, wrist])
    return found


def draw_subjects(count: int, family: str, rng: np.random.Generator) -> list[Subject]:
    """Draw people of a family.

    Raises:
        ConfigError: there is no such family.
        NotConverged: no optimum was found for a person's reach.
    """
    if family not in FAMILIES:
        raise ConfigError(f"people {family!r}", expected="one of " + ", ".join(FAMILIES))
    laws = [each.law for each in draw_people(count, rng, design.STARTS_12_DEG)]
    return [_drawn(f"S{i + 1}", family, law, rng) for i, law in enumerate(laws)]


def _same_everywhere(names: tuple[str, ...], rng: np.random.Generator) -> WeightLaw:
    """Weights that do not ask for the posture, drawn with no regard to how people weigh costs."""
    alpha = rng.dirichlet(np.full(len(names), _CONCENTRATION))
    chosen = names.index("joint_jerk")
    theta = np.zeros((len(names) - 1, len(FEATURES)))
    theta[:, 0] = np.log(np.delete(alpha, chosen) / alpha[chosen])
    return WeightLaw(names, theta)


def _drawn(name: str, family: str, law: WeightLaw, rng: np.random.Generator) -> Subject:
    """A person; drawn anew where no optimum is found for one of the reaches."""
    for attempt in range(_ATTEMPTS):
        own = _same_everywhere(law.names, rng) if family == "other_laws" else law
        try:
            return _subject(name, family, own, rng)
        except NotConverged:
            if attempt == _ATTEMPTS - 1:
                raise
    raise AssertionError("there is one attempt at least")


def _subject(name: str, family: str, law: WeightLaw, rng: np.random.Generator) -> Subject:
    height, mass = rng.normal(1.72, 0.05), max(rng.normal(67.0, 9.0), 45.0)
    seen = ArmModel.of_body(float(height), float(mass), convention=CONVENTION)
    size = 1.0 + float(rng.choice([-_OTHER, _OTHER])) if family == "other_lengths" else 1.0
    true = ArmModel.of_body(
        float(height),
        float(mass),
        upper_m=size * seen.upper_m,
        forearm_m=size * seen.forearm_m,
        convention=CONVENTION,
    )
    body = BodyArm(seen, _HAND_M, _FACING_RAD, "right")
    inside = BodyArm(true, _HAND_M, _FACING_RAD, "right")
    solver = ReachSolver(true)
    offset, drift = (_direction(rng) * size_m for size_m in (OFFSET_M, DRIFT_M))
    scale = 1.0 + float(rng.choice([-SCALE, SCALE]))
    turned = np.radians(rng.normal(0.0, 4.0, 3))
    q_start = np.radians(design.STARTS_12_DEG[START]) + turned
    habits = {}
    for index in TARGETS:
        q_end = np.radians(design.TARGETS_DEG[index] + rng.normal(0.0, 4.0, 3))
        alpha = law.alpha(q_start, q_end)
        duration = float(design.DURATIONS_S[index] * np.exp(rng.normal(0.0, 0.15)))
        path = _mean(inside, solver, family, q_start, q_end, duration, alpha, law.names, rng)
        rise = minimum_jerk(_PHASES)[:, None]
        strayed = scale * path + np.tile(offset, 2) + rise * np.tile(drift, 2)
        # Where the target is in the world is known, and so from where the shoulder is taken to be; nobody
        # tells that people end beside it.
        long = BodyArm(
            ArmModel.of_body(
                upper_m=true.upper_m, forearm_m=true.forearm_m + _HAND_M, convention=CONVENTION
            ),
            0.0,
            _FACING_RAD,
            "right",
        )
        tip = long.positions(q_end[None])[0, 3:] + offset
        habits[f"T{index + 1}"] = Habit(tip, alpha, strayed, 0.9 * duration)
    return Subject(name, family, body, law.names, habits)


def _mean(
    body: BodyArm,
    solver: ReachSolver,
    family: str,
    q_start: Array,
    q_end: Array,
    duration_s: float,
    alpha: Array,
    names: tuple[str, ...],
    rng: np.random.Generator,
) -> Array:
    """Elbow and wrist (POINTS, 6) of the mean path of a family, before it strays."""
    problem = ReachProblem.at_rest(q_start, q_end, duration_s)
    phases = 0.05 + 0.9 * _PHASES
    try:
        motion = solver.solve(problem, scaling_of(solver, problem).weights(alpha, names))
    except NotConverged:
        if family != "minimum_jerk":
            raise
        motion = None
    if family == "minimum_jerk" or motion is None:
        ends = body.positions(np.stack([q_start, q_end]))
        return np.asarray(ends[0] + minimum_jerk(phases)[:, None] * (ends[1] - ends[0]))
    path = body.positions(motion.angles(phases))
    if family == "via_points":
        bump = np.sin(np.pi * _PHASES[:, None]) ** 2
        path = path + bump * np.tile(_VIA_M * _direction(rng), 2)
    return path


def _direction(rng: np.random.Generator) -> Array:
    drawn = rng.standard_normal(3)
    found: Array = drawn / np.linalg.norm(drawn)
    return found
