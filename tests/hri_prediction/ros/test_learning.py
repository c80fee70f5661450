"""What the predictor says of the people whom it learns."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from hri_prediction.hybrid.config import HybridConfig
from hri_prediction.hybrid.loop import Expected, Learnt, Left
from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.ros import learning
from hri_prediction.ros.learning import STRANGERS, Learning


class _Loop:
    """In place of the loop: answers as told, and keeps what is asked."""

    alive, stalled = True, False

    def __init__(self) -> None:
        self.next: list[Any] = []
        self.asked: list[Any] = []

    def ask(self, question: object) -> None:
        self.asked.append(question)

    def answers(self) -> list[Any]:
        found, self.next = self.next, []
        return found


@dataclass
class _Body:
    body_id: str
    arms: dict[str, Any] = field(default_factory=dict)


class _Told:
    """What a predictor would see of it."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, people: tuple[str, ...] = ()) -> None:
        monkeypatch.setattr(learning, "merged", lambda common, library: library)
        self.learning = Learning(
            {"left": np.zeros(3), "right": np.ones(3)},
            PredictorConfig(),
            HybridConfig(),
            facing="auto",
            weights="",
            folder="",
            people=people,
            at_once=True,
        )
        self.loop = _Loop()
        monkeypatch.setattr(self.learning, "_loop", self.loop)

    def say(self, *answers: object, bodies: tuple[str, ...] = ("ann",)) -> dict[str, Any]:
        """Answers that come while bodies are there; the figures then."""
        self.loop.next = list(answers)
        there: Any = {name: _Body(name) for name in bodies}
        assert not list(self.learning.exchange(there, None))
        return self.learning.figures


def guessed(person: str = "ann", side: str = "right", **spread: float) -> Expected:
    return Expected(person, side, None, {}, spread)  # type: ignore[arg-type]


def test_how_sure_guesses_are_follows_what_is_learnt(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each reach of any task tells of the others; a task that was seen says what was seen of it."""
    told = _Told(monkeypatch)
    figures = told.say(guessed(left=0.9, right=0.9))
    assert figures["ann right left"] == "not seen yet, weights guessed within e^0.9"
    figures = told.say(Learnt("ann", "right", "left", 1, 0.5), guessed(left=0.3, right=0.4))
    assert figures["ann right left"].startswith("1 reaches")
    assert figures["ann right right"] == "not seen yet, weights guessed within e^0.4"
    # The other arm's reach to the same target is another one.
    figures = told.say(guessed(side="left", left=0.7))
    assert figures["ann left left"] == "not seen yet, weights guessed within e^0.7"
    assert figures["ann right left"].startswith("1 reaches")


def test_strangers_who_have_gone_are_forgotten_but_for_the_last(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Trackers give new ids to whoever comes back: nothing may grow with their number."""
    told = _Told(monkeypatch, ("body=ann",))
    told.say(guessed("ann", left=0.9), bodies=("body",))
    for number in range(STRANGERS + 3):
        name = f"id{number}"
        told.say(guessed(name, left=0.9), Learnt(name, "right", "left", 1, 0.5), bodies=(name,))
    assert told.loop.asked == [Left("id0"), Left("id1")]
    figures = told.say(bodies=())
    assert told.loop.asked[-1] == Left("id2")
    kept = {f"id{number} right left" for number in range(3, STRANGERS + 3)}
    assert {name for name in figures if name.endswith("left")} == {*kept, "ann right left"}
    # An answer that is late says nothing any more; whoever comes back in time is still known.
    assert told.say(Learnt("id0", "right", "left", 2, 0.5), bodies=("id3",)) == figures
    told.say(bodies=("new",))
    told.say(bodies=())
    assert told.loop.asked[-1] == Left("id4")


def test_a_stranger_is_not_taken_for_who_is_kept_by_that_name(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    told = _Told(monkeypatch, ("body=ann",))
    assert told.learning._person("body") == "ann"
    assert told.learning._person("ann") == "?ann"
    assert told.learning._person("bo") == "bo"
