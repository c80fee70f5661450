"""What training makes small, and its gradients."""

from collections.abc import Callable

import numpy as np
import pytest
import torch
from encounters import some_encounters

from hri_planner.rnn.cells import GATES
from hri_planner.rnn.features import FeatureConfig, features
from hri_planner.rnn.integration import accelerations
from hri_planner.rnn.model import STEP_S, PolicyModel
from hri_planner.rnn.network import Network, new_network
from hri_planner.rnn.rollout import roll_out
from hri_planner.rnn.training.batches import (
    buckets,
    course,
    held,
    training_scales,
)
from hri_planner.rnn.training.closed_loop import course_loss, draw_switches
from hri_planner.rnn.training.flat import flatten, unflatten
from hri_planner.rnn.training.losses import Switches, closed_loop, imitation_loss
from hri_planner.rnn.training.torch_network import TorchNetwork

CONFIG = FeatureConfig()
ENCOUNTERS = some_encounters(6)
SCALES = training_scales(ENCOUNTERS, CONFIG)


def check_gradient(plain: Network, loss: Callable[[TorchNetwork], "torch.Tensor"]) -> None:
    """Against central differences in random directions."""
    network = TorchNetwork(plain)
    loss(network).backward()
    slopes = flatten({name: w.grad.numpy() for name, w in network.weights.items()})
    begin = flatten(plain.to_arrays())
    rng = np.random.default_rng(7)
    step = 1e-6

    def value(vector: np.ndarray) -> float:
        arrays = unflatten(vector, plain.to_arrays())
        with torch.no_grad():
            return float(loss(TorchNetwork(Network.from_arrays(arrays, plain.kind, plain.units))))

    for _ in range(6):
        along = rng.normal(size=begin.size)
        along /= np.linalg.norm(along)
        difference = (value(begin + step * along) - value(begin - step * along)) / (2.0 * step)
        assert slopes @ along == pytest.approx(difference, rel=1e-4, abs=1e-7)


@pytest.mark.parametrize("kind", GATES)
def test_the_gradient_of_imitation_is_right(kind: str) -> None:
    data = buckets(ENCOUNTERS, SCALES, CONFIG, hold=4)
    plain = new_network(kind, (4, 3), np.random.default_rng(0))
    check_gradient(plain, lambda network: imitation_loss(network, data))


@pytest.mark.parametrize("kind", GATES)
def test_the_gradient_in_closed_loop_is_right(kind: str) -> None:
    data = course(ENCOUNTERS, 40)
    noise = 0.003 * torch.tensor(np.random.default_rng(1).normal(size=(40, 2, 6, 3)))
    plain = new_network(kind, (4, 3), np.random.default_rng(0))

    def loss(network: TorchNetwork) -> "torch.Tensor":
        moved = closed_loop(network, data, SCALES, CONFIG, STEP_S, steps=40, noise=noise)
        return course_loss(moved, data, 0.1)

    check_gradient(plain, loss)


SWITCHES = Switches(
    torch.tensor([3, 10, 20, 41, 41, 7]),
    torch.tensor(np.random.default_rng(2).uniform(-0.9, 0.9, (6, 3))),
)
"""Of six motions, in 40 steps; two keep their goals, some new ones are far away."""


@pytest.mark.parametrize("kind", GATES)
def test_the_gradient_is_right_when_goals_change(kind: str) -> None:
    data = course(ENCOUNTERS, 40)
    plain = new_network(kind, (4, 3), np.random.default_rng(0))

    def loss(network: TorchNetwork) -> "torch.Tensor":
        moved = closed_loop(network, data, SCALES, CONFIG, STEP_S, steps=40, switches=SWITCHES)
        return course_loss(moved, data, 0.1, SWITCHES)

    check_gradient(plain, loss)


def test_imitation_is_the_mean_squared_error_of_what_was_recorded() -> None:
    """Whatever the buckets and the padding."""
    plain = new_network("gru", (4, 3), np.random.default_rng(0))
    errors = []
    for one in ENCOUNTERS:
        hand, partner, goal = held(one, 4)
        seen = features(hand[:-1], goal, partner[:-1], CONFIG) / SCALES.inputs
        labels = accelerations(hand, STEP_S) / SCALES.acceleration
        errors += list(np.square(plain.sequence(seen) - labels).sum(axis=1))
    for count in (1, 2, 4):
        data = buckets(ENCOUNTERS, SCALES, CONFIG, hold=4, count=count)
        assert len(data) == count
        found = float(imitation_loss(TorchNetwork(plain), data).detach())
        assert found == pytest.approx(np.mean(errors), rel=1e-10)


