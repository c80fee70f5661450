"""The study of why people reach as they do, in its short form."""

from __future__ import annotations

import io
import json
import os
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console
from typer.testing import CliRunner

from hri_prediction.motor_control import design
from hri_prediction.motor_control.analyses.table import ReachTable
from hri_prediction.motor_control.arm_model import ArmModel
from hri_prediction.motor_control.collected import CollectedReach
from hri_prediction.motor_control.observed import ObservedReach, of_angles
from hri_prediction.motor_control.ocp import Motion, NotConverged, ReachSolver
from hri_prediction.motor_control.problem import ReachProblem
from hri_prediction.results.progress import ProgressLine
from hri_prediction.tracks.track import ArmTrack
from hri_sim.motor_control import people, real_reaches, study, study_command
from hri_sim.motor_control.averaged import levels
from hri_sim.motor_control.chapter_2 import recovery
from hri_sim.motor_control.chapter_3 import heights
from hri_sim.motor_control.real_reaches import by_task
from hri_sim.motor_control.study import SMOKE, carry_out
from hri_sim.motor_control.study_command import app, of_real

TINY = replace(SMOKE, people=2)


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> tuple[ReachTable, Path]:
    folder = tmp_path_factory.mktemp("people")
    return carry_out(TINY, folder, workers=1), folder


def observed_of(table: ReachTable) -> ObservedReach:
    """The first reach of a table."""
    problem = ReachProblem.moving(
        table.q_start[0], table.q_end[0], table.duration_s[0], table.v_start[0], table.v_end[0]
    )
    return of_angles(problem, table.angles[0], ArmModel.of_body())


def test_everybody_reaches_and_is_explained(table: tuple[ReachTable, Path]) -> None:
    found, _ = table
    assert len(found.explained) == 2 * 12
    assert (found.hand_cm <= np.nanmin(found.single_cm, axis=1) + 1e-9).all()
    assert found.hand_cm.mean() < 0.3
    np.testing.assert_allclose(found.truth.sum(axis=1), 1.0)
    np.testing.assert_allclose(found.alpha.sum(axis=1), 1.0)


