"""From a policy to short joint plans: each cycle a little of the hand's motion, then a way to rest.

The plan of a cycle goes on some control steps beyond the next hand-over, so that a plan that comes too
late, or not at all, is not missed at once; after them the joints come smoothly to rest. What is planned
next begins on that plan: the hand, the policy's memory and the joints at the hand-over are those that were
planned for it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_planner.dmp.policy import DmpPolicy
from hri_planner.dmp.runner import DmpRunner
from hri_planner.policy.config import PolicyConfig
from hri_planner.policy.goals import check_goal
from hri_planner.policy.hand import HandState
from hri_planner.policy.mover import Mover
from hri_planner.policy.partner import Partner
from hri_planner.policy.passage import Passage
from hri_planner.policy.rest import coming_to_rest
from hri_planner.policy.runner import PolicyRunner
from hri_planner.policy.separation import NO_BOXES
from hri_planner.policy.stretch import Limits, Moved
from hri_planner.policy.tool_velocity import ToolVelocity
from hri_planner.ptomp.plan import JointPlan
from hri_planner.rnn.model import PolicyModel
from hri_planner.robot.model import RobotModel
from hri_prediction.errors import PlanningError

FloatArray = NDArray[np.float64]

AnyPolicy = PolicyModel | DmpPolicy
"""A network, or movement primitives."""

CONTROL_PERIOD_S = 0.004
"""Of the hand's steps, and of the points of plans [s]."""

_BESIDE_M = 0.05
"""Goals nearer than this are reached sooner by a hand that remembers having rested at one [m]."""
_AWAY_M, _RESTS_AWAY_S = 0.02, 0.4
"""A hand that rests away from its goal for so long, though nothing holds it, begins anew [s]."""


@dataclass(frozen=True, eq=False)
class Cycle:
    """What a replan made.

    Attributes:
        plan: Takes effect at the hand-over.
        stage: ``"reaching"`` or ``"holding"`` (at the goal, at rest).
        reason: Why the hand does not go where the policy wants; empty when it does.
        goal: Where the hand was to go (3,) [m].
        hand: At the hand-over.
        filtered: Whether a filter changed what the policy wanted, somewhere along the plan.
        nearest: Smallest distance of the hand from the axes of partners' limbs, along the plan [m];
            infinite without partners.
    """

    plan: JointPlan
    stage: str
    reason: str
    goal: FloatArray
    hand: HandState
    filtered: bool
    nearest: float


@dataclass(frozen=True, eq=False)
class PolicySnapshot:
    """State between two replans; opaque to callers."""

    plan: JointPlan | None
    passage: Passage | None
    trail: tuple[HandState, ...]
    rested_s: float


