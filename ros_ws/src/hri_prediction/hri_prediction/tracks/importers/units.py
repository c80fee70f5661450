"""The unit of length of a file: what it says, or the one that makes an arm as long as arms are."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hri_prediction.arm.geometry import FloatArray
from hri_prediction.errors import ConfigError, DataError

UNITS = {
    "m": 1.0,
    "cm": 0.01,
    "mm": 0.001,
    "in": 0.0254,
    "ft": 0.3048,
    # Skeletons of the Carnegie Mellon database: 0.45 units are an inch (mocap.cs.cmu.edu/faqs.php).
    "cmu": 0.0254 / 0.45,
}
"""Metres in one unit."""
_SPELLINGS = {
    "meter": "m",
    "meters": "m",
    "metre": "m",
    "metres": "m",
    "centimeters": "cm",
    "millimeter": "mm",
    "millimeters": "mm",
    "millimetres": "mm",
    "inch": "in",
    "inches": "in",
    "feet": "ft",
}
_USUAL_ARM_M = (0.38, 0.84)
"""Shoulder to wrist along a stretched arm, of people small and tall, markers and joints."""
POSSIBLE_ARM_M = (0.15, 1.3)
"""Shoulder to wrist of anybody [m]; anything else is another unit or another mapping."""


@dataclass(frozen=True)
class Scale:
    """Length of a file's unit.

    Attributes:
        metres: Metres in one unit.
        text: As ``--units`` takes it.
        why: Where it comes from, for people.
        guessed: It should be confirmed.
    """

    metres: float
    text: str
    why: str = "given"
    guessed: bool = False


def parse_units(text: str) -> Scale:
    """Read a unit, or a number of metres.

    Raises:
        ConfigError: when the text is neither.
    """
    name = text.strip().lower()
    name = _SPELLINGS.get(name, name)
    try:
        metres = UNITS[name] if name in UNITS else float(name)
    except ValueError:
        metres = math.nan
    if not (math.isfinite(metres) and metres > 0.0):
        raise ConfigError(
            f"unit {text!r}", expected=f"auto, {', '.join(UNITS)}, or a number of metres"
        )
    return Scale(metres, name)


def arm_length(shoulder: FloatArray, elbow: FloatArray, wrist: FloatArray) -> float:
    """Median length of upper arm and forearm together, in the file's unit; NaN if never seen."""
    length = np.linalg.norm(elbow - shoulder, axis=-1) + np.linalg.norm(wrist - elbow, axis=-1)
    known = length[np.isfinite(length)]
    return float(np.median(known)) if len(known) else math.nan


def find_scale(said: str, arm: float) -> Scale:
    """The scale of a file.

    Args:
        said: Unit that the file names; may be empty.
        arm: Length of the arm in that unit (:func:`arm_length`).

    Raises:
        DataError: when the file's unit is unknown or makes the arm impossibly long or short, or
            the file names none and none fits.
    """
    fits = [n for n, m in UNITS.items() if _USUAL_ARM_M[0] <= arm * m <= _USUAL_ARM_M[1]]
    hint = f"give --units, {fits[0]} would fit" if fits else "give --units"
    if said:
        try:
            scale = parse_units(said)
        except ConfigError as error:
            raise DataError(
                f"the file's unit is {said!r}", expected=", ".join(UNITS), hint=hint
            ) from error
        if not POSSIBLE_ARM_M[0] <= arm * scale.metres <= POSSIBLE_ARM_M[1]:
            raise DataError(
                f"with the file's unit {said} the arm is {arm * scale.metres:.3g} m long",
                expected="{:g} to {:g} m from shoulder to wrist".format(*POSSIBLE_ARM_M),
                hint=hint,
            )
        return Scale(scale.metres, scale.text, "the file says so")
    if not fits:
        raise DataError(
            f"the file names no unit, and its arm of {arm:.4g} units fits none", hint=hint
        )
    why = f"the arm is then {arm * UNITS[fits[0]]:.2f} m long; the file names none"
    return Scale(UNITS[fits[0]], fits[0], why, guessed=True)
