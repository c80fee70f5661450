"""Arms in bags: which topics hold them, and their samples."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from hri_prediction.bags.reader import BagReader
from hri_prediction.errors import DataError
from hri_prediction.tracks.track import ArmSample, ArmTrack

ARM_TYPE = "hri_msgs/msg/HumanArm"
TRACKED = re.compile(r"^(?:.*/)?humans/bodies/(?P<body>[^/]+)/arm$")
"""Topic of a tracked arm."""
TRUE = re.compile(r"^(?:.*/)?sim/bodies/(?P<body>[^/]+)/arm$")
"""Topic of the noise-free arm of a simulated person."""


def arm_samples(
    bag: BagReader, pattern: re.Pattern[str] = TRACKED, *, one_frame: bool = False
) -> dict[tuple[str, str], list[ArmSample]]:
    """Samples of every arm in a bag, in the order of receipt.

    Args:
        bag: The bag.
        pattern: Topics to take, with a group ``body``.
        one_frame: Whether all must be in the same frame, as where distances between arms are taken.

    Returns:
        Samples by body id and side; an arm of which nothing was recorded is absent.

    Raises:
        DataError: the bag is damaged, its arms cannot be decoded here, or frames are not one.
    """
    found: dict[tuple[str, str], list[ArmSample]] = {}
    frames: dict[str, str] = {}
    for body, sample, frame in _samples(bag, pattern):
        frames.setdefault(frame, body)
        if one_frame and len(frames) > 1:
            told = " and ".join(f"{name!r} ({whose})" for name, whose in frames.items())
            raise DataError(
                f"{bag.path} has arms in frames {told}",
                expected="one frame",
                hint="distances between them mean nothing; transform one of them first",
            )
        found.setdefault((body, sample.side), []).append(sample)
    return found


def _samples(bag: BagReader, pattern: re.Pattern[str]) -> Iterator[tuple[str, ArmSample, str]]:
    """Body id, sample and its frame, in the order of receipt."""
    topics = {
        name: match["body"]
        for name, info in bag.topics.items()
        if info.type == ARM_TYPE and (match := pattern.match(name))
    }
    for message in bag.messages(topics) if topics else ():
        try:
            arm = message.decode()
            sample = sample_of(arm)
        except DataError as error:
            raise DataError(
                f"{bag.path}: {error.problem}", expected=error.expected, hint=error.hint
            ) from error
        yield topics[message.topic], sample, arm.header.frame_id


def sample_of(message: Any) -> ArmSample:
    """Sample of a HumanArm message, whatever its frame.

    Raises:
        DataError: its side is neither left nor right.
    """
    points = np.array(message.keypoints, dtype=float).reshape(4, 3)
    valid = np.array(message.valid, dtype=bool) & np.isfinite(points).all(axis=1)
    stamp = message.header.stamp
    return ArmSample(stamp.sec * 10**9 + stamp.nanosec, points, valid, message.side)


def arm_tracks(
    path: str | Path, pattern: re.Pattern[str] = TRACKED, *, max_gap_s: float = 1.0
) -> list[ArmTrack]:
    """Continuous tracks of the arms in a bag, for training and evaluation.

    A track ends where stamps go back, or after a gap; both arms of a body have tracks of their own. Times
    count from the first sample of the track.

    Args:
        path: Bag folder or .mcap file.
        pattern: Topics to take.
        max_gap_s: Longest gap within a track [s].

    Returns:
        By body, then by their begin; ``subject`` is the body id, ``task`` what the bag says it is (as
        :func:`.write_arm_bag` notes it) or empty, and ``trial`` counts from 0. Pieces of fewer than
        two samples are left out.

    Raises:
        DataError: the bag is damaged, or holds no such arm.
    """
    bag = BagReader(path)
    tracks: list[ArmTrack] = []
    bodies: dict[str, list[list[ArmSample]]] = {}
    newest: dict[tuple[str, str], list[ArmSample]] = {}
    for body, sample, _ in _samples(bag, pattern):
        piece = newest.get((body, sample.side))
        step = sample.stamp_ns - piece[-1].stamp_ns if piece else -1
        if step == 0:
            continue
        if piece is None or not 0 < step <= max_gap_s * 1e9:
            piece = newest[body, sample.side] = []
            bodies.setdefault(body, []).append(piece)
        piece.append(sample)
    for body, pieces in sorted(bodies.items()):
        whole = [piece for piece in pieces if len(piece) > 1]
        for trial, piece in enumerate(whole):
            stamps = np.array([sample.stamp_ns for sample in piece])
            tracks.append(
                ArmTrack(
                    time_s=(stamps - stamps[0]) * 1e-9,
                    keypoints=np.array([sample.keypoints for sample in piece]),
                    side=piece[0].side,
                    subject=body,
                    task=bag.custom_data.get("task", ""),
                    trial=trial,
                    source=f"{Path(path).name} at {stamps[0]} ns",
                )
            )
    if not tracks:
        raise DataError(
            f"{path} holds no arm on topics like {pattern.pattern}",
            expected=f"messages of type {ARM_TYPE}",
        )
    return tracks
