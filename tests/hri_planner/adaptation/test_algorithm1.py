"""Algorithm 1: always a cell of the grid, the largest that passes, and it says which rule gave it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from hri_planner.adaptation.algorithm1 import (
    FILTERS,
    LEAST_COLLISION,
    LEAST_CONTROL,
    RULES,
    SMOOTH_SHARE,
    label,
)
from hri_planner.adaptation.grid import CELLS, SHAPE, Cell, clipped
from hri_prediction.errors import DataError

COSTS = arrays(float, SHAPE, elements=st.sampled_from([0.0, 0.5, 1.0, 5.0, 30.0]))


@given(COSTS, COSTS)
def test_the_label_is_on_the_grid_and_the_largest_that_passes(collision, control):
    found = label(collision, control)
    assert found.cell.on_grid
    assert found.rule in RULES
    passes = (collision == 0.0) & (control <= SMOOTH_SHARE * control.max())
    place = found.cell.place
    if passes.any():
        assert found.rule == FILTERS
        rows = np.flatnonzero(passes.any(axis=1))
        assert place == (rows.max(), np.flatnonzero(passes[rows.max()]).max())
    elif (collision == 0.0).any():
        assert found.rule == LEAST_CONTROL
        assert collision[place] == 0.0
        assert control[place] == control[collision == 0.0].min()
    else:
        assert found.rule == LEAST_COLLISION
        assert collision[place] == collision.min()


@given(COSTS, COSTS, st.floats(0.1, 10.0))
def test_units_make_no_difference(collision, control, unit):
    assert label(collision, control).cell == label(unit * collision, control).cell


def test_the_largest_control_cost_is_that_of_all_cells_also_of_those_that_collide():
    collision, control = np.zeros(SHAPE), np.full(SHAPE, 1.0)
    assert label(collision, control).rule == LEAST_CONTROL
    collision[0, 0], control[0, 0] = 1.0, 10.0
    found = label(collision, control)
    assert (found.rule, found.cell) == (FILTERS, Cell(60, 60))


@pytest.mark.parametrize("spoil", [np.nan, np.inf, -1.0])
def test_costs_that_are_none(spoil):
    costs = np.zeros(SHAPE)
    costs[3, 4] = spoil
    for pair in ((costs, np.ones(SHAPE)), (np.zeros(SHAPE), costs)):
        with pytest.raises(DataError, match="not finite or negative"):
            label(*pair)
    with pytest.raises(DataError, match=r"\(2, 2\)"):
        label(np.zeros((2, 2)), np.zeros(SHAPE))


@given(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3))
def test_real_values_are_rounded_down_into_the_range(steps, rollouts):
    cell = clipped((steps, rollouts))
    assert 10 <= cell.num_timesteps <= 60
    assert 5 <= cell.num_rollouts <= 60
    if 10 <= steps < 61:
        assert cell.num_timesteps == int(steps)


def test_the_example_of_the_thesis():
    assert clipped((42.87, 30.23)) == Cell(42, 30)
    assert len(CELLS) == 132
    assert CELLS[Cell(15, 5).place[0] * SHAPE[1]] == Cell(15, 5)
