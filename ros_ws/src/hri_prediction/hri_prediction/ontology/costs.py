"""What moving beside somebody costs: nearness of each part to each, and unsmoothness (thesis, 4.5).

G are the distances of :mod:`.features` as costs, exp(−d / 0.2 m), summed over time: distances themselves,
with weights that are not negative, would make nearness good. A is the sum of the squares of third
differences. That makes 26 features.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from hri_prediction.compiled import njit
from hri_prediction.errors import DataError
from hri_prediction.ontology.features import COUNT, FEATURES, fill_features
from hri_prediction.ontology.sampling import third_differences
from hri_prediction.ontology.upper_body import Geometry, UpperBody, points_of

FloatArray = NDArray[np.float64]

LENGTH_M = 0.2
"""Distance over which nearness falls to 1/e."""
SMOOTHNESS = "unsmoothness"
COSTS = (*FEATURES, SMOOTHNESS)
NUMBER = len(COSTS)


@njit
def _fill_costs(
    paths: FloatArray,
    partner: FloatArray,
    body: Geometry,
    length: float,
    step: float,
    out: FloatArray,
) -> None:
    frame, points, distances = np.empty((3, 3)), np.empty((4, 3)), np.empty(25)
    for path in range(paths.shape[0]):
        for k in range(25):
            out[path, k] = 0.0
        for row in range(paths.shape[1]):
            points_of(paths[path, row], body, frame, points)
            fill_features(points, partner[row], distances)
            for k in range(25):
                out[path, k] += step * math.exp(-distances[k] / length)


def path_costs(
    body: UpperBody,
    paths: FloatArray,
    partner: FloatArray,
    step_s: float,
    length: float = LENGTH_M,
    beyond: tuple[FloatArray, FloatArray] | None = None,
) -> FloatArray:
    """Features of movements.

    Args:
        body: Whose.
        paths: Joints over time (s, n, 14).
        partner: Keypoints of the other one's arm at the same times (n, 4, 3) [m].
        step_s: Between two of these times [s].
        length: Distance over which nearness falls to 1/e [m].
        beyond: Joints at the three times before, and the three after, all of these movements (3, 14); none:
            rest.

    Returns:
        (s, 26): nearness [s], and the sum of squared third differences [rad²] (of the first three joints
        [m²]).

    Raises:
        DataError: when shapes do not fit.
    """
    if paths.ndim != 3 or paths.shape[2] != 14 or partner.shape != (paths.shape[1], 4, 3):
        raise DataError(
            f"movements {paths.shape} beside {partner.shape}", expected="(s, n, 14) and (n, 4, 3)"
        )
    out = np.empty((len(paths), NUMBER))
    _fill_costs(
        np.ascontiguousarray(paths),
        np.ascontiguousarray(partner),
        body.geometry,
        length,
        step_s,
        out[:, :COUNT],
    )
    ends = None if beyond is None else (beyond[0][:, None], beyond[1][:, None])
    out[:, COUNT] = (third_differences(paths.swapaxes(0, 1), ends) ** 2).sum(axis=(0, 2))
    return out