@pytest.mark.parametrize("kind", GATES)
def test_the_closed_loop_is_that_of_the_robot(kind: str) -> None:
    plain = new_network(kind, (4, 3), np.random.default_rng(0))
    data = course(ENCOUNTERS, 60)
    moved = closed_loop(TorchNetwork(plain), data, SCALES, CONFIG, STEP_S, steps=60)
    there = roll_out(
        PolicyModel(plain, SCALES, CONFIG),
        data.hand[0].numpy(),
        data.goal.numpy(),
        data.partner.numpy().transpose(1, 0, 2),
        velocity=data.velocity.numpy(),
    )
    np.testing.assert_allclose(
        moved.detach().numpy().transpose(1, 0, 2), there.positions, atol=1e-9
    )


def test_goals_change_as_those_of_the_robot() -> None:
    plain = new_network("gru", (4, 3), np.random.default_rng(0))
    data = course(ENCOUNTERS, 40)
    moved = closed_loop(
        TorchNetwork(plain), data, SCALES, CONFIG, STEP_S, steps=40, switches=SWITCHES
    )
    later = np.arange(40)[None, :, None] >= SWITCHES.step.numpy()[:, None, None]
    goals = np.where(later, SWITCHES.goal.numpy()[:, None], data.goal.numpy()[:, None])
    there = roll_out(
        PolicyModel(plain, SCALES, CONFIG),
        data.hand[0].numpy(),
        goals,
        data.partner.numpy().transpose(1, 0, 2),
        velocity=data.velocity.numpy(),
    )
    np.testing.assert_allclose(
        moved.detach().numpy().transpose(1, 0, 2), there.positions, atol=1e-9
    )


def test_after_a_change_of_goal_only_the_arrival_counts() -> None:
    data = course(ENCOUNTERS, 150)
    switches = Switches(torch.full((6,), 30), data.goal + torch.tensor((0.0, 0.2, 0.0)))
    moved = data.hand.clone()
    moved[31:80] = 5.0  # on the way, nothing is asked for
    moved[80:] = switches.goal
    assert float(course_loss(moved, data, 0.1, switches)) == pytest.approx(0.0, abs=1e-9)
    assert float(course_loss(moved, data, 0.1)) > 1.0
    moved[20] += 0.1
    assert float(course_loss(moved, data, 0.1, switches)) > 0.01
    moved = data.hand.clone()
    assert float(course_loss(moved, data, 0.1, switches)) == pytest.approx(0.1 * 19.8, rel=0.01)


def test_changes_leave_time_to_get_there() -> None:
    goals = torch.tensor(np.random.default_rng(0).uniform(-0.3, 0.3, (400, 3)))
    found = draw_switches(goals, 200, 0.3, np.random.default_rng(1))
    changed = found.step <= 200
    assert 0.25 < float(changed.double().mean()) < 0.35
    assert int(found.step[changed].min()) >= 3
    assert int(found.step[changed].max()) < 130
    short = draw_switches(goals, 60, 0.3, np.random.default_rng(1))
    assert bool((short.step > 60).all())


def test_a_recorded_course_costs_nothing_and_another_does() -> None:
    data = course(ENCOUNTERS, 100)
    assert float(course_loss(data.hand, data, 0.1)) == pytest.approx(0.0, abs=1e-9)
    shifted = data.hand + torch.tensor((0.01, 0.0, 0.0))
    found = float(course_loss(shifted, data, 0.1))
    path, late = 100.0 * 0.01**2, 100.0 * (np.hypot(0.01, 0.002) - 0.002)
    assert found == pytest.approx(path + 0.1 * late, rel=1e-6)


def test_courses_are_cut_or_held() -> None:
    one = ENCOUNTERS[0]
    short, long = course([one], 10), course([one], 50)
    assert short.hand.shape == (11, 1, 3)
    np.testing.assert_array_equal(short.hand[:, 0].numpy(), one.hand[:11])
    np.testing.assert_array_equal(
        long.hand[len(one) :, 0].numpy(), [one.hand[-1]] * (51 - len(one))
    )
    np.testing.assert_array_equal(long.partner[-1, 0].numpy(), one.partner[-1])
