"""What learnt costs change of the robot's motion: the same reaches, with them and without."""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray

from hri_planner.ptomp.config import load_default_config
from hri_planner.ptomp.interaction import find_nearness
from hri_planner.robot import load_robot
from hri_prediction.ontology.features import pair_features
from hri_prediction.ontology.shipped import SHIPPED_COSTS
from hri_prediction.results.kept import kept
from hri_sim.benchmark.conditions import CONDITIONS_A_TASK, task_conditions
from hri_sim.benchmark.episode import watch_episode
from hri_sim.benchmark.learning import task_library
from hri_sim.benchmark.outcome import Execution
from hri_sim.benchmark.planners import PlannerSetup
from hri_sim.benchmark.workers import do_all

FloatArray = NDArray[np.float64]

WORK = __name__
"""What comes of a reach hangs on what this module depends on."""
PACKAGES = ("numpy", "scipy", "numba", "mujoco")
SPLIT = "test"
NONE = ""
AGAIN = "another seed"
"""Once more without costs, with another seed of what is tracked and of the planner: how far ways differ
anyway."""
POINTS = 50
"""Places of a way that are compared with those of another."""
WEIGHTS = (3.0, 10.0)
"""Of the learnt costs; the first is what the planner starts with."""


@dataclass(frozen=True)
class Way:
    """A motion of the robot past a person.

    Attributes:
        condition: Number of the reach.
        case: Whose costs the planner had; empty, or :data:`AGAIN`: none.
        weight: Of these costs.
        tool: Where the tool was, evenly spaced along its way (POINTS, 3) [m].
        costs: What the motion costs in each case that is compared, without the weight.
        clearance: Smallest distance of robot and person [m].
        seconds: Until the goal; none when it was not reached.
        ok: Goal reached without contact.
    """

    condition: int
    case: str
    weight: float
    tool: FloatArray
    costs: dict[str, float]
    clearance: float
    seconds: float | None
    ok: bool


def robot_keypoints(q: FloatArray) -> FloatArray:
    """The robot as an arm: shoulder, elbow, wrist and tool in postures (n, 7) → (n, 4, 3) [m]."""
    robot = load_robot()
    points = robot.frames(q)[:, :4].copy()
    points[:, 0] = (0.0, 0.0, robot.lengths[0])
    return points


def learnt_cost(run: Execution, case: str) -> float:
    """Integral of a case's nearness costs until the arrival [s], whose weights' sum is 1."""
    found = find_nearness(case)
    end = len(run.q) if run.arrived is None else run.arrived + 1
    distances = pair_features(robot_keypoints(run.q[:end]), run.arm[:end])
    return float(run.step_s * np.exp(-distances / found.length).sum(axis=0) @ found.weights)


def _spaced(points: FloatArray) -> FloatArray:
    """Evenly spaced places along a way (n, 3) → (POINTS, 3)."""
    length = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))))
    places = np.linspace(0.0, length[-1], POINTS)
    return np.stack([np.interp(places, length, column) for column in points.T], axis=1)


def go(cases: Sequence[str], seed: int, job: tuple[int, str, float]) -> Way:
    """One reach with the costs of one case."""
    number, case, weight = job
    task, place = divmod(number, CONDITIONS_A_TASK)
    condition = task_conditions(SPLIT, task).conditions[place]
    settings: tuple[tuple[str, float | int | str], ...] = ()
    if case == AGAIN:
        seed += 1
    elif case:
        settings = (("interaction_costs", case), ("interaction_weight", weight))
    setup = PlannerSetup("ptomp", "PTOMP", settings=settings)
    run, outcome = watch_episode(
        condition, setup, task_library(SPLIT, task), slowdown=1.0, seed=seed
    )
    end = len(run.q) if run.arrived is None else run.arrived + 1
    tool = robot_keypoints(run.q[:end])[:, 3]
    costs = {name: learnt_cost(run, name) for name in cases}
    return Way(
        number, case, weight, _spaced(tool), costs, outcome.clearance, outcome.time_to_goal, outcome.ok
    )  # fmt: skip


