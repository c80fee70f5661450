"""One condition in virtual time: what counts as success, what planners know, and when."""

import dataclasses
import math

import numpy as np
import pytest

from hri_planner.ptomp.budget import replan_charge
from hri_planner.robot import load_robot
from hri_prediction.errors import ConfigError
from hri_sim.benchmark import episode
from hri_sim.benchmark.conditions import task_conditions
from hri_sim.benchmark.episode import run_episode
from hri_sim.benchmark.learning import task_library
from hri_sim.benchmark.observers import OBSERVERS
from hri_sim.benchmark.outcome import Execution, Outcome, measure, time_to_collision
from hri_sim.benchmark.planners import (
    NOMINAL,
    ORACLE_SETUP,
    PLANNERS,
    PlannerSetup,
    find_planners,
)
from hri_sim.people.tracking import TrackingModel, tracked_samples
from hri_sim.scenario.nominal import nominal_motion

PTOMP = PLANNERS["ptomp"]


def test_planners_name_what_exists():
    for name, setup in PLANNERS.items():
        assert setup.name == name
        assert setup.observer is None or setup.observer in OBSERVERS
        assert setup.config.num_timesteps > 0
    assert ORACLE_SETUP.name not in PLANNERS
    with pytest.raises(ConfigError, match="marign"):
        assert PlannerSetup("typo", "", settings=(("marign", 0.1),)).config


@pytest.fixture(scope="module")
def condition():
    return task_conditions("tuning", 0).conditions[0]


@pytest.fixture(scope="module")
def library():
    return task_library("tuning", 0)


def test_the_nominal_motion_collides_in_every_condition(library):
    for condition in task_conditions("tuning", 1).conditions:
        outcome = run_episode(condition, PLANNERS[NOMINAL], library, slowdown=1.0, seed=0)
        assert not outcome.ok
        assert outcome.clearance < 0.0
        assert outcome.goal_error < 1e-3 or outcome.time_to_goal is not None
        assert (outcome.replans, outcome.time_to_collision) == (0, 0.0)


def test_ptomp_gets_there_and_repeats_to_the_bit(condition, library):
    outcome = run_episode(condition, PTOMP, library, slowdown=8.0, seed=3)
    assert outcome.strict
    assert outcome.replans > 30
    assert outcome.failures == 0
    assert 1.0 < outcome.time_to_goal < 4.0
    assert outcome == run_episode(condition, PTOMP, library, slowdown=8.0, seed=3)
    assert outcome != run_episode(condition, PTOMP, library, slowdown=8.0, seed=4)


def test_slower_machines_replan_and_iterate_less(condition, library):
    runs = [run_episode(condition, PTOMP, library, slowdown=f, seed=0) for f in (1.0, 64.0, 512.0)]
    assert runs[0].iterations > runs[1].iterations > runs[2].iterations
    assert runs[0].replans > runs[1].replans > runs[2].replans
    assert runs[2].time_to_goal is None or runs[2].time_to_goal > 4.0


@pytest.mark.parametrize("most", [0, 3])
def test_iterations_can_be_capped(condition, library, most):
    capped = dataclasses.replace(PTOMP, max_iterations=most)
    outcome = run_episode(condition, capped, library, slowdown=1.0, seed=0)
    assert outcome.replans > 10
    assert outcome.iterations <= most * outcome.replans
    assert (outcome.iterations > 0) is (most > 0)


def test_a_late_plan_knows_only_what_was_known_when_its_work_began(condition, library, monkeypatch):
    """At F = 64 a replan takes several intervals: its forecast is that old at the hand-over."""
    ages = []
    replan = episode._replan

    def note(planner, handover_s, forecasts, iterations):
        ages.append(handover_s - forecasts[0].time0_s)
        return replan(planner, handover_s, forecasts, iterations)

    monkeypatch.setattr(episode, "_replan", note)
    interval, latency = 1.5 / 42, 0.008
    run_episode(condition, PTOMP, library, slowdown=1.0, seed=0)
    assert max(ages) <= interval + latency + 0.004 + 1e-9
    assert min(ages) >= interval + latency - 1e-9
    ages.clear()
    run_episode(condition, PTOMP, library, slowdown=64.0, seed=0)
    work = 64.0 * replan_charge(PTOMP.config) - interval  # less what was left over
    assert min(ages) >= work


