"""Roll-outs of movement primitives are the solution of their equations, and end where they should."""

import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.integrate import solve_ivp
from threadpoolctl import threadpool_limits

from hri_planner.dmp.basis import BASIS_COUNT, end_projector, forcing, gate, projected
from hri_planner.dmp.response import response
from hri_prediction.errors import DataError

START, GOAL = np.array((0.4, -0.3, 0.2)), np.array((0.6, 0.3, 0.1))
ALPHA, BETA, ALPHA_G = 50.0, 12.5, 15.0
CENTRES = np.linspace(0.0, 1.0, 20)


def random_weights(seed: int, sd: float, count: int = 1) -> np.ndarray:
    return sd * np.random.default_rng(seed).standard_normal((count, 3, 20))


def written_out(phase: float, weights: np.ndarray) -> np.ndarray:
    """s(u) Psi(u) w, from the description alone."""
    if not 0.0 < phase < 1.0:
        return np.zeros(3)
    active = np.exp(-0.5 * ((phase - CENTRES) * 19.0 / 0.7) ** 2)
    closed = max(1.0 - phase / 0.05, 0.0) + max(1.0 - (1.0 - phase) / 0.3, 0.0)
    return (1.0 - closed**3) * (weights @ active) / active.sum()


def integrated(phases: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """The chapter's equations over the phase, by an integrator of others."""

    def slopes(phase: float, state: np.ndarray) -> np.ndarray:
        place, rate, delayed = state.reshape(3, 3)
        driven = ALPHA * BETA * written_out(phase, weights)
        bent = ALPHA * (BETA * (delayed - place) - rate) + driven
        return np.concatenate((rate, bent, ALPHA_G * (GOAL - delayed)))

    begin = np.concatenate((START, np.zeros(3), START))
    found = solve_ivp(
        slopes, (0.0, phases[-1]), begin, t_eval=phases, rtol=1e-8, atol=1e-10, max_step=0.01
    )
    return found.y[:3].T


@pytest.mark.parametrize("sd", [0.0, 0.05, 0.2])
@pytest.mark.parametrize(("duration", "dt"), [(1.0, 0.001), (2.5, 0.004)])
def test_a_roll_out_is_the_solution_of_the_equations(sd: float, duration: float, dt: float) -> None:
    weights = random_weights(1, sd)[0]
    motion = response(duration, dt)
    wanted = integrated(motion.times / duration, projected(weights))
    np.testing.assert_allclose(motion.rollouts(START, GOAL, weights), wanted, rtol=0.0, atol=1e-4)


def test_the_forcing_is_what_is_written() -> None:
    weights, found = random_weights(3, 0.1)[0], np.empty(3)
    for phase in (-0.1, 0.0, 1e-3, 0.02, 0.05, 0.3, 0.7, 0.85, 0.999, 1.0, 1.2):
        forcing(phase, weights, found)
        np.testing.assert_allclose(found, written_out(phase, weights), atol=1e-14)
    shares = [gate(phase) for phase in np.linspace(0.0, 1.0, 2001)]
    assert max(shares) == 1.0
    assert min(shares) == 0.0
    assert np.abs(np.diff(shares)).max() < 0.05, "without a step"


@pytest.mark.parametrize("duration", [0.5, 1.0, 2.5, 10.0])
def test_whatever_the_weights_a_motion_ends_at_its_goal_at_rest(duration: float) -> None:
    weights = random_weights(4, 0.1, 100)
    starts, goals = np.random.default_rng(5).uniform(-0.5, 0.5, (2, 100, 3))
    paths = response(duration, 0.004).rollouts(starts, goals, weights)
    assert np.linalg.norm(paths[:, -1] - goals, axis=-1).max() < 1e-4
    speeds = np.linalg.norm(np.diff(paths, axis=1), axis=-1) / 0.004
    assert speeds[:, -1].max() < 0.01 * speeds.max()


def test_a_motion_begins_without_acceleration() -> None:
    """The first one that a step knows is that of its middle: it goes to 0 with the step."""
    weights = random_weights(6, 0.1, 20)
    first, most = [], []
    for dt in (4e-3, 1e-3, 2.5e-4):
        paths = response(2.5, dt).rollouts(START, GOAL, weights)
        first.append(2.0 * np.linalg.norm(paths[:, 1] - paths[:, 0], axis=-1).max() / dt**2)
        bends = np.diff(paths, 2, axis=1) / dt**2
        most.append(float(np.linalg.norm(bends, axis=-1).max()))
    assert first[0] < 0.15 * most[0]
    assert first[1] < 0.3 * first[0]
    assert first[2] < 0.3 * first[1]


@pytest.mark.parametrize("factor", [0.5, 3.0])
def test_the_duration_changes_times_and_nothing_else(factor: float) -> None:
    weights = random_weights(7, 0.1)[0]
    one, other = response(2.0, 0.004), response(factor * 2.0, factor * 0.004)
    np.testing.assert_allclose(other.times, factor * one.times)
    np.testing.assert_allclose(
        other.rollouts(START, GOAL, weights), one.rollouts(START, GOAL, weights), atol=1e-12
    )
    # With the same period, too, but for what a step of another length leaves.
    same = response(factor * 2.0, 0.004)
    path = same.rollouts(START, GOAL, weights)
    wanted = one.rollouts(START, GOAL, weights)
    for axis in range(3):
        again = np.interp(one.times, same.times / factor, path[:, axis])
        np.testing.assert_allclose(again, wanted[:, axis], atol=1e-3)


metres = st.floats(-1.0, 1.0)
places = arrays(float, 3, elements=metres)
shapes = arrays(float, (3, BASIS_COUNT), elements=metres)


@settings(max_examples=50, deadline=None)
@given(starts=arrays(float, (2, 3), elements=metres), goals=arrays(float, (2, 3), elements=metres),
       one=shapes, other=shapes, share=metres)  # fmt: skip
def test_motions_superpose(starts, goals, one, other, share) -> None:
    motion = response(2.5, 0.02)
    both = motion.rollouts(starts, goals, np.stack((one, other)))
    mixed = [share * pair[0] + (1.0 - share) * pair[1] for pair in (starts, goals, (one, other))]
    np.testing.assert_allclose(
        motion.rollouts(*mixed), share * both[0] + (1.0 - share) * both[1], atol=1e-9
    )


@settings(max_examples=50, deadline=None)
@given(start=places, goal=places, weights=shapes, offset=places, seed=st.integers(0, 2**31))
def test_motions_turn_and_move_with_start_and_goal(start, goal, weights, offset, seed) -> None:
    rotation = np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))[0]
    motion = response(2.5, 0.02)
    moved = motion.rollouts(rotation @ start + offset, rotation @ goal + offset, rotation @ weights)
    path = motion.rollouts(start, goal, weights)
    np.testing.assert_allclose(moved, path @ rotation.T + offset, atol=1e-9)


