"""Kinematics and dynamics of the arm, against Pinocchio, finite differences and the thesis' own table."""

import ctypes

import numpy as np
import pinocchio as pin
import pytest
from drawn import TASKS, state
from hypothesis import given, settings
from hypothesis import strategies as st

from hri_prediction.errors import ConfigError, DataError
from hri_prediction.motor_control import derivation
from hri_prediction.motor_control.arm_model import PARAMETERS, ArmModel, JointLimits
from hri_prediction.motor_control.compiled_graph import compiled_graph
from hri_prediction.motor_control.convention import CONVENTIONS, convention_of
from hri_prediction.motor_control.inverse import nearest_angles
from hri_prediction.motor_control.kinematics import (
    elbow_and_wrist,
    elbow_jacobian,
    hand,
    hand_jacobian,
    joint_angles,
)

AXES = {"y": [0.0, 1.0, 0.0], "-y": [0.0, -1.0, 0.0], "z": [0.0, 0.0, 1.0]}


def reference(arm: ArmModel) -> tuple[pin.Model, list[int]]:
    """The same arm in Pinocchio, and which of its joints has which of our angles."""
    model = pin.Model()
    convention = convention_of(arm.convention)
    parent = 0
    for index, axis in enumerate(convention.axes):
        joint = pin.JointModelRevoluteUnaligned(*AXES[axis])
        offset = np.array([arm.upper_m if index == 2 else 0.0, 0.0, 0.0])
        parent = model.addJoint(parent, joint, pin.SE3(np.eye(3), offset), f"joint{index}")
        if index:
            name = ("upper", "forearm")[index - 1]
            across, along = getattr(arm, f"{name}_across"), getattr(arm, f"{name}_along")
            centre = np.array([getattr(arm, f"{name}_centre_m"), 0.0, 0.0])
            inertia = pin.Inertia(
                getattr(arm, f"{name}_kg"), centre, np.diag([along, across, across])
            )
            model.appendBodyToJoint(parent, inertia, pin.SE3.Identity())
    model.gravity.linear = np.array([0.0, 0.0, -arm.gravity])
    return model, list(convention.joints)


def compiled_values_of(arm: ArmModel):
    """The same as they are computed: the code that was compiled, called through ctypes."""
    pointer = ctypes.POINTER(ctypes.c_double)
    graph = compiled_graph(arm.convention)
    function = ctypes.CFUNCTYPE(None, *[pointer] * 4)(graph.values)
    unused = np.zeros(derivation.OUTPUTS)

    def at(z):
        out = np.full(derivation.OUTPUTS, np.nan)
        arrays = (np.ascontiguousarray(z), arm.parameters, unused, out)
        function(*(array.ctypes.data_as(pointer) for array in arrays))
        return out

    return at


