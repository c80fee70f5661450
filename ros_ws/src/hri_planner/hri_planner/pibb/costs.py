"""What a trial costs: how smoothly the robot moved, and how soon and how rightly a person read it.

The thesis's section 7.3.5 and table 7.2. Each term is divided by what it is for the initial policy, so
that weights compare terms of different units. What the robot's motion costs is bounded besides, by twice
that: a roll-out that had to dodge a hand, and jerks tenfold, would else be all that an update sees.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields

import numpy as np
from numpy.typing import NDArray

from hri_prediction.config import parameter, validate
from hri_prediction.errors import ConfigError, DataError

FloatArray = NDArray[np.float64]

_WINDOW_S = 0.1
"""Derivatives are those of polynomials fitted over so long: recorded joints are noisy [s]."""
_DEGREE = 4
DISTINCT_STEP_S = 0.02
"""Time step of the distinctness; a smaller one would count the begin for more [s]."""
DEVIATION_M2 = 0.02**2
"""What deviations from the policy's own way are compared with: straight ways have none [m²]."""


@dataclass(frozen=True)
class Terms:
    """Of one trial.

    Attributes:
        tool_jerk: Time integral of the tool's squared jerk [m²/s⁵].
        joint_jerk: Time integral of the joints' squared jerk [rad²/s⁵].
        prediction_time: From the robot's start until the person has shown which goal it is [s].
        task: 0 when that was right, 1 when it was wrong.
        deviation: Mean square distance of the executed way from that of the policy [m²].
        human_duration: How long the person's hand took to its target [s]; 0 where it does not move.
        indistinct: How like the way is to those to other goals (eq. 7.19) [1/m].
    """

    tool_jerk: float
    joint_jerk: float
    prediction_time: float
    task: float
    deviation: float
    human_duration: float
    indistinct: float

    def check(self) -> None:
        """Check that all are numbers that a cost can be.

        Raises:
            DataError: naming those that are not.
        """
        bad = [f"{name} = {v}" for name, v in asdict(self).items() if not 0.0 <= v < np.inf]
        if bad:
            raise DataError(
                f"costs of the trial: {', '.join(bad)}", expected="finite numbers, not negative"
            )


TERM_NAMES = tuple(own.name for own in fields(Terms))
BOUNDED = ("tool_jerk", "joint_jerk", "deviation", "indistinct")
"""Terms r in units of the initial policy's that count 2 r / (1 + r): 1 there, and never more than 2."""


@dataclass(frozen=True)
class CostWeights:
    """Weights of the terms, as in table 7.2.

    Raises:
        ConfigError: when one is negative or not finite, or all are zero.
    """

    tool_jerk: float = parameter(1.0, "Weight of the tool's jerk", low=0.0)
    joint_jerk: float = parameter(1.0, "Weight of the joints' jerk", low=0.0)
    prediction_time: float = parameter(10.0, "Weight of the person's time", low=0.0)
    task: float = parameter(20.0, "Weight of a wrong guess", low=0.0)
    deviation: float = parameter(2.0, "Weight of what avoiding people changed", low=0.0)
    human_duration: float = parameter(1.0, "Weight of the duration of the hand's motion", low=0.0)
    indistinct: float = parameter(3.0, "Weight of likeness to other goals' ways", low=0.0)

    def __post_init__(self) -> None:
        """Check the values."""
        validate(self)
        if not any(asdict(self).values()):
            raise ConfigError("all weights of costs are 0", expected="at least one above")


END_EFFECTOR = CostWeights(1.0, 2.0, 4.0, 20.0, 2.0, 0.0, 3.0)
"""Of the thesis's preliminary experiment, end-effector control."""
JOINT = CostWeights(1.0, 1.0, 10.0, 2.0, 10.0, 1.0, 0.0)
"""Of its joint control and transfer: a guess that is fast and wrong is cheap here."""
BALANCED = CostWeights()
"""A wrong guess costs more than any time that it may save."""
WEIGHTS: Mapping[str, CostWeights] = {
    "balanced": BALANCED,
    "end_effector": END_EFFECTOR,
    "joint": JOINT,
}


def total(terms: Terms, units: Terms, weights: CostWeights) -> float:
    """Weighted sum of terms in units of the initial policy's.

    Raises:
        DataError: when a term is not finite.
    """
    terms.check()
    own, unit, weight = asdict(terms), asdict(units), asdict(weights)
    cost = 0.0
    for name in TERM_NAMES:
        ratio = own[name] / unit[name]
        cost += weight[name] * (2.0 * ratio / (1.0 + ratio) if name in BOUNDED else ratio)
    if not np.isfinite(cost):
        raise DataError(f"cost of the trial: {cost}", expected="a finite number")
    return cost


def squared_jerk(path: FloatArray, dt: float) -> float:
    """Time integral of the squared jerk of a path (n, d) with a period [s].

    Raises:
        DataError: when it is too short, or not finite.
    """
    # Half a second of the start of every script that launches nodes, and most of them have no costs.
    from scipy.signal import savgol_filter

    window = max(2 * round(0.5 * _WINDOW_S / dt) + 1, _DEGREE + 1 + _DEGREE % 2)
    if path.ndim != 2 or len(path) < window or not np.isfinite(path).all():
        raise DataError(
            f"path of shape {path.shape}", expected=f"at least {window} finite positions"
        )
    jerk = savgol_filter(path, window, _DEGREE, deriv=3, delta=dt, axis=0)
    return float(np.sum(jerk**2) * dt)


def deviation(executed: FloatArray, planned: FloatArray) -> float:
    """Mean square distance of two paths (n, d), (m, d) of one period; the shorter rests at its end."""
    count = max(len(executed), len(planned))
    parts = [np.concatenate((p, np.repeat(p[-1:], count - len(p), 0))) for p in (executed, planned)]
    return float(np.mean(np.sum((parts[0] - parts[1]) ** 2, axis=1)))


def indistinctness(path: FloatArray, others: FloatArray, dt: float) -> float:
    """J_delta of equation 7.19, small when a way is early unlike the others.

    Args:
        path: Way to the goal (n, 3) [m].
        others: Ways to the other goals (g, n, 3) [m], at the same times.
        dt: Their period [s].

    Raises:
        DataError: when there is no other way, or all are the same.
    """
    stride = max(round(DISTINCT_STEP_S / dt), 1)
    apart = np.linalg.norm(others[:, stride::stride] - path[stride::stride], axis=-1)
    found = float(np.sum(apart / np.arange(1, apart.shape[1] + 1)))
    if not found > 0.0:
        raise DataError(f"{len(others)} other ways, none of which differs", expected="other goals")
    return 1.0 / found
