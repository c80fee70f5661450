r"""Discomfort of a reach, and how much of the share of dynamic costs it explains (eqs. 2.21, 3.5 to 3.8).

Discomfort is linear in joint angles, so the weights of greatest :math:`R^2` are those of linear regression,
but for their length. Regression on anything explains something: beside each :math:`R^2` stands what the
same shares come to in random order (:mod:`~hri_prediction.motor_control.analyses.orders`). The thesis
smoothed the shares before; that makes any :math:`R^2` larger, and is here for comparison alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from statsmodels.nonparametric.smoothers_lowess import lowess

from hri_prediction.errors import DataError
from hri_prediction.motor_control.analyses.orders import random_orders

Array = NDArray[np.float64]

SIX, THREE = "2.21", "3.5"
FORMS = (SIX, THREE)
"""All six angles, weights of length 1; three, the first with weight 1."""
_PERMUTATIONS = 1000


@dataclass(frozen=True, eq=False)
class Discomfort:
    """Discomfort fitted to shares.

    Attributes:
        form: Equation, one of :data:`FORMS`.
        beta: Weights of its terms (6,) or (3,).
        values: Discomfort of each reach (N,).
        slope, offset: Of the line: share = offset + slope * discomfort.
        r2: Share of the variance that the line explains.
        chance_r2: What 95 % of random orders stay below.
        p: Share of random orders that come to as much.
        smoothed_r2: R2 after smoothing as in the thesis; NaN where it was not asked for.
        smoothed_chance_r2: What 95 % of random orders, smoothed likewise, stay below.
    """

    form: str
    beta: Array
    values: Array
    slope: float
    offset: float
    r2: float
    chance_r2: float
    p: float
    smoothed_r2: float = np.nan
    smoothed_chance_r2: float = np.nan


def terms(q_start: Array, q_end: Array, form: str) -> Array:
    """What discomfort is linear in: (N, 6) or (N, 3), of angles (N, 3) [rad]."""
    start, change = np.degrees(q_start), np.degrees(q_end - q_start)
    first = 90.0 - start[:, :1]
    if form == SIX:
        columns = [first, start[:, 1:], change]
    elif form == THREE:
        columns = [first, start[:, 1:2], change[:, :1]]
    else:
        raise DataError(f"discomfort by equation {form}", expected="one of " + ", ".join(FORMS))
    return np.concatenate(columns, axis=1) / 180.0


def fit_discomfort(
    q_start: Array,
    q_end: Array,
    share: Array,
    form: str,
    rng: np.random.Generator,
    *,
    person: NDArray[np.str_] | None = None,
    task: NDArray[np.str_] | None = None,
    smoothing: float = 0.0,
    permutations: int = _PERMUTATIONS,
) -> Discomfort:
    """Find the discomfort that explains most of the shares.

    Args:
        q_start: Postures at the start (N, 3) [rad].
        q_end: At the end (N, 3) [rad].
        share: Share of dynamic costs (N,).
        form: Equation.
        rng: For random orders.
        person: Who reached (N,); none: one person.
        task: What was done (N,): tasks change places, the same ones in all people; none: each reach is
            one of its own.
        smoothing: Span of local regression, as a share of the reaches; 0: none.
        permutations: Number of random orders.

    Raises:
        DataError: on too few reaches, or what is not finite.
    """
    columns = terms(q_start, q_end, form)
    count, size = columns.shape
    if count < size + 2 or not (np.isfinite(columns).all() and np.isfinite(share).all()):
        raise DataError(
            f"discomfort of {count} reaches",
            expected=f"{size + 2} or more, with finite angles and shares",
        )
    # What a line through all terms explains does not depend on how they are scaled.
    basis, _ = np.linalg.qr(np.column_stack([np.ones(count), columns]))
    explains = _explained(basis, share)
    who = np.zeros(count, dtype=int) if person is None else person
    orders = share[
        random_orders(who, np.arange(count) if task is None else task, permutations, rng)
    ]
    chance = np.array([_explained(basis, order) for order in orders])
    found = np.linalg.lstsq(np.column_stack([np.ones(count), columns]), share, rcond=None)[0]
    raw = found[1:]
    # Weights of length 1 that discomfort grows with the share; or the first of them is 1.
    scale = float(np.linalg.norm(raw)) if form == SIX else float(raw[0])
    if abs(scale) < 1e-12:
        raise DataError("shares that no angle has to do with", expected="shares that vary")
    beta: Array = np.array(raw / scale, dtype=np.float64)
    smoothed = chance_smoothed = np.nan
    if smoothing > 0.0:
        values = columns @ beta
        smoothed = _smoothed(basis, values, share, smoothing)
        chances = [_best_smoothed(columns, basis, order, smoothing) for order in orders[:100]]
        chance_smoothed = float(np.quantile(chances, 0.95))
    return Discomfort(
        form=form,
        beta=beta,
        values=columns @ beta,
        slope=scale,
        offset=float(found[0]),
        r2=explains,
        chance_r2=float(np.quantile(chance, 0.95)),
        p=float((1 + (chance >= explains).sum()) / (1 + permutations)),
        smoothed_r2=smoothed,
        smoothed_chance_r2=chance_smoothed,
    )


def _explained(basis: Array, share: Array) -> float:
    """R2 of the regression on a basis with orthonormal columns, the constant among them."""
    spread = float(np.square(share - share.mean()).sum())
    if spread <= 0.0:
        raise DataError("shares that are all the same", expected="shares that vary")
    left = share - basis @ (basis.T @ share)
    return 1.0 - float(left @ left) / spread


def _smoothed(basis: Array, values: Array, share: Array, span: float) -> float:
    """R2 after local regression of the shares on discomfort."""
    least = 4.0 / len(share)
    smooth = lowess(share, values, frac=max(span, least), it=0, return_sorted=False)
    return _explained(basis, np.asarray(smooth))


def _best_smoothed(columns: Array, basis: Array, share: Array, span: float) -> float:
    """The same of shares in random order, with the discomfort that suits these best."""
    beta = np.linalg.lstsq(np.column_stack([np.ones(len(share)), columns]), share, rcond=None)[0]
    return _smoothed(basis, columns @ beta[1:], share, span)
