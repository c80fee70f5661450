"""Samples are motions as smooth as their mean, and end where it does."""

import numpy as np

from hri_planner.dmp.basis import BASIS_COUNT, end_projector
from hri_planner.dmp.response import response
from hri_planner.pibb.exploration import SMOOTH, exploration

SD = 0.05


def test_weights_next_to_each_other_change_alike() -> None:
    drawn = exploration(np.random.default_rng(0), 4000, BASIS_COUNT, SD).reshape(-1, BASIS_COUNT)
    assert np.abs(drawn.mean(axis=0)).max() < 0.03 * SD
    found = drawn.T @ drawn / len(drawn)
    centres = np.arange(BASIS_COUNT)
    smooth = SD**2 * np.exp(-0.5 * ((centres[:, None] - centres) / SMOOTH) ** 2)
    wanted = end_projector() @ smooth @ end_projector()
    np.testing.assert_allclose(found, wanted, atol=0.05 * SD**2)
    # What the ends take away, they take at the end.
    inner = slice(0, BASIS_COUNT - 5)
    np.testing.assert_allclose(found[inner, inner], smooth[inner, inner], atol=0.25 * SD**2)
    assert 1.0 <= SMOOTH / 0.7 <= 4.0, "about two widths of a basis function"


def test_axes_and_samples_are_drawn_apart() -> None:
    drawn = exploration(np.random.default_rng(1), 6000, 8, 1.0)
    middle = drawn[:, :, 3]
    together = np.corrcoef(middle.T)
    np.testing.assert_allclose(together, np.eye(3), atol=0.06)
    assert abs(np.corrcoef(middle[:-1, 0], middle[1:, 0])[0, 1]) < 0.06


def test_samples_end_where_the_mean_does() -> None:
    motion, rng = response(2.5, 0.004), np.random.default_rng(2)
    changes = exploration(rng, 200, BASIS_COUNT, SD)
    np.testing.assert_allclose(changes @ end_projector(), changes, atol=1e-12)
    paths = motion.rollouts(np.zeros(3), np.zeros(3), changes)
    apart = np.linalg.norm(paths, axis=-1)
    assert apart[:, -1].max() < 1e-5
    assert np.linalg.norm(paths[:, -1] - paths[:, -2], axis=-1).max() < 1e-5
    assert (apart[:, 0] == 0.0).all()
    assert np.median(apart.max(axis=1)) > SD


def test_samples_are_smooth() -> None:
    """Their bends are those of a motion, not of noise of the same size; but for where the gate opens."""
    motion, rng = response(2.5, 0.004), np.random.default_rng(3)
    rough = SD * rng.standard_normal((200, 3, BASIS_COUNT))
    jerks = []
    for changes in (exploration(rng, 200, BASIS_COUNT, SD), rough):
        paths = motion.rollouts(np.zeros(3), np.zeros(3), changes)
        jerks.append(np.mean(np.diff(paths[:, 100:400], 3, axis=1) ** 2))
    assert jerks[0] < 0.1 * jerks[1]


def test_the_size_scales_and_seeds_say_what_is_drawn() -> None:
    one, other = (exploration(np.random.default_rng(4), 5, BASIS_COUNT, SD) for _ in range(2))
    assert one.shape == (5, 3, BASIS_COUNT)
    np.testing.assert_array_equal(one, other)
    larger = exploration(np.random.default_rng(4), 5, BASIS_COUNT, 2.0 * SD)
    np.testing.assert_allclose(larger, 2.0 * one)
    assert not np.array_equal(exploration(np.random.default_rng(5), 5, BASIS_COUNT, SD), one)
