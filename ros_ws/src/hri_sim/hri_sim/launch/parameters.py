"""Parameters of the nodes: the user's are checked before anything starts, and all are written down."""

from __future__ import annotations

import dataclasses
import difflib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from hri_planner.adaptation.model_file import find_model
from hri_planner.nodes.adaptation_config import AdaptationConfig
from hri_planner.nodes.policy_config import PolicyNodeConfig
from hri_planner.nodes.ptomp_config import PtompNodeConfig
from hri_planner.policy.config import PolicyConfig
from hri_planner.ptomp.config import load_default_config
from hri_planner.separation.config import BodyConfig, ProtectiveDistanceConfig, ReleaseConfig
from hri_prediction.config import from_mapping
from hri_prediction.errors import ConfigError, DataError, all_of, cut, shown
from hri_prediction.files.values import read_yaml
from hri_prediction.hybrid.config import HybridConfig
from hri_prediction.nodes.interaction_monitor_node import InteractionMonitorConfig
from hri_prediction.nodes.mocap_live_node import MocapLiveConfig
from hri_prediction.nodes.predictor_node import PredictorNodeConfig
from hri_prediction.ontology.config import WatchConfig
from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.ros.scheduling import SchedulingConfig
from hri_prediction.tracks.segmentation import SegmentationConfig
from hri_sim.launch.precedence import REALTIME, urgency
from hri_sim.launch.supervisor import NodeSpec
from hri_sim.nodes.dyad_node import DyadNodeConfig
from hri_sim.nodes.observer_node import ObserverNodeConfig
from hri_sim.nodes.person_node import PersonNodeConfig
from hri_sim.nodes.recorder_node import RecorderNodeConfig
from hri_sim.nodes.replayer_node import ReplayerConfig
from hri_sim.nodes.simulator_node import SimulatorNodeConfig
from hri_sim.recording.recorder_core import RecorderConfig
from hri_sim.simulator.simulation import SimulatorConfig

CONFIGURATIONS: dict[str, tuple[tuple[str, Any], ...]] = {
    "simulator": (("", SimulatorNodeConfig()), ("", SimulatorConfig())),
    "person": (("", PersonNodeConfig()),),
    "dyad": (("", DyadNodeConfig()),),
    "observer": (("", ObserverNodeConfig()),),
    "replayer": (("", ReplayerConfig()),),
    "mocap_live": (("", MocapLiveConfig()),),
    "predictor": (
        ("", PredictorNodeConfig()),
        ("", PredictorConfig()),
        ("guess.", HybridConfig()),
    ),
    "interaction_monitor": (
        ("", InteractionMonitorConfig()),
        ("watch.", WatchConfig()),
        ("segmentation.", SegmentationConfig()),
    ),
    "adaptation": (("", AdaptationConfig()),),
    "policy": (("", PolicyNodeConfig()), ("policy_planner.", PolicyConfig())),
    "ptomp": (("", PtompNodeConfig()), ("planner.", load_default_config())),
    "separation_monitor": (
        ("", ProtectiveDistanceConfig()),
        ("", BodyConfig()),
        ("", ReleaseConfig()),
    ),
    "recorder": (("", RecorderNodeConfig()), ("", RecorderConfig())),
}
"""What each node declares, by its executable: prefix of the names, and the defaults."""
EVERY_NODE = ("", SchedulingConfig())
"""What all of them declare."""
OPTIONS = {
    ("simulator", "scenario"): "--scenario",
    ("person", "scenario"): "--scenario",
    ("replayer", "file"): "--human-file",
    ("replayer", "trial"): "--trial",
    ("replayer", "place"): "--place",
    ("predictor", "library"): "--library",
    ("predictor", "hybrid"): "--person",
    ("policy", "policy"): "--policy",
    ("recorder", "output"): "--record",
    ("separation_monitor", "human"): "--separation",
    ("observer", "experiment"): "--experiment",
    ("observer", "population"): "--population",
    ("adaptation", "experiment"): "--experiment",
    ("adaptation", "folder"): "--out",
    ("adaptation", "person"): "--person",
    ("adaptation", "policy"): "--policy",
}
"""Parameters that have an option of their own, which checks them and tells the other nodes."""
WALL_CLOCK = {"use_sim_time": False, "publish_clock": False, "realtime_factor": 1.0}
"""Parameters that would put the nodes onto another clock than the one that conducts the run."""


def read_parameters(path: Path | None) -> dict[str, dict[str, Any]]:
    """Parameters by node name from a YAML file ``{node: {parameter: value}}``.

    Raises:
        ConfigError: when it is not of that form.
    """
    if path is None:
        return {}
    form = "the form 'node: {parameter: value}'"
    values = read_yaml(path, "--parameters", expected=f"a YAML file of {form}")
    if not isinstance(values, dict):
        raise ConfigError(f"--parameters {path} has another form", expected=form)
    wrong = [name for name, value in values.items() if not isinstance(value, dict)]
    if wrong:
        raise all_of(
            f"--parameters {path}",
            [
                ConfigError(f"{cut(str(name))}: {shown(values[name])}", expected=form)
                for name in wrong
            ],
        )
    return values


