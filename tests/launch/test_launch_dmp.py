"""``scripts/launch_dmp.py`` and ``scripts/adapt_policy.py`` with real processes; wrong arguments."""

from __future__ import annotations

import json
import signal
import time
from collections.abc import Callable
from pathlib import Path

import psutil
import pytest
from launched import Launched
from typer.testing import CliRunner

from hri_planner.dmp.model_file import load_dmp, save_dmp
from hri_planner.dmp.policy import DmpPolicy
from hri_planner.pibb.experiment_file import find_experiment, load_experiment
from hri_planner.pibb.library import PolicyLibrary
from hri_planner.robot.model import load_robot
from hri_prediction.bags.reader import BagReader
from hri_prediction.ros.messages import PolicyStatus
from hri_sim.launch.adapt import app as adapt_app
from hri_sim.launch.dmp import DEFAULT_POLICY
from hri_sim.launch.dmp import app as launch_app

Launch = Callable[..., Launched]
TOPICS = {"/adaptation/status", "/policy/status", "/joint_states", "/sim/state"}


def test_movement_primitives_move_the_robot(launch: Launch) -> None:
    run = launch("--reaches", "2", "--seed", "1", script="launch_dmp.py")
    assert run.end(120.0) == 0, run.text
    summary = json.loads((run.out / "summary.json").read_text())
    assert summary["outcome"] == "reached"
    assert summary["planner"] == DEFAULT_POLICY
    assert len(summary["reaches"]) == 3  # there, back, there
    for reach in summary["reaches"]:
        assert reach["goal_error_m"] <= 0.01
        assert reach["min_clearance_m"] > 0.02
        assert reach["max_handover_jump_rad"] < 5e-3
    for message in BagReader(run.out / "bag").messages({"/diagnostics"}):
        for status in message.decode().status:
            figures = {value.key: value.value for value in status.values}
            assert figures.get("compiled_late", "") == "", f"{status.name} waited for a compiler"


@pytest.mark.parametrize("experiment", ["transfer", "preliminary_end_effector"])
def test_a_person_teaches_the_robot(launch: Launch, tmp_path: Path, experiment: str) -> None:
    options = ("--experiment", experiment, "--smoke", "--person", "ann")
    library = tmp_path / "library"
    run = launch(*options, "--library", str(library), "--seed", "2", script="adapt_policy.py")
    assert run.end(200.0) == 0, run.text
    trials = run.trials()
    goals = load_experiment(find_experiment(experiment)).goals
    assert len(trials) == 3 * len(goals)
    assert {row["goal"] for row in trials} == set(goals)
    assert all(float(row["clearance"]) > 0.0 for row in trials)
    assert (run.out / "adaptation.png").stat().st_size > 10_000
    reader = BagReader(run.out / "run_1" / "bag")
    said = TOPICS | ({"/humans/guess"} if experiment.startswith("preliminary") else set())
    assert said <= set(reader.topics)
    # What a few trials taught is not kept beside what people have taught.
    assert PolicyLibrary(library).entries() == ()
    assert set(load_dmp(run.out / "trials" / "policy.npz").goals) == set(goals)
    # What comes after is another run of the same experiment: there is nothing left to do.
    again = CliRunner().invoke(adapt_app, [*options[:3], "--person", "bob", "--out", str(run.out)])
    assert again.exit_code == 1
    assert "ann" in again.output


def test_ctrl_c_stops_the_robot_and_who_sends_it(launch: Launch) -> None:
    """In mid-motion: no trial begins while nodes are being stopped, and the recording shows the rest."""
    run = launch("--smoke", "--person", "ann", "--seed", "2", script="adapt_policy.py")
    run.wait_for("trials: ", 120.0)
    time.sleep(3.0)
    run.process.send_signal(signal.SIGINT)
    assert run.end(60.0) == 130
    assert "goes on" in run.text
    assert "Traceback" not in run.text
    reader = BagReader(run.out / "run_1" / "bag")
    *_, last = (m.decode() for m in reader.messages({"/joint_states"}))
    assert max(abs(speed) for speed in last.velocity) < 0.02
    *_, status = (m.decode() for m in reader.messages({"/policy/status"}))
    assert status.stage not in (PolicyStatus.MOVING, PolicyStatus.STOPPING)


