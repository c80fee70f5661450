"""What the report's pictures have in common."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hri_sim.media.look import BLUE, GREEN, GREY, PURPLE, SKY, VERMILION, Colour

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

GOAL_COLOURS: Sequence[Colour] = (BLUE, VERMILION, GREEN, PURPLE, SKY, GREY)
ABOVE, FRONT = (1, 0), (1, 2)
VIEWS = {"from above": ABOVE, "as the person sees it": FRONT}
"""Axes of the base frame that are seen, to the right and upwards; from above, x points downwards."""
AXES = "xyz"
BELL_TRIALS = 5.0
"""Standard deviation of the bell by which trials are smoothed."""


def bands(
    axes: Axes, courses: FloatArray, colour: Colour, label: str, *, most: float = np.inf
) -> None:
    """Mean and standard deviation over people of courses (people, updates), all below ``most``."""
    updates = np.arange(1, courses.shape[1] + 1)
    mean, sd = courses.mean(axis=0), courses.std(axis=0)
    axes.fill_between(
        updates, mean - sd, np.minimum(mean + sd, most), color=colour, alpha=0.16, lw=0
    )
    axes.plot(updates, mean, color=colour, lw=2.0, label=label)
    whole_updates(axes, courses.shape[1])


def whole_updates(axes: Axes, count: int) -> None:
    """Ticks at the first update and at round numbers."""
    axes.set_xticks([1, *range(5, count + 1, 5)] if count >= 10 else range(1, count + 1))
    axes.set_xlim(0.5, count + 0.5)
    axes.set_xlabel("update")


def guesses(axes: Axes, numbers: FloatArray, values: FloatArray, wrong: BoolArray) -> None:
    """Trials as points, wrong guesses apart, with mean and standard deviation."""
    right = ~wrong
    axes.plot(
        numbers[right], values[right], ".", ms=5.0, mew=0, color=BLUE, alpha=0.35, label="right guess"
    )  # fmt: skip
    axes.plot(
        numbers[wrong], values[wrong], "x", ms=4.5, mew=1.0, color=VERMILION, alpha=0.8,
        label="wrong guess",
    )  # fmt: skip
    grid = np.arange(1.0, numbers.max() + 1.0)
    mean, sd = smoothed(numbers, values, grid)
    axes.plot(grid, mean, color="black", lw=1.8, label="mean, smoothed")
    axes.plot(grid, sd, "--", color=GREEN, lw=1.8, label="standard deviation, smoothed")
    axes.set_xlim(0.0, numbers.max() + 1.0)
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("trial to this goal")


def smoothed(
    numbers: FloatArray, values: FloatArray, grid: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Mean and standard deviation of values over trial numbers: of those around, by a bell.

    A polynomial through squares would fall below zero where few guesses are wrong.
    """
    bell = np.exp(-0.5 * ((numbers - grid[:, None]) / BELL_TRIALS) ** 2)
    bell /= bell.sum(axis=1, keepdims=True)
    mean = bell @ values
    square = (bell * (values - mean[:, None]) ** 2).sum(axis=1)
    return mean, np.sqrt(square)


def draw_boxes(axes: Axes, boxes: FloatArray, view: tuple[int, int], label: str = "") -> None:
    """Static obstacles (k, 2, 3) as they are seen."""
    from matplotlib.patches import Rectangle

    for index, (centre, half) in enumerate(boxes):
        corner = 100.0 * (centre - half)[list(view)]
        width, height = 200.0 * half[list(view)]
        axes.add_patch(
            Rectangle(
                (float(corner[0]), float(corner[1])), width, height, fc="0.85", ec="0.55", lw=0.8,
                label=label if index == 0 else "_",
            )
        )  # fmt: skip


def draw_way(axes: Axes, path: FloatArray, view: tuple[int, int], **look: Any) -> None:
    """A way (n, 3) [m] as it is seen, in cm."""
    axes.plot(100.0 * path[:, view[0]], 100.0 * path[:, view[1]], **look)


def label_view(axes: Axes, view: tuple[int, int]) -> None:
    """Names of the axes; a centimetre is as long on both."""
    axes.set(xlabel=f"{AXES[view[0]]} [cm]", ylabel=f"{AXES[view[1]]} [cm]")
    axes.set_aspect("equal", adjustable="datalim")
    if view == ABOVE:
        axes.invert_yaxis()
