"""Simulator node: MuJoCo LWR4+, its trajectory controller and the scene, behind a real cell's topics."""

from __future__ import annotations

import math
import time
from collections import deque
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Header, String
from trajectory_msgs.msg import JointTrajectory as JointTrajectoryMessage

from hri_prediction.config import parameter, validate
from hri_prediction.errors import ConfigError, DataError, HriError
from hri_prediction.ros.conversions import WORLD, flat, sample_from_message
from hri_prediction.ros.messages import ControllerState, HumanArm, Reset, SimState
from hri_prediction.ros.node import ERROR, OK, WARN, HriNode, run_node
from hri_prediction.ros.parameters import declare_config
from hri_prediction.ros.qos import LATCHED, SENSOR, reliable
from hri_prediction.ros.template import templates
from hri_prediction.ros.time import seconds_to_ns, to_time
from hri_sim.nodes.arms import TrueArms
from hri_sim.nodes.timed_commands import TimedCommands
from hri_sim.nodes.trajectory_messages import trajectory_from_message
from hri_sim.scenario.schema import Scenario, load_scenario
from hri_sim.scenario.shipped import scenario_or_shipped
from hri_sim.simulator.controller import IDLE, STOPPING, TRACKING
from hri_sim.simulator.simulation import STEP_NS, Simulation, SimulatorConfig
from hri_sim.simulator.stopchain import NO_HEARTBEAT, TOUCHED
from hri_sim.warm import warm_simulation

PERIOD_S = 0.004
"""Period of /joint_states [s]."""
NOBODY = 1e9
"""Clearance when nobody is in the scene [m]."""
MAX_CATCH_UP = 125
"""Periods that a late tick makes up for, with as many commands of a kind; beyond, simulated time slips
and a fault is noted. In as long a robot comes to rest whose controller hears nothing, with
`command_timeout` and `ramp_down` as launched (0.1 and 0.07 s): like a real one it stands when heard again.
"""
_STATES = {
    IDLE: ControllerState.IDLE,
    TRACKING: ControllerState.TRACKING,
    STOPPING: ControllerState.STOPPING,
}


@dataclass(frozen=True)
class SimulatorNodeConfig:
    """What the node itself needs to know."""

    scenario: str = parameter("", "Path of the scenario file; empty: the table scene that ships")
    seed: int = parameter(0, "Seed of the start posture's noise", low=0)
    contacts: bool = parameter(True, "Whether bodies push each other")
    publish_clock: bool = parameter(
        False, "Be the source of /clock, for nodes that run with use_sim_time"
    )
    realtime_factor: float = parameter(
        1.0,
        "Speed of the simulated clock against the wall clock, with publish_clock",
        low=0.01,
        high=100.0,
    )

    def __post_init__(self) -> None:
        validate(self)


