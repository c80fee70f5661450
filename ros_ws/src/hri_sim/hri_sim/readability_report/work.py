"""One person's whole experiment, as a piece of work that any process can do.

What this module depends on decides about the results that are kept: it imports no more than it needs.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

from hri_planner.dmp.policy import DmpPolicy
from hri_planner.pibb.experiment import Experiment
from hri_planner.robot.model import load_robot
from hri_sim.readability.learning import Learnt, learn


@dataclass(frozen=True, eq=False)
class Job:
    """What is to be done.

    Attributes:
        case: Name of the experiment in the report.
        seed: Of the person.
        experiment: What is done.
        readings: Trials of each goal by which policies are judged.
        taught: The policy that another person taught elsewhere, to begin with; none: straight ways.
    """

    case: str
    seed: int
    experiment: Experiment
    readings: int
    taught: DmpPolicy | None


@dataclass(frozen=True, eq=False)
class Done:
    """What came of it.

    Attributes:
        case: As of the job.
        seed: As of the job.
        learnt: The result.
        seconds: How long it took [s].
    """

    case: str
    seed: int
    learnt: Learnt
    seconds: float


def do_job(job: Job) -> Done:
    """Let a person take part."""
    robot, begin = load_robot(), time.perf_counter()
    first = None
    if job.taught is not None:
        here = job.experiment.initial_policy(robot)
        # In the frame of each way: what was taught there is a similar way here.
        first = job.taught.moved(here.start, here.posture, here.goals)
    learnt = learn(robot, job.experiment, job.seed, first=first, readings=job.readings)
    return Done(job.case, job.seed, learnt, time.perf_counter() - begin)
