"""Adaptation node: lets a person read the robot's motions, trial by trial, and improves them by PI^BB.

Each trial: the robot goes back to its start; the policy node is given the trial's sample of the policy and
sent to its goal; the person's answer is taken from ``humans/guess`` or a hand at a target. When both are
over the costs are known, all is saved, and after the last trial of an update the policy improves. What
comes next is decided by :class:`hri_planner.pibb.session.Session`.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from hri_planner.dmp.policy import PERIOD_S, DmpPolicy
from hri_planner.nodes.adaptation_config import AdaptationConfig
from hri_planner.nodes.adaptation_reporting import STAGES, status_of
from hri_planner.nodes.adaptation_requests import PolicyRequests
from hri_planner.pibb.beginning import opened_session
from hri_planner.pibb.costs import squared_jerk
from hri_planner.pibb.nearness import Nearness
from hri_planner.pibb.recording import Recording, Stirring, check_clock
from hri_planner.pibb.session import Session, Trial
from hri_planner.pibb.storage import save_session
from hri_planner.robot.model import load_robot
from hri_planner.ros.arms import HAND_TIP, ArmInputs, Arms
from hri_planner.ros.conversions import joints_from_message
from hri_planner.ros.inputs import NOBODY
from hri_prediction.errors import ConfigError, DataError, HriError, PlanningError
from hri_prediction.ros.messages import AdaptationStatus, GoalGuess, HumanArm, IdsList
from hri_prediction.ros.node import ERROR, OK, WARN, HriNode, run_node
from hri_prediction.ros.parameters import declare_config
from hri_prediction.ros.qos import LISTS, SENSOR, reliable
from hri_prediction.ros.time import seconds_to_ns, to_ns
from hri_prediction.ros.tracked import TRACKED

TICK_S = 0.02
STATUS_NS = 200_000_000
"""Time between two messages of the status when nothing happens [ns]."""
AT_START_M = 0.006
"""A tool so near to the start is there: policies end their motions within 5 mm [m]."""
_KEPT_NS = 500_000_000
"""A filter that has changed nothing for so long does not keep the robot from anywhere [ns]."""
_SILENT_NS = 500_000_000
"""A robot of which nothing has been heard for so long is waited for [ns]."""
_MOVES_RAD_S = 0.02
"""A robot with a faster joint moves; on one that rests people may lay a hand between trials [rad/s]."""
TRIAL_FILE = "trial.npz"
"""The policy with the present trial's sample, for the policy node."""

IDLE, RETURNING, READY = AdaptationStatus.IDLE, AdaptationStatus.RETURNING, AdaptationStatus.READY
MOVING, ANSWERING = AdaptationStatus.MOVING, AdaptationStatus.ANSWERING
OVER, STOPPED = AdaptationStatus.OVER, AdaptationStatus.STOPPED


