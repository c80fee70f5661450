"""Training jobs: a policy in a folder, made once, of the data that it says."""

import json
import os
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from recorded_dyad import record_dyad

from hri_planner.rnn.model_file import read_policy
from hri_planner.rnn.training.config import TrainingConfig
from hri_prediction.errors import ConfigError, DataError
from hri_prediction.tracks.files import save_tracks
from hri_sim.policies.jobs import is_trained, job_data, made_of, rounds, train_job
from hri_sim.policies.table import Job, table_jobs
from hri_sim.policies.training_command import SMOKE, chosen_jobs

CONFIG = replace(TrainingConfig(), **SMOKE)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("dyads")
    for seed in (1, 2):
        save_tracks(folder / f"{seed}.npz", record_dyad(seed, 4).tracks())
    return folder


@pytest.fixture
def job(recorded: Path, tmp_path: Path) -> Job:
    path = tmp_path / "dyad.npz"
    shutil.copy(recorded / "1.npz", path)
    return Job("small", str(path), CONFIG)


def test_a_policy_says_how_it_came_about(job: Job, tmp_path: Path) -> None:
    said: list[tuple[int, int, str]] = []
    path = train_job(job, tmp_path, 0, {"commit": "abc"}, lambda *words: said.append(words))
    assert [(done, of) for done, of, _ in said] == [(1, 3), (2, 3), (3, 3)]
    assert said[0][2].startswith("imitation, validation ")
    model, trained = read_policy(path)
    assert model.network.units == (3, 3)
    assert trained["origin"] == {"commit": "abc"}
    assert trained["data"] == "dyad.npz"
    assert trained["config"]["units"] == [3, 3]
    how = json.loads((tmp_path / "small.json").read_text())
    assert [line["stage"] for line in how["rounds"]] == ["imitation", "closed_loop", "closed_loop"]
    assert how["data_hash"] == trained["data_hash"] != ""


def test_what_is_trained_is_left_and_another_is_not_replaced(
    job: Job, recorded: Path, tmp_path: Path
) -> None:
    path = train_job(job, tmp_path, 0, {})
    before, content = path.stat().st_mtime_ns, path.read_bytes()
    train_job(job, tmp_path, 0, {"commit": "later"})
    assert path.stat().st_mtime_ns == before
    made = made_of(job, 0)
    assert is_trained(path, made)
    for changed, words in (
        (made_of(job, 1), "data_seed 0, not 1"),
        (made_of(replace(job, learner="ann"), 0), "learner , not ann"),
        (made_of(replace(job, config=replace(CONFIG, seed=1)), 0), "seed 0, not 1"),
    ):
        with pytest.raises(ConfigError, match=f"made otherwise .{words}.*write elsewhere"):
            is_trained(path, changed)
    # The same name for another recording.
    shutil.copy(recorded / "2.npz", job.data)
    with pytest.raises(ConfigError, match=r"made otherwise .data_hash "):
        train_job(job, tmp_path, 0, {})
    assert path.read_bytes() == content
    path.write_bytes(content[:100])
    assert not is_trained(path, made)


def test_another_recording_gives_another_policy(job: Job, recorded: Path, tmp_path: Path) -> None:
    for name in ("one", "other"):
        (tmp_path / name).mkdir()
    first = read_policy(train_job(job, tmp_path / "one", 0, {}))[0]
    shutil.copy(recorded / "2.npz", job.data)
    other = read_policy(train_job(job, tmp_path / "other", 0, {}))[0]
    assert np.abs(first.network.weight - other.network.weight).max() > 1e-6


def test_a_checkpoint_is_gone_when_all_is_done_and_a_damaged_one_refused(
    job: Job, tmp_path: Path
) -> None:
    path = train_job(job, tmp_path, 0, {})
    content, checkpoint = path.read_bytes(), tmp_path / "small.training.npz"
    assert sorted(file.name for file in tmp_path.glob("small*")) == ["small.json", "small.npz"]
    path.unlink()
    checkpoint.write_bytes(content[:200])
    with pytest.raises(DataError, match=r"small\.training\.npz"):
        train_job(job, tmp_path, 0, {})
    assert not path.exists()


def test_data_are_a_recordings_or_a_sets(job: Job, tmp_path: Path) -> None:
    both, ann = job_data(job, 0), job_data(replace(job, learner="ann"), 0)
    assert len(ann.learnt) < len(both.learnt)
    assert {one.pair for one in both.test} == {"ann and bob"}
    with pytest.raises(DataError, match="nobody is called 'eve'"):
        job_data(replace(job, learner="eve"), 0)
    with pytest.raises(ConfigError, match="data set 'nowhere'"):
        job_data(replace(job, data="nowhere"), 0)
    assert "data_hash" not in made_of(replace(job, data="D1"), 0)


@pytest.mark.skipif("HRI_DATA_DIR" not in os.environ, reason="needs the recordings (HRI_DATA_DIR)")
def test_handovers_are_learnt_from_all_pairs_but_one(monkeypatch: pytest.MonkeyPatch) -> None:
    job = Job("pair", "handover-without-3", CONFIG)
    data = job_data(job, 0)
    assert {one.pair for one in data.test} == {"3"}
    assert "3" not in {one.pair for one in (*data.learnt, *data.validation)}
    assert made_of(job, 0)["data_hash"] != ""
    (chosen,) = chosen_jobs(CONFIG, job.data, "", False, "")
    assert chosen.data == job.data
    monkeypatch.delenv("HRI_DATA_DIR")
    with pytest.raises(ConfigError, match="HRI_DATA_DIR is not set"):
        made_of(job, 0)


def test_the_table_has_24_configurations() -> None:
    jobs = {job.name: job for job in table_jobs(TrainingConfig(seed=4))}
    assert list(jobs) == [f"C{number}" for number in range(1, 25)]
    assert (jobs["C7"].config.cell, jobs["C7"].config.units, jobs["C7"].data) == (
        "gru3t",
        (9, 9),
        "D1",
    )
    assert (jobs["C12"].config.cell, jobs["C12"].data) == ("lstm", "D2")
    assert (jobs["C21"].config.cell, jobs["C21"].data) == ("lstm", "D3-2")
    assert jobs["C24"].data == "D3-3"
    assert all(job.config.seed == 4 for job in jobs.values())
    assert rounds(jobs["C1"]) == TrainingConfig().imitation_rounds + TrainingConfig().closed_rounds
