"""The simulated cell against the robot model, MuJoCo's own distances and the clock."""

import mujoco
import numpy as np
import pytest

from hri_planner.robot import load_robot
from hri_planner.robot.model import CAPSULE_NAMES
from hri_prediction.arm.geometry import ArmRadii
from hri_prediction.errors import ConfigError, DataError
from hri_prediction.geometry.segments import capsule_distances
from hri_sim.scenario.schema import PersonSpec, ReachSpec, Scenario
from hri_sim.simulator import JointTrajectory, Simulation, SimulatorConfig
from hri_sim.simulator.benchmark import measure_speed
from hri_sim.simulator.scene import LONGEST_LIMB

ROBOT = load_robot()
START = np.array([0.5, -0.6, 0.0, 1.4, 0.0, -0.9, 0.0])
END = START + np.array([-1.0, 0.3, 0.4, -0.5, 0.2, 0.3, 0.5])
ARM = np.array([[0.75, 0.0, 0.4], [0.70, 0.15, 0.2], [0.55, 0.1, 0.1], [0.5, 0.1, 0.1]])


def scenario(people=1, **changes):
    persons = tuple(PersonSpec(id=f"person{n + 1}") for n in range(people))
    values = {
        "name": "test",
        "robot_start": tuple(START),
        "targets": {"cup": (0.5, 0.1, 0.2)},
        "persons": persons,
        "reaches": (ReachSpec(robot_target="cup"),),
    }
    return Scenario(**values | changes)


def min_jerk(start, end, stamp_ns, duration=1.5, count=43):
    t = np.linspace(0.0, duration, count)
    x = (t / duration)[:, None]
    s = 10 * x**3 - 15 * x**4 + 6 * x**5
    v = (30 * x**2 - 60 * x**3 + 30 * x**4) / duration
    a = (60 * x - 180 * x**2 + 120 * x**3) / duration**2
    move = end - start
    return JointTrajectory(stamp_ns, ROBOT.joint_names, t, start + s * move, v * move, a * move)


@pytest.fixture(scope="module")
def simulation():
    return Simulation(scenario(people=2))


def robot_geoms(model):
    return [model.geom(name).id for name in CAPSULE_NAMES]


def state_of(simulation):
    """Time, joint angles and velocities, and mocap poses: equal bytes, equal states."""
    model, kind = simulation.scene.model, mujoco.mjtState.mjSTATE_INTEGRATION
    state = np.empty(mujoco.mj_stateSize(model, kind))
    mujoco.mj_getState(model, simulation.data, state, kind)
    return state.tobytes(), simulation.time_ns


def test_model_is_the_robot(simulation):
    model = simulation.scene.model
    assert model.nq == model.nv == model.nu == 7
    assert [model.joint(i).name for i in range(7)] == list(ROBOT.joint_names)
    np.testing.assert_allclose(model.jnt_range, np.stack((ROBOT.lower, ROBOT.upper), axis=1))
    np.testing.assert_allclose(model.actuator_ctrlrange[:, 1], ROBOT.effort)
    np.testing.assert_allclose(model.geom_size[robot_geoms(model), 0], [0.07, 0.07, 0.06])
    robot = [i for i in range(model.nbody) if model.body(i).name.startswith("lwr_")]
    assert model.body_mass[robot].sum() == pytest.approx(1.21 + 4 * 2.30 + 1.60 + 1.49 + 0.11)


def test_kinematics_and_capsules_agree_with_the_robot_model(simulation):
    rng = np.random.default_rng(0)
    model, data = simulation.scene.model, mujoco.MjData(simulation.scene.model)
    for q in rng.uniform(ROBOT.lower, ROBOT.upper, (200, 7)):
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        points = ROBOT.frames(q)
        np.testing.assert_allclose(data.site("tool").xpos, points[3], atol=1e-9)
        for part, geom in enumerate(robot_geoms(model)):
            axis = data.geom_xmat[geom].reshape(3, 3)[:, 2] * model.geom_size[geom, 1]
            ends = data.geom_xpos[geom] + np.stack((-axis, axis))
            np.testing.assert_allclose(ends, points[part : part + 2], atol=1e-9)


