"""What a run tells the predictor so that it learns the person who reaches.

What that needs takes half a second to load, and most runs learn nobody: it is imported where it is used.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from hri_planner.ptomp.variants import find_variant
from hri_prediction.errors import ConfigError
from hri_sim.scenario.schema import Scenario

if TYPE_CHECKING:
    from hri_sim.launch.run import RunOptions


def have_compiled(say: Callable[[str], None]) -> None:
    """Compile what learns people, the first time: a node that had to would be waited for in vain.

    Args:
        say: Told that it takes a while.
    """
    from hri_prediction.hybrid.body import CONVENTION
    from hri_prediction.hybrid.loop import warm_loop
    from hri_prediction.motor_control.compiled_graph import is_prepared

    if not is_prepared(CONVENTION):
        say("compiling what learns people, once")
        warm_loop()


def learning(options: RunOptions, scenario: Scenario) -> dict[str, Any]:
    """Parameters of the predictor; none where nobody is to be learnt.

    Raises:
        ConfigError: naming what does not fit.
    """
    if options.person is None:
        return {}
    from hri_prediction.hybrid.people_command import DEFAULT_FOLDER
    from hri_prediction.hybrid.store import check_person

    check_person(options.person)
    if find_variant(options.planner).prediction != "promp":
        raise ConfigError(
            f"--person with --planner {options.planner}",
            expected="a planner that is told predictions: this one is told of constant velocity",
        )
    names = sorted({reach.person_target for reach in scenario.reaches if reach.person_target})
    if not names:
        raise ConfigError(
            f"--person {options.person}, but nobody reaches for a target in scenario {scenario.name}",
            expected="a scenario whose reaches have a person_target",
            hint="recordings say nothing of targets: give a --scenario that does, or leave --person out",
        )
    bodies = {scenario.person_of(i).id for i, r in enumerate(scenario.reaches) if r.person_target}
    if len(bodies) > 1:
        raise ConfigError(
            f"--person {options.person}, but {' and '.join(sorted(bodies))} reach in this scenario",
            expected="one person",
            hint="give the predictor's parameter people by --parameters for more",
        )
    (body,) = bodies
    return {
        "hybrid": True,
        "target_names": names,
        "target_positions": [float(v) for name in names for v in scenario.targets[name]],
        "people_folder": str(DEFAULT_FOLDER.resolve()),
        "people": [f"{body}={options.person}"],
    }
