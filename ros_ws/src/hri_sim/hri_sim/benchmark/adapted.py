"""Planners whose time steps and roll-outs are chosen when the motion starts."""

from __future__ import annotations

from hri_planner.adaptation.best_fixed import BestFixed
from hri_planner.adaptation.grid import with_cell
from hri_planner.adaptation.model_file import shipped_model
from hri_planner.ptomp import PtompConfig
from hri_planner.ptomp.budget import ADAPTATION_S
from hri_prediction.prediction import TaskLibrary
from hri_sim.benchmark.conditions import Condition
from hri_sim.benchmark.first_look import start_situation
from hri_sim.benchmark.variation import AS_DRAWN, Variation

TRAINED_AT = 8
"""F that the models that these planners use were trained at."""

ADAPTED = (
    (
        "ptomp_gpr",
        "the same, time steps and roll-outs chosen at the start by Gaussian processes (thesis)",
        f"gpr_f{TRAINED_AT}",
    ),
    (
        "ptomp_gpr_lower",
        "the same, both lowered by one standard deviation of the processes' errors (thesis)",
        f"gpr_lower_f{TRAINED_AT}",
    ),
    (
        "ptomp_adapted",
        "the same, both chosen at the start by a lower bound of the chance of success",
        f"success_f{TRAINED_AT}",
    ),
    (
        "ptomp_fixed",
        "the same, both always those that were best in all the tuning tasks learnt from",
        f"fixed_f{TRAINED_AT}",
    ),
)
"""Name, text, and the model that ships with the planner."""


def adapted_config(
    config: PtompConfig,
    model: str,
    condition: Condition,
    observer: str,
    library: TaskLibrary,
    seed: int,
    variation: Variation = AS_DRAWN,
) -> tuple[PtompConfig, float]:
    """A planner's parameters with what a shipped model chooses at the start of a motion.

    Returns:
        The parameters, and what choosing is charged [s]; nothing where there is nothing to choose.

    Raises:
        ConfigError: when there is no such model.
        PlanningError: when the planner refuses the goal.
    """
    selection = shipped_model(model)
    if isinstance(selection, BestFixed):
        chosen, charge_s = selection.cell, 0.0
    else:
        seen = start_situation(condition, observer, config, library, seed, variation)
        chosen, charge_s = selection.choose(seen), ADAPTATION_S
    return with_cell(config, chosen), charge_s
