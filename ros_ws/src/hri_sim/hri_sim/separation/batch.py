"""Many encounters on all cores, kept in chunks: none is done twice."""

from __future__ import annotations

import functools
import hashlib
import json
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass
from pathlib import Path

from hri_prediction.compiled import processor
from hri_prediction.results.dependencies import dependency_hash
from hri_sim.benchmark.workers import do_all, versions
from hri_sim.scenario.shipped import load_shipped
from hri_sim.separation.encounter import KINDS, Encounter, Meeting, Settings
from hri_sim.simulator.simulation import Simulation, SimulatorConfig
from hri_sim.simulator.stopchain import COMMAND_TIMEOUT_S, HEARTBEAT_TIMEOUT_S

CHUNK = 50
"""Encounters that are done and kept together."""
WORK = "hri_sim.separation.batch"


@dataclass(frozen=True)
class Chunk:
    """Some encounters.

    Attributes:
        kind: What people want in them.
        first: Seed of the first.
        count: How many.
        settings: Of all.
    """

    kind: str
    first: int
    count: int
    settings: Settings

    def file(self, folder: Path) -> Path:
        """Where they are kept: other code or settings keep theirs elsewhere."""
        parts = (
            json.dumps(asdict(self.settings)),
            dependency_hash(WORK),
            processor(),
            sorted(versions().items()),
        )
        mark = hashlib.sha256(repr(parts).encode()).hexdigest()[:16]
        return folder / mark / f"{self.kind}_{self.first}_{self.count}.json"


@functools.cache
def _simulation() -> Simulation:
    empty = load_shipped("table_reach").model_copy(update={"persons": (), "reaches": ()})
    config = SimulatorConfig(
        command_timeout=COMMAND_TIMEOUT_S, heartbeat_timeout=HEARTBEAT_TIMEOUT_S
    )
    return Simulation(empty, contacts=False, config=config)


def do_chunk(chunk: Chunk) -> tuple[Chunk, list[Meeting]]:
    """The encounters of a chunk; called in a process of its own."""
    seeds = range(chunk.first, chunk.first + chunk.count)
    return chunk, [
        Encounter(_simulation(), chunk.kind, chunk.settings, seed).run() for seed in seeds
    ]


def chunks_of(settings: Settings, count: int, first_seed: int) -> list[Chunk]:
    """Chunks of so many encounters in all, alike of each kind."""
    chunks = []
    for index, kind in enumerate(KINDS):
        wanted = count // len(KINDS) + (index < count % len(KINDS))
        for begin in range(0, wanted, CHUNK):
            chunks.append(Chunk(kind, first_seed + begin, min(CHUNK, wanted - begin), settings))
    return chunks


def run_chunks(
    chunks: Sequence[Chunk], folder: Path, workers: int, progress: Callable[[int, int], None]
) -> list[Meeting]:
    """All encounters of these chunks, those that are kept and those that are done now.

    Args:
        chunks: What is wanted.
        folder: Where they are kept.
        workers: Processes.
        progress: Told how many encounters are done, of how many.
    """
    found: dict[Chunk, list[Meeting]] = {}
    total = sum(chunk.count for chunk in chunks)
    for chunk in chunks:
        kept = _read(chunk.file(folder))
        if kept is not None and len(kept) == chunk.count:
            found[chunk] = kept
    progress(sum(map(len, found.values())), total)
    missing = [chunk for chunk in chunks if chunk not in found]
    if missing:
        with closing(do_all(do_chunk, missing, workers=workers)) as results:
            for chunk, meetings in results:
                _write(chunk.file(folder), meetings)
                found[chunk] = meetings
                progress(sum(map(len, found.values())), total)
    return [meeting for chunk in chunks for meeting in found[chunk]]


def _read(path: Path) -> list[Meeting] | None:
    try:
        return [Meeting(**row) for row in json.loads(path.read_text())]
    except (OSError, ValueError, TypeError):
        return None


def _write(path: Path, meetings: Sequence[Meeting]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    new = path.with_suffix(".new")
    new.write_text(json.dumps([asdict(meeting) for meeting in meetings]))
    new.replace(path)
