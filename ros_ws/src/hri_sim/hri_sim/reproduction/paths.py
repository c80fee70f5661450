"""Pictures of motions: good beside poor parameters, ours beside the opponent, the worst of all."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from hri_sim.benchmark.conditions import Condition
from hri_sim.benchmark.planners import PLANNERS, PlannerSetup
from hri_sim.media.look import BLUE, GREEN, PURPLE, VERMILION, Colour
from hri_sim.reproduction import surfaces
from hri_sim.reproduction.bars import ITOMP, OURS
from hri_sim.reproduction.closer import Item
from hri_sim.reproduction.drawing import Trace, draw_clearances, draw_scene, drawn

GOOD = (42, 30)
"""(TS, NT) that the thesis finds for its scene."""
POOR = (55, 50)
"""(TS, NT) with which its robot collides."""
INSTANTS = (0.25, 0.5, 0.75)
"""Shares of the person's reach that are shown."""


def trace(
    scene: Condition,
    setup: PlannerSetup,
    slowdown: float,
    seed: int,
    label: str,
    colour: Colour,
    style: str = "-",
) -> Trace:
    """The motion of a planner in a scene."""
    item = Item(setup, scene.task.split, scene.task.number, scene.number, slowdown, seed)
    return Trace(label, colour, item.watch()[0], style)


def draw_parameters(scene: Condition, worst: tuple[int, int], seed: int, path: Path) -> None:
    """The motions of good and poor parameters, and of the worst of the grid, beside the person's."""
    chosen = (
        (GOOD, "good in the thesis", GREEN, "-"),
        (POOR, "poor there", VERMILION, "--"),
        (worst, "highest cost of the grid", PURPLE, ":"),
    )
    traces = []
    for (time_steps, rollouts), words, colour, style in chosen:
        setup = surfaces.with_parameters(time_steps, rollouts, surfaces.OBSERVERS["uncertain"])
        label = f"(TS, NT) = ({time_steps}, {rollouts}), {words}"
        traces.append(trace(scene, setup, surfaces.SLOWDOWN, seed, label, colour, style))
    reach = scene.scenario.reaches[0]
    instants = [reach.person_delay + share * reach.person_duration for share in INSTANTS]
    with drawn(path, 11.0, 6.2) as figure:
        grid = figure.add_gridspec(2, len(instants), height_ratios=(1.6, 1.0))
        for number, (time_s, share) in enumerate(zip(instants, INSTANTS, strict=True)):
            axes = figure.add_subplot(grid[0, number])
            draw_scene(axes, scene, traces[0], time_s, traces)
            axes.set_title(f"t = {time_s:.2f} s, {100.0 * share:.0f} % of the reach")
        below = figure.add_subplot(grid[1, :])
        draw_clearances(below, scene, traces, instants)
        figure.legend(loc="outside lower center", ncols=4)


def draw_comparison(scene: Condition, slowdown: float, seed: int, path: Path) -> None:
    """Ours and the opponent at the moment at which the opponent is nearest to the person."""
    ours = trace(scene, PLANNERS[OURS], slowdown, seed, f"{OURS} (learnt prediction)", BLUE)
    theirs = trace(
        scene, PLANNERS[ITOMP], slowdown, seed, f"{ITOMP} (prediction by velocity)", VERMILION, "--"
    )
    time_s = theirs.closest_s()
    with drawn(path, 11.0, 7.4) as figure:
        grid = figure.add_gridspec(2, 2, height_ratios=(2.0, 1.0))
        for number, shown in enumerate((ours, theirs)):
            axes = figure.add_subplot(grid[0, number])
            # Their own path is drawn last: it is the one that matters in a panel.
            draw_scene(axes, scene, shown, time_s, (ours, theirs))
            axes.set_title(f"{shown.label}, t = {time_s:.2f} s")
        draw_clearances(figure.add_subplot(grid[1, :]), scene, (ours, theirs), (time_s,))
        figure.legend(loc="outside lower center", ncols=3)


def draw_worst(item: Item, words: str, path: Path) -> None:
    """The motion of an item at its closest moment, and its clearance over time."""
    scene = item.find()
    label = f"{item.setup.name}, seed {item.seed}"
    shown = trace(scene, item.setup, item.slowdown, item.seed, label, BLUE)
    nominal = replace(item, setup=PLANNERS["nominal"])
    plain = Trace("nominal", VERMILION, nominal.watch()[0], "--")
    time_s = shown.closest_s()
    with drawn(path, 11.0, 4.6) as figure:
        left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.15))
        draw_scene(left, scene, shown, time_s, (shown, plain))
        left.set_title(f"Task {item.task}, condition {item.condition}, t = {time_s:.2f} s")
        draw_clearances(right, scene, (shown, plain), (time_s,))
        right.set_title(words)
        figure.legend(loc="outside lower center", ncols=3)
