"""What recorded people show of what the thesis found, in words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hri_prediction.motor_control.costs import CHAPTER_2
from hri_sim.motor_control import thesis


def differences(found: Mapping[str, Any]) -> str:
    """Whether these people show what the thesis found, with what is other about them."""
    means = {cost: found["errors"]["hand_cm"][cost]["mean"] for cost in CHAPTER_2}
    theirs = {cost: _mean_of(thesis.HAND_CM[cost]) for cost in CHAPTER_2}
    ours = {cost: value for cost, value in means.items() if value is not None}
    order, wanted = (sorted(each, key=each.__getitem__) for each in (ours, theirs))
    text = [
        "Of single costs, "
        + ", ".join(f"{_words(cost)} ({ours[cost]:.1f} cm)" for cost in order)
        + " come near in this order, as in the thesis"
        + ("." if order == wanted else " they do not: " + ", ".join(map(_words, wanted)) + ".")
    ]
    weights, most = found["by_task"]["weights"], max(thesis.ALPHA, key=_thesis_alpha)
    for task in found["by_task"]["tasks"]:
        own = {cost: weights[cost][task]["mean"] for cost in CHAPTER_2}
        known = {cost: value for cost, value in own.items() if value is not None}
        if not known:
            continue
        heaviest = max(known, key=known.__getitem__)
        same = "as in" if heaviest == most else f"that of {_words(most)} in"
        text.append(
            f"{task.capitalize()}, the heaviest weight is that of {_words(heaviest)} "
            f"({known[heaviest]:.2f}), {same} the thesis ({_thesis_alpha(most):.2f})."
        )
    return (
        " ".join(text)
        + " What is other here: people sit and reach over a table instead of to a board, with a hand "
        "instead of a fist; nobody told them not to roll the shoulder; one reach is explained at a time, "
        "not the mean of three.\n"
    )


def _mean_of(text: str) -> float:
    """The mean in "mean ± standard deviation"."""
    return float(text.split(" ± ")[0])


def _thesis_alpha(cost: str) -> float:
    return _mean_of(thesis.ALPHA[cost])


def _words(cost: str) -> str:
    return cost.replace("_", " ")
