"""What is measured of the planner's kernel: each case timed in turn for all, and results compared."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hri_planner.benchmarks.plain_distances import arm_points, capsule_gaps, row_gaps, row_points
from hri_planner.benchmarks.plain_iteration import PlainCosts, PlainOptimizer
from hri_planner.benchmarks.references import PinocchioLoop, TorchRows, available
from hri_planner.ptomp import HumanForecast, PtompConfig, TableBox
from hri_planner.ptomp.clearance import many_clearances
from hri_planner.ptomp.costs import CostModel
from hri_planner.ptomp.optimizer import Optimizer
from hri_planner.robot import RobotModel, load_robot, solve_ik
from hri_prediction.benchmarks.promp_cases import Case, Progress, draw_library
from hri_prediction.benchmarks.reaches import TARGETS, draw_reach
from hri_prediction.benchmarks.timing import Contender, time_in_turn
from hri_prediction.geometry.minimum_jerk import minimum_jerk
from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.prediction.output import ReachState
from hri_prediction.prediction.predictor import ReachPredictor
from hri_prediction.tracks.track import ArmSample

Array = NDArray[np.float64]

DOUBLE, SINGLE, OURS, NUMPY = "ours_f64", "ours_f32", "ours", "numpy"
ROWS, PINOCCHIO, TORCH = "numpy_rows", "pinocchio_loop", "torch"
STEPS, DURATION_S = 42, 1.5
REPEATS = (
    10  # of our distances: in the planner, roll-outs come from the cache and not from others' turns
)
ITERATIONS = 10  # of one call of the optimiser; it would give up after twelve failures
NOISE_SD = 0.35
MARGIN = 0.07
RADII = np.array([0.05, 0.04, 0.04])
LIMBS = np.array([0.29, 0.26, 0.09])
TABLE = TableBox((0.55, 0.0, -0.03), (0.9, 1.4, 0.04))
RATE_HZ = 250.0


@dataclass(frozen=True)
class Extent:
    """How long to measure.

    Args:
        rounds: Rounds of the cases that are over in microseconds.
        slow: Rounds of what loops over configurations.
        reaches: Reaches that are foreseen.
    """

    rounds: int = 300
    slow: int = 10
    reaches: int = 8


SMOKE = Extent(3, 1, 1)


@dataclass(frozen=True)
class Scene:
    """A robot on its way through the arm of a person.

    Args:
        robot: The robot.
        config: Weights and sizes.
        times_s: Of the columns (P,) [s], two of the past first.
        goal: Of the tool (3,) [m].
        trajectory: Straight in the joints (7, P) [rad].
        rollouts: The same with noise (NT, 7, P) [rad].
        arm: The person's (P, 4, 3) [m], limbs of constant length.
        sigma: Standard deviations (P, 4) [m].
    """

    robot: RobotModel
    config: PtompConfig
    times_s: Array
    goal: Array
    trajectory: Array
    rollouts: Array
    arm: Array
    sigma: Array

    def costs(self, precision: str) -> CostModel:
        """Our cost model, bound to the scene."""
        model = CostModel(self.robot, replace(self.config, precision=precision), TABLE)
        step = float(self.times_s[1] - self.times_s[0])
        forecast = HumanForecast(float(self.times_s[0]), step, self.arm, self.sigma, RADII)
        model.bind(self.times_s, self.goal, [forecast], MARGIN)
        return model

    def plain(self) -> PlainCosts:
        """The same in NumPy."""
        return PlainCosts(
            self.robot, self.config, self.goal, DURATION_S / STEPS, MARGIN, TABLE.top,
            [(self.arm, self.sigma, RADII)],
        )  # fmt: skip


def draw_scene(rng: np.random.Generator) -> Scene:
    """A scene of the size that is usual: 42 steps, 30 roll-outs."""
    robot, config = load_robot(), PtompConfig(num_timesteps=STEPS, num_rollouts=30)
    columns = STEPS + 3
    rest = np.radians([0.0, -40.0, 0.0, 90.0, 0.0, -40.0, 0.0])
    places = np.array([[0.5, -0.35, 0.15], [0.5, 0.35, 0.15]]) + rng.uniform(-0.03, 0.03, (2, 3))
    ends = [solve_ik(robot, place, rest, rng) for place in places]
    share = minimum_jerk((np.arange(columns) - 2) / STEPS)[:, None]
    trajectory = np.ascontiguousarray((ends[0] + share * (ends[1] - ends[0])).T)
    noise = np.zeros((config.num_rollouts, 7, columns))
    size = rng.uniform(-0.3, 0.3, (config.num_rollouts, 6, 1))
    noise[:, :6] = size * np.sin(np.pi * share[:, 0]) ** 2
    hanging = np.array([[-0.1, 0.0, -1.0], [-0.7, 0.0, -0.3], [-1.0, 0.0, 0.0]])
    stretched = np.array([[-0.6, 0.2, -0.8], [-1.0, 0.1, -0.1], [-1.0, 0.0, -0.1]])
    axes = hanging + share[:, :, None] * (stretched - hanging)
    axes *= LIMBS[:, None] / np.linalg.norm(axes, axis=2, keepdims=True)
    arm = np.zeros((columns, 4, 3))
    arm[:, 1:] = np.cumsum(axes, axis=1)
    arm += np.array([0.78, 0.0, 0.40]) + rng.uniform(-0.03, 0.03, 3)
    sigma = 0.005 + 0.03 * np.linspace(0.0, 1.0, columns)[:, None] * np.arange(4) / 3.0
    times = DURATION_S / STEPS * np.arange(-2.0, columns - 2)
    return Scene(robot, config, times, places[1], trajectory, trajectory + noise, arm, sigma)


def keep_freed_memory() -> None:
    """Let the C library keep what NumPy frees, instead of asking the system for each large array.

    glibc keeps blocks up to the size of the largest that was freed so far; else the same expression
    takes twice as long in one process as in another, depending on what ran before.
    """
    np.empty(1 << 21)


def clearance_case(scene: Scene, extent: Extent, tick: Progress) -> Case:
    """Forward kinematics and nine distances of all columns of all roll-outs.

    Ours give the smallest distance and what the planner makes of the nine; the others the nine.
    """
    robot, arm = scene.robot, scene.arm
    q = np.ascontiguousarray(scene.rollouts.transpose(0, 2, 1))
    count, columns = q.shape[:2]
    contenders: dict[str, Contender] = {}
    found: dict[str, Array] = {}

    def ours(name: str, precision: str) -> None:
        model = scene.costs(precision)
        padded, result = model.pad(scene.rollouts), np.empty((count, columns), model.dtype)

        def step(_: int) -> None:
            for _ in range(REPEATS):
                many_clearances(padded, columns, *model.problem, result)

        contenders[name], found[name] = Contender(step), result

    ours(DOUBLE, "double")
    ours(SINGLE, "single")
    joints = [np.ascontiguousarray(q[..., joint]) for joint in range(6)]
    arm_rows = list(np.ascontiguousarray(arm.transpose(1, 2, 0)))
    lengths, radii, own = robot.lengths.tolist(), robot.capsule_radii.tolist(), RADII.tolist()

    def plain(_: int) -> Array:
        return capsule_gaps(arm_points(q, robot.lengths), robot.capsule_radii, arm, RADII)[0]

    def rows(_: int) -> list[list[tuple[Array, Array]]]:
        return row_gaps(row_points(joints, lengths, np), radii, arm_rows, own, np)

    contenders[NUMPY], contenders[ROWS] = Contender(plain), Contender(rows)
    if available("pinocchio") and available("coal"):
        loop = PinocchioLoop(robot, arm, RADII)
        contenders[PINOCCHIO] = Contender(lambda _: loop.gaps(q), rounds=extent.slow)
    if available(TORCH):
        torch = TorchRows(robot, q, arm, RADII)
        contenders[TORCH] = Contender(lambda _: torch.gaps())
    times = time_in_turn(contenders, extent.rounds, progress=tick)
    for name in (DOUBLE, SINGLE):
        times[name] = times[name] / REPEATS
    found[NUMPY] = plain(0).min(axis=(2, 3))
    found[ROWS] = np.min([gap for part in rows(0) for gap, _ in part], axis=0)
    if PINOCCHIO in contenders:
        found[PINOCCHIO] = loop.gaps(q).min(axis=2)
    if TORCH in contenders:
        found[TORCH] = np.min([np.asarray(gap) for part in torch.gaps() for gap, _ in part], axis=0)
    truth = PINOCCHIO if PINOCCHIO in found else NUMPY
    differences = {
        f"clearance [m]: {name} and {truth}": float(np.abs(values - found[truth]).max())
        for name, values in found.items()
        if name != truth
    }
    return Case({name: taken / (count * columns) for name, taken in times.items()}, differences)


def iteration_case(rng: np.random.Generator, scene: Scene, extent: Extent, tick: Progress) -> Case:
    """Noise, costs of all roll-outs, average, its cost, acceptance; ours through the optimiser."""
    plain = scene.plain()
    expected = plain.terms(scene.rollouts)[0]
    contenders, differences = {}, {}
    for name, precision in ((OURS, "double"), (SINGLE, "single")):
        model = scene.costs(precision)
        optimizer = Optimizer(replace(scene.config, precision=precision), rng.spawn(1)[0])
        cost = float(model.evaluate(scene.trajectory[None])[0][0])
        contenders[name] = Contender(_ten_iterations(optimizer, model, scene.trajectory, cost))
        terms = model.evaluate(scene.rollouts)[1]
        scale = np.abs(expected).max(axis=0) + 1e-12
        worst = float((np.abs(terms - expected) / scale).max())
        differences[f"cost terms, relative: {name} and {NUMPY}"] = worst
    other: list[PlainOptimizer] = []

    def begin() -> None:
        other[:] = [PlainOptimizer(plain, scene.config, rng, scene.trajectory)]

    contenders[NUMPY] = Contender(lambda _: other[0].iterate(NOISE_SD), begin)
    times = time_in_turn(contenders, extent.rounds, progress=tick)
    times[OURS], times[SINGLE] = times[OURS] / ITERATIONS, times[SINGLE] / ITERATIONS
    return Case(times, differences)


def _ten_iterations(
    optimizer: Optimizer, model: CostModel, trajectory: Array, cost: float
) -> Callable[[int], object]:
    def step(_: int) -> None:
        result = optimizer.run(
            model, trajectory, cost, free_until=model.columns - 1, free_end=False, sd=NOISE_SD,
            iterations=ITERATIONS, deadline=None,
        )  # fmt: skip
        assert result.iterations == ITERATIONS

    return step


def forecast_case(rng: np.random.Generator, scene: Scene, extent: Extent, tick: Progress) -> Case:
    """A sample of motion capture in, the planner's cost model bound to the new forecast.

    All hypotheses of task and duration are conditioned on it; counted is what happens during a reach.
    """
    library = draw_library(rng)
    predictor = ReachPredictor(library, replace(PredictorConfig(), update_interval=0.001))
    reach = draw_reach(rng, next(iter(TARGETS)), 0, RATE_HZ)
    valid = np.ones(4, dtype=bool)
    samples = [
        ArmSample(round(t * 1e9), points, valid, "right")
        for t, points in zip(reach.time_s, reach.keypoints, strict=True)
    ]
    reaching = np.zeros(len(samples), dtype=bool)
    model = scene.costs("double")

    def step(i: int) -> None:
        predictor.observe(samples[i])
        prediction = predictor.predict()
        if prediction is None:
            return
        reaching[i] = prediction.state == ReachState.REACHING
        largest = np.linalg.eigvalsh(prediction.covariance)[..., -1]
        now = prediction.stamp_ns * 1e-9
        forecast = HumanForecast(
            now, float(prediction.times_s[1] - prediction.times_s[0]), prediction.mean,
            np.sqrt(largest.clip(min=0.0)), RADII,
        )  # fmt: skip
        model.bind(now + scene.times_s, scene.goal, [forecast], MARGIN)

    contender = Contender(step, predictor.reset)
    taken = time_in_turn({OURS: contender}, extent.reaches, len(samples), progress=tick)[OURS]
    return Case({OURS: taken.reshape(extent.reaches, -1)[:, reaching].ravel()}, {})