def test_a_batch_is_its_motions_one_by_one() -> None:
    weights = random_weights(8, 0.1, 24).reshape(4, 6, 3, 20)
    starts, goals = np.random.default_rng(9).uniform(-0.5, 0.5, (2, 4, 6, 3))
    motion = response(2.5, 0.004)
    paths = motion.rollouts(starts, goals, weights)
    assert paths.shape == (4, 6, len(motion.times), 3)
    for index in np.ndindex(4, 6):
        alone = motion.rollouts(starts[index], goals[index], weights[index])
        np.testing.assert_allclose(paths[index], alone, atol=1e-12)


def test_24_motions_take_no_longer_than_3_ms() -> None:
    weights, motion = random_weights(10, 0.1, 24), response(2.5, 0.004)
    took = []
    with threadpool_limits(1):  # as nodes run: threads only wait for each other
        for _ in range(50):
            begun = time.perf_counter()
            motion.rollouts(START, GOAL, weights)
            took.append(time.perf_counter() - begun)
    assert min(took) <= 3e-3


def demonstrations(phases: np.ndarray) -> dict[str, np.ndarray]:
    """Minimum-jerk motions along a line and along curves."""
    u = np.minimum(phases, 1.0)
    bell = u**3 * (10.0 + u * (-15.0 + 6.0 * u))
    straight = START + bell[:, None] * (GOAL - START)
    angle = 0.75 * np.pi * bell
    arc = 0.3 * np.stack((np.cos(angle), np.sin(angle), 0.2 * angle), axis=1)
    wave = np.sin(2.0 * np.pi * bell) * bell * (1.0 - bell)
    return {
        "straight": straight,
        "raised": straight + (16.0 * 0.2 * (bell * (1.0 - bell)) ** 2)[:, None] * (0.0, 0.0, 1.0),
        "arc": arc,
        "snake": straight + 0.5 * wave[:, None] * (0.3, -0.4, 1.0),
        "rest": np.tile(START, (len(u), 1)),
    }


@pytest.mark.parametrize("name", list(demonstrations(np.zeros(1))))
@pytest.mark.parametrize("duration", [1.0, 2.5])
def test_what_is_shown_is_imitated_to_half_a_millimetre(name: str, duration: float) -> None:
    motion = response(duration, 0.004)
    shown = demonstrations(motion.times / duration)[name]
    path = motion.rollouts(shown[0], shown[-1], motion.fit(shown))
    assert np.sqrt(np.mean(np.sum((path - shown) ** 2, axis=1))) <= 5e-4


def test_a_motion_that_was_made_is_found_again() -> None:
    motion = response(2.5, 0.004)
    weights = projected(random_weights(11, 0.05)[0])
    path = motion.rollouts(START, GOAL, weights)
    again = motion.rollouts(path[0], path[-1], motion.fit(path))
    np.testing.assert_allclose(again, path, atol=1e-4)


def test_ends_are_taken_out_of_weights_once() -> None:
    projector = end_projector()
    np.testing.assert_allclose(projector @ projector, projector, atol=1e-10)
    np.testing.assert_allclose(projector, projector.T)
    assert np.linalg.matrix_rank(projector, tol=1e-6) == BASIS_COUNT - 2
    weights = random_weights(12, 0.1)[0]
    np.testing.assert_allclose(projected(projected(weights)), projected(weights), atol=1e-12)
    with pytest.raises(ValueError, match="read-only"):
        projector[0, 0] = 2.0


@pytest.mark.parametrize(
    "shown",
    [np.zeros((626, 2)), np.zeros((5, 3)), np.zeros(3), np.full((626, 3), np.nan)],
)
def test_demonstrations_that_do_not_fit_are_refused(shown: np.ndarray) -> None:
    with pytest.raises(DataError, match=r"demonstration of shape .*expected finite positions"):
        response(2.5, 0.004).fit(shown)


@pytest.mark.parametrize(
    ("duration", "dt"), [(0.0, 0.004), (-1.0, 0.004), (np.nan, 0.004), (np.inf, 0.004), (1.0, 0.0)]
)
def test_durations_and_periods_are_positive(duration: float, dt: float) -> None:
    with pytest.raises(DataError, match="expected positive times"):
        response(duration, dt)
