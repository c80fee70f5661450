"""Trials in lock-step: all nodes of an experiment, from the first goal to the last update."""

import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
from std_srvs.srv import Trigger

from hri_planner.dmp.model_file import load_dmp, save_dmp
from hri_planner.nodes.adaptation_node import AdaptationNode
from hri_planner.pibb.experiment import Experiment
from hri_planner.pibb.experiment_file import find_experiment, load_experiment
from hri_planner.pibb.storage import load_session
from hri_planner.robot.model import load_robot
from hri_prediction.errors import ConfigError
from hri_prediction.ros.messages import AdaptationStatus, GoalGuess, LoadModel, ReachTarget, Reset
from hri_prediction.ros.qos import SENSOR, reliable
from hri_prediction.ros.time import seconds_to_ns, to_time
from hri_sim.launch.adaptation import AdaptationOptions
from hri_sim.launch.lockstep import adaptation_graph, run_in_lockstep
from hri_sim.nodes.observer_node import ObserverNode
from hri_sim.testing.graph import Graph

ROBOT = load_robot()


def short(name: str = "transfer") -> Experiment:
    """Two goals and six trials."""
    found = load_experiment(find_experiment(name))
    kept = list(found.goals)[:2]
    plan = replace(found.improvement.lasting(1), rollouts=2, habituation=1)
    return found.with_(
        goals={goal: found.goals[goal] for goal in kept},
        targets={goal: found.targets[goal] for goal in kept},
        improvement=plan,
        duration=1.5,
    )


def options(
    folder: Path, experiment: Experiment | None = None, **changes: object
) -> AdaptationOptions:
    return replace(
        AdaptationOptions(folder, experiment or short(), "ann", 3, record=False), **changes
    )


def adaptation(graph: Graph) -> AdaptationNode:
    node = graph.nodes["adaptation"]
    assert isinstance(node, AdaptationNode)
    return node


def until(graph: Graph, stage: int, timeout_s: float = 20.0) -> None:
    graph.run_until(lambda: adaptation(graph).stage == stage, timeout_s)


def after(count: int, graph: Graph) -> Callable[[], bool]:
    return lambda: len(adaptation(graph).session.state.results) >= count


def guess(graph: Graph, goal: str, ahead_s: float = 0.0) -> None:
    stamp = to_time(seconds_to_ns(graph.now_s + ahead_s))
    message = GoalGuess(header=Header(stamp=stamp), body_id="person1", goal=goal)
    graph.publish(GoalGuess, "humans/guess", message, reliable(10))


@pytest.mark.parametrize("name", ["transfer", "preliminary_end_effector"])
def test_a_whole_experiment(tmp_path: Path, name: str) -> None:
    experiment = short(name)
    said: list[int] = []
    conducted = run_in_lockstep(
        options(tmp_path, experiment), lambda done, of, note: said.append(done)
    )
    session = conducted.session
    assert 0.0 < conducted.nearest_m < 0.5  # on the ways back
    assert said == list(range(1, 7))
    results = session.state.results
    assert len(results) == session.trials == 6
    for result in results:
        assert 0.3 < result.terms.prediction_time < 6.0
        assert result.clearance > 0.0
        assert (result.terms.human_duration > 0.0) == (experiment.response == "hand")
        # Also of a policy that was loaded a moment before: its motion begins at once, and at full speed.
        assert result.terms.deviation < 0.03**2
    assert session.state.update == 1
    first = experiment.initial_policy(ROBOT)
    changed = [
        not np.array_equal(session.state.policy.weights[goal], first.weights[goal])
        for goal in experiment.goals
    ]
    assert any(changed)
    # What others read is there too.
    policy = load_dmp(tmp_path / "trials" / "policy.npz")
    for goal, own in policy.weights.items():
        assert own == pytest.approx(session.state.policy.weights[goal])
    assert (tmp_path / "trials" / "trials.csv").read_text().count("\n") == 7


@pytest.mark.parametrize("away_m", [0.14, 0.16])
def test_a_hand_that_keeps_the_robot_off_its_goal_does_not_break_the_trial_off(
    tmp_path: Path, away_m: float
) -> None:
    """The person has answered with a hand beside the goal, nearer than the filter lets a robot come."""
    experiment = short()
    beside = away_m * np.array((0.95, 0.12, -0.29))
    targets = {goal: place + beside for goal, place in experiment.goals.items()}
    with adaptation_graph(options(tmp_path, experiment.with_(targets=targets))) as graph:
        node, off = adaptation(graph), []
        for count in (1, 2):
            until(graph, AdaptationStatus.ANSWERING)
            assert node._trial is not None
            tool = ROBOT.frames(node._heard.q)[3]
            off.append(float(np.linalg.norm(tool - experiment.goals[node._trial.goal])))
            graph.run_until(after(count, graph), 10.0)
        assert max(off) > 0.008
        assert graph.messages("/adaptation/status")[-1].aborted == 0
        assert all(r.clearance > 0.03 for r in node.session.state.results)


