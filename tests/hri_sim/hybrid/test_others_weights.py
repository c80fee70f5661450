"""First guesses by the weights of other people."""

from __future__ import annotations

import numpy as np
import pytest

from hri_prediction.errors import DataError
from hri_prediction.hybrid.weight_file import load_process
from hri_prediction.hybrid.weight_process import WeightData
from hri_prediction.hybrid.why import Why
from hri_sim.hybrid import others_weights as module
from hri_sim.hybrid.others_weights import others_weights
from hri_sim.hybrid.real import Repeated
from hri_sim.hybrid.report import _by_others
from hri_sim.hybrid.subjects import POINTS, VARIABILITY_M, draw_subjects

NAMES = load_process().names


def people(count: int) -> tuple[list[Repeated], dict[tuple[str, str], Why | str]]:
    """Simulated ones, each with two reaches for one target, and weights that are said to explain them."""
    rng = np.random.default_rng(3)
    repeated: list[Repeated] = []
    whys: dict[tuple[str, str], Why | str] = {}
    for index, subject in enumerate(draw_subjects(count, "optimal", rng)):
        target = sorted(subject.habits)[0]
        reaches = tuple(subject.reach(target, rng, VARIABILITY_M) for _ in range(2))
        assert len(reaches[0].values) == POINTS
        repeated.append(Repeated(f"P{index} right", target, reaches))
        alpha = rng.dirichlet(np.ones(len(NAMES)))
        sd = np.full(len(NAMES), 0.1)
        ends = rng.uniform(-0.5, 0.5, (2, 1, 3))
        data = WeightData.of(NAMES, ends[0], ends[1], alpha[None], np.diag(sd**2)[None])
        whys[repeated[-1].person, target] = Why(target, alpha, sd, 0.02, 0.01, 1.0, data)
    return repeated, whys


def test_nobody_is_guessed_by_their_own_weights(monkeypatch: pytest.MonkeyPatch) -> None:
    repeated, whys = people(11)
    fitted: list[WeightData] = []

    def fit(data: WeightData) -> object:
        fitted.append(data)
        return load_process()

    monkeypatch.setattr(module, "fit_process", fit)
    found = others_weights(repeated[:2], whys)
    assert found["reaches"] == 4
    assert found["others_cm"] == found["shipped_cm"]  # the process was replaced by that which ships
    assert 0.0 < found["shipped_cm"] < 10.0
    for data, each in zip(fitted, repeated, strict=False):
        why = whys[each.person, each.target]
        assert isinstance(why, Why)
        assert len(data) == 10
        assert not (data.inputs == why.data.inputs).all(axis=1).any()


def test_only_reaches_of_which_both_expect_something_are_compared(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    repeated, whys = people(11)
    monkeypatch.setattr(module, "fit_process", lambda data: load_process())
    usual = module._errors
    monkeypatch.setattr(module, "_errors", lambda each, by: [None, *usual(each, by)[1:]])
    assert others_weights(repeated[:2], whys)["reaches"] == 2
    monkeypatch.setattr(module, "_errors", lambda each, by: [None for _ in each.reaches])
    with pytest.raises(DataError, match="nothing can be expected"):
        others_weights(repeated[:2], whys)


def test_too_few_people_are_refused() -> None:
    repeated, whys = people(3)
    with pytest.raises(DataError, match="2 reaches of people other than P0"):
        others_weights(repeated, whys)


def test_the_report_has_figures_or_the_reason_why_there_are_none() -> None:
    assert "2.40 cm" in _by_others({"shipped_cm": 2.5, "others_cm": 2.4, "reaches": 8})
    assert "too few" in _by_others({"skipped": "too few"})