def test_clearance_agrees_with_mujoco_and_the_planner_geometry(simulation):
    rng = np.random.default_rng(1)
    scene, data = simulation.scene, simulation.data
    for _ in range(60):
        simulation.reset(q=rng.uniform(0.9 * ROBOT.lower, 0.9 * ROBOT.upper))
        arms = ARM + rng.normal(0.0, 0.05, (2, 4, 3))
        for name, arm in zip(simulation.arm_names, arms, strict=True):
            simulation.set_arm(name, arm)
        mujoco.mj_kinematics(scene.model, data)
        found = simulation.clearance()
        pairs = {
            (part, person, limb): mujoco.mj_geomDistance(
                scene.model, data, robot_geom, limb_geom, 10.0, None
            )
            for part, robot_geom in enumerate(robot_geoms(scene.model))
            for person, row in enumerate(scene.limb_geoms)
            for limb, limb_geom in enumerate(row)
        }
        part, person, limb = min(pairs, key=pairs.get)
        if pairs[part, person, limb] > 1e-3:  # penetration depth is no axis distance
            assert found.distance == pytest.approx(pairs[part, person, limb], abs=1e-6)
            assert found.robot_part == ("upper_arm", "lower_arm", "hand")[part]
            assert found.arm == f"person{person + 1}"
            assert found.limb == ("upper_arm", "forearm", "hand")[limb]
        limbs = np.stack((arms[:, :-1], arms[:, 1:]), axis=2).reshape(-1, 2, 3)
        ours = capsule_distances(
            ROBOT.robot_capsules(simulation.q),
            ROBOT.capsule_radii,
            limbs,
            np.tile(ArmRadii().array, 2),
        )
        assert found.distance == pytest.approx(ours.min(), abs=1e-12)


def test_the_robot_comes_at_somebody_as_fast_as_the_distance_shrinks(simulation):
    rng = np.random.default_rng(3)
    step_s, compared = 1e-6, 0
    for _ in range(60):
        q = rng.uniform(0.9 * ROBOT.lower, 0.9 * ROBOT.upper)
        qd = rng.normal(0.0, 1.0, 7)
        simulation.reset(q=q)
        for name in simulation.arm_names:
            simulation.set_arm(name, ARM + rng.normal(0.0, 0.05, (4, 3)))
        simulation.qd[:] = qd
        found = simulation.clearance()
        simulation.q[:] = q - step_s * qd
        before = simulation.clearance()
        simulation.q[:] = q + step_s * qd
        after = simulation.clearance()
        pairs = {(c.robot_part, c.arm, c.limb) for c in (before, found, after)}
        if len(pairs) == 1:
            slope = (before.distance - after.distance) / (2.0 * step_s)
            assert found.approach == pytest.approx(slope, abs=1e-5)
            compared += 1
    assert compared > 50
    simulation.qd[:] = 0.0
    assert simulation.clearance().approach == 0.0
    for name in simulation.arm_names:
        simulation.set_arm(name, None)
    simulation.qd[:] = 1.0
    assert simulation.clearance().approach == 0.0


def test_table_clearance_agrees_with_mujoco(simulation):
    rng = np.random.default_rng(2)
    scene, data = simulation.scene, simulation.data
    for q in rng.uniform(0.9 * ROBOT.lower, 0.9 * ROBOT.upper, (100, 7)):
        simulation.reset(q=q)
        mujoco.mj_kinematics(scene.model, data)
        theirs = min(
            mujoco.mj_geomDistance(scene.model, data, geom, scene.table_geom, 10.0, None)
            for geom in robot_geoms(scene.model)
        )
        if theirs > 1e-3:
            assert simulation.table_clearance() == pytest.approx(theirs, abs=1e-5)
        else:
            assert simulation.table_clearance() < 2e-3


def test_holds_still_against_gravity():
    simulation = Simulation(scenario())
    simulation.step(2000)
    assert np.abs(simulation.q - START).max() <= 1e-4
    assert np.abs(simulation.torque).max() > 5.0
    assert simulation.clearance().distance == np.inf


def test_tracks_a_minimum_jerk_motion():
    simulation = Simulation(scenario())
    simulation.controller.accept(min_jerk(START, END, 5_000_000))
    worst = 0.0
    for _ in range(1600):
        simulation.step()
        worst = max(worst, np.abs(simulation.q - simulation.controller.q_ref).max())
    assert worst <= 2e-3
    np.testing.assert_allclose(simulation.q, END, atol=1e-4)
    np.testing.assert_allclose(simulation.tool_position(), ROBOT.frames(END)[3], atol=1e-4)


