"""All pictures of the report, with the rules that chose their scenes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hri_sim.benchmark.conditions import Condition
from hri_sim.reproduction import paths, postures, scenes, surfaces
from hri_sim.reproduction.bars import ITOMP, OURS
from hri_sim.reproduction.failures import worst_item
from hri_sim.reproduction.section import Measured

FOLDER = "ptomp"
"""Beside the report."""


def draw_all(
    folder: Path,
    grid: surfaces.Grid,
    costs: Mapping[str, Mapping[str, Any]],
    headline: Measured,
) -> dict[str, dict[str, str]]:
    """Draw them; file name and caption of each, by name.

    Args:
        folder: Where to.
        grid: Of the surfaces.
        costs: The surfaces.
        headline: Planners side by side, F = 1.
    """
    folder.mkdir(parents=True, exist_ok=True)
    seed, slowdown = headline.plan.seeds[0], headline.plan.slowdown
    found: dict[str, dict[str, str]] = {}

    def add(name: str, caption: str) -> Path:
        found[name] = {"file": f"{FOLDER}/{name}.png", "caption": caption}
        return folder / f"{name}.png"

    where = f"Scene {named(grid.scene)}: {scenes.FIRST_MOVING}. F = {surfaces.SLOWDOWN:g}."
    for kind, number in (("certain", "6.3"), ("uncertain", "6.5")):
        text = f"Costs over (TS, NT) where {surfaces.TITLES[kind]} (figure {number} of the thesis). {where}"
        surfaces.draw(grid, costs, kind, add(f"costs_{kind}", text))
    worst = surfaces.worst_cell(grid, costs["uncertain"])
    text = (
        f"Parameters {paths.GOOD} that the thesis finds good, {paths.POOR} with which its robot collides, "
        f"and the cell of the highest costs above, {worst}, with prediction (figure 6.4); seed {seed}, "
        "which need not be the one that made these costs high. "
        f"The robot is that of {paths.GOOD}; dotted: the three instants. {where}"
    )
    paths.draw_parameters(grid.scene, worst, seed, add("parameters", text))
    scene, rule = scenes.compared(headline)
    text = (
        f"`{OURS}` beside `{ITOMP}` (figure 6.6), both at the moment at which `{ITOMP}` is nearest to the "
        f"person; F = {slowdown:g}, seed {seed}. They differ in margin, time scaling and ways around too, "
        f"not in the prediction alone. Green ring: the robot's goal. Scene {named(scene)}: {rule}."
    )
    paths.draw_comparison(scene, slowdown, seed, add("comparison", text))
    pair = postures.find_pair(scenes.in_order(headline.plan), slowdown, seed)
    text = (
        "Final posture without and with the person (figure 6.7), whose arm is drawn as it is then; blue: "
        "the tool's path, green ring: its goal. "
        f"Scene {named(pair.scene)}: {pair.rule}."
    )
    postures.draw_postures(pair, add("postures", text))
    item, clearance = worst_item(headline)
    text = (
        f"The smallest clearance of all motions of `{OURS}` (F = 1), {1e3 * clearance:.0f} mm: scene "
        f"{named(item.find())}, seed {item.seed}, beside the nominal motion."
    )
    paths.draw_worst(item, "Clearance over time", add("worst", text))
    return found


def named(scene: Condition) -> str:
    """A condition as a reader finds it again."""
    return f"task {scene.task.number}, condition {scene.number}"


def lines(pictures: Mapping[str, Mapping[str, str]]) -> list[str]:
    """Pictures with captions."""
    return [
        f"![{name}]({found['file']})\n\n{found['caption']}\n" for name, found in pictures.items()
    ]
