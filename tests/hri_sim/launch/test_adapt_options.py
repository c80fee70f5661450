"""What the command line of an experiment makes of what it is given."""

from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console
from typer.testing import CliRunner

from hri_planner.dmp.policy import DmpPolicy
from hri_planner.pibb.beginning import first_policy
from hri_planner.pibb.experiment_file import find_experiment, load_experiment
from hri_planner.pibb.library import PolicyLibrary
from hri_planner.pibb.session import Session
from hri_planner.pibb.storage import learnt_in, save_session
from hri_planner.robot.model import load_robot
from hri_prediction.errors import ConfigError, DataError
from hri_sim.launch import adapt
from hri_sim.launch.adapt_checks import check_free
from hri_sim.launch.adaptation import Conducted
from hri_sim.launch.folder import naming
from hri_sim.readability.batch import PEOPLE


def test_weights_that_are_not_given_stay_those_of_the_experiment() -> None:
    shipped = load_experiment(find_experiment("preliminary_joint"))
    changed = adapt._changed(shipped, "{task: 40}", None, None, None)
    assert asdict(changed.weights) == {**asdict(shipped.weights), "task": 40.0}
    assert adapt._changed(shipped, "{}", None, None, None).weights == shipped.weights
    named = adapt._changed(shipped, "balanced", None, None, None).weights
    assert named != shipped.weights


def test_fewer_updates_average_fewer() -> None:
    shipped = load_experiment(find_experiment("transfer"))
    plan = adapt._changed(shipped, None, 2, None, None).improvement
    assert (plan.updates, plan.averaged) == (2, 1)
    assert plan == replace(shipped.improvement, updates=2, averaged=1)


def test_a_batch_does_not_take_the_place_of_another(tmp_path: Path) -> None:
    (tmp_path / PEOPLE).write_text("{}\n")
    experiment = load_experiment(find_experiment("transfer"))
    with pytest.raises(ConfigError, match="holds a batch already"):
        adapt._batch(experiment, None, tmp_path, range(1), 1, 1, Console())
    assert (tmp_path / PEOPLE).read_text() == "{}\n"


@pytest.mark.parametrize(
    ("problem", "said"),
    [
        ("rnn_a has no goals", "--policy rnn_a has no goals"),
        ("/models/rnn_a.npz is damaged", "--policy rnn_a: /models/rnn_a.npz is damaged"),
        ("rnn_ab is another", "--policy rnn_a: rnn_ab is another"),
        ("policy 'rnn_a'", "--policy rnn_a: policy 'rnn_a'"),
    ],
)
def test_an_option_is_named_where_its_value_stands_as_a_word(problem: str, said: str) -> None:
    with pytest.raises(DataError) as caught, naming("--policy", "rnn_a"):
        raise DataError(problem, expected="one that is whole")
    assert caught.value.problem == said


def test_a_policy_of_the_library_is_replaced_only_by_what_it_came_from(tmp_path: Path) -> None:
    shelf, trials = PolicyLibrary(tmp_path / "policies"), tmp_path / "trials"
    experiment = load_experiment(find_experiment("transfer"))
    first = first_policy(experiment, load_robot(), "")
    session = Session.begin(experiment, first, np.random.default_rng(1))
    save_session(trials, session, person="ann", seed=1)
    check_free(shelf, "ann", "transfer", trials)  # there is none yet
    policy, own = session.state.policy, learnt_in(session, person="ann", seed=1)
    shelf.add(policy, "ann", "transfer", own)
    check_free(shelf, "ann", "transfer", trials)
    shelf.add(policy, "ann", "transfer", {**own, "trials": 30, "cost_first": 20.0}, replace=True)
    with pytest.raises(ConfigError, match="another policy of ann for transfer"):
        check_free(shelf, "ann", "transfer", trials)
    with pytest.raises(ConfigError, match="another policy of ann for transfer"):
        check_free(shelf, "ann", "transfer", tmp_path / "new")
    check_free(shelf, "ann", "transfer", None)


def test_a_policy_that_came_meanwhile_is_not_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of another run with a person of the same name, that ended while this one was on."""
    shelf, folder = PolicyLibrary(tmp_path / "policies"), tmp_path / "run"
    experiment = load_experiment(find_experiment("transfer"))
    first = first_policy(experiment, load_robot(), "")

    def run_both(*_: object) -> tuple[Conducted, DmpPolicy]:
        session = Session.begin(experiment, first, np.random.default_rng(1))
        save_session(folder / "trials", session, person="ann", seed=1)
        own = learnt_in(session, person="ann", seed=2)
        shelf.add(first, "ann", "transfer", {**own, "trials": 30, "cost_first": 20.0})
        return Conducted(session, 0.1), first

    monkeypatch.setattr(adapt, "_one", run_both)
    monkeypatch.setattr(adapt, "_conclude", lambda *_: False)
    given = ["--mode", "lockstep", "--person", "ann", "--library", str(shelf.folder)]
    result = CliRunner().invoke(adapt.app, [*given, "--out", str(folder)])
    assert result.exit_code == 1, result.output
    assert "another policy of ann for transfer" in result.output
    assert shelf.entries()[0].trials == 30
