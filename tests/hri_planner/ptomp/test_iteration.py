"""One iteration of the optimiser: no memory taken, no NaN spread, single precision near to double."""

import tracemalloc

import numpy as np
import pytest
from numba.core.runtime import _nrt_python, rtsys

from hri_planner.ptomp import HumanForecast, PtompConfig
from hri_planner.ptomp.costs import CostModel
from hri_planner.ptomp.iteration import iterate
from hri_planner.ptomp.layout import ROW, TERM_COUNT
from hri_planner.ptomp.smoothing import smoothing_factors
from hri_planner.robot import load_robot, solve_ik

ROBOT = load_robot()
COLUMNS, COUNT = 45, 30


class Iterations:
    """An incumbent that leads through an arm, and all that an iteration needs."""

    def __init__(self, precision="double", seed=0):
        rng = np.random.default_rng(seed)
        rest = np.radians([0, -40, 0, 90, 0, -40, 0])
        ends = [solve_ik(ROBOT, np.array([0.5, y, 0.15]), rest, rng) for y in (-0.35, 0.35)]
        x = np.clip((np.arange(COLUMNS) - 2) / (COLUMNS - 3), 0, 1)[:, None]
        path = ends[0] + x**3 * (10 - 15 * x + 6 * x * x) * (ends[1] - ends[0])
        arm = np.array([[0.8, 0, 0.4], [0.75, 0, 0.15], [0.5, 0, 0.15], [0.41, 0, 0.15]])
        people = HumanForecast(0.0, 1.0, arm[None], np.full((1, 4), 0.01), np.full(3, 0.05))
        self.model = CostModel(ROBOT, PtompConfig(precision=precision), None)
        times = 1.5 / 42 * np.arange(-2.0, COLUMNS - 2.0)
        self.model.bind(times, np.array([0.5, 0.35, 0.15]), [people], 0.07)
        dtype = self.model.dtype
        self.incumbent = self.model.pad(path.T[None])[0]
        self.cost = self.first = float(self.model.evaluate(path.T[None])[0][0])
        self.normals = rng.standard_normal(1 << 14).astype(dtype)
        self.factors = tuple(values.astype(dtype) for values in smoothing_factors())
        self.buffers = (
            np.zeros((COUNT, 7, ROW), dtype), np.zeros(COUNT, dtype), np.zeros((4, 7, ROW), dtype),
            np.full(4, np.inf, dtype), np.zeros((7, ROW), dtype), np.zeros(TERM_COUNT, dtype),
        )  # fmt: skip

    def run(self, place):
        self.cost = iterate(
            self.incumbent, self.cost, COLUMNS, COLUMNS - 1, False, 0.3, 10.0, self.normals, place,
            *self.factors, *self.model.problem, *self.buffers,
        )  # fmt: skip
        return self.cost

    @property
    def arrays(self):
        """How many arrays it is called with."""
        return 2 + len(self.factors) + len(self.model.problem) + len(self.buffers)


@pytest.fixture
def counting():
    """Numba counts what compiled code allocates."""
    _nrt_python.memsys_enable_stats()
    yield
    _nrt_python.memsys_disable_stats()


@pytest.mark.usefixtures("counting")
def test_nothing_is_allocated():
    iterations = Iterations()
    iterations.run(0)
    before = rtsys.get_allocation_stats()
    for place in range(20):
        iterations.run(place)
    after = rtsys.get_allocation_stats()
    # A reference to each array that is passed, and nothing more.
    assert after.alloc - before.alloc <= 20 * iterations.arrays
    assert after.free - before.free == after.alloc - before.alloc
    tracemalloc.start()
    try:
        iterations.run(21)
        begun = tracemalloc.get_traced_memory()[0]
        tracemalloc.reset_peak()
        for place in range(20):
            iterations.run(place)
        # A few numbers; one trajectory alone would be ten kilobytes.
        assert tracemalloc.get_traced_memory()[1] - begun < 4000
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("precision", ["double", "single"])
def test_it_improves_and_tells_the_cost(precision):
    iterations = Iterations(precision)
    costs = [iterations.run(100 * number) for number in range(40)]
    assert np.all(np.diff([iterations.first, *costs]) <= 0.0)
    assert costs[-1] < 0.1 * iterations.first
    total, _, nearest = iterations.model.evaluate(iterations.incumbent[None, :, :COLUMNS])
    assert total[0] == pytest.approx(costs[-1], rel=1e-9 if precision == "double" else 1e-4)
    assert nearest[0] > 0.0


def test_roll_outs_of_both_precisions_agree():
    double, single = Iterations(), Iterations("single")
    double.run(7)
    single.run(7)
    rollouts, near = double.buffers[0], single.buffers[0]
    assert near.dtype == np.float32
    assert np.abs(rollouts[:, :, :COLUMNS] - near[:, :, :COLUMNS]).max() < 1e-4
    np.testing.assert_allclose(double.buffers[1], single.buffers[1], rtol=2e-3)


def test_a_nan_is_not_accepted():
    iterations = Iterations()
    before = iterations.incumbent.copy()
    iterations.normals[:40] = np.nan  # noise of the first roll-out, which draws no window from it
    assert iterations.run(0) == iterations.first
    np.testing.assert_array_equal(iterations.incumbent, before)
    iterations.normals = np.random.default_rng(1).standard_normal(1 << 14)
    iterations.buffers[3][:] = np.inf
    assert iterations.run(0) < iterations.first  # nothing of it is left in the buffers
