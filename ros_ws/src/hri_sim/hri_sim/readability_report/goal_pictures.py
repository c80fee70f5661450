"""Pictures after the thesis' figures 7.5 to 7.9: ways to each goal, costs and times of their trials."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hri_planner.pibb.experiment import Experiment
from hri_sim.media.look import BLUE, GREEN, GREY, SKY, VERMILION
from hri_sim.readability_report.drawing import (
    ABOVE,
    GOAL_COLOURS,
    VIEWS,
    draw_boxes,
    draw_way,
    guesses,
    label_view,
)
from hri_sim.readability_report.laboratory import Person
from hri_sim.readability_report.trials import COST
from hri_sim.reproduction.drawing import drawn

FloatArray = NDArray[np.float64]


def draw_goal(
    experiment: Experiment, goal: str, people: Sequence[Person], shown: Person, path: Path
) -> None:
    """Figures 7.5 to 7.8: one goal."""
    means = shown.learnt.means
    ways = [mean.path(goal) for mean in means]
    with drawn(path, 9.6, 7.0) as figure:
        upper, lower = figure.subplots(2, 2)
        for axes, (title, view) in zip(upper, VIEWS.items(), strict=True):
            draw_boxes(axes, experiment.boxes, view, "obstacle")
            for index, way in enumerate(ways[1:-1]):
                label = "after an update" if index == 0 else "_"
                draw_way(axes, way, view, color=SKY, lw=0.9, label=label)
            draw_way(axes, ways[0], view, color="black", ls="--", lw=1.6, label="initial")
            draw_way(axes, ways[-1], view, color=VERMILION, lw=2.2, label="final")
            for name, place in experiment.goals.items():
                own = name == goal
                axes.plot(
                    *(100.0 * place[list(view)]), "o", ms=7.0 if own else 5.0,
                    mfc=GREEN if own else "white", mec=GREEN if own else GREY, mew=1.2,
                    label={True: "its goal", False: "other goals"}[own] if _first(experiment, name, goal)
                    else "_",
                )  # fmt: skip
            start = 100.0 * means[0].start[list(view)]
            axes.plot(*start, "s", ms=5.0, color="black", label="start")
            axes.set_title(f"Ways to {goal}, {title}")
            label_view(axes, view)
        handles, labels = upper[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=len(labels))
        for axes, column, label in zip(
            lower, (COST, "prediction_time"), ("total cost", "J_pred [s]"), strict=True
        ):
            guesses(axes, *_of_goal(people, goal, column))
            axes.set_ylabel(label)
        lower[0].set_title(f"Costs, {_people(people)}")
        lower[1].set_title(f"Time until the goal is shown, {_people(people)}")
        handles, labels = lower[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=4)


def _first(experiment: Experiment, name: str, goal: str) -> bool:
    """Whether it is the one of its kind that the legend names."""
    return name == goal or name == next(other for other in experiment.goals if other != goal)


def _people(people: Sequence[Person]) -> str:
    return "one person" if len(people) == 1 else f"{len(people)} people"


def _of_goal(
    people: Sequence[Person], goal: str, column: str
) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
    """Number of each trial to a goal, its value and whether the guess was wrong, of all people."""
    numbers, values, wrong = [], [], []
    for person in people:
        chosen = person.trials.to(goal)
        numbers.append(np.arange(1.0, chosen.sum() + 1.0))
        values.append(person.trials.columns[column][chosen])
        wrong.append(person.trials.wrong[chosen])
    return np.concatenate(numbers), np.concatenate(values), np.concatenate(wrong)


def draw_finals(
    experiment: Experiment, people: Sequence[Person], shown: Person, path: Path
) -> None:
    """Figure 7.9: all people's last ways to one goal, and one person's to all goals."""
    goals = list(experiment.goals)
    with drawn(path, 11.4, 4.2) as figure:
        left, *right = figure.subplots(1, 3)
        view = ABOVE
        draw_boxes(left, experiment.boxes, view)
        for index, person in enumerate(people):
            label = "final, each person" if index == 0 else "_"
            draw_way(
                left,
                person.learnt.last.path(goals[0]),
                view,
                color=BLUE,
                lw=0.9,
                alpha=0.6,
                label=label,
            )
        draw_way(
            left, shown.learnt.first.path(goals[0]), view, color="black", ls="--", lw=1.6, label="initial"
        )  # fmt: skip
        left.plot(*(100.0 * experiment.goals[goals[0]][list(view)]), "o", ms=7.0, color=GREEN)
        left.set_title(f"{goals[0]}, {_people(people)}, from above")
        label_view(left, view)
        left.legend(loc="best")
        for axes, (title, view) in zip(right, VIEWS.items(), strict=True):
            draw_boxes(axes, experiment.boxes, view)
            for goal, colour in zip(goals, GOAL_COLOURS, strict=False):
                draw_way(axes, shown.learnt.first.path(goal), view, color=colour, lw=1.0, ls=":")
                draw_way(axes, shown.learnt.last.path(goal), view, color=colour, lw=2.0, label=goal)
                axes.plot(*(100.0 * experiment.goals[goal][list(view)]), "o", ms=6.0, color=colour)
            axes.set_title(f"All goals, {title}")
            label_view(axes, view)
        handles, labels = right[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=len(goals))
