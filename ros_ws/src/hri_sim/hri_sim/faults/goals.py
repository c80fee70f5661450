"""Goals that cannot be reached, and goals by the dozen."""

from __future__ import annotations

from collections import Counter
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_prediction.ros.messages import ReachTarget
from hri_sim.faults.motion import (
    AGAIN,
    POLICY,
    PTOMP,
    REFERENCE,
    SAFE,
    STATE_S,
    Motion,
    arm_beside,
    lockstep,
    scene,
)
from hri_sim.launch.reports import OUTCOMES
from hri_sim.reliability.fault import LOCKSTEP, Fault, Figure, Place, Trial
from hri_sim.testing import ReachHandle, node_factory
from hri_sim.testing.spoiling import Bystander

STORM, STORM_S = 50, 5.0
"""Goals of a storm, and how long it lasts [s]."""
REFUSED = Figure("refused", "refused as out of reach or blocked", limit=1.0, least=True)
ANSWERED = Figure("answer_ms", "answered after", "ms", 1000.0)
REST_OF_REFUSED = Figure("rest_ms", "robot at rest after", "ms", 300.0)


def goal_at(position: NDArray[np.float64], duration: float = 1.5) -> ReachTarget.Goal:
    """A goal by tool position [m]."""
    goal = ReachTarget.Goal(duration=duration)
    goal.pose.header.frame_id = "world"
    point = goal.pose.pose.position
    point.x, point.y, point.z = (float(value) for value in position)
    return goal


def out_of_reach(table: bool, seed: int, place: Place) -> Trial:
    """A goal beyond the robot's reach or in the table; every other time while the robot moves."""
    name = "table" if table else "far"
    with Motion(seed, place, name) as motion:
        if seed % 2:
            motion.under_way()
        else:
            motion.graph.run(0.6)
        x, y, _ = motion.scenario.targets[motion.scenario.reaches[0].robot_target]
        if table:
            height = motion.scenario.table.top + motion.rng.uniform(-0.2, 0.02)
            wanted = np.array((x, y, height))
        else:
            away = motion.rng.normal(size=3)
            wanted = np.array((0.0, 0.0, 0.4)) + motion.rng.uniform(
                1.6, 5.0
            ) * away / np.linalg.norm(away)
        motion.mark()
        handle = motion.graph.reach(goal_at(wanted), f"/{PTOMP}/reach_target")
        outcome = motion.finish(handle, 10.0)
        answer_ms = (motion.graph.now_s - motion.begin_s) * 1e3
        motion.graph.run(0.6)
        said = handle.result.reason if handle.result is not None else ""
        figures: dict[str, float | None] = {
            "refused": float(outcome in ("unreachable", "blocked") and bool(said)),
            "answer_ms": answer_ms,
            "rest_ms": motion.rest_ms(),
            "again": motion.reaches_again(),
        }
        return Trial(seed, {**figures, **motion.safe()}, f"{outcome}: {said}")


def inside_person(seed: int, place: Place) -> Trial:
    """A goal in the forearm of an arm that is held still, where the robot is not at first."""
    arm = arm_beside(seed, scene(seed, place.keep)[0])
    options: dict[str, Any] = {
        "sensors": [node_factory(Bystander, arm)],
        "parameters": {PTOMP: {"max_duration": 2.5}},
    }
    with Motion(seed, place, "person", **options) as motion:
        motion.graph.run(0.6)
        share = motion.rng.uniform(0.0, 1.0)
        wanted = arm[1] + share * (arm[2] - arm[1])
        motion.mark()
        handle = motion.graph.reach(goal_at(wanted), f"/{PTOMP}/reach_target")
        outcome = motion.finish(handle, 10.0)
        motion.graph.run(0.3)
        said = handle.result.reason if handle.result is not None else ""
        figures: dict[str, float | None] = {
            "refused": float(outcome in ("unreachable", "blocked") and bool(said)),
            "clear_cm": motion.clearance_to(arm) * 100.0,
            "again": motion.reaches_again(0),
        }
        return Trial(seed, {**figures, **motion.safe()}, f"{outcome}: {said}")


def storm(mover: str, seed: int, place: Place) -> Trial:
    """Goals every 0.1 s, in turn those of the scene and others near them."""
    with Motion(seed, place, "storm", mover=mover) as motion:
        motion.graph.run(0.6)
        motion.mark()
        places = [
            np.array(motion.scenario.targets[one.robot_target]) for one in motion.scenario.reaches
        ]
        handles: list[ReachHandle] = []
        due_s = motion.graph.now_s
        for index in range(STORM):
            wanted = places[index % 2].copy()
            if index < STORM - 1:
                wanted += motion.rng.uniform(-0.03, 0.05, 3)
            handles.append(motion.graph.reach(goal_at(wanted), f"/{mover}/reach_target"))
            due_s += STORM_S / STORM
            motion.graph.run_until(partial(_reached, motion, due_s), 1.0)
        outcome = motion.finish(handles[-1])
        counts = Counter(
            OUTCOMES.get(h.result.outcome, "failed") for h in handles[:-1] if h.result is not None
        )
        jumps = [m.max_handover_jump for m in motion.since(REFERENCE)]
        figures: dict[str, float | None] = {
            "answered": float(sum(handle.done for handle in handles)),
            "reached": float(outcome == "reached"),
            "handover_rad": float(max(jumps)),
        }
        said = ", ".join(f"{count} {name}" for name, count in sorted(counts.items()))
        return Trial(seed, {**figures, **motion.safe()}, f"{said}; the last {outcome}")


def _reached(motion: Motion, due_s: float) -> bool:
    return motion.graph.now_s >= due_s - STATE_S / 2


def _storm(name: str, mover: str) -> Fault:
    return Fault(
        name,
        f"a storm of goals ({mover})",
        f"{STORM} goals in {STORM_S:g} s, each before the one before is reached",
        "every goal is answered; no step at any hand-over; the last is reached",
        LOCKSTEP,
        (
            Figure("answered", "goals answered", limit=float(STORM), least=True),
            Figure("reached", "the last goal is reached", limit=1.0, least=True),
            Figure("handover_rad", "largest step at a hand-over", "rad", 1e-3, digits=5),
            *SAFE,
        ),
        lockstep(partial(storm, mover)),
    )


GOALS = (
    Fault(
        "unreachable", "a goal out of reach", "a goal 1.6 to 5 m away; every other time in mid-motion",
        "refused with a reason; the robot rests, and reaches the next", LOCKSTEP,
        (REFUSED, ANSWERED, REST_OF_REFUSED, AGAIN, *SAFE), lockstep(partial(out_of_reach, False)),
        count=40,
    ),
    Fault(
        "into_table", "a goal in the table", "a goal from 20 cm below the table's top to less than a hand "
        "above it; every other time in mid-motion",
        "refused with a reason; the robot rests, and reaches the next", LOCKSTEP,
        (REFUSED, ANSWERED, REST_OF_REFUSED, AGAIN, *SAFE), lockstep(partial(out_of_reach, True)),
        count=40,
    ),
    Fault(
        "into_person", "a goal in a person",
        "a goal in the forearm of an arm that is held still, within 20 cm of a place",
        "kept clear of; given up with a reason; the next goal is reached", LOCKSTEP,
        (REFUSED, Figure("clear_cm", "clear of that arm", "cm", 0.0, least=True, digits=1), AGAIN, *SAFE),
        lockstep(inside_person),
    ),
    _storm("goal_storm", PTOMP),
    _storm("goal_storm_policy", POLICY),
)  # fmt: skip
"""Faults of goals."""
