"""What the predictor says of the people whom it learns."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hri_prediction.hybrid.config import HybridConfig
from hri_prediction.hybrid.loop import Expected, Learnt
from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.ros import learning
from hri_prediction.ros.learning import Learning


class _Answers:
    """In place of the loop: answers as told."""

    alive, stalled = True, False

    def __init__(self) -> None:
        self.next: list[Any] = []

    def answers(self) -> list[Any]:
        found, self.next = self.next, []
        return found


def test_how_sure_guesses_are_follows_what_is_learnt(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each reach of any task tells of the others; a task that was seen says what was seen of it."""
    monkeypatch.setattr(learning, "merged", lambda common, library: library)
    made = Learning(
        {"left": np.zeros(3), "right": np.ones(3)},
        PredictorConfig(),
        HybridConfig(),
        facing="auto",
        weights="",
        folder="",
        people=(),
        at_once=True,
    )
    loop = _Answers()
    monkeypatch.setattr(made, "_loop", loop)

    def say(*answers: object) -> dict[str, Any]:
        loop.next = list(answers)
        assert not list(made.exchange({}, None))
        return made.figures

    def guessed(**spread: float) -> Expected:
        return Expected("ann", "right", None, {}, spread)  # type: ignore[arg-type]

    figures = say(guessed(left=0.9, right=0.9))
    assert figures["ann left"] == "not seen yet, weights guessed within e^0.9"
    figures = say(Learnt("ann", "left", 1, 0.5), guessed(left=0.3, right=0.4))
    assert figures["ann left"].startswith("1 reaches")
    assert figures["ann right"] == "not seen yet, weights guessed within e^0.4"
