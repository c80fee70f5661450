"""Node processes that are killed or frozen in mid-motion, as users run them."""

from __future__ import annotations

import shutil
import signal
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from hri_planner.nodes.policy_config import DEFAULT_POLICY
from hri_prediction.bags import BagReader, salvage
from hri_prediction.errors import GraphError
from hri_prediction.ros.time import NANO, to_ns
from hri_sim.faults.live import READY_S, LiveGraph
from hri_sim.faults.motion import AT_REST, NAMED, SCENES, STEP, scene
from hri_sim.launch.separation import MONITOR, OFF
from hri_sim.reliability.fault import PROCESSES, Fault, Figure, Place, Trial

RECORDER, SIMULATOR, POLICY = "recorder", "simulator", "policy"
GRAPH = "graph"
"""What stays from one fault to the next."""
HELD_S = 1.5
"""How long a node is frozen [s]; a recorder longer, as it is given more time to speak."""
RECORDER_HELD_S = 5.0
LOST = Figure("lost_s", "recording lost", "s", 1.0, digits=2)
SALVAGED = Figure("salvaged", "messages salvaged", limit=1.0, least=True)
READY = Figure("ready_s", "all nodes well again after", "s", READY_S, digits=1)
TOUCHED = Figure("touched", "states in which a person is touched", limit=0.0)
SILENT = Figure("named_ms", "named after", "ms", 5000.0)
"""A recorder is expected to speak every second; it is named when it has not for three."""
REASONS = {
    "person": ("newest sample", "no usable sample", "last seen"),
    "predictor": ("newest sample", "prediction"),
    "ptomp": ("plan that the motion needs", "heartbeat"),
    POLICY: ("plan that the motion needs", "heartbeat"),
    MONITOR: ("heartbeat",),
    SIMULATOR: ("/joint_states", "joint states"),
    RECORDER: (RECORDER,),
}
"""What is said of each when it falls silent: one of these words."""


def live_graph(victim: str, place: Place) -> LiveGraph:
    """The graph that a node of this name is part of: one that runs already, or a new one."""
    kind = victim if victim in (POLICY, MONITOR) else "planner"
    running = place.stays.get(GRAPH)
    if isinstance(running, LiveGraph):
        if running.folder.name == kind:
            return running
        running.close()
    _, library = scene(0, place.keep)
    # Where the folder of a fault goes, a graph that outlives it must not be.
    graph = LiveGraph(
        new_folder(place.keep.parent / GRAPH / kind),
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
    seeds: Sequence[int],
    place: Place,
) -> Iterator[Trial]:
    """Repetitions in one graph; where it does not come back to life a new one is started."""
    for seed in seeds:
        graph = live_graph(victim, place)
        try:
            trial = one(graph, victim, seed, place)
        except GraphError as error:
            trial = Trial(seed, {"ready_s": None}, str(error))
        if trial.figures["ready_s"] is None:
            place.stays.pop(GRAPH).close()
        yield trial


def kill(graph: LiveGraph, victim: str, seed: int, place: Place) -> Trial:
    """``kill -9`` at a random time of a motion; the launcher starts the node again."""
    graph.under_way(np.random.default_rng([seed, *victim.encode()]))
    bag = _newest_bag(graph.folder)
    since_s = graph.send(victim, signal.SIGKILL)
    graph.spin(1.0)
    named_ms, _ = graph.first_said(since_s, (f"node {victim} was ended by",), graph.told)
    reason_ms, said = graph.first_said(since_s, REASONS[victim], graph.reasons)
    figures: dict[str, float | None] = {
        "named_ms": named_ms,
        "touched": float(graph.touched),
        "step_rad": graph.largest_step(),
    }
    if victim != RECORDER:
        figures["reason_ms"] = reason_ms
        if victim != SIMULATOR:
            figures["rest_ms"] = graph.rest_ms(since_s)
    figures["ready_s"] = graph.ready_after(since_s)
    if victim == RECORDER:
        figures |= _salvaged(bag, place.folder / f"salvaged_{seed}", since_s)
    return Trial(seed, figures, said)


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
    since_s = graph.send(victim, signal.SIGSTOP)
    graph.spin(RECORDER_HELD_S if victim == RECORDER else HELD_S)
    said_by = graph.told if victim == RECORDER else graph.reasons
    named_ms, said = graph.first_said(since_s, REASONS[victim], said_by)
    figures: dict[str, float | None] = {"named_ms": named_ms}
    if victim not in (RECORDER, SIMULATOR):
        figures["rest_ms"] = graph.rest_ms(since_s)
    touched, step = graph.touched, graph.largest_step()
    thawed_s = graph.send(victim, signal.SIGCONT)
    graph.spin(1.5)
    figures |= {
        "ready_s": graph.ready_after(thawed_s),
        "touched": float(touched + graph.touched),
        "step_rad": max(step, graph.largest_step()),
    }
    return Trial(seed, figures, said)


def _kill(victim: str) -> Fault:
    said = Figure("reason_ms", "reason said in the graph after", "ms", 1000.0)
    answer = {
        RECORDER: "named; the run goes on; the bag is salvaged up to 1 s before",
        SIMULATOR: "named by the launcher and in the graph",
    }.get(victim, "robot at rest, named by the launcher and in the graph")
    figures: tuple[Figure, ...] = (AT_REST, NAMED, said)
    if victim == RECORDER:
        figures = (NAMED, LOST, SALVAGED)
    elif victim == SIMULATOR:
        figures = (NAMED, said)
    return Fault(
        f"kill_{victim}",
        f"kill -9 of {victim}",
        "SIGKILL at a random time of a motion; the launcher starts the node again (--on-death restart)",
        answer,
        PROCESSES,
        (*figures, READY, STEP, TOUCHED),
        partial(many, kill, victim),
    )


def _freeze(victim: str) -> Fault:
    moved = victim not in (RECORDER, SIMULATOR)
    answer = "robot at rest, and named" if moved else "named"
    figures = ((AT_REST,) if moved else ()) + ((SILENT,) if victim == RECORDER else (NAMED,))
    return Fault(
        f"freeze_{victim}",
        f"{victim} is frozen",
        f"SIGSTOP at a random time of a motion, SIGCONT {HELD_S:g} s later"
        if victim != RECORDER
        else f"SIGSTOP at a random time of a motion, SIGCONT {RECORDER_HELD_S:g} s later",
        f"{answer}; afterwards it goes on",
        PROCESSES,
        (*figures, READY, STEP, TOUCHED),
        partial(many, freeze, victim),
    )


PLANNED = (SIMULATOR, "person", "predictor", "ptomp", RECORDER)
"""Nodes of the graph with a planner; it serves all of them in turn."""
PROCESS_FAULTS = (
    *map(_kill, PLANNED), *map(_freeze, PLANNED),
    _kill(POLICY), _freeze(POLICY), _kill(MONITOR), _freeze(MONITOR),
)  # fmt: skip
"""Faults of processes."""
