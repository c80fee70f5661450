"""Files that are made to do harm: bombs, endless nesting, lying sizes, pickles and tags that execute."""

from __future__ import annotations

import struct
from dataclasses import replace
from pathlib import Path

import fuzz_readers
import fuzz_samples
import numpy as np
import pytest
from fuzz_archives import Member, arrays_of, npy_bytes, npy_said, odd_archives, pickled, zip_bytes
from fuzz_mcaps import Record, file_bytes, records
from fuzz_samples import cdr
from fuzz_trees import odd_yaml
from mocap_files import arm_mm, trc_text

from hri_prediction.bags import mcap_file as layout
from hri_prediction.bags.metadata import BagMetadata, FileInfo, TopicInfo, write_metadata

MEGABYTES = 1_000_000


@pytest.mark.parametrize("kind", fuzz_readers.SETTINGS)
def test_yaml(sandbox, tmp_path: Path, kind: str) -> None:
    box = sandbox(fuzz_readers.SETTINGS[kind])
    path = tmp_path / "a.yaml"
    for name, content in odd_yaml(str(box.canary)).items():
        path.write_bytes(content)
        found = box.check(path)
        assert found.kind == "refused" or kind in ("predictor", "training"), name


@pytest.mark.parametrize("kind", fuzz_readers.PLAIN)
def test_json(sandbox, tmp_path: Path, kind: str) -> None:
    box = sandbox(fuzz_readers.PLAIN[kind])
    path = tmp_path / "people" / "ann" / "person.json"
    path.parent.mkdir(parents=True)
    huge = b"1" * 4000
    for name, content in {
        "swells": b"[" + b"[]," * 4_000_000 + b"[]]",
        "swells within": b'{"format": [' + b"[]," * 1_300_000 + b"[]]}",
        "deep": b"[" * 100_000 + b"]" * 100_000,
        "numbers": b'{"format": '
        + huge
        + b', "length_m": 1e999, "costs": NaN, "reaches": -Infinity}',
    }.items():
        path.write_bytes(content)
        assert box.check(path).kind == "refused", name


def test_yaml_of_bags(sandbox, tmp_path: Path) -> None:
    bag = fuzz_samples.write_bag(tmp_path / "bag", 6)
    box = sandbox(lambda path: fuzz_readers.any_bag(path.parent))
    for name, content in odd_yaml(str(box.canary)).items():
        (bag / "metadata.yaml").write_bytes(content)
        assert box.check(bag / "metadata.yaml").kind == "refused", name


def test_yaml_within_bags(sandbox, tmp_path: Path) -> None:
    """What recorders write into channels and metadata is not needed to read messages."""
    bag = fuzz_samples.bag_files()[0]
    box = sandbox(fuzz_readers.salvaged)
    path = tmp_path / "a.mcap"
    wanted = (
        "laughs",
        "merging laughs",
        "within itself",
        "deep",
        "python",
        "no such day",
        "no anchor",
    )
    odd = odd_yaml(str(box.canary))
    for content in (odd[name] for name in wanted):
        made = [one for one in records(bag) if one.opcode == layout.CHUNK]
        texts = [b"rosbag2", b"serialized_metadata", content]
        inner = b"".join(struct.pack("<I", len(text)) + text for text in texts[1:])
        body = struct.pack("<I", 7) + texts[0] + struct.pack("<I", len(inner)) + inner
        path.write_bytes(file_bytes([*made, Record(layout.METADATA, body)], closed=False))
        assert box.check(path).kind == "read"


@pytest.fixture(scope="module")
def bombs(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, dict[str, bytes]]:
    """A canary, and archives that would make it."""
    canary = str(tmp_path_factory.mktemp("canary") / "executed")
    return canary, odd_archives(canary)


@pytest.mark.parametrize("kind", ["library", "session", "tracks", "handovers"])
def test_archives(sandbox, tmp_path: Path, kind: str, bombs: tuple[str, dict[str, bytes]]) -> None:
    others = {"tracks": fuzz_readers.tracks, "handovers": fuzz_readers.load_handovers}
    canary, contents = bombs
    box = sandbox({**fuzz_readers.MODELS, **others}[kind])
    path = tmp_path / "session.npz"
    for name, content in contents.items():
        path.write_bytes(content)
        assert box.check(path).kind == "refused", name
        assert not Path(canary).exists(), name


def test_pickles_among_usable_arrays(sandbox, tmp_path: Path) -> None:
    box = sandbox(fuzz_readers.tracks)
    path = tmp_path / "a.npz"
    arrays = arrays_of(fuzz_samples.track_archives()[0])
    for name in (*arrays, "further"):
        members = [
            Member(f"{key}.npy", npy_bytes(value)) for key, value in arrays.items() if key != name
        ]
        path.write_bytes(zip_bytes([*members, Member(f"{name}.npy", pickled(str(box.canary)))]))
        assert box.check(path).kind == "refused"


