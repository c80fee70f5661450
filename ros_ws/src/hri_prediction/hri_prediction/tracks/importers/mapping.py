"""Which markers stand for shoulder, elbow, wrist and hand tip: given, or guessed from their names."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_prediction.arm.geometry import KEYPOINTS, SIDES, FloatArray
from hri_prediction.errors import ConfigError, DataError, cut
from hri_prediction.tracks.importers.marker_sets import (
    MARKER_SETS,
    SIDE_WORDS,
    MarkerSet,
    plain,
)
from hri_prediction.tracks.importers.markers import MarkerData, bare, subject_of

_SHOWN = 40
_REQUIRED = KEYPOINTS[:3]


@dataclass(frozen=True)
class Mapping:
    """Markers of each keypoint; several are averaged.

    Attributes:
        shoulder: Rows of :attr:`.MarkerData.labels`; elbow, wrist and hand_tip likewise.
        elbow: As above.
        wrist: As above.
        hand_tip: As above; empty where there is none.
        side: ``left`` or ``right``; empty where the names do not tell.
        set_name: Marker set that fits; empty when the mapping was given.
        notes: What else could have been meant.
    """

    shoulder: tuple[int, ...]
    elbow: tuple[int, ...]
    wrist: tuple[int, ...]
    hand_tip: tuple[int, ...] = ()
    side: str = ""
    set_name: str = ""
    notes: tuple[str, ...] = ()

    def items(self) -> Iterator[tuple[str, tuple[int, ...]]]:
        """Keypoints and their markers, in the order of the keypoints."""
        return ((name, getattr(self, name)) for name in KEYPOINTS)

    def text(self, labels: tuple[str, ...]) -> str:
        """The mapping as ``--map`` takes it."""
        return ",".join(
            f"{name}=" + "+".join(labels[row] for row in rows)
            for name, rows in self.items()
            if rows
        )


def seen(data: MarkerData) -> NDArray[np.bool_]:
    """Which markers were seen when, shape (N, M)."""
    return seen_places(data.positions, data.zeros_missing)


def seen_places(positions: FloatArray, zeros_missing: bool) -> NDArray[np.bool_]:
    """Which places (N, M, 3) are there, shape (N, M): all finite, and not (0, 0, 0) where asked for."""
    found: NDArray[np.bool_] = np.asarray(np.isfinite(positions).all(axis=-1))
    if zeros_missing:
        found &= (positions != 0.0).any(axis=-1)
    return found


def mean_position(
    positions: FloatArray, present: NDArray[np.bool_], rows: tuple[int, ...]
) -> FloatArray:
    """Mean of markers; NaN where one of them was not seen, so that it never jumps.

    Args:
        positions: Shape (N, M, 3).
        present: Which of them were seen (:func:`seen`), shape (N, M).
        rows: Markers to average.

    Returns:
        Shape (N, 3), in the unit and axes of the positions.
    """
    points = positions[:, list(rows)].mean(axis=1)
    points[~present[:, list(rows)].all(axis=1)] = np.nan
    return points


def mapping_parts(text: str) -> dict[str, str]:
    """The keypoints of a mapping and what it names for each, before any file is looked at.

    Raises:
        ConfigError: when the text is malformed.
    """
    parts: dict[str, str] = {}
    for part in text.split(","):
        key, separator, names = (piece.strip() for piece in part.partition("="))
        if not (separator and names) or key not in KEYPOINTS or key in parts:
            raise ConfigError(
                f"the mapping holds {part.strip()!r}",
                expected="shoulder=…,elbow=…,wrist=…[,hand_tip=…], each once",
            )
        parts[key] = names
    missing = [key for key in _REQUIRED if key not in parts]
    if missing:
        raise ConfigError(f"the mapping has no {missing[0]}", expected="shoulder, elbow and wrist")
    return parts


def parse_mapping(text: str, data: MarkerData, subject: str = "") -> Mapping:
    """Read ``shoulder=A,elbow=B,wrist=C+D[,hand_tip=E]``.

    Labels may leave the subject away where only one has such a marker, or where ``subject`` is it.

    Raises:
        ConfigError: when the text is malformed, or a marker does not exist, is ambiguous or is named
            twice.
    """
    chosen: dict[str, tuple[int, ...]] = {}
    for key, names in mapping_parts(text).items():
        whole = names in data.labels
        pieces = [names] if whole else [name.strip() for name in names.split("+")]
        chosen[key] = tuple(_row(name, data, subject) for name in pieces)
    used: dict[int, str] = {}
    for key, rows in chosen.items():
        for row in rows:
            if row in used:
                where = f"for {used[row]} and {key}" if used[row] != key else f"twice in {key}"
                raise ConfigError(
                    f"the mapping uses the marker {data.labels[row]!r} {where}",
                    expected="each marker once",
                )
            used[row] = key
    names_used = [bare(data.labels[row]) for rows in chosen.values() for row in rows]
    return Mapping(
        shoulder=chosen["shoulder"],
        elbow=chosen["elbow"],
        wrist=chosen["wrist"],
        hand_tip=chosen.get("hand_tip", ()),
        side=_side_of(names_used),
    )


def _row(name: str, data: MarkerData, subject: str) -> int:
    if name in data.labels:
        return data.labels.index(name)
    rows = [r for r, label in enumerate(data.labels) if name.lower() == bare(label).lower()]
    own = [row for row in rows if subject and subject_of(data.labels[row]) == subject]
    rows = own or rows
    if len(rows) == 1:
        return rows[0]
    if rows:
        raise ConfigError(
            f"{len(rows)} markers are named {name!r}",
            expected="one of " + ", ".join(data.labels[row] for row in rows),
        )
    raise ConfigError(f"there is no marker {name!r}", expected="one of " + shown_labels(data))


def shown_labels(data: MarkerData) -> str:
    """The labels, as many as can be read."""
    more = len(data.labels) - _SHOWN
    return ", ".join(map(cut, data.labels[:_SHOWN])) + (f" and {more} more" if more > 0 else "")


def _side_of(names: list[str]) -> str:
    """Side that the names of markers tell, by the patterns of the sets."""
    found = {
        side
        for side in SIDES
        for word in SIDE_WORDS[side]
        for each in MARKER_SETS
        if each.sided
        for pattern in _patterns(each)
        if pattern.replace("{s}", word) in {plain(name) for name in names}
    }
    return found.pop() if len(found) == 1 else ""


def _patterns(each: MarkerSet) -> Iterator[str]:
    for key in KEYPOINTS:
        for alternative in getattr(each, key):
            yield from alternative.split("+")


def guess_mapping(data: MarkerData, side: str = "", subject: str = "") -> Mapping:
    """The arm that the names of the markers speak of.

    Args:
        data: The markers.
        side: Wanted arm; with both there and none wanted, it is the right one.
        subject: Wanted person, where the labels name several.

    Raises:
        DataError: when there is no arm, or more than one person has one.
    """
    present = seen(data)
    people = dict.fromkeys(subject_of(label) for label in data.labels)
    if subject in people:
        people = {subject: None}
    arms: dict[str, dict[str, Mapping]] = {}
    unseen: list[str] = []
    for person in people:
        rows = [r for r, label in enumerate(data.labels) if subject_of(label) == person]
        for arm_side in (side,) if side else ("right", "left"):
            arm = _arm(data, rows, arm_side, present, unseen)
            if arm is not None:
                arms.setdefault(person, {})[arm_side] = arm
    if len(arms) > 1:
        none = f", and {subject} is none of them" if subject else ""
        raise DataError(
            f"{len(arms)} people have an arm: {', '.join(arms)}{none}",
            hint="choose one with --subject",
        )
    if not arms:
        lacking = f"; {', '.join(dict.fromkeys(unseen))} never seen" if unseen else ""
        raise DataError(
            f"no {side + ' ' if side else ''}arm is recognised among the markers{lacking}",
            expected="the names of a known marker set",
            hint="give --map shoulder=…,elbow=…,wrist=…; the markers are " + shown_labels(data),
        )
    (found,) = arms.values()
    return _chosen(found)


def _chosen(found: dict[str, Mapping]) -> Mapping:
    """One of the arms of a person."""
    first, *others = found.values()
    if others and first.side:
        note = f"the {others[0].side} arm is there too: --side {others[0].side}"
        return dataclasses.replace(first, notes=(*first.notes, note))
    return first


def _arm(
    data: MarkerData,
    rows: list[int],
    side: str,
    present: NDArray[np.bool_],
    unseen: list[str],
) -> Mapping | None:
    """The arm of one person by the first set that fits; adds names that fit but are not seen."""
    by_name: dict[str, list[int]] = {}
    for row in rows:
        by_name.setdefault(plain(bare(data.labels[row])), []).append(row)
    for each in MARKER_SETS:
        if each.skeleton and data.format != "BVH":
            continue
        words = SIDE_WORDS[side] if each.sided else ("",)
        points: dict[str, tuple[int, ...]] = {}
        missed: dict[str, list[str]] = {}
        for key in KEYPOINTS:
            points[key], missed[key] = _first_seen(
                getattr(each, key), words, data, by_name, present
            )
        if all(points[key] for key in _REQUIRED):
            chosen = [row for key in KEYPOINTS for row in points[key]]
            repeats = {row: len(by_name[plain(bare(data.labels[row]))]) for row in chosen}
            notes = tuple(
                f"{data.labels[row]}: {count} markers have this name, this one is seen most"
                for row, count in repeats.items()
                if count > 1
            )
            return Mapping(
                shoulder=points["shoulder"],
                elbow=points["elbow"],
                wrist=points["wrist"],
                hand_tip=points["hand_tip"],
                side=side if each.sided else "",
                set_name=each.name,
                notes=notes,
            )
        if all(points[key] or missed[key] for key in _REQUIRED):
            unseen += [name for key in _REQUIRED if not points[key] for name in missed[key]]
    return None


def _first_seen(
    alternatives: tuple[str, ...],
    words: tuple[str, ...],
    data: MarkerData,
    by_name: dict[str, list[int]],
    present: NDArray[np.bool_],
) -> tuple[tuple[int, ...], list[str]]:
    """Markers of the first alternative that is there and was seen at some time.

    Where a name is repeated, the marker that was seen most is taken.

    Returns:
        The markers, none where no alternative fits, and the labels of those never seen together.
    """
    missed: list[str] = []
    for alternative, word in itertools.product(alternatives, words):
        names = [pattern.replace("{s}", word) for pattern in alternative.split("+")]
        if not all(name in by_name for name in names):
            continue
        rows = tuple(max(by_name[name], key=lambda r: int(present[:, r].sum())) for name in names)
        if present[:, list(rows)].all(axis=1).any():
            return rows, []
        missed += [data.labels[row] for row in rows]
    return (), missed
