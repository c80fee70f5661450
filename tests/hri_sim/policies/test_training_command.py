"""The command that trains policies, as users give it; killed and begun again, too."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import yaml
from recorded_dyad import record_dyad
from typer.testing import CliRunner

from hri_planner.rnn.model_file import load_policy, read_policy
from hri_planner.rnn.training.config import TrainingConfig
from hri_prediction.errors import ConfigError
from hri_prediction.tracks.files import save_tracks
from hri_sim.policies.training_command import app, chosen_jobs

WITHOUT_TORCH = """
import sys

class Without:
    def __init__(self, finder):
        self.finder = finder

    def find_spec(self, name, *rest):
        return None if name.split(".")[0] == "torch" else self.finder.find_spec(name, *rest)

sys.meta_path[:] = [Without(finder) for finder in sys.meta_path]
"""


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("recording") / "Two people.npz"
    save_tracks(path, record_dyad(1, 5).tracks())
    return path


def test_a_smoke_run_leaves_a_policy(recording: Path, tmp_path: Path) -> None:
    out = tmp_path / "policies"
    words = ["--data", str(recording), "--learner", "ann", "--out", str(out), "--smoke"]
    result = CliRunner().invoke(app, [*words, "--seed", "7"])
    assert result.exit_code == 0, result.output
    path = out / "rnn_gru_3x3_two_people_ann.npz"
    assert f"policy: {path}" in result.output
    model, trained = read_policy(path)
    assert model.network.units == (3, 3)
    assert trained["config"]["seed"] == 7
    assert trained["learner"] == "ann"
    before = path.stat().st_mtime_ns
    assert CliRunner().invoke(app, [*words, "--seed", "7"]).exit_code == 0
    assert path.stat().st_mtime_ns == before


def test_a_killed_training_ends_in_the_same_policy(recording: Path, tmp_path: Path) -> None:
    config = tmp_path / "config.yaml"
    values = {
        "cell": "gru", "units": [3, 3], "imitation_rounds": 3, "imitation_iterations": 2,
        "closed_rounds": 60, "closed_iterations": 2, "batch": 4, "first_horizon": 8,
        "last_horizon": 12, "patience": 60,
    }  # fmt: skip
    config.write_text(yaml.safe_dump(values))

    def words(out: Path) -> list[str]:
        return ["--data", str(recording), "--config", str(config), "--out", str(out)]

    name = "rnn_gru_3x3_two_people"
    whole, killed = tmp_path / "whole", tmp_path / "killed"
    checkpoint = killed / f"{name}.training.npz"
    code = "from hri_sim.policies.training_command import main; main()"
    process = subprocess.Popen(
        [sys.executable, "-c", code, *words(killed)], stdout=subprocess.DEVNULL
    )
    changes, seen, end = 0, 0, time.monotonic() + 60.0
    while changes < 8:
        assert time.monotonic() < end
        assert process.poll() is None, "it ended before it could be killed"
        now = checkpoint.stat().st_mtime_ns if checkpoint.exists() else 0
        changes, seen = changes + (now != seen), now
        time.sleep(0.001)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    assert not (killed / f"{name}.npz").exists()
    for out in (killed, whole):
        assert CliRunner().invoke(app, words(out)).exit_code == 0
    found, wanted = (load_policy(folder / f"{name}.npz") for folder in (killed, whole))
    for key, values in wanted.network.to_arrays().items():
        assert found.network.to_arrays()[key].tobytes() == values.tobytes()


def test_without_torch_it_says_how_to_get_it(tmp_path: Path) -> None:
    code = WITHOUT_TORCH + (
        "from hri_prediction.errors import ConfigError\n"
        "from hri_sim.policies.training_command import app\n"
        "try: app(['--out', 'x'], standalone_mode=False)\n"
        "except ConfigError as error: print(error)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path, check=False
    )
    assert done.stdout.startswith("torch is not installed"), done.stderr
    assert "requirements/training.txt" in done.stdout
    assert not list(tmp_path.iterdir())


def test_what_runs_without_torch_imports_none() -> None:
    code = WITHOUT_TORCH + (
        "import hri_planner.rnn.rollout, hri_planner.rnn.model_file, hri_sim.policies.jobs\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"data": "D4"}, "--data D4; expected one of D1, D2, .* or a recording that exists"),
        ({"learner": "ann"}, "--learner ann with --data D1; give a recording"),
        ({"only": "C7"}, "--only C7 without --table"),
        ({"table": True, "only": "C7,C99"}, "--only C99; expected some of C1, "),
        ({"table": True, "data": "."}, r"--table with --data \."),
    ],
)
def test_options_that_cannot_be_are_named(options: dict, words: str) -> None:
    given = {"data": "D1", "learner": "", "table": False, "only": "", **options}
    with pytest.raises(ConfigError, match=words):
        chosen_jobs(TrainingConfig(), **given)


def test_some_of_the_table_can_be_chosen() -> None:
    jobs = chosen_jobs(TrainingConfig(), "D1", "", True, "C7, C21")
    assert [(job.name, job.data) for job in jobs] == [("C7", "D1"), ("C21", "D3-2")]
    assert len(chosen_jobs(TrainingConfig(), "D1", "", True, "")) == 24
    (one,) = chosen_jobs(TrainingConfig(cell="lstm", units=(5, 5)), "D3-1", "", False, "")
    assert one.name == "rnn_lstm_5x5_d3-1"
