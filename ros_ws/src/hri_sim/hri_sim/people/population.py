"""Simulated people to evaluate a predictor on; none of them moves as the predictor's models do.

`matched` people move like those of the simulator (:mod:`.motion`): a minimum-jerk line with a lift and
a bow, scattered in end point, duration and swivel. The other families depart from what was learnt
from them:

* `other_lengths`: limbs 15 % shorter or longer than anybody's among the matched,
* `via_points`: two overlapping minimum-jerk movements (Flash & Henis 1991), the first towards a point
  aside of and above the way, so that the path is bent and the speed has two peaks,
* `changed_mind`: towards one target, and from 30-50 % of that movement on to another one, by which the
  reach is named (also two superposed movements, Flash & Henis 1991),
* `minimum_jerk`: the plain straight line, without lift or bow, that people do not follow.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from hri_prediction.arm.geometry import FloatArray
from hri_prediction.errors import ConfigError
from hri_prediction.geometry.minimum_jerk import minimum_jerk
from hri_prediction.tracks.segmentation import Reach
from hri_prediction.tracks.track import ArmTrack
from hri_sim.people.changes import change_mind
from hri_sim.people.motion import HandMotion, draw_motion
from hri_sim.people.seeding import population_generator
from hri_sim.people.tracking import SAMPLE_PERIOD_NS, TrackingModel
from hri_sim.people.training import REST_S
from hri_sim.scenario.schema import PersonSpec

FAMILIES = ("matched", "other_lengths", "via_points", "changed_mind", "minimum_jerk")
TARGETS: dict[str, tuple[float, float, float]] = {
    "near_side": (0.45, 0.32, 0.20),
    "middle": (0.38, 0.15, 0.15),
    "far_side": (0.38, -0.15, 0.15),
    "raised": (0.42, -0.02, 0.30),
}
"""Where hands reach to [m], world frame; anybody's arm gets there."""
DURATIONS_S = (0.8, 1.5)
"""Range of the usual durations [s]."""
_START_SCATTER_M = 0.01

HandPath = Callable[[FloatArray], tuple[FloatArray, FloatArray]]
"""Times (n,) [s] to hand tips (n, 3) [m] and swivels (n,) [rad]."""


@dataclass(frozen=True, eq=False)
class SimulatedReach:
    """One recorded reach.

    Attributes:
        track: What the tracking system delivered, 0.3 s of rest on both sides.
        truth: When the reach truly began and ended.
    """

    track: ArmTrack
    truth: Reach


def draw_person(family: str, name: str, seed: int) -> PersonSpec:
    """A person of a family: lengths, seat, habits.

    Raises:
        ConfigError: for an unknown family.
    """
    if family not in FAMILIES:
        raise ConfigError(f"people = {family!r}", expected="one of " + ", ".join(FAMILIES))
    rng = population_generator(seed, name, 0)
    size = 1.0 + 0.03 * float(np.clip(rng.standard_normal(), -2.0, 2.0))
    if family == "other_lengths":
        size *= float(rng.choice([0.85, 1.15]))
    usual = PersonSpec()
    seat = np.array(usual.shoulder) + rng.uniform(-0.02, 0.02, 3)
    return PersonSpec(
        id=name,
        shoulder=(float(seat[0]), float(seat[1]), float(seat[2])),
        upper_arm=usual.upper_arm * size,
        forearm=usual.forearm * size,
        hand=usual.hand * size,
        speed_factor=float(rng.uniform(0.9, 1.1)),
        swivel=float(rng.uniform(0.1, 0.4)),
        lift=float(rng.uniform(0.08, 0.25)),
    )


def _by_way_of(motion: HandMotion, rng: np.random.Generator) -> HandPath:
    """Two overlapping movements: towards a point off the way, and from 30 % of the time on to the end."""
    way = motion.end - motion.start
    length = float(np.linalg.norm(way))
    aside = np.array([-way[1], way[0], 0.0]) / max(float(np.linalg.norm(way[:2])), 1e-9)
    off = 0.12 * (1.0 + 0.2 * rng.standard_normal(2)) * length
    via = motion.start + 0.4 * way + off[0] * aside + off[1] * np.array([0.0, 0.0, 1.0])

    def path(times: FloatArray) -> tuple[FloatArray, FloatArray]:
        tau = (times - motion.start_s) / motion.duration
        first, second = minimum_jerk(tau / 0.65), minimum_jerk((tau - 0.3) / 0.7)
        tip = motion.start + first[:, None] * (via - motion.start)
        return tip + second[:, None] * (motion.end - via), motion.sample(times)[1]

    return path


def record_reach(
    spec: PersonSpec, family: str, task: str, trial: int, rng: np.random.Generator
) -> SimulatedReach:
    """Draw one reach of a person and track it at 250 Hz, time 0 at the true onset.

    Args:
        spec: Who reaches.
        family: How the hand moves, one of `FAMILIES`.
        task: Key of `TARGETS`; where the hand arrives.
        trial: Number that the track carries.
        rng: Source of all randomness.
    """
    start = np.array(spec.home) + _START_SCATTER_M * rng.standard_normal(3)
    usual_s = float(rng.uniform(*DURATIONS_S)) / spec.speed_factor
    changes = family == "changed_mind"
    target = str(rng.choice([t for t in TARGETS if t != task])) if changes else task
    motion = draw_motion(
        spec.arm,
        start,
        np.array(TARGETS[target]),
        start_s=0.0,
        duration=usual_s,
        swivel=(spec.swivel, spec.swivel),
        lift=spec.lift,
        variability=spec.variability,
        rng=rng,
    )
    path: HandPath = motion.sample
    duration = motion.duration
    if changes:
        changed = change_mind(spec, motion, TARGETS[task], usual_s, rng)
        path, duration = changed.sample, changed.duration
    elif family == "via_points":
        path = _by_way_of(motion, rng)
    elif family == "minimum_jerk":
        path = replace(motion, bow=np.zeros(3)).sample
    rest = round(REST_S * 1e9) // SAMPLE_PERIOD_NS
    count = 2 * rest + int(duration * 1e9) // SAMPLE_PERIOD_NS + 1
    stamps = SAMPLE_PERIOD_NS * (np.arange(count) - rest)
    times: FloatArray = np.asarray(1e-9 * stamps, dtype=float)
    truth = spec.arm.posture(*path(times))
    model = TrackingModel(spec, rng)
    samples = [
        model.observe(int(stamp), points).sample
        for stamp, points in zip(stamps, truth, strict=True)
    ]
    track = ArmTrack(
        time_s=times,
        keypoints=np.stack([sample.keypoints for sample in samples]),
        side=spec.side,
        subject=spec.id,
        task=task,
        trial=trial,
        source=f"simulated, {family}",
    )
    return SimulatedReach(track, Reach(0.0, duration))


def population(family: str, people: int, repetitions: int, seed: int) -> list[SimulatedReach]:
    """Reaches of several people of a family to all targets.

    Args:
        family: One of `FAMILIES`.
        people: Number of persons.
        repetitions: Reaches to each target.
        seed: Equal seeds give equal people and reaches, whatever their number.
    """
    reaches = []
    for person in range(people):
        spec = draw_person(family, f"{family}{person + 1}", seed)
        for number in range(repetitions):
            for place, task in enumerate(TARGETS):
                index = 1 + number * len(TARGETS) + place
                rng = population_generator(seed, spec.id, index)
                reaches.append(record_reach(spec, family, task, number, rng))
    return reaches