def _kept(cases: Sequence[str], seed: int, runs: Path, job: tuple[int, str, float]) -> Way:
    def make() -> dict[str, Any]:
        way = go(cases, seed, job)
        return {**asdict(way), "tool": way.tool.tolist()}

    # Costs and settings are data, not sources.
    key = repr((tuple(cases), seed, job, _costs_hash(), load_default_config()))
    told = kept(runs, WORK, PACKAGES, key, make)
    return Way(**{**told, "tool": np.array(told["tool"])})


@functools.cache
def _costs_hash() -> str:
    """Of the learnt costs that ship."""
    return hashlib.sha256(SHIPPED_COSTS.read_bytes()).hexdigest()


def compare(
    cases: Sequence[str],
    count: int,
    seed: int,
    runs: Path,
    workers: int,
    progress: Callable[[int, int], None],
    weights: Sequence[float] = WEIGHTS,
) -> list[Way]:
    """All reaches without costs, without them by another seed, and with the costs of each case.

    Args:
        cases: Names.
        count: Reaches.
        seed: Of what is tracked and of the planner.
        runs: Folder of what is done, which is not done again.
        workers: Processes.
        progress: Told how many are done, of how many.
        weights: Of the costs.
    """
    # Spread over tasks: each has a person and a goal of its own.
    numbers = [CONDITIONS_A_TASK * k for k in range(count)]
    kinds = [(NONE, 0.0), (AGAIN, 0.0), *((case, weight) for case in cases for weight in weights)]
    jobs = [(number, *kind) for number in numbers for kind in kinds]
    found: list[Way] = []
    with closing(
        do_all(functools.partial(_kept, tuple(cases), seed, runs), jobs, workers=workers)
    ) as results:
        for way in results:
            found.append(way)
            progress(len(found), len(jobs))
    return sorted(found, key=lambda way: (way.condition, way.case, way.weight))


def _pairs(ways: Sequence[Way], case: str, weight: float) -> list[tuple[Way, Way]]:
    plain = {way.condition: way for way in ways if way.case == NONE}
    return [(plain[w.condition], w) for w in ways if (w.case, w.weight) == (case, weight)]


def _apart_cm(pairs: Sequence[tuple[Way, Way]]) -> float:
    """How far ways are from each other where they are farthest; median of all reaches [cm]."""
    apart = [np.linalg.norm(a.tool - b.tool, axis=1).max() for a, b in pairs]
    return 100.0 * float(np.median(apart))


def effect(ways: Sequence[Way], case: str, weight: float) -> dict[str, float]:
    """What the costs of a case change, over all reaches; no seconds where none arrives both ways."""
    return _change(_pairs(ways, case, weight), case)


def anyway(ways: Sequence[Way], case: str) -> dict[str, float]:
    """The same of no costs and another seed: what changes anyway of what the costs of a case are."""
    return _change(_pairs(ways, AGAIN, 0.0), case)


def _change(pairs: Sequence[tuple[Way, Way]], case: str) -> dict[str, float]:
    cost = [b.costs[case] / a.costs[case] - 1.0 for a, b in pairs]
    later = [
        b.seconds - a.seconds for a, b in pairs if a.seconds is not None and b.seconds is not None
    ]
    return {
        "reaches": len(pairs),
        "apart_cm": _apart_cm(pairs),
        "cost_percent": 100.0 * float(np.median(cost)),
        "cost_less_share": float(np.mean(np.array(cost) < 0.0)),
        "clearance_cm": 100.0 * float(np.median([b.clearance - a.clearance for a, b in pairs])),
        **({"seconds": float(np.median(later))} if later else {}),
        "ok_without": float(np.mean([a.ok for a, _ in pairs])),
        "ok_with": float(np.mean([b.ok for _, b in pairs])),
    }


def _cells(row: Mapping[str, float]) -> str:
    later = f"{row['seconds']:+.2f} s" if "seconds" in row else "–"
    return (
        f"{row['apart_cm']:.1f} cm | {row['cost_percent']:+.1f} % | "
        f"{100 * row['cost_less_share']:.0f} % | {row['clearance_cm']:+.1f} cm | "
        f"{later} | {100 * row['ok_without']:.0f} % | {100 * row['ok_with']:.0f} %"
    )


