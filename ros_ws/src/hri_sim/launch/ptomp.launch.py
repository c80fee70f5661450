"""The graph with the PTOMP planner or a learned policy, for machines with ``ros2 launch``.

Starts the same nodes with the same parameters as ``scripts/launch_ptomp.py``, but conducts nothing:
the robot waits for a goal and the simulated person for a cue::

    ros2 launch hri_sim ptomp.launch.py seed:=3 record:=run3
    ros2 topic pub --once /sim/cue hri_msgs/msg/Cue "{person_target: person_1, duration: 1.3}"
    ros2 action send_goal --feedback /ptomp/reach_target hri_msgs/action/ReachTarget \
        "{target: robot_1}"

``separation:=measured`` (or ``predicted``, ``assumed``) starts a separation monitor beside them. In a real
cell leave out what the cell has itself: ``simulator:=false person:=false``; a monitor then starts unless
``separation:=off`` says otherwise, reckons with trunks and heads too, and evades nobody. The nodes are
heard on this machine alone, unless discovery is set up otherwise, as by
``ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET``.
"""

import os
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import List  # noqa: UP035

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction, Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from hri_planner.separation.config import ASSUMED
from hri_prediction.ros.this_machine import stay_on_this_machine
from hri_prediction.tracks.files import load_tracks
from hri_prediction.tracks.placement import Placement
from hri_prediction.tracks.seating import suggest_placement
from hri_sim.launch.options import one_of
from hri_sim.launch.precedence import urgency
from hri_sim.launch.run import RunOptions, node_specs
from hri_sim.launch.separation import (
    DEFAULT_SEPARATION,
    MONITOR,
    SEPARATIONS,
    separation_specs,
)
from hri_sim.launch.supervisor import NodeSpec
from hri_sim.scenario.schema import load_scenario

ARGUMENTS = {
    "scenario": ("", "scenario file (YAML); empty: the table scene that ships"),
    "seed": ("0", "seed of the person, the tracking noise and the planner"),
    "planner": ("ptomp", "motion planner: ptomp, itomp, stomp or another variant"),
    "policy": (
        "",
        "policy that moves the robot instead, as rnn_gru_9x9_d1 (then goals go to policy/reach_target)",
    ),
    "separation": (
        "",
        "separation monitor, and how fast it takes people to come nearer: "
        + ", ".join(SEPARATIONS)
        + f"; empty: {DEFAULT_SEPARATION}, with person:=false {ASSUMED}",
    ),
    "library": ("", "task library of train_promp.py; empty: constant-velocity prediction"),
    "record": ("", "bag folder to create; empty: nothing is recorded"),
    "human_file": ("", "recording to replay on cue instead of the simulated person"),
    "trial": ("0", "track of the recording, from 0"),
    "place": ("", "where the recording is put, X,Y,Z,YAW; empty: seated across the table"),
    "simulator": ("true", "false: the robot and its controller come from elsewhere"),
    "person": ("true", "false: the tracked arms come from elsewhere"),
}

# Several processes share a few cores: one thread each for linear algebra on small matrices.
ENVIRONMENT = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}


def typed(value: object) -> object:
    """A parameter value that launch hands on as it is: strings would be read as YAML."""
    if isinstance(value, str):
        return ParameterValue(value, value_type=str)
    if isinstance(value, list) and value and isinstance(value[0], str):
        # launch knows lists by identity with typing's: list[str] would be refused.
        return ParameterValue(value, value_type=List[str])  # noqa: UP006
    return value


def to_action(spec: NodeSpec) -> Node:
    """One node; when an essential one ends, everything ends."""
    parameters = {**urgency(spec.executable), **spec.parameters}
    return Node(
        package=spec.package,
        executable=spec.executable,
        name=spec.label,
        parameters=[{name: typed(value) for name, value in parameters.items()}],
        output="screen",
        additional_env={**ENVIRONMENT, **stay_on_this_machine(os.environ)},
        on_exit=[Shutdown(reason=f"{spec.label} ended")] if spec.essential else None,
    )


def nodes(context: LaunchContext) -> list[Node]:
    """The nodes that the arguments ask for."""
    values = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    shipped = resources.files("hri_sim").joinpath("scenarios/table_reach.yaml")
    path = Path(values["scenario"] or str(shipped)).resolve()
    library = Path(values["library"]).resolve() if values["library"] else None
    real = values["person"].lower() == "false"
    options = RunOptions(
        out=Path(),
        seed=int(values["seed"]),
        planner=values["planner"],
        library=library,
        policy=values["policy"] or None,
        separation=one_of(
            "separation",
            values["separation"] or (ASSUMED if real else DEFAULT_SEPARATION),
            SEPARATIONS,
            hint="or leave it out",
        ),
    )
    placement = None
    if values["human_file"]:
        file, trial = Path(values["human_file"]).resolve(), int(values["trial"])
        options = replace(options, human="replay", human_file=file, trial=trial)
        place = values["place"]
        placement = Placement.parse(place) if place else suggest_placement(load_tracks(file)[trial])
    bag = Path(values["record"]).resolve()
    scenario = load_scenario(path)
    specs = node_specs(options, scenario, path, library, placement, bag)
    left_out = {"recorder"} if not values["record"] else set()
    if values["simulator"].lower() == "false":
        left_out.add("simulator")
    if real:
        left_out |= {"person", "replayer"}
        specs = [spec for spec in specs if spec.executable != MONITOR]
        specs += separation_specs(options.separation, scenario, real=True)
    return [to_action(spec) for spec in specs if spec.executable not in left_out]


def generate_launch_description() -> LaunchDescription:
    """Called by ``ros2 launch``."""
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in ARGUMENTS.items()
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=nodes)])
