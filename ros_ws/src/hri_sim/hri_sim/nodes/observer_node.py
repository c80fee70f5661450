"""Observer node: a simulated person who watches the robot, guesses where it is going, and says so.

The person sees the tool (``joint_states``), and when sure presses a key (``humans/guess``), or reaches for
the goal's target through the robot's space, as motion capture then says. Which goal it is stands nowhere
that the person looks.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

from hri_planner.pibb.experiment_file import find_experiment, load_experiment
from hri_planner.robot.model import load_robot
from hri_planner.ros.conversions import joints_from_message
from hri_prediction.config import parameter, validate
from hri_prediction.errors import DataError
from hri_prediction.ros.conversions import WORLD
from hri_prediction.ros.messages import AdaptationStatus, GoalGuess, Reset
from hri_prediction.ros.node import OK, WARN, HriNode, run_node
from hri_prediction.ros.parameters import declare_config
from hri_prediction.ros.qos import SENSOR, reliable
from hri_prediction.ros.time import NANO, to_ns, to_time
from hri_sim.nodes.captured_bodies import CapturedBodies
from hri_sim.people.capture import CapturedArm
from hri_sim.people.seeding import tracking_generator
from hri_sim.people.tracking import SAMPLE_PERIOD_NS, TrackingModel
from hri_sim.readability.learning import TRAITS, TRIALS, generator
from hri_sim.readability.participant import Participant, participant_spec
from hri_sim.readability.traits import POPULATIONS, draw_person

_BEGINS = (AdaptationStatus.READY, AdaptationStatus.MOVING)
_SEEN_NS = 500_000_000
"""A robot of which nothing was heard for so long is not seen [ns]."""
_WATCHED = (AdaptationStatus.READY, AdaptationStatus.MOVING, AdaptationStatus.ANSWERING)


@dataclass(frozen=True)
class ObserverNodeConfig:
    """What the node needs to know."""

    experiment: str = parameter(
        "transfer", "What is done: a .yaml file, or an experiment that ships"
    )
    seed: int = parameter(0, "Seed of the person and of what the person does", low=0)
    population: str = parameter(
        "usual", "Whom the person is drawn from", choices=tuple(POPULATIONS)
    )
    body_id: str = parameter("person1", "Name of the body")

    def __post_init__(self) -> None:
        validate(self)
        participant_spec(self.body_id)


class ObserverNode(HriNode):
    """One person who takes part in an experiment of the adaptation node."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("observer", period_s=SAMPLE_PERIOD_NS / NANO, **kwargs)
        self._config = declare_config(self, ObserverNodeConfig)
        self._robot = load_robot()
        self._experiment = load_experiment(find_experiment(self._config.experiment))
        self._seed = self._config.seed
        self._tool: Any = None
        self._tool_ns: int | None = None
        self._watching = self._said = False
        self._stage = AdaptationStatus.IDLE
        self._guesses = 0
        self._joined: int | None = None
        """How many trials were over when this person came; none: not yet known."""
        self._captured = CapturedBodies(self, [self._config.body_id], self._person_anew)
        self._guess = self.announce(GoalGuess, "humans/guess", reliable(10))
        self.listen(AdaptationStatus, "adaptation/status", self._on_status, reliable(10))
        self.listen(JointState, "joint_states", self._on_joints, SENSOR)
        self.serve(Reset, "~/reset", self._on_reset)

    def _person_anew(self) -> dict[str, list[CapturedArm]]:
        experiment, name = self._experiment, self._config.body_id
        traits = draw_person(
            self._config.population, generator(self._seed, TRAITS), len(experiment.goals)
        )
        spec = participant_spec(name)
        self._participant = Participant(
            traits,
            experiment.targets,
            hand=experiment.response == "hand",
            # Who goes on with an experiment does not have the moods of its first trials again.
            rng=self._moods(),
            spec=spec,
        )
        self._watching = self._said = False
        tracking = TrackingModel(spec, tracking_generator(self._seed, name))
        return {name: [CapturedArm(self._participant.person.truth, spec.side, tracking)]}

    def _moods(self) -> np.random.Generator:
        """What differs from trial to trial."""
        if not self._joined:
            return generator(self._seed, TRIALS)
        return np.random.default_rng([self._seed, TRIALS, self._joined])

    def _on_status(self, message: AdaptationStatus) -> None:
        if self._joined is None:
            self._joined = message.trial
            if self._joined:
                self._captured.restart()
        stage = message.stage
        now_s = self._captured.seconds(self.now_ns())
        # Until it hears that the robot moves for it.
        ready = AdaptationStatus.READY in (stage, self._stage)
        if ready and stage in _BEGINS and self._participant.decision is not None:
            # The robot was put back, or had not quite come to rest: that was no trial, and none begins
            # before this hand is withdrawn.
            self._withdraw(now_s)
        self._stage = stage
        # Who hears of a trial late watches the rest of it.
        if stage in _BEGINS and not self._watching and self._sees():
            self._participant.begin(now_s, self._tool, self._experiment.goals)
            self._watching, self._said = True, False
        elif stage not in _WATCHED and self._watching:
            self._withdraw(now_s)

    def _sees(self) -> bool:
        """Whether the robot is seen: one that was seen last before a gap may be anywhere by now."""
        return self._tool_ns is not None and self.now_ns() - self._tool_ns <= _SEEN_NS

    def _withdraw(self, now_s: float) -> None:
        """Forget what the robot did; put the hand back."""
        self._watching = False
        self._participant.go_home(now_s + 0.1)

    def _on_joints(self, message: JointState) -> None:
        try:
            q, _ = joints_from_message(message, self._robot.joint_names)
        except DataError as error:
            self.fault("joints", str(error))
            return
        self._tool, self._tool_ns = self._robot.frames(np.array(q))[3], self.now_ns()
        if self._watching:
            time_s = self._captured.seconds(to_ns(message.header.stamp))
            self._participant.watch(time_s, self._tool)

    def _on_reset(self, request: Reset.Request, response: Reset.Response) -> Reset.Response:
        if request.scenario:
            response.success = False
            response.message = f"scenario {request.scenario!r}; an observer has none, only a seed"
            return response
        self._seed = int(request.seed)
        self._captured.restart()
        response.success = True
        return response

    def on_tick(self, now_ns: int) -> None:
        """Publish where the arm is; press the key when it is time."""
        self._captured.tick(now_ns)
        decision = self._participant.decision
        if decision is None or self._said or self._experiment.response != "press":
            return
        if self._captured.seconds(now_ns) < decision.shown_s:
            return
        self._said = True
        self._guesses += 1
        # Between two ticks: the key's own time, as a keyboard's driver would stamp it.
        stamp_ns = now_ns - round((self._captured.seconds(now_ns) - decision.shown_s) * NANO)
        header = Header(stamp=to_time(stamp_ns), frame_id=WORLD)
        goal = self._participant.guess
        self._guess.publish(GoalGuess(header=header, body_id=self._config.body_id, goal=goal))

    def health(self) -> tuple[bytes, str, dict[str, Any]]:
        """What the person does, or waits for."""
        if not self._watching:
            doing = "waiting"
        elif self._participant.guess:
            doing = f"sure of {self._participant.guess}"
        else:
            doing = "watching"
        figures = {
            "body": self._config.body_id,
            "keys_pressed": self._guesses,
            "captures_skipped": self._captured.skipped,
        }
        if not self._sees():
            return WARN, "nothing heard of the robot", figures
        if self._joined is None:
            return WARN, "nothing heard of the adaptation node", figures
        return OK, doing, figures


def main(args: list[str] | None = None) -> int:
    """Entry point."""
    return run_node(ObserverNode, args)