def _fields(executable: str) -> Iterator[tuple[str, str, Any]]:
    """Name of each parameter of a node, name of the field, and the defaults that it is one of."""
    for prefix, defaults in (*CONFIGURATIONS[executable], EVERY_NODE):
        for field in dataclasses.fields(defaults):
            if "doc" in field.metadata:
                yield prefix + field.name, field.name, defaults


def _name_faults(spec: NodeSpec, given: Mapping[str, Any]) -> Iterator[ConfigError]:
    known = [name for name, _, _ in _fields(spec.executable)]
    for name, value in given.items():
        if (spec.executable, name) in OPTIONS:
            yield ConfigError(
                f"{spec.label}: {name} has an option of its own",
                hint=f"give {OPTIONS[spec.executable, name]} instead",
            )
        if name in WALL_CLOCK and (name in known or name == "use_sim_time"):
            if value != WALL_CLOCK[name]:
                yield ConfigError(
                    f"{spec.label}: {name} = {shown(value)}",
                    expected=f"{WALL_CLOCK[name]}: a launched run is conducted by the wall clock",
                    hint="for another clock start the nodes one by one, with scripts/run_node.py",
                )
        elif name not in known and not str(name).startswith("qos_overrides."):
            near = difflib.get_close_matches(cut(str(name)), known, 3)
            yield ConfigError(
                f"node {spec.label} has no parameter {shown(name)}",
                expected="one like " + ", ".join(near) if near else "one of " + ", ".join(known),
            )


def _model_faults(spec: NodeSpec, given: Mapping[str, Any]) -> Iterator[ConfigError]:
    """What is wrong with a model of adaptation, which only the node itself would find out."""
    model = given.get("adaptation_model")
    if spec.executable == "ptomp" and isinstance(model, str) and model:
        try:
            find_model(model)
        except (ConfigError, DataError) as error:
            yield ConfigError(
                f"{spec.label}: {error.problem}", expected=error.expected, hint=error.hint
            )


def _urgency_faults(spec: NodeSpec, given: Mapping[str, Any]) -> Iterator[ConfigError]:
    """Who computes for as long as there is time is not to come before who stops the robot."""
    wanted, least = given.get("realtime_priority", 0), min(REALTIME.values())
    if spec.executable not in REALTIME and isinstance(wanted, int) and wanted >= least:
        yield ConfigError(
            f"{spec.label}: realtime_priority = {wanted}",
            expected=f"less than {least}, that of the separation monitor",
            hint="who is to stop the robot in time comes first",
        )


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value


def _effective(
    spec: NodeSpec, given: Mapping[str, Any], faults: list[ConfigError]
) -> dict[str, Any]:
    """All parameters of a node, as it will have them; what is wrong with them goes into faults."""
    wanted = {**urgency(spec.executable), **spec.parameters, **given}
    found: dict[str, Any] = {}
    for prefix, defaults in (*CONFIGURATIONS[spec.executable], EVERY_NODE):
        fields = {field for _, field, owner in _fields(spec.executable) if owner is defaults}
        own = {field: wanted[prefix + field] for field in fields if prefix + field in wanted}
        values = {field: getattr(defaults, field) for field in fields} | own
        try:
            config = from_mapping(type(defaults), values)
        except ConfigError as error:
            for fault in error.faults:
                problem = fault.problem.removeprefix(f"{type(defaults).__name__}.")
                faults.append(
                    ConfigError(
                        f"{spec.label}: {prefix}{problem}", expected=fault.expected, hint=fault.hint
                    )
                )
            continue
        for name, field, owner in _fields(spec.executable):
            value = getattr(config, field) if owner is defaults else None
            # ROS cannot tell the type of an empty list; where the default is one, it is left out.
            if owner is defaults and not (value == () and getattr(defaults, field) == ()):
                found[name] = _plain(value)
    return {**found, **{name: value for name, value in given.items() if name not in found}}


def complete_parameters(
    specs: Sequence[NodeSpec], overrides: Mapping[str, Mapping[str, Any]], source: str
) -> list[NodeSpec]:
    """Nodes with all their parameters: those that they have, those of the user, and the defaults.

    Args:
        specs: The nodes with what the run gives them.
        overrides: The user's parameters by node name.
        source: Where the user gave these, for errors.

    Raises:
        ConfigError: naming source, node, parameter, value and range of all that is wrong.
    """
    labels = [spec.label for spec in specs]
    faults = [
        ConfigError(f"no node {shown(name)}", expected="one of " + ", ".join(labels))
        for name in overrides
        if name not in labels
    ]
    complete = []
    for spec in specs:
        given = overrides.get(spec.label, {})
        faults += _name_faults(spec, given)
        faults += _model_faults(spec, given)
        faults += _urgency_faults(spec, given)
        complete.append(dataclasses.replace(spec, parameters=_effective(spec, given, faults)))
    if faults:
        raise all_of(source, faults)
    return complete


def interaction_of(parameters: Mapping[str, Mapping[str, Any]]) -> tuple[str, str]:
    """Name and file of the learnt costs by which a planner keeps clear of people; empty: none, the shipped.

    Args:
        parameters: Of the nodes, by name.
    """
    planner = parameters.get("ptomp", {})
    name, path = (planner.get(f"planner.interaction_{word}", "") for word in ("costs", "file"))
    return str(name), str(path)
