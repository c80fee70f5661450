"""Training, storing and loading the task library."""

import contextlib
import dataclasses
import json

import numpy as np
import pytest

from hri_prediction.errors import ConfigError, DataError
from hri_prediction.prediction import PredictorConfig, TaskLibrary, train_library
from hri_prediction.prediction.cli import train_main
from hri_prediction.prediction.training import train
from hri_prediction.tracks.files import save_tracks

LEFT = np.array([-0.45, -0.25, -0.1])


def test_library_describes_its_tracks(library):
    assert [(t.name, t.side) for t in library.tasks] == [
        ("left bin", "right"),
        ("right bin", "right"),
    ]
    for task in library.tasks:
        assert task.demonstrations == 6
        assert 0.7 < task.duration_mean_s < 1.1
        assert task.duration_std_s > 0.05
        assert task.residual_m < 0.002
    assert library.upper_arm_m == pytest.approx(0.29, abs=0.005)
    assert library.forearm_m == pytest.approx(0.26, abs=0.005)
    assert library.for_side("left") == library.tasks  # nothing better is known


def test_end_points_are_those_of_the_tasks(library):
    ends = {t.name: t.promp.trajectory_mean([1.0])[0, 3:] for t in library.tasks}
    np.testing.assert_allclose(ends["left bin"], [-0.45, -0.25, -0.1], atol=0.02)
    np.testing.assert_allclose(ends["right bin"], [-0.45, 0.25, -0.1], atol=0.02)


def test_saved_library_is_the_same(library, tmp_path):
    library.save(tmp_path / "library.npz")
    loaded = TaskLibrary.load(tmp_path / "library.npz")
    assert loaded.upper_arm_m == library.upper_arm_m
    for a, b in zip(loaded.tasks, library.tasks, strict=True):
        assert (a.name, a.side, a.duration_mean_s) == (b.name, b.side, b.duration_mean_s)
        np.testing.assert_array_equal(a.promp.covariance, b.promp.covariance)
    with np.load(tmp_path / "library.npz", allow_pickle=False) as archive:
        header = json.loads(str(archive["header"]))
    assert header["units"] == "metre, second"


def test_damaged_and_mismatching_files_are_named(library, tmp_path):
    path = tmp_path / "library.npz"
    library.save(path)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    with pytest.raises(DataError, match=r"library\.npz"):
        TaskLibrary.load(path)
    with pytest.raises(DataError):
        TaskLibrary.load(tmp_path / "absent.npz")
    header = {"format": "hri-task-library-1", "tasks": [{"name": "a", "side": "left"}]}
    np.savez(path, header=np.array(json.dumps(header)))
    with pytest.raises(DataError, match="lacks or garbles"):
        TaskLibrary.load(path)
    np.savez(path, header=np.array(json.dumps({"format": "hri-promp-1"})))
    with pytest.raises(DataError, match="hri-promp-1"):
        TaskLibrary.load(path)


def test_bits_flipped_anywhere_never_escape_as_other_errors(library, tmp_path):
    path, rng = tmp_path / "library.npz", np.random.default_rng(0)
    library.save(path)
    content = path.read_bytes()
    for _ in range(40):
        damaged = bytearray(content)
        damaged[rng.integers(len(content))] ^= 0xFF
        path.write_bytes(bytes(damaged))
        with contextlib.suppress(DataError):
            TaskLibrary.load(path)


def test_inconsistent_libraries_are_refused(library):
    with pytest.raises(DataError, match="empty"):
        TaskLibrary((), 0.3, 0.3)
    with pytest.raises(DataError, match="twice"):
        TaskLibrary((library.tasks[0], library.tasks[0]), 0.3, 0.3)
    with pytest.raises(DataError, match="side"):
        TaskLibrary((dataclasses.replace(library.tasks[0], side="up"),), 0.3, 0.3)