def test_what_is_done_is_not_done_again(
    table: tuple[ReachTable, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    found, folder = table

    def again(turn: object) -> None:
        raise AssertionError(turn)

    monkeypatch.setattr(study, "do_turn", again)
    same = carry_out(TINY, folder, workers=1)
    np.testing.assert_array_equal(same.alpha, found.alpha)


def test_each_person_is_the_same_in_any_order(
    table: tuple[ReachTable, Path], tmp_path: Path
) -> None:
    found, _ = table
    index, alone = study.do_turn(study.Turn(TINY, 1, tmp_path))
    assert index == 1
    np.testing.assert_array_equal(alone.alpha, found.of(["S2"]).alpha)


def test_a_repetition_without_an_optimum_is_drawn_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    person = study.people_of(TINY)[0]
    solve, failed = people.ReachSolver.solve, []

    def once(self: ReachSolver, problem: ReachProblem, *rest: object) -> Motion:
        motion = solve(self, problem, *rest)
        if not failed:
            failed.append(problem)
            raise NotConverged(problem, np.ones(7), motion, 1.0)
        return motion

    monkeypatch.setattr(people.ReachSolver, "solve", once)
    recorded = people.record(person, 0, 0, np.random.default_rng(0), repetitions=1)
    assert len(recorded.tracks) == len(failed) == 1

    def never(self: ReachSolver, problem: ReachProblem, *rest: object) -> Motion:
        raise NotConverged(problem, np.ones(7), solve(self, problem, *rest), 1.0)

    monkeypatch.setattr(people.ReachSolver, "solve", never)
    with pytest.raises(NotConverged):
        people.record(person, 0, 0, np.random.default_rng(0), repetitions=1)


def test_levels_are_those_of_the_postures() -> None:
    starts = np.array([f"P{i + 1}" for i in range(12)])
    for row, (q1, q2, q3) in zip(design.STARTS_12_DEG, design.LEVELS_12, strict=True):
        assert {"up": row[0] < -20.0, "middle": 5.0 < row[0] < 15.0, "down": row[0] > 30.0}[q1]
        assert (row[1] > 25.0) == (q2 == "high")
        assert (row[2] > 25.0) == (q3 == "high")
    assert len(set(design.LEVELS_12)) == len(starts)
    np.testing.assert_array_equal(
        design.STARTS_12_DEG[list(design.IN_CHAPTER_2)], design.STARTS_DEG
    )


def test_levels_of_a_table(table: tuple[ReachTable, Path]) -> None:
    found = levels(table[0])
    assert set(found["q1_start"]) == {"middle", "up"}
    assert found["target"].tolist() == table[0].target.tolist()


def test_each_person_counts_once(table: tuple[ReachTable, Path]) -> None:
    found, _ = table
    # Ten times as many reaches of one person leave the mean over people where it is.
    more = found.where(np.concatenate([np.arange(24), *[np.arange(12)] * 9]))
    one, ten = (by_task(each, np.random.default_rng(0)) for each in (found, more))
    assert one["people"] == 2
    for name in found.names:
        for task in one["tasks"]:
            assert one["weights"][name][task]["mean"] == pytest.approx(
                ten["weights"][name][task]["mean"]
            )


def test_the_whole_report(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("HRI_DATA_DIR", raising=False)
    arguments = ["--smoke", "--people", "2", "--runs", str(tmp_path), "--workers", "1"]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, result.output
    assert "real reaches: left out, HRI_DATA_DIR is not set" in result.output
    text = (tmp_path / "motor_control.md").read_text()
    content = json.loads((tmp_path / "motor_control.json").read_text())
    assert content["chapter_2"]["errors"]["n"] == 24
    assert "Left out: HRI_DATA_DIR is not set." in text
    for name in ("errors", "single_costs", "discomfort", "transitions", "mean_errors"):
        assert f"motor_control/{name}.png" in text
        assert (tmp_path / "motor_control" / f"{name}.png").stat().st_size > 10_000


def test_real_reaches_in_short(tmp_path: Path) -> None:
    """The first few, explained, and told of in the report."""
    if not os.environ.get("HRI_DATA_DIR"):
        pytest.skip("HRI_DATA_DIR is not set")
    with ProgressLine(Console(file=io.StringIO())) as progress:
        found = of_real(
            tmp_path,
            tmp_path,
            workers=2,
            scheduler=None,
            smoke=True,
            seed=0,
            progress=progress,
        )
    if "skipped" in found:
        pytest.skip(found["skipped"])
    assert found["by_task"]["tasks"] == ["across", "forward"]
    assert found["errors"]["not_worse"] == found["errors"]["n"] == 12 - len(found["left_out"])
    assert found["misfit_cm"] < found["misfit_cm_yaw_pitch"]
    assert (tmp_path / "real_weights.png").stat().st_size > 10_000


def test_recordings_that_cannot_be_read_cost_no_report(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / real_reaches.SOURCE
    file.parent.mkdir(parents=True)
    file.write_text("version https://git-lfs.github.com/spec/v1")
    monkeypatch.setenv("HRI_DATA_DIR", str(tmp_path))
    arguments = ["--smoke", "--people", "2", "--runs", str(tmp_path), "--workers", "1"]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, result.output
    assert f"Left out: {file}" in (tmp_path / "motor_control.md").read_text()


def test_recordings_of_which_nothing_is_explained_cost_no_report(
    table: tuple[ReachTable, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found, _ = table
    file = tmp_path / real_reaches.SOURCE
    file.parent.mkdir(parents=True)
    file.touch()
    monkeypatch.setenv("HRI_DATA_DIR", str(tmp_path))
    none = replace(found, error=np.array(["too short"] * len(found)))
    monkeypatch.setattr(study_command, "explain_real", lambda *_, **__: (none, []))
    with ProgressLine(Console(file=io.StringIO())) as progress:
        told = of_real(
            tmp_path, tmp_path, workers=1, scheduler=None, smoke=True, seed=0, progress=progress
        )
    assert told["skipped"].startswith(f"no reach of {file} was explained by ")
    assert told["skipped"].endswith(": too short")


def test_names_of_real_people_may_have_blanks(
    table: tuple[ReachTable, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    reach = observed_of(table[0])
    tracks = [
        ArmTrack(reach.phases, np.zeros((len(reach.phases), 4, 3)), "left", "Ann B", "a task", 0)
    ]
    monkeypatch.setattr(
        real_reaches, "load_recordings", lambda *_: [SimpleNamespace(track=tracks[0])]
    )
    collected = CollectedReach(reach, ArmModel.of_body(), 0.0, "Ann B left", "a task.0")
    monkeypatch.setattr(real_reaches, "collect", lambda *_: ([collected], ["another: no arm"]))
    found, skipped = real_reaches.explain_real(
        tmp_path / "reach.npz", tmp_path / "kept.jsonl", workers=1
    )
    assert (found.person.tolist(), found.start.tolist()) == (["Ann B"], ["left"])
    assert found.target.tolist() == ["a task"]
    assert skipped == ["another: no arm"]


def test_weights_that_are_known_are_judged(table: tuple[ReachTable, Path]) -> None:
    found, _ = table
    exact = replace(found, alpha=found.truth, sd=np.full_like(found.sd, 1e-6))
    known = recovery(exact)
    assert known["median_largest_error"] == pytest.approx(0.0, abs=1e-12)
    assert known["r2"] == pytest.approx(1.0)
    assert known["covered_95"] == 1.0
    assert known["dynamic_correlation"] == pytest.approx(1.0)
    mean = np.tile(found.truth.mean(axis=0), (len(found), 1))
    spread = np.random.default_rng(0).normal(0.0, 1e-6, found.truth.shape)
    guessed = recovery(replace(found, alpha=mean + spread))
    assert guessed["r2"] == pytest.approx(0.0, abs=1e-3)


def test_low_targets_beside_high_ones(table: tuple[ReachTable, Path]) -> None:
    """All weight in energy for low targets, none for high ones; each person counts once."""
    found, _ = table
    low = np.isin(found.target, ["T3", "T6", "T9"])
    energy, smooth = (np.eye(4)[found.names.index(name)] for name in ("energy", "joint_jerk"))
    told = heights(replace(found, alpha=np.where(low[:, None], energy, smooth)))
    assert told["mean"] == pytest.approx(1.0)
    assert set(told["changes"]) == {"S1", "S2"}
    assert told["p"] is None  # of two people


def test_help_says_what_it_does() -> None:
    result = CliRunner().invoke(app, ["--help"])
    assert "recorded" in result.output
    assert "--scheduler" in result.output
