"""A support vector machine with a quadratic kernel, as quadratic forms (thesis, 4.7.1).

The decision between two classes is Σ c_k (γ x_k·x + 1)² + b over the support vectors x_k: a quadratic form
in x. So that is what is kept, and no recording of anybody is; deciding takes as long whatever was trained
on. Decisions are made probabilities by one logistic function, and those of pairs are coupled (Wu, Lin and
Weng 2004, second method); the class is the one that is likeliest.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import cho_solve, solve_triangular
from scipy.special import expit, logsumexp

from hri_prediction.errors import DataError, shown
from hri_prediction.extras import check_scikit_learn
from hri_prediction.ontology.features import COUNT, EXCHANGED, FEATURES
from hri_prediction.promp.storage import read_npz, write_npz

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

FORMAT = "hri-interaction-classifier-2"
COST = 100.0
"""Of the support vector machine: of what lies on the wrong side of the margin. With ten times as much
recordings left out are hardly better recognised (simulated dyads, seed 0), with a third of it worse."""
_FOLDS = 2
_SLOPES = (0.05, 20.0)
_UPPER = np.triu_indices(COUNT)
TERMS = len(_UPPER[0]) + COUNT + 1
"""Products, features and the constant."""
_ROUGH = 0.1
"""Variance, by that of each distance, below which nobody looks: some 4 cm. Two people a metre apart are
farther off than all that is learnt of simulated dyads with this and with 0.3, and not with 0.01."""


@dataclass(frozen=True, eq=False)
class InteractionClassifier:
    """Which class the mean features of a segment belong to.

    Attributes:
        classes: Their numbers, increasing (c,).
        mean: Of the features of the training segments (25,) [m].
        scale: Standard deviations of these (25,) [m].
        forms: Of each pair of classes, the coefficients of products (upper triangle), features and the
            constant (c (c - 1) / 2, 351); positive: the first of the pair.
        slope: Of the logistic function of a decision.
        root: Lower Cholesky factor of the covariance of the features by their standard deviations (25, 25).
        farthest: How far from the mean, by that covariance, segments are that were learnt, at most [-].
        about: What it was trained on.
    """

    classes: IntArray
    mean: FloatArray
    scale: FloatArray
    forms: FloatArray
    slope: float
    root: FloatArray
    farthest: float
    about: str = ""

    def __post_init__(self) -> None:
        """Check that all fits together."""
        count = len(self.classes)
        shapes = {
            "mean": (COUNT,),
            "scale": (COUNT,),
            "forms": (count * (count - 1) // 2, TERMS),
            "root": (COUNT, COUNT),
        }
        for name, shape in shapes.items():
            array = getattr(self, name)
            if array.shape != shape or not np.isfinite(array).all():
                raise DataError(f"{name} has shape {array.shape}", expected=f"{shape}, finite")
        if count < 2 or (np.diff(self.classes) <= 0).any():
            raise DataError(f"classes {self.classes.tolist()}", expected="two or more, increasing")
        positive = np.concatenate((self.scale, np.diag(self.root), [self.slope, self.farthest]))
        if not ((positive > 0.0) & np.isfinite(positive)).all():
            raise DataError(
                "a scale, the slope, the root's diagonal or the farthest is not positive",
                expected="positive numbers",
            )

    def decisions(self, features: ArrayLike) -> FloatArray:
        """Decisions between all pairs (n, pairs) of features (n, 25) [m]."""
        points = np.asarray(features, dtype=float)
        if points.ndim != 2 or points.shape[1] != COUNT:
            raise DataError(f"features have shape {points.shape}", expected=f"(n, {COUNT})")
        z = (points - self.mean) / self.scale
        products = z[:, _UPPER[0]] * z[:, _UPPER[1]]
        terms = np.concatenate((products, z, np.ones((len(z), 1))), axis=1)
        found: FloatArray = terms @ self.forms.T
        return found

    def probabilities(self, features: ArrayLike) -> FloatArray:
        """Probabilities of the classes (n, c) of features (n, 25) [m]; both orders of the agents count."""
        points = np.asarray(features, dtype=float)
        one, other = (
            coupled(expit(self.slope * self.decisions(x))) for x in (points, points[:, EXCHANGED])
        )
        found: FloatArray = 0.5 * (one + other)
        return found

    def strangeness(self, features: ArrayLike) -> FloatArray:
        """How far features (n, 25) [m] are from those that were learnt (n,): 1 is as far as any of these.

        By all distances together (Mahalanobis): each by itself may be as usual where no two arms have all.
        """
        z = (np.asarray(features, dtype=float) - self.mean) / self.scale
        white = solve_triangular(self.root, z.T, lower=True)
        found: FloatArray = np.linalg.norm(white, axis=0) / self.farthest
        return found

    def unlike(self, features: ArrayLike) -> str:
        """Why probabilities say little: distances like which none were learnt; empty where all are.

        Args:
            features: Of one movement (25,) [m].
        """
        row = np.asarray(features, dtype=float)
        strange = float(self.strangeness(row[None])[0])
        if strange <= 1.0:
            return ""
        # What each distance has a part in.
        z = (row - self.mean) / self.scale
        worst = int((z * cho_solve((self.root, True), z)).argmax())
        return (
            f"unlike what was learnt: {strange:.1f} times as far off as any of that, mostly by "
            f"{FEATURES[worst]}, {row[worst]:.2f} m beside the others"
        )

    def classify(self, features: ArrayLike) -> IntArray:
        """The likeliest classes (n,) of features (n, 25) [m]."""
        found: IntArray = self.classes[self.probabilities(features).argmax(axis=1)]
        return found

    def save(self, path: str | Path) -> None:
        """Write it as .npz with a JSON header."""
        arrays = {
            "classes": self.classes,
            "mean": self.mean,
            "scale": self.scale,
            "forms": self.forms.astype(np.float32),
            "root": self.root,
        }
        header = {"slope": self.slope, "farthest": self.farthest, "about": self.about}
        write_npz(path, arrays, {"format": FORMAT, **header})

    @classmethod
    def load(cls, path: str | Path) -> InteractionClassifier:
        """Read what :meth:`save` wrote.

        Raises:
            DataError: when it is missing, damaged or something else.
        """
        arrays, header = read_npz(path, FORMAT)
        try:
            slope, farthest = header["slope"], header["farthest"]
            for name, value in (("slope", slope), ("farthest", farthest)):
                if not isinstance(value, float):
                    raise DataError(f"{name} = {shown(value)}", expected="a number")
            mean, scale, forms, root = (
                np.asarray(arrays[name], dtype=float) for name in ("mean", "scale", "forms", "root")
            )
            classes = arrays["classes"]
            if classes.ndim != 1 or classes.dtype.kind not in "iu":
                raise DataError(
                    f"classes are {classes.dtype} {classes.shape}", expected="numbers (c,)"
                )
            about = str(header.get("about", ""))
            return cls(classes.astype(np.int64), mean, scale, forms, slope, root, farthest, about)
        except DataError as error:
            raise DataError(f"{path}: {error.problem}", expected=error.expected) from error
        except (KeyError, ValueError, TypeError) as error:
            raise DataError(
                f"{path} is incomplete: {error}", expected=f"a whole {FORMAT}"
            ) from error


def coupled(pairwise: FloatArray) -> FloatArray:
    """Probabilities of classes from those of pairs (Wu, Lin and Weng 2004, eq. 2.14 f.).

    Args:
        pairwise: Of the first of each pair, given one of the two, in the order of
            ``itertools.combinations`` (n, pairs).

    Returns:
        (n, c), each row with a sum of 1.
    """
    number = pairwise.shape[1]
    count = round((1.0 + np.sqrt(1.0 + 8.0 * number)) / 2.0)
    first, second = np.array(list(itertools.combinations(range(count), 2))).T
    r = np.zeros((len(pairwise), count, count))
    safe = np.clip(pairwise, 1e-7, 1.0 - 1e-7)
    r[:, first, second], r[:, second, first] = safe, 1.0 - safe
    system = np.zeros((len(pairwise), count + 1, count + 1))
    system[:, :count, :count] = -np.swapaxes(r, 1, 2) * r
    rows = np.arange(count)
    system[:, rows, rows] = (r**2).sum(axis=1)
    system[:, :count, count] = system[:, count, :count] = 1.0
    wanted = np.zeros((len(pairwise), count + 1, 1))
    wanted[:, count] = 1.0
    found: FloatArray = np.clip(np.linalg.solve(system, wanted)[:, :count, 0], 0.0, None)
    return found / found.sum(axis=1, keepdims=True)


def _fit(
    features: FloatArray, labels: IntArray, cost: float, slope: float
) -> InteractionClassifier:
    from sklearn.svm import SVC

    mean, scale = features.mean(axis=0), features.std(axis=0)
    z = (features - mean) / scale
    gamma = 1.0 / COUNT
    machine = SVC(C=cost, kernel="poly", degree=2, gamma=gamma, coef0=1.0, cache_size=500.0)
    machine.fit(z, labels)
    root = np.linalg.cholesky(z.T @ z / len(z) + _ROUGH * np.eye(COUNT))
    farthest = float(np.linalg.norm(solve_triangular(root, z.T, lower=True), axis=0).max())
    return InteractionClassifier(
        np.asarray(machine.classes_, dtype=np.int64),
        mean,
        scale,
        _forms(machine, gamma),
        slope,
        root,
        farthest,
    )


def _forms(machine: Any, gamma: float) -> FloatArray:
    """The quadratic forms of all pairs of a fitted machine of scikit-learn."""
    count = len(machine.classes_)
    ends = np.concatenate(([0], np.cumsum(machine.n_support_)))
    vectors, coefficients = machine.support_vectors_, machine.dual_coef_
    found = []
    for pair, (i, j) in enumerate(itertools.combinations(range(count), 2)):
        parts = [(slice(ends[i], ends[i + 1]), j - 1), (slice(ends[j], ends[j + 1]), i)]
        x = np.concatenate([vectors[part] for part, _ in parts])
        c = np.concatenate([coefficients[row, part] for part, row in parts])
        square = gamma**2 * (x.T * c) @ x
        square = square + np.triu(square, 1)
        constant = c.sum() + machine.intercept_[pair]
        form = np.concatenate((square[_UPPER], 2.0 * gamma * (c @ x), [constant]))
        # Of two classes alone, scikit-learn's decision is positive for the second.
        found.append(-form if count == 2 else form)
    return np.array(found)


def train(
    features: ArrayLike,
    labels: ArrayLike,
    *,
    cost: float = COST,
    slope: float | None = None,
    groups: ArrayLike | None = None,
    rng: np.random.Generator,
    about: str = "",
) -> InteractionClassifier:
    """Train on segments.

    Args:
        features: Of the segments (n, 25) [m]; both orders of the agents are trained on.
        labels: Numbers of the classes (n,).
        cost: Of what lies on the wrong side of the margin.
        slope: Of the logistic function; none: the one that is likeliest for segments left out.
        groups: Numbers of what is left out as a whole for that (n,), such as recordings: segments of one
            are more alike than those of another will be. None: each segment by itself.
        rng: Draws which are left out.
        about: What they are.

    Raises:
        DataError: when there is one class only, or too few segments of one.
        ConfigError: without scikit-learn.
    """
    check_scikit_learn()
    x, y = np.asarray(features, dtype=float), np.asarray(labels, dtype=np.int64)
    if x.ndim != 2 or x.shape[1] != COUNT or y.shape != (len(x),) or not np.isfinite(x).all():
        raise DataError(
            f"features {x.shape} and labels {y.shape}", expected="(n, 25), finite, and (n,)"
        )
    numbers, counts = np.unique(y, return_counts=True)
    if len(numbers) < 2 or counts.min() < 2 * _FOLDS:
        few = ", ".join(f"{n} of class {k}" for k, n in zip(numbers, counts, strict=True))
        raise DataError(
            f"segments: {few or 'none'}",
            expected=f"two classes or more, {2 * _FOLDS} segments of each",
        )
    both = np.concatenate((x, x[:, EXCHANGED])), np.concatenate((y, y))
    flat = [
        name for name, spread in zip(FEATURES, np.ptp(both[0], axis=0), strict=True) if not spread
    ]
    if flat:
        raise DataError(
            f"the distance {flat[0]} is the same in all segments",
            expected="distances that differ",
            hint="are two keypoints the same?",
        )
    if slope is None:
        named = None if groups is None else np.asarray(groups, dtype=np.int64)
        slope = _likeliest_slope(x, y, named, cost, rng)
    return replace(_fit(*both, cost, slope), about=about)


def _folds(y: IntArray, groups: IntArray | None, rng: np.random.Generator) -> IntArray:
    """Which fold each segment is left out in (n,): groups are left out whole."""
    fold = np.empty(len(y), dtype=np.int64)
    for number in np.unique(y):
        own = np.flatnonzero(y == number)
        names = own if groups is None else groups[own]
        order = rng.permutation(np.unique(names))
        if len(order) < _FOLDS:  # a single recording of a class has to be parted
            names, order = own, rng.permutation(own)
        place = {name: index % _FOLDS for index, name in enumerate(order.tolist())}
        fold[own] = [place[name] for name in names.tolist()]
    return fold


def _likeliest_slope(
    x: FloatArray, y: IntArray, groups: IntArray | None, cost: float, rng: np.random.Generator
) -> float:
    """The slope that gives segments which were left out the largest probability."""
    fold = _folds(y, groups, rng)
    parts = []
    for left_out in range(_FOLDS):
        rest = fold != left_out
        both = np.concatenate((x[rest], x[rest][:, EXCHANGED])), np.concatenate((y[rest], y[rest]))
        parts.append((_fit(*both, cost, 1.0), x[~rest], y[~rest]))

    def badness(log_slope: float) -> float:
        told = [
            negative_log(replace(model, slope=float(np.exp(log_slope))), features, labels)
            for model, features, labels in parts
        ]
        return float(np.concatenate(told).mean())

    # Here, as it takes a tenth of the start of a node to load, and none of them trains.
    from scipy.optimize import minimize_scalar

    found = minimize_scalar(
        badness, bounds=tuple(np.log(_SLOPES)), method="bounded", options={"xatol": 0.05}
    )
    return float(np.exp(found.x))


def negative_log(
    model: InteractionClassifier, features: FloatArray, labels: IntArray
) -> FloatArray:
    """Negative log probability of the true classes (n,)."""
    given = np.log(np.maximum(model.probabilities(features), 1e-12))
    given -= logsumexp(given, axis=1, keepdims=True)
    found: FloatArray = -given[np.arange(len(labels)), np.searchsorted(model.classes, labels)]
    return found
