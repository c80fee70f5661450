"""The launch files, against a stand-in of the launch API.

The real ``launch`` and ``launch_ros`` are not on PyPI, so this cannot show that ``ros2 launch``
runs the files. It shows that they load, declare their arguments, and ask for nodes that exist with
the same parameters as the launch scripts. The stand-in refuses what the real classes refuse, as far
as their sources were read: unknown arguments, parameter types other than str and typing.List[str].
"""

from __future__ import annotations

import importlib.util
import sys
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any, List  # noqa: UP035

import numpy as np
import pytest

from hri_prediction.errors import ConfigError
from hri_prediction.ros.scheduling import HIGHEST
from hri_prediction.ros.this_machine import CHOICES, PROFILE
from hri_prediction.tracks.files import save_tracks
from hri_prediction.tracks.track import ArmTrack
from hri_sim.launch.run import RunOptions, node_specs
from hri_sim.scenario.schema import load_scenario

SOURCES = Path(__file__).resolve().parents[3] / "ros_ws" / "src"
FILES = sorted(SOURCES.glob("*/launch/*.launch.py"))
TABLE = SOURCES / "hri_sim" / "hri_sim" / "scenarios" / "table_reach.yaml"


@dataclass
class LaunchContext:
    launch_configurations: dict[str, str] = field(default_factory=dict)


@dataclass
class LaunchDescription:
    entities: list[Any]


@dataclass
class DeclareLaunchArgument:
    name: str
    default_value: str
    description: str


@dataclass
class LaunchConfiguration:
    name: str

    def perform(self, context: LaunchContext) -> str:
        return context.launch_configurations[self.name]


@dataclass
class OpaqueFunction:
    function: Any


@dataclass
class Shutdown:
    reason: str


@dataclass
class ParameterValue:
    value: Any
    value_type: type


@dataclass
class Node:
    package: str
    executable: str
    name: str
    parameters: list[dict[str, Any]]
    output: str
    additional_env: dict[str, str]
    on_exit: list[Any] | None


def _module(name: str, *members: Any) -> ModuleType:
    module = ModuleType(name)
    for member in members:
        setattr(module, member.__name__, member)
    return module


