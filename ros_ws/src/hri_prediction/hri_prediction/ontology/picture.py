"""The cases as graphs, like figure 4.3 (a) of the thesis."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt

from hri_prediction.ontology.cases import GROUP_NAMES, Case, cases
from hri_prediction.ontology.graph import ACTIONS, FIRST, MOTION, SECOND, SHARED, EdgeSet

_COLOURS = ("#d9a400", "#2b6cb0")
_PLACES = {FIRST: 1.0, MOTION: 0.0, SECOND: -1.0}
_COLUMNS = 5
_WIDTH = 44
"""Letters of a title that fit above a case."""


def to_networkx(edges: EdgeSet) -> Any:
    """The graph of both agents: vertices as (agent, space), edges with ``kind`` E0 (own), E1, E2, E3."""
    import networkx as nx

    graph = nx.Graph()
    for agent in (1, 2):
        for space in ACTIONS:
            graph.add_edge((agent, space), (agent, MOTION), kind="E0")
    for first, second in edges:
        kind = "E3" if first == second == MOTION else "E1" if (first, second) in SHARED else "E2"
        graph.add_edge((1, first), (2, second), kind=kind)
    return graph


def _draw(case: Case, axes: plt.Axes) -> None:
    import networkx as nx

    graph = to_networkx(case.edges)
    places = {(agent, space): (agent, _PLACES[space]) for agent, space in graph}
    styles = {
        "E0": ("-", "#888888"),
        "E1": ("-", "black"),
        "E2": ("--", "black"),
        "E3": (":", "#c0392b"),
    }
    for kind, (style, colour) in styles.items():
        chosen = [(a, b) for a, b, k in graph.edges(data="kind") if k == kind]
        width = 1.0 if kind == "E0" else 2.0
        nx.draw_networkx_edges(
            graph, places, chosen, ax=axes, style=style, edge_color=colour, width=width
        )
    for agent in (1, 2):
        for shape, spaces in (("o", ACTIONS), ("s", (MOTION,))):
            nodes = [(agent, space) for space in spaces]
            nx.draw_networkx_nodes(
                graph, places, nodes, ax=axes, node_shape=shape, node_color=_COLOURS[agent - 1],
                node_size=180,
            )  # fmt: skip
    words = textwrap.fill(f"{case.number}: {case.description}", _WIDTH)
    axes.set_title(f"{words}\n({GROUP_NAMES[case.group - 1]})", fontsize=7)
    axes.margins(0.25)
    axes.set_axis_off()


def draw_cases(path: Path) -> None:
    """All twenty as a PNG.

    Round: action spaces; square: motion spaces; black: shared; dashed: gone over; dotted: motions cross.
    """
    rows = -(-len(cases()) // _COLUMNS)
    figure, grid = plt.subplots(rows, _COLUMNS, figsize=(14.0, 2.8 * rows), layout="constrained")
    for case, axes in zip(cases(), grid.flat, strict=True):
        _draw(case, axes)
    figure.suptitle(
        "The cases of interaction. Round: action spaces, square: motion spaces, of agent 1 (left) and 2. "
        "Black: shared, dashed: the motion of one over a space of the other, red: motions cross.",
        fontsize=9,
    )
    figure.savefig(path, dpi=110)
    plt.close(figure)
