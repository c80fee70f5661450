r"""Which weights of costs a reach between two postures has: Gaussian processes (thesis eq. 3.1).

Weights lie on a simplex, Gaussians do not. So logarithms of ratios are what is learnt,

.. math:: y_i(q_s, q_e) = \log \frac{\alpha_i}{\alpha_{JJ}} \sim
          GP\big(m_i,\ a_i \exp(-\tfrac{1}{2} \textstyle\sum_k (x_k - x'_k)^2 / l_{ik}^2)\big),
          \quad x = (q_s, q_e),

each observation with the variance that inverse optimal control found for it. What is known of one person
is a second process on top of that of all people: their own deviation from it, of the spread that there
usually is between people, alike over wide ranges of posture. Its mean is used, its variance reported.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import cho_solve, cholesky

from hri_prediction.errors import ConfigError, DataError
from hri_prediction.motor_control.costs import JOINT_JERK, indices_of
from hri_prediction.motor_control.scaling import rescaled

Array = NDArray[np.float64]

LEAST_WEIGHT = 0.01
"""Smaller weights are not told apart from this: paths hardly move with them."""
_LEAST_VARIANCE, _MOST_VARIANCE = 0.05**2, 3.0**2
"""Of an observed logarithm."""
PERSON_SD = 0.9
"""How far people's logarithms usually are from those of all (standard deviation): simulated ones."""
SAME_RAD = 0.1
"""Reaches between postures that are no further apart are the same one."""
PERSON_LENGTH_RAD = 1.5
"""Over which distance of postures a person's deviation stays alike."""


def postures(q_start: ArrayLike, q_end: ArrayLike) -> Array:
    """Inputs (..., 6) of angles (..., 3) at both ends [rad]."""
    start, end = np.asarray(q_start, dtype=float), np.asarray(q_end, dtype=float)
    return np.concatenate([start, end], axis=-1)


def to_logs(alpha: ArrayLike, covariance: ArrayLike, names: tuple[str, ...]) -> tuple[Array, Array]:
    """Logarithms of ratios and their variances (..., n - 1), in the order of names, without joint jerk.

    Args:
        alpha: Weights (..., n).
        covariance: Of their errors (..., n, n): what one has too much the others have too little.
        names: Of the costs.
    """
    reference = names.index(JOINT_JERK)
    given = np.asarray(alpha, dtype=float)
    weights = np.maximum(given, LEAST_WEIGHT)
    size = len(names)
    # Of a weight at the bound it is only known that it is small.
    small = np.where(given <= LEAST_WEIGHT, LEAST_WEIGHT**2, 0.0)
    errors = np.asarray(covariance, dtype=float) + small[..., None] * np.eye(size)
    slopes = np.eye(size) / weights[..., None]
    slopes = slopes - slopes[..., reference : reference + 1, :]
    variance = np.einsum("...ik,...kl,...il->...i", slopes, errors, slopes)
    logs = np.log(weights) - np.log(weights[..., reference : reference + 1])
    return (
        np.delete(logs, reference, axis=-1),
        bounded_variance(np.delete(variance, reference, axis=-1)),
    )


def bounded_variance(variance: ArrayLike) -> Array:
    """Of logarithms of ratios: none is known better, and nothing less, than weights can be told apart."""
    found: Array = np.clip(np.asarray(variance, dtype=float), _LEAST_VARIANCE, _MOST_VARIANCE)
    return found


def of_whole(
    alpha: ArrayLike, covariance: ArrayLike, factors: ArrayLike, rest_factors: ArrayLike
) -> tuple[Array, Array]:
    """Weights of a reach that was cut (n,), and their covariance (n, n), as those of the whole reach.

    Ratios are what is learnt: they are as sure as before.

    Args:
        alpha: Weights (n,).
        covariance: Of their errors (n, n).
        factors: S of these costs of the reach that was cut (n,).
        rest_factors: S of these costs of the reach from rest to rest (n,).
    """
    weights = np.asarray(alpha, dtype=float)
    ratio = np.asarray(factors, dtype=float) / np.asarray(rest_factors, dtype=float)
    whole = rescaled(weights, factors, rest_factors)
    slopes = (np.diag(ratio) - np.outer(whole, ratio)) / float(weights @ ratio)
    return whole, slopes @ np.asarray(covariance, dtype=float) @ slopes.T


def to_alpha(logs: ArrayLike, names: tuple[str, ...]) -> Array:
    """Weights (..., n) of logarithms of ratios (..., n - 1)."""
    whole = np.insert(np.asarray(logs, dtype=float), names.index(JOINT_JERK), 0.0, axis=-1)
    raised = np.exp(whole - whole.max(axis=-1, keepdims=True))
    found: Array = raised / raised.sum(axis=-1, keepdims=True)
    return found


