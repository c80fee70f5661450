"""Two real people who hand something over (Khanna et al. 2022), as far as two trials carry.

The folder ``dyad_handover_kth`` has the skeletons of giver and taker at 120 Hz. A handover shares one
action space: it is nearest to case 13. The hand's end is not tracked and put in line with the forearm.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hri_prediction.errors import DataError
from hri_prediction.files.arrays import Arrays, read_arrays
from hri_prediction.ontology.cases import GROUP_NAMES
from hri_prediction.ontology.classifier import InteractionClassifier
from hri_prediction.ontology.cost_file import CaseCosts, LearntCosts
from hri_prediction.ontology.costs import LENGTH_M
from hri_prediction.ontology.cutting import segments_of
from hri_prediction.ontology.features import COUNT
from hri_prediction.ontology.movements import ARM_SPREAD, learn_costs, movements_of
from hri_prediction.ontology.piirl import cosine
from hri_prediction.ontology.verdict import verdict_on
from hri_prediction.tracks.importers.convert import HAND_M
from hri_prediction.tracks.tables import one_number
from hri_prediction.tracks.track import ArmTrack
from hri_sim.ontology.costs_command import cost_table

FILE = Path("dyad_handover_kth/skeleton_120hz.npz")
DRAWS = 5
"""So often are costs learnt."""
ARM = ("RUArm", "RFArm", "RHand")
"""Bodies whose origins are shoulder, elbow and wrist."""
NEAREST = 13


@dataclass(frozen=True)
class Handed:
    """A movement of a handover.

    Attributes:
        trial: Number of the recording.
        who: Whose wrist moved.
        begin: Since the recording began [s].
        seconds: How long it took.
        number: The likeliest case; 0: it was refused.
        probability: Of it.
        group: The likeliest class of the reduced ontology.
        of_sharing: Probability of all cases in which something is shared.
        reason: Why it was refused, or why probabilities say little.
    """

    trial: int
    who: str
    begin: float
    seconds: float
    number: int
    probability: float
    group: int
    of_sharing: float
    reason: str


def load_skeletons(path: Path) -> list[tuple[ArmTrack, ArmTrack]]:
    """The right arms of both people in each trial.

    Args:
        path: ``skeleton_120hz.npz``.

    Raises:
        DataError: when it is something else.
    """
    try:
        return _skeletons(read_arrays(path), path.name)
    except DataError as error:
        named = error.problem if str(path) in error.problem else f"{path}: {error.problem}"
        raise DataError(named, expected=error.expected) from error


def _skeletons(arrays: Arrays, source: str) -> list[tuple[ArmTrack, ArmTrack]]:
    for name in ("pos", "body_names", "person_names"):
        if name not in arrays:
            raise DataError(f"there is no {name}", expected="the file of skeletons")
    places = arrays["pos"]
    bodies, names = (
        [str(name) for name in arrays[key].ravel()] for key in ("body_names", "person_names")
    )
    if (
        not set(ARM) <= set(bodies)
        or places.ndim != 5
        or places.shape[2:] != (2, len(bodies), 3)
        or places.dtype.kind not in "fiu"
        or len(names) != 2
    ):
        raise DataError(
            f"pos {places.dtype} {places.shape}, bodies {', '.join(bodies):.200}, {len(names)} persons",
            expected=f"numbers (trial, frame, 2, body, 3), bodies with {', '.join(ARM)}, two persons",
        )
    rate = one_number(arrays, "rate_hz")
    if not 0.0 < rate < math.inf:
        raise DataError(f"rate_hz = {rate}", expected="a positive rate")
    joints = places[:, :, :, [bodies.index(name) for name in ARM]].astype(float)
    with np.errstate(all="ignore"):  # what is not seen, or has no length, has no hand tip
        forearm = joints[..., 2, :] - joints[..., 1, :]
        length = np.linalg.norm(forearm, axis=-1, keepdims=True)
        tips = joints[..., 2, :] + HAND_M * forearm / length
    points = np.concatenate((joints, tips[..., None, :]), axis=-2)
    time_s = np.arange(points.shape[1]) / rate
    found = []
    for trial in points:
        one, other = (
            ArmTrack(time_s, trial[:, person], subject=names[person], source=source)
            for person in range(2)
        )
        found.append((one, other))
    return found


def label(
    trials: list[tuple[ArmTrack, ArmTrack]], classifier: InteractionClassifier
) -> list[Handed]:
    """What the monitor would say of each movement."""
    sharing = np.isin(classifier.classes, np.arange(13, 21))
    found = []
    for number, tracks in enumerate(trials, start=1):
        for segment in segments_of(tracks):
            who, begin = tracks[segment.agent].subject, segment.onset_ns * 1e-9
            seconds = (segment.end_ns - segment.onset_ns) * 1e-9
            if segment.features is None:
                found.append(Handed(number, who, begin, seconds, 0, 0.0, 0, 0.0, segment.reason))
                continue
            verdict = verdict_on(classifier, segment.features)
            shared = float(verdict.probabilities[sharing].sum())
            found.append(
                Handed(
                    number, who, begin, seconds, verdict.number, verdict.probability, verdict.group,
                    shared, verdict.unlike,
                )
            )  # fmt: skip
    return found


def learn_handovers(
    trials: list[tuple[ArmTrack, ArmTrack]], seed: int, draws: int = DRAWS
) -> list[CaseCosts]:
    """What these people avoid, by how they move; several times, with other draws of what might have been.

    Args:
        trials: Tracks of both.
        seed: Of what might have been.
        draws: How often.

    Raises:
        DataError: when all of both arms is seen in no movement.
    """
    movements = [movement for tracks in trials for movement in movements_of(tracks)]
    found = []
    for number in range(draws):
        rng = np.random.default_rng([seed, number])
        learnt = learn_costs(movements, rng, spread=ARM_SPREAD)
        found.append(CaseCosts(learnt.weights, learnt.scale, len(movements)))
    return found


def cost_lines(found: list[CaseCosts]) -> list[str]:
    """The part of a report on what costs two real people move by."""
    pairs = list(itertools.combinations(found, 2))
    alike = [cosine(one.scaled[:COUNT], other.scaled[:COUNT]) for one, other in pairs]
    return [
        "By path-integral inverse reinforcement learning, of the arm alone, from the same two trials "
        f"(shares of the scaled weights), {len(found)} times with other draws of what might have been. "
        f"Cosine of the nearness that two of these find: median {np.median(alike):.2f}, least "
        f"{min(alike):.2f}; what is not found each time is not known.\n",
        *cost_table(LearntCosts({f"draw {n}": one for n, one in enumerate(found, 1)}, LENGTH_M)),
        "",
        "Two trials of one pair say what the method makes of real skeletons, not how people are.\n",
    ]


def handover_lines(found: list[Handed]) -> list[str]:
    """The part of a report on real handovers."""
    judged = [one for one in found if one.number]
    sharing = [one for one in judged if one.number >= NEAREST]
    text = [
        "### Two real people\n",
        "Handovers of Khanna et al. (2022), KTH, two trials, both people's right arms at 120 Hz (bodies "
        f"RUArm, RFArm and RHand; the hand tip is put {HAND_M:g} m beyond the wrist), by the classifier "
        "that ships, which knows seated simulated people alone. A handover shares a space in mid-air: "
        f"nearest to case {NEAREST}. {len(judged)} movements, {len(sharing)} of them taken for a case in "
        "which something is shared (13 to 20). The monitor says of those that are far from all that was "
        "learnt that they are: people who stand apart are. Two trials show that recordings of others go "
        "through; they say nothing of how often the classifier is right.\n",
        "| trial | who | begins [s] | lasts [s] | case | probability | reduced | cases 13 to 20 together | "
        "what is said besides |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for one in found:
        head = f"| {one.trial} | {one.who} | {one.begin:.2f} | {one.seconds:.2f} |"
        if not one.number:
            text.append(f"{head} none | – | – | – | {one.reason} |")
            continue
        text.append(
            f"{head} {one.number} | {100 * one.probability:.0f} % | "
            f"{one.group} {GROUP_NAMES[one.group - 1]} | {100 * one.of_sharing:.0f} % | {one.reason} |"
        )
    return [*text, ""]
