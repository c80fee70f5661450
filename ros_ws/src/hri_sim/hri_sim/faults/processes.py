"""Node processes that are killed or frozen in mid-motion, as users run them."""

from __future__ import annotations

import shutil
import signal
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from hri_planner.nodes.policy_config import DEFAULT_POLICY
from hri_prediction.bags import BagReader, salvage
from hri_prediction.errors import GraphError
from hri_prediction.ros.time import NANO, to_ns
from hri_sim.faults.live import SLOW_S, LiveGraph
from hri_sim.faults.motion import AT_REST, CAME_AT, LEANT_ON, NAMED, SCENES, TOUCHED, scene
from hri_sim.faults.own_motion import OwnMotion
from hri_sim.faults.reaching import reaching_graph
from hri_sim.faults.reference import BEYOND, JUMP, worse
from hri_sim.faults.sources import DYAD, INTERACTION, MOCAP_LIVE, SOURCES, SourceGraph
from hri_sim.faults.trials import TrialsGraph
from hri_sim.launch.health import SILENT
from hri_sim.launch.separation import MONITOR, OFF
from hri_sim.reliability.fault import PROCESSES, Fault, Figure, Place, Trial

RECORDER, SIMULATOR, POLICY = "recorder", "simulator", "policy"
OBSERVER, ADAPTATION = "observer", "adaptation"
HANDS_OFF = (RECORDER, SIMULATOR, ADAPTATION, INTERACTION)
"""Nodes on which it does not depend whether the robot may move on."""
ANOTHER_ROBOT = (SIMULATOR,)
"""Nodes with which the controller dies: one that is started again begins anew, with a robot at its start,
so that its reference says nothing of what the one before asked for; while it is frozen there is none."""
UNKNOWN_ARMS = (MOCAP_LIVE,)
"""Sources of arms that the simulator does not know, so that it cannot tell whether they are touched."""
GRAPH = "graph"
"""What stays from one fault to the next."""
LOOK_ON = (RECORDER, INTERACTION)
"""Nodes without which a motion goes on as with them."""
ARRIVES_S = 20.0
"""A motion takes at most so long [s]."""
IN_TRIALS = (OBSERVER, ADAPTATION)
"""Nodes of experiments alone."""
HELD_S = 1.5
"""How long a node is frozen [s]."""
SILENT_HELD_S = 5.0
"""The same of those that the robot does not rest without: long enough to lose what buffers do not hold."""
LOST = Figure("lost_s", "recording lost", "s", 1.0, digits=2)
SALVAGED = Figure("salvaged", "messages salvaged", limit=1.0, least=True)
AGAIN_S = 30.0
"""So long may it take until all nodes are well again, or a further trial is done [s]."""
READY = Figure("ready_s", "all nodes well again after", "s", AGAIN_S, digits=1)
GOES_ON = Figure("goes_on_s", "a further trial done after", "s", AGAIN_S, digits=1)
WENT_ON = Figure("went_on", "the motion under way goes on to its end", limit=1.0, least=True)
LOST_TRIALS = Figure("lost_trials", "trials lost", limit=0.0)
UNSEEN = ("newest sample", "no usable sample", "last seen")
REASONS = {
    "person": UNSEEN,
    **dict.fromkeys(SOURCES, UNSEEN),
    "predictor": ("newest sample", "prediction"),
    "ptomp": ("plan that the motion needs", "heartbeat"),
    POLICY: ("plan that the motion needs", "heartbeat"),
    MONITOR: ("heartbeat",),
    SIMULATOR: ("/joint_states", "joint states"),
    OBSERVER: UNSEEN,
    RECORDER: (RECORDER,),
    ADAPTATION: (ADAPTATION,),
    INTERACTION: (INTERACTION,),
}
"""What is said of each when it falls silent: one of these words."""


def kind_of(victim: str) -> str:
    """The kind of graph that a node is looked at in, unless another is said."""
    if victim in IN_TRIALS:
        return "trials"
    if victim == INTERACTION:
        return DYAD
    return victim if victim in (POLICY, MONITOR, *SOURCES) else "planner"


def live_graph(kind: str, place: Place) -> LiveGraph:
    """A graph of this kind: one that runs already, or a new one."""
    running = place.stays.get(GRAPH)
    if isinstance(running, LiveGraph):
        if running.folder.name == kind:
            return running
        # Where the next one cannot be started, this one must not be closed once more.
        place.stays.pop(GRAPH).close()
    # Where the folder of a fault goes, a graph that outlives it must not be.
    folder = new_folder(place.keep.parent / GRAPH / kind)
    if kind == "trials":
        graph: LiveGraph = TrialsGraph(folder, SCENES[0])
    elif kind in SOURCES:
        graph = SourceGraph(folder, SCENES[0], kind)
    else:
        _, library = scene(0, place.keep)
        graph = reaching_graph(
            folder,
            SCENES[0],
            library.resolve(),
            policy=DEFAULT_POLICY if kind == POLICY else None,
            separation="measured" if kind == MONITOR else OFF,
        )
    place.stays[GRAPH] = graph
    return graph


