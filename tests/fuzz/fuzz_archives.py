"""Archives of arrays (.npz), altered inside and out, with checksums that fit."""

from __future__ import annotations

import io
import json
import os
import pickle
import struct
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from fuzz_bytes import BYTES, altered
from fuzz_trees import json_text, tree_changed
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn

STORED, DEFLATED = 0, 8


@dataclass(frozen=True)
class Member:
    """A file of a zip archive, and what the archive says of it where that is not so.

    Attributes:
        name: Of the file.
        data: Its content.
        method: Of compression.
        size: What the archive says of its length; none: the truth.
        crc: And of its checksum.
    """

    name: str
    data: bytes
    method: int = STORED
    size: int | None = None
    crc: int | None = None


def zip_bytes(members: list[Member], comment: bytes = b"") -> bytes:
    """An archive."""
    out, directory = bytearray(), bytearray()
    for member in members:
        packed = member.data
        if member.method == DEFLATED:
            packer = zlib.compressobj(6, zlib.DEFLATED, -15)
            packed = packer.compress(member.data) + packer.flush()
        size = len(member.data) if member.size is None else member.size
        crc = zlib.crc32(member.data) if member.crc is None else member.crc
        name = member.name.encode()
        fields = struct.pack("<HHHHHIIIHH", 20, 0x800, member.method, 0, 33, crc, len(packed),
                             size & 0xFFFFFFFF, len(name), 0)  # fmt: skip
        directory += b"PK\x01\x02" + struct.pack("<H", 20) + fields
        directory += struct.pack("<HHHII", 0, 0, 0, 0, len(out)) + name
        out += b"PK\x03\x04" + fields + name + packed
    count = min(len(members), 0xFFFF)
    end = struct.pack("<HHHHIIH", 0, 0, count, count, len(directory), len(out), len(comment))
    return bytes(out + directory + b"PK\x05\x06" + end + comment)


def npy_bytes(array: np.ndarray) -> bytes:
    """An array as a file."""
    out = io.BytesIO()
    np.save(out, array, allow_pickle=False)
    return out.getvalue()


def npy_said(header: str, data: bytes = b"", version: tuple[int, int] = (1, 0)) -> bytes:
    """An array's file that says of itself what is given."""
    text = header.encode("latin-1") + b"\n"
    length = struct.pack("<H" if version == (1, 0) else "<I", len(text) & (2**16 - 1))
    return b"\x93NUMPY" + bytes(version) + length + text + data


def npz_bytes(arrays: Mapping[str, np.ndarray], method: int = STORED) -> bytes:
    """Arrays as ``numpy.savez`` writes them."""
    return zip_bytes([Member(f"{name}.npy", npy_bytes(a), method) for name, a in arrays.items()])


def arrays_of(content: bytes) -> dict[str, np.ndarray]:
    """What is in an archive."""
    with np.load(io.BytesIO(content), allow_pickle=False) as archive:
        return {name: archive[name] for name in archive.files}


class Canary:
    """What, when it is unpickled, makes a folder."""

    def __init__(self, folder: str) -> None:
        self.folder = folder

    def __reduce__(self) -> tuple[Any, ...]:
        return os.mkdir, (self.folder,)


def pickled(canary: str) -> bytes:
    """An array of objects that were pickled, as numpy writes it."""
    return npy_said(
        "{'descr': '|O', 'fortran_order': False, 'shape': (1,), }", pickle.dumps(Canary(canary))
    )


_TYPES = (
    "f4",
    "f2",
    "i8",
    "u1",
    "?",
    "c16",
    "U3",
    "S5",
    "M8[ns]",
    "m8[s]",
    "V8",
    ">f8",
    "g",
    "i1,f8",
)
_HUGE = (
    *("(1000000000000,)", "(4294967296, 4294967296)", "(-1,)", "(0, 1000000000000)", "(1000000000, 0, 3)"),
    *("(2, " + "1, " * 70 + ")", "(True,)", "(1.5,)", "'x'", "()", "(9999999,)", "(" * 150, "(10**9,)"),
)  # fmt: skip
_DESCRIPTIONS = (
    *("'<U0'", "'|O'", "'<f8'", "'<U1000000000'", "'|S2147483647'", "'|V0'", "[]", "[('a', '|O')]", "None"),
    *("[('a', '<f8', (1000000,))]", "'<f9999'", "[('a', [('b', '<U0')])]", "'<M8[ns]'", "'x'", "{}"),
)  # fmt: skip
_NUMBERS = (
    0.0,
    -1.0,
    1.0,
    1e9,
    1e300,
    -1e308,
    np.nan,
    np.inf,
    -np.inf,
    5e-324,
    2.0**63,
    -(2.0**63),
)


