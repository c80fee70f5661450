"""The graph of a robot that reaches past a person who reaches."""

from __future__ import annotations

from pathlib import Path

from hri_sim.faults.live import LiveGraph
from hri_sim.faults.specs import launched_specs
from hri_sim.launch.run import RunOptions
from hri_sim.launch.separation import OFF
from hri_sim.scenario.conditions import draw_scenario


def reaching_graph(
    folder: Path, seed: int, library: Path, *, policy: str | None = None, separation: str = OFF
) -> LiveGraph:
    """The graph in which a robot reaches past a person who reaches.

    Args:
        folder: For logs, parameters and bag; it is there.
        seed: Seed of the scenario.
        library: Task library of the predictor.
        policy: Policy that moves the robot; none: a planner.
        separation: What a separation monitor reckons with.
    """
    scenario = draw_scenario(seed, 2)
    options = RunOptions(
        out=folder, seed=seed, drawn=scenario, policy=policy, separation=separation
    )
    return LiveGraph(folder, scenario, options.mover, launched_specs(options, scenario, library))
