"""The command lines of the evaluation, on simulated people."""

import json

import numpy as np
import pytest

from hri_prediction.errors import ConfigError, DataError
from hri_prediction.evaluation.folds import LEAVE_ONE_OUT, NEW_TASK, WITHIN
from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.tracks.files import save_tracks
from hri_sim.evaluation import evaluate, reproduce
from hri_sim.evaluation.unknown_targets import unknown_target_lines
from hri_sim.people.population import FAMILIES, population


def run_main(monkeypatch, module, *arguments) -> int:
    monkeypatch.setattr("sys.argv", ["script", *map(str, arguments)])
    with pytest.raises(SystemExit) as stop:
        module.main()
    return int(stop.value.code or 0)


def test_simulated_people(tmp_path, monkeypatch, capsys):
    out = tmp_path / "out"
    options = ("--people", "via_points", "--protocol", LEAVE_ONE_OUT, "--observed", "0.5,0.3")
    arguments = ("--out", out, *options, "--smoke", "--workers", "1")
    assert run_main(monkeypatch, evaluate, *arguments) == 0
    assert {p.name for p in out.iterdir()} == {
        "results.json",
        "results.md",
        "error.png",
        "calibration.png",
        "tubes.png",
        "folds",
    }
    results = json.loads((out / "results.json").read_text())
    assert results["protocol"] == LEAVE_ONE_OUT
    assert (results["data"], results["people"]) == ("simulated", "via_points")
    assert (results["observed"], results["n"], results["subjects"]) == (0.3, 16, 2)
    assert results["durations_from"] == "the truth"
    assert set(results["origin"]) == {"commit", "date", "machine"}
    figures = results["predictors"]["promp"]
    assert set(figures["endpoint_error_m"]) == {"median", "mean", "p95"}
    assert figures["latency_us"] > 0.0
    text = (out / "results.md").read_text()
    for name in results["predictors"]:
        assert f"| `{name}` |" in text
    assert "| reaches noticed | " in text
    assert "held against the truth" in text
    assert "16 reaches" in capsys.readouterr().out.replace("\n", " ")


def test_track_files_and_those_without_names(tmp_path, monkeypatch):
    reaches = [reach.track for reach in population("matched", 1, 3, 0)]
    save_tracks(tmp_path / "mine.npz", reaches)
    arguments = ("--data", tmp_path / "mine.npz", "--workers", "1", "--smoke")
    assert run_main(monkeypatch, evaluate, "--out", tmp_path / "a", *arguments) == 0
    results = json.loads((tmp_path / "a" / "results.json").read_text())
    assert (results["data"], results["task_from"], results["n"]) == ("mine.npz", "task", 8)
    assert "people" not in results
    assert results["durations_from"].startswith("what the segmentation cuts")
    nameless = [t for t in reaches if t.task in ("middle", "far_side")]
    for track in nameless:
        object.__setattr__(track, "task", "")
    save_tracks(tmp_path / "nameless.npz", nameless)
    job = evaluate.Job(
        str(tmp_path / "nameless.npz"),
        "matched",
        WITHIN,
        (0.3,),
        PredictorConfig(),
        "auto",
        0,
        False,
    )
    recordings, group_by = evaluate.read_data(job)
    assert (len(recordings), group_by) == (6, "movement")


def test_simulated_people_who_do_not_match_learn_from_those_who_do():
    segmentation = PredictorConfig().segmentation
    people = evaluate.simulated_recordings("other_lengths", 0, segmentation, smoke=True)
    kinds = {(r.track.source.split(", ")[1], r.teaches, r.judged) for r in people}
    assert kinds == {("matched", True, False), ("other_lengths", False, True)}
    assert all(r.reaches[0].onset_s == 0.0 for r in people)
    matched = evaluate.simulated_recordings("matched", 0, segmentation, smoke=True)
    assert all(r.teaches and r.judged for r in matched)


@pytest.mark.parametrize(
    ("options", "error", "problem"),
    [
        (("--observed", "30"), ConfigError, "--observed 30"),
        (("--observed", "0.3,0.3"), ConfigError, "--observed 0.3,0.3"),
        (("--observed", "some"), ConfigError, "--observed some"),
        (("--protocol", "between"), ConfigError, "within"),
        (("--people", "martians"), ConfigError, "via_points"),
        (("--task-from", "colour"), ConfigError, "movement"),
        (("--data", "nowhere.npz"), DataError, "nowhere.npz"),
    ],
)
def test_wrong_arguments_are_named(tmp_path, monkeypatch, options, error, problem):
    monkeypatch.setattr("sys.argv", ["script", "--out", str(tmp_path / "o"), *options])
    with pytest.raises(error, match=problem):
        evaluate.main()


def test_an_out_that_is_a_file_is_refused(tmp_path, monkeypatch):
    (tmp_path / "o").write_text("")
    monkeypatch.setattr("sys.argv", ["script", "--out", str(tmp_path / "o" / "p")])
    with pytest.raises(ConfigError, match="--out"):
        evaluate.main()


def test_ctrl_c_says_that_it_can_go_on(tmp_path, monkeypatch, capsys):
    def interrupted(*_args, **_kwargs):
        raise KeyboardInterrupt

    monkeypatch.setattr(evaluate, "run_job", interrupted)
    assert run_main(monkeypatch, evaluate, "--out", tmp_path) == 130
    assert "goes on" in capsys.readouterr().out


