"""The same comparison on recorded reaches: each reach of a person and a target is the first one in turn."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field, replace
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
from hri_prediction.prediction.library import TaskModel, demonstration
from hri_prediction.tracks.placement import Placement
from hri_prediction.tracks.seating import facing_deg
from hri_prediction.tracks.segmentation import SegmentationConfig
from hri_sim.hybrid.first_guesses import GUESSES, OPTIMAL, Guess, other_guesses
from hri_sim.hybrid.scores import calibration, told, untold
from hri_sim.hybrid.trial import Judged

Array = NDArray[np.float64]

SOURCE = Path("reach_adl_vicon/reach.npz")


@dataclass(frozen=True, eq=False)
class Repeated:
    """Repetitions of one reach of one person.

    Attributes:
        person: Name.
        target: Name.
        reaches: In the order in which they were recorded; two or more.
    """

    person: str
    target: str
    reaches: tuple[SeenReach, ...]

    def __post_init__(self) -> None:
        if len(self.reaches) < 2:
            raise DataError(
                f"{self.person} {self.target}: {len(self.reaches)} reaches", expected="two or more"
            )

    def tip(self, without: SeenReach | None = None) -> Array:
        """Where the target is taken to be (3,) [m], from the shoulder: the median of where the wrist ends.

        Nobody wrote down where it was. Hands are left out, as in the thesis.

        Args:
            without: The reach that is to be predicted, whose end nobody knows yet.
        """
        others = [reach for reach in self.reaches if reach is not without]
        tip: Array = np.median([reach.end_tip - reach.shoulder for reach in others], axis=0)
        return tip


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
        found.append(Repeated(f"{person} {side}", task, tuple(reaches)))
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
        judged: Scores.
        divergences: Of each update, a row for each person and target.
        whys: What explained their mean paths, by person and target; or why nothing did.
        not_expected: Why nothing could be expected this once, where something was with all reaches.
    """

    judged: list[Judged]
    divergences: list[list[float]]
    whys: dict[tuple[str, str], Why | str]
    not_expected: list[str] = field(default_factory=list)


@dataclass(frozen=True, eq=False)
class _Turn:
    """One target of an arm, as it is learnt in one order of its reaches.

    Attributes:
        each: The target.
        order: Of its reaches.
        person: Who begins with the first of them.
        key: Of the task.
        states: What is known, by first guess.
    """

    each: Repeated
    order: tuple[SeenReach, ...]
    person: HybridPerson
    key: TaskKey
    states: dict[str, Guess]

    def model(self, guess: str) -> TaskModel:
        """As predictors have it."""
        state = self.states[guess]
        return state.rules.model(state.task, *self.person.usual_duration())


def run_real(
    repeated: list[Repeated], progress: Callable[[int, int], None] | None = None
) -> RealCourse:
    """Learn the reaches of each arm one by one, beginning with each of them in turn.

    Args:
        repeated: What was read.
        progress: Told how many arms of how many are done.
    """
    course = RealCourse([], [], {})
    arms = sorted({each.person for each in repeated})
    for done, arm in enumerate(arms):
        _run_arm([each for each in repeated if each.person == arm], repeated, course)
        if progress is not None:
            progress(done + 1, len(arms))
    return course


def _run_arm(own: list[Repeated], repeated: list[Repeated], course: RealCourse) -> None:
    """All targets of one arm beside each other: what is not told is which of them a reach is for."""
    whole = {each.target: _begin(each, 0, None, repeated) for each in own}
    begun = [each for each in own if not isinstance(whole[each.target], str)]
    for each in own:
        turn = whole[each.target]
        if isinstance(turn, str):
            course.whys[each.person, each.target] = turn
        else:
            _explain(_learnt(turn, len(turn.order)), course)
    longest = max((len(each.reaches) for each in begun), default=0)
    for first in range(longest):
        for seen in range(longest):
            # Where a target is, is known from the reaches but the one that is to be predicted.
            turns = [
                _begin(each, first, seen, repeated) for each in begun if first < len(each.reaches)
            ]
            there = [turn for turn in turns if not isinstance(turn, str)]
            # Of which nothing can be expected from elsewhere or for elsewhere is left out this once.
            course.not_expected.extend(turn for turn in turns if isinstance(turn, str))
            _judge([_learnt(turn, seen) for turn in there], seen, course)


def _learnt(turn: _Turn, count: int) -> _Turn:
    """The same when so many reaches have been seen, from each first guess."""
    states = {}
    for guess, state in turn.states.items():
        task = state.task
        for reach in turn.order[:count]:
            task = state.rules.updated(task, reach.phases, reach.values, reach.duration_s)
        states[guess] = Guess(state.rules, task)
    return replace(turn, states=states)


def _judge(turns: list[_Turn], seen: int, course: RealCourse) -> None:
    """Predict the next reach for each target."""
    for guess in GUESSES:
        models = tuple(turn.model(guess) for turn in turns)
        for model, turn in zip(models, turns, strict=True):
            if seen >= len(turn.order):
                continue
            reach = turn.order[seen]
            by_told = told(model, reach)
            by_itself = untold(models, reach, turn.states[guess].rules.predictor)
            course.judged.append(
                Judged(
                    turn.each.person, turn.each.target, guess, seen, by_told.warped_m, by_told.end_m,
                    by_itself.warped_m, by_itself.end_m,
                    calibration([by_told]), calibration([by_itself]),
                )
            )  # fmt: skip


def _explain(turn: _Turn, course: RealCourse) -> None:
    task = turn.states[OPTIMAL].task
    course.divergences.append(list(task.divergences))
    turn.person.tasks[turn.key] = task
    try:
        found: Why | str = turn.person.explain(turn.key)
    except HriError as error:
        found = str(error)
    course.whys[turn.each.person, turn.each.target] = found


def first_guess(
    each: Repeated, reach: SeenReach, people: WeightProcess, unknown: SeenReach | None
) -> tuple[HybridPerson, TaskKey]:
    """What optimal control expects from where an arm rests before its first reach.

    Args:
        each: Whose target it is.
        reach: Where it begins.
        people: Which weights are expected of anybody.
        unknown: The reach whose end is not known.

    Raises:
        HriError: nothing can be expected.
    """
    person = HybridPerson(
        {each.target: each.tip(without=unknown)}, people, PredictorConfig(), HybridConfig()
    )
    points = np.zeros((4, 3))
    points[1], points[2] = reach.values[0, :3], reach.values[0, 3:]
    points[3] = reach.start_tip - reach.shoulder
    person.at_rest(Rest(reach.body, points))
    (key,) = person.tasks
    return person, key


def _begin(each: Repeated, first: int, seen: int | None, repeated: list[Repeated]) -> _Turn | str:
    """All first guesses, from where the arm rests before one of the reaches; or why there are none."""
    order = each.reaches[first:] + each.reaches[:first]
    side = each.person.split()[1]
    paths = [
        np.mean([reach.values for reach in other.reaches], axis=0)
        for other in repeated
        if other.target == each.target
        and other.person.split()[1] == side
        and other.person != each.person
    ]
    if not paths:
        return "nobody else was recorded who reaches there"
    try:
        people = load_process()
        unknown = order[seen] if seen is not None and seen < len(order) else None
        person, key = first_guess(each, order[0], people, unknown)
        task, duration_s = person.tasks[key], person.config.duration
        made = other_guesses(person.rules, task, people, order[0], task.geometry, paths, duration_s)
    except HriError as error:
        return str(error)
    return _Turn(each, order, person, key, {OPTIMAL: Guess(person.rules, task), **made})
