"""The handovers of eight pairs (Khanna et al. 2022), as a folder ``dyad_handover_kth`` holds them.

The goal of either hand is where it was when the recording ended. Coordinates x and y of the
file are fractions of the distance of both chests, which is 1.2 to 1.4 m where it is known.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from hri_planner.rnn.encounters import Encounter, smoothed
from hri_prediction.errors import DataError
from hri_prediction.files.arrays import Arrays, read_arrays
from hri_prediction.tracks.tables import one_number, row_spans

FILE = Path("dyad_handover_kth/hands.npz")
CHESTS_APART_M = 1.3
PEOPLE = ("giver", "taker")
RATES_HZ = (10.0, 2000.0)
"""Rates that a recording of a hand may have."""

_ARRAYS = ("pos", "start", "length", "pair", "rate_hz")


def holds_handovers(path: Path) -> bool:
    """Whether a file is one of handovers."""
    try:
        return set(read_arrays(path)) >= set(_ARRAYS)
    except DataError:
        return False


def load_handovers(path: Path, learner: str = "taker") -> list[Encounter]:
    """All handovers of a file.

    Args:
        path: The file.
        learner: One of :data:`PEOPLE`.

    Raises:
        DataError: when the file is missing or is not one of them.
    """
    own = PEOPLE.index(learner)
    found = read_arrays(path)
    try:
        return list(_encounters(found, own))
    except DataError as error:
        raise DataError(f"cannot read {path}: {error.problem}", expected=error.expected) from error


def _encounters(found: Arrays, own: int) -> Iterator[Encounter]:
    missing = [name for name in _ARRAYS if name not in found]
    if missing:
        raise DataError(f"it has no {missing[0]}", expected=", ".join(_ARRAYS))
    hands, pairs, rate = found["pos"], found["pair"], one_number(found, "rate_hz")
    if hands.ndim != 3 or hands.shape[1:] != (2, 3) or hands.dtype.kind != "f":
        raise DataError(f"pos is {hands.dtype} {hands.shape}", expected="floats (rows, 2, 3)")
    if not RATES_HZ[0] <= rate <= RATES_HZ[1]:
        raise DataError(f"rate_hz is {rate:g}", expected="{:g} to {:g} Hz".format(*RATES_HZ))
    spans = row_spans(found, len(hands))
    if pairs.shape != (len(spans),) or pairs.dtype.kind not in "USiu":
        raise DataError(f"pair is {pairs.dtype} {pairs.shape}", expected=f"names ({len(spans)},)")
    scale = np.array((CHESTS_APART_M, CHESTS_APART_M, 1.0))
    for (first, last), pair in zip(spans, pairs, strict=True):
        both = hands[first:last].astype(float) * scale
        hand = smoothed(both[:, own], rate)
        partner = smoothed(both[:, 1 - own], rate)
        yield Encounter(hand, partner, hand[-1], "handover", False, str(pair))


def without_pair(encounters: list[Encounter], pair: str) -> tuple[list[Encounter], list[Encounter]]:
    """Those of all other pairs, and those of this one.

    Raises:
        DataError: when there is no such pair.
    """
    others = [one for one in encounters if one.pair != pair]
    if len(others) == len(encounters):
        known = sorted({one.pair for one in encounters})
        raise DataError(f"pair {pair!r}", expected="one of " + ", ".join(known))
    return others, [one for one in encounters if one.pair == pair]
