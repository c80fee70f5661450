"""Pictures after the thesis' figures 7.10 to 7.13: how costs and people's times went over the updates."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hri_sim.media.look import BLUE, GREY, VERMILION
from hri_sim.readability_report.cases import Case
from hri_sim.readability_report.drawing import GOAL_COLOURS, bands, whole_updates
from hri_sim.readability_report.laboratory import Person
from hri_sim.readability_report.trials import COST, Trials, costs_in
from hri_sim.reproduction.drawing import drawn

FloatArray = NDArray[np.float64]
Pairs = Sequence[tuple[Person, Person]]

A_COLOUR, B_COLOUR = VERMILION, BLUE


def draw_course(people: Sequence[Person], shown: Person, path: Path) -> None:
    """Figure 7.10: cost, response time and accuracy."""

    def right(trials: Trials) -> FloatArray:
        return trials.by_update(np.where(trials.wrong, 0.0, 100.0))

    panels = {
        "Total cost": ("total cost", lambda t: t.by_update(t.columns[COST])),
        "Response time": ("J_pred [s]", lambda t: t.by_update(t.columns["prediction_time"])),
        "Accuracy": ("right guesses [%]", right),
    }
    with drawn(path, 11.4, 3.7) as figure:
        for axes, (title, (label, of)) in zip(figure.subplots(1, 3), panels.items(), strict=True):
            courses = np.array([of(person.trials) for person in people])
            most = 100.0 if title == "Accuracy" else np.inf
            bands(axes, courses, BLUE, "all people: mean ± standard deviation", most=most)
            updates = np.arange(1, courses.shape[1] + 1)
            axes.plot(
                updates, of(shown.trials), "o-", ms=3.5, lw=1.0, color=VERMILION, label="one person"
            )
            axes.set(ylabel=label, title=title)
        handles, labels = axes.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=2)


def draw_jerk(people: Sequence[Person], shown: Person, path: Path) -> None:
    """Figure 7.11: jerk of joints and tool over the trials."""
    panels = {
        "Joints": ("joint_jerk", "∫ jerk² [rad²/s⁵]"),
        "Tool": ("tool_jerk", "∫ jerk² [m²/s⁵]"),
    }
    with drawn(path, 9.6, 4.0) as figure:
        for axes, (title, (column, label)) in zip(
            figure.subplots(1, 2), panels.items(), strict=True
        ):
            values = shown.trials.columns[column]
            numbers = np.arange(1, len(values) + 1)
            axes.plot(
                numbers,
                values,
                ".",
                ms=4.0,
                mew=0,
                color=GREY,
                alpha=0.7,
                label="one person's trials",
            )
            columns = [person.trials.columns[column] for person in people]
            updates = shown.trials.updates
            each = len(values) / updates
            middle = (np.arange(updates) + 0.5) * each + 0.5
            pooled = [
                np.concatenate(
                    [
                        one[person.trials.of(update)]
                        for one, person in zip(columns, people, strict=True)
                    ]
                )
                for update in range(updates)
            ]
            low, half, high = np.array([np.percentile(one, (10, 50, 90)) for one in pooled]).T
            axes.fill_between(
                middle, low, high, color=BLUE, alpha=0.16, lw=0, label="all people: 10 to 90 %"
            )
            axes.plot(middle, half, color=BLUE, lw=2.0, label="all people: median of an update")
            axes.set(xlabel="trial", ylabel=label, title=title, yscale="log")
            axes.set_xlim(0.0, len(values) + 1.0)
        handles, labels = axes.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=3)


def draw_transfer_cost(
    teacher: Person, pairs: Pairs, cases: tuple[Case, Case], smoke: bool, path: Path
) -> None:
    """Figure 7.12: costs of who taught before B, and those of A and B for each goal."""
    goals = teacher.trials.goals
    weights = [case.experiment(smoke).weights for case in cases]
    with drawn(path, 11.4, 3.7) as figure:
        left, *right = figure.subplots(1, 1 + len(goals))
        for goal, colour in zip(goals, GOAL_COLOURS, strict=False):
            trials = teacher.trials
            costs = trials.by_update(trials.columns[COST], goal)
            left.plot(
                range(1, trials.updates + 1), costs, "o-", ms=3.0, lw=1.4, color=colour, label=goal
            )
        whole_updates(left, teacher.trials.updates)
        left.set(ylabel="total cost, mean of an update", title="Who taught before B")
        left.legend()
        for axes, goal in zip(right, goals, strict=True):
            for index, (colour, name) in enumerate(((A_COLOUR, "A"), (B_COLOUR, "B"))):
                courses = [
                    pair[index].trials.by_update(
                        costs_in(pair[index].trials, pair[0].learnt.units, weights[index]), goal
                    )
                    for pair in pairs
                ]
                bands(axes, np.array(courses), colour, f"{name}: mean ± standard deviation")
            axes.set_title(f"A and B, {goal}")
        right[0].set_ylabel("total cost, in A's units")
        ends = np.array([axes.get_ylim() for axes in right])
        for axes in right:
            axes.set_ylim(ends[:, 0].min(), ends[:, 1].max())
        handles, labels = right[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=2)


def draw_transfer_time(pairs: Sequence[tuple[str, Pairs]], path: Path) -> None:
    """Figure 7.13: response times of A and B, a panel for each pair of experiments."""
    with drawn(path, 4.9 * len(pairs) + 0.6, 3.9) as figure:
        panels = figure.subplots(1, len(pairs), sharey=True, squeeze=False)[0]
        for axes, (title, some) in zip(panels, pairs, strict=True):
            for index, (colour, name) in enumerate(((A_COLOUR, "A"), (B_COLOUR, "B"))):
                courses = [
                    one.trials.by_update(one.trials.columns["prediction_time"])
                    for one in (pair[index] for pair in some)
                ]
                bands(axes, np.array(courses), colour, f"{name}: mean ± standard deviation")
            axes.set_title(title)
        panels[0].set_ylabel("J_pred [s]")
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=2)
