"""The potential field pushes as its potential says, and only what comes closer."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from hri_planner.dmp.drive import Drive, begin, drive_acceleration
from hri_planner.dmp.potential_field import (
    ASIDE,
    FieldConfig,
    Obstacles,
    acceleration,
    potential,
)
from hri_prediction.errors import ConfigError, DataError

FIELD = FieldConfig(strength=0.3)
STEP = 1e-4
SMALLEST_NORMAL = float(np.finfo(float).tiny)
START, GOAL = np.zeros(3), np.array((0.6, 0.0, 0.0))


def energy(x: np.ndarray, v: np.ndarray, radius: float, config: FieldConfig) -> float:
    """U as the chapter writes it, of what comes closer."""
    length, speed = np.linalg.norm(x), np.linalg.norm(v)
    cosine = v @ x / (speed * length)
    p = max(length - radius, config.nearest)
    return float(config.strength * max(-cosine, 0.0) ** config.exponent * speed / p)


def downhill(place: Callable, at: np.ndarray, v: np.ndarray, radius: float, config) -> np.ndarray:
    """-grad U by five-point differences, with v held."""
    found = np.empty(3)
    for axis, unit in enumerate(STEP * np.eye(3)):
        near, far = (
            [energy(at + k * unit - place(at + k * unit), v, radius, config) for k in (-n, n)]
            for n in (1, 2)
        )
        found[axis] = -(8.0 * (near[1] - near[0]) - (far[1] - far[0])) / (12.0 * STEP)
    return found


def told_by_differences(x: np.ndarray, v: np.ndarray, radius: float, config: FieldConfig) -> bool:
    """Whether the potential has a gradient there that the field is to be.

    Not where distances count as the smallest one, nor where the velocity is straight on (the tie is
    broken there) or the tool is just beside the obstacle (the second derivative jumps).
    """
    length = np.linalg.norm(x)
    cosine = v @ x / (np.linalg.norm(v) * length)
    sine = np.sqrt(max(1.0 - cosine**2, 0.0))
    return length - radius > config.nearest + 0.01 and cosine < -0.02 and sine > 1.1 * ASIDE


def agree(found: np.ndarray, wanted: np.ndarray) -> None:
    assert np.linalg.norm(found - wanted) <= 1e-6 * np.linalg.norm(wanted)


@pytest.mark.parametrize("exponent", [2.0, 3.5])
def test_capsules_push_down_their_potential(exponent: float) -> None:
    rng, config = np.random.default_rng(0), FieldConfig(strength=0.3, exponent=exponent)
    tried = 0
    for _ in range(600):
        axis, speeds = rng.uniform(-0.3, 0.3, (2, 3)), rng.uniform(-0.5, 0.5, (2, 3))
        at, v = rng.uniform(-0.5, 0.5, 3), rng.uniform(-1.0, 1.0, 3)
        way = axis[1] - axis[0]

        def share(point: np.ndarray, axis=axis, way=way) -> float:
            return float((point - axis[0]) @ way / (way @ way))

        def place(point: np.ndarray, axis=axis, way=way, share=share) -> np.ndarray:
            return axis[0] + np.clip(share(point), 0.0, 1.0) * way

        here = float(np.clip(share(at), 0.0, 1.0))
        relative = v - (1.0 - here) * speeds[0] - here * speeds[1]
        x = at - place(at)
        # Where the nearest place begins to go with the tool, there are two gradients.
        if min(abs(share(at)), abs(share(at) - 1.0)) * np.linalg.norm(way) < 0.002:
            continue
        # Neither are velocities gone by that lead past the axis nowhere but along it.
        lateral = relative / np.linalg.norm(relative)
        lateral = lateral - (lateral @ x) * x / (x @ x)
        if 0.0 < share(at) < 1.0:
            lateral = lateral - (lateral @ way) * way / (way @ way)
        if np.linalg.norm(lateral) < 1.1 * ASIDE or not told_by_differences(
            x, relative, 0.08, config
        ):
            continue
        obstacles = Obstacles.of([axis], [speeds], [0.08])
        agree(acceleration(at, v, obstacles, config), downhill(place, at, relative, 0.08, config))
        assert potential(at, v, obstacles, config) == pytest.approx(
            energy(x, relative, 0.08, config)
        )
        tried += 1
    assert tried > 100


def test_boxes_push_down_their_potential() -> None:
    rng = np.random.default_rng(1)
    tried = 0
    for _ in range(600):
        centre, half = rng.uniform(-0.2, 0.2, 3), rng.uniform(0.05, 0.2, 3)
        at, v = rng.uniform(-0.6, 0.6, 3), rng.uniform(-1.0, 1.0, 3)

        def place(point: np.ndarray, centre=centre, half=half) -> np.ndarray:
            return np.clip(point, centre - half, centre + half)

        # Next to where a face ends, there are two gradients.
        x, edges = at - place(at), np.abs(np.abs(at - centre) - half)
        if edges.min() < 0.002 or not x.any() or not told_by_differences(x, v, 0.06, FIELD):
            continue
        obstacles = Obstacles.of(boxes=[(centre, half)], margin=0.06)
        agree(acceleration(at, v, obstacles, FIELD), downhill(place, at, v, 0.06, FIELD))
        assert potential(at, v, obstacles, FIELD) == pytest.approx(energy(x, v, 0.06, FIELD))
        tried += 1
    assert tried > 100


def test_pushes_sum_up() -> None:
    rng = np.random.default_rng(2)
    axes, speeds = rng.uniform(-0.3, 0.3, (3, 2, 3)), rng.uniform(-0.3, 0.3, (3, 2, 3))
    radii, boxes = rng.uniform(0.03, 0.1, 3), rng.uniform(0.1, 0.3, (2, 2, 3))
    at, v = np.array((0.5, 0.4, -0.3)), np.array((-0.5, -0.3, 0.4))
    alone = [
        acceleration(at, v, Obstacles.of([a], [s], [r]), FIELD)
        for a, s, r in zip(axes, speeds, radii, strict=True)
    ]
    alone += [acceleration(at, v, Obstacles.of(boxes=[b], margin=0.05), FIELD) for b in boxes]
    together = acceleration(at, v, Obstacles.of(axes, speeds, radii, boxes, 0.05), FIELD)
    assert np.abs(together).max() > 0.01
    np.testing.assert_allclose(together, np.sum(alone, axis=0), atol=1e-12)


OBSTACLES = {
    "capsule": Obstacles.of([((0.3, -0.2, 0.0), (0.3, 0.2, 0.0))], radii=[0.08]),
    "box": Obstacles.of(boxes=[((0.4, 0.0, 0.0), (0.1, 0.2, 0.2))], margin=0.06),
}
vectors = arrays(float, 3, elements=st.floats(-1.0, 1.0))


@pytest.mark.parametrize("obstacles", OBSTACLES.values(), ids=list(OBSTACLES))
@pytest.mark.parametrize(
    "velocity",
    [(0.0, 0.0, 0.0), (-0.5, 0.0, 0.0), (-0.1, 0.4, 0.3), (0.0, 0.0, 0.5), (0.0, 0.5, 0.0)],
)
def test_what_rests_goes_away_or_passes_beside_is_not_pushed(obstacles, velocity) -> None:
    assert (acceleration(START, velocity, obstacles, FIELD) == 0.0).all()


def test_it_is_the_relative_velocity_that_counts() -> None:
    axis = [((0.3, -0.2, 0.0), (0.3, 0.2, 0.0))]
    along, away, comes = ((np.array(v) * np.ones((1, 2, 1))) for v in (
        (0.5, 0.1, 0.0), (0.8, 0.0, 0.0), (-0.5, 0.0, 0.1)
    ))  # fmt: skip
    toward = np.array((0.5, 0.1, 0.0))
    for moving in (along, away):
        obstacles = Obstacles.of(axis, moving, [0.08])
        assert (acceleration(START, toward, obstacles, FIELD) == 0.0).all()
    pushed = acceleration(START, np.zeros(3), Obstacles.of(axis, comes, [0.08]), FIELD)
    assert pushed[0] < 0.0, "a tool at rest gives way to what comes"


@settings(max_examples=100, deadline=None)
@given(at=vectors, velocity=vectors, factor=st.sampled_from([0.125, 0.25, 0.5, 2.0, 4.0, 8.0]))
@example(at=np.zeros(3), velocity=np.array([2.2e-313, 1.0, 2.2e-313]), factor=0.25)
def test_the_push_is_finite_brakes_and_grows_with_the_speed(at, velocity, factor) -> None:
    """By powers of two, which no product rounds: past an obstacle at its nearest, cos is rounding alone.

    But for products below the smallest normal number: these lose digits.
    """
    for obstacles in OBSTACLES.values():
        assume(np.linalg.norm(velocity) > 1e-3)
        push = acceleration(at, velocity, obstacles, FIELD)
        assert np.isfinite(push).all()
        again = acceleration(at, factor * velocity, obstacles, FIELD)
        np.testing.assert_allclose(again, factor * push, rtol=0.0, atol=SMALLEST_NORMAL)


@pytest.mark.parametrize("obstacles", OBSTACLES.values(), ids=list(OBSTACLES))
@pytest.mark.parametrize("velocity", [(0.5, 0.0, 0.0), (0.5, 0.0, 0.2), (0.4, 0.3, 0.1)])
def test_the_push_falls_with_the_distance(obstacles: Obstacles, velocity) -> None:
    sizes = [
        np.linalg.norm(acceleration((x, 0.0, 0.0), velocity, obstacles, FIELD))
        for x in np.linspace(-1.0, 0.18, 60)
    ]
    assert sizes[0] > 0.0
    assert (np.diff(sizes) > 0.0).all()


@pytest.mark.parametrize("obstacles", OBSTACLES.values(), ids=list(OBSTACLES))
def test_the_push_has_no_steps_as_the_tool_turns(obstacles: Obstacles) -> None:
    """From straight on, over the edge of where ties are broken, to beside and away."""
    for up in ((0.0, 0.0, 1.0), (0.0, 0.6, 0.8)):
        angles = np.linspace(1e-3, 0.75 * np.pi, 4001)
        pushes = np.array([
            acceleration(
                START, 0.5 * (np.cos(a) * np.array((1.0, 0.0, 0.0)) + np.sin(a) * np.array(up)),
                obstacles, FIELD,
            )
            for a in angles
        ])  # fmt: skip
        steps = np.linalg.norm(np.diff(pushes, axis=0), axis=1)
        assert steps.max() < 0.005 * np.linalg.norm(pushes, axis=1).max()


@pytest.mark.parametrize("obstacles", OBSTACLES.values(), ids=list(OBSTACLES))
def test_the_push_has_no_steps_as_the_tool_comes(obstacles: Obstacles) -> None:
    places = np.linspace((-0.3, 0.02, 0.03), (0.18, 0.05, 0.06), 4001)
    pushes = np.array([acceleration(at, (0.5, 0.1, 0.1), obstacles, FIELD) for at in places])
    steps = np.linalg.norm(np.diff(pushes, axis=0), axis=1)
    assert steps.max() < 0.005 * np.linalg.norm(pushes, axis=1).max()


def test_where_there_is_no_direction_nothing_breaks() -> None:
    for at in ((0.3, 0.0, 0.0), (0.4, 0.0, 0.0), (0.3, 0.2, 0.0)):
        for obstacles in OBSTACLES.values():
            assert np.isfinite(acceleration(at, (0.5, 0.1, 0.0), obstacles, FIELD)).all()
    lone = Obstacles.of([((0.3, 0.0, 0.0), (0.3, 0.0, 0.0))], radii=[0.08])
    assert acceleration(START, (0.5, 0.0, 0.1), lone, FIELD)[0] < 0.0


def roll_out(obstacles: Obstacles, config: FieldConfig, goal=GOAL, dt: float = 0.004) -> np.ndarray:
    """Straight way to a goal in 2.5 s, and 1.5 s of rest; only the field interferes."""
    drive = Drive.of(goal, 2.5, np.zeros((3, 20)), config).constants(dt)
    place, speed, memory, wanted = START.copy(), np.zeros(3), begin(START), np.empty(3)
    path = [place]
    for _ in range(1000):
        drive_acceleration(
            place, speed, memory, drive, obstacles.axes, obstacles.speeds, obstacles.radii,
            obstacles.boxes, obstacles.margin, wanted,
        )  # fmt: skip
        place = place + speed * dt + 0.5 * wanted * dt**2
        speed = speed + wanted * dt
        path.append(place)
    return np.array(path)


def gap(path: np.ndarray, axis: np.ndarray, radius: float) -> float:
    way = axis[1] - axis[0]
    share = np.clip((path - axis[0]) @ way / max(way @ way, 1e-12), 0.0, 1.0)
    return float(np.linalg.norm(path - axis[0] - share[:, None] * way, axis=1).min() - radius)


AXES = {
    "across": ((0.3, -0.3, 0.0), (0.3, 0.3, 0.0)),
    "upright": ((0.3, 0.0, -0.3), (0.3, 0.0, 0.3)),
    "diagonal": ((0.3, -0.2, -0.2), (0.3, 0.2, 0.2)),
    "inclined towards the tool": ((0.25, 0.0, -0.3), (0.35, 0.0, 0.3)),
    "point": ((0.3, 0.0, 0.0), (0.3, 0.0, 0.0)),
    "a fist": ((0.3, 0.0, 0.0), (0.4, 0.0, 0.0)),
}


@pytest.mark.parametrize("name", list(AXES))
@pytest.mark.parametrize("turn", [0.0, 0.7, 2.0])
def test_a_capsule_exactly_in_the_way_is_gone_around(name: str, turn: float) -> None:
    """Head-on, the gradient only brakes: a tool would stand before the capsule, or go through it."""
    rotation = np.array((
        (np.cos(turn), -np.sin(turn), 0.0), (np.sin(turn), np.cos(turn), 0.0), (0.0, 0.0, 1.0),
    ))  # fmt: skip
    axis, goal = np.array(AXES[name]) @ rotation.T, rotation @ GOAL
    obstacles = Obstacles.of([axis], radii=[0.10])
    path = roll_out(obstacles, FIELD, goal)
    assert gap(path, axis, 0.10) > 0.0
    assert np.linalg.norm(path[-1] - goal) < 1e-3
    np.testing.assert_array_equal(roll_out(obstacles, FIELD, goal), path)


def test_a_way_straight_up_is_gone_around_too() -> None:
    axis, goal = np.array(((-0.2, 0.0, 0.3), (0.2, 0.0, 0.3))), np.array((0.0, 0.0, 0.6))
    path = roll_out(Obstacles.of([axis], radii=[0.10]), FIELD, goal)
    assert gap(path, axis, 0.10) > 0.0
    assert np.linalg.norm(path[-1] - goal) < 1e-3


def test_without_strength_nothing_is_pushed() -> None:
    path = roll_out(Obstacles.of([AXES["across"]], radii=[0.10]), FieldConfig(strength=0.0))
    assert np.abs(path[:, 1:]).max() == 0.0


def test_obstacles_that_do_not_fit_are_refused() -> None:
    axis = [(START, GOAL)]
    with pytest.raises(DataError, match=r"1 capsules, speeds .* 0 radii; expected speeds of both"):
        Obstacles.of(axis)
    with pytest.raises(DataError, match="expected speeds of both ends"):
        Obstacles.of(axis, np.zeros((2, 2, 3)), [0.1])
    for bad in ({"axes": [(START, START * np.nan)], "radii": [0.1]}, {"axes": axis, "radii": [np.inf]},
                {"boxes": [(START, START * np.nan)]}):  # fmt: skip
        with pytest.raises(DataError, match="an obstacle is not finite"):
            Obstacles.of(**bad)
    assert len(Obstacles.of().axes) == len(Obstacles.of().boxes) == 0
    with pytest.raises(ConfigError, match=r"exponent = 1\.0"):
        FieldConfig(exponent=1.0)
    with pytest.raises(ConfigError, match="strength = nan"):
        FieldConfig(strength=np.nan)
