"""People and tracking otherwise than planners were made for, and a robot that truly moves."""

from __future__ import annotations

from collections.abc import Mapping

from hri_sim.benchmark.execution import MUJOCO, PAPER
from hri_sim.benchmark.outcome import GOAL_M
from hri_sim.benchmark.planners import PLANNERS, find_planners
from hri_sim.benchmark.report import SHARE_HEADS, markdown_table, share_text
from hri_sim.benchmark.run import Plan
from hri_sim.benchmark.variation import AS_DRAWN, CHANGES_TARGET, STOPS, Variation
from hri_sim.reproduction.bars import ITOMP, OURS, SLOWDOWNS
from hri_sim.reproduction.leads import VELOCITY
from hri_sim.reproduction.section import FEW, Measured, Scope, extent

VARIATIONS = {
    "as drawn": Variation(),
    "noise 5 mm": Variation(tracking_noise_mm=5.0),
    "noise 10 mm": Variation(tracking_noise_mm=10.0),
    "latency 40 ms": Variation(latency_ms=40.0),
    "latency 80 ms": Variation(latency_ms=80.0),
    "slower person": Variation(person_speed=0.7),
    "faster person": Variation(person_speed=1.5),
    "person stops": Variation(person=STOPS),
    "person changes target": Variation(person=CHANGES_TARGET),
}
"""By what the report calls them."""
COMPARED = (OURS, VELOCITY, ITOMP)


def people_plans(scope: Scope) -> dict[str, Plan]:
    """One for each variation and machine."""
    names = list(VARIATIONS)[:: len(VARIATIONS) - 1] if scope.smoke else VARIATIONS
    return {
        f"{name}, F = {slow:g}": scope.first.plan(
            find_planners(COMPARED), slow, conditions=FEW, variation=VARIATIONS[name]
        )
        for slow in SLOWDOWNS
        for name in names
    }


def people_lines(measured: Mapping[str, Measured]) -> list[str]:
    """A row for each variation and planner, with what can be reached at all."""
    rows = []
    for name, one in measured.items():
        feasible = share_text(one.results["oracle_feasible"], None)
        for planner, found in one.results["planners"].items():
            shares = [share_text(found[key], found["ci95"][key]) for key in SHARE_HEADS]
            left = share_text(_left_goal(one, planner), None)
            taken = found["time_to_goal_s"]
            time = "–" if taken is None else f"{taken:.2f}"
            rows.append([name, f"`{planner}`", *shares, left, time, feasible])
    asked = {one.plan.variation for one in measured.values()}
    asked.discard(AS_DRAWN)
    text = [f"- {name}: {v.text}." for name, v in VARIATIONS.items() if v in asked]
    return [
        f"{extent(measured)}. Planners and predictors know "
        "nothing of what is otherwise; the last column can be reached with perfect prediction and a large "
        "budget. Left: ok, but within 0.6 s the tool was more than 1 cm off the goal again. A planner that "
        "keeps clear at the goal too gives way to all that it is told there, noise included.\n",
        markdown_table(
            ["what", "planner", *SHARE_HEADS.values(), "left", "time to goal [s]", "perfect"], rows
        ),
        "\n".join(text) + "\n",
    ]


def _left_goal(measured: Measured, planner: str) -> float:
    """Share of motions that are ok and then leave the goal."""
    outcomes = [
        o for unit, d in measured.done.items() if unit.planner == planner for o in d.outcomes
    ]
    left = [o.ok and o.hold_error is not None and o.hold_error > GOAL_M for o in outcomes]
    return sum(left) / len(left)


def mujoco_plans(scope: Scope) -> dict[str, Plan]:
    """Ours on paper and in MuJoCo, on the reference machine and on a slow one."""
    return {
        f"F{slow:g} {where}": scope.first.plan(
            (PLANNERS[OURS],), slow, conditions=FEW, execution=execution
        )
        for slow in (1.0, 64.0)
        for where, execution in (("paper", PAPER), ("MuJoCo", MUJOCO))
    }


def mujoco_lines(measured: Mapping[str, Measured]) -> list[str]:
    """Both side by side, and how far the joints were from the plan."""
    rows = []
    for name, one in measured.items():
        found = one.results["planners"][OURS]
        error = found.get("tracking_error_rad")
        rows.append(
            [
                name,
                *(share_text(found[key], found["ci95"][key]) for key in SHARE_HEADS),
                f"{found['clearance_m']:.4f}",
                f"{found['accel_cost']:.1f}",
                "–" if error is None else f"{1e3 * error:.2f}",
            ]
        )
    head = [
        "what",
        *SHARE_HEADS.values(),
        "clearance [m]",
        "∫‖q̈‖² [rad²/s³]",
        "largest error [mrad]",
    ]
    return [
        f"{extent(measured)}, `{OURS}`: plans as they are, and as "
        "the simulated controller and robot follow them.\n",
        markdown_table(head, rows),
    ]
