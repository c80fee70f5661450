"""How exactly movement primitives take on what they are shown."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_planner.dmp.policy import PERIOD_S
from hri_planner.dmp.response import response
from hri_prediction.geometry.minimum_jerk import minimum_jerk
from hri_sim.people.person import SimulatedPerson
from hri_sim.readability.participant import PER_METRE_S, USUAL_S, participant_spec
from hri_sim.readability_report.cases import END_EFFECTOR, A

FloatArray = NDArray[np.float64]
Path = Callable[[FloatArray], FloatArray]
"""Times (n,) [s] to places (n, 3) [m]."""

COUNT, SMOKE_COUNT = 40, 3
"""Demonstrations of each kind."""
KINDS = {
    "straight": "minimum jerk, straight",
    "curved": "minimum jerk with a bow",
    "s-shaped": "minimum jerk with a bow to either side",
    "hand": "simulated people's hands: lifted, bowed and scattered",
}
_DURATIONS_S = (0.8, 3.0)
_LENGTHS_M = (0.2, 0.8)
_BOW = (0.1, 0.35)
"""Bows as a share of the length of the way."""
_STREAM = 71


def imitation(smoke: bool) -> dict[str, Any]:
    """Root mean square distance [mm] of motions from demonstrations, of each kind."""
    rng = np.random.default_rng(_STREAM)
    found = {}
    for kind in KINDS:
        count = SMOKE_COUNT if smoke else COUNT
        errors = [_error_mm(*_demonstration(kind, rng)) for _ in range(count)]
        found[kind] = {
            "count": count,
            "median_mm": float(np.median(errors)),
            "max_mm": max(errors),
        }
    return found


def _demonstration(kind: str, rng: np.random.Generator) -> tuple[Path, float]:
    if kind == "hand":
        return _hand_path(rng)
    return drawn_path(kind, rng), float(rng.uniform(*_DURATIONS_S))


def _error_mm(path: Path, duration: float) -> float:
    fitted = response(duration, PERIOD_S)
    shown = path(np.minimum(fitted.times / duration, 1.0))
    made = fitted.rollouts(shown[0], shown[-1], fitted.fit(shown))
    return 1e3 * float(np.sqrt(np.mean(np.sum((made - shown) ** 2, axis=1))))


def drawn_path(kind: str, rng: np.random.Generator) -> Path:
    """Shares of the time (n,) to places (n, 3) [m] of a drawn way."""
    start = rng.uniform((0.3, -0.4, 0.1), (0.6, 0.4, 0.4))
    heading, aside = np.linalg.qr(rng.standard_normal((3, 2)))[0].T
    length = rng.uniform(*_LENGTHS_M)
    bow = 0.0 if kind == "straight" else length * rng.uniform(*_BOW)
    turns = 2.0 if kind == "s-shaped" else 1.0

    def path(share: FloatArray) -> FloatArray:
        way = minimum_jerk(share)[:, None]
        return np.asarray(
            start + length * way * heading + bow * np.sin(turns * np.pi * way) * aside
        )

    return path


def _hand_path(rng: np.random.Generator) -> tuple[Path, float]:
    """A reach of who takes part in the experiments, to one of their targets; its duration [s]."""
    experiments = [case.experiment(False) for case in (A, END_EFFECTOR)]
    targets = [place for one in experiments for place in one.targets.values()]
    person = SimulatedPerson(participant_spec(), 0)
    target = targets[rng.integers(len(targets))]
    way = float(np.linalg.norm(target - np.array(person.spec.home)))
    motion = person.plan_reach(target, 0.0, USUAL_S + PER_METRE_S * way, rng)
    return lambda share: motion.sample(share * motion.duration)[0], motion.duration


def lines(found: Mapping[str, Any]) -> list[list[str]]:
    """Rows of a table: kind, number, median and largest error."""
    return [
        [KINDS[kind], str(one["count"]), f"{one['median_mm']:.3f}", f"{one['max_mm']:.3f}"]
        for kind, one in found.items()
    ]
