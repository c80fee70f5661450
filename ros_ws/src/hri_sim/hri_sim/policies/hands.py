"""Hands of people who were recorded together: where they come from, and whose they are."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from hri_prediction.bags.arms import arm_samples
from hri_prediction.bags.reader import BagReader
from hri_prediction.errors import DataError
from hri_prediction.tracks.files import load_tracks

FloatArray = NDArray[np.float64]

TRACK_FILES = (".npz", ".csv", ".tsv")
"""Endings of the track files of a folder."""

_TIP = 3
_LONGEST_GAP_S = 0.1
_NAMES_SHOWN = 20


@dataclass(frozen=True, eq=False)
class HandRecord:
    """One person's hand over a recording.

    Attributes:
        person: Name.
        time_s: Times (n,), increasing, on the clock of both people [s].
        hand: Hand tip (n, 3) [m]; without rows in which it was not seen.
    """

    person: str
    time_s: FloatArray
    hand: FloatArray

    def at(self, time_s: FloatArray) -> FloatArray:
        """Positions between samples (m, 3) [m]; NaN in longer gaps and outside the record."""
        found = np.full((len(time_s), 3), np.nan)
        right = np.clip(np.searchsorted(self.time_s, time_s), 1, len(self.time_s) - 1)
        near = self.time_s[right] - self.time_s[right - 1] <= _LONGEST_GAP_S + 1e-9
        inside = (time_s >= self.time_s[0]) & (time_s <= self.time_s[-1])
        found[near & inside] = PchipInterpolator(self.time_s, self.hand)(time_s[near & inside])
        return found

    def until(self, time_s: FloatArray) -> FloatArray:
        """As :meth:`at`, but held where it was seen last; NaN before it was seen at all."""
        found = self.at(time_s)
        last = np.searchsorted(self.time_s, time_s, side="right") - 1
        unseen = np.isnan(found[:, 0]) & (last >= 0)
        found[unseen] = self.hand[last[unseen]]
        return found


@dataclass(frozen=True, eq=False)
class Together:
    """Two people who were recorded at the same time.

    Attributes:
        name: Of the recording, within its file.
        task: What they did, or empty.
        hands: Of both.
    """

    name: str
    task: str
    hands: tuple[HandRecord, HandRecord]

    @property
    def pair(self) -> str:
        """Name of the two."""
        return " and ".join(sorted(record.person for record in self.hands))


def hands_together(path: Path) -> list[Together]:
    """All recordings of two people.

    Args:
        path: A bag with the arms of two bodies, a track file with tracks of two subjects in the same
            trial of a task, or a folder of track files that belong together.

    Raises:
        DataError: when it cannot be read, or no two people were recorded together.
    """
    if path.suffix == ".mcap" or any(path.glob("*.mcap")):
        return [_of_bag(path)]
    return _of_tracks(track_files(path), path)


def track_files(path: Path) -> list[Path]:
    """A file itself, or the track files of a folder.

    Raises:
        DataError: when there are none.
    """
    if not path.is_dir():
        return [path]
    found = sorted(file for file in path.iterdir() if file.suffix in TRACK_FILES)
    if not found:
        raise DataError(f"{path} holds neither a bag nor track files")
    return found


def _of_bag(path: Path) -> Together:
    records = []
    arms = arm_samples(BagReader(path))
    first_ns = min((sample.stamp_ns for found in arms.values() for sample in found), default=0)
    for (body, _), samples in sorted(arms.items()):
        stamps = np.array([sample.stamp_ns - first_ns for sample in samples]) * 1e-9
        tips = np.array([sample.keypoints[_TIP] for sample in samples])
        records.append(_record(body, stamps, tips))
    return Together("", "", _two(records, str(path)))


def _of_tracks(files: Sequence[Path], path: Path) -> list[Together]:
    trials: dict[tuple[str, int], list[HandRecord]] = {}
    for file in files:
        for track in load_tracks(file):
            records = trials.setdefault((track.task, track.trial), [])
            records.append(_record(track.subject, track.time_s, track.keypoints[:, _TIP]))
    found = {key: records for key, records in trials.items() if len(records) > 1}
    if not found:
        people = sorted(
            {record.person or "(no name)" for all_ in trials.values() for record in all_}
        )
        raise DataError(
            f"{path}: each trial holds one person only, {_shown(people)}",
            expected="tracks of two subjects with the same task and trial, on the same clock",
        )
    together = []
    for (task, trial), records in found.items():
        where = f"{path}: trial {trial}" + (f" of {task}" if task else "")
        together.append(Together(f"{task} {trial}".strip(), task, _two(records, where)))
    return together


def _record(person: str, time_s: FloatArray, tips: FloatArray) -> HandRecord:
    """Those rows that were seen, in the order of time."""
    order = np.argsort(time_s, kind="stable")
    order = order[np.isfinite(tips[order]).all(axis=1)]
    order = order[np.diff(time_s[order], prepend=-np.inf) > 0.0]
    return HandRecord(person, np.asarray(time_s[order]), np.asarray(tips[order]))


def _two(records: Sequence[HandRecord], where: str) -> tuple[HandRecord, HandRecord]:
    """Both of them.

    Raises:
        DataError: when there are not two people, or they were not recorded at the same time.
    """
    names = [record.person or "(no name)" for record in records]
    if len(names) != 2 or len(set(names)) != 2:
        people = len(set(names))
        kind = "people" if people == len(names) else "arms"
        text = "one person only" if people == 1 else f"{len(names)} {kind}"
        raise DataError(
            f"{where} holds {text if names else 'nobody'}: {_shown(names)}",
            expected="one arm of each of two people",
        )
    for record in records:
        if len(record.time_s) < 2:
            raise DataError(f"{where}: the hand tip of {record.person} was never seen")
    one, other = records
    if min(one.time_s[-1], other.time_s[-1]) <= max(one.time_s[0], other.time_s[0]):
        raise DataError(
            f"{where}: {one.person} was recorded from {one.time_s[0]:.1f} to "
            f"{one.time_s[-1]:.1f} s, {other.person} from {other.time_s[0]:.1f} to "
            f"{other.time_s[-1]:.1f} s",
            expected="two people at the same time, on the same clock",
        )
    return one, other


def _shown(names: Iterable[str]) -> str:
    """Some names."""
    all_ = list(names)
    more = ["..."] if len(all_) > _NAMES_SHOWN else []
    return ", ".join([*all_[:_NAMES_SHOWN], *more])
