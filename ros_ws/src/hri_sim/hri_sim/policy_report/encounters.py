"""The separation filter in ten thousand encounters with partners who do not give way.

And in some thousand more with partners who chase the hand, and with partners whose whole arm is kept clear
of as the node keeps clear of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_planner.policy.config import PolicyConfig
from hri_planner.policy.separation import SeparationConfig
from hri_planner.rnn.metrics.reaching import REACHED_M, reach_steps
from hri_planner.rnn.model import PolicyModel
from hri_sim.benchmark.report import markdown_table
from hri_sim.dyads.arms import SeatedArm
from hri_sim.dyads.hands import STEP_S, Reaches
from hri_sim.dyads.setups import DyadSetup, draw_setups
from hri_sim.policies.evaluation import finite
from hri_sim.policies.evaluation_report import number
from hri_sim.policies.meetings import Meetings, chased, distances, draw_many, meet, taken
from hri_sim.policy_report.laboratory import Laboratory

COUNT = 10_000
FURTHER = 2_000
SMOKE_COUNT = 20
FASTEST_M_S = 2.0
"""Of partners who chase the hand."""
STRAYED_M = 0.3
"""A hand that ends so far from a free goal has strayed."""
HANDS, CHASING, ARMS = "hands", "chasing", "arms"
KINDS = ("bounded", "fiercer", CHASING, ARMS)

_SETUPS, _EACH = 25, 20
"""Of one batch."""
_STREAM = 41
_ROUNDING_M = 1e-9


@dataclass(frozen=True)
class Batch:
    """A part of the encounters.

    Attributes:
        file: Of the policy.
        number: Of the batch, which decides about its encounters.
        kind: Partners whose hands reach, chase the hand, or reach with arms that are seen.
        setups: Number of setups, with twenty encounters each.
    """

    file: Path
    number: int
    kind: str
    setups: int = _SETUPS


def arms_of(setups: Sequence[DyadSetup]) -> SeatedArm:
    """Partners' arms, of each of the encounters in each of some setups."""
    shoulders = np.array([setup.shoulders[1] for setup in setups])
    yaws = np.array([setup.yaw[1] for setup in setups])
    return SeatedArm(np.repeat(shoulders, _EACH, axis=0), np.repeat(yaws, _EACH))


