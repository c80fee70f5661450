"""Bags that are cut or have wrong bits, and messages of another package of the same name."""

from __future__ import annotations

import os
import shutil
import sys
import time
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from hri_prediction.bags import BagReader, BagWriter, TopicInfo, salvage
from hri_prediction.errors import HriError
from hri_sim.faults.ended import ended
from hri_sim.launch.run_node import installed_nodes
from hri_sim.launch.supervisor import find_executable
from hri_sim.reliability.damage import Damage, cut, flipped
from hri_sim.reliability.fault import FILES, Fault, Figure, Place, Trial

TOGETHER = 25
"""Files that are damaged in one repetition."""
CHUNKS, IN_CHUNK = 20, 20
TOPIC = TopicInfo("/noise", "std_msgs/msg/ByteMultiArray")

OTHER_ERRORS = Figure(
    "other_errors", "ends otherwise than by being read or one clear error", limit=0.0
)
REFUSED = Figure("refused", "refused with one clear error")
SCRIPT = "hri_sim.tools.inspect_bag"
"""What scripts/inspect_bag.py runs."""
SCRIPT_SAYS = Figure(
    "script", "inspect_bag.py ends otherwise than with a clear line and its exit code", limit=0.0
)


def make_bag(folder: Path, rng: np.random.Generator) -> list[int]:
    """Write a bag of numbered noise in chunks; returns where each of them ends in its file [bytes]."""
    ends = []
    with BagWriter(folder) as writer:
        channel = writer.add_topic(TOPIC)
        for number in range(CHUNKS * IN_CHUNK):
            writer.write(channel, rng.bytes(100), number)
            if number % IN_CHUNK == IN_CHUNK - 1:
                writer.flush()
                ends.append(writer.size)
    return ends


def bags(seeds: Sequence[int], place: Place, damage: Damage) -> Iterator[Trial]:
    """Damaged bags, read and salvaged."""
    for seed in seeds:
        rng = np.random.default_rng(seed)
        folder = place.folder / str(seed)
        ends = make_bag(folder / "bag", rng)
        (file,) = (folder / "bag").glob("*.mcap")
        content = file.read_bytes()
        whole = {m.log_time_ns: m.data for m in BagReader(folder / "bag").messages()}
        counts = dict.fromkeys(
            ("refused", "other_errors", "altered", "lost", "kept", "script"), 0.0
        )
        for index in range(TOGETHER):
            changed = damage(rng, content)
            file.write_bytes(changed)
            out = folder / f"out_{index}"
            try:
                salvage(file, out)
                found = {m.log_time_ns: m.data for m in BagReader(out).messages()}
            except HriError:
                counts["refused"] += 1
                found = {}
            except Exception:  # whatever else comes is what is looked for
                counts["other_errors"] += 1
                continue
            shutil.rmtree(out, ignore_errors=True)
            counts["kept"] += len(found) / len(whole)
            counts["altered"] += sum(whole.get(key) != data for key, data in found.items())
            counts["lost"] += _lost_of_whole(content, changed, ends, set(found))
            if index == 0:
                counts["script"] = float(not _inspected(folder / "bag", found == whole))
        counts["kept"] *= 100.0 / TOGETHER
        shutil.rmtree(folder)
        yield Trial(seed, counts)


def _inspected(bag: Path, whole: bool) -> bool:
    """Whether the script ends as it should: 0 only where nothing is missing, 1 with one line, or 3.

    Args:
        bag: The bag, damaged.
        whole: Whether all of its messages can be read as they were.
    """
    done = ended([sys.executable, "-m", SCRIPT, bag])
    if done is None:
        return False
    lines = done.stderr.strip().splitlines()
    if done.returncode == 1:
        return len(lines) == 1 and lines[0].startswith("inspect_bag.py: ")
    if done.returncode == 3:
        return not lines and "warning" in done.stdout
    return done.returncode == 0 and whole and not lines


def _lost_of_whole(content: bytes, changed: bytes, ends: list[int], found: set[int]) -> int:
    """Messages that are not found though their chunk, and all before it, is as it was."""
    alike = len(changed)
    if alike == len(content):
        alike = next(
            (i for i, (a, b) in enumerate(zip(content, changed, strict=True)) if a != b), alike
        )
    chunks = sum(end <= alike for end in ends)
    return sum(number not in found for number in range(chunks * IN_CHUNK))


def wrong_messages(seeds: Sequence[int], place: Place) -> Iterator[Trial]:
    """Nodes of which each finds an hri_msgs with ``IdsList`` and nothing else in front."""
    front = place.folder / "front"
    for name in ("msg", "action", "srv"):
        (front / "hri_msgs" / name).mkdir(parents=True)
        (front / "hri_msgs" / name / "__init__.py").write_text("")
    (front / "hri_msgs" / "__init__.py").write_text("")
    (front / "hri_msgs" / "msg" / "__init__.py").write_text("class IdsList: pass\n")
    path = os.pathsep.join([str(front), *filter(None, sys.path)])
    nodes = installed_nodes()
    for seed in seeds:
        package, node = nodes[seed % len(nodes)]
        begin = time.monotonic()
        done = ended([find_executable(package, node)], {**os.environ, "PYTHONPATH": path})
        said = "" if done is None else done.stdout + done.stderr
        code = 0 if done is None else done.returncode
        figures: dict[str, float | None] = {
            "refused": float(code != 0 and "is not this project's" in said),
            "tells_how": float("source this workspace last" in said),
            "lines": float(len(said.strip().splitlines())),
            "seconds": time.monotonic() - begin,
        }
        yield Trial(
            seed, figures, f"{node}: {said.strip().splitlines()[-1] if said.strip() else ''}"
        )


def _bags(name: str, title: str, injected: str, damage: Damage) -> Fault:
    return Fault(
        name,
        title,
        f"{injected}; {TOGETHER} files a repetition, each of {CHUNKS} chunks; the first is given to "
        "inspect_bag.py too",
        "salvaged up to the damage, or refused with one clear error and an exit code that is not 0; "
        "nothing that was not recorded",
        FILES,
        (
            OTHER_ERRORS,
            Figure("altered", "messages that were not recorded so", limit=0.0),
            Figure("lost", "messages lost of chunks before the damage", limit=0.0),
            Figure("kept", "messages kept", "%", least=True),
            SCRIPT_SAYS,
            REFUSED,
        ),
        partial(bags, damage=damage),
        count=40,
    )


DAMAGED = (
    _bags("truncated_bags", "truncated bags", "the file ends anywhere", cut),
    _bags("flipped_bags", "bit-flipped bags", "1 to 8 bits anywhere are wrong", flipped),
    Fault(
        "wrong_hri_msgs",
        "the wrong hri_msgs",
        "a package of that name with IdsList alone is in front; every node in turn is started",
        "one clear error that says how to mend it, exit code not 0",
        FILES,
        (
            Figure("refused", "refused, and named", limit=1.0, least=True),
            Figure("tells_how", "says how to mend it", limit=1.0, least=True),
            Figure("lines", "lines that are said", limit=1.0),
            Figure("seconds", "after", "s", digits=1),
        ),
        wrong_messages,
        count=13,  # nodes
    ),
)
"""Faults of bags and of installations."""
