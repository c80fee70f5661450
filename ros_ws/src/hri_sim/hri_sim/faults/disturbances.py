"""Clocks that jump, resets, planners that are too slow and nodes that die, in lock-step."""

from __future__ import annotations

from functools import partial

from hri_planner.nodes.ptomp_node import PtompNode
from hri_prediction.ros.messages import Reset
from hri_sim.faults.motion import (
    AGAIN,
    AT_REST,
    NAMED,
    POLICY,
    PTOMP,
    SAFE,
    WILD,
    Motion,
    lockstep,
)
from hri_sim.launch.separation import MONITOR, OFF
from hri_sim.reliability.fault import LOCKSTEP, Fault, Figure, Place, Trial
from hri_sim.testing.slow import SlowWorker

LATE_REST = Figure("rest_ms", "robot at rest after", "ms", 300.0)
"""36 ms to the replan that is missed, 120 ms until it is, 70 ms to stop, and ticks."""
SILENCE = (
    "newest sample",
    "no usable sample",
    "last seen",
    "heartbeat",
    "plan that the motion needs",
)
"""Words that are said when somebody falls silent."""
ENDED = Figure("ended", "the motion ends with a reason", limit=1.0, least=True)


def clock_graph(seed: int) -> tuple[str, str]:
    """What moves the robot where the clock jumps, and the monitor beside it: two of three times other ones.

    Scenes follow each other by the seed: each of them gets each of these.
    """
    return ((PTOMP, OFF), (POLICY, OFF), (PTOMP, "measured"))[seed // 3 % 3]


def reset_graph(seed: int) -> tuple[str, str]:
    """What moves the robot that is reset, and the monitor beside it."""
    return (PTOMP, POLICY)[seed // 4 % 2], (OFF, "measured")[seed // 2 % 2]


def clock(low_s: float, high_s: float, seed: int, place: Place) -> Trial:
    """The clock of all nodes jumps; two of three times with a policy, or with a monitor."""
    mover, monitor = clock_graph(seed)
    with Motion(seed, place, "clock", mover=mover, separation=monitor, start_s=20.0) as motion:
        handle = motion.under_way()
        by_s = motion.rng.uniform(low_s, high_s)
        motion.graph.shift_clock(by_s)
        motion.mark()
        outcome = motion.finish(handle)
        motion.graph.run(1.2)
        named_ms, said = motion.named("the clock", "in the future")
        figures: dict[str, float | None] = {
            "named_ms": named_ms,
            "wild": motion.wild(),
            "ended": float(outcome != "nothing"),
            "again": motion.reaches_again(),
        }
        return Trial(seed, {**figures, **motion.safe()}, f"{by_s:+.2f} s: {said} ({outcome})")


def reset(seed: int, place: Place) -> Trial:
    """Robot and people are put back to where they began."""
    mover, monitor = reset_graph(seed)
    with Motion(seed, place, "reset", mover=mover, separation=monitor) as motion:
        handle = motion.under_way()
        nodes = ("simulator", "person")[: 1 + seed % 2]
        for node in nodes:
            answer = motion.graph.call(Reset, f"/{node}/reset", Reset.Request(seed=seed))
            assert answer.success, answer.message
        motion.mark()
        outcome = motion.finish(handle)
        figures: dict[str, float | None] = {
            "wild": motion.wild(),
            "ended": float(outcome != "nothing"),
            "again": motion.reaches_again(),
        }
        assert handle.result is not None
        said = f"{' and '.join(nodes)}: {outcome} {handle.result.reason}".strip()
        return Trial(seed, {**figures, **motion.safe(afterwards=True)}, said)


def overload(seed: int, place: Place) -> Trial:
    """Each plan takes longer than it may."""
    with Motion(seed, place, "overload") as motion:
        handle = motion.under_way()
        node = motion.graph.nodes[PTOMP]
        assert isinstance(node, PtompNode)
        usual = node.replanning.worker
        delay_s = motion.rng.uniform(0.1, 0.4)
        node.replanning.worker = SlowWorker(node, delay_s)  # type: ignore[assignment]
        motion.mark()
        motion.graph.run(0.6)
        rest_ms = motion.rest_ms()
        outcome = motion.finish(handle)
        named_ms, said = motion.named("the replan is")
        node.replanning.worker = usual
        figures: dict[str, float | None] = {
            "rest_ms": rest_ms,
            "named_ms": named_ms,
            "ended": float(outcome != "nothing"),
            "again": motion.reaches_again(),
        }
        return Trial(seed, {**figures, **motion.safe()}, f"{delay_s:.2f} s: {said} ({outcome})")


def death(victim: str, mover: str, monitor: str, seed: int, place: Place) -> Trial:
    """A node says nothing any more, from one step to the next."""
    with Motion(seed, place, victim, mover=mover, separation=monitor) as motion:
        motion.under_way()
        motion.mark()
        motion.graph.kill(victim)
        motion.graph.run(1.2)
        figures: dict[str, float | None] = {"rest_ms": motion.rest_ms()}
        named_ms, said = motion.named(*SILENCE)
        return Trial(seed, {**figures, "named_ms": named_ms, **motion.safe()}, said)


def _death(victim: str, mover: str = PTOMP, monitor: str = OFF) -> Fault:
    return Fault(
        f"death_of_{victim}",
        f"{victim} falls silent for good",
        "the node is taken out of the graph at a random time of a motion; simulated time",
        "robot at rest; a reason is said",
        LOCKSTEP,
        (AT_REST, NAMED, *SAFE),
        lockstep(partial(death, victim, mover, monitor)),
        count=100,
    )


def _clock(name: str, title: str, low_s: float, high_s: float) -> Fault:
    return Fault(
        name,
        title,
        f"the clock that all nodes share jumps by {low_s:g} to {high_s:g} s at a random time of a motion",
        "named; motion and predictions begin anew or go on; no step, no NaN; the next goal is reached",
        LOCKSTEP,
        (NAMED, WILD, ENDED, AGAIN, *SAFE),
        lockstep(partial(clock, low_s, high_s)),
        count=60,
    )


DISTURBANCES = (
    _death("person"),
    _death("predictor"),
    _death("ptomp"),
    _death("policy", POLICY),
    _death(MONITOR, PTOMP, "measured"),
    _clock("clock_back", "the clock of all nodes goes back", -5.0, -0.3),
    _clock("clock_ahead", "the clock of all nodes jumps ahead", 0.3, 5.0),
    Fault(
        "reset",
        "reset in mid-motion",
        "~/reset of the simulator, every other time of the person too, at a random time of a motion of "
        "planner or policy, with and without a monitor",
        "the motion ends with a reason or goes on; no step afterwards; the next goal is reached",
        LOCKSTEP,
        (WILD, ENDED, AGAIN, *SAFE),
        lockstep(reset),
        count=40,
    ),
    Fault(
        "overload",
        "the planner is too slow",
        "each plan takes 0.1 to 0.4 s instead of 36 ms, from a random time of a motion on",
        "robot at rest, named, and the motion given up; once plans are in time the next goal is reached",
        LOCKSTEP,
        (LATE_REST, NAMED, ENDED, AGAIN, *SAFE),
        lockstep(overload),
        count=40,
    ),
)
"""Faults of nodes and of time."""
