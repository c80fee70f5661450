"""Parameters of all nodes: described, checked; and the wrong message package is named."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from hri_planner.nodes.ptomp_node import PtompNode
from hri_prediction.errors import ConfigError, DataError, HriError
from hri_prediction.nodes.predictor_node import PredictorNode
from hri_sim.nodes.person_node import PersonNode
from hri_sim.nodes.recorder_node import RecorderNode
from hri_sim.nodes.replayer_node import ReplayerNode
from hri_sim.nodes.simulator_node import SimulatorNode
from hri_sim.scenario.schema import Scenario
from hri_sim.testing import Graph, node_factory, ptomp_graph

# rclpy's own: without description there.
ROS_OWN = ("use_sim_time", "start_type_description_service", "qos_overrides")


def test_every_parameter_is_described(graph: Graph) -> None:
    for node in graph.nodes.values():
        names = [name for name in node._parameters if not name.startswith(ROS_OWN)]
        assert names
        for name in names:
            description = node.describe_parameter(name).description
            assert len(description) > 10, f"{node.get_name()}: {name}"


@pytest.mark.parametrize(
    ("node", "name", "value"),
    [
        (SimulatorNode, "realtime_factor", 0.0),
        (SimulatorNode, "command_timeout", -1.0),
        (SimulatorNode, "seed", -1),
        (SimulatorNode, "seed", "many"),
        (PersonNode, "seed", -1),
        (PredictorNode, "period", 1.0),
        (PredictorNode, "max_bodies", 0),
        (PredictorNode, "horizon", 100.0),
        (PredictorNode, "output", "everything"),
        (PtompNode, "replan_interval", 0.001),
        (PtompNode, "planner.margin", -1.0),
        (PtompNode, "target_positions", [1.0, 2.0]),
        (PtompNode, "table_center", [1.0, 2.0]),
    ],
)
def test_values_out_of_range_are_one_clear_line(node: Any, name: str, value: Any) -> None:
    with pytest.raises(ConfigError) as caught:
        Graph([node_factory(node, parameters={name: value})])
    text = str(caught.value)
    assert name.split(".")[-1] in text
    assert "\n" not in text


@pytest.mark.parametrize(
    ("node", "name", "value"),
    [
        (SimulatorNode, "scenario", "/nowhere/scenario.yaml"),
        (PersonNode, "scenario", "/nowhere/scenario.yaml"),
        (PredictorNode, "library", "/nowhere/library.npz"),
        (PtompNode, "adaptation_model", "/nowhere/model.npz"),
        (PtompNode, "adaptation_model", "no_such_model"),
        (ReplayerNode, "file", "/nowhere/recording.npz"),
        (ReplayerNode, "file", ""),
        (RecorderNode, "output", "/proc/nowhere/bag"),
    ],
)
def test_files_that_are_not_there(node: Any, name: str, value: str) -> None:
    with pytest.raises(HriError) as caught:
        Graph([node_factory(node, parameters={name: value})])
    text = str(caught.value)
    assert value in text
    assert "\n" not in text


def test_a_library_that_is_none(tmp_path: Path) -> None:
    path = tmp_path / "library.npz"
    path.write_bytes(b"PK\x03\x04 not a library")
    with pytest.raises(DataError, match=r"library\.npz"):
        Graph([node_factory(PredictorNode, parameters={"library": str(path)})])


def test_parameters_for_a_node_that_is_not_there(scenario: Scenario, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"'predictr'.*predictor"):
        ptomp_graph(scenario, tmp_path, parameters={"predictr": {"period": 0.02}})


def _fake_package(folder: Path, messages: str) -> None:
    for name in ("msg", "action", "srv"):
        (folder / "hri_msgs" / name).mkdir(parents=True)
        (folder / "hri_msgs" / name / "__init__.py").write_text("")
    (folder / "hri_msgs" / "__init__.py").write_text("")
    (folder / "hri_msgs" / "msg" / "__init__.py").write_text(messages)


def _import_messages(front: Path) -> subprocess.CompletedProcess[str]:
    path = os.pathsep.join([str(front), *filter(None, sys.path)])
    return subprocess.run(
        [
            sys.executable,
            "-c",
            "from hri_prediction.errors import GraphError\n"
            "try:\n    import hri_prediction.ros.messages\n"
            "except GraphError as error:\n    print(error)",
        ],
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )


def test_the_wrong_message_package_is_named(tmp_path: Path) -> None:
    """ROS4HRI's package has the same name and IdsList, but none of the other types."""
    _fake_package(tmp_path, "class IdsList: pass\nclass Skeleton2D: pass\n")
    done = _import_messages(tmp_path)
    assert "is not this project's" in done.stdout, done.stderr
    assert str(tmp_path) in done.stdout
    assert "ROS4HRI" in done.stdout
    assert done.stdout.count("\n") == 1


def test_the_right_message_package_is_taken(tmp_path: Path) -> None:
    assert _import_messages(tmp_path).stdout == ""


def test_the_factory_type(make_graph: Callable[..., Graph]) -> None:
    """Parameters and remappings by node, as a launched run has them."""
    graph = make_graph(parameters={"ptomp": {"replan_interval": 0.048}})
    assert graph.nodes["ptomp"].get_parameter("replan_interval").value == 0.048
    assert graph.nodes["simulator"].get_parameter("command_timeout").value == 0.1
