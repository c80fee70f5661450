"""Recordings of two people with what they did: a file that lists bags, cases and people.

sessions:
  - {bag: bags/s1_case_7, case: 7, subject: s1, position: frontal}
  - {bag: bags/s2_case_7, case: 7, subject: s2, bodies: [anna, ben], side: left}
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from hri_prediction.arm.geometry import SIDES
from hri_prediction.bags.arms import arm_samples
from hri_prediction.bags.reader import BagReader
from hri_prediction.errors import DataError, HriError, shown
from hri_prediction.files.values import read_yaml
from hri_prediction.ontology.cases import find_case
from hri_prediction.ontology.config import WatchConfig
from hri_prediction.ontology.segment import Segment
from hri_prediction.ontology.table import SegmentTable, table_of
from hri_prediction.ontology.watch import BACK_NS, DyadWatch
from hri_prediction.tracks.rate import check_rate
from hri_prediction.tracks.track import ArmSample, ArmTrack

SESSIONS = "sessions.yaml"
_EXPECTED = "sessions: [{bag: FOLDER, case: 1 to 20, subject: NAME, position: NAME, …}, …]"
_OPTIONAL = {"position": "", "bodies": (), "side": "right"}


@dataclass(frozen=True)
class RecordedSession:
    """A recording of two people who did one thing.

    Attributes:
        bag: Its folder or file.
        case: Number of the case.
        subject: Who of the two it is that changes from dyad to dyad.
        position: How they were placed; may be empty.
        bodies: Ids of the two in the bag; empty: there are no others.
        side: Which arm of both.
    """

    bag: Path
    case: int
    subject: str
    position: str = ""
    bodies: tuple[str, ...] = ()
    side: str = "right"


@dataclass(frozen=True)
class Refused:
    """Movements of a recording that nothing can be said of.

    Attributes:
        bag: Its folder or file.
        taken: How many others there are.
        reasons: Why, and how often.
    """

    bag: Path
    taken: int
    reasons: tuple[tuple[str, int], ...]

    @property
    def count(self) -> int:
        """How many."""
        return sum(number for _, number in self.reasons)

    def line(self) -> str:
        """In words."""
        why = ", ".join(f"{number} {reason}" for reason, number in self.reasons)
        return (
            f"{self.bag.name}: {self.count} of {self.count + self.taken} movements refused: {why}"
        )


def read_sessions(path: str | Path) -> list[RecordedSession]:
    """The sessions that a file lists; bags are sought from its folder on.

    Args:
        path: The file, or a folder that holds ``sessions.yaml``.

    Raises:
        ConfigError: when it cannot be read.
        DataError: naming the entry that is wrong, and how.
    """
    file = Path(path) / SESSIONS if Path(path).is_dir() else Path(path)
    content = read_yaml(file, expected=_EXPECTED)
    entries = content.get("sessions") if isinstance(content, dict) else None
    if not isinstance(entries, list) or not entries:
        raise DataError(f"{file} lists no sessions", expected=_EXPECTED)
    found: list[RecordedSession] = []
    for number, entry in enumerate(entries, start=1):
        try:
            session = _session(entry, file.parent)
            _check_new(session, found)
            found.append(session)
        except HriError as error:
            raise DataError(
                f"{file}: session {number}: {error.problem}", expected=error.expected
            ) from error
    return found


def _check_new(session: RecordedSession, before: Sequence[RecordedSession]) -> None:
    """Refuse what is listed twice: whatever is left out of training would be learnt all the same.

    Raises:
        DataError: naming the other one.
    """
    for number, other in enumerate(before, start=1):
        same = other.bag.resolve() == session.bag.resolve() and other.side == session.side
        # Who names no bodies means those two that the bag has.
        either = not other.bodies or not session.bodies
        if same and (either or set(other.bodies) == set(session.bodies)):
            raise DataError(
                f"{session.bag} is that of session {number} too",
                expected="each recording of two people once",
            )


def _session(entry: Any, folder: Path) -> RecordedSession:
    if not isinstance(entry, dict):
        raise DataError(shown(entry), expected="bag, case and subject by name")
    unknown = sorted(str(key) for key in entry.keys() - {"bag", "case", "subject", *_OPTIONAL})
    missing = [key for key in ("bag", "case", "subject") if key not in entry]
    if unknown or missing:
        what = f"no {missing[0]}" if missing else f"unknown {unknown[0]!r}"
        known = ", ".join(("bag", "case", "subject", *_OPTIONAL))
        raise DataError(what, expected=known)
    values = {**_OPTIONAL, **entry}
    bodies, side = values["bodies"], values["side"]
    if not (
        isinstance(bodies, (list, tuple))
        and len(bodies) in (0, 2)
        and len(set(map(str, bodies))) == len(bodies)
        and all(isinstance(body, (str, int)) for body in bodies)
    ):
        raise DataError(f"bodies {shown(bodies)}", expected="two different ids")
    if side not in SIDES:
        raise DataError(f"side {shown(side)}", expected="left or right")
    return RecordedSession(
        folder / str(values["bag"]),
        find_case(values["case"]).number,
        str(values["subject"]),
        str(values["position"]),
        tuple(map(str, bodies)),
        side,
    )


def write_sessions(path: Path, sessions: Sequence[Mapping[str, Any]]) -> None:
    """Write such a file."""
    path.write_text(yaml.safe_dump({"sessions": [dict(one) for one in sessions]}, sort_keys=False))


def segments_of_bag(
    bag: str | Path,
    bodies: Sequence[str] = (),
    side: str = "right",
    config: WatchConfig | None = None,
) -> tuple[tuple[str, str], list[Segment]]:
    """The segments of two people in a bag, as the interaction monitor finds them live.

    Args:
        bag: Folder or .mcap file.
        bodies: Ids of the two; empty: there must be no others.
        side: Which arm of both.
        config: Of the features.

    Returns:
        Ids of the two, and the segments.

    Raises:
        DataError: when the bag cannot be read, does not hold these two in one frame, or the stamps of one
            of them go back and those of the other do not.
    """
    pair, samples = _two_arms(bag, bodies, side)
    watch = DyadWatch(config)
    found: list[Segment] = []
    for take in zip(*_takes(bag, pair, samples), strict=True):
        watch.restart()
        for agent, sample in _by_stamp(take):
            found += watch.push(agent, sample)
        found += watch.finish()
    return pair, found


def tracks_of_bag(
    bag: str | Path, bodies: Sequence[str] = (), side: str = "right"
) -> tuple[ArmTrack, ArmTrack]:
    """The arms of two people in a bag as tracks on one clock; arguments as :func:`segments_of_bag`.

    Raises:
        DataError: likewise, where stamps go back, and where samples are too few a second.
    """
    pair, samples = _two_arms(bag, bodies, side)
    takes = len(_takes(bag, pair, samples)[0])
    if takes > 1:
        raise DataError(
            f"stamps in {bag} go back: it holds {takes} takes",
            expected="one",
            hint="record each take in a bag of its own",
        )
    first_ns = min(own[0].stamp_ns for own in samples)
    tracks = []
    for name, own in zip(pair, samples, strict=True):
        stamps, rows = np.unique([sample.stamp_ns for sample in own], return_index=True)
        tracks.append(
            ArmTrack(
                (stamps - first_ns) * 1e-9,
                np.array([own[row].keypoints for row in rows]),
                side=side,
                subject=name,
                source=str(bag),
            )
        )
        check_rate(tracks[-1], f"{bag}: {name}")
    return tracks[0], tracks[1]


def _two_arms(
    bag: str | Path, bodies: Sequence[str], side: str
) -> tuple[tuple[str, str], list[list[ArmSample]]]:
    """Ids of two people in a bag, and the samples of their arms."""
    arms = arm_samples(BagReader(bag), one_frame=True)
    there = sorted({body for body, own in arms if own == side})
    names = tuple(bodies) or tuple(there)
    if len(names) != 2 or not set(names) <= set(there):
        other = sorted({body for body, own in arms if own != side})
        besides = f", and other ones of {', '.join(other)}" if other else ""
        raise DataError(
            f"{bag} holds the {side} arms of {', '.join(there) or 'nobody'}{besides}",
            expected=" and ".join(bodies) if bodies else "those of two people",
            hint="" if len(there) < 2 or bodies else "name two of them: bodies: [ONE, OTHER]",
        )
    return (names[0], names[1]), [arms[name, side] for name in names]


def _takes(
    bag: str | Path, pair: tuple[str, str], samples: Sequence[Sequence[ArmSample]]
) -> list[list[list[ArmSample]]]:
    """The samples of each body, parted where stamps go back, as a monitor begins anew there."""
    parted = []
    for own in samples:
        pieces: list[list[ArmSample]] = [[]]
        newest_ns = own[0].stamp_ns
        for sample in own:
            if newest_ns - sample.stamp_ns > BACK_NS:
                pieces.append([])
                newest_ns = sample.stamp_ns
            newest_ns = max(newest_ns, sample.stamp_ns)
            pieces[-1].append(sample)
        parted.append(pieces)
    counts = [len(pieces) - 1 for pieces in parted]
    if counts[0] != counts[1]:
        told = ", ".join(f"{who} {count}" for who, count in zip(pair, counts, strict=True))
        raise DataError(
            f"stamps in {bag} go back, and not of both as often ({told} times)",
            expected="two bodies on one clock",
            hint="record each take in a bag of its own",
        )
    return parted


def _by_stamp(samples: Sequence[Sequence[ArmSample]]) -> list[tuple[int, ArmSample]]:
    items = [(agent, sample) for agent, own in enumerate(samples) for sample in own]
    order = np.argsort([sample.stamp_ns for _, sample in items], kind="stable")
    return [items[index] for index in order]


def table_of_recording(session: RecordedSession, number: int) -> tuple[SegmentTable, Refused]:
    """The segments of a session, and why other movements are none.

    Args:
        session: Which.
        number: What it is called in the table.
    """
    _, segments = segments_of_bag(session.bag, session.bodies, session.side)
    rows = [segment.features for segment in segments if segment.features is not None]
    count = len(rows)
    table = table_of(
        rows,
        [session.case] * count,
        [session.subject] * count,
        [session.position] * count,
        [number] * count,
    )
    kinds = Counter(one.kind for one in segments if one.features is None)
    return table, Refused(session.bag, count, tuple(sorted(kinds.items())))
