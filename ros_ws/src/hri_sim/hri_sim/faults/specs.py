"""What is started for a graph of the table of faults."""

from __future__ import annotations

from pathlib import Path

from hri_sim.launch.parameters import complete_parameters, read_parameters
from hri_sim.launch.run import RunOptions, node_specs
from hri_sim.launch.scene import SCENARIO
from hri_sim.launch.supervisor import NodeSpec
from hri_sim.scenario.schema import Scenario, save_scenario


def launched_specs(
    options: RunOptions, scenario: Scenario, library: Path | None, source: NodeSpec | None = None
) -> list[NodeSpec]:
    """The nodes of a run with all their parameters; the scenario that they read is written.

    Args:
        options: Of the run.
        scenario: The scene.
        library: Task library of the predictor; none: prediction by constant velocity.
        source: Where people come from; none: they are simulated, and reach on cue.
    """
    path = (options.out / SCENARIO).resolve()
    save_scenario(path, scenario)
    made = node_specs(options, scenario, path, library, None, options.out / "bag")
    if source is not None:
        made = [source if spec.executable == "person" else spec for spec in made]
    return complete_parameters(made, read_parameters(None), "")
