"""What numbers of time steps and of noisy trajectories do to the costs of one scene."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hri_prediction.arm.geometry import FloatArray
from hri_sim.benchmark.conditions import Condition
from hri_sim.benchmark.planners import PLANNERS, PlannerSetup
from hri_sim.reproduction.bars import OURS
from hri_sim.reproduction.closer import Item, Look
from hri_sim.reproduction.drawing import drawn
from hri_sim.reproduction.section import Scope

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SLOWDOWN = 8.0
"""F of the machine: on the reference machine, no number of either costs too much time."""
TIME_STEPS = tuple(range(10, 61, 5))
ROLLOUTS = tuple(range(5, 61, 5))
OBSERVERS = {"certain": "oracle", "uncertain": "promp"}
"""Without and with uncertainty of the prediction: the true motion, or what is learnt."""
TITLES = {
    "certain": "the person's motion is known",
    "uncertain": "the person's motion is predicted, with uncertainty",
}
COSTS = {
    "collision": "collision cost  ∫Σ max(0, (m − d)/5 cm)² dt  [s]",
    "control": "control cost  ½∫‖q̈‖² dt  [rad²/s³]",
}
_COLOURS = "cividis"


def with_parameters(time_steps: int, rollouts: int, observer: str) -> PlannerSetup:
    """Ours with other numbers of time steps and noisy trajectories."""
    ours = PLANNERS[OURS]
    settings = (*ours.settings, ("num_timesteps", time_steps), ("num_rollouts", rollouts))
    text = f"{OURS} with TS = {time_steps}, NT = {rollouts}"
    return PlannerSetup(f"{OURS}_{time_steps}_{rollouts}", text, observer, settings)


@dataclass(frozen=True)
class Grid:
    """The cells of both surfaces.

    Attributes:
        scene: The condition.
        scope: How many seeds each cell is averaged over.
    """

    scene: Condition
    scope: Scope

    @property
    def time_steps(self) -> tuple[int, ...]:
        """Values of TS."""
        return TIME_STEPS[:: len(TIME_STEPS) - 1] if self.scope.smoke else TIME_STEPS

    @property
    def rollouts(self) -> tuple[int, ...]:
        """Values of NT."""
        return ROLLOUTS[:: len(ROLLOUTS) - 1] if self.scope.smoke else ROLLOUTS

    @property
    def items(self) -> list[Item]:
        """All there is to look at: by kind of prediction, TS, NT and seed."""
        task = self.scene.task
        return [
            Item(
                with_parameters(ts, nt, o), task.split, task.number, self.scene.number, SLOWDOWN, s
            )
            for o in OBSERVERS.values()
            for ts in self.time_steps
            for nt in self.rollouts
            for s in self.scope.seeds
        ]

    def surfaces(self, looks: Sequence[Look]) -> dict[str, dict[str, Any]]:
        """Mean costs and shares of contact as rows of TS, by kind of prediction."""
        shape = (len(OBSERVERS), len(self.time_steps), len(self.rollouts), len(self.scope.seeds))
        values = {
            "collision": [seen.collision_cost for seen in looks],
            "control": [0.5 * seen.outcome.accel_cost for seen in looks],
            "contact": [float(seen.contact_s is not None) for seen in looks],
            "ok": [float(seen.outcome.ok) for seen in looks],
        }
        means = {
            name: np.array(found).reshape(shape).mean(axis=3) for name, found in values.items()
        }
        return {
            kind: {name: found[number].tolist() for name, found in means.items()}
            for number, kind in enumerate(OBSERVERS)
        }


def worst_cell(grid: Grid, surface: Mapping[str, Any]) -> tuple[int, int]:
    """(TS, NT) of the largest collision cost; of the largest control cost where several are equal."""
    keys = [
        (surface["collision"][i][j], surface["control"][i][j], ts, nt)
        for i, ts in enumerate(grid.time_steps)
        for j, nt in enumerate(grid.rollouts)
    ]
    *_, time_steps, rollouts = max(keys)
    return time_steps, rollouts


def draw(grid: Grid, surfaces: Mapping[str, Mapping[str, Any]], kind: str, path: Path) -> None:
    """Both costs of one kind of prediction; colours mean the same for both kinds."""
    with drawn(path, 11.0, 4.9) as figure:
        for panel, (name, title) in zip(figure.subplots(1, 2), COSTS.items(), strict=True):
            highest = max(np.max(found[name]) for found in surfaces.values())
            contacts = np.array(surfaces[kind]["contact"])
            _panel(figure, panel, grid, np.array(surfaces[kind][name]), contacts, float(highest))
            panel.set_title(title)
        seeds = len(grid.scope.seeds)
        figure.suptitle(
            f"Costs over time steps and noisy trajectories, F = {SLOWDOWN:g}, mean of {seeds} seed"
            f"{'s' if seeds > 1 else ''}: {TITLES[kind]}\n(dots: contact with some seed)",
            fontsize=10.5,
            x=0.01,
            ha="left",
        )


def _panel(
    figure: Figure, axes: Axes, grid: Grid, values: FloatArray, contacts: FloatArray, highest: float
) -> None:
    top = max(highest, 1e-9)
    image = axes.imshow(values, origin="lower", aspect="auto", cmap=_COLOURS, vmin=0.0, vmax=top)
    digits = next((n for n, least in enumerate((20.0, 3.0, 0.3)) if highest >= least), 3)
    for (row, column), value in np.ndenumerate(values):
        colour = "white" if value < 0.55 * top else "black"
        text = f"{value:.{digits}f}"
        axes.text(column, row, text, ha="center", va="center", fontsize=6.8, color=colour)
        if contacts[row, column] > 0.0:
            axes.plot(column + 0.36, row + 0.30, "o", ms=3.2, mfc="#d55e00", mec="white", mew=0.5)
    axes.set_xticks(range(len(grid.rollouts)), [str(n) for n in grid.rollouts])
    axes.set_yticks(range(len(grid.time_steps)), [str(n) for n in grid.time_steps])
    axes.set_xlabel("noisy trajectories an iteration, NT")
    axes.set_ylabel("time steps of the motion, TS")
    axes.spines[:].set_visible(False)
    axes.tick_params(length=0)
    bar = figure.colorbar(image, ax=axes, fraction=0.05, pad=0.02)
    bar.outline.set_visible(False)
