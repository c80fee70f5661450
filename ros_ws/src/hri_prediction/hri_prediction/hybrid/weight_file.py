"""Processes of weights on the disk: JSON, so that people can read them."""

from __future__ import annotations

import hashlib
import importlib.resources
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hri_prediction.errors import ConfigError, DataError
from hri_prediction.files.content import read_text
from hri_prediction.files.sealed import check_seal, sealed
from hri_prediction.files.values import parse_json
from hri_prediction.files.whole import write_whole
from hri_prediction.hybrid.body import CONVENTION
from hri_prediction.hybrid.weight_process import WeightData, WeightProcess
from hri_prediction.motor_control.scaling import MAXIMUM

FORMAT = "hri-weight-process-2"
"""Since 2 weights are those of reaches from rest to rest, and the file says of which arm they are."""
SHIPPED = "first_weights.json"
"""Fitted to the laws of 15 simulated people for the 108 tasks of the thesis' chapter 3:
``scripts/fit_weights.py`` with the results of ``scripts/simulate_weights.py``."""


MOST = 2000
"""Observations: time goes with the third power of their number."""


def data_to_values(data: WeightData) -> dict[str, Any]:
    """Observations as plain values, with five digits."""
    return {
        "costs": list(data.names),
        **{
            name: [[float(f"{v:.5g}") for v in row] for row in getattr(data, name).tolist()]
            for name in ("inputs", "logs", "variance")
        },
        **({"reaches": list(data.reaches)} if any(data.reaches) else {}),
    }


def data_of_values(values: Any) -> WeightData:
    """Inverse of :func:`data_to_values`.

    Raises:
        DataError: something is missing, or does not fit together.
    """
    try:
        names = tuple(map(str, values["costs"]))
        inputs, logs, variance = (
            np.array(values[key], dtype=float) for key in ("inputs", "logs", "variance")
        )
        if not len(inputs):
            return WeightData.none(names)
        if len(inputs) > MOST:
            raise DataError(f"{len(inputs)} observed weights", expected=f"{MOST} at most")
        reaches = tuple(map(str, values.get("reaches", ())))
        return WeightData(names, inputs, logs, variance, reaches)
    except ConfigError as error:
        raise DataError(error.problem, expected=error.expected) from error
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise DataError(
            f"observed weights lack or garble {error}", expected="costs, inputs, logs, variance"
        ) from error


def check_arm(values: Mapping[str, Any]) -> None:
    """Whether weights are of the arm model that the hybrid predictor has, with its scale factors.

    Args:
        values: A file's; what it does not say is taken to be as it is here.

    Raises:
        DataError: they are of another one.
    """
    for key, own in (("convention", CONVENTION), ("scaling", MAXIMUM)):
        given = values.get(key, own)
        if given != own:
            raise DataError(
                f"weights with {key} {given!r:.40}",
                expected=f"{own!r}, as the hybrid predictor has it",
                hint=f"explain the reaches with fit_ioc.py --{key} {own}",
            )


def save_process(
    path: Path, process: WeightProcess, origin: str, left_out: Mapping[str, float] | None = None
) -> None:
    """Write a process.

    Args:
        path: File.
        process: What people's weights are like.
        origin: What it was fitted to, in words.
        left_out: Errors of weights of reaches that were left out; into the file, and not read again.
    """
    content = {
        "format": FORMAT,
        "origin": origin,
        "convention": CONVENTION,
        **({"left_out": dict(left_out)} if left_out else {}),
        "mean": process.mean.tolist(),
        "amplitude": process.amplitude.tolist(),
        "lengths_rad": process.lengths.tolist(),
        **data_to_values(process.data),
    }
    whole = sealed(content)
    lines = [f" {json.dumps(k)}: {json.dumps(v, allow_nan=False)}" for k, v in whole.items()]
    text = "{\n" + ",\n".join(lines) + "\n}\n"
    write_whole({path: lambda part: part.write_text(text)})


def _shipped() -> str:
    return importlib.resources.files("hri_prediction.hybrid").joinpath(SHIPPED).read_text()


def shipped_hash() -> str:
    """Stands for the process that ships with the package (16 hex digits)."""
    return hashlib.sha256(_shipped().encode()).hexdigest()[:16]


def load_process(path: Path | None = None) -> WeightProcess:
    """Read a process.

    Args:
        path: File; none: the one that ships with the package.

    Raises:
        DataError: it is missing, damaged, or something else.
    """
    if path is None:
        text, where = _shipped(), SHIPPED
    else:
        text, where = read_text(path), str(path)
    try:
        values = parse_json(text)
        if not isinstance(values, dict) or values.get("format") != FORMAT:
            raise DataError("it is no process of weights", expected=f"JSON of format {FORMAT}")
        check_arm(values)
        process = WeightProcess(
            data_of_values(values),
            *(np.array(values[key], dtype=float) for key in ("mean", "amplitude", "lengths_rad")),
        )
    except DataError as error:
        raise DataError(
            f"{where}: {error.problem}", expected=error.expected, hint=error.hint
        ) from error
    except (ArithmeticError, LookupError, TypeError, ValueError, np.linalg.LinAlgError) as error:
        raise DataError(f"{where}: it lacks or garbles {error}") from error
    check_seal(values, where)
    return process
