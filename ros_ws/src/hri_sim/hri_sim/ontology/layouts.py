"""Where two people and their action spaces are in each case of interaction, so that it is what happens.

Whether an edge is there is measured on the arms of both, as they go from one action space to the other and
give way to nobody:

- an action space is shared when both have it;
- a motion goes over an action space when forearm or hand do, seen from above;
- motions cross when forearms or hands come to the same place while both are on their way.

Between "is there" and "is not there" is room, where an edge is neither: when people sit a little otherwise,
edges of a case seldom become those of another one, but often neither (the report on jitter counts both).
Layouts are found by minimising what the edges lack, from random beginnings, or from another
layout, so that cases of a group of the reduced ontology look as alike as their edges allow.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hri_prediction.compiled import njit
from hri_prediction.errors import ConfigError
from hri_prediction.geometry.segments import segment_distance
from hri_prediction.ontology.cases import Case
from hri_prediction.ontology.graph import (
    CROSSING,
    FIRST,
    MOTION,
    OVER,
    SECOND,
    SHARED,
    Edge,
    EdgeSet,
    images,
)
from hri_sim.dyads.arms import SeatedArm
from hri_sim.dyads.setups import DyadSetup

FloatArray = NDArray[np.float64]

POSITIONS = {"frontal": math.pi, "orthogonal": 0.5 * math.pi, "same side": 0.0}
"""Where agent 2 sits, seen from the middle of the table: angle from agent 1's seat [rad]."""

SPACES = (FIRST, SECOND)
LIFT = 0.16
"""Height of paths as a share of their length, as people on the average have it."""
THERE_M = {"over": 0.04, "cross": 0.05}
"""An edge is there when forearm or hand come so near."""
NOT_THERE_M = {"over": 0.10, "cross": 0.10, "shared": 0.12}
"""It is not there when they stay so far away."""

_SEAT_M = 0.55
_SHOULDER_M = (0.18, 0.36)  # aside of the middle of the seat, and above the table
_SPREAD_RAD = 0.5
_HEIGHT_M = 0.05
_REACH_M = (0.25, 0.66)
_WAY_M = (0.22, 0.55)
_BOW_M = 0.22
_SHARE = np.linspace(0.0, 1.0, 15)
_MIDDLE = (_SHARE >= 0.35) & (_SHARE <= 0.65)
"""Of the time of a motion: while it is on its way."""
_STARTS, _NEAR_STARTS, _STEPS = 60, 12, 1500


@dataclass(frozen=True, eq=False)
class Layout:
    """Two people and their action spaces.

    Attributes:
        position: One of :data:`POSITIONS`.
        yaw: How far both are turned from looking along -x (2,) [rad].
        shoulders: Right shoulders (2, 3) [m], the middle of the table top at the origin, z up.
        spaces: Action spaces of both (2, 2, 3) [m].
        bow: How far the middle of each motion is aside of the straight line (2, 3) [m].
        edges: That are there.
    """

    position: str
    yaw: FloatArray
    shoulders: FloatArray
    spaces: FloatArray
    bow: FloatArray
    edges: EdgeSet = frozenset()

    def setup(self, name: str) -> DyadSetup:
        """The same for those who move hands."""
        return DyadSetup(name, self.position, self.yaw, self.shoulders, self.spaces, self.bow)


def seats(position: str) -> tuple[FloatArray, FloatArray]:
    """Yaw (2,) [rad] and right shoulders (2, 3) [m] of two people.

    Raises:
        ConfigError: when there is no such position.
    """
    if position not in POSITIONS:
        raise ConfigError(f"position {position!r}", expected="one of " + ", ".join(POSITIONS))
    angles = np.array((0.0, POSITIONS[position]))
    if position == "same side":
        angles += (-_SPREAD_RAD, _SPREAD_RAD)
    outward = np.stack((-np.sin(angles), -np.cos(angles), np.zeros(2)), axis=1)
    right = np.stack((np.cos(angles), -np.sin(angles), np.zeros(2)), axis=1)
    aside, above = _SHOULDER_M
    shoulders = _SEAT_M * outward + aside * right + above * np.array((0.0, 0.0, 1.0))
    return np.arctan2(outward[:, 1], outward[:, 0]), shoulders


