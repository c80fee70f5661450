"""The interaction graph: how many sets of edges there are, which can be, and which are the same."""

from __future__ import annotations

import itertools
from pathlib import Path

import networkx as nx
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hri_prediction.errors import ConfigError, DataError
from hri_prediction.ontology.cases import REDUCED, case_of, cases, find_case, group_of
from hri_prediction.ontology.graph import (
    CROSSING,
    EDGES,
    OVER,
    SHARED,
    all_sets,
    canonical,
    classes,
    feasible_sets,
    images,
    why_infeasible,
)
from hri_prediction.ontology.picture import draw_cases, to_networkx

SETS = st.frozensets(st.sampled_from(EDGES))


def test_512_68_20_7() -> None:
    assert (len(SHARED), len(OVER), len(EDGES)) == (4, 4, 9)
    assert len(set(all_sets())) == 512
    assert len(feasible_sets()) == 68
    assert len(classes()) == len(cases()) == 20
    assert len(REDUCED) == 7
    assert sorted(itertools.chain(*REDUCED)) == list(range(1, 21))


def test_the_classes_part_the_feasible_sets() -> None:
    orbits = [images(edges) for edges in classes()]
    assert sum(map(len, orbits)) == 68
    assert frozenset().union(*orbits) == frozenset(feasible_sets())


def _same(one: nx.Graph, other: nx.Graph) -> bool:
    """Whether graphs are isomorphic, spaces of the same kind onto each other (VF2)."""
    for graph in (one, other):
        for _, data in graph.nodes(data=True):
            data.clear()
        for node in graph:
            graph.nodes[node]["kind"] = "M" if node[1] == "M" else "A"
    return bool(
        nx.is_isomorphic(
            one,
            other,
            node_match=lambda a, b: a == b,
            edge_match=lambda a, b: a["kind"] == b["kind"],
        )
    )


def test_the_classes_are_those_of_an_independent_search_for_isomorphisms() -> None:
    found: list[nx.Graph] = []
    for edges in feasible_sets():
        graph = to_networkx(edges)
        if not any(_same(graph, other) for other in found):
            found.append(graph)
    assert len(found) == 20
    for one, other in itertools.combinations(cases(), 2):
        assert not _same(to_networkx(one.edges), to_networkx(other.edges))


@given(SETS)
def test_symmetry_changes_neither_feasibility_nor_class(edges: frozenset[tuple[str, str]]) -> None:
    reasons = {bool(why_infeasible(image)) for image in images(edges)}
    assert len(reasons) == 1
    assert {canonical(image) for image in images(edges)} == {canonical(edges)}
    assert edges in images(canonical(edges))
    if not reasons.pop():
        assert len({case_of(image).number for image in images(edges)}) == 1


def test_numbers_are_those_of_the_prose() -> None:
    shared, over, crossing = ("A1", "A1"), ("A2", "M"), CROSSING
    assert case_of([]).number == 1
    assert case_of([over]).number == 2
    assert case_of([crossing]).number == 3
    assert case_of([("A1", "M"), ("A2", "M")]).number == 4
    assert case_of([("A1", "M"), ("M", "A2")]).number == 5
    assert case_of(OVER).number == 10
    assert case_of([*OVER, crossing]).number == 12
    assert case_of([shared]).number == 13
    assert case_of([shared, over, crossing]).number == 16
    assert case_of([shared, ("A2", "A2"), crossing]).number == 20
    assert [case.number for case in cases()] == list(range(1, 21))
    assert len({case.description for case in cases()}) == 20


@pytest.mark.parametrize(
    ("edges", "said"),
    [
        ([("A1", "A1"), ("A1", "A2")], "shared with both"),
        ([("A1", "A1"), ("A1", "M")], "goes over it"),
        ([("A1", "A3")], "expected two of A1, A2, M"),
    ],
)
def test_what_cannot_be_is_refused_with_the_reason(edges: list[tuple[str, str]], said: str) -> None:
    with pytest.raises(DataError, match=said):
        case_of(edges)


@pytest.mark.parametrize("name", ["case_7", "7", 7])
def test_cases_are_found_by_name_and_number(name: str | int) -> None:
    assert find_case(name).number == 7
    assert find_case(name).name == "case_7"


@pytest.mark.parametrize("name", ["case_0", "21", "seven", "", "²", -1])
def test_other_names_are_refused(name: str | int) -> None:
    with pytest.raises(ConfigError, match="1 to 20"):
        find_case(name)


def test_groups() -> None:
    assert [group_of(number) for number in (1, 2, 3, 18, 11, 19, 4)] == [1, 2, 3, 4, 5, 6, 7]
    assert find_case(12).group == 4


def test_all_cases_are_drawn(tmp_path: Path) -> None:
    draw_cases(tmp_path / "cases.png")
    assert (tmp_path / "cases.png").read_bytes()[:4] == b"\x89PNG"
