"""The handovers of eight pairs (Khanna et al. 2022), as a folder ``dyad_handover_kth`` holds them.

The goal of either hand is where it was when the recording ended. Coordinates x and y of the
file are fractions of the distance of both chests, which is 1.2 to 1.4 m where it is known.
"""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np

from hri_planner.rnn.encounters import Encounter, smoothed
from hri_prediction.errors import DataError

FILE = Path("dyad_handover_kth/hands.npz")
CHESTS_APART_M = 1.3
PEOPLE = ("giver", "taker")

_ARRAYS = {"pos", "start", "length", "pair", "rate_hz"}


def holds_handovers(path: Path) -> bool:
    """Whether a file is one of handovers."""
    try:
        with np.load(path, allow_pickle=False) as found:
            return set(found.files) >= _ARRAYS
    except (OSError, ValueError, zipfile.BadZipFile):
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
    try:
        with np.load(path, allow_pickle=False) as found:
            hands, starts, lengths = found["pos"], found["start"], found["length"]
            pairs, rate = found["pair"], float(found["rate_hz"])
    except (OSError, KeyError, ValueError, zipfile.BadZipFile) as error:
        raise DataError(
            f"cannot read {path}: {error}", expected="pos, start, length, pair and rate_hz"
        ) from error
    scale = np.array((CHESTS_APART_M, CHESTS_APART_M, 1.0))
    encounters = []
    for begin, count, pair in zip(starts, lengths, pairs, strict=True):
        both = hands[begin : begin + count].astype(float) * scale
        hand = smoothed(both[:, own], rate)
        partner = smoothed(both[:, 1 - own], rate)
        encounters.append(Encounter(hand, partner, hand[-1], "handover", False, str(pair)))
    return encounters


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