def new_folder(folder: Path) -> Path:
    """An empty folder of this name."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder


def many(
    one: Callable[[LiveGraph, str, int, Place], Trial],
    victim: str,
    kind: str,
    seeds: Sequence[int],
    place: Place,
) -> Iterator[Trial]:
    """Repetitions in one graph; where it does not come back to life a new one is started."""
    for seed in seeds:
        graph = live_graph(kind, place)
        try:
            trial = one(graph, victim, seed, place)
        except GraphError as error:
            trial = Trial(seed, {"ready_s": None}, str(error))
        else:
            ready_s = trial.figures["ready_s"]
            if ready_s is None or ready_s > SLOW_S:
                # Which node is not well, and why, matters more than what was said in time.
                trial = replace(trial, said=graph.late)
        if trial.figures["ready_s"] is None:
            place.stays.pop(GRAPH).close()
        yield trial


def kill(graph: LiveGraph, victim: str, seed: int, place: Place) -> Trial:
    """``kill -9`` at a random time of a motion; the launcher starts the node again."""
    graph.under_way(np.random.default_rng([seed, *victim.encode()]))
    bag, trials = _newest_bag(graph.folder), _trials(graph)
    since_s = graph.send(victim, signal.SIGKILL)
    graph.spin(1.0)
    named_ms, _ = graph.first_said(since_s, (f"node {victim} was ended by",), graph.told)
    reason_ms, said = graph.first_said(since_s, REASONS[victim], graph.reasons)
    figures: dict[str, float | None] = {"named_ms": named_ms}
    if victim not in SILENT:
        figures["reason_ms"] = reason_ms
    figures["ready_s"] = graph.ready_after(since_s)
    if victim not in HANDS_OFF:
        # As soon as it ticks again the robot rightly moves on.
        figures["rest_ms"] = graph.rest_ms(since_s, graph.back_s(victim, since_s))
    # All of the time until the node is back, and what the robot does then.
    if victim not in ANOTHER_ROBOT:
        figures |= graph.on_course()
    figures |= _touched(victim, graph.own_motion())
    figures |= _of_trials(graph, since_s, trials)
    if victim in LOOK_ON:
        figures["went_on"] = float(_arrives(graph))
    if victim == RECORDER:
        figures |= _salvaged(bag, place.folder / f"salvaged_{seed}", since_s)
    return Trial(seed, figures, said)


def _arrives(graph: LiveGraph) -> bool:
    """Whether the motion under way goes on to its end."""
    goal = graph.goal
    if goal is None:
        return False
    graph.spin(ARRIVES_S, lambda: bool(goal.outcome))
    return goal.ended_by_itself


def _touched(victim: str, *motions: OwnMotion) -> dict[str, float | None]:
    """How often a person was touched, where that can be told."""
    if victim in UNKNOWN_ARMS:
        return {}
    return {
        "touched": float(sum(motion.touched_moving for motion in motions)),
        "came_at": max(motion.came_at for motion in motions),
        "leant_on": float(sum(motion.touched_at_rest for motion in motions)),
    }


def _trials(graph: LiveGraph) -> list[str]:
    """Trials that are on the disk, if any are made."""
    return graph.kept() if isinstance(graph, TrialsGraph) else []


def _of_trials(graph: LiveGraph, since_s: float, before: list[str]) -> dict[str, float | None]:
    """Whether an experiment goes on as if nothing had been."""
    if not isinstance(graph, TrialsGraph):
        return {}
    goes_on_s = graph.goes_on_after(since_s, before)
    return {"goes_on_s": goes_on_s, "lost_trials": float(graph.lost(before))}


def _newest_bag(run: Path) -> Path:
    return max(run.glob("bag*"), key=lambda path: path.stat().st_ctime_ns)


def _salvaged(bag: Path, out: Path, killed_s: float) -> dict[str, float | None]:
    """What is left of a bag whose recorder was killed; it is removed."""
    salvage(bag, out)
    last_s, count = 0.0, 0
    for message in BagReader(out).messages({"/joint_states"}):
        last_s, count = to_ns(message.decode().header.stamp) / NANO, count + 1
    shutil.rmtree(out)
    shutil.rmtree(bag)
    return {"lost_s": killed_s - last_s if count else None, "salvaged": float(count)}


def freeze(graph: LiveGraph, victim: str, seed: int, place: Place) -> Trial:
    """SIGSTOP at a random time of a motion, and SIGCONT some time later."""
    graph.under_way(np.random.default_rng([seed, *victim.encode()]))
    trials = _trials(graph)
    since_s = graph.send(victim, signal.SIGSTOP)
    graph.spin(SILENT_HELD_S if victim in SILENT else HELD_S)
    # Of those that the robot does not rest without nobody in the graph speaks.
    said_by = graph.told if victim in SILENT else graph.reasons
    named_ms, said = graph.first_said(since_s, REASONS[victim], said_by)
    figures: dict[str, float | None] = {"named_ms": named_ms}
    if victim not in HANDS_OFF:
        figures["rest_ms"] = graph.rest_ms(since_s)
    frozen, course = graph.own_motion(), graph.on_course()
    thawed_s = graph.send(victim, signal.SIGCONT)
    graph.spin(1.5)
    ready_s, again = graph.ready_after(thawed_s), graph.on_course()
    figures |= {
        "ready_s": ready_s,
        **(again if victim in ANOTHER_ROBOT else worse(course, again)),
        **_touched(victim, frozen, graph.own_motion()),
    }
    figures |= _of_trials(graph, thawed_s, trials)
    if victim in LOOK_ON:
        figures["went_on"] = float(_arrives(graph))
    return Trial(seed, figures, said)


def _wanted_of(victim: str, *, killed: bool) -> tuple[Figure, ...]:
    """What is wanted whatever is done to a node."""
    trials = (GOES_ON, LOST_TRIALS) if victim in IN_TRIALS else ()
    went_on = (WENT_ON,) if victim in LOOK_ON else ()
    course = () if killed and victim in ANOTHER_ROBOT else (JUMP, BEYOND)
    touched = () if victim in UNKNOWN_ARMS else (TOUCHED, CAME_AT, LEANT_ON)
    return (*trials, *went_on, *course, *touched)


def _kill(victim: str, kind: str = "") -> Fault:
    said = Figure("reason_ms", "reason said in the graph after", "ms", 1000.0)
    answer = {
        RECORDER: "named; the motion goes on; the bag is salvaged up to 1 s before",
        SIMULATOR: "named by the launcher and in the graph",
        ADAPTATION: "named; the trial under way is made again, no other is lost",
        INTERACTION: "named; the motion goes on",
    }.get(victim, "robot at rest, named by the launcher and in the graph")
    figures: tuple[Figure, ...] = (AT_REST, NAMED, said)
    if victim == RECORDER:
        figures = (NAMED, LOST, SALVAGED)
    elif victim == SIMULATOR:
        figures = (NAMED, said)
    elif victim in (ADAPTATION, INTERACTION):
        figures = (NAMED,)
    return Fault(
        f"kill_{victim}{BESIDE if kind else ''}",
        f"kill -9 of {victim}{', beside a monitor' if kind else ''}",
        "SIGKILL at a random time of a motion; the launcher starts the node again (--on-death restart)",
        answer,
        PROCESSES,
        (*figures, READY, *_wanted_of(victim, killed=True)),
        partial(many, kill, victim, kind or kind_of(victim)),
    )


def _freeze(victim: str, kind: str = "") -> Fault:
    moved = victim not in HANDS_OFF
    answer = "robot at rest, and named" if moved else "named"
    if victim in LOOK_ON:
        answer = "named; the motion goes on"
    figures = (AT_REST, NAMED) if moved else (NAMED,)
    held_s = SILENT_HELD_S if victim in SILENT else HELD_S
    return Fault(
        f"freeze_{victim}{BESIDE if kind else ''}",
        f"{victim} is frozen{', beside a monitor' if kind else ''}",
        f"SIGSTOP at a random time of a motion, SIGCONT {held_s:g} s later",
        f"{answer}; afterwards it goes on",
        PROCESSES,
        (*figures, READY, *_wanted_of(victim, killed=False)),
        partial(many, freeze, victim, kind or kind_of(victim)),
    )


PLANNED = (SIMULATOR, "person", "predictor", "ptomp", RECORDER)
"""Nodes of the graph with a planner; it serves all of them in turn."""
MONITORED = ("person", "predictor", "ptomp")
"""Those that are looked at beside a separation monitor too, which then has the robot stop."""
BESIDE = "_monitored"
"""What the names of those lines end with."""
PROCESS_FAULTS = (
    *map(_kill, PLANNED), *map(_freeze, PLANNED),
    _kill(POLICY), _freeze(POLICY), _kill(MONITOR), _freeze(MONITOR),
    *(line(node, MONITOR) for line in (_kill, _freeze) for node in MONITORED),
    _kill(OBSERVER), _freeze(OBSERVER), _kill(ADAPTATION), _freeze(ADAPTATION),
    *(line(node) for node in (*SOURCES, INTERACTION) for line in (_kill, _freeze)),
)  # fmt: skip
"""Faults of processes."""