def _other_values(draw: DrawFn, array: np.ndarray) -> np.ndarray:
    array = array.copy()
    if not array.size:
        return array
    if array.dtype.kind in "U":
        points = array.view(np.uint32) if array.ndim else array.reshape(1).view(np.uint32)
        points.ravel()[draw(st.integers(0, points.size - 1))] = draw(
            st.sampled_from([0, 0xD800, 0x10FFFF, 0x110000, 0xFFFFFFFF, 0x27, 0x0A, 0x661])
        )
        return array
    flat = array.reshape(-1)
    where = draw(st.sampled_from(["one", "one", "all", "rows"]))
    value = draw(st.one_of(st.sampled_from(_NUMBERS), st.integers(-2, 300).map(float)))
    with np.errstate(all="ignore"):
        number = np.array(value).astype(array.dtype)
    if where == "one":
        flat[draw(st.integers(0, flat.size - 1))] = number
    elif where == "all":
        flat[:] = number
    else:
        flat[:] = np.roll(flat, draw(st.integers(1, 50)))
    return array


def _other_shape(draw: DrawFn, array: np.ndarray) -> np.ndarray:
    what = draw(
        st.sampled_from(["cut", "more", "flat", "deep", "turned", "empty", "scalar", "fortran"])
    )
    if what == "cut" and array.ndim:
        return array[: draw(st.integers(0, max(len(array) - 1, 0)))]
    if what == "more" and array.ndim:
        return np.concatenate([array] * draw(st.sampled_from([2, 3, 50])))
    if what == "empty":
        return array.ravel()[:0].reshape((0, *array.shape[1:]) if array.ndim else (0,))
    if what == "scalar" and array.size:
        return array.ravel()[0:1].reshape(())
    if what == "fortran":
        return np.asfortranarray(array)
    return {"flat": array.ravel(), "deep": array[None]}.get(what, array.T)


def _other_type(draw: DrawFn, array: np.ndarray) -> np.ndarray:
    kind = np.dtype(draw(st.sampled_from(_TYPES)))
    try:
        with np.errstate(all="ignore"):
            return array.astype(kind)
    except Exception:  # numpy raises errors of a dozen kinds
        return np.zeros(array.shape, kind)


def _tree_of(array: np.ndarray) -> Any:
    """What is in a header; none of another array, and of a header that is none any more."""
    if array.dtype.kind != "U" or array.ndim:
        return None
    try:
        found = json.loads(str(array[()]))
    except (SystemError, ValueError):
        return None
    return found if isinstance(found, dict) else None


def array_changed(draw: DrawFn, array: np.ndarray) -> np.ndarray:
    """The same with other values, of another shape, or of another type."""
    tree = _tree_of(array)
    if tree is not None and draw(st.integers(0, 3)):
        return np.array(json_text(tree_changed(draw, tree)))
    return draw(st.sampled_from([_other_values, _other_values, _other_shape, _other_type]))(
        draw, array
    )


def _file_changed(draw: DrawFn, data: bytes, canary: str) -> bytes:
    """An array's file with another header, or with what is none."""
    what = draw(
        st.sampled_from(["shape", "type", "both", "version", "long", "cut", "more", "pickle"])
    )
    if what == "pickle":
        return pickled(canary)
    if what == "cut":
        return data[: draw(st.integers(0, len(data)))]
    if what == "more":
        return data + bytes(draw(st.integers(1, 100)))
    if what == "long":
        return npy_said("{" + " " * 60_000 + "}", version=(2, 0))
    if what == "version":
        return data[:6] + bytes([draw(st.integers(0, 9)), draw(st.integers(0, 3))]) + data[8:]
    shape = draw(st.sampled_from(_HUGE)) if what != "type" else "(2,)"
    kind = draw(st.sampled_from(_DESCRIPTIONS)) if what != "shape" else "'<f8'"
    fortran = draw(st.sampled_from(["False", "True", "3"]))
    return npy_said(
        f"{{'descr': {kind}, 'fortran_order': {fortran}, 'shape': {shape}, }}", data[128:]
    )