@pytest.mark.parametrize("moment", [0.4, 0.75, 1.1])
def test_robot_is_at_rest_200_ms_after_the_last_heartbeat(moment):
    simulation = Simulation(scenario(), config=SimulatorConfig(command_timeout=0.1))
    simulation.controller.chain.command(1.0, 0)
    simulation.controller.accept(min_jerk(START, END, 5_000_000))
    for _ in range(round(moment * 1000)):
        if simulation.time_ns % 20_000_000 == 0:
            simulation.controller.chain.command(1.0, simulation.time_ns)
            last = simulation.time_ns
        simulation.step()
    assert np.abs(simulation.qd).max() > 0.1
    simulation.step((last + 200_000_000 - simulation.time_ns) // 1_000_000)
    assert np.abs(simulation.qd).max() < 0.01
    assert np.abs(simulation.q - simulation.controller.q_ref).max() < 2e-3


def test_torques_stay_within_the_motors():
    simulation = Simulation(scenario())
    simulation.controller.hold(START + 0.8)
    for _ in range(300):
        simulation.step()
        assert (np.abs(simulation.torque) <= ROBOT.effort).all()


def arm_at_the_tool(simulation):
    tool = simulation.tool_position()
    return tool + np.array([[0.5, 0.0, 0.1], [0.3, 0.1, 0.0], [0.12, 0.0, 0.0], [0.05, 0.0, 0.0]])


def test_touching_is_noticed_and_pushes():
    results = {}
    for contacts in (True, False):
        simulation = Simulation(scenario(), contacts=contacts)
        simulation.set_arm("person1", arm_at_the_tool(simulation))
        simulation.step(50)
        results[contacts] = simulation.contacts(), np.abs(simulation.q - START).max()
        if not contacts:
            assert simulation.clearance().distance < -0.02
            assert simulation.clearance().limb == "hand"
    assert results[True][0][0] >= 1
    assert results[True][0][1] == 0
    assert results[True][1] > 1e-3
    assert results[False][0] == (0, 0)
    assert results[False][1] <= 1e-4


def test_table_contact_is_counted_apart():
    simulation = Simulation(scenario())
    simulation.reset(q=np.array([0.0, -1.1, 0.0, 1.1, 0.0, -0.9, 0.0]))
    assert simulation.table_clearance() > 0.02
    simulation.controller.hold(np.array([0.0, -1.25, 0.0, 1.1, 0.0, -0.9, 0.0]))
    simulation.step(300)
    people, table = simulation.contacts()
    assert people == 0
    assert table >= 1
    assert simulation.table_clearance() > -0.02


def test_hidden_arm_is_gone():
    simulation = Simulation(scenario())
    simulation.set_arm("person1", arm_at_the_tool(simulation))
    assert simulation.arm("person1") is not None
    simulation.set_arm("person1", None)
    simulation.step(5)
    assert simulation.arm("person1") is None
    assert simulation.contacts() == (0, 0)
    assert simulation.clearance().distance == np.inf


def test_same_seed_same_bytes():
    def run(seed):
        simulation = Simulation(
            scenario(), seed=seed, config=SimulatorConfig(start_noise=0.01, command_timeout=0.1)
        )
        simulation.controller.chain.command(0.8, 0)
        simulation.controller.accept(min_jerk(START, END, 30_000_000))
        for step in range(0, 400, 4):
            simulation.controller.chain.command(0.8, simulation.time_ns)
            simulation.set_arm("person1", ARM + 0.0005 * step)
            simulation.step(4)
        return state_of(simulation), simulation

    first, simulation = run(3)
    assert first == run(3)[0]
    assert first != run(4)[0]
    simulation.reset(seed=3)
    assert simulation.time_ns == 0
    assert state_of(simulation) == state_of(
        Simulation(scenario(), seed=3, config=SimulatorConfig(start_noise=0.01))
    )


def test_wrong_arms_and_postures_are_refused(simulation):
    with pytest.raises(DataError, match=r"no arm 'bob'.*person1, person2"):
        simulation.set_arm("bob", ARM)
    with pytest.raises(DataError, match="not finite"):
        simulation.set_arm("person1", ARM * np.nan)
    with pytest.raises(DataError, match=r"shape \(3, 3\)"):
        simulation.set_arm("person1", ARM[:3])
    long = ARM.copy()
    long[0, 0] += LONGEST_LIMB
    with pytest.raises(DataError, match="upper_arm of person1 is"):
        simulation.set_arm("person1", long)
    with pytest.raises(DataError, match="outside the joint limits"):
        simulation.reset(q=np.full(7, 3.0))
    with pytest.raises(ConfigError, match="bandwidth"):
        SimulatorConfig(bandwidth=0.0)


def test_speed_is_far_above_real_time():
    # The bar is 20; machines that run tests may be busy.
    speed = measure_speed(scenario(), seconds=1.0)
    assert speed.realtime_factor > 10.0


def test_both_arms_of_a_person_are_there():
    person = PersonSpec(id="ann", both_arms=True)
    both = Simulation(scenario(persons=(person,)))
    assert both.arm_names == ("ann", "ann/left")
    both.set_arm("ann", ARM + np.array([0.0, 2.0, 0.0]))
    assert both.clearance().arm == "ann"
    both.set_arm("ann/left", arm_at_the_tool(both))
    both.step()
    assert both.clearance().arm == "ann/left"
    assert both.clearance().distance < 0.0
    assert both.contacts()[0] > 0
    both.set_arm("ann/left", None)
    assert both.clearance().arm == "ann"
