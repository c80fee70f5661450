"""Pictures of one person's trials: costs and times, and how the ways have changed."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hri_planner.dmp.policy import DmpPolicy
from hri_planner.pibb.experiment import Experiment
from hri_planner.pibb.session import Result, Session

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FloatArray = NDArray[np.float64]

_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")


def draw_session(path: Path, session: Session, first: DmpPolicy, title: str) -> None:
    """Draw a session into a PNG.

    Args:
        path: Of the file.
        session: Its trials, and the policy that they led to.
        first: The policy that it began with.
        title: What it is.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.0, 7.6), layout="constrained")
    FigureCanvasAgg(figure)
    grid: dict[str, Axes] = figure.subplot_mosaic([["cost", "time"], ["top", "side"]])
    figure.suptitle(title)
    learning = [result for result in session.state.results if result.trial.update >= 0]
    _draw_cost(grid["cost"], list(session.experiment.goals), learning)
    _draw_times(grid["time"], session.state.results)
    for name, axes in (("top", (1, 0)), ("side", (1, 2))):
        _draw_ways(grid[name], session.experiment, first, session.state.policy, axes)
    figure.savefig(path, dpi=110)


def _draw_cost(axes: Axes, goals: list[str], results: list[Result]) -> None:
    from matplotlib.ticker import MaxNLocator

    axes.set(
        title="Cost of the trials, and mean of each update", xlabel="update", ylabel="total cost"
    )
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    samples = max((r.trial.sample for r in results), default=0)
    for index, goal in enumerate(goals):
        own = [r for r in results if r.trial.goal == goal]
        updates = sorted({r.trial.update for r in own})
        means = [np.mean([r.cost for r in own if r.trial.update == u]) for u in updates]
        colour = _COLOURS[index % len(_COLOURS)]
        places = [r.trial.update + 1 + 0.08 * (r.trial.sample - 0.5 * samples) for r in own]
        axes.plot(places, [r.cost for r in own], ".", color=colour, alpha=0.25)
        axes.plot(np.array(updates) + 1, means, ".-", color=colour, label=goal)
    axes.legend(frameon=False)


def _draw_times(axes: Axes, results: tuple[Result, ...]) -> None:
    from matplotlib.ticker import MaxNLocator

    axes.set(title="Until the person showed a goal", xlabel="trial", ylabel="J_pred [s]")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    number = np.array([r.trial.number for r in results])
    time = np.array([r.terms.prediction_time for r in results])
    right = np.array([r.terms.task == 0.0 for r in results])
    axes.plot(number[right], time[right], ".", color="#0072B2", alpha=0.5, label="right guess")
    axes.plot(number[~right], time[~right], "x", color="#D55E00", label="wrong guess")
    # A guess that is fast and wrong is no good: it is not in the mean.
    number, time = number[right], time[right]
    window = max(len(time) // 12, 3)
    if len(time) > window:
        mean = np.ones(window) / window
        middle, smooth = (np.convolve(values, mean, mode="valid") for values in (number, time))
        axes.plot(middle, smooth, color="black", label=f"mean of {window} right ones")
    axes.legend(frameon=False)


def _draw_ways(
    axes: Axes, experiment: Experiment, first: DmpPolicy, last: DmpPolicy, shown: tuple[int, int]
) -> None:
    from matplotlib.patches import Rectangle

    names = "xyz"
    title = {(1, 0): "Ways from above", (1, 2): "Ways as the person sees them"}[shown]
    axes.set(
        title=f"{title}: first (dashed), last", xlabel=f"{names[shown[0]]} [m]",
        ylabel=f"{names[shown[1]]} [m]",
    )  # fmt: skip
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.2)
    # Who sits opposite has y > 0 at the left hand; from above, so has the picture.
    axes.invert_xaxis()
    for centre, half in experiment.boxes:
        corner = tuple(centre[list(shown)] - half[list(shown)])
        size = 2.0 * half[list(shown)]
        axes.add_patch(Rectangle(corner, *size, fc="#f2c48d", ec="#c08040"))
    for index, goal in enumerate(experiment.goals):
        colour = _COLOURS[index % len(_COLOURS)]
        for policy, style in ((first, "--"), (last, "-")):
            way = policy.path(goal)[:, list(shown)]
            axes.plot(*way.T, style, color=colour)
        place = policy.goals[goal][list(shown)]
        axes.plot(*place, "o", color=colour)
        axes.annotate(
            goal, (place[0], place[1]), xytext=(6, 6), textcoords="offset points", color=colour
        )
