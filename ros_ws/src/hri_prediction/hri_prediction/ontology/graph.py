"""The interaction graph of two agents, and which sets of its edges are one and the same case.

Each agent has two action spaces, where the hand does something, and one motion space, through which it
goes from one to the other. An interaction is an edge between two of these, one of each agent (thesis, 4.3):

- E1: an action space that both share (4 edges);
- E2: the motion of one goes over an action space of the other (4 edges);
- E3: motions cross (1 edge).

The thesis prints 513 sets of edges: its sum for 1 to 8 edges is 510, and none and all nine make 512.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable

from hri_prediction.errors import DataError

FIRST, SECOND, MOTION = "A1", "A2", "M"
VERTICES = (FIRST, SECOND, MOTION)
"""Of an agent: two action spaces and the motion space between them."""
ACTIONS = (FIRST, SECOND)

Edge = tuple[str, str]
"""A vertex of agent 1 and one of agent 2."""
EdgeSet = frozenset[Edge]

EDGES: tuple[Edge, ...] = tuple(itertools.product(VERTICES, VERTICES))
SHARED = tuple(edge for edge in EDGES if MOTION not in edge)
"""E1: action spaces that are one."""
OVER = tuple(edge for edge in EDGES if (MOTION in edge) and edge != (MOTION, MOTION))
"""E2: the motion of one over an action space of the other."""
CROSSING: Edge = (MOTION, MOTION)
"""E3."""


def all_sets() -> list[EdgeSet]:
    """Every set of edges: 2⁹ = 512."""
    return [
        frozenset(chosen)
        for count in range(len(EDGES) + 1)
        for chosen in itertools.combinations(EDGES, count)
    ]


def why_infeasible(edges: Iterable[Edge]) -> str:
    """Why a set of edges cannot be; empty where it can."""
    chosen = frozenset(edges)
    for agent, space in itertools.product((0, 1), ACTIONS):
        at_space = [edge for edge in chosen if edge[agent] == space]
        shared = sum(edge in SHARED for edge in at_space)
        if shared > 1:
            return f"{space} of agent {agent + 1} is shared with both action spaces of the other"
        if shared and len(at_space) > shared:
            return f"{space} of agent {agent + 1} is shared, and the other's motion goes over it"
    return ""


def feasible_sets() -> list[EdgeSet]:
    """The sets of edges that can be: 68."""
    return [edges for edges in all_sets() if not why_infeasible(edges)]


def images(edges: Iterable[Edge]) -> set[EdgeSet]:
    """What a set of edges becomes when an agent's action spaces, or the agents, change places: up to 8."""
    exchange = {FIRST: SECOND, SECOND: FIRST, MOTION: MOTION}
    same = {vertex: vertex for vertex in VERTICES}
    found = set()
    for one, other in itertools.product((same, exchange), repeat=2):
        image = frozenset((one[first], other[second]) for first, second in edges)
        found |= {image, frozenset((second, first) for first, second in image)}
    return found


def canonical(edges: Iterable[Edge]) -> EdgeSet:
    """One of the images, the same for all of them."""
    return min(images(edges), key=sorted)


def classes() -> list[EdgeSet]:
    """One feasible set of edges of each class: 20."""
    return sorted(
        {canonical(edges) for edges in feasible_sets()}, key=lambda e: (len(e), sorted(e))
    )


def check_feasible(edges: Iterable[Edge]) -> EdgeSet:
    """The edges, if they can be.

    Raises:
        DataError: naming what is no edge, or why they cannot be.
    """
    chosen = frozenset(edges)
    for edge in chosen:
        if edge not in EDGES:
            raise DataError(f"edge {edge!r}", expected="two of " + ", ".join(VERTICES))
    if reason := why_infeasible(chosen):
        raise DataError(f"these edges cannot be: {reason}")
    return chosen
