"""Encounters of recordings of two people: what policies learn from."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hri_planner.rnn.encounters import Encounter, in_all_directions, smoothed
from hri_planner.rnn.model import STEP_S
from hri_prediction.errors import DataError
from hri_prediction.files.content import open_file
from hri_prediction.tracks.segmentation import find_reaches
from hri_sim.policies.datasets import VALIDATION_SHARE, DataSet
from hri_sim.policies.handovers import PEOPLE, holds_handovers, load_handovers
from hri_sim.policies.hands import HandRecord, Together, hands_together

TEST_SHARE = 0.1
"""Of the pairs, or of the reaches, that nothing is learnt from."""

LEAST_WAY_M = 0.05
"""Shorter movements are no reaches."""

_RATE_HZ = 250.0
_BEFORE_S = 0.1
_SETTLING_S = 1.5
_REST_S = 0.05
"""A reach after which the hand does not rest for so long has no goal."""
_MARGIN_S = 0.3
"""Before the reach, for the low-pass, which is bad at the ends."""
_AT_REST_M = 0.004
_RESTING_STEPS = 4
_LEAST_ROWS = 32
_PIECE = 1 << 20


@dataclass(frozen=True, eq=False)
class Recorded:
    """An encounter, and what it must not be parted from.

    Attributes:
        encounter: One reach of a learner.
        group: Same for encounters at the same time; these are learnt from all, or none.
    """

    encounter: Encounter
    group: str


def load_encounters(path: Path, learner: str = "") -> list[Recorded]:
    """Encounters of a recording, each person's reaches or one's.

    A reach begins and ends where the learner's hand rests, and its goal is where it then is.
    ``backward`` is not known of recordings and False.

    Args:
        path: As :func:`.hands_together` takes it, or the handovers' ``hands.npz``, of which the taker
            learns unless it is told otherwise.
        learner: Name of a person; empty: both by turns.

    Raises:
        DataError: when no two people were recorded together, the learner is not one of them, or there
            are no reaches.
    """
    if path.suffix == ".npz" and holds_handovers(path):
        _check_learner(path, learner, PEOPLE)
        found = load_handovers(path, learner or PEOPLE[1])
        return [Recorded(one, str(index)) for index, one in enumerate(found)]
    recordings = hands_together(path)
    _check_learner(path, learner, {r.person for one in recordings for r in one.hands})
    found_all: list[Recorded] = []
    restless = 0
    for together in recordings:
        encounters, without_rest = _of_recording(together, learner)
        found_all += encounters
        restless += without_rest
    if not found_all:
        raise DataError(
            f"{path}: no reaches found"
            + (f" ({restless} movements did not end at rest)" if restless else ""),
            expected=f"a hand that moves {LEAST_WAY_M:g} m or more from rest to rest, "
            "while the other person's is seen",
        )
    return found_all


def _check_learner(path: Path, learner: str, people: Sequence[str] | set[str]) -> None:
    if learner and learner not in people:
        raise DataError(
            f"{path}: nobody is called {learner!r}", expected="one of " + ", ".join(sorted(people))
        )


def _of_recording(together: Together, learner: str) -> tuple[list[Recorded], int]:
    """Encounters, and how many movements did not end at rest."""
    spans: list[tuple[float, float, Encounter]] = []
    restless = 0
    for own, other in (together.hands, together.hands[::-1]):
        if learner and own.person != learner:
            continue
        reaches = find_reaches(own.time_s, own.hand)
        for index, reach in enumerate(reaches):
            following = reaches[index + 1].onset_s if index + 1 < len(reaches) else np.inf
            if following - reach.end_s < _REST_S:
                restless += 1
                continue
            before = reaches[index - 1].end_s if index else -np.inf
            begin = max(reach.onset_s - _BEFORE_S, before, own.time_s[0])
            end = min(reach.end_s + _SETTLING_S, following, own.time_s[-1])
            one = _encounter(own, other, begin, end, together)
            if one is not None:
                spans.append((begin, begin + len(one) * STEP_S, one))
    return _grouped(spans, together), restless


def _encounter(
    own: HandRecord, other: HandRecord, begin: float, end: float, together: Together
) -> Encounter | None:
    """One reach; none when it is short, or a hand was not seen.

    Args:
        own: Of the learner.
        other: Of the partner.
        begin: Of the reach [s].
        end: When the hand has come to rest for sure [s].
        together: What it is part of.
    """
    margin = round(_MARGIN_S / STEP_S)
    while margin and begin - margin * STEP_S < max(own.time_s[0], other.time_s[0]):
        margin -= 1
    times = np.arange(begin - margin * STEP_S, end + 1e-9, 1.0 / _RATE_HZ)
    hand, partner = own.at(times), other.until(times)
    if len(times) < _LEAST_ROWS or np.isnan(hand).any() or np.isnan(partner).any():
        return None
    path, beside = (smoothed(one, _RATE_HZ)[margin:] for one in (hand, partner))
    rest = path[-_RESTING_STEPS:].mean(axis=0)
    away = np.linalg.norm(path - rest, axis=1) > _AT_REST_M
    last = int(np.flatnonzero(away)[-1]) if away.any() else 0
    count = min(last + _RESTING_STEPS, len(path))
    if other.time_s[-1] < begin or np.linalg.norm(path[count - 1] - path[0]) < LEAST_WAY_M:
        return None
    return Encounter(
        path[:count],
        beside[:count],
        path[count - 1],
        together.task or "recorded",
        False,
        together.pair,
    )


def _grouped(spans: list[tuple[float, float, Encounter]], together: Together) -> list[Recorded]:
    """Encounters that overlap in time are of one group."""
    found = []
    group, busy_until = -1, -np.inf
    for begin, end, one in sorted(spans, key=lambda span: span[:2]):
        if begin >= busy_until:
            group += 1
        busy_until = max(busy_until, end)
        found.append(Recorded(one, f"{together.pair}, {together.name}, {group}"))
    return found


def recorded_set(found: Sequence[Recorded], seed: int) -> DataSet:
    """Encounters by what they are for.

    Where there are several pairs, whole pairs are kept for the test, else reaches.

    Args:
        found: All encounters.
        seed: Of the shuffle.

    Raises:
        DataError: when there are too few to be divided.
    """
    rng = np.random.default_rng((seed, 0))
    pairs = sorted({one.encounter.pair for one in found})
    if len(pairs) > 1:
        kept = _some(pairs, TEST_SHARE, rng)
        test = [one for one in found if one.encounter.pair in kept]
    else:
        kept = _some(sorted({one.group for one in found}), TEST_SHARE, rng)
        test = [one for one in found if one.group in kept]
    others = [one for one in found if not any(one is other for other in test)]
    groups = sorted({one.group for one in others})
    if len(groups) < 2:
        raise DataError(
            f"{len(found)} reaches of {len(pairs)} pairs",
            expected="reaches at three different times at least, to learn from, to stop by and to test",
        )
    held = _some(groups, VALIDATION_SHARE, rng)
    return DataSet(
        tuple(in_all_directions([one.encounter for one in others if one.group not in held])),
        tuple(one.encounter for one in others if one.group in held),
        tuple(one.encounter for one in test),
    )


def _some(names: Sequence[str], share: float, rng: np.random.Generator) -> set[str]:
    """A share of the names drawn at random, at least one."""
    count = max(round(share * len(names)), 1)
    return {names[index] for index in rng.permutation(len(names))[:count]}


def recording_hash(path: Path) -> str:
    """Hash of a recording's content, whatever its name.

    Raises:
        DataError: when it cannot be read.
    """
    digest = hashlib.sha256()
    try:
        files = sorted(p for p in path.rglob("*") if p.is_file()) if path.is_dir() else [path]
        for file in files:
            with open_file(file) as stream:
                while piece := stream.read(_PIECE):
                    digest.update(piece)
    except OSError as error:
        raise DataError(f"cannot read {path}: {error.strerror}") from error
    return digest.hexdigest()[:16]
