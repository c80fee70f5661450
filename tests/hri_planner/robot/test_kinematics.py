"""The URDF, Pinocchio, MuJoCo, the DH table and the compiled kinematics say the same."""

import mujoco
import numpy as np
import pinocchio
import pytest

from hri_planner.robot.kinematics import tool_jacobian
from hri_planner.robot.model import capsule_radii, load_robot, parse_robot
from hri_prediction.errors import DataError

ROBOT = load_robot()
COUNT = 10_000


def _configurations(count=COUNT):
    return np.random.default_rng(7).uniform(ROBOT.lower, ROBOT.upper, (count, 7))


def _dh_wrists(q):
    """Table of the thesis: origin at the shoulder, end at the wrist."""
    alpha = np.radians([90, -90, -90, 90, 90, -90, 0])
    d = [0, 0, 0.400, 0, 0.390, 0, 0]
    pose = np.tile(np.eye(4), (len(q), 1, 1))
    for joint in range(7):
        c, s = np.cos(q[:, joint]), np.sin(q[:, joint])
        ca, sa = np.cos(alpha[joint]), np.sin(alpha[joint])
        zero, one = np.zeros_like(c), np.ones_like(c)
        rows = [
            np.stack([c, -s * ca, s * sa, zero], -1),
            np.stack([s, c * ca, -c * sa, zero], -1),
            np.stack([zero, sa * one, ca * one, d[joint] * one], -1),
            np.stack([zero, zero, zero, one], -1),
        ]
        pose = pose @ np.stack(rows, 1)
    return pose[:, :3, 3] + ROBOT.shoulder


def test_wrist_agrees_everywhere():
    q = _configurations()
    wrists = ROBOT.frames(q)[:, 2]
    assert np.abs(_dh_wrists(q) - wrists).max() < 1e-9
    model = pinocchio.buildModelFromXML(ROBOT.urdf_text)
    data = model.createData()
    frame = model.getFrameId("lwr_link_6")
    scene = mujoco.MjModel.from_xml_string(ROBOT.urdf_text)
    state = mujoco.MjData(scene)
    body = scene.body("lwr_link_6").id
    errors = np.empty((COUNT, 2))
    for index, angles in enumerate(q):
        pinocchio.framesForwardKinematics(model, data, angles)
        errors[index, 0] = np.abs(data.oMf[frame].translation - wrists[index]).max()
        state.qpos[:] = angles
        mujoco.mj_kinematics(scene, state)
        errors[index, 1] = np.abs(state.xpos[body] - wrists[index]).max()
    assert errors.max() < 1e-9


def test_elbow_and_tool_agree_with_pinocchio():
    model = pinocchio.buildModelFromXML(ROBOT.urdf_text)
    data = model.createData()
    for angles in _configurations(200):
        pinocchio.framesForwardKinematics(model, data, angles)
        points = ROBOT.frames(angles)
        for name, row in (("lwr_link_2", 0), ("lwr_link_4", 1), ("lwr_tool", 3)):
            there = data.oMf[model.getFrameId(name)].translation
            assert np.abs(there - points[row]).max() < 1e-12


def test_limits_and_masses_agree_with_pinocchio_and_mujoco():
    model = pinocchio.buildModelFromXML(ROBOT.urdf_text)
    np.testing.assert_allclose(model.lowerPositionLimit, ROBOT.lower)
    np.testing.assert_allclose(model.upperPositionLimit, ROBOT.upper)
    np.testing.assert_allclose(model.velocityLimit, ROBOT.velocity)
    np.testing.assert_allclose(model.effortLimit, ROBOT.effort)
    np.testing.assert_allclose(np.degrees(ROBOT.velocity), [110, 110, 128, 128, 204, 184, 184])
    scene = mujoco.MjModel.from_xml_string(ROBOT.urdf_text)
    assert scene.body_mass.sum() == pytest.approx(1.21 + 4 * 2.30 + 1.60 + 1.49 + 0.11)
    np.testing.assert_allclose(scene.jnt_range[:, 1], ROBOT.upper)
    np.testing.assert_allclose(ROBOT.part_masses, [4.6, 3.9, 1.6])


def test_zero_posture_stands_straight_up():
    np.testing.assert_allclose(ROBOT.frames(np.zeros(7))[:, 2], [0.31, 0.71, 1.10, 1.278])


def test_jacobian_against_finite_differences():
    jac, tool = np.empty((3, 7)), np.empty(3)
    step = 1e-6
    for angles in _configurations(100):
        tool_jacobian(angles, ROBOT.lengths, tool, jac)
        np.testing.assert_allclose(tool, ROBOT.frames(angles)[3], atol=1e-14)
        ahead = ROBOT.frames(angles + step * np.eye(7))[:, 3]
        behind = ROBOT.frames(angles - step * np.eye(7))[:, 3]
        np.testing.assert_allclose(jac, (ahead - behind).T / (2 * step), atol=1e-8)


def test_capsules_join_the_frames():
    q = _configurations(12).reshape(3, 4, 7)
    capsules = ROBOT.robot_capsules(q)
    assert capsules.shape == (3, 4, 3, 2, 3)
    np.testing.assert_array_equal(capsules[..., 0, :], ROBOT.frames(q)[..., :3, :])
    np.testing.assert_array_equal(capsules[..., 1, :], ROBOT.frames(q)[..., 1:, :])


def test_radii_come_from_the_urdf():
    np.testing.assert_array_equal(ROBOT.capsule_radii, [0.07, 0.07, 0.06])
    wider = ROBOT.urdf_text.replace('radius="0.06"', 'radius="0.065"')
    assert capsule_radii(wider)[2] == 0.065
    with pytest.raises(DataError, match="hand"):
        capsule_radii(ROBOT.urdf_text.replace('name="hand_end"', 'name="nameless"'))


def test_other_arms_are_refused():
    with pytest.raises(DataError, match="lwr_joint_2"):
        parse_robot(ROBOT.urdf_text.replace('xyz="0 -1 0"', 'xyz="0 1 0"', 1))
    with pytest.raises(DataError, match="cannot be read"):
        parse_robot("<robot>")


def test_arrays_are_read_only():
    with pytest.raises(ValueError, match="read-only"):
        ROBOT.lower[0] = 0.0