def test_same_seed_same_trials(tmp_path: Path) -> None:
    said = []
    for _ in range(2):
        with adaptation_graph(options(tmp_path / "run")) as graph:
            graph.run_until(after(3, graph), 60.0)
            quiet = ("/diagnostics", "/rosout", "/parameter_events")
            said.append({topic: log for topic, log in graph.log.items() if topic not in quiet})
            said[-1]["trials"] = adaptation(graph).session.state.results
        shutil.rmtree(tmp_path / "run")
    assert said[0].keys() == said[1].keys()
    for topic in said[0]:
        assert said[0][topic] == said[1][topic], topic


def test_trials_go_on_after_a_kill(tmp_path: Path) -> None:
    broken = options(tmp_path / "broken")
    with adaptation_graph(broken) as graph:
        graph.run_until(after(3, graph), 60.0)
        until(graph, AdaptationStatus.MOVING)  # in the middle of the fourth
        graph.run(0.3)
        planned = adaptation(graph).session.state.order
    kept = load_session(broken.trials)[0]
    assert len(kept.state.results) == 3
    assert kept.state.order == planned
    again = run_in_lockstep(broken, lambda *_: None).session
    assert [(r.trial.goal, r.trial.sample) for r in again.state.results[3:]] == list(planned)
    assert again.state.results[:3] == kept.state.results


def test_a_folder_of_another_person_is_refused(tmp_path: Path) -> None:
    run_options = options(tmp_path)
    with adaptation_graph(run_options):
        pass
    with pytest.raises(ConfigError, match="holds trials with person 'ann'; expected person 'bob'"):
        adaptation_graph(replace(run_options, person="bob"))


def test_trials_that_began_otherwise_are_not_gone_on_with(tmp_path: Path) -> None:
    run_options, policy = options(tmp_path / "run"), tmp_path / "ways.npz"
    with adaptation_graph(run_options):
        pass
    experiment = run_options.experiment
    moved = {name: place + np.array((0.0, 0.0, 0.01)) for name, place in experiment.goals.items()}
    weights = replace(experiment.weights, task=1.0)
    way = experiment.initial_policy(ROBOT)
    bent = {name: own + 0.01 for name, own in way.weights.items()}
    save_dmp(policy, replace(way, weights=bent), {})
    for changes, words in (
        ({"seed": 4}, "seed 3; expected seed 4"),
        (
            {"experiment": experiment.with_(weights=weights)},
            "weights.task 20.0; expected weights.task 1.0",
        ),
        ({"experiment": experiment.with_(goals=moved)}, "goals.left"),
        ({"policy": policy}, "first policy"),
    ):
        with pytest.raises(ConfigError, match=re.escape(words)):
            adaptation_graph(replace(run_options, **changes))
    with adaptation_graph(run_options):
        pass


def test_nobody_answers(tmp_path: Path) -> None:
    with adaptation_graph(options(tmp_path, human="live")) as graph:
        node = adaptation(graph)
        graph.run(0.2)
        assert node.stage == AdaptationStatus.IDLE
        assert "people" in node.health()[1]  # no source says who is tracked


