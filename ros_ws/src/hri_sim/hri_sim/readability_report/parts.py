"""The parts by themselves: roll-outs, imitation, field, hands in the way, singular postures."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

import numpy as np

from hri_planner.dmp.policy import PERIOD_S
from hri_planner.dmp.response import response
from hri_planner.pibb.exploration import exploration
from hri_planner.robot.model import load_robot
from hri_sim.benchmark.report import markdown_table
from hri_sim.readability_report import demonstrations, head_on, singularities
from hri_sim.readability_report.cases import A
from hri_sim.readability_report.field_gradient import field_gradient
from hri_sim.readability_report.laboratory import Laboratory

BATCH = 24
ROUNDS, SMOKE_ROUNDS = 400, 40


def measure(laboratory: Laboratory) -> dict[str, Any]:
    """All of them."""
    laboratory.progress.say("parts")
    return {
        "rollouts": rollout_times(laboratory.smoke),
        "imitation": demonstrations.imitation(laboratory.smoke),
        "field": field_gradient(laboratory.smoke),
        "head_on": head_on.head_on(laboratory.smoke),
        "singularities": singularities.singularities(laboratory.smoke),
    }


def rollout_times(smoke: bool) -> dict[str, Any]:
    """Time of a batch of roll-outs [ms], each batch of other weights."""
    experiment = A.experiment(smoke)
    policy = experiment.initial_policy(load_robot())
    name, rng = policy.names[0], np.random.default_rng(0)
    mean, fitted = policy.weights[name], response(policy.duration, PERIOD_S)
    times = []
    for _ in range(SMOKE_ROUNDS if smoke else ROUNDS):
        batch = mean + exploration(rng, BATCH, mean.shape[1], experiment.improvement.exploration)
        begin = time.perf_counter()
        fitted.rollouts(policy.start, policy.goals[name], batch)
        times.append(1e3 * (time.perf_counter() - begin))
    return {
        "batch": BATCH,
        "points": len(fitted.times),
        "median_ms": float(np.median(times)),
        "p99_ms": float(np.percentile(times, 99.0)),
    }


def lines(found: Mapping[str, Any]) -> list[str]:
    """Tables."""
    times, field = found["rollouts"], found["field"]
    return [
        f"A batch of {times['batch']} roll-outs, each of {times['points']} points every "
        f"{1e3 * PERIOD_S:.0f} ms: {times['median_ms']:.2f} ms (median; 99 % within "
        f"{times['p99_ms']:.2f} ms).\n",
        "Weights fitted to demonstrations, and how far their motions are from these (root mean square over "
        "the motion):\n",
        markdown_table(
            ["demonstrations", "number", "median [mm]", "largest [mm]"],
            demonstrations.lines(found["imitation"]),
        ),
        f"Potential field: its acceleration beside the slope of its potential by finite differences, in "
        f"{field['count']} places at random: the largest difference is {field['error']:.1e} of the "
        f"acceleration, or of 1 m/s² where it is less; accelerations up to {field['largest_m_s2']:.0f} "
        "m/s². Left out: tools that are nearly head-on, which the field sends aside on purpose.\n",
        "Hands exactly in the way: the tip on the straight way, the forearm across, so that nothing says "
        f"to which side. Robot with separation filter; reached: within {1e3 * head_on.REACHED_M:.0f} mm of "
        f"the goal after {head_on.SECONDS:.0f} s; distances are of the whole arm from the forearm. Beside "
        "it, the same without the field:\n",
        markdown_table(
            ["hand", "field", "ways", "reached", "contacts", "smallest distance [cm]"],
            head_on.lines(found["head_on"]),
        ),
        "Ways through singular postures: the tool's ways in smooth motions of the joints "
        f"({singularities.TRAVEL_RAD} rad in {singularities.SECONDS} s, in a direction at random) through "
        "such a posture. Slow joints can go them exactly; the inverse kinematics is told the tool's way "
        "alone, and damps what is nearly lost:\n",
        markdown_table(
            [
                "singular posture", "ways", "tool error, median [mm]", "largest [mm]", "≤ 1 mm [%]",
                "largest joint speed [rad/s]",
            ],
            singularities.lines(found["singularities"]),
        ),
    ]  # fmt: skip
