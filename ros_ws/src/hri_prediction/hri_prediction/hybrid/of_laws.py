"""What is expected of anybody's reaches, by the laws that people's own reaches follow."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Hashable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import DataError
from hri_prediction.hybrid.fitting import check_costs
from hri_prediction.hybrid.weight_process import (
    PERSON_SD,
    WeightData,
    bounded_variance,
    postures,
    to_alpha,
    to_logs,
)

Array = NDArray[np.float64]


def data_of_laws(names: tuple[str, ...], laws: Sequence[Mapping[str, Any]]) -> WeightData:
    """The mean of people's weights of each task, with its variance.

    A mean of n people is off by what people differ by, and by what their laws are off. How much they
    differ is known from the task itself, and, as if one more had been seen, from people in general. Tasks
    that have no name are nobody else's.

    Args:
        names: Costs, joint jerk among them (n,).
        laws: As ``person_laws.to_mapping`` writes them.

    Raises:
        DataError: costs are none of these, or a law lacks or garbles its tasks.
    """
    check_costs(names)
    groups: dict[Hashable, list[tuple[Array, Array, Array]]] = defaultdict(list)
    for number, law in enumerate(laws):
        try:
            for index, row in enumerate(law["tasks"]):
                ends = (np.radians(np.array(row[k], float)) for k in ("q_start_deg", "q_end_deg"))
                inputs = postures(*ends)
                logs, sd = (np.array(row[key], dtype=float) for key in ("logs", "log_sd"))
                key = row["task"] if isinstance(row["task"], str) else (number, index)
                groups[key].append((inputs, logs, sd))
        except (ArithmeticError, LookupError, TypeError, ValueError) as error:
            raise DataError(
                f"a law of the results lacks or garbles {error}", expected="results of fit_ioc.py"
            ) from error
    shapes = {(6,), (len(names) - 1,)}
    rows = []
    for which, own in groups.items():
        for parts in own:
            fits = {part.shape for part in parts} == shapes and parts[1].shape == parts[2].shape
            if not fits or not all(np.isfinite(part).all() for part in parts):
                raise DataError(
                    f"task {which!r:.80} of a law: {[part.tolist() for part in parts]!r:.120}",
                    expected=f"six angles, and {len(names) - 1} finite logarithms with deviations",
                )
        inputs, logs, sd = (np.array(part) for part in zip(*own, strict=True))
        # Laws go on beyond what paths tell apart.
        floored, _ = to_logs(
            to_alpha(logs, names), np.zeros((len(own), len(names), len(names))), names
        )
        mean = floored.mean(axis=0)
        between = (PERSON_SD**2 + np.square(floored - mean).sum(axis=0)) / len(own)
        own_errors = bounded_variance(np.square(sd)).mean(axis=0)
        rows.append((inputs.mean(axis=0), mean, (between + own_errors) / len(own)))
    if not rows:
        raise DataError("laws without a task", expected="one or more")
    inputs, logs, variance = (np.array(part) for part in zip(*rows, strict=True))
    return WeightData(names, inputs, logs, bounded_variance(variance))