def test_trials_that_are_broken_off_leave_no_trace(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The person sees nothing: reaches for nothing, and says nothing.
    with adaptation_graph(options(tmp_path)) as graph:
        node = adaptation(graph)
        monkeypatch.setattr(node, "_config", replace(node._config, answer_timeout=1.0))
        graph.nodes["observer"].ignore("joint_states")
        before, planned = node.session.state, node.session.next_trial()
        graph.run_until(lambda: bool(node._aborted), 30.0)
        assert node.session.state is before
        assert node.session.next_trial() == planned
        assert load_session(tmp_path / "trials")[0].state.results == ()
        assert any("did not answer" in text for text in node.faults)
        last = graph.messages("/adaptation/status")[-1]
        assert (last.aborted, last.last_trial) == (1, -1)
        graph.run_until(lambda: node.stage == AdaptationStatus.STOPPED, 90.0)
        assert any("5 trials in a row" in text for text in node.faults)


def test_a_motion_is_lost_with_a_policy_node_that_is_started_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The middleware takes seconds to miss a killed process; one in its stead may be there by then."""
    with adaptation_graph(options(tmp_path)) as graph:
        node = adaptation(graph)
        until(graph, AdaptationStatus.MOVING)
        graph.run(0.3)
        monkeypatch.setattr(node._requests._reach, "server_is_ready", lambda: True)
        graph.kill("policy")
        graph.run_until(lambda: bool(node._aborted), 6.0)
        assert any("nothing of the motion for 5 s" in text for text in node.faults)
        assert node.session.state.results == ()


def test_a_motion_that_somebody_else_began_is_waited_for(tmp_path: Path) -> None:
    """As that of an adaptation node which was killed meanwhile."""
    with adaptation_graph(options(tmp_path / "run")) as graph:
        node = adaptation(graph)
        node.stage = AdaptationStatus.OVER
        graph.run(0.2)
        policy = short().initial_policy(ROBOT)
        save_dmp(tmp_path / "ways.npz", policy, {})
        request = LoadModel.Request(path=str(tmp_path / "ways.npz"))
        assert graph.call(LoadModel, "policy/load_model", request).success
        handle = graph.reach(_goal(tuple(policy.goals["left"]), 6.0), "/policy/reach_target")
        graph.run(0.2)
        node.stage = AdaptationStatus.IDLE
        graph.run(4.0)
        assert "the policy node still moves the robot" in node.health()[1]
        graph.run_until(after(1, graph), 30.0)
        assert handle.result is not None
        assert handle.result.outcome == ReachTarget.Result.REACHED
        assert node._aborted == 0


def test_an_observer_that_hears_of_a_trial_late_watches_the_rest_of_it(tmp_path: Path) -> None:
    """As when processes find each other while the first trial has begun."""
    with adaptation_graph(options(tmp_path)) as graph:
        observer = graph.nodes["observer"]
        assert isinstance(observer, ObserverNode)
        observer.ignore("adaptation/status")
        until(graph, AdaptationStatus.MOVING)
        observer.listen(AdaptationStatus, "adaptation/status", observer._on_status, reliable(10))
        graph.run_until(after(1, graph), 20.0)
        assert not adaptation(graph).faults


def test_an_observer_who_was_misled_before_a_trial_withdraws_the_hand(tmp_path: Path) -> None:
    """A simulator that is started again puts the robot back, which looks like the motion of a trial."""
    with adaptation_graph(options(tmp_path)) as graph:
        node = adaptation(graph)
        graph.run_until(after(1, graph), 20.0)
        until(graph, AdaptationStatus.RETURNING)
        graph.run(0.3)
        assert graph.call(Reset, "simulator/reset", Reset.Request(seed=3)).success
        waits = "a hand is at a target: the trial begins when it is withdrawn"
        graph.run_until(lambda: node.health()[1] == waits, 10.0)
        graph.run_until(after(2, graph), 20.0)
        assert node._aborted == 0


def test_an_observer_who_sees_nothing_of_the_robot_does_not_begin(tmp_path: Path) -> None:
    """Processes find one that was started again at different times; it is elsewhere by then."""
    with adaptation_graph(options(tmp_path)) as graph:
        node, observer = adaptation(graph), graph.nodes["observer"]
        assert isinstance(observer, ObserverNode)
        graph.run_until(after(1, graph), 20.0)
        until(graph, AdaptationStatus.RETURNING)
        observer.ignore("joint_states")
        until(graph, AdaptationStatus.READY)
        graph.run(0.1)
        assert not observer._watching
        observer.listen(JointState, "joint_states", observer._on_joints, SENSOR)
        graph.run_until(after(2, graph), 20.0)
        waits = {message.reason for message in graph.messages("/adaptation/status")}
        assert not any("a hand is at a target" in reason for reason in waits)
        assert node._aborted == 0


def test_answers_that_do_not_count(tmp_path: Path) -> None:
    with adaptation_graph(options(tmp_path, short("preliminary_end_effector"))) as graph:
        node = adaptation(graph)
        goals = list(node.session.experiment.goals)
        graph.run(0.1)
        guess(graph, goals[0])
        graph.run(0.04)
        assert any("no trial is on" in text for text in node.faults)
        guess(graph, "nowhere")
        graph.run(0.04)
        assert any("'nowhere' is no goal" in text for text in node.faults)
        until(graph, AdaptationStatus.MOVING)
        guess(graph, goals[0])
        graph.run(0.02)
        assert any("before the robot moved" in text for text in node.faults)
        # A key counts, and the first one.
        graph.run(0.3)
        guess(graph, goals[0], ahead_s=3600.0)
        graph.run(0.02)
        assert any("ahead of the clock" in text for text in node.faults)
        guess(graph, goals[1])
        graph.run(0.2)
        guess(graph, goals[0])
        graph.run_until(after(1, graph), 20.0)
        result = node.session.state.results[0]
        assert result.guess == goals[1]
        assert result.terms.prediction_time == pytest.approx(0.32, abs=0.06)


def test_an_update_on_demand(tmp_path: Path) -> None:
    with adaptation_graph(options(tmp_path)) as graph:
        node = adaptation(graph)
        answer = graph.call(Trigger, "adaptation/update", Trigger.Request())
        assert not answer.success
        assert "two trials" in answer.message
        graph.run_until(after(2, graph), 60.0)  # the habituation
        until(graph, AdaptationStatus.MOVING)
        answer = graph.call(Trigger, "adaptation/update", Trigger.Request())
        assert not answer.success
        assert "a trial is on" in answer.message
        graph.run_until(lambda: any(len(c) > 1 for c in node.session.state.costs.values()), 90.0)
        answer = graph.call(Trigger, "adaptation/update", Trigger.Request())
        assert answer.success, answer.message
        until(graph, AdaptationStatus.OVER)


@pytest.mark.parametrize(
    "stage", [AdaptationStatus.IDLE, AdaptationStatus.RETURNING, AdaptationStatus.READY]
)
def test_an_update_on_demand_in_each_stage_between_trials(tmp_path: Path, stage: int) -> None:
    """The next trial is one of the policy that the update made, and the node has loaded that one."""
    experiment = short()
    plan = experiment.improvement.lasting(2)
    with adaptation_graph(options(tmp_path, experiment.with_(improvement=plan))) as graph:
        node = adaptation(graph)

        def ready() -> bool:
            enough = any(len(costs) > 1 for costs in node.session.state.costs.values())
            return enough and node.stage == stage

        graph.run_until(ready, 120.0)
        answer = graph.call(Trigger, "adaptation/update", Trigger.Request())
        assert answer.success, answer.message
        assert node.session.state.update == 1
        until(graph, AdaptationStatus.MOVING, 30.0)
        assert not node.faults
        trial = node.session.next_trial()
        assert trial is not None
        assert trial.update == 1
        held = load_dmp(tmp_path / "trials" / "trial.npz")
        wanted = node.session.policy_of(trial)
        for goal, own in wanted.weights.items():
            assert held.weights[goal] == pytest.approx(own)


def test_a_trial_begins_when_hands_rest(tmp_path: Path) -> None:
    with adaptation_graph(options(tmp_path)) as graph:
        node = adaptation(graph)
        until(graph, AdaptationStatus.READY)
        tip, moved = np.array((0.9, 0.2, 0.1)), 0.0
        for count in range(100):  # somebody else's hand, which waves beside the targets
            moved = 0.05 * (count % 2)
            node.hand_seen("person2", seconds_to_ns(graph.now_s), tip + moved)
            graph.run(0.02)
        assert node.stage == AdaptationStatus.READY
        assert "a hand moves" in node.health()[1]
        graph.run(1.0)
        assert node.stage == AdaptationStatus.MOVING


def test_policies_and_goals_that_the_policy_node_does_not_take(tmp_path: Path) -> None:
    experiment = short()
    policy = experiment.initial_policy(ROBOT)
    file = tmp_path / "ways.npz"
    save_dmp(file, policy, {})
    with adaptation_graph(options(tmp_path / "run", experiment)) as graph:
        graph.nodes["adaptation"].stage = AdaptationStatus.OVER  # this test asks instead
        graph.run(0.2)
        answer = graph.call(LoadModel, "policy/load_model", LoadModel.Request(path=str(file)))
        assert answer.success, answer.message
        assert "left" in answer.message
        handle = graph.reach(_goal((0.5, 0.0, 0.3)), "/policy/reach_target")
        graph.run_until(lambda: handle.done, 5.0)
        assert handle.result is not None
        assert handle.result.outcome == ReachTarget.Result.UNREACHABLE
        assert "knows no way" in handle.result.reason
        assert "left" in handle.result.reason
        # Its duration is the one that is asked for.
        handle = graph.reach(_goal(tuple(policy.goals["left"]), 3.0), "/policy/reach_target")
        graph.run_until(lambda: handle.done, 10.0)
        assert handle.result is not None
        assert handle.result.outcome == ReachTarget.Result.REACHED
        assert handle.result.duration == pytest.approx(3.0, abs=0.5)
        back = graph.reach(_goal(tuple(policy.start)), "/policy/reach_target")
        graph.run_until(lambda: back.done, 10.0)
        assert back.result is not None
        assert back.result.outcome == ReachTarget.Result.REACHED


def _goal(place: tuple[float, ...], duration: float = 0.0) -> ReachTarget.Goal:
    goal = ReachTarget.Goal(duration=duration)
    position = goal.pose.pose.position
    position.x, position.y, position.z = (float(value) for value in place)
    return goal