def test_trials_go_on_after_everything_was_killed(launch: Launch) -> None:
    """In mid-motion of a trial: it is made again, and those before it stand as they were."""
    options = ("--experiment", "transfer", "--smoke", "--person", "ann", "--seed", "2")
    first = launch(*options, script="adapt_policy.py")
    first.wait_for("trials: ", 120.0)
    first.wait_for_trials(2)
    time.sleep(4.0)  # back to the start takes some 2 s, and the way to the goal as long
    nodes = first.nodes()
    nodes["adaptation"].kill()
    first.process.kill()
    assert first.end() == -signal.SIGKILL
    _, left = psutil.wait_procs(nodes.values(), 20.0)
    assert not left
    before = first.trials()
    assert 2 <= len(before) < 9

    again = launch(*options, out=first.out, script="adapt_policy.py")
    assert again.end(200.0) == 0, again.text
    after = again.trials()
    assert len(after) == 9
    assert after[: len(before)] == before
    assert BagReader(first.out / "run_2" / "bag").topics["/adaptation/status"]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--experiment", "transfre"], "transfer"),
        (["--mode", "dream"], "live, lockstep, batch"),
        (["--human", "robot"], "simulated, live"),
        (["--population", "robots"], "usual, other"),
        (["--weights", "{task: -1}"], "at least 0"),
        (["--weights", "heavy"], "balanced"),
        (["--policy", "missing.npz"], "missing.npz"),
        (["--weights", "{task: ["], "expected YAML"),
        (["--person", "a/b"], "name of a file"),
        (["--mode", "batch", "--population", "other"], "--population with --mode live or lockstep"),
        (["--mode", "batch", "--seed", "3"], "--seed with --mode live or lockstep"),
        (["--mode", "lockstep", "--human", "live"], "--human with --mode live"),
        (["--mode", "lockstep", "--parameters", "p.yaml"], "--parameters with --mode live"),
        (["--seeds", "3"], "--seeds with --mode batch"),
    ],
)
def test_what_does_not_fit_an_experiment_is_named(
    tmp_path: Path, options: list[str], words: str
) -> None:
    result = CliRunner().invoke(adapt_app, ["--out", str(tmp_path / "run"), *options])
    assert result.exit_code == 1, result.output
    assert words in " ".join(result.output.split())
    assert not (tmp_path / "run").exists()


def test_what_another_run_taught_is_not_replaced_unasked(tmp_path: Path) -> None:
    found = load_experiment(find_experiment("transfer"))
    library = PolicyLibrary(tmp_path / "library")
    kept = library.add(found.initial_policy(load_robot()), "ann", "transfer", {})
    before = kept.read_bytes()
    given = ["--person", "ann", "--library", str(library.folder), "--out", str(tmp_path / "run")]
    result = CliRunner().invoke(adapt_app, ["--mode", "lockstep", *given])
    assert result.exit_code == 1, result.output
    assert "--replace" in result.output
    assert kept.read_bytes() == before
    assert not (tmp_path / "run").exists()


def test_experiment_b_in_a_batch_begins_where_the_experiment_says(tmp_path: Path) -> None:
    """Another's policy from another start is turned and stretched, as it is in the graph."""
    robot = load_robot()
    elsewhere = load_experiment(find_experiment("transfer_other_start")).initial_policy(robot)
    file = tmp_path / "taught.npz"
    save_dmp(file, elsewhere, {})
    out = tmp_path / "run"
    given = ["--mode", "batch", "--smoke", "--seeds", "1", "--workers", "1", "--policy", str(file)]
    result = CliRunner().invoke(adapt_app, [*given, "--out", str(out)])
    assert result.exit_code == 0, result.output
    here = load_experiment(find_experiment("transfer")).initial_policy(robot)
    found = load_dmp(out / "policy_0.npz")
    assert found.start == pytest.approx(here.start)
    assert found.posture == pytest.approx(here.posture)


def test_what_does_not_fit_a_policy_is_named(tmp_path: Path) -> None:
    robot = load_robot()
    found = load_experiment(find_experiment("transfer"))
    policy = found.initial_policy(robot)
    other = tmp_path / "other.npz"
    names = {"left": "a", "middle": "b", "right": "c"}
    save_dmp(
        other,
        DmpPolicy(
            policy.start,
            policy.posture,
            {names[k]: v for k, v in policy.goals.items()},
            {names[k]: v for k, v in policy.weights.items()},
            2.0,
        ),
        {},
    )
    for options, words in (
        (["--policy", str(other)], "goals a, b, c"),
        (["--policy", "rnn_gru_9x9_d1"], "launch_rnn.py runs networks"),
        (["--policy", "rnn_gru_9x9_d1", "--scenario", "s.yaml"], "launch_rnn.py runs networks"),
        (["--experiment", "nothing"], "nothing"),
        (["--human", "robot"], "simulated, replay"),
    ):
        result = CliRunner().invoke(launch_app, ["--out", str(tmp_path / "run"), *options])
        assert result.exit_code == 1, result.output
        assert words in " ".join(result.output.split())