class AdaptationNode(HriNode):
    """Conducts the trials of one experiment with one person.

    Attributes:
        session: The trials.
        stage: As in the status.
    """

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("adaptation", period_s=TICK_S, **kwargs)
        config = declare_config(self, AdaptationConfig)
        if not config.folder:
            raise ConfigError(
                "the parameter folder is empty", expected="where trials are kept", hint="set it"
            )
        # Once before anything moves: what it imports takes half a second.
        squared_jerk(np.zeros((100, 1)), PERIOD_S)
        self._config, self._robot = config, load_robot()
        self._folder = Path(config.folder).resolve()
        opened = opened_session(
            self._folder,
            config.experiment,
            person=config.person,
            seed=config.seed,
            policy=config.policy,
            robot=self._robot,
        )
        self.session: Session = opened.session
        self._begun = opened.begun
        done = len(self.session.state.results)
        self.get_logger().info(f"{done} of {self.session.trials} trials are done")
        experiment = self.session.experiment
        self._targets = dict(experiment.targets) if experiment.response == "hand" else {}
        self._stirring = Stirring(self._targets.values())
        self._near: Nearness | None = None
        self._between = Nearness(self._robot, experiment.solids)
        self._heard = ArmInputs(radii=config.radii)
        self._joints_ns: int | None = None
        self._trial: Trial | None = None
        self._policy: DmpPolicy | None = None
        self._recording: Recording | None = None
        self._aborted = self._in_row = 0
        self._beside_ns: int | None = None
        self._next_status_ns = 0
        self._enter(IDLE, self.now_ns())
        self._status = self.announce(AdaptationStatus, "adaptation/status", reliable(10))
        self._requests = PolicyRequests(self, self._folder / TRIAL_FILE)
        self.listen(JointState, "joint_states", self._on_joints, SENSOR)
        self.listen(IdsList, TRACKED, _Hands(self, self._heard, config.max_future).take, LISTS)
        self.listen(GoalGuess, "humans/guess", self._on_guess, reliable(10))
        self.serve(Trigger, "adaptation/update", self._on_update)

    @property
    def between(self) -> float:
        """Smallest distance of the moving robot outside of trials that count [m]; very large at first."""
        return min(self._between.distance, NOBODY)

    def close(self) -> None:
        """Let the action go."""
        self._requests.close()

    def settled(self) -> bool:
        """Whether the policy node has answered all that it is to answer by now."""
        return self._requests.settled

    # ------------------------------------------------------------------ what is heard
    def _on_joints(self, message: JointState) -> None:
        try:
            self._heard.q, self._heard.qd = joints_from_message(message, self._robot.joint_names)
        except DataError as error:
            self.fault("joints", str(error))
            return
        self._joints_ns = self.now_ns()
        moves = float(np.abs(self._heard.qd).max()) > _MOVES_RAD_S
        if self._near is not None or moves:
            near = self._near or self._between
            near.take(self._heard.q, self._heard.separation(self._robot))
        if self._recording is not None and self.stage == MOVING:
            self._recording.joints(to_ns(message.header.stamp), self._heard.q)

    def hand_seen(self, whose: str, stamp_ns: int, tip: NDArray[np.float64]) -> None:
        """Take the place of a hand (3,) [m], by any name of its own, with its stamp [ns]."""
        try:
            check_clock("a hand", stamp_ns, self.now_ns())
        except DataError as error:
            self.fault("hand", str(error))
            return
        self._stirring.hand(whose, stamp_ns, tip)
        if self._recording is not None:
            self._recording.hand(whose, stamp_ns, tip)

    def _on_guess(self, message: GoalGuess) -> None:
        try:
            if message.goal not in self.session.experiment.goals:
                known = ", ".join(self.session.experiment.goals)
                raise DataError(f"the guess {message.goal!r} is no goal", expected=known)
            if self._recording is None:
                raise DataError(
                    f"the guess {message.goal!r} came while no trial is on",
                    hint="a guess counts from the robot's start until the trial is over",
                )
            stamp_ns = to_ns(message.header.stamp)
            check_clock(f"the guess {message.goal!r}", stamp_ns, self.now_ns())
            self._recording.press(message.goal, stamp_ns)
        except DataError as error:
            self.fault("guess", str(error))

    def _on_update(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        before = self.session.state
        try:
            if self._recording is not None:
                raise PlanningError("a trial is on", hint="ask between two trials")
            self.session.update_now()
            self._save()
        except HriError as error:
            self.session.state = before
            response.success, response.message = False, str(error)
            return response
        self._begin_anew()
        updates = self.session.state.update
        response.success, response.message = True, f"the policy has had {updates} updates"
        return response

    # ------------------------------------------------------------------ tick
    def on_tick(self, now_ns: int) -> None:
        """Go on with the trial."""
        before = self.stage
        if self.stage not in (OVER, STOPPED):
            try:
                self._act(now_ns)
            except HriError as error:
                self._abort(str(error), now_ns)
        if self.stage != before or not 0 <= self._next_status_ns - now_ns <= STATUS_NS:
            self._next_status_ns = now_ns + STATUS_NS
            self._status.publish(
                status_of(
                    self.session,
                    now_ns=now_ns,
                    stage=self.stage,
                    reason=self._reason,
                    person=self._config.person,
                    aborted=self._aborted,
                    between=self.between,
                )
            )

    def _act(self, now_ns: int) -> None:
        silent = self._joints_ns is None or now_ns - self._joints_ns > _SILENT_NS
        if silent or self._heard.tracked is None:
            self._reason = "nothing heard of " + ("the robot" if silent else "people")
            return
        if self.stage in (RETURNING, MOVING, ANSWERING):
            self._reason = ""  # all is heard again; before a trial there may be another one
        if self.stage == IDLE:
            self._go_back(now_ns)
        elif self.stage == RETURNING:
            if self._requests.arrived():
                self._enter(READY, now_ns)
        elif self.stage == READY:
            if self._trial is None:  # an update on demand came while the robot went back
                self._enter(IDLE, now_ns)
            else:
                self._set_out(now_ns, self._trial)
        elif self.stage == MOVING:
            assert self._recording is not None
            if self._requests.begins_ns is not None:
                self._recording.begin(self._requests.begins_ns)
            if self._requests.arrived():
                self._enter(ANSWERING, now_ns)
            elif self._kept_beside(now_ns):
                # The filter keeps it off that hand: it would go to and fro until it is given up.
                self._requests.end()
        else:
            self._conclude(now_ns)

    def _go_back(self, now_ns: int) -> None:
        """To the start, from where the next trial begins; none is left: over."""
        if self._in_row and now_ns - self._since_ns < seconds_to_ns(self._config.pause):
            return  # what was in the way may take a moment
        self._begin_anew()
        self._trial = self.session.next_trial()
        if self._trial is None:
            self._enter(OVER, now_ns, "all trials are done")
            self.get_logger().info(f"over after {len(self.session.state.results)} trials")
            return
        self._reason = self._requests.not_ready()
        mean = self.session.state.policy
        if self._reason or not self._requests.has(mean, self._trial.number):
            return
        if np.linalg.norm(self._robot.frames(self._heard.q)[3] - mean.start) <= AT_START_M:
            self._enter(READY, now_ns)
            return
        self._requests.send(mean.start, mean.duration)
        self._enter(RETURNING, now_ns)

    def _set_out(self, now_ns: int, trial: Trial) -> None:
        """To the goal, once all rest."""
        if self._policy is None:
            self._policy = self.session.policy_of(trial)
        if not self._requests.has(self._policy, trial.number):
            return
        if now_ns - self._since_ns < seconds_to_ns(self._config.pause):
            return
        if self._hand_at_target():
            self._reason = "a hand is at a target: the trial begins when it is withdrawn"
            return
        if self._stirring.since(now_ns) < seconds_to_ns(self._config.pause):
            self._reason = "a hand moves beside the targets: the trial begins when it rests"
            return
        self._recording = Recording(self._robot, self._targets, self._config)
        self._near = Nearness(self._robot, self.session.experiment.solids)
        self._beside_ns = None
        self._requests.send(self._policy.goals[trial.goal], self._policy.duration)
        self._enter(MOVING, now_ns)

    def _kept_beside(self, now_ns: int) -> bool:
        """Whether the filter has kept the robot off its goal for a while, and the person has answered."""
        assert self._trial is not None
        assert self._recording is not None
        goal = self.session.experiment.goals[self._trial.goal]
        off = float(np.linalg.norm(self._robot.frames(self._heard.q)[3] - goal))
        begun_ns, kept_ns = self._requests.begins_ns, self._requests.kept_ns
        # Beside people it may go to and fro by centimetres.
        near = self._config.beside * (1.0 if self._beside_ns is None else 1.5)
        duration_ns = seconds_to_ns(self.session.state.policy.duration)
        if (
            off > near
            or self._recording.answer is None
            or begun_ns is None
            or now_ns < begun_ns + duration_ns
            or kept_ns is None
            or now_ns - kept_ns > _KEPT_NS
        ):
            self._beside_ns = None
            return False
        self._beside_ns = now_ns if self._beside_ns is None else self._beside_ns
        return now_ns - self._beside_ns >= seconds_to_ns(self._config.beside_time)

    def _conclude(self, now_ns: int) -> None:
        """Take what the trial cost, once the person has answered."""
        assert self._trial is not None
        assert self._recording is not None
        assert self._policy is not None
        assert self._near is not None
        answer = self._recording.answer
        if answer is None:
            if now_ns - self._since_ns > seconds_to_ns(self._config.answer_timeout):
                raise PlanningError("the person did not answer")
            return
        trial, before = self._trial, self.session.state
        terms = self._recording.terms(self._policy, trial.goal, self.session.indistinctness(trial))
        result = self.session.finish(trial, answer.goal, terms, min(self._near.distance, NOBODY))
        try:
            self._save()
        except HriError:
            self.session.state = before
            raise
        self._in_row, self._recording, self._near = 0, None, None
        said = "right" if terms.task == 0.0 else f"taken for {result.guess}"
        self.get_logger().info(
            f"trial {trial.number + 1} of {self.session.trials}: {trial.goal}, {said} "
            f"after {terms.prediction_time:.2f} s"
        )
        self._enter(IDLE, now_ns)

    def _abort(self, reason: str, now_ns: int) -> None:
        """Break the trial off; it leaves nothing, and is made again."""
        self._aborted += 1
        self._in_row += 1
        self.fault("trial", f"trial broken off: {reason}")
        self._requests.forget()
        self._begin_anew()
        given_up = self._in_row >= self._config.most_aborted
        if given_up:
            self.fault("stopped", f"{self._in_row} trials in a row broken off: {reason}", ERROR)
        self._enter(STOPPED if given_up else IDLE, now_ns, reason)

    def _begin_anew(self) -> None:
        """No trial is on."""
        if self._near is not None:
            self._between.join(self._near)
        self._trial = self._policy = self._recording = self._near = None
        if self.stage == READY:
            self._enter(IDLE, self.now_ns())

    def _hand_at_target(self) -> bool:
        reach = 2.0 * self._config.hand_radius
        return any(
            np.linalg.norm(arm[3] - place) <= reach
            for arm in self._heard.arms_now()
            for place in self._targets.values()
        )

    def _enter(self, stage: int, now_ns: int, reason: str = "") -> None:
        self.stage, self._since_ns, self._reason = stage, now_ns, reason

    def _save(self) -> None:
        config = self._config
        save_session(
            self._folder, self.session, person=config.person, seed=config.seed, begun=self._begun
        )

    def health(self) -> tuple[bytes, str, dict[str, Any]]:
        """How far it has come."""
        figures = {
            "trials": f"{len(self.session.state.results)} of {self.session.trials}",
            "aborted": self._aborted,
            "update": self.session.state.update,
        }
        if self.stage == STOPPED:
            return ERROR, self._reason, figures
        waits = bool(self._reason) and self.stage != OVER
        return WARN if waits else OK, self._reason or STAGES[self.stage], figures


class _Hands(Arms):
    """Arms of tracked bodies: hands answer, and the robot's distance to all is noted."""

    def __init__(self, node: AdaptationNode, inputs: ArmInputs, max_future: float) -> None:
        super().__init__(node, inputs, max_future)
        self._adaptation = node

    def take_one(self, body_id: str, message: HumanArm) -> None:
        """Take a sample."""
        sample = self.take_sample(body_id, message)
        if np.isfinite(sample.keypoints[HAND_TIP]).all():
            whose = f"{body_id} {sample.side}"
            self._adaptation.hand_seen(whose, sample.stamp_ns, sample.keypoints[HAND_TIP])


def main(args: list[str] | None = None) -> int:
    """Entry point."""
    sys.setswitchinterval(5e-4)
    return run_node(AdaptationNode, args)