def measure(laboratory: Laboratory) -> dict[str, Any]:
    """Figures by policy and kind of partner, with and without the filter."""
    config = SeparationConfig()
    counts = {HANDS: COUNT, CHASING: FURTHER, ARMS: FURTHER}
    found: dict[str, Any] = {}
    for policy in laboratory.compared():
        file = policy.file(laboratory.runs)
        parts: dict[str, dict[str, NDArray[Any]]] = {}
        for kind, most in counts.items():
            wanted = min(most, SMOKE_COUNT) if laboratory.smoke else most
            work = partial(encounter_batch, config=_of_the_node() if kind == ARMS else config)
            got: list[dict[str, NDArray[Any]]] = []
            # Some are drawn again: as many batches as it takes.
            while _enough(got) < wanted:
                left = wanted - _enough(got)
                size = 2 if laboratory.smoke else _SETUPS
                more = -(-left // (size * _EACH * 9 // 10))
                batches = [Batch(file, len(got) + i, kind, size) for i in range(more)]
                got += laboratory.all(f"encounters {policy.name}", work, batches)
            parts[kind] = _trimmed(got, wanted)
        beside, chased_by = parts[HANDS], parts[CHASING]
        bounded = _bounded(beside)
        found[policy.name] = {
            "bounded": summary(beside, bounded, config),
            "fiercer": summary(beside, ~bounded, config),
            CHASING: summary(chased_by, _bounded(chased_by), config),
            ARMS: summary(parts[ARMS], _bounded(parts[ARMS]), _of_the_node()),
            "drawn": int(beside["drawn"]),
        }
    return {
        "separation_m": config.separation,
        "arm_separation_m": _of_the_node().separation,
        "hand_acceleration": config.hand_acceleration,
        "partner_acceleration": config.partner_acceleration,
        "policies": found,
    }


def _of_the_node() -> SeparationConfig:
    return PolicyConfig().separation_filter


def _bounded(batch: Mapping[str, NDArray[Any]]) -> NDArray[np.bool_]:
    found: NDArray[np.bool_] = (
        batch["partner_acceleration"] <= SeparationConfig().partner_acceleration
    )
    return found


def _enough(batches: Sequence[Mapping[str, NDArray[Any]]]) -> int:
    """Encounters so far whose partner keeps the bound."""
    return sum(int(_bounded(batch).sum()) for batch in batches)


def _trimmed(batches: Sequence[Mapping[str, NDArray[Any]]], count: int) -> dict[str, NDArray[Any]]:
    """All up to the last of so many whose partner keeps the bound."""
    whole = {
        name: np.concatenate([batch[name] for batch in batches])
        for name in batches[0]
        if name != "drawn"
    }
    last = int(np.flatnonzero(np.cumsum(_bounded(whole)) == count)[0]) + 1
    drawn = np.array(sum(int(batch["drawn"]) for batch in batches))
    return {**{name: values[:last] for name, values in whole.items()}, "drawn": drawn}


def encounter_batch(batch: Batch, config: SeparationConfig) -> dict[str, NDArray[Any]]:
    """Figures of each encounter; those are left out that begin within the separation.

    Returns:
        By name: of each encounter (n,), and the number drawn.
    """
    from hri_planner.rnn.model_file import load_policy

    model = load_policy(batch.file)
    rng = np.random.default_rng((_STREAM, batch.number, (HANDS, CHASING, ARMS).index(batch.kind)))
    setups = draw_setups(batch.setups, rng)
    drawn = draw_many(setups, _EACH, rng)
    arms = arms_of(setups) if batch.kind == ARMS else None
    joints = drawn.start[:, 1:] if arms is None else arms.keypoints(drawn.start[:, 1])
    apart = distances(joints, drawn.start[:, 0]) >= config.separation
    reaches = taken(drawn, apart).with_partner("none")
    if arms is not None:
        arms = SeatedArm(arms.shoulder[apart], np.asarray(arms.yaw)[apart])
    muscles = int(rng.integers(2**31))
    exact = _run(model, reaches, None, batch, config, muscles, arms)
    kept = _run(model, reaches, config, batch, config, muscles, arms)
    goal = reaches.goal[:, 0]
    last = kept.partner[:, -1]
    there = distances(last[:, None] if arms is None else arms.keypoints(last), goal)
    found = {
        "drawn": np.array(len(drawn)),
        "partner_acceleration": kept.partner_acceleration,
        "goal_free": there > config.separation + REACHED_M,
        "filtered": kept.filtered,
    }
    for name, one in (("without", exact), ("with", kept)):
        found[f"nearest_{name}"] = one.nearest
        found[f"reached_{name}"] = np.isfinite(reach_steps(one.hand, goal))
        found[f"terminal_{name}"] = np.linalg.norm(one.hand[:, -1] - goal, axis=1)
    return found


def _run(
    model: PolicyModel,
    reaches: Reaches,
    separation: SeparationConfig | None,
    batch: Batch,
    config: SeparationConfig,
    muscles: int,
    arms: SeatedArm | None,
) -> Meetings:
    if batch.kind == CHASING:
        # A hair less, so that rounding does not count as more.
        most = config.partner_acceleration * (1.0 - 1e-9)
        return chased(model, reaches, separation, FASTEST_M_S, most)
    rng = np.random.default_rng(muscles)
    arm = None if arms is None else arms.keypoints
    return meet(model, reaches, rng, separation=separation, arm=arm)


def summary(
    found: Mapping[str, NDArray[Any]], which: NDArray[np.bool_], config: SeparationConfig
) -> dict[str, Any]:
    """Figures of some encounters, with and without the filter."""
    free = which & found["goal_free"]

    def of(name: str) -> dict[str, Any]:
        nearest, terminal = found[f"nearest_{name}"][which], 1e3 * found[f"terminal_{name}"]
        reached = found[f"reached_{name}"]
        return {
            "violations": int((nearest < config.separation - _ROUNDING_M).sum()),
            "nearest_mm": float(1e3 * nearest.min()) if len(nearest) else None,
            "reached_share": _mean(reached[which]),
            "reached_share_goal_free": _mean(reached[free]),
            "terminal_mean_mm": _mean(terminal[free]),
            "terminal_max_mm": float(terminal[free].max()) if free.any() else None,
            "strayed": int((terminal[free] > 1e3 * STRAYED_M).sum()),
        }

    filtered = found["filtered"][which]
    result: dict[str, Any] = finite(
        {
            "encounters": int(which.sum()),
            "goal_free": int(free.sum()),
            "acted_share": _mean(filtered > 0.0),
            "acted_time_share": _mean(filtered),
            "without": of("without"),
            "with": of("with"),
        }
    )
    return result


def _mean(values: NDArray[Any]) -> float | None:
    return float(values.mean()) if len(values) else None


_SAID = {
    "bounded": "do not give way",
    "fiercer": "the same, accelerate more than the filter expects",
    CHASING: f"chase the hand, at up to {FASTEST_M_S:g} m/s",
    ARMS: "do not give way, the whole arm",
}


def lines(found: Mapping[str, Any]) -> list[str]:
    """The table."""
    rows = []
    for name, kinds in found["policies"].items():
        for kind in KINDS:
            one = kinds[kind]
            if not one["encounters"]:
                continue
            for filtered in ("without", "with"):
                mine = one[filtered]
                acted = [
                    f"{100.0 * one['acted_share']:.1f}",
                    f"{100.0 * one['acted_time_share']:.1f}",
                ]
                rows.append(
                    [
                        f"`{name}`",
                        _SAID[kind],
                        filtered,
                        f"{mine['violations']:,} of {one['encounters']:,}",
                        "–" if mine["nearest_mm"] is None else f"{mine['nearest_mm']:.2f}",
                        number(_percent(mine["reached_share"])),
                        number(_percent(mine["reached_share_goal_free"])),
                        f"{number(mine['terminal_mean_mm'])} / {number(mine['terminal_max_mm'])}",
                        str(mine["strayed"]),
                        *(acted if filtered == "with" else ("–", "–")),
                    ]
                )
    first = next(iter(found["policies"].values()))
    fierce = first["fiercer"]["encounters"]
    every = first["bounded"]["encounters"] + fierce
    return [
        f"A set separation of {found['separation_m']:g} m, a hand that may accelerate by "
        f"{found['hand_acceleration']:g} m/s², partners taken to be capable of "
        f"{found['partner_acceleration']:g} m/s²; the filter acts every {1e3 * STEP_S:g} ms on true "
        "positions and velocities. Both begin at rest. Encounters that begin within the separation "
        f"are drawn again. Of {every:,} partners who do not give way, {fierce:,} accelerated more than "
        "the filter expects at some moment: they are counted apart, and others were drawn until "
        f"{first['bounded']['encounters']:,} kept the bound. Violations: encounters in which the hands "
        "were nearer than the set separation at any control step; between two of them they come at most "
        "0.03 mm nearer than at both. Goal free: the partner does not end so near to the goal (separation "
        "+ 30 mm) that the filter must keep the hand off; terminal distances are of these. Strayed: "
        f"goal free, but the hand ended {STRAYED_M:g} m off or more: pushed to where the policy has learnt "
        "nothing, it does not find back. Those who chase keep the bound, and never let go of the hand. "
        f"*The whole arm*: {found['arm_separation_m']:g} m from the axes of upper arm, forearm and hand of "
        "seated people, by what moves the robot; none of whose joints accelerates more than expected.\n",
        markdown_table(
            [
                "policy", "partners", "filter", "violations", "nearest [mm]", "reached [%]",
                "reached, goal free [%]", "terminal mean / max [mm]", "strayed", "filter acted in [%]",
                "of the time [%]",
            ],
            rows,
        ),
    ]  # fmt: skip


def _percent(value: float | None) -> float | None:
    return None if value is None else 100.0 * value