@pytest.fixture(autouse=True)
def stand_in(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (
        _module("launch", LaunchContext, LaunchDescription),
        _module("launch.actions", DeclareLaunchArgument, OpaqueFunction, Shutdown),
        _module("launch.substitutions", LaunchConfiguration),
        _module("launch_ros"),
        _module("launch_ros.actions", Node),
        _module("launch_ros.parameter_descriptions", ParameterValue),
    ):
        monkeypatch.setitem(sys.modules, module.__name__, module)


def _launch(path: Path, **arguments: str) -> list[Node]:
    """The nodes that a launch file starts."""
    spec = importlib.util.spec_from_file_location("launch_file", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    entities = module.generate_launch_description().entities
    declared = {e.name: e.default_value for e in entities if isinstance(e, DeclareLaunchArgument)}
    assert set(arguments) <= set(declared)
    assert all(e.description for e in entities if isinstance(e, DeclareLaunchArgument))
    (function,) = [e.function for e in entities if isinstance(e, OpaqueFunction)]
    return function(LaunchContext(declared | arguments))


def _plain(node: Node) -> dict[str, Any]:
    """Parameters as the node gets them.

    launch_ros reads bare strings in a dictionary as YAML and refuses empty lists, so neither may
    occur.
    """
    (values,) = node.parameters
    found = {}
    for name, value in values.items():
        if isinstance(value, ParameterValue):
            assert value.value_type is str or value.value_type is List[str]  # noqa: UP006
            value = value.value
        else:
            assert not isinstance(value, str), name
            assert not (isinstance(value, list) and (not value or isinstance(value[0], str))), name
        found[name] = value
    return found


def _path(name: str) -> Path:
    return next(path for path in FILES if path.name == name)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_starts_nodes_that_exist(path: Path) -> None:
    nodes = _launch(path)
    assert nodes
    for node in nodes:
        setup = (SOURCES / node.package / "setup.py").read_text()
        assert f'"{node.executable} = ' in setup


def test_same_nodes_and_parameters_as_the_launch_script(tmp_path: Path) -> None:
    bag, library = tmp_path / "bag", tmp_path / "library.npz"
    nodes = _launch(_path("ptomp.launch.py"), seed="7", record=str(bag), library=str(library))
    options = RunOptions(out=tmp_path, seed=7, library=library)
    specs = node_specs(options, load_scenario(TABLE), TABLE, library, None, bag)
    assert [(n.package, n.executable, n.name) for n in nodes] == [
        (s.package, s.executable, s.label) for s in specs
    ]
    for node, spec in zip(nodes, specs, strict=True):
        got, wanted = _plain(node), dict(spec.parameters)
        # The installed scenario file may be another copy of the same one.
        for values in (got, wanted):
            if "scenario" in values:
                values["scenario"] = load_scenario(values["scenario"])
        assert got == wanted
        assert bool(node.on_exit) == spec.essential


def test_another_planner_is_a_variant() -> None:
    nodes = _launch(_path("ptomp.launch.py"), planner="itomp")
    parameters = _plain(next(n for n in nodes if n.executable == "ptomp"))
    assert parameters["variant"] == "itomp"
    assert parameters["planner.time_scaling"] is False


def test_a_policy_takes_the_place_of_planner_and_predictor() -> None:
    nodes = _launch(_path("ptomp.launch.py"), policy="rnn_gru_9x9_d1")
    assert {node.executable for node in nodes} == {"simulator", "person", "policy"}
    parameters = _plain(next(n for n in nodes if n.executable == "policy"))
    assert parameters["policy"] == "rnn_gru_9x9_d1"


@pytest.mark.parametrize("policy", ["", "rnn_gru_9x9_d1"])
def test_a_separation_monitor_as_of_the_launch_scripts(tmp_path: Path, policy: str) -> None:
    assert "separation_monitor" not in {n.executable for n in _launch(_path("ptomp.launch.py"))}
    nodes = _launch(_path("ptomp.launch.py"), separation="measured", policy=policy)
    found = {node.executable: _plain(node) for node in nodes}
    # Where a monitor supplies the speed scale, it alone does.
    assert found["policy" if policy else "ptomp"]["heartbeat"] is False
    options = RunOptions(out=tmp_path, policy=policy or None, separation="measured")
    specs = node_specs(options, load_scenario(TABLE), TABLE, None, None, tmp_path)
    (wanted,) = (s.parameters for s in specs if s.executable == "separation_monitor")
    assert found["separation_monitor"] == {"realtime_priority": HIGHEST, **wanted}
    assert found["separation_monitor"]["trunk"] is False


def test_beside_real_people_the_monitor_is_as_it_starts(tmp_path: Path) -> None:
    cell = {"simulator": "false", "person": "false", "separation": "measured"}
    nodes = _launch(_path("ptomp.launch.py"), **cell)
    found = {node.executable: _plain(node) for node in nodes}
    assert found.keys() == {"predictor", "ptomp", "separation_monitor"}
    assert found["separation_monitor"] == {"realtime_priority": HIGHEST, "human": "measured"}
    assert found["ptomp"]["heartbeat"] is False


def test_an_unknown_separation_is_refused() -> None:
    with pytest.raises(ConfigError, match="separation measurd; expected one like measured"):
        _launch(_path("ptomp.launch.py"), separation="measurd")


def test_nothing_is_recorded_unless_asked_for() -> None:
    assert "recorder" not in {n.executable for n in _launch(_path("ptomp.launch.py"))}


def test_nodes_are_heard_on_this_machine_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in CHOICES:
        monkeypatch.delenv(name, raising=False)
    for node in _launch(_path("ptomp.launch.py")):
        assert node.additional_env["FASTRTPS_DEFAULT_PROFILES_FILE"] == str(PROFILE)
        assert node.additional_env["ROS_AUTOMATIC_DISCOVERY_RANGE"] == "SYSTEM_DEFAULT"
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET")  # a cell of several machines
    for node in _launch(_path("ptomp.launch.py")):
        assert not {"FASTRTPS_DEFAULT_PROFILES_FILE", *CHOICES[:4]} & node.additional_env.keys()


def test_a_real_cell_brings_its_own_robot_and_tracking() -> None:
    cell = {"simulator": "false", "person": "false"}
    nodes = _launch(_path("ptomp.launch.py"), separation="off", **cell)
    assert {n.executable for n in nodes} == {"predictor", "ptomp"}
    # Without a word on it somebody real is not left without a monitor.
    found = {n.executable: _plain(n) for n in _launch(_path("ptomp.launch.py"), **cell)}
    assert found.keys() == {"predictor", "ptomp", "separation_monitor"}
    assert found["separation_monitor"] == {"realtime_priority": HIGHEST, "human": "assumed"}
    assert found["ptomp"]["heartbeat"] is False


@pytest.mark.parametrize("place", ["", "0.1,0.2,0.3,90"])
def test_replays_a_recording(tmp_path: Path, place: str) -> None:
    arm = np.array([[0.0, 0.0, 0.4], [0.0, 0.1, 0.15], [0.0, 0.3, 0.1], [0.0, 0.38, 0.1]])
    keypoints = np.tile(arm, (50, 1, 1)) + 0.002 * np.arange(50)[:, None, None]
    file = tmp_path / "reaches.npz"
    save_tracks(file, [ArmTrack(np.arange(50) / 100.0, keypoints)])
    nodes = _launch(_path("ptomp.launch.py"), human_file=str(file), place=place)
    replayer = next(n for n in nodes if n.executable == "replayer")
    assert "person" not in {n.executable for n in nodes}
    parameters = _plain(replayer)
    assert parameters["file"] == str(file)
    assert parameters["place"].count(",") == 3
    if place:
        assert parameters["place"] == "0.1,0.2,0.3,90.0"
