"""Boxes stop the tool before their margin; people come first."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from hri_planner.policy.separation import (
    NO_BOXES,
    NOWHERE,
    Places,
    SeparationConfig,
    keep_separation,
)

CONFIG = SeparationConfig()
DT, MARGIN = 0.004, 0.08
CENTRE, HALF = np.array((0.5, 0.1, 0.2)), np.array((0.1, 0.2, 0.05))
BOX = np.array([(CENTRE, HALF)])
REST = np.zeros(3)


def gap(place: np.ndarray, boxes: np.ndarray = BOX) -> float:
    """Distance from the surface of the nearest box; 0 inside."""
    off = np.maximum(np.abs(place - boxes[:, 0]) - boxes[:, 1], 0.0)
    return float(np.linalg.norm(off, axis=1).min())


def kept(wanted, place, speed, boxes=BOX, people=NOWHERE, floor=None, margin=MARGIN):
    return keep_separation(
        np.array(wanted, dtype=float), place, speed, people, DT, CONFIG, floor=floor, boxes=boxes,
        margin=margin,
    )  # fmt: skip


def driven(
    place: np.ndarray, speed: np.ndarray, aim: np.ndarray, steps: int = 500, *, boxes=BOX
) -> np.ndarray:
    """Way of a tool that wants somewhere, come what may."""
    path = [place]
    for _ in range(steps):
        told = kept(30.0 * (aim - place) - 3.0 * speed, place, speed, boxes).acceleration
        assert np.linalg.norm(told) <= CONFIG.hand_acceleration * (1.0 + 1e-9)
        place = place + speed * DT + 0.5 * told * DT**2
        speed = speed + told * DT
        path.append(place)
    return np.array(path)


@pytest.mark.parametrize("seed", range(30))
def test_a_tool_that_wants_into_a_box_stops_before_its_margin(seed: int) -> None:
    rng = np.random.default_rng(seed)
    out = rng.standard_normal(3)
    place = CENTRE + 0.7 * out / np.linalg.norm(out)
    aim = CENTRE + rng.uniform(-0.5, 0.5, 3) * HALF
    way = (aim - place) / np.linalg.norm(aim - place)
    path = driven(place, 1.0 * way, aim)
    gaps = [gap(at) for at in path]
    assert min(gaps) >= MARGIN - 1e-6
    assert gaps[-1] < MARGIN + 0.01, "it comes as near as it may"


def test_a_tool_passes_between_and_along_boxes_without_touching() -> None:
    boxes = np.array(
        [BOX[0], ((0.5, 0.62, 0.2), (0.1, 0.1, 0.1)), ((0.5, 0.3, 0.6), (0.2, 0.3, 0.1))]
    )
    rng = np.random.default_rng(1)
    for _ in range(10):
        place = np.array((0.1, 0.4, 0.3)) + rng.uniform(-0.1, 0.1, 3)
        aim = np.array((0.9, 0.4, 0.3)) + rng.uniform(-0.1, 0.1, 3)
        path = driven(place, REST, aim, 700, boxes=boxes)
        assert min(gap(at, boxes) for at in path) >= MARGIN - 1e-6


@pytest.mark.parametrize("face", range(6))
def test_what_is_inside_is_pushed_out_by_the_nearest_face(face: int) -> None:
    axis, side = face % 3, 1.0 if face < 3 else -1.0
    place = CENTRE.copy()
    place[axis] += side * (HALF[axis] - 0.01)
    told = kept(REST, place, REST)
    wanted = np.zeros(3)
    wanted[axis] = side * CONFIG.hand_acceleration
    assert told.changed
    np.testing.assert_allclose(told.acceleration, wanted, atol=1e-6)
    path = driven(place, REST, CENTRE, 400)
    assert gap(path[-1]) >= MARGIN - 1e-3


@pytest.mark.parametrize("seed", range(10))
def test_from_anywhere_inside_the_tool_gets_out(seed: int) -> None:
    rng = np.random.default_rng(seed)
    place = CENTRE + rng.uniform(-1.0, 1.0, 3) * (HALF + 0.05)
    path = driven(place, rng.uniform(-0.3, 0.3, 3), CENTRE, 500)
    assert np.isfinite(path).all()
    outside = np.array([gap(at) for at in path]) >= MARGIN - 1e-3
    assert outside[-1]
    assert outside[int(np.argmax(outside)) :].all(), "and stays there"


def test_on_a_face_and_in_the_middle_nothing_breaks() -> None:
    for place in (CENTRE, CENTRE + HALF, CENTRE - HALF, CENTRE + HALF * (1.0, 0.0, 0.0)):
        told = kept((1.0, 2.0, 3.0), place, REST)
        assert np.isfinite(told.acceleration).all()
        assert told.changed
    flat = np.array([(CENTRE, np.zeros(3))])
    assert np.isfinite(kept((1.0, 2.0, 3.0), CENTRE, REST, flat).acceleration).all()


vectors = arrays(float, 3, elements=st.floats(-1.0, 1.0))


@settings(max_examples=150, deadline=None)
@given(wanted=vectors, out=vectors, speed=vectors)
def test_nothing_is_changed_that_need_not_be(wanted, out, speed) -> None:
    place = CENTRE + out
    told = kept(6.0 * wanted, place, speed)
    limited = 6.0 * wanted
    limited *= min(CONFIG.hand_acceleration / max(np.linalg.norm(limited), 1e-9), 1.0)
    if not told.changed:
        np.testing.assert_allclose(told.acceleration, limited, atol=1e-9)
        return
    nearest = np.clip(place, CENTRE - HALF, CENTRE + HALF)
    if gap(place) < 1e-6:
        return
    outward = (place - nearest) / gap(place)
    assert (told.acceleration - limited) @ outward > 0.0
    # Only a tool that is near or comes is held up.
    assert gap(place) < MARGIN + 0.5 or speed @ outward < 0.0


def test_a_box_far_away_or_left_behind_is_none() -> None:
    for place, speed in (
        ((0.5, 0.1, 1.0), (0.2, 0.0, -0.2)), ((0.7, 0.1, 0.2), (0.5, 0.0, 0.0)),
        ((0.7, 0.1, 0.2), (0.0, 0.5, 0.3)),
    ):  # fmt: skip
        told = kept((1.0, 0.5, 0.2), np.array(place), np.array(speed))
        assert not told.changed
        np.testing.assert_array_equal(told.acceleration, (1.0, 0.5, 0.2))
    assert not kept((-8.0, 0.0, 0.0), np.array((0.69, 0.1, 0.2)), REST, NO_BOXES).changed


def test_people_come_before_boxes() -> None:
    """A fist drives the tool against a box: it gives way as if there were none."""
    place = np.array((0.5 - 0.1 - MARGIN - 0.005, 0.1, 0.2))
    fist = Places(place - np.array([(0.11, 0.0, 0.0)]), np.array([(1.5, 0.0, 0.0)]), np.zeros(1))
    coming = np.array((0.3, 0.0, 0.0))
    alone = kept(REST, place, coming, NO_BOXES, fist).acceleration
    both = kept(REST, place, coming, BOX, fist).acceleration
    assert alone[0] > 1.0
    np.testing.assert_allclose(both, alone, atol=1e-9)
    assert kept(REST, place, coming, BOX).acceleration[0] < -1.0, "which the box would not let it"
    # The floor goes with the box.
    low = kept(REST, place, coming, BOX, fist, floor=0.15).acceleration
    np.testing.assert_allclose(low, alone, atol=1e-9)


def test_where_there_is_room_for_all_all_are_kept_clear_of() -> None:
    """A tool that wants into the corner of a box, a floor and a fist that rests."""
    box = np.array([(CENTRE, (0.1, 0.2, 0.3))])
    place, speed = np.array((0.15, -0.1, 0.3)), np.zeros(3)
    fist, floor = np.array((0.3, 0.25, 0.08)), 0.05
    people = Places(fist[None], np.zeros((1, 3)), np.zeros(1))
    aim, path = np.array((0.4, 0.3, 0.0)), [place]
    for _ in range(600):
        told = kept(
            30.0 * (aim - place) - 3.0 * speed, place, speed, box, people, floor
        ).acceleration
        place = place + speed * DT + 0.5 * told * DT**2
        speed = speed + told * DT
        path.append(place)
    gaps = [gap(at, box) - MARGIN for at in path]
    apart = [float(np.linalg.norm(at - fist)) - CONFIG.separation for at in path]
    heights = [float(at[2]) - floor for at in path]
    for rooms in (gaps, apart, heights):
        assert min(rooms) >= -1e-6
        assert rooms[-1] < 0.02