def effect_lines(ways: Sequence[Way], cases: Sequence[str]) -> list[str]:
    """The part of a report that says what learnt costs change."""
    weights = sorted({way.weight for way in ways if way.case not in (NONE, AGAIN)})
    some = _pairs(ways, cases[0], weights[0])
    text = [
        "### Learnt costs in the planner\n",
        f"PTOMP past {len(some)} simulated people who reach (the benchmark's {SPLIT} conditions, one of "
        "each task), with `planner.interaction_costs` and without, all else the same: median of each "
        "reach's difference. The cost is that of the case itself, of the motion as it was executed. Ways "
        f"differ by what is drawn, too: by how much anyway say the rows of no costs and {AGAIN}.\n",
        "| costs of | weight | farthest apart | learnt cost | less in | clearance | time to the goal | "
        "ok without | ok with |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for case in cases:
        text.append(f"| none, {AGAIN}, by {case} | – | {_cells(anyway(ways, case))} |")
        text += [
            f"| {case} | {weight:g} | {_cells(effect(ways, case, weight))} |" for weight in weights
        ]
    return [*text, "", *_cross_lines(ways, cases, weights[-1])]


def crossed(ways: Sequence[Way], cases: Sequence[str], weight: float) -> FloatArray:
    """Median change of the costs of each case (columns) by planning with those of each (rows) [%]."""
    return np.array(
        [
            [
                100.0 * np.median([b.costs[name] / a.costs[name] - 1.0 for a, b in pairs])
                for name in cases
            ]
            for case in cases
            for pairs in [_pairs(ways, case, weight)]
        ]
    )


def _cross_lines(ways: Sequence[Way], cases: Sequence[str], weight: float) -> list[str]:
    """Whether costs of a case do more for that case than those of others do."""
    text = [
        f"The same motions by the costs of each case (weight {weight:g}, median change): were all cases "
        "alike to the planner, rows would be the same.\n",
        "| planned with | " + " | ".join(f"costs of {case}" for case in cases) + " |",
        "| --- |" + " --- |" * len(cases),
    ]
    table = crossed(ways, cases, weight)
    for case, row in zip(cases, table, strict=True):
        text.append(f"| {case} | " + " | ".join(f"{value:+.1f} %" for value in row) + " |")
    return [*text, "", _whose_does_most(table, cases)]


def _whose_does_most(table: FloatArray, cases: Sequence[str]) -> str:
    """In words, of a table of :func:`crossed`."""
    most = [cases[row] for row in np.argmin(table, axis=0)]
    own = sum(one == case for one, case in zip(most, cases, strict=True))
    words = ", ".join(f"those of {case} by {one}" for one, case in zip(most, cases, strict=True))
    return (
        f"A case's own costs lower these costs most of all in {own} of {len(cases)} cases: {words}. Where "
        "it is another case's, a name chooses how much the robot keeps away, more than from what.\n"
    )


def draw_ways(path: Path, ways: Sequence[Way], cases: Sequence[str], weight: float) -> None:
    """Ways of the tool from above, without and with the costs of each case, of the first reaches.

    Args:
        path: PNG.
        ways: All of them.
        cases: Names.
        weight: Which of the weights.
    """
    shown = sorted({way.condition for way in ways})[:8]
    rows = -(-len(shown) // 4)
    figure, grid = plt.subplots(
        rows, 4, figsize=(12.0, 3.0 * rows), squeeze=False, layout="constrained"
    )
    for axes in grid.flat[len(shown) :]:
        axes.set_axis_off()
    for axes, number in zip(grid.flat, shown, strict=False):
        for way in ways:
            if way.condition != number or way.case == AGAIN or (way.case and way.weight != weight):
                continue
            name = way.case.replace("_", " ") or "none"
            style = {"color": "black", "linewidth": 1.8} if not way.case else {"linewidth": 1.1}
            axes.plot(way.tool[:, 0], way.tool[:, 1], label=name, **style)
        axes.set_title(f"condition {number}", size=8)
        axes.set_aspect("equal")
        axes.tick_params(labelsize=6)
    grid[0, 0].legend(fontsize=6)
    figure.suptitle(
        f"The tool's way from above [m], with the learnt costs of {', '.join(cases)} (weight {weight:g})",
        size=9,
    )
    figure.savefig(path, dpi=110)
    plt.close(figure)
