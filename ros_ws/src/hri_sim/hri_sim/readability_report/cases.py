"""The experiments of the report, and the one in which those teach who come before experiment B."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass, replace

from hri_planner.pibb.experiment import Experiment
from hri_planner.pibb.experiment_file import find_experiment, load_experiment
from hri_prediction.errors import ConfigError

TEACHER_SEED = 10_000
"""Is added to the seed of who learns by a policy, and gives the seed of who taught it before."""
READINGS, SMOKE_READINGS = 40, 1
"""Trials of each goal by which a policy is judged before and after."""
SMOKE_UPDATES, SMOKE_ROLLOUTS = 2, 3


@dataclass(frozen=True)
class Case:
    """One experiment of the report.

    Attributes:
        name: In files, and of ``--experiments``.
        file: Name of the experiment's file.
        rollouts: Trials of each goal in an update; none: as the file says.
        taught: Whether it begins with what another person taught.
        text: What it is.
    """

    name: str
    file: str
    rollouts: int | None
    taught: bool
    text: str

    def experiment(self, smoke: bool) -> Experiment:
        """What is done; as little as there can be in a smoke run."""
        return _experiment(self, smoke)


@functools.cache
def _experiment(case: Case, smoke: bool) -> Experiment:
    found = load_experiment(find_experiment(case.file))
    plan = found.improvement
    if case.rollouts is not None:
        plan = replace(plan, rollouts=case.rollouts)
    if smoke:
        least = min(plan.rollouts, SMOKE_ROLLOUTS)
        plan = replace(plan.lasting(SMOKE_UPDATES), rollouts=least, habituation=1)
    return found.with_(improvement=plan)


END_EFFECTOR = Case(
    "preliminary_end_effector", "preliminary_end_effector", None, False,
    "four goals and a static obstacle; the tool is controlled, the field acts on the movement primitive",
)  # fmt: skip
JOINT = Case(
    "preliminary_joint", "preliminary_joint", None, False,
    "the same, joints controlled by inverse kinematics, without field and without null space",
)  # fmt: skip
A = Case("transfer_a", "transfer", None, False, "A: from straight ways")
A_3 = Case("transfer_a_3", "transfer", 3, False, "A with the mean and two samples")
B = Case(
    "transfer_b", "transfer", None, True, "B: from what another person taught at another start"
)
B_3 = Case("transfer_b_3", "transfer", 3, True, "B with the mean and two samples")
CASES = (END_EFFECTOR, JOINT, A, A_3, B, B_3)
TEACHER = Case(
    "transfer_other_start", "transfer_other_start", None, False, "those who taught before experiment B"
)  # fmt: skip
PAIRS = ((A, B), (A_3, B_3))
"""What is compared: without and with a policy that was taught before."""


def case_of(name: str) -> Case:
    """By its name.

    Raises:
        KeyError: when there is none.
    """
    return {one.name: one for one in (*CASES, TEACHER)}[name]


def chosen_cases(names: str) -> Sequence[Case]:
    """Those of a list of names, apart by commas or blanks; all when it is empty.

    Raises:
        ConfigError: when one is not known.
    """
    wanted = names.replace(",", " ").split()
    known = [one.name for one in CASES]
    unknown = [name for name in wanted if name not in known]
    if unknown:
        raise ConfigError(
            f"--experiments {', '.join(unknown)}", expected="some of " + ", ".join(known)
        )
    return [one for one in CASES if not wanted or one.name in wanted]