def test_planners_of_a_seed_see_the_same_samples(condition, library, monkeypatch):
    seen = []
    make = OBSERVERS["staying"]

    def recording(person, known):
        observer = make(person, known)
        see = observer.see
        observer.see = lambda sample: (seen.append(sample.keypoints.tobytes()), see(sample))
        return observer

    monkeypatch.setitem(OBSERVERS, "staying", recording)
    for settings in ((), (("num_rollouts", 10),)):
        setup = PlannerSetup("other", "", "staying", settings)
        run_episode(condition, setup, library, slowdown=64.0, seed=0)
        seen.append("end")
    first = seen.index("end")
    second = seen[first + 1 : -1]
    common = min(first, len(second))
    assert common > 200
    assert seen[:common] == second[:common]


def test_observers_know_what_they_should(condition, library):
    """Half way through the reach, the end of it: the oracle exactly, ProMP well, others not."""
    person = condition.person()
    (motion,) = person.motions
    now = motion.start_s + 0.5 * motion.duration
    count = math.floor((now + 0.5) * 250)
    tracking = TrackingModel(person.spec, np.random.default_rng(0))
    samples = tracked_samples(person, tracking, -500_000_000, count)
    end = np.array([motion.end_s])
    truth = person.truth(end)[0, 2]
    errors = {}
    for name, make in OBSERVERS.items():
        observer = make(person, library)
        for tracked in samples:
            observer.see(tracked.sample)
        forecast = observer.forecast(now)
        if name == "unseen":
            assert forecast is None
            continue
        mean, _ = forecast.sample(end)
        errors[name] = float(np.linalg.norm(mean[0, 0, 2] - truth))
    assert errors["oracle"] < 1e-3
    assert errors["promp"] < 0.06
    assert errors["staying"] > 0.05
    assert errors["promp"] < errors["staying"]


def test_the_oracle_is_no_contestant_and_solves_it(condition, library):
    assert run_episode(condition, ORACLE_SETUP, library, slowdown=1.0, seed=0).ok
    with pytest.raises(ConfigError, match=r"nominal"):
        find_planners(["oracle"])
    with pytest.raises(ConfigError, match="once"):
        find_planners(["ptomp", "ptomp"])


OUTCOME = Outcome(0.03, 0.02, 1e-5, 1e-4, 1.5, 1.0, 0.01, 30.0, 0.4, 42, 0, 900)


@pytest.mark.parametrize(
    ("change", "ok", "strict"),
    [
        ({}, True, True),
        ({"clearance": 0.0}, False, False),
        ({"time_to_goal": None, "hold_clearance": None, "hold_error": None}, False, False),
        ({"hold_clearance": -0.001}, True, False),
        ({"hold_error": 0.02}, True, False),
        ({"speed_share": 1.06}, True, False),
        ({"table_clearance": -0.001}, True, False),
    ],
)
def test_success(change, ok, strict):
    outcome = dataclasses.replace(OUTCOME, **change)
    assert (outcome.ok, outcome.strict) == (ok, strict)
    assert outcome.clear(0.02) == ok
    assert not outcome.clear(0.05)


def test_measures_of_a_known_motion(condition):
    """The nominal motion: its acceleration integral in closed form, its speed, its length."""
    robot, scenario = load_robot(), condition.scenario
    start = np.array(scenario.robot_start)
    _, q = nominal_motion(robot, start, condition.robot_goal, 1.5)
    way = q[-1] - q[0]
    tau = np.linspace(0.0, 1.0, 376)[:, None]
    qd = way * (30 * tau**2 - 60 * tau**3 + 30 * tau**4) / 1.5
    qdd = way * (60 * tau - 180 * tau**2 + 120 * tau**3) / 1.5**2
    far = np.full((376, 4, 3), 5.0) + np.arange(4)[:, None]
    run = Execution(0.004, q, qd, qdd, far, 375)
    found = measure(
        robot,
        run,
        np.array(condition.robot_goal),
        scenario.table,
        replans=0,
        failures=0,
        iterations=0,
    )
    # Integral of (60 t - 180 t^2 + 120 t^3)^2 over 0..1 is 120/7.
    assert found.accel_cost == pytest.approx(120.0 / 7.0 / 1.5**3 * float(way @ way), rel=1e-3)
    assert found.speed_share == pytest.approx(
        float((1.875 * np.abs(way) / 1.5 / robot.velocity).max()), rel=1e-3
    )
    assert found.time_to_goal == pytest.approx(1.5)
    assert found.goal_error < 1e-6
    assert found.clearance > 5.0


def test_time_to_collision():
    shrinking = np.linspace(1.0, 0.5, 51)  # 0.01 a step of 4 ms: 2.5 m/s
    assert time_to_collision(shrinking, 0.004) == pytest.approx(0.5 / 2.5)
    assert time_to_collision(shrinking[::-1], 0.004) is None
    assert time_to_collision(shrinking - 0.5, 0.004) == 0.0