def values_of(arm: ArmModel):
    """The outputs of the derivation at a state, as they are before they are compiled."""
    import casadi as ca

    z, p = derivation.symbols()
    made = ca.Function("y", [z, p], [derivation.outputs(convention_of(arm.convention), z, p)])
    return lambda at: np.array(made(at, arm.parameters)).ravel()


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_torques_are_those_of_pinocchio(convention, rng):
    arm = ArmModel.of_body(1.8, 82.0, convention=convention)
    model, order = reference(arm)
    data, outputs, compiled = model.createData(), values_of(arm), compiled_values_of(arm)
    for _ in range(50):
        z = state(rng)
        q, dq, ddq = (z[3 * k : 3 * k + 3][order] for k in range(3))
        expected = np.empty(3)
        expected[order] = pin.rnea(model, data, q, dq, ddq)
        energy = 2.0 * pin.computeKineticEnergy(model, data, q, dq)
        allowed = 1e-10 * max(1.0, np.abs(expected).max())
        for y in (outputs(z), compiled(z)):
            np.testing.assert_allclose(y[3:6], expected, rtol=0.0, atol=allowed)
            assert y[9] == pytest.approx(energy, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_rates_and_jerks_are_derivatives_by_time(convention, rng):
    arm = ArmModel.of_body(convention=convention)
    outputs = values_of(arm)
    for _ in range(10):
        z = state(rng)

        def at(t, z=z):
            q, dq, ddq, dddq = z.reshape(4, 3)
            rows = (
                q + t * dq + t**2 / 2 * ddq + t**3 / 6 * dddq,
                dq + t * ddq + t**2 / 2 * dddq,
                ddq + t * dddq,
                dddq,
            )
            return np.concatenate(rows)

        step = 1e-5
        rate = (outputs(at(step))[3:6] - outputs(at(-step))[3:6]) / (2.0 * step)
        np.testing.assert_allclose(outputs(z)[6:9], rate, rtol=1e-5, atol=1e-5)
        step = 1e-3
        path = [hand(at(k * step)[:3], arm) for k in (-2, -1, 1, 2)]
        jerk = (path[3] - 2.0 * path[2] + 2.0 * path[1] - path[0]) / (2.0 * step**3)
        size = np.linalg.norm(outputs(z)[:3])
        assert np.linalg.norm(jerk) == pytest.approx(size, rel=1e-3)


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_jacobians_match_finite_differences(convention, rng):
    arm = ArmModel.of_body(convention=convention)
    q, step = rng.normal(0.0, 1.0, (20, 3)), 1e-6
    for jacobian, which in ((elbow_jacobian(q, arm), 0), (hand_jacobian(q, arm), 1)):
        for joint in range(3):
            moved = step * np.eye(3)[joint]
            ahead, behind = (elbow_and_wrist(q + s * moved, arm)[which] for s in (1.0, -1.0))
            numeric = (ahead - behind) / (2 * step)
            np.testing.assert_allclose(jacobian[..., joint], numeric, atol=1e-8)


def test_zero_is_sideways_and_a_right_angle_hangs_down():
    arm = ArmModel.of_body()
    reach = arm.upper_m + arm.forearm_m
    np.testing.assert_allclose(hand(np.zeros(3), arm), [reach, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(hand([0.5 * np.pi, 0.0, 0.0], arm), [0.0, 0.0, -reach], atol=1e-12)
    np.testing.assert_allclose(hand([0.0, 0.5 * np.pi, 0.0], arm), [0.0, reach, 0.0], atol=1e-12)


def test_distances_are_those_of_the_thesis():
    # Table 2.4, from P1 to T1..T9, measured at the fist: the lengths are those of arms 1.11 times as long.
    wanted = [0.813, 0.775, 0.779, 0.689, 0.645, 0.650, 0.574, 0.535, 0.533]
    plain = ArmModel.of_body()
    arm = ArmModel.of_body(upper_m=1.11 * plain.upper_m, forearm_m=1.11 * plain.forearm_m)
    found = [np.linalg.norm(hand(task[3], arm) - hand(task[2], arm)) for task in TASKS[:9]]
    apart = np.subtract(found, wanted)
    assert np.sqrt(np.mean(apart**2)) < 0.0165
    assert np.abs(apart).max() < 0.026


@given(st.integers(0, 10_000), st.sampled_from(sorted(CONVENTIONS)))
@settings(max_examples=50, deadline=None)
def test_angles_of_a_model_that_was_seen_are_found_again(seed, convention):
    rng = np.random.default_rng(seed)
    arm = ArmModel.of_body(convention=convention)
    q = rng.uniform([-1.3, -0.7, 0.05], [1.3, 1.5, 2.4], (30, 3))
    elbow, wrist = elbow_and_wrist(q, arm)
    points = np.stack([np.zeros_like(elbow), elbow, wrist], axis=1) + rng.normal(0.0, 1.0, 3)
    for found in (
        joint_angles(*np.moveaxis(points, 1, 0), convention),
        nearest_angles(points, arm),
    ):
        back = elbow_and_wrist(found, arm)
        np.testing.assert_allclose(back[0], elbow, atol=1e-7)
        np.testing.assert_allclose(back[1], wrist, atol=1e-7)


def test_what_a_shoulder_rolls_is_shared_and_limits_are_kept(arm, rng):
    q = rng.uniform([0.8, 0.0, 0.5], [1.5, 0.8, 1.8], (40, 3))
    elbow, wrist = elbow_and_wrist(q, arm)
    forearm = wrist - elbow
    axis = elbow / np.linalg.norm(elbow, axis=1, keepdims=True)
    rolled = (
        np.cos(0.6) * forearm
        + np.sin(0.6) * np.cross(axis, forearm)
        + (1.0 - np.cos(0.6)) * (axis * forearm).sum(axis=1, keepdims=True) * axis
    )
    points = np.stack([np.zeros_like(elbow), elbow, elbow + rolled], axis=1)

    def misfit(angles):
        e, w = elbow_and_wrist(angles, arm)
        return np.square(e - points[:, 1]).sum(axis=1) + np.square(w - points[:, 2]).sum(axis=1)

    limits = JointLimits.degrees(((-90.0, 90.0), (-20.0, 60.0), (0.0, 120.0)))
    found = nearest_angles(points, arm, limits)
    assert (found >= np.array(limits.lower)).all()
    assert (found <= np.array(limits.upper)).all()
    free = nearest_angles(points, arm)
    direct = joint_angles(*np.moveaxis(points, 1, 0))
    assert misfit(free).mean() < 0.5 * misfit(direct).mean()
    for _ in range(20):  # nothing next to it is nearer
        nearby = np.clip(found + rng.normal(0.0, 1e-3, found.shape), limits.lower, limits.upper)
        assert (misfit(nearby) >= misfit(found) - 1e-9).all()


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"height_m": 0.0}, "height"),
        ({"mass_kg": float("nan")}, "mass"),
        ({"upper_m": -0.3}, "upper_m"),
        ({"convention": "roll"}, "yaw_pitch"),
    ],
)
def test_arms_that_cannot_be_are_refused(change, word):
    with pytest.raises(ConfigError, match=word):
        ArmModel.of_body(**change)


def test_limits_and_segments_that_cannot_be_are_refused():
    with pytest.raises(ConfigError, match="lower below upper"):
        JointLimits((0.0, 0.0, 0.0), (1.0, 0.0, 1.0))
    with pytest.raises(DataError, match="forearm has no length"):
        joint_angles(np.zeros(3), np.ones(3), np.ones(3))


def test_parameters_are_all_numbers_of_the_model(arm):
    assert len(arm.parameters) == len(PARAMETERS) == 11
    assert arm.upper_kg == pytest.approx(0.028 * 70.0)
    assert arm.upper_across == pytest.approx(arm.upper_kg * (0.322 * arm.upper_m) ** 2)
