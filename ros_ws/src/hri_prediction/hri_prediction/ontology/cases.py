"""The twenty cases of interaction, by number, and the seven that they are reduced to.

The thesis' figure with the numbers is lost; they are rebuilt from its prose by what each case has: how
many action spaces are shared, onto how many of each agent's action spaces the other's motion goes, and
whether motions cross.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable
from dataclasses import dataclass

from hri_prediction.errors import ConfigError
from hri_prediction.ontology.graph import (
    ACTIONS,
    CROSSING,
    MOTION,
    SHARED,
    Edge,
    EdgeSet,
    canonical,
    check_feasible,
    classes,
)

Signature = tuple[int, tuple[int, int], bool]
"""Action spaces that are shared; of each agent those that are gone over, the more first; crossing."""

_NUMBERS: dict[Signature, int] = {
    (0, (0, 0), False): 1, (0, (1, 0), False): 2, (0, (0, 0), True): 3, (0, (2, 0), False): 4,
    (0, (1, 1), False): 5, (0, (1, 0), True): 6, (0, (2, 1), False): 7, (0, (2, 0), True): 8,
    (0, (1, 1), True): 9, (0, (2, 2), False): 10, (0, (2, 1), True): 11, (0, (2, 2), True): 12,
    (1, (0, 0), False): 13, (1, (0, 0), True): 14, (1, (1, 0), False): 15, (1, (1, 0), True): 16,
    (1, (1, 1), False): 17, (1, (1, 1), True): 18, (2, (0, 0), False): 19, (2, (0, 0), True): 20,
}  # fmt: skip

REDUCED = ((1,), (2,), (3,), (10, 12, 17, 18), (7, 11), (5, 6, 9, 13, 19), (4, 8, 14, 15, 16, 20))
"""The reduced ontology: cases that are told apart no more. A heuristic of the thesis (4.4.1)."""
GROUP_NAMES = (
    "free", "over one space", "crossing", "no freedom", "one freedom", "two freedoms, in line",
    "two freedoms, one over the other",
)  # fmt: skip
PREFIX = "case_"


@dataclass(frozen=True)
class Case:
    """A kind of interaction.

    Attributes:
        number: 1 to 20.
        edges: A set of edges that has it; the others are its images.
        shared: Action spaces that are shared.
        over: How many action spaces of one, and of the other agent are gone over, the more first.
        crossing: Whether motions cross.
    """

    number: int
    edges: EdgeSet
    shared: int
    over: tuple[int, int]
    crossing: bool

    @property
    def name(self) -> str:
        """As in files, topics and parameters: ``case_7``."""
        return f"{PREFIX}{self.number}"

    @property
    def group(self) -> int:
        """Number in the reduced ontology, 1 to 7."""
        return group_of(self.number)

    @property
    def description(self) -> str:
        """What goes on, in words."""
        spaces = {1: "an action space", 2: "both action spaces"}
        parts = []
        if self.shared:
            spoken = "one action space is" if self.shared == 1 else "both action spaces are"
            parts.append(f"{spoken} shared")
        more, less = self.over
        if more == less and more:
            parts.append(f"each reaches over {spaces[more]} of the other")
        elif more:
            parts.append(f"one reaches over {spaces[more]} of the other")
            if less:
                parts.append(f"who reaches back over {spaces[less]}")
        if self.crossing:
            parts.append("motions cross")
        return ", ".join(parts) if parts else "each for itself"


def signature_of(edges: Iterable[Edge]) -> Signature:
    """What decides about the number of a case."""
    chosen = frozenset(edges)
    onto = [
        sum(edge[agent] in ACTIONS and edge[1 - agent] == MOTION for edge in chosen)
        for agent in (0, 1)
    ]
    shared = sum(edge in SHARED for edge in chosen)
    return shared, (max(onto), min(onto)), CROSSING in chosen


@functools.cache
def cases() -> tuple[Case, ...]:
    """All twenty, in the order of their numbers."""
    found = {}
    for edges in classes():
        shared, over, crossing = signature = signature_of(edges)
        number = _NUMBERS[signature]
        found[number] = Case(number, canonical(edges), shared, over, crossing)
    return tuple(found[number] for number in sorted(found))


def case_of(edges: Iterable[Edge]) -> Case:
    """The case of a set of edges.

    Raises:
        DataError: when these edges cannot be.
    """
    number = _NUMBERS[signature_of(check_feasible(edges))]
    return cases()[number - 1]


def find_case(name: str | int) -> Case:
    """A case by its number or name.

    Raises:
        ConfigError: when there is none.
    """
    text = str(name).removeprefix(PREFIX)
    number = int(text) if text.isascii() and text.isdecimal() else 0
    if not 1 <= number <= len(_NUMBERS):
        raise ConfigError(f"case {name!r}", expected=f"1 to {len(_NUMBERS)}, or {PREFIX}1 …")
    return cases()[number - 1]


def group_of(number: int) -> int:
    """Number in the reduced ontology, 1 to 7, of a case from 1 to 20."""
    return next(index for index, group in enumerate(REDUCED, 1) if number in group)
