"""Learnt costs of moving beside somebody, case by case, as a JSON file."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import ConfigError, DataError
from hri_prediction.files.sealed import check_seal, sealed
from hri_prediction.files.values import read_json
from hri_prediction.ontology.cases import find_case
from hri_prediction.ontology.costs import COSTS, NUMBER

FloatArray = NDArray[np.float64]

FORMAT = "hri-interaction-costs-1"


@dataclass(frozen=True, eq=False)
class CaseCosts:
    """What was learnt of a case.

    Attributes:
        weights: Of the costs, in their own units (26,).
        scale: Of the costs: how much they differ among what might have been done (26,).
        movements: So many were learnt from.
        cosine: Between these weights and those that people are known to have moved by, each times its
            scale; none when these are not known, as of people who were recorded.
    """

    weights: FloatArray
    scale: FloatArray
    movements: int
    cosine: float | None = None

    @property
    def scaled(self) -> FloatArray:
        """How much each counts (26,)."""
        return self.weights * self.scale


@dataclass(frozen=True, eq=False)
class LearntCosts:
    """Costs of several cases.

    Attributes:
        cases: By name, as ``case_3``.
        length: Distance over which nearness falls to 1/e [m].
        about: What they were learnt from.
        warnings: What whoever uses them should know first.
    """

    cases: Mapping[str, CaseCosts]
    length: float
    about: str = ""
    warnings: tuple[str, ...] = ()

    def save(self, path: Path, **more: Any) -> None:
        """Write them; ``more`` goes into the file and is not read again."""
        content = {
            "format": FORMAT,
            "about": self.about,
            "length_m": self.length,
            "costs": list(COSTS),
            "cases": {name: plain_costs(one) for name, one in self.cases.items()},
            **({"warnings": list(self.warnings)} if self.warnings else {}),
            **more,
        }
        new = path.with_suffix(".new")
        new.write_text(json.dumps(sealed(content), indent=1, allow_nan=False) + "\n")
        new.replace(path)


def load_costs(path: str | Path) -> LearntCosts:
    """Read what :meth:`LearntCosts.save` wrote.

    Raises:
        DataError: when it is missing, damaged or something else.
    """
    content = read_json(path)
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise DataError(f"{path} is no file of learnt costs", expected=f"format {FORMAT}")
    try:
        length = float(content["length_m"])
        if not (math.isfinite(length) and length > 0.0):
            raise DataError(f"length_m = {length}", expected="a positive length")
        if content["costs"] != list(COSTS):
            raise DataError("other costs than these", expected=", ".join(COSTS))
        cases = {find_case(name).name: costs_of(one) for name, one in content["cases"].items()}
        warnings = content.get("warnings", [])
        if not isinstance(warnings, list) or not all(isinstance(text, str) for text in warnings):
            raise DataError(f"warnings {warnings!r:.80}", expected="a list of texts")
        learnt = LearntCosts(cases, length, str(content.get("about", "")), tuple(warnings))
    except (ConfigError, DataError) as error:
        raise DataError(f"{path}: {error.problem}", expected=error.expected) from error
    # Arithmetic: a number that is too large to be one.
    except (ArithmeticError, KeyError, TypeError, ValueError, AttributeError) as error:
        raise DataError(
            f"{path} is incomplete: {error!r:.200}", expected=f"a whole {FORMAT}"
        ) from error
    check_seal(content, path)
    return learnt


def plain_costs(costs: CaseCosts) -> dict[str, Any]:
    """Costs of a case as plain values."""
    known = {} if costs.cosine is None else {"cosine": costs.cosine}
    return {
        "weights": costs.weights.tolist(),
        "scale": costs.scale.tolist(),
        "movements": costs.movements,
        **known,
    }


def costs_of(content: Any) -> CaseCosts:
    """What :func:`plain_costs` told.

    Raises:
        DataError: when weights are not what they are to be.
        KeyError: when something is missing.
    """
    weights, scale = (np.array(content[name], dtype=float) for name in ("weights", "scale"))
    for array in (weights, scale):
        if array.shape != (NUMBER,) or not np.isfinite(array).all() or (array < 0.0).any():
            raise DataError(
                f"weights or scale {array.shape}", expected=f"({NUMBER},), none negative"
            )
    known = content.get("cosine")
    return CaseCosts(
        weights, scale, int(content["movements"]), None if known is None else float(known)
    )
