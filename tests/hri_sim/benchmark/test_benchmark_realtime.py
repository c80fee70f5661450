"""Figures in real time: complete, of what they say, apart from the reproducible ones."""

import json
import time

import numpy as np
import pytest

from hri_planner.nodes.motion_config import TRANSPORT_NS
from hri_planner.nodes.ptomp_config import PtompNodeConfig
from hri_planner.nodes.ptomp_node import TICK_S
from hri_planner.ptomp import PtompPlanner
from hri_prediction.errors import ConfigError
from hri_sim.benchmark import command, realtime
from hri_sim.benchmark.conditions import task_conditions
from hri_sim.benchmark.learning import task_library
from hri_sim.benchmark.planners import PLANNERS
from hri_sim.benchmark.realtime import Times, measure_condition
from hri_sim.benchmark.realtime_report import REALTIME_TASKS, figures, percentiles

PARTS = {"prediction", "gathering", "posture", "start", "iteration"}


@pytest.fixture(scope="module")
def condition():
    return task_conditions("tuning", 0).conditions[0]


@pytest.fixture(scope="module")
def library():
    return task_library("tuning", 0)


def test_deadlines_are_those_of_the_node():
    assert PtompNodeConfig().compute_share == realtime.COMPUTE_SHARE
    assert pytest.approx(TICK_S + 1e-9 * TRANSPORT_NS) == realtime.READY_S


def test_replans_are_given_the_deadline_and_dropped_when_late(condition, library, monkeypatch):
    """Replans that take 30 ms are late at an interval of 35.7 ms; the robot stays on its first motion."""
    seen = []
    plain = PtompPlanner.replan

    def slow(self, handover_s, forecasts, *, iterations=None, deadline=None):
        if deadline is not None:
            assert not deadline()
            time.sleep(0.03)
            assert deadline()
            seen.append(handover_s)
        return plain(self, handover_s, forecasts, iterations=0)

    monkeypatch.setattr(PtompPlanner, "replan", slow)
    times = Times()
    measure_condition(condition, PLANNERS["ptomp_staying"], library, times, seed=0)
    assert times.missed == len(times.replan) == len(seen) > 40
    assert min(times.replan) >= 0.03
    assert times.ok == [False]  # the first motion knows of nobody
    assert figures(times)["missed_share"] == 1.0


def test_each_iteration_is_timed(condition, library):
    times = Times()
    measure_condition(condition, PLANNERS["ptomp_staying"], library, times, seed=0)
    assert len(times.iteration) == len(times.iteration_charge) > 50
    assert min(times.iteration) > 1e-6
    assert times.iterations > len(times.replan)
    assert np.median(times.iteration) < np.median(times.replan)
    assert times.ok == [True]
    assert len(times.prediction) == len(times.replan) == len(times.gather)
    assert 0 < len(times.gather_met) < len(times.gather)
    assert len(times.start) == 3  # the planner's and of those that tell the prices


def test_percentiles_are_in_milliseconds():
    assert percentiles([], (50,)) is None
    assert percentiles([0.001, 0.003], (50, 100)) == pytest.approx({"p50": 2.0, "p100": 3.0})


def test_command_writes_figures_of_their_own(tmp_path, monkeypatch, capsys):
    options = ("--smoke", "--split", "tuning", "--planners", "nominal,ptomp")
    monkeypatch.setattr("sys.argv", ["script", "--out", str(tmp_path), "--real-time", *options])
    with pytest.raises(SystemExit):
        command.main()
    assert {path.name for path in tmp_path.iterdir()} == {"realtime.json", "realtime.md"}
    results = json.loads((tmp_path / "realtime.json").read_text())
    assert set(results["planners"]) == {"ptomp"}  # the nominal motion is not replanned
    found = results["planners"]["ptomp"]
    assert found["interval_ms"] == pytest.approx(1500.0 / 42)
    assert found["replan_ms"]["p50"] <= found["replan_ms"]["p99"] <= found["replan_ms"]["p100"]
    assert set(found["iteration_ms"]) == {"p50", "p99"}
    assert set(found["prices_ms"]) >= PARTS
    assert found["prices_ms"]["prediction"]["charged"] == 0.5
    assert 0.0 <= found["missed_share"] <= 1.0
    text = (tmp_path / "realtime.md").read_text()
    assert "| `ptomp` | 35.7 |" in text
    assert "missed" in capsys.readouterr().out
    assert any(task_conditions("test", task).task.ambiguous for task in REALTIME_TASKS)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--planners", "nominal"), "a planner that replans"),
        (("--budget", "8"), "one process"),
        (("--workers", "2"), "one process"),
        (("--scheduler", "tcp://127.0.0.1:1"), "one process"),
    ],
)
def test_senseless_options_are_refused(tmp_path, monkeypatch, arguments, message):
    options = ["script", "--out", str(tmp_path), "--smoke", "--real-time", *arguments]
    monkeypatch.setattr("sys.argv", options)
    with pytest.raises(ConfigError, match=message):
        command.app(standalone_mode=False)
