"""The planners that the benchmark knows by name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from hri_planner.ptomp import PtompConfig, load_default_config
from hri_planner.ptomp.plan import JointPlan, connect
from hri_planner.ptomp.variants import variants
from hri_planner.robot import RobotModel
from hri_prediction.config import from_mapping
from hri_prediction.errors import ConfigError
from hri_sim.benchmark.adapted import ADAPTED
from hri_sim.scenario.nominal import nominal_goal
from hri_sim.scenario.schema import Scenario

NOMINAL = "nominal"
ORACLE = "oracle"


@dataclass(frozen=True)
class PlannerSetup:
    """A planner as it takes part.

    Attributes:
        name: What it is called on the command line and in results.
        text: What it is, in words.
        observer: What it is told of the person, one of :data:`.OBSERVERS`; none: nothing, and it
            does not replan.
        settings: Parameters of :class:`PtompConfig` that differ from the default, with values.
        adaptation: Shipped model that chooses time steps and roll-outs at the start; none: they stay.
        max_iterations: Of a replan, whatever the budget pays for; none: as many as that.
    """

    name: str
    text: str
    observer: str | None = "promp"
    settings: tuple[tuple[str, float | int | str], ...] = ()
    adaptation: str | None = None
    max_iterations: int | None = None

    @property
    def config(self) -> PtompConfig:
        """The parameters."""
        return from_mapping(PtompConfig, {**asdict(load_default_config()), **dict(self.settings)})


PLANNERS = {
    **{
        name: PlannerSetup(name, found.text, found.prediction, tuple(found.settings.items()))
        for name, found in variants().items()
    },
    **{name: PlannerSetup(name, text, adaptation=model) for name, text, model in ADAPTED},
    NOMINAL: PlannerSetup(
        NOMINAL, "minimum-jerk motion to the nearest goal posture, whoever is there", None
    ),
}
"""Those that can be asked for."""
DEFAULT_PLANNERS = ("ptomp", NOMINAL)

ORACLE_SETUP = PlannerSetup(ORACLE, "PTOMP that knows the person's motion", "oracle")
"""Says, with a large budget, which conditions can be solved at all; not one of the contestants."""


def find_planners(names: Sequence[str]) -> tuple[PlannerSetup, ...]:
    """Planners by name.

    Raises:
        ConfigError: when one is unknown or named twice, or there is none.
    """
    known = ", ".join(PLANNERS)
    for name in names:
        if name not in PLANNERS:
            raise ConfigError(f"planner {name!r}", expected="one of " + known)
    if not names or len(set(names)) < len(names):
        raise ConfigError(f"planners {','.join(names)!r}", expected=f"each once, of {known}")
    return tuple(PLANNERS[name] for name in names)


def nominal_plan(robot: RobotModel, scenario: Scenario) -> JointPlan:
    """The nominal motion of a scenario's first reach, from time 0 on."""
    reach = scenario.reaches[0]
    start = np.array(scenario.robot_start)
    goal = nominal_goal(robot, start, scenario.targets[reach.robot_target])
    times = np.linspace(0.0, reach.duration, 2)
    rest = (start, np.zeros(7), np.zeros(7))
    # A quintic between states of rest is the minimum-jerk motion.
    return JointPlan(times, *connect(rest, goal, reach.duration, times))
