"""The command lines of the ontology, in their short forms."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hri_prediction.ontology.classifier import COST, InteractionClassifier
from hri_prediction.ontology.cost_file import load_costs
from hri_prediction.ontology.costs import COSTS, LENGTH_M
from hri_prediction.ontology.evaluation import REDUCED
from hri_prediction.ontology.movements import PENALTY
from hri_prediction.ontology.piirl import Learnt
from hri_prediction.ontology.recordings import tracks_of_bag, write_sessions
from hri_prediction.ontology.table import SegmentTable
from hri_prediction.results.options import run_app
from hri_prediction.ros.arm_bag import write_arms_bag
from hri_sim.ontology import costs_command, evaluation_command, training_command
from hri_sim.ontology.cosine import (
    ALL_JOINTS,
    ARM,
    cosine_lines,
    cosine_results,
    nearness_cosine,
    same_costs,
    seek_all,
)
from hri_sim.ontology.data import simulated_table
from hri_sim.ontology.sessions import DyadStudy, sessions_of
from hri_sim.ontology.splits import RANDOM, Split, do_splits
from hri_sim.ontology.strangers import judge_shipped
from hri_sim.tools import simulate_dyads


@pytest.fixture(scope="module")
def segments(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A few sessions of three cases."""
    folder = tmp_path_factory.mktemp("segments")
    study = DyadStudy(encounters=3)
    chosen = [s for s in sessions_of(study, 0) if s.subject in ("s1", "s2") and s.case in (1, 2, 3)]
    table = simulated_table(chosen, study, folder, 2, lambda done, of: None)
    table.save(folder / "segments.npz")
    return folder / "segments.npz"


def run(command: object, *arguments: object) -> int:
    return run_app(command.app, "x.py", [str(argument) for argument in arguments])  # type: ignore[attr-defined]


def test_segments_are_made_once(segments: Path) -> None:
    files = sorted(segments.parent.glob("segments_*.npz"))
    assert len(files) == 1
    table = SegmentTable.load(segments)
    # Three movements of either; one that gives way may be cut into two.
    assert 2 * 9 * 6 <= len(table) <= 1.2 * 2 * 9 * 6
    assert set(table.case.tolist()) == {1, 2, 3}


