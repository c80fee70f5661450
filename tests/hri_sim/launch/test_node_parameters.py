"""The parameters that a run writes down: all of each node, with paths that hold."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest
import yaml

from hri_planner.ptomp.variants import find_variant
from hri_prediction.errors import ConfigError, GraphError
from hri_sim.launch.folder import NewFolder, RunFolders, naming
from hri_sim.launch.parameters import CONFIGURATIONS, complete_parameters, read_parameters
from hri_sim.launch.run import RunOptions, node_specs
from hri_sim.launch.scene import run_library
from hri_sim.launch.separation import separation_specs
from hri_sim.launch.supervisor import NodeSpec
from hri_sim.scenario.shipped import load_shipped


def _complete(tmp_path: Path, overrides: dict | None = None) -> dict[str, NodeSpec]:
    scene, library = tmp_path / "scenario.yaml", tmp_path / "library.npz"
    specs = node_specs(
        RunOptions(out=tmp_path, seed=3), load_shipped("table_reach"), scene, library, None, scene
    )
    return {s.label: s for s in complete_parameters(specs, overrides or {}, "--parameters x")}


def test_every_parameter_is_written(tmp_path: Path) -> None:
    for label, spec in _complete(tmp_path).items():
        for prefix, defaults in CONFIGURATIONS[spec.executable]:
            for field in dataclasses.fields(defaults):
                if getattr(defaults, field.name) != ():
                    assert prefix + field.name in spec.parameters, label
        assert "realtime_priority" in spec.parameters
        text = yaml.safe_dump(dict(spec.parameters))
        assert yaml.safe_load(text) == spec.parameters
        assert "[]" not in text  # ROS cannot tell the type of an empty list


def test_the_users_values_win_and_get_the_declared_type(tmp_path: Path) -> None:
    nodes = _complete(tmp_path, {"ptomp": {"max_duration": 30, "planner.margin": 0.1}})
    assert nodes["ptomp"].parameters["max_duration"] == 30.0
    assert isinstance(nodes["ptomp"].parameters["max_duration"], float)
    assert nodes["ptomp"].parameters["planner.margin"] == 0.1
    assert nodes["ptomp"].parameters["seed"] == 3


def test_the_monitor_comes_first_unless_the_user_says_otherwise(tmp_path: Path) -> None:
    (monitor,) = separation_specs("measured", load_shipped("table_reach"))
    for given, wanted in (({}, 12), ({"separation_monitor": {"realtime_priority": 0}}, 0)):
        (found,) = complete_parameters([monitor], given, "--parameters x")
        assert found.parameters["realtime_priority"] == wanted
    assert {s.parameters["realtime_priority"] for s in _complete(tmp_path).values()} == {0}


def test_who_plans_does_not_come_before_who_stops_the_robot(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"ptomp: realtime_priority = 12; expected less than 12"):
        _complete(tmp_path, {"ptomp": {"realtime_priority": 12}})
    assert _complete(tmp_path, {"ptomp": {"realtime_priority": 11}})


def test_all_that_is_wrong_is_named_at_once(tmp_path: Path) -> None:
    with pytest.raises(ConfigError) as caught:
        _complete(
            tmp_path,
            {
                "predictr": {"period": 0.02},
                "ptomp": {"replan_intervall": 0.05, "planner.margin": -1.0, "max_duration": "long"},
                "predictor": {"period": 9.0, "library": "x.npz"},
            },
        )
    head, *lines = str(caught.value).split("\n")
    assert head == "--parameters x: 6 faults"
    text = "\n".join(sorted(lines))
    for words in (
        "no node 'predictr'; expected one of simulator, ",
        "node ptomp has no parameter 'replan_intervall'; expected one like replan_interval",
        "ptomp: planner.margin = -1.0; expected at least",
        "ptomp: max_duration = 'long'; expected a value of type float",
        "predictor: period = 9.0; expected at most 0.04 s",
        "predictor: library has an option of its own; give --library instead",
    ):
        assert words in text


@pytest.mark.parametrize("model", ["sucess_f8", "{}/cut.npz"])
def test_a_model_that_cannot_be_used_is_refused_before_anything_starts(
    tmp_path: Path, model: str
) -> None:
    (tmp_path / "cut.npz").write_bytes(b"PK\x03\x04 the rest is missing")
    with pytest.raises(ConfigError, match=r"ptomp: .*(sucess_f8'; expected one of|cut\.npz)"):
        _complete(tmp_path, {"ptomp": {"adaptation_model": model.format(tmp_path)}})
    nodes = _complete(tmp_path, {"ptomp": {"adaptation_model": "success_f8"}})
    assert nodes["ptomp"].parameters["adaptation_model"] == "success_f8"


def test_nodes_that_have_no_mapping_are_named(tmp_path: Path) -> None:
    path = tmp_path / "parameters.yaml"
    path.write_text("ptomp: 3\npredictor: {period: 0.02}\nperson: [1]\n")
    with pytest.raises(ConfigError, match=r"2 faults\n  ptomp: 3; expected.*\n  person: \[1\]"):
        read_parameters(path)


def test_the_wall_clock_may_be_named(tmp_path: Path) -> None:
    nodes = _complete(tmp_path, {"simulator": {"use_sim_time": False, "realtime_factor": 1.0}})
    assert nodes["simulator"].parameters["use_sim_time"] is False


def test_folders_are_left_as_they_were_unless_kept(tmp_path: Path) -> None:
    out, bag = tmp_path / "a" / "b", tmp_path / "c" / "bag"
    with RunFolders(out, bag, ("scenario.yaml",)) as folders:
        (out / "scenario.yaml").write_text("")
        assert folders.bag == bag
    assert list(tmp_path.iterdir()) == []
    bag.mkdir(parents=True)
    with RunFolders(out, bag, ()):
        assert not bag.exists()
    assert bag.is_dir()
    with RunFolders(out, None, ("scenario.yaml",)) as folders:
        (out / "scenario.yaml").write_text("")
        folders.keep()
    assert (out / "scenario.yaml").exists()


def test_a_try_that_did_not_begin_does_not_bar_the_next(tmp_path: Path) -> None:
    """Whatever nodes have left that ran into an error before the run began, or were stopped."""
    out, bag = tmp_path / "run", tmp_path / "bag"

    def attempt(error: BaseException) -> None:
        with RunFolders(out, bag, ("scenario.yaml",)):
            for path in (out / "log", out / "parameters", bag):
                path.mkdir()
                (path / "something").write_text("")
            (out / "scenario.yaml").write_text("")
            raise error

    with pytest.raises(GraphError):
        attempt(GraphError("not ready"))
    assert not bag.exists()
    assert [path.name for path in out.iterdir()] == ["log"]  # the message points to them
    assert (out / "log" / "something").exists()
    with pytest.raises(KeyboardInterrupt):
        attempt(KeyboardInterrupt())
    assert not bag.exists()
    assert list(out.iterdir()) == []
    (out / "log").mkdir()
    (out / "log" / "something").write_text("mine")
    with pytest.raises(ConfigError, match="is not empty"):
        RunFolders(out, bag, ())


def test_an_error_names_the_option(tmp_path: Path) -> None:
    (tmp_path / "notes").write_text("")
    with pytest.raises(ConfigError, match=r"--runs .* is not empty.*choose another with --runs"):
        NewFolder(tmp_path, "--runs")
    for problem in ("cannot read a.yaml", "nothing in it"):
        with pytest.raises(ConfigError, match=r"--scenario a.yaml"), naming("--scenario", "a.yaml"):
            raise ConfigError(problem)


def test_a_peer_is_a_variant_of_the_node(tmp_path: Path) -> None:
    scene = tmp_path / "scenario.yaml"
    options = RunOptions(out=tmp_path, planner="itomp")
    specs = node_specs(options, load_shipped("table_reach"), scene, None, None, scene)
    nodes = {s.label: s for s in complete_parameters(specs, {}, "--parameters x")}
    wanted = find_variant("itomp")
    assert nodes["ptomp"].parameters["variant"] == "itomp"
    for name, value in dataclasses.asdict(wanted.config).items():
        assert nodes["ptomp"].parameters[f"planner.{name}"] == value
    assert nodes["predictor"].parameters["library"] == ""


def test_a_peer_that_is_told_of_constant_velocity_takes_no_library(tmp_path: Path) -> None:
    scene = load_shipped("table_reach")
    options = RunOptions(out=tmp_path, planner="itomp")
    assert run_library(options, scene, None, print) is None
    with pytest.raises(ConfigError, match="constant velocity"):
        run_library(
            dataclasses.replace(options, library=tmp_path / "library.npz"), scene, None, print
        )