@dataclass(frozen=True, eq=False)
class WeightData:
    """Observed weights.

    Attributes:
        names: The costs, joint jerk among them (n,).
        inputs: Postures at both ends (N, 6) [rad]; N may be 0.
        logs: Logarithms of ratios (N, n - 1).
        variance: Of each (N, n - 1).
        reaches: What each was observed of (N,); empty: nobody knows.

    Raises:
        ConfigError: on costs that are none, or lack joint jerk.
        DataError: on shapes that do not fit, and on what is not finite.
    """

    names: tuple[str, ...]
    inputs: Array
    logs: Array
    variance: Array
    reaches: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        indices_of(self.names)
        if JOINT_JERK not in self.names or len(self.names) < 2:
            raise ConfigError(
                f"costs {', '.join(self.names)}", expected=f"{JOINT_JERK} and one more at least"
            )
        count = len(np.atleast_1d(self.inputs))
        shapes = {
            "inputs": (count, 6),
            "logs": (count, len(self.names) - 1),
            "variance": (count, len(self.names) - 1),
        }
        for name, shape in shapes.items():
            array = np.array(getattr(self, name), dtype=float).reshape(
                shape if count == 0 else np.shape(getattr(self, name))
            )
            if array.shape != shape or not np.isfinite(array).all():
                raise DataError(
                    f"{name} of weights of shape {array.shape}",
                    expected=f"finite numbers of shape {shape}",
                )
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        if (self.variance <= 0.0).any():
            raise DataError("a variance of weights that is not positive", expected="more than 0")
        reaches = tuple(self.reaches) or ("",) * count
        if len(reaches) != count:
            raise DataError(f"weights of {len(reaches)} reaches", expected=f"{count}")
        object.__setattr__(self, "reaches", reaches)

    def __len__(self) -> int:
        return len(self.inputs)

    @staticmethod
    def none(names: tuple[str, ...]) -> WeightData:
        """No observations of these costs."""
        width = len(names) - 1
        return WeightData(names, np.zeros((0, 6)), np.zeros((0, width)), np.zeros((0, width)))

    @staticmethod
    def of(
        names: tuple[str, ...],
        q_start: ArrayLike,
        q_end: ArrayLike,
        alpha: ArrayLike,
        covariance: ArrayLike,
    ) -> WeightData:
        """Of weights (N, n) and the covariances of their errors (N, n, n) at postures (N, 3) [rad]."""
        return WeightData(names, postures(q_start, q_end), *to_logs(alpha, covariance, names))

    def and_also(self, other: WeightData) -> WeightData:
        """These, and others after them.

        Raises:
            DataError: others are of other costs.
        """
        if other.names != self.names:
            raise DataError(f"weights of {', '.join(other.names)}", expected=", ".join(self.names))
        return WeightData(
            self.names,
            np.concatenate((self.inputs, other.inputs)),
            np.concatenate((self.logs, other.logs)),
            np.concatenate((self.variance, other.variance)),
            (*self.reaches, *other.reaches),
        )

    def where(self, rows: NDArray[np.bool_] | NDArray[np.intp]) -> WeightData:
        """Some of these: by a mask (N,), or numbers."""
        reaches = tuple(np.array(self.reaches, dtype=object)[rows].tolist())
        return WeightData(
            self.names, self.inputs[rows], self.logs[rows], self.variance[rows], reaches
        )

    def of_reach(self, name: str) -> WeightData:
        """The same, observed of one reach."""
        return replace(self, reaches=(name,) * len(self))


@dataclass(frozen=True, eq=False)
class WeightGuess:
    """What is expected of a reach.

    Attributes:
        alpha: Weights at the mean of the logarithms (n,).
        logs: That mean (n - 1,).
        logs_sd: Standard deviations (n - 1,).
    """

    alpha: Array
    logs: Array
    logs_sd: Array


