"""Bags and models that are cut or have wrong bits, and messages of another package of the same name."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hri_planner.adaptation.model_file import load_model, shipped_path
from hri_planner.dmp.model_file import load_dmp
from hri_planner.policy.model_file import find_any
from hri_planner.rnn.model_file import load_policy
from hri_prediction.bags import BagReader, BagWriter, TopicInfo, salvage
from hri_prediction.errors import HriError
from hri_sim.launch.run_node import installed_nodes
from hri_sim.launch.supervisor import find_executable
from hri_sim.reliability.fault import FILES, Fault, Figure, Place, Trial

TOGETHER = 25
"""Files that are damaged in one repetition."""
CHUNKS, IN_CHUNK = 20, 20
TOPIC = TopicInfo("/noise", "std_msgs/msg/ByteMultiArray")
Damage = Callable[[np.random.Generator, bytes], bytes]

OTHER_ERRORS = Figure(
    "other_errors", "ends otherwise than by being read or one clear error", limit=0.0
)
REFUSED = Figure("refused", "refused with one clear error")


def cut(rng: np.random.Generator, content: bytes) -> bytes:
    """The file ends earlier."""
    return content[: int(rng.integers(len(content)))]


def flipped(rng: np.random.Generator, content: bytes) -> bytes:
    """One to eight bits are wrong."""
    changed = bytearray(content)
    for _ in range(int(rng.integers(1, 9))):
        changed[int(rng.integers(len(changed)))] ^= 1 << int(rng.integers(8))
    return bytes(changed)


def make_bag(folder: Path, rng: np.random.Generator) -> list[int]:
    """A bag of numbered noise in chunks; where each chunk ends in its file [bytes]."""
    ends = []
    with BagWriter(folder) as writer:
        channel = writer.add_topic(TOPIC)
        for number in range(CHUNKS * IN_CHUNK):
            writer.write(channel, rng.bytes(100), number)
            if number % IN_CHUNK == IN_CHUNK - 1:
                writer.flush()
                ends.append(writer.size)
    return ends


def bags(damage: Damage, seeds: Sequence[int], place: Place) -> Iterator[Trial]:
    """Damaged bags, read and salvaged."""
    for seed in seeds:
        rng = np.random.default_rng(seed)
        folder = place.folder / str(seed)
        ends = make_bag(folder / "bag", rng)
        (file,) = (folder / "bag").glob("*.mcap")
        content = file.read_bytes()
        whole = {m.log_time_ns: m.data for m in BagReader(folder / "bag").messages()}
        counts = dict.fromkeys(("refused", "other_errors", "altered", "lost", "kept"), 0.0)
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
        counts["kept"] *= 100.0 / TOGETHER
        shutil.rmtree(folder)
        yield Trial(seed, counts)


def _lost_of_whole(content: bytes, changed: bytes, ends: list[int], found: set[int]) -> int:
    """Messages that are not found though their chunk, and all before it, is as it was."""
    alike = len(changed)
    if alike == len(content):
        alike = next(
            (i for i, (a, b) in enumerate(zip(content, changed, strict=True)) if a != b), alike
        )
    chunks = sum(end <= alike for end in ends)
    return sum(number not in found for number in range(chunks * IN_CHUNK))


def models(damage: Damage, seeds: Sequence[int], place: Place) -> Iterator[Trial]:
    """Damaged models of each kind that ships, loaded."""
    kinds: tuple[tuple[Path, Callable[[Path], Any]], ...] = (
        (find_any("dmp_transfer"), load_dmp),
        (find_any("rnn_gru_9x9_d1"), load_policy),
        (shipped_path("success_f8"), load_model),
        (shipped_path("gpr_f8"), load_model),
    )
    contents = [path.read_bytes() for path, _ in kinds]
    originals = [load(path) for path, load in kinds]
    for seed in seeds:
        rng = np.random.default_rng(seed)
        counts = dict.fromkeys(("refused", "other_errors", "altered"), 0.0)
        for index in range(TOGETHER):
            kind = index % len(kinds)
            path = place.folder / kinds[kind][0].name
            path.write_bytes(damage(rng, contents[kind]))
            try:
                loaded = kinds[kind][1](path)
            except HriError:
                counts["refused"] += 1
            except Exception:  # whatever else comes is what is looked for
                counts["other_errors"] += 1
            else:
                counts["altered"] += not same(loaded, originals[kind])
        yield Trial(seed, counts)


def same(one: Any, other: Any) -> bool:
    """Whether two things hold the same values."""
    if type(one) is not type(other):
        return False
    if isinstance(one, np.ndarray):
        return np.array_equal(one, other, equal_nan=one.dtype.kind == "f")
    if isinstance(one, Mapping):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    if isinstance(one, list | tuple):
        return len(one) == len(other) and all(map(same, one, other))
    if hasattr(one, "__dict__"):
        return same(vars(one), vars(other))
    return callable(one) or bool(one == other)


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
        done = subprocess.run(
            [str(find_executable(package, node))],
            env={**os.environ, "PYTHONPATH": path},
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
        )
        said = done.stdout + done.stderr
        figures: dict[str, float | None] = {
            "refused": float(done.returncode != 0 and "is not this project's" in said),
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
        f"{injected}; {TOGETHER} files a repetition, each of {CHUNKS} chunks",
        "salvaged up to the damage, or refused with one clear error; nothing that was not recorded",
        FILES,
        (
            OTHER_ERRORS,
            Figure("altered", "messages that were not recorded so", limit=0.0),
            Figure("lost", "messages lost of chunks before the damage", limit=0.0),
            Figure("kept", "messages kept", "%", least=True),
            REFUSED,
        ),
        partial(bags, damage),
        count=40,
    )


def _models(name: str, title: str, injected: str, damage: Damage) -> Fault:
    return Fault(
        name,
        title,
        f"{injected}; {TOGETHER} files a repetition: policies (DMP, RNN), adaptation (SVC, GPR)",
        "refused with one clear error, or loaded with the same values",
        FILES,
        (OTHER_ERRORS, Figure("altered", "loaded with other values", limit=0.0), REFUSED),
        partial(models, damage),
        count=40,
    )


DAMAGED = (
    _bags("truncated_bags", "truncated bags", "the file ends anywhere", cut),
    _bags("flipped_bags", "bit-flipped bags", "1 to 8 bits anywhere are wrong", flipped),
    _models("truncated_models", "truncated models", "the file ends anywhere", cut),
    _models("flipped_models", "bit-flipped models", "1 to 8 bits anywhere are wrong", flipped),
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
"""Faults of files and of installations."""