def test_headers_of_arrays_that_claim_what_is_not_there(sandbox, tmp_path: Path) -> None:
    box = sandbox(fuzz_readers.tracks)
    path = tmp_path / "a.npz"
    for shape in ("(10000000000,)", "(0, 10000000000)", "(-1,)", "(4294967296, 4294967296)", "()"):
        for kind in ("<f8", "<U0", "|S0", "<U100000000", "|V0", "<f8"):
            said = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}"
            names = ("pos", "joint_names", "onset", "start", "length", "subject", "side", "trial")
            path.write_bytes(zip_bytes([Member(f"{name}.npy", npy_said(said)) for name in names]))
            assert box.check(path).kind == "refused"


# ------------------------------------------------------------------ bags
def bag_of(*made: Record) -> bytes:
    """A file with a topic, and some records."""
    whole = records(fuzz_samples.bag_files()[0])
    chunk = next(one for one in whole if one.opcode == layout.CHUNK)
    inner = tuple(one for one in chunk.inner if one.opcode != layout.MESSAGE)
    first = Record(layout.CHUNK, inner=(*inner, message()))
    return file_bytes([first, *made])


def message(data: bytes = cdr(7)) -> Record:
    """Of the first topic."""
    return Record(layout.MESSAGE, struct.pack("<HIQQ", 1, 1, 10**18, 10**18) + data)


def bags_that_swell() -> dict[str, bytes]:
    """By what they do."""
    zeros = message(bytes(100 * MEGABYTES))
    big = {how: Record(layout.CHUNK, inner=(zeros,), packed=how) for how in ("zstd", "lz4")}
    attached = struct.pack("<QQ", 0, 0) + struct.pack("<I", 1) + b"a" + struct.pack("<I", 0)
    attached += struct.pack("<Q", 400_000) + bytes(400_000) + bytes(4)
    far = attached[:-400_012] + struct.pack("<Q", 2**62) + bytes(10)
    many = [Record(layout.CHUNK, inner=(message(bytes(500_000)),))] * 3
    once = bag_of(*many, Record(layout.ATTACHMENT, attached))
    end = once.rindex(bytes([layout.FOOTER]) + struct.pack("<Q", 20))
    start = struct.unpack_from("<Q", once, end + 9)[0]
    summary = once[start:end]
    return {
        "zstd": bag_of(big["zstd"]),
        "lz4": bag_of(big["lz4"]),
        "zstd that says less": bag_of(Record(layout.CHUNK, inner=(zeros,), said={"size": 100})),
        "lz4 that says less": bag_of(
            Record(layout.CHUNK, inner=(zeros,), packed="lz4", said={"size": 100})
        ),
        "size alone": bag_of(Record(layout.CHUNK, inner=(message(),), said={"size": 2**40})),
        "packed size alone": bag_of(
            Record(layout.CHUNK, inner=(message(),), said={"packed": 2**62})
        ),
        "attachment that is not there": bag_of(Record(layout.ATTACHMENT, far)),
        "index of everything, often": once[:end].replace(summary, summary * 3000) + once[end:],
        "text that is not there": bag_of(Record(layout.CHANNEL, bytes(4) + b"\xff" * 8)),
    }


@pytest.fixture(scope="module")
def swelling() -> dict[str, bytes]:
    """Made once: they take a while."""
    return bags_that_swell()


