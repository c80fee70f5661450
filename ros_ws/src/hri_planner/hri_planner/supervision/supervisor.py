"""Decides, tick by tick, what the robot is told: move, pause, go on, stop, hold; and how a motion ends."""

from __future__ import annotations

from hri_planner.supervision.decision import (
    Decision,
    Interval,
    Orders,
    Outcome,
    ReadyPlan,
    Report,
    Seen,
    Stage,
    Verdict,
)
from hri_planner.supervision.freshness import NANO, Limits, joints_problem, problem
from hri_planner.supervision.intervals import Intervals
from hri_planner.supervision.keeper import Keeper
from hri_planner.supervision.motion import Motion, planning
from hri_planner.supervision.rules import Rules
from hri_planner.supervision.stop import SETTLE_NS, Stop
from hri_planner.supervision.touch import STOPS, TOUCHED, Touch
from hri_prediction.beat import Beat

HEARTBEAT_NS = 20_000_000
FEEDBACK_NS = 100_000_000
CLOCK_STEP_NS = 100_000_000
"""A clock that goes back by more than this starts all anew; less is a clock being set [ns]."""


class Supervisor(Keeper):
    """Its methods are told what has happened, with the time, and return what is to be done.

    Args:
        rules: By what motions are judged.
        limits: How old inputs may be.

    Attributes:
        intervals: The planning clock and its counts.
    """

    def __init__(self, rules: Rules, limits: Limits) -> None:
        super().__init__()
        self._rules = rules
        self._limits = limits
        self.intervals = Intervals(rules.interval_ns, rules.transport_ns, rules.late_timeout_s)
        self._stop, self._touch = Stop(), Touch()
        self._last_ns = 0
        self._heartbeat, self._feedback = Beat(HEARTBEAT_NS), Beat(FEEDBACK_NS)
        self._standing = Beat(FEEDBACK_NS)  # why the robot does not move

    def unreachable(self, reason: str, seen: Seen) -> Decision:
        """There is no way to the goal that was to begin; what the robot is still on ends with it."""
        orders = Orders()
        if self.motion is not None:
            if seen.on_plan:
                self._halt(orders)
            self._end(self.motion, Outcome.UNREACHABLE, reason, seen.now_ns, orders)
        return orders.decision()

    # ------------------------------------------------------------------ time
    def clock_went_back(self, now_ns: int) -> bool:
        """Take the time; whether it is so much before the one before that :meth:`restart` is due."""
        back = now_ns < self._last_ns - CLOCK_STEP_NS
        self._last_ns = now_ns
        return back

    def restart(self, now_ns: int) -> Decision:
        """Begin anew after the clock went back: no stamp from before means anything now."""
        text = "the clock went back"
        orders = Orders(faults=[("clock", f"{text}: the present motion is dropped")])
        held = self.holding
        self._halt(orders)
        self._stop.over()
        self.intervals.restart(now_ns)
        for beat in (self._heartbeat, self._feedback, self._standing):
            beat.at_once(now_ns)
        if self.motion is not None:
            self._end(self.motion, Outcome.FAILED, text, now_ns, orders)
        elif held:
            self.stage, self.reason = Stage.IDLE, text
            orders.reports.append(self._report(None))
        return orders.decision()

    def heartbeat_due(self, now_ns: int) -> bool:
        """Whether the speed scale is to be said now."""
        return self._heartbeat.due(now_ns) and self._rules.heartbeat

    def feedback_due(self, now_ns: int) -> bool:
        """Whether the present motion's feedback is to be said now."""
        return self.motion is not None and self._feedback.due(now_ns)

    def tick(self, seen: Seen) -> Decision:
        """What is to be done now."""
        orders = Orders()
        if self.motion is not None:
            self.motion.look(seen.now_ns)
        if self.motion is not None and self.motion.cancelling:
            self._cancel(seen, self.motion, orders)
        elif self.active:
            self._supervise(seen, self.motion, orders)
        return orders.decision()

    # ------------------------------------------------------------------ plans
    def begun(self, interval: Interval) -> None:
        """The planner is on the motion of ``interval.start``."""
        self.holding = False
        if self.motion is not None:
            self.motion.started = True
        self.intervals.started(interval.handover_ns)
        self.intervals.begun(interval.handover_ns)

    def judge(self, plan: ReadyPlan, now_ns: int) -> Verdict:
        """What becomes of a plan that is ready."""
        if not self._concerns_us(plan.number):
            return Verdict.FORGET
        late = self.intervals.is_late(now_ns, plan.handover_ns, plan.due_ns)
        if late:
            self._missed(self.motion)
        # While stopping: it was made for a robot that moves on.
        return Verdict.DROP if late or self.scale == 0.0 else Verdict.PUBLISH

    def published(self, plan: ReadyPlan, now_ns: int) -> Report:
        """A plan was sent: what the status says of it."""
        self.intervals.published(now_ns)
        motion = self.motion
        if motion is None:
            self.stage = Stage.HOLDING
        else:
            motion.replans += 1
            motion.costs = dict(plan.costs)
            self.stage = Stage.WAITING if plan.waits else Stage.MOVING
        self.reason = plan.reason
        return self._report(motion)

    def out_of_time(self, number: int) -> None:
        """There was no time for the replan of an interval."""
        if self._concerns_us(number):
            self._missed(self.motion)

    def failed(self, number: int, text: str) -> Decision:
        """A replan for a motion failed."""
        if not self._concerns_us(number):
            return Decision()
        self.intervals.failed(text)
        self._missed(self.motion)
        return Decision(faults=(("replan", f"a replan failed: {text}"),))

    def _missed(self, motion: Motion | None, intervals: int = 1) -> None:
        self.intervals.misses += intervals
        if motion is not None:
            motion.misses += intervals

    # ------------------------------------------------------------------ a tick
    def _supervise(self, seen: Seen, motion: Motion | None, orders: Orders) -> None:
        now_ns = seen.now_ns
        trouble = problem(seen.heard, self._limits, now_ns) or self._stop.unrest(
            seen.heard.controller
        )
        # Whether a replan that never came back began before the motion did makes no difference.
        due = self.scale != 0.0 and (seen.busy or motion is None or motion.started)
        overdue = "" if trouble else self.intervals.lateness(now_ns, due=due)
        begun = motion is None or motion.started
        touched = not (trouble or overdue) and self._touch.holds(seen, self.scale, begun=begun)
        if trouble or overdue or touched:
            self._pause(seen, motion, trouble or overdue or TOUCHED, orders)
            if not overdue or not self.active:
                return
            # Tried again while the robot stops and stands: the first success lets it go on.
        else:
            self._go_on(now_ns, motion)
            if motion is not None:
                motion.min_separation = min(motion.min_separation, seen.separation)
                if self._has_ended(seen, motion, orders):
                    return
                if motion.started and motion.plans_ahead(self._rules):
                    self._say_planning(now_ns, motion, orders)
        if not seen.busy and self.intervals.is_due(now_ns):
            orders.interval = self._next_interval(seen, self.motion, orders)

    def _go_on(self, now_ns: int, motion: Motion | None) -> None:
        """There is nothing to stop for: full speed."""
        self._stop.over()
        self._touch.over()
        if self.scale == 0.0:
            self.reason = ""
            self._heartbeat.at_once(now_ns)
            self.intervals.resume(now_ns)
            if motion is not None:
                motion.lost_since_ns = None
        self.scale = 1.0

    def _say_planning(self, now_ns: int, motion: Motion, orders: Orders) -> None:
        """The robot stays where it is until what is planned once is there."""
        if self.stage != Stage.WAITING:
            self._standing.at_once(now_ns)
        if self._standing.due(now_ns):
            self.stage, self.reason = Stage.WAITING, planning(self.intervals.failure)
            orders.reports.append(self._report(motion))

    def _pause(self, seen: Seen, motion: Motion | None, why: str, orders: Orders) -> None:
        """Bring the robot to rest on its path until the cause is gone."""
        now_ns = seen.now_ns
        if self.scale != 0.0 or self.stage != Stage.STOPPING:
            self.scale = 0.0
            # At once, not with the next beat: every millisecond of the stop counts.
            self._heartbeat.at_once(now_ns)
            self.stage, self.reason = Stage.STOPPING, why
            orders.faults.append(("paused", why))
            self._standing.at_once(now_ns)
        if self._standing.due(now_ns):
            # Again and again: the cause may change while the robot stands.
            self.reason = why
            orders.reports.append(self._report(motion))
        heartbeat = self._rules.heartbeat
        if self._stop.is_due(now_ns, seen.heard.controller, heartbeat=heartbeat):
            self._stop.tell(now_ns, STOPS if why == TOUCHED else why)
            orders.drop = True
        if motion is None:
            return
        motion.over_since_ns = None
        if why == TOUCHED:  # nothing is lost: it takes as long as the person does
            motion.lost_since_ns = None
            motion.min_separation = min(motion.min_separation, seen.separation)
            self._has_ended(seen, motion, orders)
            return
        if motion.lost_since_ns is None:
            motion.lost_since_ns = now_ns
        if (now_ns - motion.lost_since_ns) / NANO > self._rules.lost_timeout_s:
            self._halt(orders)
            lost = not self.intervals.overdue or problem(seen.heard, self._limits, now_ns)
            outcome = Outcome.LOST_INPUT if lost else Outcome.FAILED
            self._end(motion, outcome, f"stopped: {why}", now_ns, orders)

    def _cancel(self, seen: Seen, motion: Motion, orders: Orders) -> None:
        """Stop, and end the motion once the robot is seen at rest."""
        now_ns = seen.now_ns
        if motion.cancelled_ns is None:
            motion.cancelled_ns = now_ns
            self._stop.tell(now_ns, "cancelled: the robot comes to rest")
            self._halt(orders)
            self.stage, self.reason = Stage.STOPPING, "cancelled"
            orders.reports.append(self._report(motion))
        elif self._stop.is_due_again(now_ns):
            self._stop.tell(now_ns, "cancelled: the robot comes to rest")
            self._halt(orders)
        controller = seen.heard.controller
        idle = controller is None or not controller.active
        unseen = joints_problem(seen.heard, self._limits, now_ns)
        if not unseen and idle and seen.speed < self._rules.rest_speed:
            self._stop.over()
            self._end(motion, Outcome.CANCELLED, "cancelled; the robot stands", now_ns, orders)
        elif (now_ns - motion.cancelled_ns) / NANO > self._rules.lost_timeout_s:
            why = unseen or "it still moves"
            text = f"cancelled, but the robot was not seen to come to rest: {why}"
            self._end(motion, Outcome.LOST_INPUT, text, now_ns, orders)

    def _has_ended(self, seen: Seen, motion: Motion, orders: Orders) -> bool:
        found = motion.verdict(seen, self._rules, self.reason)
        if found is None:
            return False
        outcome, reason = found
        if outcome == Outcome.REACHED:
            self.holding = True
        else:
            self._halt(orders)
        self._end(motion, outcome, reason, seen.now_ns, orders)
        return True

    def _next_interval(self, seen: Seen, motion: Motion | None, orders: Orders) -> Interval | None:
        begin_ns, missed = self.intervals.next(seen.now_ns)
        if missed and self.scale != 0.0 and (motion is None or motion.started):
            self._missed(motion, missed)
        if motion is None:
            interval = Interval(begin_ns, begin_ns + self._rules.interval_ns, self._count)
        else:
            interval = motion.next_interval(begin_ns, self._rules)
            if not motion.started:
                return interval if self._may_begin(seen, motion, orders) else None
            if interval.ahead:
                self.intervals.started(interval.handover_ns)
        self.intervals.begun(interval.handover_ns)
        return interval

    def _may_begin(self, seen: Seen, motion: Motion, orders: Orders) -> bool:
        """Whether the robot stands or, if the planner will go on from there, is on a plan of ours.

        Otherwise it is coming to rest after a stop, and nobody knows where it will be at the
        hand-over; what somebody else made it do is stopped.
        """
        controller = seen.heard.controller
        if controller is None or not controller.active:
            return True
        # Nobody looks after a plan during all the time that another one is made ahead.
        if seen.on_plan and not (self._rules.plans_once and seen.speed >= self._rules.rest_speed):
            return True
        if seen.now_ns - motion.accepted_ns > SETTLE_NS:
            self._halt(orders)
            self.intervals.postpone(seen.now_ns + SETTLE_NS)
        return False
