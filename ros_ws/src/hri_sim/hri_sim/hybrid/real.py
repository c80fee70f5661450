"""The same comparison on recorded reaches: each reach of a person and a target is the first one in turn."""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import DataError, HriError
from hri_prediction.evaluation.recordings import Recording, load_recordings
from hri_prediction.hybrid.body import BodyArm
from hri_prediction.hybrid.config import HybridConfig
from hri_prediction.hybrid.person import HybridPerson, Rest, SeenReach
from hri_prediction.hybrid.task import TaskKey
from hri_prediction.hybrid.weight_file import load_process
from hri_prediction.hybrid.weight_process import WeightProcess
from hri_prediction.hybrid.why import Why
from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.prediction.library import demonstration
from hri_prediction.tracks.placement import Placement
from hri_prediction.tracks.seating import facing_deg
from hri_prediction.tracks.segmentation import SegmentationConfig
from hri_sim.hybrid.first_guesses import GUESSES, OPTIMAL, Guess, other_guesses
from hri_sim.hybrid.scores import calibration, told
from hri_sim.hybrid.trial import Judged

Array = NDArray[np.float64]

SOURCE = Path("reach_adl_vicon/reach.npz")


@dataclass(frozen=True, eq=False)
class Repeated:
    """Repetitions of one reach of one person.

    Attributes:
        person: Name.
        target: Name.
        reaches: In the order in which they were recorded.
        tip: Where the target is taken to be (3,) [m], from the shoulder: the median of where the wrist
            ends. Nobody wrote down where it was. Hands are left out, as in the thesis.
    """

    person: str
    target: str
    reaches: tuple[SeenReach, ...]
    tip: Array


def read(file: Path) -> tuple[list[Repeated], list[str]]:
    """Repetitions of all people, and a line for each reach that cannot be used.

    Raises:
        DataError: the file cannot be read, or holds no reach that can be used.
    """
    recordings = load_recordings(file, SegmentationConfig())
    groups: dict[tuple[str, str, str], list[SeenReach]] = defaultdict(list)
    skipped: list[str] = []
    bodies: dict[tuple[str, str], BodyArm] = {}
    for recording in recordings:
        track = recording.track
        who = track.subject, track.side
        try:
            if who not in bodies:
                bodies[who] = _body(recordings, *who)
            for reach in recording.reaches[:1]:
                seen = _seen(recording, bodies[who], reach.onset_s, reach.end_s)
                groups[track.subject, track.side, track.task].append(seen)
        except DataError as error:
            skipped.append(f"{track.subject} {track.side} {track.task} {track.trial}: {error}")
    found = []
    for (person, side, task), reaches in sorted(groups.items()):
        if len(reaches) < 3:
            skipped.append(f"{person} {side} {task}: {len(reaches)} reaches")
            continue
        tip = np.median([reach.end_tip - reach.shoulder for reach in reaches], axis=0)
        found.append(Repeated(f"{person} {side}", task, tuple(reaches), tip))
    if not found:
        raise DataError(f"no reach of {file} can be used", expected="three of one kind at least")
    return found, skipped


def _body(recordings: list[Recording], subject: str, side: str) -> BodyArm:
    tracks = [r.track for r in recordings if r.track.subject == subject]
    own = np.concatenate([track.keypoints for track in tracks if track.side == side])
    facing = math.radians(facing_deg(tracks, Placement()))
    return replace(BodyArm.measured(own, side, facing, 0.0), hand_m=0.0)


def _seen(recording: Recording, body: BodyArm, onset_s: float, end_s: float) -> SeenReach:
    track = recording.track
    demo = demonstration(track, onset_s, end_s, 61)
    seen = np.isfinite(track.keypoints[:, 0]).all(axis=1)
    shoulder = np.array(
        [np.interp(onset_s, track.time_s[seen], track.keypoints[seen, 0, k]) for k in range(3)]
    )
    first, last = demo.values[0, 3:] + shoulder, demo.values[-1, 3:] + shoulder
    return SeenReach(body, demo.phases, demo.values, shoulder, first, last, end_s - onset_s)


@dataclass(frozen=True, eq=False)
class RealCourse:
    """What came of recorded reaches.

    Attributes:
        judged: Scores, with target and duration told.
        divergences: Of each update, a row for each person and target.
        whys: What explained their mean paths, by person and target; or why nothing did.
    """

    judged: list[Judged]
    divergences: list[list[float]]
    whys: dict[tuple[str, str], Why | str]


def run_real(repeated: list[Repeated]) -> RealCourse:
    """Learn the reaches of each person one by one, beginning with each of them in turn."""
    judged: list[Judged] = []
    divergences: list[list[float]] = []
    whys: dict[tuple[str, str], Why | str] = {}
    for each in repeated:
        alike = [
            other
            for other in repeated
            if other.target == each.target
            and other.person.split()[1] == each.person.split()[1]
            and other.person != each.person
        ]
        paths = [np.mean([reach.values for reach in other.reaches], axis=0) for other in alike]
        if not paths:
            continue
        count = len(each.reaches)
        for first in range(count):
            order = [each.reaches[(first + k) % count] for k in range(count)]
            begun = _begin(each, order[0], paths)
            if isinstance(begun, str):
                whys[each.person, each.target] = begun
                break
            person, key, states = begun
            for guess in GUESSES:
                state = states[guess]
                for seen, reach in enumerate(order):
                    score = told(state.rules.model(state.task, *person.usual_duration()), reach)
                    judged.append(
                        Judged(
                            each.person, each.target, guess, seen, score.warped_m, score.end_m,
                            math.nan, math.nan, calibration([score]), None,
                        )
                    )  # fmt: skip
                    new = state.rules.updated(
                        state.task, reach.phases, reach.values, reach.duration_s
                    )
                    state = Guess(state.rules, new)
                states[guess] = state
            if first == 0:
                divergences.append(list(states[OPTIMAL].task.divergences))
                person.tasks[key] = states[OPTIMAL].task
                try:
                    whys[each.person, each.target] = person.explain(key)
                except HriError as error:
                    whys[each.person, each.target] = str(error)
    return RealCourse(judged, divergences, whys)


def first_guess(
    each: Repeated, reach: SeenReach, people: WeightProcess
) -> tuple[HybridPerson, TaskKey]:
    """What optimal control expects from where an arm rests before its first reach.

    Args:
        each: Whose target it is.
        reach: Where it begins.
        people: Which weights are expected of anybody.

    Raises:
        HriError: nothing can be expected.
    """
    person = HybridPerson({each.target: each.tip}, people, PredictorConfig(), HybridConfig())
    points = np.zeros((4, 3))
    points[1], points[2] = reach.values[0, :3], reach.values[0, 3:]
    points[3] = reach.start_tip - reach.shoulder
    person.at_rest(Rest(reach.body, points))
    (key,) = person.tasks
    return person, key


def _begin(
    each: Repeated, reach: SeenReach, paths: list[Array]
) -> tuple[HybridPerson, TaskKey, dict[str, Guess]] | str:
    """All first guesses; or why there are none."""
    try:
        people = load_process()
        person, key = first_guess(each, reach, people)
        task, duration_s = person.tasks[key], person.config.duration
        made = other_guesses(person.rules, task, people, reach, task.geometry, paths, duration_s)
    except HriError as error:
        return str(error)
    return person, key, {OPTIMAL: Guess(person.rules, task), **made}