@pytest.mark.parametrize("kind", fuzz_readers.BAGS)
def test_bags_that_swell(sandbox, tmp_path: Path, kind: str, swelling: dict[str, bytes]) -> None:
    box = sandbox(fuzz_readers.BAGS[kind], memory=400e6)
    path = tmp_path / "a.mcap"
    for name, content in swelling.items():
        assert len(content) < 12 * MEGABYTES, name
        for data in (content, content[: 2 * len(content) // 3]):
            path.write_bytes(data)
            found = box.check(path)
            whole = data is content and kind not in ("salvaged",)
            assert not whole or found.kind == "refused", name


@pytest.mark.parametrize("kind", ["any", "inspected", "salvaged"])
def test_chunks_within_chunks(sandbox, tmp_path: Path, kind: str) -> None:
    """Thousands of heads, each of a chunk of all that follows; none is whole."""
    head, size = 49, MEGABYTES
    heads = bytearray()
    while len(heads) < size:
        left = size - len(heads)
        heads += struct.pack("<BQ16xQIIQ", layout.CHUNK, left + head - 9, left, 1, 0, left)
    lost = struct.pack("<BQ", 0, 0)  # from here on chunks are looked for
    path = tmp_path / "a.mcap"
    for content in (bag_of()[:-50] + lost + heads + bytes(head), bytes(8) + heads + bytes(head)):
        path.write_bytes(content)
        found = sandbox(fuzz_readers.BAGS[kind]).check(path)
        assert found.kind == ("read" if content.startswith(layout.MAGIC) else "refused")


def test_types_that_are_no_messages(
    sandbox, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What a bag names must not be imported, unless it is a package of messages that is installed."""
    package = tmp_path / "evil" / "msg"
    package.mkdir(parents=True)
    monkeypatch.syspath_prepend(str(tmp_path))
    whole = fuzz_samples.arm_bag_files()[0]
    made = [one for one in records(whole) if one.opcode == layout.CHUNK]
    arms = BagMetadata(
        topics=(TopicInfo("/humans/bodies/ann/arm", "hri_msgs/msg/HumanArm"),),
        files=(FileInfo("a.mcap", 0, 0, 1),),
    )
    box = sandbox(fuzz_readers.arms)
    (package / "__init__.py").write_text(f"import os\nos.mkdir({str(box.canary)!r})\nBoom = 1\n")
    (tmp_path / "evil" / "__init__.py").write_text("")
    bag = tmp_path / "bag"
    bag.mkdir()
    write_metadata(bag, arms)
    for name in (
        b"evil/msg/Boom",
        b"os/path/join",
        b"../msg/Boom",
        b"evil.msg/msg/Boom",
        b"x" * 9000,
    ):
        chunks = [
            replace(one, inner=tuple(changed_type(r, name) for r in one.inner)) for one in made
        ]
        (bag / "a.mcap").write_bytes(file_bytes(chunks))
        found = box.check(bag)
        assert found.kind == "refused"
        assert "is not installed here" in found.text


def changed_type(record: Record, name: bytes) -> Record:
    """A schema of arms under another name."""
    if record.opcode != layout.SCHEMA:
        return record
    (length,) = struct.unpack_from("<I", record.body, 2)
    return Record(
        record.opcode,
        record.body[:2] + struct.pack("<I", len(name)) + name + record.body[6 + length :],
    )


# ------------------------------------------------------------------ texts that swell
def texts_that_swell() -> dict[str, str]:
    """By the ending that they have."""
    markers = [f"M{i}" for i in range(12_000)]
    wide = trc_text(np.zeros((1, len(markers), 3)), markers).splitlines()[:-1]
    short = [f"{row}\t{row / 100}" for row in range(1, 40_000)]
    root = "OFFSET 0 0 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n"
    joints = "".join(f"JOINT j{i}\n{{\nOFFSET 0 0 0\nCHANNELS 0\n}}\n" for i in range(3000))
    motion = "MOTION\nFrames: 6000\nFrame Time: 0.01\n" + "0 0 0 0 0 0\n" * 6000
    stiff = f"HIERARCHY\nROOT R\n{{\n{root}{joints}}}\n{motion}"
    digits = trc_text(arm_mm()).replace("250.000000", "1" * 150_000 + "x")
    quote = '"' + "A" * 200_000 + '"'
    quotes = (
        f"Trajectories\n100\n,,{quote}\nFrame,Sub Frame,X,Y,Z\n,,mm,mm,mm\n1,0,1,1,1\n2,0,1,1,1\n"
    )
    return {"trc": "\n".join([*wide, *short]), "bvh": stiff, "long.trc": digits, "csv": quotes}


@pytest.mark.parametrize("ending", ["trc", "bvh", "long.trc", "csv"])
def test_texts_that_swell(sandbox, tmp_path: Path, ending: str) -> None:
    text = texts_that_swell()[ending]
    assert len(text) < MEGABYTES
    path = tmp_path / f"a.{ending}"
    path.write_text(text)
    assert sandbox(fuzz_readers.markers, memory=400e6).check(path).kind == "refused"


def test_trials_that_share_their_rows(sandbox, tmp_path: Path) -> None:
    """Each trial is a copy of its rows: thirty thousand of all of them would be three gigabytes."""
    rows, trials = 1000, 30_000
    track = fuzz_samples.arm_track(rows)
    arrays = {
        "schema": np.array("hri_arm_tracks/1"),
        "time_s": track.time_s,
        "keypoints": track.keypoints,
        "start": np.zeros(trials, int),
        "length": np.full(trials, rows),
        "side": np.full(trials, "left"),
    }
    np.savez_compressed(tmp_path / "a.npz", **arrays)
    found = sandbox(fuzz_readers.tracks, memory=400e6).check(tmp_path / "a.npz")
    assert (found.kind, "trials have" in found.text) == ("refused", True)
