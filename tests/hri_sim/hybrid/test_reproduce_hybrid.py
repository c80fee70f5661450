"""The hybrid predictor on trial, in its short form."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import multivariate_normal
from typer.testing import CliRunner

from hri_prediction.errors import ConfigError
from hri_prediction.hybrid.body import CONVENTION
from hri_prediction.hybrid.fit_command import read_results
from hri_sim.hybrid import simulate_weights
from hri_sim.hybrid.command import app
from hri_sim.hybrid.first_guesses import GUESSES
from hri_sim.hybrid.report import _cm
from hri_sim.hybrid.scores import _score, calibration
from hri_sim.hybrid.subjects import FAMILIES, POINTS, VARIABILITY_M, draw_subjects, stray
from hri_sim.hybrid.tables import _median_cm
from hri_sim.hybrid.trial import run_person


@pytest.mark.parametrize("family", FAMILIES)
def test_people_stray_by_what_is_said(family: str) -> None:
    rng = np.random.default_rng(2)
    (subject,) = draw_subjects(1, family, rng)
    for target, habit in subject.habits.items():
        reaches = np.array([subject.reach(target, rng, VARIABILITY_M).values for _ in range(80)])
        apart = np.linalg.norm(reaches[..., 3:] - habit.mean[:, 3:], axis=-1)
        assert np.sqrt(np.mean(apart**2)) == pytest.approx(VARIABILITY_M, rel=0.15)
    assert subject.rest.points.shape == (4, 3)
    again = draw_subjects(1, family, np.random.default_rng(2))[0]
    np.testing.assert_array_equal(again.habits[target].mean, habit.mean)


def test_reaches_stray_smoothly() -> None:
    drawn = stray(np.random.default_rng(0), 0.01)
    assert drawn.shape == (POINTS, 6)
    assert np.abs(np.diff(drawn, axis=0)).max() < 0.002


def test_unknown_people_are_refused() -> None:
    with pytest.raises(ConfigError, match="via_points"):
        draw_subjects(1, "martians", np.random.default_rng(0))


def test_predictions_get_better_with_reaches() -> None:
    rng = np.random.default_rng(5)
    subjects = draw_subjects(2, "optimal", rng)
    course = run_person(
        subjects[0], subjects[1:], rng, variability_m=VARIABILITY_M, counts=(0, 5), judged=4
    )
    for guess in GUESSES:
        own = [each for each in course.judged if each.guess == guess]
        before, after = (
            np.mean([each.warped_m for each in own if each.seen == seen]) for seen in (0, 5)
        )
        assert after < before
    assert len(course.divergences["T1"]) == 5


def test_how_sure_predictions_are_is_judged_as_it_should_be() -> None:
    rng = np.random.default_rng(0)
    factor = np.linalg.cholesky(np.diag([4e-4, 1e-4, 9e-4]) + 5e-5)
    covariance = np.tile(factor @ factor.T, (2000, 1, 1))
    drawn = rng.standard_normal((2000, 3)) @ factor.T
    right = calibration([_score(np.zeros((2000, 3)), covariance, drawn)])
    assert right.inside50 == pytest.approx(0.50, abs=0.03)
    assert right.inside95 == pytest.approx(0.95, abs=0.02)
    truth = multivariate_normal(np.zeros(3), covariance[0])
    assert right.nll == pytest.approx(-truth.logpdf(drawn).mean())
    for share in (0.25, 4.0):
        wrong = calibration([_score(np.zeros((2000, 3)), share * covariance, drawn)])
        assert wrong.nll > right.nll
        assert (wrong.inside95 < right.inside95) == (share < 1.0)


def test_the_short_form(tmp_path: Path) -> None:
    arguments = [
        "--smoke",
        "--out",
        str(tmp_path),
        "--runs",
        str(tmp_path / "runs"),
        "--workers",
        "1",
    ]
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 0, done.output
    content = json.loads((tmp_path / "hybrid.json").read_text())
    assert set(content["families"]["optimal"]["curves"]) == set(GUESSES)
    assert content["latency"]["learning beside"]["learnt"] > 0
    sure = content["families"]["optimal"]["sure"]["optimal control"]
    assert all(0.5 < share <= 1.0 for share in sure["inside95"].values())
    assert content["real"]["skipped"] == "--smoke"
    text = (tmp_path / "hybrid.md").read_text()
    assert "straight line" in text
    assert "p99" in text
    for name in ("errors", "weights"):
        assert (tmp_path / "hybrid" / f"{name}_optimal.png").stat().st_size > 10_000


def test_the_short_form_of_simulated_weights_is_what_weights_are_fitted_to(tmp_path: Path) -> None:
    assert simulate_weights.main(["--smoke", "--out", str(tmp_path), "--workers", "1"]) == 0
    content = json.loads((tmp_path / "results.json").read_text())
    assert content["convention"] == CONVENTION
    assert [law["person"] for law in content["laws"]] == ["S1", "S2"]
    explained = read_results(tmp_path / "results.json")
    data = explained.data
    assert explained.what == f"{len(data)} reaches by the laws of 2 arms"
    assert data.names == tuple(content["costs"])
    assert 10 <= len(data) <= 27  # not all are found in the noise
    for kept in (tmp_path / "laws").glob("*.json"):
        kept.write_text(kept.read_text().replace('"steps": ', '"steps": 100'))
    assert simulate_weights.main(["--smoke", "--out", str(tmp_path), "--workers", "1"]) == 0
    again = json.loads((tmp_path / "results.json").read_text())
    assert all(law["steps"] >= 100 for law in again["laws"])  # what is done is not done again


def test_weights_without_an_optimum_do_not_end_a_report() -> None:
    assert np.isnan(_median_cm([]))
    assert _median_cm([float("inf"), 0.01, 0.03]) == pytest.approx(2.0)
    assert _cm(None) == "–"
