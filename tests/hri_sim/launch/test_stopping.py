"""A monitor that takes the robot to stop sooner than it does is refused, wherever it runs."""

from __future__ import annotations

from pathlib import Path

import pytest
from rich.console import Console

from hri_planner.pibb.experiment_file import find_experiment, load_experiment
from hri_prediction.errors import ConfigError
from hri_prediction.results.progress import ProgressLine
from hri_sim.launch.adaptation import AdaptationOptions, run_adaptation
from hri_sim.launch.run import RunOptions, prepare
from hri_sim.launch.separation import MONITOR, check_stopping, permitted_words

SAID = (
    "stopping_time = 0.07 s, but the controller takes 0.3 s to stop"
    ".*at least simulator: ramp_down = 0.3"
)


@pytest.fixture
def parameters(tmp_path: Path) -> Path:
    path = tmp_path / "slow.yaml"
    path.write_text("simulator: {ramp_down: 0.3}\n")
    return path


def test_in_a_launched_run(tmp_path: Path, parameters: Path) -> None:
    run = RunOptions(
        out=tmp_path / "run",
        parameters=parameters,
        separation="measured",
        policy="rnn_gru_9x9_d1",
    )
    run.out.mkdir()
    with pytest.raises(ConfigError, match=SAID):
        prepare(run, run.out / "bag", Console())


@pytest.mark.parametrize(("reaction_time", "refused"), [(0.048, False), (0.047, True)])
def test_a_monitor_reckons_with_its_own_death(reaction_time: float, refused: bool) -> None:
    """4 ms until it has spoken, 12 ms on the way, and as long as the controller goes on."""
    given = {
        "simulator": {"ramp_down": 0.07, "command_timeout": 0.1, "heartbeat_timeout": 0.032},
        MONITOR: {"stopping_time": 0.07, "reaction_time": reaction_time},
    }
    if not refused:
        check_stopping(given, "here")
        return
    with pytest.raises(ConfigError, match=r"goes on for 0\.032 s .* at least 0\.048 s"):
        check_stopping(given, "here")


@pytest.mark.parametrize("human", ["simulated", "live"])
def test_in_an_experiment(tmp_path: Path, parameters: Path, human: str) -> None:
    options = AdaptationOptions(
        tmp_path / "experiment",
        load_experiment(find_experiment("transfer")),
        "ann",
        1,
        human=human,
        parameters=parameters,
        separation="measured",
    )
    console = Console()
    with ProgressLine(console) as line, pytest.raises(ConfigError, match=SAID):
        run_adaptation(options, console, line)


@pytest.mark.parametrize(
    ("monitor", "said"),
    [
        ({}, ""),
        ({"evasion": False, "contact_speed": 0.0}, ""),
        (
            {"evasion": True, "contact_speed": 0.15},
            "may leave people at any speed and go at 0.15 m/s beside",
        ),
        ({"evasion": True}, "the robot may leave people at any speed, and so touch them"),
    ],
)
def test_what_a_monitor_permits_beside_people_is_said(
    monitor: dict[str, object], said: str
) -> None:
    words = permitted_words({MONITOR: monitor} if monitor else {})
    assert said in words
    assert bool(said) is bool(words)
