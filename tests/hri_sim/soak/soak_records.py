"""Records of soaks that never were."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np

from hri_sim.soak.contacts import Contact
from hri_sim.soak.log import BEGIN, END, FAULT, LOG, REACH, SAMPLE, SoakLog

SECONDS = 600
NODES = ("person", "ptomp")
BEGUN = {
    "origin": {
        "commit": "abc",
        "date": "2026-01-01",
        "machine": {"cpu": "x", "cores": 2, "python": "3.11"},
    },
    "minutes": 10.0,
    "seed": 0,
    "faults_asked": "all",
    "mean_wait_s": 20.0,
    "separation": "measured",
    "contact_speed": 0.15,
    "nodes": list(NODES),
}
ENDED = {
    "broken": "",
    "killed": [],
    "orphans": [],
    "shared_left": [],
    "bags": [
        {
            "bag": "bag",
            "bytes": 150_000_000,
            "closed": True,
            "messages": 900_000,
            "seconds": 599.0,
            "error": "",
        }
    ],
    "not_finite": 0,
}
KILLED = {
    "s": 100.0,
    "fault": "kill",
    "node": "ptomp",
    "seconds": 0.0,
    "moving": True,
    "rest_ms": 150.0,
    "named_ms": 20.0,
    "ready_s": 6.0,
    "reached_s": 9.0,
    "outcomes": ["interrupted", "reached"],
    "as_wanted": None,
}
CANCELLED = {
    **KILLED,
    "s": 200.0,
    "fault": "cancel",
    "node": "",
    "named_ms": None,
    "ready_s": None,
    "rest_ms": 80.0,
    "outcomes": ["cancelled", "reached"],
    "as_wanted": True,
}
TOUCHED = Contact(7.0, 0.5, 0.1, "hand", "ann/forearm")
REACHED = {
    "s": 5.0,
    "way": "a b",
    "outcome": "reached",
    "reason": "",
    "seconds": 1.5,
    "disturbed": False,
}


def sample(
    second: int,
    leak: float,
    rng: np.random.Generator,
    lasting: Collection[str] = NODES,
    slower: float = 0.0,
) -> dict[str, Any]:
    """A second of a run: ptomp is started again after 100 s, who does not last each second."""

    def process(name: str, born: float, base: float) -> dict[str, Any]:
        memory = base * (1.0 + leak * second / SECONDS) + float(rng.normal(0.0, 0.05))
        return {
            "pid": 7,
            "born": born if name in lasting else float(second),
            "memory_mb": memory,
            "resident_mb": memory + 100.0,
            "threads": 12,
            "files": 14,
            "cpu_s": 0.25 * second * (1.0 + 0.5 * slower * second / SECONDS),
        }

    return {
        "s": float(second),
        "processes": {
            "person": process("person", 0.0, 100.0),
            "ptomp": process("ptomp", 0.0 if second < 100 else 101.0, 150.0),
        },
        "bags": {"bag": 250_000 * second},
        "shared_files": 0,
        "free_mb": 1000,
        "latency_ms": [float(v) for v in rng.normal(35.0, 4.0, 10)],
        "figures": {"person": {"tick_hz": 250.0}, "recorder": {"dropped": 0.0}},
    }


def write_record(
    folder: Path,
    *,
    leak: float = 0.0,
    faults: tuple[dict[str, Any], ...] = (KILLED, CANCELLED),
    reaches: tuple[dict[str, Any], ...] = (REACHED,),
    deaths: tuple[dict[str, Any], ...] = (),
    end: dict[str, Any] | None = ENDED,
    seconds: int = SECONDS,
    slower: float = 0.0,
    lasting: Collection[str] = NODES,
) -> Path:
    """Write one; ``end`` none: the script was killed; ``lasting``: whose processes live on."""
    rng = np.random.default_rng(0)
    folder.mkdir(parents=True, exist_ok=True)
    with SoakLog(folder / LOG) as log:
        log.write(BEGIN, BEGUN)
        for second in range(seconds):
            log.write(SAMPLE, sample(second, leak, rng, lasting, slower))
        kinds = ((FAULT, faults), (REACH, reaches), ("death", deaths))
        for kind, rows in kinds:
            for row in rows:
                log.write(kind, row)
        if end is not None:
            log.write(END, end)
    return folder
