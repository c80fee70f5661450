"""The arms of several people who were recorded together, for one bag on one clock."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from hri_prediction.errors import ConfigError
from hri_prediction.tracks.files import load_tracks
from hri_prediction.tracks.track import ArmTrack

_TOGETHER_S = 0.05
"""Tracks of one recording are as long as each other, but for how sampling rates cut them [s]. Whether their
first frames are the same instant no file says."""


def read_beside(files: Sequence[Path], *, bag: bool, place: str) -> list[ArmTrack]:
    """The tracks of the others in a recording.

    Args:
        files: Of one track each.
        bag: Whether a bag is to be written.
        place: The placement that is asked for.

    Raises:
        ConfigError: what is asked for does not fit.
        DataError: a file cannot be read.
    """
    if not files:
        return []
    listed = " ".join(map(str, files))
    if not bag:
        raise ConfigError(
            f"--beside {listed} with a track file as --out",
            expected="the folder of a new bag",
            hint="a track file holds one arm: import each person into one of their own",
        )
    if place.strip().lower() in ("", "auto"):
        raise ConfigError(
            f"--beside {listed} with --place {place or 'auto'}",
            expected="X,Y,Z,YAW or none",
            hint="one placement is for all of them, and nobody knows where the robot is among several",
        )
    tracks = []
    for file in files:
        own = load_tracks(file)
        if len(own) != 1:
            raise ConfigError(
                f"--beside {file} holds {len(own)} tracks", expected="that of one arm, one trial"
            )
        tracks.append(own[0])
    return tracks


def check_together(track: ArmTrack, others: Sequence[ArmTrack]) -> None:
    """Refuse tracks that cannot be of different people in one recording.

    Raises:
        ConfigError: naming whose they are, or who was recorded when.
    """
    names = [each.subject for each in (track, *others)]
    if others and (not all(names) or len(set(names)) < len(names)):
        raise ConfigError(
            f"arms of {', '.join(name or 'nobody' for name in names)}",
            expected="those of different people",
            hint="name each with --subject, also where the file of --beside was imported",
        )
    for other in others:
        if (
            abs(other.time_s[0] - track.time_s[0]) > _TOGETHER_S
            or abs(other.time_s[-1] - track.time_s[-1]) > _TOGETHER_S
        ):
            raise ConfigError(
                f"{other.subject} was recorded from {other.time_s[0]:.2f} to {other.time_s[-1]:.2f} s, "
                f"{track.subject} from {track.time_s[0]:.2f} to {track.time_s[-1]:.2f} s",
                expected="people of one recording, on one clock",
            )
