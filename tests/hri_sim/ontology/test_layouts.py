"""Layouts in which a case is what happens."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hri_prediction.errors import ConfigError, DataError
from hri_prediction.ontology.cases import REDUCED, case_of, cases, find_case
from hri_sim.ontology.layout_file import SHIPPED_LAYOUTS, load_layouts, save_layouts
from hri_sim.ontology.layouts import (
    POSITIONS,
    THERE_M,
    edge_distances,
    find_layout,
    measured_edges,
    seats,
    undisturbed,
)
from hri_sim.ontology.layouts_command import find_group
from hri_sim.ontology.pictures import draw_layouts
from hri_sim.ontology.sessions import layout_of

CROSSED = {
    "edges": [["M", "M"]],
    "spaces_m": np.zeros((2, 2, 3)).tolist(),
    "bow_m": np.zeros((2, 3)).tolist(),
}
"""A layout of case 3."""
EVERY = [(case.number, position) for case in cases() for position in POSITIONS]


@pytest.mark.parametrize(("number", "position"), EVERY)
def test_every_case_is_laid_out_in_every_position(number: int, position: str) -> None:
    layout = layout_of(number, position)
    edges = measured_edges(layout)
    assert edges is not None
    assert edges == layout.edges
    assert case_of(edges).number == number


def test_hands_are_where_they_are_to_be_and_arms_are_whole() -> None:
    layout = layout_of(4, "frontal")
    arms = undisturbed(layout)
    for agent in range(2):
        np.testing.assert_allclose(arms[agent, [0, -1], 3], layout.spaces[agent], atol=1e-9)
    lengths = np.linalg.norm(np.diff(arms, axis=2), axis=-1)
    np.testing.assert_allclose(
        lengths, np.broadcast_to((0.29, 0.26, 0.09), lengths.shape), atol=1e-9
    )


def test_nobody_begins_where_the_other_begins() -> None:
    for case in cases():
        spaces = layout_of(case.number, "frontal").spaces
        assert np.linalg.norm(spaces[0, 0] - spaces[1, 0]) > 0.1
        assert np.linalg.norm(spaces[0, 1] - spaces[1, 1]) > 0.1


def test_an_edge_that_is_half_there_is_no_edge() -> None:
    layout = layout_of(2, "frontal")
    over = [
        e for e, d in edge_distances(layout).items() if d <= THERE_M["over"] and e in layout.edges
    ]
    assert len(over) == 1
    # Moved aside by half of the room between there and not there.
    spaces = layout.spaces.copy()
    found = set()
    for shift in np.linspace(0.0, 0.3, 31):
        moved = spaces.copy()
        moved[:, :, 1] += shift * np.array([[1.0], [-1.0]])
        found.add(measured_edges(replace(layout, spaces=moved)))
    assert None in found


def test_groups_look_alike() -> None:
    def apart(one: int, other: int) -> float:
        first, second = (layout_of(number, "orthogonal").spaces for number in (one, other))
        return float(np.linalg.norm(first - second, axis=-1).mean())

    within = np.mean([apart(group[0], number) for group in REDUCED for number in group[1:]])
    across = np.mean([apart(a[0], b[0]) for a in REDUCED for b in REDUCED if a != b])
    assert within < 0.5 * across


def test_the_same_generator_gives_the_same_layout() -> None:
    one, other = (find_layout(find_case(3), "frontal", np.random.default_rng(4)) for _ in range(2))
    np.testing.assert_array_equal(one.spaces, other.spaces)


def test_people_sit_where_they_are_said_to() -> None:
    yaw, shoulders = seats("frontal")
    assert abs(np.cos(yaw[0] - yaw[1])) == pytest.approx(1.0)
    assert np.linalg.norm(shoulders[0] - shoulders[1]) > 1.0
    yaw, _ = seats("orthogonal")
    assert np.cos(yaw[0] - yaw[1]) == pytest.approx(0.0, abs=1e-12)
    with pytest.raises(ConfigError, match="frontal, orthogonal, same side"):
        seats("above")


def test_they_are_drawn(tmp_path: Path) -> None:
    draw_layouts(tmp_path / "l.png", {"1": layout_of(1, "frontal"), "20": layout_of(20, "frontal")})
    assert (tmp_path / "l.png").stat().st_size > 10_000


def test_what_ships_is_kept_whole(tmp_path: Path) -> None:
    shipped = load_layouts()
    assert sorted(shipped) == sorted(EVERY)
    save_layouts(tmp_path / "l.json", shipped)
    for key, one in load_layouts(tmp_path / "l.json").items():
        for name in ("yaw", "shoulders", "spaces", "bow"):
            np.testing.assert_array_equal(getattr(one, name), getattr(shipped[key], name))
        assert one.edges == shipped[key].edges


def test_the_search_begins_a_group_from_its_first_case() -> None:
    found = find_group(((13, 19), "frontal"))
    assert list(found) == [(13, "frontal"), (19, "frontal")]
    for (number, _), layout in found.items():
        edges = measured_edges(layout)
        assert edges is not None
        assert case_of(edges).number == number


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"format": "other"}, "no file of layouts"),
        ({"cases": {"case_1": {"frontal": {}}}}, "incomplete"),
        ({"cases": {"case_1": {"frontal": CROSSED}}}, "l.json: edges of case_3"),
        ({"cases": {"case_99": {"frontal": {}}}}, "1 to 20"),
        (
            {"cases": {"case_1": {"frontal": {"edges": [], "spaces_m": [[0]], "bow_m": [0]}}}},
            "instead of",
        ),
    ],
)
def test_other_files_are_refused(tmp_path: Path, change: dict[str, object], said: str) -> None:
    content = json.loads(SHIPPED_LAYOUTS.read_text()) | change
    (tmp_path / "l.json").write_text(json.dumps(content))
    with pytest.raises(DataError, match=said):
        load_layouts(tmp_path / "l.json")
    with pytest.raises(ConfigError, match="frontal, orthogonal, same side"):
        layout_of(1, "above")