def test_training(segments: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    assert run(training_command, "--data", segments, "--out", out, "--runs", tmp_path) == 0
    model = InteractionClassifier.load(out / "interaction_cases.npz")
    assert model.classes.tolist() == [1, 2, 3]
    told = json.loads((out / "results.json").read_text())
    least, most = told["left_out"]["recognised_range"]
    assert 0.0 <= least <= told["left_out"]["recognised"] <= most <= 1.0
    assert told["left_out"]["draws"] == training_command.DRAWS
    assert sum(row["segments"] for row in told["left_out"]["calibration"]) > 20
    text = (out / "training.md").read_text()
    said = capsys.readouterr().out
    assert "recognised" in text
    assert "3 cases, 1" in said
    assert any("few recordings" in one for one in told["warnings"]) == ("few recordings" in said)
    assert all(one in text for one in told["warnings"])


def test_few_segments_are_learnt_and_none_left_out(
    segments: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    table = SegmentTable.load(segments)
    few = np.concatenate([np.flatnonzero(table.case == case)[:5] for case in (1, 2, 3)])
    table.where(np.isin(np.arange(len(table)), few)).save(tmp_path / "few.npz")
    out = tmp_path / "out"
    assert (
        run(training_command, "--data", tmp_path / "few.npz", "--out", out, "--runs", tmp_path) == 0
    )
    assert len(InteractionClassifier.load(out / "interaction_cases.npz").classes) == 3
    assert json.loads((out / "results.json").read_text())["left_out"] is None
    said = capsys.readouterr().out
    assert "3 cases, 15 segments\n" in said
    assert "warning: nothing was left out, so nobody knows how well it does: segments: 2 of" in said
    assert "nothing was left out" in (out / "training.md").read_text()


def test_who_trusts_a_classifier_is_warned(segments: Path) -> None:
    table = SegmentTable.load(segments)

    def found(recognised: float, sure: float, off: float = 0.0) -> list[str]:
        rows = [{"segments": 10, "sure": sure}, {"segments": 0, "sure": None}]
        content = {
            "recognised": recognised,
            "recognised_range": [recognised - off, recognised + off],
            "draws": 5,
            "chance": np.log(3.0),
            "calibration": rows,
        }
        return training_command.warnings(table, content)

    few = [one for one in found(0.9, 0.9) if one.startswith("few recordings of")]
    sessions = {case: len(set(table.session[table.case == case])) for case in (1, 2, 3)}
    assert bool(few) == (min(sessions.values()) < training_command.FEW)
    assert any("of no use" in one for one in found(0.4, 0.4))
    assert any("36 % were said on the average, 81 % were so" in one for one in found(0.81, 0.36))
    assert found(0.9, 0.85) == few
    (uneven,) = set(found(0.78, 0.8, off=0.18)) - set(few)
    assert "hangs on which recordings are left out: 60 to 96 % in 5 draws" in uneven


def test_a_session_is_kept_as_soon_as_it_is_made(tmp_path: Path) -> None:
    study = DyadStudy(encounters=1)
    chosen = [s for s in sessions_of(study, 0) if s.case == 1][:3]

    def stop(done: int, of: int) -> None:
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        simulated_table(chosen, study, tmp_path, 1, stop)
    (parts,) = [path for path in tmp_path.iterdir() if path.is_dir()]
    kept = {path: path.stat().st_mtime_ns for path in parts.iterdir()}
    assert len(kept) >= 2

    def look(done: int, of: int) -> None:
        if done == 1:
            assert {path: path.stat().st_mtime_ns for path in kept} == kept

    table = simulated_table(chosen, study, tmp_path, 1, look)
    assert len(set(table.session.tolist())) == 3
    assert [path.suffix for path in tmp_path.iterdir()] == [".npz"]


def test_evaluation(segments: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = (
        "--data",
        segments,
        "--out",
        tmp_path / "out",
        "--runs",
        tmp_path,
        "--repetitions",
        2,
        "--live",
        0,
        "--smoke",
    )
    assert run(evaluation_command, *arguments) == 0
    told = json.loads((tmp_path / "out" / "results.json").read_text())
    assert told["counts"] == [512, 68, 20, 7]
    assert set(told["location_invariance"]) == {"case_1", "case_2", "case_3"}
    assert set(told["location_invariance"]["case_1"]) == {"frontal", "orthogonal", "same side"}
    assert told["subjects"] == ["s1", "s2"]
    # What is of simulated people is not held against recordings.
    assert told["piirl_cosine"] is None
    assert told["live_latency_ms"] is None
    assert "Costs that are known" not in (tmp_path / "out" / "ontology.md").read_text()
    for name in ("intra", "subject_vs_group", "group_vs_subject"):
        assert len(told[name]) == 2
    for mean, (least, most) in zip(told["intra"], told["intra_range"], strict=True):
        assert least <= mean <= most
    for labels in ("full", "reduced"):
        assert 0.0 < told[labels]["by_subject"] <= 1.0
    text = (tmp_path / "out" / "ontology.md").read_text()
    assert "thesis, human data, random halves" in text
    assert 0.0 < told["grouped"]["by_subject"] <= 1.0
    assert min(told["shipped"]["grouped"], told["shipped"]["full"]) > 0.5
    assert told["options"] == {"random halves": 2, "cost": COST}
    assert "### The classifier that ships" in text
    for name in ("confusion_full.png", "confusion_reduced.png"):
        assert (tmp_path / "out" / name).exists()
    kept = len(list(tmp_path.glob("splits_*/*.json")))
    assert kept == 2 * 2 + 3 + 2 * 3 + 2 + 2 + 3
    assert set(told["position_left_out"]) == {"frontal", "orthogonal", "same side"}
    # Again: nothing is done twice.
    before = {path: path.stat().st_mtime_ns for path in tmp_path.glob("splits_*/*.json")}
    assert run(evaluation_command, *arguments) == 0
    assert before == {path: path.stat().st_mtime_ns for path in tmp_path.glob("splits_*/*.json")}
    assert "by subject" in capsys.readouterr().out


def test_a_table_that_was_left_half_is_written_anew(segments: Path, tmp_path: Path) -> None:
    """It is no reason to say of every split that these data do not allow it."""
    table = SegmentTable.load(segments)
    splits = [Split(RANDOM, REDUCED, "", 0, COST)]
    do_splits(table, splits, tmp_path, 1, lambda done, of: None)
    (half,) = tmp_path.glob("splits_*/segments.npz")
    half.write_bytes(half.read_bytes()[:1000])
    (done,) = half.parent.glob("*.json")
    done.unlink()
    (found,) = do_splits(table, splits, tmp_path, 1, lambda done, of: None).values()
    assert "counts" in found
    assert len(SegmentTable.load(half)) == len(table)


def test_the_classifier_that_ships_recognises_strangers(tmp_path: Path) -> None:
    """People whom it has not learnt, in all cases: no less than a part of what is reported."""
    study = DyadStudy(encounters=2, people=2)
    table = simulated_table(sessions_of(study, 5), study, tmp_path, 2, lambda done, of: None)
    found = judge_shipped(table)
    print(found.to_mapping())
    assert found.cases.overall > 0.4
    assert found.classes.overall > 0.6
    assert found.unlike < 0.1
    assert "none of the people" in "\n".join(found.lines(strangers=True))


def test_small_recordings_are_evaluated_as_far_as_they_go(segments: Path, tmp_path: Path) -> None:
    """As in the documentation: one recording of each case, or one case of each person."""
    table = SegmentTable.load(segments)
    single = table.where(table.subject == "s1").where(
        table.where(table.subject == "s1").position == "frontal"
    )
    person = (table.case == 1) & (table.subject == "s1") | (table.case == 2) & (
        table.subject == "s2"
    )
    for name, part in (("single", single), ("person", table.where(person))):
        part.save(tmp_path / f"{name}.npz")
        out = tmp_path / name
        done = run(
            evaluation_command, "--data", tmp_path / f"{name}.npz", "--out", out, "--runs", tmp_path,
            "--repetitions", 2, "--live", 0, "--smoke",
        )  # fmt: skip
        assert done == 0
        told = json.loads((out / "results.json").read_text())
        assert told["left_out"]
        assert (told["full"]["random"] is None) == (name == "single")  # too few of each
        text = (out / "ontology.md").read_text()
        assert "Left out, as these data do not allow it" in text
        why = {"single": "one recording of each case", "person": "nobody else did what s1 did"}
        assert why[name] in text


def test_known_costs_are_found_again(tmp_path: Path) -> None:
    """Movements that are optimal for them, on a few sessions."""
    study = DyadStudy(encounters=8)
    found = seek_all(study, 4, 3, tmp_path, 2, lambda done, of: None)
    assert [one.joints for one in found] == [ALL_JOINTS] * 4 + [ARM] * 4
    for one in found:
        print(one)
        assert one.agreement["known"] > 0.99
        assert one.agreement["known"] > one.flat
        assert min(one.cosines["known"], one.merged["known"]) > 0.8
        assert 0.005 < one.bend < 1.5
    for joints in (ALL_JOINTS, ARM):  # the chapter's bar
        own = [one for one in found if one.joints == joints]
        assert np.median([one.cosines["known"] for one in own]) >= 0.95
        assert np.median([one.merged["known"] for one in own]) >= 0.95
    wanted = [one.cosines["known"] >= 0.95 for one in found if one.joints == ARM]
    assert cosine_results(found)["piirl_cosine_arm_share"] == pytest.approx(
        np.mean(wanted), abs=1e-4
    )
    text = "\n".join(cosine_lines(found, "of simulated dyads"))
    assert f"| {100 * np.mean(wanted):.0f} % |" in text
    assert f"| {found[0].session.case} | {found[0].movements} | all |" in text
    # What is done is kept.
    files = sorted(tmp_path.iterdir())
    assert len(files) == 8
    assert seek_all(study, 4, 3, tmp_path, 2, lambda done, of: None) == found
    assert sorted(tmp_path.iterdir()) == files


def test_costs_that_are_the_same_have_one_name() -> None:
    rng = np.random.default_rng(0)
    columns = rng.normal(size=(50, 3))
    same = same_costs(columns[:, [0, 1, 0, 2, 1]] * (1.0, 1.0, 1.0 + 1e-6, 1.0, 1.01))
    assert same.tolist() == [0, 1, 0, 3, 4]  # a hundredth is a difference
    truth, found = np.zeros(26), np.zeros(26)
    truth[5], found[8], found[25] = 2.0, 1.0, 7.0
    learnt = Learnt(found, np.ones(26), 0.0, 0.1)
    assert nearness_cosine(truth, learnt) == 0.0
    merged = np.arange(25)
    merged[8] = 5
    assert nearness_cosine(truth, learnt, merged) == pytest.approx(1.0)


def test_learning_costs(tmp_path: Path) -> None:
    out = tmp_path / "out"
    arguments = ("--case", 2, "--smoke", "--samples", 60, "--runs", tmp_path)
    assert run(costs_command, "--out", out, *arguments) == 0
    found = load_costs(out / "costs.json")
    assert list(found.cases) == ["case_2"]
    assert found.cases["case_2"].movements >= 12
    assert np.isfinite(found.cases["case_2"].weights).all()
    assert (out / "costs.png").stat().st_size > 10_000
    # People moved by costs that are known, of which one edge goes over a space.
    assert found.cases["case_2"].cosine is not None
    assert found.cases["case_2"].cosine > 0.9
    assert "cosine" in (out / "costs.md").read_text()
    assert "a smoke run: of no use" in found.about
    assert any("smoke run" in text for text in found.warnings)
    # With the trunk as it was nothing can be learnt of where the shoulder is.
    assert "arm alone" in found.about
    shoulders = [k for k, name in enumerate(COSTS) if name.startswith("shoulder-")]
    assert (found.cases["case_2"].weights[shoulders] == 0.0).all()
    again = tmp_path / "again"
    kept = {path: path.stat().st_mtime_ns for path in tmp_path.glob("*.json")}
    assert len(kept) == 1
    assert run(costs_command, "--out", again, *arguments) == 0
    assert {path: path.stat().st_mtime_ns for path in tmp_path.glob("*.json")} == kept
    whole = tmp_path / "all"
    assert run(costs_command, "--out", whole, "--joints", "all", *arguments) == 0
    assert "all joints" in load_costs(whole / "costs.json").about


def test_costs_say_of_how_many_people_they_are(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ("--smoke", "--samples", 8, "--runs", tmp_path, "--workers", 1)
    told = ("--out", tmp_path / "out", "--case", 13, *arguments)
    assert run(costs_command, "--people", 5, *told) == 1
    assert "--people 5: case_13 has 4 in each position" in capsys.readouterr().err
    assert run(costs_command, "--people", 2, *told) == 0
    assert "2 people in each position;" in load_costs(tmp_path / "out" / "costs.json").about


def test_costs_of_recordings_are_drawn_anew(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """How like those of other draws they are, and what cannot be learnt of recordings, is said."""
    bags = tmp_path / "bags"
    arguments = ("--case", 13, "--position", "frontal", "--encounters", 2)
    assert run(simulate_dyads, "--out", bags, *arguments) == 0
    out = tmp_path / "out"
    arguments = ("--data", bags, "--samples", 8, "--joints", "all", "--workers", 1)
    assert run(costs_command, "--out", out, *arguments) == 0
    told = json.loads((out / "results.json").read_text())
    assert 0.0 <= told["alike"]["case_13"] <= 1.0 + 1e-9
    text, said = (out / "costs.md").read_text(), capsys.readouterr().out
    assert "alike |" in text
    assert "Nobody knows the costs of people who were recorded" in text
    assert "--joints all of recordings" in said
    assert all(one in text and one in said for one in told["warnings"])
    assert told["options"] == {
        "seed": 0,
        "people": None,
        "samples": 8,
        "penalty": PENALTY,
        "length": LENGTH_M,
        "joints": "all",
    }
    near = tmp_path / "near"
    assert run(costs_command, "--out", near, "--length", 0.1, *arguments) == 0
    found, usual = (load_costs(folder / "costs.json") for folder in (near, out))
    assert (found.length, usual.length) == (0.1, LENGTH_M)
    assert (found.cases["case_13"].scale < usual.cases["case_13"].scale)[:25].all()


def test_movements_that_are_refused_are_counted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """And a recording of which nothing is left is named."""
    bags = tmp_path / "bags"
    for case in (1, 2):
        arguments = ("--case", case, "--position", "frontal", "--encounters", 4)
        assert run(simulate_dyads, "--out", bags / str(case), *arguments) == 0
    (one,) = (bags / "1").glob("case_1_*")
    (other,) = (bags / "2").glob("case_2_*")
    tracks = tracks_of_bag(other)
    lost = tracks[1].keypoints.copy()
    lost[:, 1] = np.nan  # the elbow of one of them
    write_arms_bag(bags / "blind", [tracks[0], replace(tracks[1], keypoints=lost)], {})
    write_sessions(
        bags / "sessions.yaml",
        [
            {"bag": str(path.relative_to(bags)), "case": case, "subject": "s1"}
            for path, case in ((one, 1), (other, 2), (bags / "blind", 2))
        ],
    )
    out = tmp_path / "out"
    arguments = ("--data", bags, "--out", out, "--runs", tmp_path)
    assert run(training_command, *arguments) == 0
    told = json.loads((out / "results.json").read_text())
    line = next(line for line in told["refused"] if line.startswith("blind: "))
    assert "8 of 8 movements refused" in line
    assert "both arms were seen for too little of it" in line
    assert line in (out / "training.md").read_text()
    assert line in capsys.readouterr().out
    assert told["sessions"] == 2


def test_dyads_that_are_broken_off_leave_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """So that the same command can be given again, as it says."""
    arguments = ("--out", tmp_path / "dyads", "--case", 1, "--encounters", 1)
    record, count = simulate_dyads.record_session, 0

    def stopped(*given: object) -> object:
        nonlocal count
        count += 1
        if count == 2:
            raise KeyboardInterrupt
        return record(*given)  # type: ignore[arg-type]

    with monkeypatch.context() as patched:
        patched.setattr(simulate_dyads, "record_session", stopped)
        assert run(simulate_dyads, *arguments) == 130
    assert "nothing of it is kept" in capsys.readouterr().out
    assert list((tmp_path / "dyads").iterdir()) == []
    assert [path.name for path in tmp_path.iterdir()] == ["dyads"]
    assert run(simulate_dyads, *arguments) == 0
    assert "sessions.yaml" in {path.name for path in (tmp_path / "dyads").iterdir()}


@pytest.mark.parametrize(
    ("command", "arguments", "said"),
    [
        (training_command, ("--data", "nowhere.npz"), "--data nowhere.npz: cannot read"),
        (training_command, ("--data", "nowhere"), "sessions"),
        (evaluation_command, ("--data", "nowhere.yaml"), "--data nowhere.yaml"),
        (
            evaluation_command,
            ("--data", "some.npz", "--live", "30"),
            "--live 30 with --data some.npz",
        ),
        (costs_command, ("--case", "21"), "1 to 20"),
        (costs_command, ("--length", "0.1"), "--length 0.1 with simulated people"),
        (training_command, ("--data", "some.npz", "--smoke"), "--smoke with --data some.npz"),
        (costs_command, ("--data", "nowhere"), "nowhere"),
        (costs_command, ("--joints", "legs"), "one of all, arm"),
        (costs_command, ("--data", "nowhere", "--people", 2), "--people with --data nowhere"),
        (costs_command, ("--data", "nowhere", "--smoke"), "--smoke with --data nowhere"),
    ],
)
def test_what_is_wrong_is_said(
    command: object, arguments: tuple[str, ...], said: str, tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    assert run(command, *arguments, "--out", tmp_path / "out") == 1
    error = capsys.readouterr().err
    assert error.startswith("error: ")
    assert said in error
    assert error.count("\n") == 1