def test_what_is_reproduced(tmp_path, monkeypatch):
    jobs, skipped = reproduce.jobs(None, 0, smoke=False)
    assert {job.people for job in jobs.values()} == set(FAMILIES)
    assert len(jobs) == len(FAMILIES) + 2
    assert len(skipped) == 2
    assert all("HRI_DATA_DIR" in line for line in skipped)
    for file in (reproduce.ADL, reproduce.RUNS):
        (tmp_path / file).parent.mkdir()
        (tmp_path / file).write_bytes(b"")
    jobs, skipped = reproduce.jobs(tmp_path, 0, smoke=False)
    assert (len(jobs), skipped) == (len(FAMILIES) + 7, [])
    assert jobs[f"adl_{LEAVE_ONE_OUT}"].protocol == LEAVE_ONE_OUT
    assert {name for name, job in jobs.items() if job.protocol == NEW_TASK} == {
        f"adl_{NEW_TASK}",
        f"matched_{NEW_TASK}",
    }
    assert jobs[f"dfki_{WITHIN}"].config.min_demonstrations == 3
    monkeypatch.setenv("HRI_DATA_DIR", str(tmp_path / "none"))
    with pytest.raises(ConfigError, match="HRI_DATA_DIR"):
        reproduce.recordings_folder()


def test_the_report_of_everything(tmp_path, monkeypatch):
    monkeypatch.delenv("HRI_DATA_DIR", raising=False)
    monkeypatch.setattr(reproduce, "OBSERVED", (0.3, 0.35))
    monkeypatch.setattr(reproduce, "FAMILIES", ("minimum_jerk",))
    every = reproduce.jobs
    monkeypatch.setattr(
        reproduce,
        "jobs",
        lambda *a: (
            {k: v for k, v in every(*a)[0].items() if k in (name, f"matched_{NEW_TASK}")},
            every(*a)[1],
        ),
    )
    name = f"minimum_jerk_{LEAVE_ONE_OUT}"
    out, runs = tmp_path / "results", tmp_path / "runs"
    arguments = ("--out", out, "--runs", runs, "--smoke", "--workers", "1")
    assert run_main(monkeypatch, reproduce, *arguments) == 0
    content = json.loads((out / "prediction.json").read_text())
    assert list(content["evaluations"]) == [f"matched_{NEW_TASK}", name]
    assert content["segmentation"] == {}
    assert len(content["skipped"]) == 2
    text = (out / "prediction.md").read_text()
    assert "## Simulated people who move along plain minimum-jerk lines" in text
    assert "HRI_DATA_DIR" in text
    plots = [line.split("(")[1].rstrip(")") for line in text.splitlines() if line.startswith("![")]
    assert len(plots) == 4
    assert "| predictor | 30 % seen: end point [mm] |" in text
    assert "learnt from other people's reaches to other targets" in text
    assert "simulated, `minimum_jerk`, leave-one-subject-out" in text
    assert all((out / plot).is_file() for plot in plots)


def test_reaches_to_unknown_targets_stand_beside_those_to_known_ones():
    def of(end: float, *names: str) -> dict:
        figures = {"endpoint_error_m": {"median": end}, "coverage50": 0.4, "coverage95": None}
        shares = {share: dict.fromkeys(names, figures) for share in ("0.3", "0.5", "0.8")}
        return {"n": 7, "predictors": shares["0.3"], "by_observed": shares}

    results = {f"adl_{NEW_TASK}": of(0.15, "promp", "minimum_jerk")}
    titles = {"adl": "Seated", "dfki": "Places"}
    lines = unknown_target_lines(titles, results)
    assert lines[4] == "Seated, 7 reaches:"
    row = "| 40 % | – % | 150 | 40 % | – % |"
    assert lines[8:10] == [f"| `promp` | 150 {row}", f"| `minimum_jerk` | 150 {row}"]
    beside = unknown_target_lines(titles, results | {f"adl_{LEAVE_ONE_OUT}": of(0.04, "promp")})
    assert beside[10] == "| `promp`, target shown | 40 | 40 % | – % | 40 | 40 % | – % |"
    assert unknown_target_lines(titles, {f"adl_{LEAVE_ONE_OUT}": of(0.04, "promp")}) == []


def test_segmentation_is_checked_where_there_are_labels(tmp_path):
    assert reproduce.check_segmentation(None, PredictorConfig().segmentation) == {}
    path = tmp_path / reproduce.ADL
    path.parent.mkdir()
    reach = population("matched", 1, 1, 0)[0].track.resampled(100.0)
    rows = len(reach)
    pos = np.nan_to_num(reach.keypoints, nan=0.0)
    np.savez(
        path,
        pos=pos,
        joint_names=np.array(["shoulder", "elbow", "wrist", "fingertip"]),
        start=np.array([0]),
        length=np.array([rows]),
        onset=np.array([30]),
        offset=np.array([rows - 30]),
        subject=np.array([1]),
        side=np.array(["R"]),
        trial=np.array([1]),
        task=np.array(["A"]),
    )
    found = reproduce.check_segmentation(tmp_path, PredictorConfig().segmentation)
    assert list(found) == ["ADL, 5 % of peak speed"]
    assert found["ADL, 5 % of peak speed"]["labels"] == 1
