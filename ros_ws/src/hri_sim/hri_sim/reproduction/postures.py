"""The final posture without and with the person."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hri_planner.robot import load_robot
from hri_sim.benchmark.conditions import Condition
from hri_sim.benchmark.outcome import Execution
from hri_sim.benchmark.planners import PLANNERS
from hri_sim.media.look import BLUE
from hri_sim.reproduction.bars import OURS
from hri_sim.reproduction.closer import Item
from hri_sim.reproduction.drawing import Trace, draw_scene, drawn
from hri_sim.reproduction.speeds import UNSEEN

ELBOW_M = 0.10
"""From which distance of the elbows on two final postures differ."""
LOOKED_AT = 60


@dataclass(frozen=True, eq=False)
class Pair:
    """Motions to the same goal.

    Attributes:
        scene: The condition.
        without: Of a robot that is not told of the person.
        beside: Of one that is.
        elbow: Distance of the elbow in the two final postures [m].
    """

    scene: Condition
    without: Execution
    beside: Execution
    elbow: float

    @property
    def rule(self) -> str:
        """How it was chosen."""
        if self.elbow >= ELBOW_M:
            return (
                "the first condition (of each task in turn) in which the elbow ends "
                f"{100.0 * ELBOW_M:g} cm or more elsewhere: {100.0 * self.elbow:.0f} cm"
            )
        return (
            f"the condition with the largest difference of the elbows: {100.0 * self.elbow:.0f} cm"
        )


def find_pair(scenes: Iterable[Condition], slowdown: float, seed: int) -> Pair:
    """The first of the scenes in which the final postures differ, or that of the largest difference.

    Both motions must arrive to count; `LOOKED_AT` scenes are looked at.
    """
    robot = load_robot()
    best: Pair | None = None
    for scene, _ in zip(scenes, range(LOOKED_AT), strict=False):
        runs = []
        for setup in (UNSEEN, PLANNERS[OURS]):
            item = Item(setup, scene.task.split, scene.task.number, scene.number, slowdown, seed)
            runs.append(item.watch()[0])
        ends = [robot.frames(run.q[-1])[1] for run in runs]
        arrived = all(run.arrived is not None for run in runs)
        elbow = float(np.linalg.norm(ends[1] - ends[0])) if arrived else 0.0
        if best is None or elbow > best.elbow:
            best = Pair(scene, runs[0], runs[1], elbow)
        if best.elbow >= ELBOW_M:
            break
    assert best is not None
    return best


def draw_postures(pair: Pair, path: Path) -> None:
    """Where both motions end, with the person's arm at that time."""
    with drawn(path, 11.0, 4.9) as figure:
        chosen = (
            (pair.without, "(a) planned without the person"),
            (pair.beside, "(b) planned with the person"),
        )
        for axes, (run, title) in zip(figure.subplots(1, 2), chosen, strict=True):
            shown = Trace(OURS, BLUE, run)
            time_s = (len(run.q) - 1 if run.arrived is None else run.arrived) * run.step_s
            draw_scene(axes, pair.scene, shown, time_s, (shown,))
            nearest = 1e3 * float(shown.clearance()[shown.row(time_s) :].min())
            axes.set_title(f"{title}: {nearest:.0f} mm clear at the goal".replace("-", "\u2212"))
