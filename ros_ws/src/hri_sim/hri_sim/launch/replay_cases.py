"""Recordings of real people to replay, and what the predictor may learn from."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from hri_prediction.errors import ConfigError
from hri_prediction.tracks.files import load_tracks
from hri_prediction.tracks.selection import nominal_reaches
from hri_prediction.tracks.track import ArmTrack

DATA_VARIABLE = "HRI_DATA_DIR"


@dataclass(frozen=True)
class ReplayCase:
    """One recording to replay, and what the predictor may learn from.

    Attributes:
        name: Short name.
        track: The recording.
        training: Recordings of others.
        task_from: What names the tasks of the library.
    """

    name: str
    track: ArmTrack
    training: list[ArmTrack]
    task_from: str


def _want(option: str, count: int, found: int, place: Path) -> None:
    """Refuse to measure fewer recordings than were asked for."""
    if found < count:
        raise ConfigError(
            f"{option} {count}, and {found} recordings in {place}",
            hint=f"{DATA_VARIABLE} must name the folder of the recordings; or ask for fewer",
        )


def dfki_cases(folder: Path, count: int) -> list[ReplayCase]:
    """Pick-and-place runs; the library learns from the other runs, cut into reaches.

    Raises:
        ConfigError: when there are fewer.
    """
    if count == 0:
        return []
    place = folder / "pickplace_dfki_qualisys" / "original"
    tracks = [track for file in sorted(place.glob("*.tsv")) for track in load_tracks(file)]
    _want("--dfki", count, len(tracks), place)
    # Spread over both subjects.
    chosen = tracks[:: max(len(tracks) // count, 1)][:count]
    return [
        ReplayCase(
            f"dfki_{track.subject}_{track.trial}".replace(" ", "_"),
            track,
            [other for other in tracks if other is not track],
            "movement",
        )
        for track in chosen
    ]


def vicon_cases(folder: Path, count: int) -> list[ReplayCase]:
    """Seated reaches, one a subject; the library learns from the other subjects.

    Raises:
        ConfigError: when there are fewer subjects.
    """
    if count == 0:
        return []
    place = folder / "reach_adl_vicon" / "reach.npz"
    groups = nominal_reaches(load_tracks(place) if place.is_file() else [])
    subjects = sorted({subject for subject, _, _ in groups})
    _want("--vicon", count, len(subjects), place)
    cases = []
    for index, subject in enumerate(subjects[:count]):
        # Alternate over tasks and sides.
        own = [group for key, group in sorted(groups.items()) if key[0] == subject]
        track = own[index % len(own)][0]
        others = [t for key, group in groups.items() if key[0] != subject for t in group]
        cases.append(
            ReplayCase(f"vicon_{subject}_{track.task}_{track.side}", track, others, "task")
        )
    return cases
