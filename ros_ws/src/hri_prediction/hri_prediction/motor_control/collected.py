"""Recorded reaches of several people, brought to the models of their arms."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from hri_prediction.errors import ConfigError, DataError
from hri_prediction.evaluation.recordings import Recording
from hri_prediction.motor_control.arm_model import ArmModel
from hri_prediction.motor_control.observed import ObservedReach
from hri_prediction.motor_control.seen import arm_of, mean_of, observe
from hri_prediction.motor_control.whole import WholeReach, observe_whole
from hri_prediction.tracks.placement import Placement
from hri_prediction.tracks.seating import facing_deg
from hri_prediction.tracks.track import ArmTrack

AUTO = "auto"
_Seen = tuple[ObservedReach, WholeReach | None]


@dataclass(frozen=True, eq=False)
class CollectedReach:
    """A reach to explain.

    Attributes:
        observed: What was seen.
        arm: Whose arm it was.
        facing_deg: Where the person was taken to face in the axes of the recording.
        person: Who it was, and which arm.
        task: Which reach it is; repetitions have the same.
        whole: The same from rest to rest, where it is known to be.
    """

    observed: ObservedReach
    arm: ArmModel
    facing_deg: float
    person: str
    task: str
    whole: WholeReach | None = None


@dataclass(frozen=True)
class People:
    """What is known of people and wanted of their reaches.

    Attributes:
        facing: Where they face in the axes of the recording [deg] from x towards y, or ``auto``: the
            quarter turn nearest to where a person's arms point in the mean of all that was recorded.
        height_m: Of all.
        mass_kg: Of all.
        convention: Of the joint angles.
        average: Whether to take the mean of the repetitions of a person, side and task.
        whole: Whether reaches are known to go from rest to rest, and are not to be cut.
    """

    facing: str
    height_m: float
    mass_kg: float
    convention: str
    average: bool
    whole: bool = False


def collect(
    recordings: Sequence[Recording],
    people: People,
    progress: Callable[[int, int], None] = lambda done, of: None,
) -> tuple[list[CollectedReach], list[str]]:
    """Bring recorded reaches to the arm models of the people who made them.

    Args:
        recordings: With their reaches.
        people: What is known of who made them.
        progress: Called with recordings done, and their number.

    Returns:
        The reaches, and a line for each that cannot be used, and each track without any.

    Raises:
        ConfigError: ``facing`` is no angle.
        DataError: means are asked for of tracks that have no subject or no task.
    """
    by_person: dict[str, list[ArmTrack]] = defaultdict(list)
    persons = [_person(recording.track, index) for index, recording in enumerate(recordings)]
    for recording, person in zip(recordings, persons, strict=True):
        track = recording.track
        if people.average and not (track.subject and track.task):
            raise DataError(
                f"{track.source or 'a track'} has no subject or no task",
                expected="both, to know which reaches are repetitions of each other",
                hint="leave out --average",
            )
        by_person[person].append(track)
    groups: dict[tuple[str, str, str, int], list[_Seen]] = defaultdict(list)
    of_group: dict[tuple[str, str, str, int], tuple[ArmModel, float]] = {}
    skipped = []
    arms: dict[tuple[str, str], ArmModel] = {}
    facings: dict[str, float] = {}
    for index, (recording, person) in enumerate(zip(recordings, persons, strict=True)):
        progress(index, len(recordings))
        track = recording.track
        parts = (person, track.side, track.task)
        trial = " ".join((*(part for part in parts if part), str(track.trial)))
        skipped += [f"{trial}: {line}" for line in recording.refused]
        if not recording.reaches and not recording.refused:
            skipped.append(f"{trial}: no reach is found in it")
        for number, reach in zip(recording.numbers, recording.reaches, strict=True):
            name = f"{trial}.{number}"
            try:
                if person not in facings:
                    facings[person] = _facing(by_person[person], people.facing)
                facing = facings[person]
                if (person, track.side) not in arms:
                    own = [each for each in by_person[person] if each.side == track.side]
                    arms[person, track.side] = arm_of(
                        own,
                        height_m=people.height_m,
                        mass_kg=people.mass_kg,
                        convention=people.convention,
                    )
                arm = arms[person, track.side]
                where = (track, reach.onset_s, reach.end_s, arm)
                toward = math.radians(facing)
                seen: _Seen
                if people.whole:
                    whole = observe_whole(*where, facing_rad=toward, name=name)
                    seen = whole.between, whole
                else:
                    seen = observe(*where, facing_rad=toward, name=name), None
            except DataError as error:
                text = str(error)
                skipped.append(text if text.startswith(name) else f"{name}: {text}")
                continue
            # The second reach of a recording is a repetition of the second of another.
            key = (person, track.side, track.task, number)
            groups[key].append(seen)
            of_group[key] = arm, facing
    progress(len(recordings), len(recordings))
    found = []
    for key, reaches in groups.items():
        arm, facing = of_group[key]
        person, side, task, number = key
        whose, which = f"{person} {side}", f"{task}.{number}"
        if not people.average:
            # Without a task nobody knows what is a repetition of what.
            found += [
                CollectedReach(
                    each,
                    arm,
                    facing,
                    whose,
                    which if task else f"{which}.{index}",
                    whole,
                )
                for index, (each, whole) in enumerate(reaches)
            ]
            continue
        name = " ".join(
            part for part in (person, side, task, str(number) if number else "") if part
        )
        try:
            mean = mean_of([each for each, _ in reaches], arm, name)
            found.append(CollectedReach(mean, arm, facing, whose, which))
        except DataError as error:
            skipped.append(str(error))
    return found, skipped


def _person(track: ArmTrack, index: int) -> str:
    """Who it is; of a track without a name, nobody else."""
    return track.subject or track.source or f"recording {index}"


def _facing(tracks: Sequence[ArmTrack], given: str) -> float:
    """Where a person faces in the axes of the recordings [deg]."""
    if given == AUTO:
        try:
            return facing_deg(tracks, Placement())
        except DataError as error:
            raise DataError(
                f"{error.problem}: nobody knows where this person faces",
                expected=error.expected,
                hint="say it: --facing DEGREES, from x towards y",
            ) from error
    try:
        angle = float(given)
    except ValueError:
        angle = math.nan
    if not math.isfinite(angle):
        raise ConfigError(f"--facing {given}", expected="auto, or degrees from x towards y")
    return angle