class PolicyPlanner:
    """Turns a policy into joint plans; one thread at a time may use it.

    Args:
        robot: The robot.
        model: The policy.
        config: Parameters.
        rng: Draws where the search for a goal's posture begins.
        floor: Height that the tool stays above [m]; none: any.
        boxes: Centre and half the size of boxes that it stays out of, edges along the axes
            (k, 2, 3) [m], base frame.
        limb_radii: Of people's upper arm, forearm and hand [m].
        arrived: Distance from the goal at which the hand counts as there [m].

    Attributes:
        model: The policy.
        plan: The newest plan; none before the first reach.
    """

    model: AnyPolicy

    def __init__(
        self,
        robot: RobotModel,
        model: AnyPolicy,
        config: PolicyConfig,
        rng: np.random.Generator,
        *,
        floor: float | None = None,
        boxes: FloatArray = NO_BOXES,
        limb_radii: Sequence[float] = Limits.limb_radii,
        arrived: float = 0.004,
    ) -> None:
        self.robot = robot
        self._arrived = arrived
        self.config = config
        self.floor = floor
        self._rng = rng
        self._limits = limits_of(robot, config, floor=floor, boxes=boxes, limb_radii=limb_radii)
        self.use(model)

    def use(self, model: AnyPolicy) -> None:
        """Go over to another policy; a reach that is under way is forgotten."""
        self.model = model
        self._runner = self._runner_of(model)
        self._inverse = ToolVelocity(
            self.robot, self.config.inverse_kinematics, self._runner.posture
        )
        self.plan: JointPlan | None = None
        self._passage: Passage | None = None
        self._trail: tuple[HandState, ...] = ()
        self._goal = np.zeros(3)
        self._rested_s = 0.0

    def check_model(self, model: AnyPolicy) -> None:
        """Check that a policy can be gone over to.

        Raises:
            DataError: when its time step does not fit.
        """
        self._runner_of(model)

    def _runner_of(self, model: AnyPolicy) -> Mover:
        if isinstance(model, DmpPolicy):
            return DmpRunner(model, self.config.field, self._limits, CONTROL_PERIOD_S)
        separation = self.config.separation_filter if self.config.filter else None
        return PolicyRunner(model, separation, CONTROL_PERIOD_S, self.floor, limits=self._limits)

    def check(self, goal: FloatArray, q: FloatArray) -> None:
        """Check a goal.

        Args:
            goal: Where the tool is to go (3,) [m], base frame.
            q: Joint angles (7,) [rad] from which a posture is looked for.

        Raises:
            PlanningError: when it is not finite, below the floor, in a box, or no posture reaches it.
        """
        check_goal(self.robot, goal, q, self._limits, self._rng)

    def start(
        self,
        q: FloatArray,
        qd: FloatArray,
        goal: FloatArray,
        time_s: float,
        duration_s: float = 0.0,
    ) -> None:
        """Begin a reach. At rest the policy begins anew; in flight a network remembers what it did.

        Args:
            q: Joint angles (7,) [rad].
            qd: Joint speeds (7,) [rad/s].
            goal: Where the tool is to go (3,) [m], base frame.
            time_s: Plan clock [s].
            duration_s: How long it is to take [s]; 0, and always for networks: as the policy has it.

        Raises:
            PlanningError: when the state or goal cannot be used, no posture reaches the goal, or the
                policy knows no way to it.
        """
        if not self.robot.within_limits(np.asarray(q), 1e-3):
            raise PlanningError("start posture lies outside of the joint limits")
        self.check(goal, q)
        self._runner.set_out(self._inverse.tool(np.array(q, dtype=float)), goal, duration_s)
        if not self._runner.recurrent:
            self._trail = ()
        self._goal = np.array(goal, dtype=float)
        self._stand(np.array(q, dtype=float), np.array(qd, dtype=float), time_s)

    def retarget(self, goal: FloatArray) -> None:
        """From the next replan on the goal, which has been checked, is elsewhere (3,) [m]."""
        self._rested_s = 0.0
        self._goal = np.array(goal, dtype=float)

    def resync(self, q: FloatArray, qd: FloatArray, time_s: float) -> None:
        """The controller is somewhere else than the plan says: go on from there, at rest anew.

        Raises:
            PlanningError: when no reach is active or the state is not finite.
        """
        if self.plan is None:
            raise PlanningError("resync without an active reach", hint="call start first")
        if not (np.all(np.isfinite(q)) and np.all(np.isfinite(qd))):
            raise PlanningError("resync state is not finite")
        self._stand(np.array(q, dtype=float), np.array(qd, dtype=float), time_s)

    def follow(self, plan: JointPlan) -> None:
        """The robot is on this plan, e.g. on the present one but later, as speed scaling makes it."""
        if self.plan is None or not np.array_equal(plan.q[-1], self.plan.q[-1]):
            self._passage = None
        self.plan = plan

    def snapshot(self) -> PolicySnapshot:
        """What the next replan starts from; see :meth:`restore`."""
        return PolicySnapshot(self.plan, self._passage, self._trail, self._rested_s)

    def restore(self, snapshot: PolicySnapshot) -> None:
        """Go back to an earlier state, because the plan made since never took effect."""
        self.plan, self._passage = snapshot.plan, snapshot.passage
        self._trail, self._rested_s = snapshot.trail, snapshot.rested_s

    def replan(self, handover_s: float, partners: Sequence[Partner], horizon_s: float) -> Cycle:
        """Let the policy go on from where the robot will be at the hand-over.

        Args:
            handover_s: Plan clock [s].
            partners: What will be known of others' hands at the hand-over, extrapolated to it.
            horizon_s: For how long the policy goes on, before the plan comes to rest [s].

        Raises:
            PlanningError: when no reach is active, or the policy asks for what is not finite.
        """
        if self.plan is None:
            raise PlanningError("replan without an active reach", hint="call start first")
        first, ahead, q, qd = self._at(handover_s)
        if self._passage is not None and self._runner.recurrent:
            first = self._awake(first, self._passage.before_end_s - (self.plan.end_s - handover_s))
        count = max(round(horizon_s / CONTROL_PERIOD_S), 1)
        hands: list[HandState] = [first]
        parts: list[Moved] = []
        while len(hands) <= count:
            hand, done_s = hands[-1], (len(hands) - 1) * CONTROL_PERIOD_S
            known = [partner.later(done_s) for partner in partners]
            moved, later = self._runner.move(
                hand,
                self._goal,
                known,
                parts[-1].q[-1] if parts else q,
                parts[-1].qd[-1] if parts else qd,
                count + 1 - len(hands),
                self._inverse,
            )
            parts.append(moved)
            hands += later
        angles = np.concatenate((q[None], *(part.q for part in parts)))
        speeds = np.concatenate((qd[None], *(part.qd for part in parts)))
        if not (np.isfinite(angles).all() and np.isfinite(speeds).all()):
            raise PlanningError("the policy asks for what is not finite", hint="load another one")
        self.plan = self._ending_at_rest(handover_s, angles, speeds)
        self._trail = tuple(hands)
        self._passage = Passage(self._trail, CONTROL_PERIOD_S, self.plan.end_s - handover_s, ahead)
        away = float(np.linalg.norm(first.position - self._goal))
        speed = float(np.linalg.norm(first.velocity))
        there = away < self._arrived and speed < self.config.arrived_speed
        filtered, reason = any(hand.filtered for hand in hands), ""
        if filtered:
            reason = "kept at a distance from the partner, the table or a box"
        elif any(part.strayed.any() for part in parts):
            reason = "the joints are at their limits"
        return Cycle(
            plan=self.plan,
            stage="holding" if there else "reaching",
            reason=reason,
            goal=self._goal.copy(),
            hand=first,
            filtered=filtered,
            nearest=min(part.nearest for part in parts),
        )

    def _awake(self, hand: HandState, went_on_s: float) -> HandState:
        """The hand, without memory if it has rested away from the goal for too long.

        Recurrent networks may settle where they have learnt nothing, as after the filter has pushed them
        away; from rest and without memory each learnt reach began.

        Args:
            hand: At the hand-over.
            went_on_s: How far along the plan the robot has come since the last one [s].
        """
        away = float(np.linalg.norm(hand.position - self._goal)) > _AWAY_M
        slow = float(np.linalg.norm(hand.velocity)) < 2.0 * self.config.arrived_speed
        self._rested_s = self._rested_s + went_on_s if away and slow and not hand.filtered else 0.0
        if self._rested_s < _RESTS_AWAY_S:
            return hand
        self._rested_s = 0.0
        return self._runner.begin(hand.position, hand.velocity)

    def _at(self, time_s: float) -> tuple[HandState, float, FloatArray, FloatArray]:
        """Hand, how far it is ahead, joint angles and speeds at a time of the plan clock."""
        assert self.plan is not None
        q, qd, _ = self.plan.sample(time_s)
        if self._passage is not None:
            try:
                return *self._passage.at(self.plan.end_s - time_s), q, qd
            except LookupError:
                pass  # on another part of the plan
        tool, velocity = self._inverse.tool_motion(q, qd)
        return self._runner.begin(tool, velocity, memory=self._memory_at(tool)), 0.0, q, qd

    def _memory_at(self, tool: FloatArray) -> FloatArray | None:
        """What the network remembered where the tool is now, or next to there: it may be late, or stopped.

        None when the reach begins, as each learnt reach did. Without memory a hand makes a way of
        centimetres even to a goal where it is already: beside its goal it remembers having rested there.
        """
        if not self._trail:
            beside = float(np.linalg.norm(tool - self._goal)) < _BESIDE_M
            network = self._runner.recurrent
            return self._runner.settled(self._goal) if beside and network else None
        places = np.array([hand.position for hand in self._trail])
        return self._trail[int(np.argmin(np.sum((places - tool) ** 2, axis=1)))].memory

    def _stand(self, q: FloatArray, qd: FloatArray, time_s: float) -> None:
        """Be somewhere, on the way to rest; from rest each reach of a network begins anew.

        A movement primitive that was stopped goes on with its way from where it is.
        """
        if self._runner.recurrent and float(np.abs(qd).max()) < self.config.forget_speed:
            self._trail = ()
        q = np.clip(q, self.robot.lower, self.robot.upper)
        qd = np.clip(qd, -self.robot.velocity, self.robot.velocity)
        self.plan, self._passage = self._ending_at_rest(time_s, q[None], qd[None]), None

    def _ending_at_rest(self, begin_s: float, q: FloatArray, qd: FloatArray) -> JointPlan:
        """A plan of these points (n, 7), (n, 7), after which the joints come to rest."""
        later, *rest = coming_to_rest(
            q[-1],
            qd[-1],
            self._inverse.config.joint_acceleration,
            self.robot.lower,
            self.robot.upper,
        )
        qdd = np.zeros_like(q)
        if len(q) > 1:
            qdd = np.gradient(qd, CONTROL_PERIOD_S, axis=0)
        times = begin_s + CONTROL_PERIOD_S * np.arange(len(q))
        knots = (np.concatenate(pair) for pair in zip((q, qd, qdd), rest, strict=True))
        return JointPlan(np.append(times, times[-1] + later), *knots)


def floor_over(table: FloatArray, robot: RobotModel, margin: float) -> float:
    """Height that the tool's axis stays above [m].

    Args:
        table: Centre and half the size (2, 3) [m].
        robot: Whose tool it is.
        margin: Distance of the tool's surface that is kept [m].
    """
    return float(table[0, 2] + table[1, 2] + robot.capsule_radii[2] + margin)


def limits_of(
    robot: RobotModel,
    config: PolicyConfig,
    *,
    floor: float | None,
    boxes: FloatArray = NO_BOXES,
    limb_radii: Sequence[float] = Limits.limb_radii,
) -> Limits:
    """What a tool keeps to; arguments as of :class:`PolicyPlanner`."""
    radii = robot.capsule_radii
    return Limits(
        config.separation_filter,
        config.filter,
        floor,
        np.ascontiguousarray(boxes, dtype=float),
        margin=float(radii[2]) + config.box_margin,
        limb_radii=tuple(float(radius) for radius in limb_radii),
        tool_radius=float(radii[2]),
        link_radii=(float(radii[0]), float(radii[1])),
        link_reach=config.link_reach,
        link_gain=config.link_gain,
    )