def _archive_changed(draw: DrawFn, members: list[Member]) -> list[Member]:
    """Another order, another name, twice, away, or with what is not so."""
    at = draw(st.integers(0, len(members) - 1))
    one = members[at]
    what = draw(
        st.sampled_from(["size", "crc", "method", "twice", "away", "order", "name", "exchange"])
    )
    if what == "size":
        one = replace(one, size=draw(st.sampled_from([0, 1, len(one.data) + 5, 2**31, 2**32 - 2])))
    elif what == "crc":
        one = replace(one, crc=draw(st.integers(0, 2**32 - 1)))
    elif what == "method":
        one = replace(one, method=draw(st.sampled_from([STORED, DEFLATED, 1, 9, 12, 14, 99])))
    elif what == "name":
        names = ["x.npy", "header", "../a.npy", "a\x00.npy", "", "/", "ü.npy", members[0].name]
        one = replace(one, name=draw(st.sampled_from(names)))
    elif what == "twice":
        return [*members, *[one] * draw(st.sampled_from([1, 300]))]
    elif what == "away":
        return members[:at] + members[at + 1 :]
    elif what == "exchange":
        one = replace(one, data=members[draw(st.integers(0, len(members) - 1))].data)
    else:
        return members[::-1]
    return [*members[:at], one, *members[at + 1 :]]


@st.composite
def archives(draw: DrawFn, samples: tuple[bytes, ...], canary: str) -> bytes:
    """One of the archives: its arrays altered, or their files, or the archive, or all of its bytes."""
    content = draw(st.sampled_from(samples))
    if draw(st.integers(0, 6)) == 0:
        return draw(altered((content,), BYTES))
    arrays = arrays_of(content)
    method = draw(st.sampled_from([STORED, DEFLATED]))
    for _ in range(draw(st.sampled_from([0, 1, 1, 1, 2, 3]))):
        name = draw(st.sampled_from(sorted(arrays)))
        if "header" in arrays and draw(st.booleans()):
            name = "header"
        arrays[name] = array_changed(draw, arrays[name])
    members = [Member(f"{name}.npy", npy_bytes(a), method) for name, a in arrays.items()]
    for _ in range(draw(st.sampled_from([0, 0, 0, 1, 1, 2]))):
        if members and draw(st.booleans()):
            members = _archive_changed(draw, members)
        elif members:
            at = draw(st.integers(0, len(members) - 1))
            members[at] = replace(members[at], data=_file_changed(draw, members[at].data, canary))
    return zip_bytes(members)


def odd_archives(canary: str) -> dict[str, bytes]:
    """Archives that are made, not altered: by what they are."""
    zeros = npy_said(
        "{'descr': '<f8', 'fortran_order': False, 'shape': (40000000,), }", bytes(320_000_000)
    )
    names = ("header", "time_s", "pos", "schema")
    bomb = zip_bytes([Member("time_s.npy", zeros, DEFLATED)])
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_BZIP2) as archive:
        archive.writestr("header.npy", bytes(5_000_000))
    long = npy_said("{'descr': '<U0', 'fortran_order': False, 'shape': (1000000000000,), }")
    swelling = np.array("[" + "[]," * 11_000_000 + "[]]")
    return {
        "bomb": bomb,
        "a header that swells": zip_bytes([Member("header.npy", npy_bytes(swelling), DEFLATED)]),
        "many small ones": zip_bytes([Member(f"{i}.npy", npy_bytes(np.zeros(1))) for i in range(300)]),
        "empty archive": zip_bytes([]),
        "other compression": packed.getvalue(),
        "pickles": zip_bytes([Member(f"{name}.npy", pickled(canary)) for name in names]),
        "a pickle alone": pickle.dumps(Canary(canary)),
        "a pickle in .npy": pickled(canary),
        "nothing many times": zip_bytes([Member(f"{n}.npy", long) for n in ("joint_names", "onset")]),
        "no arrays": zip_bytes([Member("a.txt", b"words")]),
        "an archive in it": zip_bytes([Member("header.npy", bomb[:100])]),
        "comment": zip_bytes([Member("a.npy", b"")], comment=b"PK\x05\x06" * 5000),
    }  # fmt: skip
