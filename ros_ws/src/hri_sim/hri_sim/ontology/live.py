"""How long after a movement its case is on the topic, by what a listener has heard."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hri_prediction.ontology.cases import group_of
from hri_prediction.ontology.config import WatchConfig

WANTED_MS = 50.0
STEP_NS = round(WatchConfig().step * 1e9)
"""Between the instants of features [ns]."""


@dataclass(frozen=True)
class Heard:
    """A message on the topic of cases.

    Attributes:
        at_ns: When it was heard [ns].
        complete: Whether of a movement that is over; else of one that is under way, or was refused.
        first: Whose movement.
        number: The case; 0: none.
        group: The class of the reduced ontology.
        onset_ns: When the movement began [ns].
        end_ns: When it ended, or was refused [ns]; 0 while it is under way.
        newest_ns: Stamp of the newest sample behind it [ns].
        instant_ns: Until when both are in it [ns].
        meant: The case that the two people are in.
    """

    at_ns: int
    complete: bool
    first: str
    number: int
    group: int
    onset_ns: int
    end_ns: int
    newest_ns: int
    instant_ns: int
    meant: int

    @property
    def refused(self) -> bool:
        """Whether there is no case of a movement that is over."""
        return self.end_ns > 0 and not self.complete


@dataclass(frozen=True)
class LiveFigures:
    """What came of movements that were watched live.

    Attributes:
        movements: How many a case was told of.
        refused: Of how many others none was, as the topic says with a reason.
        case_ms: From the end of each to the next time that its case was told, of samples until the end (the
            last instants smoothed by what there were), as it looked by then [ms].
        lacking_ms: For how long before the end not all of both arms had been seen by then [ms]; 0: for less
            than an instant.
        known_ms: The same until what was told is what is told of the whole movement in the end, and at all
            times in between [ms].
        complete_ms: From the end of each until it was certain that it was over, and told [ms].
        computed_ms: From the newest sample to that message [ms].
        same: Share whose case, as it looked within 50 ms after the end, was that of the whole movement.
        right: Share whose case, told in the end, is the one that the two people are in.
        class_right: Share whose class of the reduced ontology, told in the end, is that of this case.
    """

    movements: int
    refused: int
    case_ms: tuple[float, ...]
    lacking_ms: tuple[float, ...]
    known_ms: tuple[float, ...]
    complete_ms: tuple[float, ...]
    computed_ms: tuple[float, ...]
    same: float
    right: float
    class_right: float


def settled(heard: Sequence[Heard]) -> list[Heard]:
    """What was heard of movements that began when the first one had been told: all nodes run by then.

    Args:
        heard: Of movements, in the order of time.
    """
    first = next((told.at_ns for told in heard if told.complete), None)
    return [told for told in heard if first is not None and told.onset_ns >= first]


def figures_of(heard: Sequence[Heard]) -> LiveFigures:
    """Figures of what was heard on the topic.

    Args:
        heard: Of movements, in the order of time.
    """
    case, lacking, known, complete, computed, same = [], [], [], [], [], []
    right, class_right = [], []
    for told in heard:
        if not told.complete:
            continue
        later = [
            one
            for one in heard
            if not one.complete
            and (one.first, one.onset_ns) == (told.first, told.onset_ns)
            # What was told after the end, of samples before it, knows nothing of the end.
            and one.newest_ns >= told.end_ns
        ]
        later.append(told)
        case.append((later[0].at_ns - told.end_ns) / 1e6)
        hidden_ns = told.end_ns - later[0].instant_ns
        lacking.append(hidden_ns / 1e6 if hidden_ns >= STEP_NS else 0.0)
        settled_ns = told.at_ns
        for one in reversed(later):
            if one.number != told.number:
                break
            settled_ns = one.at_ns
        known.append((settled_ns - told.end_ns) / 1e6)
        soon = [one.number for one in later if one.at_ns - told.end_ns <= WANTED_MS * 1e6]
        same.append(bool(soon) and soon[-1] == told.number)
        complete.append((told.at_ns - told.end_ns) / 1e6)
        computed.append((told.at_ns - told.newest_ns) / 1e6)
        right.append(told.number == told.meant)
        class_right.append(told.group == group_of(told.meant))
    shares = (float(np.mean(each)) if each else math.nan for each in (same, right, class_right))
    return LiveFigures(
        len(case),
        sum(told.refused for told in heard),
        tuple(case),
        tuple(lacking),
        tuple(known),
        tuple(complete),
        tuple(computed),
        *shares,
    )


def live_summary(found: LiveFigures) -> dict[str, float | int]:
    """For ``results.json``: times [ms]."""
    told: dict[str, float | int] = {"movements": found.movements, "refused": found.refused}
    if not found.movements:
        return told
    for name, values in (
        ("case", found.case_ms), ("known", found.known_ms),
        ("complete", found.complete_ms), ("computed", found.computed_ms),
    ):  # fmt: skip
        for share in (50, 99):
            told[f"{name}_p{share}"] = round(float(np.percentile(values, share)), 2)
        told[f"{name}_most"] = round(max(values), 2)
    told["same_within_50_ms"] = round(found.same, 4)
    told["recognised"] = round(found.right, 4)
    told["class_recognised"] = round(found.class_right, 4)
    told["hidden_at_the_end"] = sum(ms > 0.0 for ms in found.lacking_ms)
    told["hidden_most_ms"] = round(max(found.lacking_ms), 2)
    told["told_within_50_ms"] = round(float(np.mean(np.array(found.case_ms) <= WANTED_MS)), 4)
    return told


def live_lines(told: dict[str, float | int], cases: Sequence[int] = ()) -> list[str]:
    """The part of a report that says how late cases are told.

    Args:
        told: As :func:`live_summary`.
        cases: What the pairs did, one each.
    """
    if not told.get("movements"):
        refused = f"; {told['refused']} were refused, with a reason" if told.get("refused") else ""
        return ["### Live\n", f"Of no movement a case was told{refused}.\n"]
    names = {
        "case": "the end of a movement, to its case by what was seen until its end",
        "known": "the end of a movement, to the case that is told of it from then on",
        "complete": "the end of a movement, to its being over for certain, and told",
        "computed": "the newest sample, to that message",
    }
    hidden = ""
    if told["hidden_at_the_end"]:
        hidden = (
            f"At the end of {told['hidden_at_the_end']} of them not all of both arms was seen: what was "
            f"told next knows nothing of the last {told['hidden_most_ms']:.0f} ms at most. "
        )
    same, right, of_class = (
        f"{100 * told[key]:.0f} %"
        for key in ("same_within_50_ms", "recognised", "class_recognised")
    )
    pairs = f" ({len(cases)} pairs, opposite each other, of cases " if len(cases) > 1 else " (case "
    of = pairs + ", ".join(map(str, cases)) + ")" if cases else ""
    text = [
        "### Live\n",
        f"{told['movements']} movements of a dyad process{of} at 250 Hz, with the noise and drop-outs of "
        "tracking (2 mm), of which recordings here have 0.5 mm and none, watched by a monitor process that "
        f"is held to one core; movements that were refused, with a reason: {told['refused']}. Wanted: a "
        f"case within {WANTED_MS:g} ms of the end: of "
        f"{100 * told['told_within_50_ms']:.1f} % of them, "
        f"{'met' if told['case_most'] <= WANTED_MS else '**missed**'}. {hidden}"
        f"{same} were by then taken for what is told in the end. That was "
        f"the case that the two were in for {right} of them; the class of the reduced ontology that was "
        f"told was that of this case for {of_class}.\n",
        "| from | p50 [ms] | p99 [ms] | most [ms] |",
        "| --- | --- | --- | --- |",
    ]
    text += [
        f"| {words} | {told[f'{key}_p50']:.1f} | {told[f'{key}_p99']:.1f} | {told[f'{key}_most']:.1f} |"
        for key, words in names.items()
    ]
    return [*text, ""]