def test_unusable_tracks_are_reported(tracks, config):
    still = dataclasses.replace(
        tracks[0], keypoints=np.broadcast_to(tracks[0].keypoints[:1], tracks[0].keypoints.shape)
    )
    result = train([still, *tracks], config)
    assert len(result.skipped) == 1
    assert "no reach" in result.skipped[0]
    with pytest.raises(DataError, match="no task"):
        train_library([still], config)
    with pytest.raises(DataError, match="at least 7"):
        train(tracks, dataclasses.replace(config, min_demonstrations=7))
    with pytest.raises(DataError, match="group_by"):
        train(tracks, config, group_by="colour")


def test_several_persons_make_wider_tasks(tracks, config):
    names = [dataclasses.replace(t, subject=str(i % 2)) for i, t in enumerate(tracks)]
    one, two = train_library(tracks, config), train_library(names, config)
    for a, b in zip(one.tasks, two.tasks, strict=True):
        assert np.trace(b.promp.covariance) > np.trace(a.promp.covariance)


def test_command_line(tracks, tmp_path, capsys):
    save_tracks(tmp_path / "reaches.npz", tracks)
    out = tmp_path / "out"
    assert train_main([str(tmp_path / "reaches.npz"), "--out", str(out), "--smoke"]) == 0
    assert {p.name for p in out.iterdir()} == {
        "library.npz",
        "results.json",
        "results.md",
        "wrist.png",
    }
    assert len(TaskLibrary.load(out / "library.npz").tasks) == 2
    results = json.loads((out / "results.json").read_text())
    assert results["tasks"][0]["demonstrations"] == 5
    assert results["origin"].keys() == {"commit", "date", "machine"}
    assert (out / "results.md").read_text().startswith("Commit ")
    capsys.readouterr()
    before = (out / "library.npz").read_bytes()
    again = [str(tmp_path / "reaches.npz"), "--out", str(out), "--smoke"]
    assert train_main(again) == 1
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "library.npz" in error
    assert "--overwrite" in error
    assert (out / "library.npz").read_bytes() == before
    (out / "library.npz").write_bytes(b"")
    assert train_main([*again, "--overwrite"]) == 0
    assert (out / "library.npz").read_bytes() == before
    capsys.readouterr()
    assert train_main([*again[:2], str(tmp_path / "library.npz")]) == 1
    assert "a folder" in capsys.readouterr().err
    new = tmp_path / "new"
    assert train_main([str(tmp_path / "none.npz"), "--out", str(new)]) == 1
    assert capsys.readouterr().err.count("\n") == 1
    arguments = [str(tmp_path / "reaches.npz"), "--out", str(new), "--leave-out-subject", "x"]
    assert train_main(arguments) == 1
    assert "expected one of one" in capsys.readouterr().err
    assert train_main(["--no-such-option"]) == 2


def test_config_is_checked():
    with pytest.raises(ConfigError, match="onset_speed"):
        PredictorConfig(onset_speed=0.5)
    with pytest.raises(ConfigError, match="output"):
        PredictorConfig(output="median")


def test_a_task_seen_once_varies_as_the_others_do(reach_maker):
    rng = np.random.default_rng(1)
    often = [
        reach_maker("left bin", rng, trial=i, duration=float(length), target=LEFT + shift)
        for i, (length, shift) in enumerate(
            zip(np.linspace(0.7, 1.5, 6), 0.06 * rng.standard_normal((6, 3)), strict=True)
        )
    ]
    once = reach_maker("right bin", rng, duration=1.0)
    among = train_library([*often, once])
    known, single = among.tasks
    assert (known.demonstrations, single.demonstrations) == (6, 1)
    alone = train_library([once]).tasks[0]
    assert alone.duration_log_sd == pytest.approx(0.1, rel=0.05)
    assert single.duration_log_sd > 2.0 * alone.duration_log_sd
    spread, narrow = (
        np.sqrt(np.trace(task.promp.trajectory_covariance([1.0])[0][3:, 3:]))
        for task in (single, alone)
    )
    assert spread > 1.3 * narrow
    # What was seen often speaks for itself.
    steady = train_library(often).tasks[0]
    assert known.duration_log_sd == pytest.approx(steady.duration_log_sd)