class SimulatorNode(HriNode):
    """Stands in for the robot: takes trajectories, gives joint states, knows the true distances."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("simulator", period_s=PERIOD_S, **kwargs)
        config = declare_config(self, SimulatorNodeConfig)
        physics = declare_config(self, SimulatorConfig)
        if config.publish_clock and self.get_parameter("use_sim_time").value:
            raise ConfigError(
                "the simulator has publish_clock and use_sim_time",
                expected="only publish_clock: it cannot follow its own clock",
            )
        self._config = config
        self._physics = physics
        self._seed = config.seed
        self._busy_s: deque[float] = deque(maxlen=500)
        self._slips = 0
        self._rejected = 0
        # Stamp of the active trajectory as its sender knows it, also after simulated time slipped.
        self._active_ns = 0
        self._commands = TimedCommands()
        self._wall_base_s = time.monotonic()
        warm_simulation()
        self._load(scenario_or_shipped(config.scenario), self.now_ns())

        self._joint_states = self.announce(JointState, "joint_states", SENSOR)
        self._sim_state = self.announce(SimState, "sim/state", SENSOR)
        self._reference = self.announce(
            ControllerState, "joint_trajectory_controller/reference", SENSOR
        )
        # Three messages of each period, whose numbers alone are new.
        names = list(self._simulation.robot.joint_names)
        zeros = flat(np.zeros(len(names)))
        header = Header(frame_id=WORLD)
        self._robot_template = templates(
            lambda: JointState(name=names, position=zeros, velocity=zeros, effort=zeros)
        )
        self._truth_template = templates(
            lambda robot_part, human_part: SimState(
                header=header, robot_part=robot_part, human_part=human_part, torque=zeros
            )
        )
        self._reference_template = templates(
            lambda reason: ControllerState(
                header=header,
                reason=reason,
                joint_names=names,
                reference_position=zeros,
                reference_velocity=zeros,
            )
        )
        self._description = self.announce(String, "robot_description", LATCHED)
        self._clock_topic = self.announce(Clock, "/clock", SENSOR) if config.publish_clock else None
        self.listen(
            JointTrajectoryMessage,
            "joint_trajectory_controller/joint_trajectory",
            self._on_command,
            reliable(MAX_CATCH_UP),
            # Stamped with the time of its first point, or not at all when it asks for a stop.
            command=True,
            timed=True,
        )
        scale = "separation/speed_scale"
        self.listen(Float64, scale, self._on_command, reliable(MAX_CATCH_UP), timed=True)
        for person in self._simulation.scenario.persons:
            self.listen(HumanArm, f"sim/bodies/{person.id}/arm", self._on_arm, SENSOR)
        self.serve(Reset, "~/reset", self._on_reset)
        self._description.publish(String(data=self._simulation.robot.urdf_text))
        self._begun = False

    # ------------------------------------------------------------------ set-up
    def _load(self, scenario: Scenario, now_ns: int) -> None:
        self._simulation = Simulation(
            scenario, contacts=self._config.contacts, seed=self._seed, config=self._physics
        )
        self._arms = TrueArms(scenario)
        self._commands.clear()
        self._rebase(now_ns)

    def _rebase(self, now_ns: int) -> None:
        """Put simulated time zero at ``now_ns``, on the grid of the period."""
        period = seconds_to_ns(PERIOD_S)
        self._base_ns = now_ns // period * period - self._simulation.time_ns

    def now_ns(self) -> int:
        """ROS time; with ``publish_clock``, the clock that this node makes."""
        if self._config_publishes_clock():
            elapsed = time.monotonic() - self._wall_base_s
            return seconds_to_ns(1.0 + elapsed * self._config.realtime_factor)
        return super().now_ns()

    def _receipt_ns(self, wall_ns: int) -> int:
        """The node's time at a time of the wall clock, also where its clock has another speed."""
        receipt_ns = super()._receipt_ns(wall_ns)
        if not self._config_publishes_clock():
            return receipt_ns
        return self.tick_ns + round((receipt_ns - self.tick_ns) * self._config.realtime_factor)

    def _config_publishes_clock(self) -> bool:
        config = getattr(self, "_config", None)
        return bool(config is not None and config.publish_clock and not self.lockstep)

    # ------------------------------------------------------------------ inputs
    def _on_command(self, message: JointTrajectoryMessage | Float64, receipt_ns: int) -> None:
        if self._time_source.ros_time_is_active:
            # How fast somebody else's clock goes nobody knows: as if it had come right after the last tick.
            receipt_ns = self._base_ns + self._simulation.time_ns
        self._commands.add(receipt_ns, message)

    def _obey(self, until_ns: int | None = None) -> None:
        """Give the controller the commands that had come before a time [ns]; without one, all.

        Of several trajectories the last alone counts, besides those that ask for a stop: the last may be
        refused.
        """
        due = self._commands.take(until_ns)
        trajectories = [one for _, one in due if isinstance(one, JointTrajectoryMessage)]
        for came_ns, message in due:
            if isinstance(message, Float64):
                self._scale(message.data, came_ns)
            elif message is trajectories[-1] or not message.points:
                self._follow(message)

    def _follow(self, message: JointTrajectoryMessage) -> None:
        try:
            trajectory = trajectory_from_message(message)
            ros_ns = trajectory.stamp_ns or self._base_ns + self._simulation.time_ns
            if trajectory.stamp_ns:
                # The controller runs on simulated time; 0 means "now" to it.
                stamp_ns = max(trajectory.stamp_ns - self._base_ns, 1)
                trajectory = replace(trajectory, stamp_ns=stamp_ns)
            controller = self._simulation.controller
            controller.accept(
                trajectory,
                needs_replan=self._physics.command_timeout > 0.0 and len(message.points) > 1,
            )
            if message.points:
                self._active_ns = ros_ns
        except DataError as error:
            self._rejected += 1
            self._simulation.controller.rejection = str(error)
            self.fault("trajectory", f"trajectory refused: {error}")

    def _scale(self, scale: float, came_ns: int) -> None:
        simulation = self._simulation
        # As old as it is, also where simulated time leaves out when it came.
        heard_ns = min(came_ns - self._base_ns, simulation.time_ns)
        try:
            simulation.controller.chain.command(scale, heard_ns)
        except DataError as error:
            self.fault("speed_scale", str(error))

    def _on_arm(self, message: HumanArm) -> None:
        try:
            sample = sample_from_message(message)
            if sample.valid.all():
                self._arms.add(message.body_id, sample)
        except DataError as error:
            self.fault("arm", str(error))

    def _on_reset(self, request: Reset.Request, response: Reset.Response) -> Reset.Response:
        try:
            if request.scenario:
                scenario = load_scenario(request.scenario)
                persons = [person.id for person in self._simulation.scenario.persons]
                if {person.id for person in scenario.persons} != set(persons):
                    raise ConfigError(
                        f"{request.scenario} has other persons than this graph",
                        expected=", ".join(persons) or "nobody",
                        hint="start the simulator with that scenario",
                    )
            else:
                scenario = self._simulation.scenario
            self._seed = int(request.seed)
            self._load(scenario, self.now_ns())
        except HriError as error:
            response.success, response.message = False, str(error)
            return response
        response.success = True
        return response

    # ------------------------------------------------------------------ work
    def on_tick(self, now_ns: int) -> None:
        """Bring the simulation to ``now_ns`` and publish once for every period passed.

        A real controller is not late where this node is: in the periods that are made up for it hears
        each command when the middleware received it, so that heartbeats go on in them. Of more than a
        second that can be less: the newest :data:`MAX_CATCH_UP` of a kind wait, and with somebody else's
        clock all count as if they had come right after the last tick.
        """
        start = time.perf_counter()
        now_ns = min(now_ns, self.tick_ns)  # what came since messages were taken is not known
        period = seconds_to_ns(PERIOD_S)
        if not self._begun:
            # Start-up takes its time; simulated time begins with the first tick.
            self._begun = True
            self._rebase(now_ns - period)
        due = (now_ns - self._base_ns - self._simulation.time_ns) // period
        if due < 0 or due > MAX_CATCH_UP:
            self._slips += 1
            made_up = MAX_CATCH_UP if due > 0 else 0
            what = "went back" if due < 0 else "ran ahead"
            besides = f"{made_up * PERIOD_S:.1f} s of it is made up for; " if made_up else ""
            self.fault(
                "slip",
                f"the clock {what} by {abs(due) * PERIOD_S:.3f} s; {besides}simulated time goes on",
            )
            self._make_up(made_up)
            base_ns = self._base_ns
            self._rebase(now_ns - period)
            self._simulation.controller.chain.leave_out(max(self._base_ns - base_ns, 0))
            due = made_up + 1
        else:
            self._make_up(due - 1)
        if due:
            # All of them, whatever they say of when they came: the clock may have been set.
            self._obey()
            self._advance()
            self._busy_s.append((time.perf_counter() - start) / due)

    def _make_up(self, periods: int) -> None:
        for _ in range(periods):
            self._obey(self._base_ns + self._simulation.time_ns + seconds_to_ns(PERIOD_S))
            self._advance()

    def _advance(self) -> None:
        """Simulate one period and say what there is at its end."""
        period = seconds_to_ns(PERIOD_S)
        stamp_ns = self._base_ns + self._simulation.time_ns + period
        for name, timeline in self._arms.timelines.items():
            self._simulation.set_arm(name, timeline.at(stamp_ns))
        self._simulation.step(period // STEP_NS)
        self._publish(stamp_ns)

    def _publish(self, stamp_ns: int) -> None:
        simulation = self._simulation
        if self._clock_topic is not None:
            self._clock_topic.publish(Clock(clock=to_time(stamp_ns)))
        robot = self._robot_template()
        robot.stamp(stamp_ns)
        robot.write(position=simulation.q, velocity=simulation.qd, effort=simulation.torque)
        self._joint_states.publish(robot.encoded())
        clearance = simulation.clearance()
        human, table = simulation.contacts()
        seen = math.isfinite(clearance.distance)
        truth = self._truth_template(
            clearance.robot_part, f"{clearance.arm}/{clearance.limb}" if seen else ""
        )
        truth.stamp(stamp_ns)
        truth.write(
            clearance=clearance.distance if seen else NOBODY,
            approach=clearance.approach,
            contacts_human=human,
            contacts_table=table,
            tool=simulation.tool_position(),
            torque=simulation.torque,
            time=simulation.time_s,
        )
        self._sim_state.publish(truth.encoded())
        self._publish_reference(stamp_ns)

    def _publish_reference(self, stamp_ns: int) -> None:
        controller = self._simulation.controller
        template = self._reference_template(controller.reason)
        template.stamp(stamp_ns)
        template.stamp(self._active_ns if controller.stamp_ns else 0, "trajectory")
        template.write(
            state=_STATES[controller.state],
            reference_position=controller.q_ref,
            reference_velocity=controller.qd_ref,
            time_in_trajectory=controller.time_in_trajectory,
            speed_scale=controller.scale,
            handover_jump=controller.last_jump_position,
            max_handover_jump=controller.handover_jump_position,
        )
        self._reference.publish(template.encoded())

    def health(self) -> tuple[bytes, str, dict[str, Any]]:
        """Controller state, and why it stops where nobody asked it to; real-time factor, refusals."""
        controller = self._simulation.controller
        busy = sum(self._busy_s) / len(self._busy_s) if self._busy_s else 0.0
        figures = {
            "controller": controller.state,
            "realtime_factor_alone": f"{PERIOD_S / busy:.1f}" if busy else "",
            "trajectories_refused": self._rejected,
            "trajectories_refused_as_late": controller.late_refusals,
            "clock_slips": self._slips,
        }
        contacts = self._simulation.contacts()[0]
        if contacts:
            return ERROR, TOUCHED, figures
        # Standing, the robot does not need the heartbeat, but could not set off without it.
        stopped = controller.state == STOPPING and not controller.chain.halting
        if stopped or controller.chain.reason == NO_HEARTBEAT:
            return WARN, controller.chain.reason, figures
        return OK, controller.reason or controller.state, figures


def main(args: list[str] | None = None) -> int:
    """Entry point."""
    return run_node(SimulatorNode, args)