def undisturbed(layout: Layout) -> FloatArray:
    """Keypoints of both on the way from the first to the second action space (2, n, 4, 3) [m]."""
    gone = (10.0 * _SHARE**3 - 15.0 * _SHARE**4 + 6.0 * _SHARE**5)[:, None]
    bump = (64.0 * (_SHARE * (1.0 - _SHARE)) ** 3)[:, None]
    found = []
    for agent in range(2):
        begin, end = layout.spaces[agent]
        lift = LIFT * np.linalg.norm(end - begin) * np.array((0.0, 0.0, 1.0))
        hands = begin + gone * (end - begin) + bump * (lift + layout.bow[agent])
        arm = SeatedArm(layout.shoulders[agent], np.full(len(hands), layout.yaw[agent]))
        found.append(arm.keypoints(hands))
    return np.array(found)


@njit
def _nearest_over(arms: FloatArray, place: FloatArray) -> float:
    """Smallest distance of forearms and hands (n, 4, 3) to a place (3,), seen from above [m]."""
    nearest = math.inf
    begin, end, point = np.zeros(3), np.zeros(3), np.zeros(3)
    point[:2] = place[:2]
    for row in range(arms.shape[0]):
        for limb in range(1, 3):
            begin[:2], end[:2] = arms[row, limb, :2], arms[row, limb + 1, :2]
            nearest = min(nearest, segment_distance(begin, end, point, point))
    return nearest


@njit
def _nearest_each_other(first: FloatArray, second: FloatArray) -> float:
    """Smallest distance of forearms and hands (n, 4, 3), whenever either is there [m]."""
    nearest = math.inf
    for row in range(first.shape[0]):
        for other in range(second.shape[0]):
            for i in range(1, 3):
                for j in range(1, 3):
                    nearest = min(
                        nearest,
                        segment_distance(
                            first[row, i], first[row, i + 1], second[other, j], second[other, j + 1]
                        ),
                    )
    return nearest


def edge_distances(layout: Layout) -> dict[Edge, float]:
    """How far each edge is from being there [m]: of spaces, of motions to spaces, of motions."""
    arms = undisturbed(layout)
    found: dict[Edge, float] = {}
    for edge in SHARED:
        one, other = (SPACES.index(vertex) for vertex in edge)
        found[edge] = float(np.linalg.norm(layout.spaces[0, one] - layout.spaces[1, other]))
    for edge in OVER:
        owner = 0 if edge[0] != MOTION else 1
        space = layout.spaces[owner, SPACES.index(edge[owner])]
        found[edge] = float(_nearest_over(arms[1 - owner], np.ascontiguousarray(space)))
    found[CROSSING] = float(_nearest_each_other(arms[0, _MIDDLE], arms[1, _MIDDLE]))
    return found


def _kind(edge: Edge) -> str:
    return "cross" if edge == CROSSING else "over" if edge in OVER else "shared"


def _bound(edge: Edge, edges: EdgeSet) -> tuple[float, bool] | None:
    """Bound of an edge's distance [m] and whether it is an upper one; none: it follows from others."""
    kind = _kind(edge)
    if kind == "over":
        owner = 0 if edge[0] != MOTION else 1
        # Where a space is shared the other goes to it, and so over it: that is no edge of its own.
        if any(shared in edges and shared[owner] == edge[owner] for shared in SHARED):
            return None
    if edge in edges:
        return None if kind == "shared" else (THERE_M[kind], True)
    return NOT_THERE_M[kind], False


def measured_edges(layout: Layout) -> EdgeSet | None:
    """The edges that are there; none when one is neither there nor not."""
    distances = edge_distances(layout)
    edges = frozenset(e for e in SHARED if distances[e] < 1e-6)
    for edge in (*SHARED, *OVER, CROSSING):
        bound = _bound(edge, edges)
        if bound is None:
            continue
        if _kind(edge) != "shared" and distances[edge] <= THERE_M[_kind(edge)]:
            edges |= {edge}
        elif distances[edge] < NOT_THERE_M[_kind(edge)]:
            return None
    return edges


def _lack(layout: Layout, edges: EdgeSet) -> float:
    """What a layout lacks of a set of edges, of reach and of room; 0: nothing."""
    total = 0.0
    for edge, distance in edge_distances(layout).items():
        bound = _bound(edge, edges)
        if bound is not None:
            over = distance - bound[0] if bound[1] else bound[0] - distance
            total += max(over + 0.003, 0.0)
    for agent in range(2):
        apart = np.linalg.norm((layout.spaces[agent] - layout.shoulders[agent])[:, :2], axis=1)
        way = float(np.linalg.norm(layout.spaces[agent, 1] - layout.spaces[agent, 0]))
        for value, (low, high) in ((apart[0], _REACH_M), (apart[1], _REACH_M), (way, _WAY_M)):
            total += max(low - value, value - high, 0.0)
        out, up = np.linalg.norm(layout.bow[agent, :2]), layout.bow[agent, 2]
        total += float(max(out - _BOW_M, up - _BOW_M, -up, 0.0))
        # Nobody reaches behind the own shoulder.
        ahead = -np.array((math.cos(layout.yaw[agent]), math.sin(layout.yaw[agent])))
        forth = (layout.spaces[agent] - layout.shoulders[agent])[:, :2] @ ahead
        total += float(np.maximum(0.15 - forth, 0.0).sum())
    return total