@dataclass(frozen=True, eq=False)
class WeightProcess:
    """What people's weights are like.

    Attributes:
        data: What was observed.
        mean: m (n - 1,).
        amplitude: a (n - 1,).
        lengths: l (n - 1, 6) [rad].

    Raises:
        DataError: on shapes that do not fit, and on what is not finite and positive.
    """

    data: WeightData
    mean: Array
    amplitude: Array
    lengths: Array
    _factors: tuple[Array, ...] = field(init=False, repr=False)
    _solved: tuple[Array, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        width = len(self.data.names) - 1
        for name, shape in (("mean", (width,)), ("amplitude", (width,)), ("lengths", (width, 6))):
            array = np.array(getattr(self, name), dtype=float)
            positive = name == "mean" or bool((array > 0.0).all())
            if array.shape != shape or not np.isfinite(array).all() or not positive:
                raise DataError(
                    f"{name} of a process of weights of shape {array.shape}",
                    expected=f"finite{'' if name == 'mean' else ', positive'} numbers of shape {shape}",
                )
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        factors, solved = [], []
        for i in range(width):
            matrix = self.kernel(i, self.data.inputs, self.data.inputs)
            factor = cholesky(matrix + np.diag(self.data.variance[:, i]), lower=True)
            factors.append(factor)
            solved.append(cho_solve((factor, True), self.data.logs[:, i] - self.mean[i]))
        object.__setattr__(self, "_factors", tuple(factors))
        object.__setattr__(self, "_solved", tuple(solved))

    @property
    def names(self) -> tuple[str, ...]:
        """The costs."""
        return self.data.names

    def kernel(self, output: int, first: Array, second: Array) -> Array:
        """Covariances (N, M) of one output at inputs (N, 6) and (M, 6)."""
        return self.amplitude[output] * _alike(first, second, self.lengths[output])

    def posterior(self, output: int, inputs: Array) -> tuple[Array, Array]:
        """Mean (M,) and covariance (M, M) of one output at inputs (M, 6)."""
        across = self.kernel(output, self.data.inputs, inputs)
        mean = self.mean[output] + across.T @ self._solved[output]
        covariance = self.kernel(output, inputs, inputs)
        covariance = covariance - across.T @ cho_solve((self._factors[output], True), across)
        return mean, 0.5 * (covariance + covariance.T)

    def guess(self, q_start: ArrayLike, q_end: ArrayLike) -> WeightGuess:
        """What is expected of a reach between two postures (3,) [rad]."""
        return PersonalProcess(self, WeightData.none(self.names)).guess(q_start, q_end)


@dataclass(frozen=True, eq=False)
class PersonalProcess:
    """What one person's weights are like: those of all people, and the person's own deviation.

    Attributes:
        people: What they are like of all.
        own: What was observed of this one.
        sd: Of people's deviations.
        length_rad: Over which they stay alike.
    """

    people: WeightProcess
    own: WeightData
    sd: float = PERSON_SD
    length_rad: float = PERSON_LENGTH_RAD

    def __post_init__(self) -> None:
        if self.own.names != self.people.names:
            raise DataError(
                f"weights of {', '.join(self.own.names)}", expected=", ".join(self.people.names)
            )
        if not (self.sd > 0.0 and self.length_rad > 0.0):
            raise ConfigError(
                f"a deviation of {self.sd} over {self.length_rad} rad", expected="positive numbers"
            )

    @property
    def names(self) -> tuple[str, ...]:
        """The costs."""
        return self.people.names

    def learnt(self, observed: WeightData) -> PersonalProcess:
        """The same with more observations of this person.

        What was observed before of the same reach, between the same postures, is replaced: it was made of a
        part of the same reaches. The other arm's, whose angles are counted as those of its mirror image, is
        not, and neither is that to another target nearby.
        """
        near = np.abs(self.own.inputs[:, None] - observed.inputs[None]).max(axis=2) < SAME_RAD
        own, new = (np.array(data.reaches, dtype=object) for data in (self.own, observed))
        same = (own[:, None] == new[None]) | (own[:, None] == "") | (new[None] == "")
        before = self.own.where(~(near & same).any(axis=1))
        return replace(self, own=before.and_also(observed))

    def guess(self, q_start: ArrayLike, q_end: ArrayLike) -> WeightGuess:
        """What is expected of a reach of this person between two postures (3,) [rad]."""
        asked = postures(q_start, q_end)[None]
        points = np.concatenate([asked, self.own.inputs])
        logs, variances = [], []
        for i in range(len(self.names) - 1):
            mean, covariance = self.people.posterior(i, points)
            lengths = np.full(6, self.length_rad)
            covariance = covariance + self.sd**2 * _alike(points, points, lengths)
            value, variance = mean[0], covariance[0, 0]
            if len(self.own):
                seen = covariance[1:, 1:] + np.diag(self.own.variance[:, i])
                factor = cholesky(seen, lower=True)
                solved = cho_solve((factor, True), covariance[1:, 0])
                value = value + solved @ (self.own.logs[:, i] - mean[1:])
                variance = variance - solved @ covariance[1:, 0]
            logs.append(float(value))
            variances.append(max(float(variance), 0.0))
        found = np.array(logs)
        return WeightGuess(to_alpha(found, self.names), found, np.sqrt(np.array(variances)))


def _alike(first: Array, second: Array, lengths: Array) -> Array:
    apart = (first[:, None, :] - second[None, :, :]) / lengths
    found: Array = np.exp(-0.5 * np.square(apart).sum(axis=-1))
    return found