def shared_by_turns(edges: EdgeSet, like: EdgeSet = frozenset()) -> EdgeSet:
    """An image of the edges in which nobody begins where the other begins: spaces shared crosswise.

    Args:
        edges: Of the case.
        like: Edges that it is to have in common with, as many as may be.
    """
    alike = {(FIRST, FIRST), (SECOND, SECOND)}
    fit = [image for image in images(edges) if not image & alike]
    return min(fit, key=lambda image: (len(image ^ like), sorted(image)))


def _decoded(values: FloatArray, base: Layout, edges: EdgeSet) -> Layout:
    spaces = np.full((2, 2, 3), _HEIGHT_M)
    spaces[..., :2] = values[:8].reshape(2, 2, 2)
    for one, other in itertools.product(SPACES, SPACES):
        if (one, other) in edges:
            spaces[1, SPACES.index(other)] = spaces[0, SPACES.index(one)]
    bow = np.zeros((2, 3))
    for agent in range(2):
        way = (spaces[agent, 1] - spaces[agent, 0])[:2]
        across = np.array((-way[1], way[0])) / max(float(np.linalg.norm(way)), 1e-6)
        bow[agent, :2] = values[8 + 2 * agent] * across
        bow[agent, 2] = abs(values[9 + 2 * agent])
    return replace(base, spaces=spaces, bow=bow, edges=edges)


def _encoded(layout: Layout) -> FloatArray:
    values = np.empty(12)
    values[:8] = layout.spaces[..., :2].ravel()
    for agent in range(2):
        way = (layout.spaces[agent, 1] - layout.spaces[agent, 0])[:2]
        across = np.array((-way[1], way[0])) / max(float(np.linalg.norm(way)), 1e-6)
        values[8 + 2 * agent] = layout.bow[agent, :2] @ across
        values[9 + 2 * agent] = layout.bow[agent, 2]
    return values


def _anywhere(shoulders: FloatArray, rng: np.random.Generator) -> FloatArray:
    values = np.empty(12)
    for agent in range(2):
        spots = 0.5 * shoulders[agent, :2] + rng.normal(0.0, 0.2, (2, 2))
        values[4 * agent : 4 * agent + 4] = spots.ravel()
    values[8:] = rng.normal(0.0, 0.08, 4)
    return values


def find_layout(
    case: Case, position: str, rng: np.random.Generator, near: Layout | None = None
) -> Layout:
    """A layout whose edges are those of a case.

    Args:
        case: Which.
        position: How the two sit, one of :data:`POSITIONS`.
        rng: Draws where the search begins.
        near: A layout of another case in this position, from which the search begins.

    Raises:
        ConfigError: when there is no such position, or no layout was found.
    """
    yaw, shoulders = seats(position)
    # Here, as it takes a while to load, and the places that ship are read, not searched for.
    from scipy.optimize import minimize

    edges = shared_by_turns(case.edges, near.edges if near else frozenset())
    base = Layout(position, yaw, shoulders, np.zeros((2, 2, 3)), np.zeros((2, 3)))

    def lack(values: FloatArray) -> float:
        return _lack(_decoded(values, base, edges), edges)

    for start in range(_STARTS):
        if near is not None and start < _NEAR_STARTS:
            begin = _encoded(near) + rng.normal(0.0, 0.02 * (1 + start), 12)
        else:
            begin = _anywhere(shoulders, rng)
        simplex = np.concatenate((begin[None], begin + 0.08 * np.diag(rng.choice((-1.0, 1.0), 12))))
        found = minimize(
            lack,
            begin,
            method="Nelder-Mead",
            options={
                "initial_simplex": simplex,
                "maxfev": _STEPS,
                "adaptive": True,
                "xatol": 1e-4,
                "fatol": 1e-5,
            },
            callback=_until_nothing_lacks,
        )
        layout = _decoded(found.x, base, edges)
        if found.fun <= 0.0 and measured_edges(layout) == edges:
            return layout
    raise ConfigError(f"no layout of {case.name} was found for people who sit {position}")


def _until_nothing_lacks(intermediate_result: object) -> None:
    if getattr(intermediate_result, "fun", 1.0) <= 0.0:
        raise StopIteration
