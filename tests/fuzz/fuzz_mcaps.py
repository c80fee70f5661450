"""MCAP files, taken apart into records, altered, and put together with lengths and checksums that fit."""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass, field, replace

import lz4.frame
import zstandard
from fuzz_bytes import BYTES, altered
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn

from hri_prediction.bags import mcap_file as layout

_HEAD = struct.Struct("<BQ")
_NUMBERS = (
    0,
    1,
    2,
    3,
    22,
    255,
    65535,
    2**31 - 1,
    2**31,
    2**32 - 1,
    2**33,
    2**40,
    2**62,
    2**63 - 1,
    2**63,
    2**64 - 1,
)
_OPCODES = (*range(0, 17), 0x80, 0xFF)
_PACKED = ("zstd", "lz4", "")


@dataclass(frozen=True)
class Record:
    """A record, and those within it if it is a chunk.

    Attributes:
        opcode: What it is.
        body: Its content; of a chunk it is made anew.
        inner: Of a chunk.
        packed: How a chunk is compressed.
        length: What it says of its own length; none: the truth.
        said: What a chunk says of itself otherwise: size, checksum, name of the compression.
    """

    opcode: int
    body: bytes = b""
    inner: tuple[Record, ...] = ()
    packed: str = "zstd"
    length: int | None = None
    said: dict[str, int | str] = field(default_factory=dict)

    def written(self) -> bytes:
        """As it stands in a file."""
        body = self.body
        if self.opcode == layout.CHUNK and (self.inner or not body):
            body = self._chunk()
        return _HEAD.pack(self.opcode, len(body) if self.length is None else self.length) + body

    def _chunk(self) -> bytes:
        raw = b"".join(record.written() for record in self.inner)
        stamps = [struct.unpack_from("<Q", r.body, 6)[0] for r in self.inner if len(r.body) >= 14
                  and r.opcode == layout.MESSAGE]  # fmt: skip
        name = str(self.said.get("name", self.packed)).encode()
        head = struct.pack("<QQ", min(stamps, default=0), max(stamps, default=0))
        head += struct.pack("<Q", self.said.get("size", len(raw)))
        head += (
            struct.pack("<I", self.said.get("crc", zlib.crc32(raw)))
            + struct.pack("<I", len(name))
            + name
        )
        packed = compressed(raw, self.packed)
        return head + struct.pack("<Q", self.said.get("packed", len(packed))) + packed


def compressed(raw: bytes, how: str) -> bytes:
    """As a chunk holds it."""
    if how == "zstd":
        return zstandard.ZstdCompressor(level=1).compress(raw)
    return bytes(lz4.frame.compress(raw)) if how == "lz4" else raw


def records(data: bytes) -> list[Record]:
    """All records between the magic numbers of a whole file."""
    found = []
    at = len(layout.MAGIC)
    while at < len(data) - len(layout.MAGIC):
        opcode, length = _HEAD.unpack_from(data, at)
        body = data[at + _HEAD.size : at + _HEAD.size + length]
        at += _HEAD.size + length
        if opcode == layout.CHUNK:
            start = 32 + struct.unpack_from("<I", body, 28)[0] + 8
            raw = zstandard.ZstdDecompressor().decompress(body[start:])
            inner = tuple(records(layout.MAGIC + raw + layout.MAGIC))
            found.append(Record(opcode, inner=inner))
        else:
            found.append(Record(opcode, body))
    return found


def file_bytes(made: list[Record], *, indexed: bool = True, closed: bool = True) -> bytes:
    """A file of records before the index, with a new index of them.

    Args:
        made: All before the end of the data.
        indexed: Whether there is an index.
        closed: Whether there is an end at all.
    """
    out = bytearray(layout.MAGIC)
    summary: list[Record] = []
    for record in made:
        start, text = len(out), record.written()
        out += text
        place = struct.pack("<QQ", start, len(text))
        if record.opcode == layout.CHUNK:
            summary += [r for r in record.inner if r.opcode in (layout.SCHEMA, layout.CHANNEL)]
            body = text[_HEAD.size :][:16] + place + struct.pack("<IQ", 0, 0)
            summary.append(Record(layout.CHUNK_INDEX, body + struct.pack("<IQQ", 0, 0, 0)))
        elif record.opcode == layout.ATTACHMENT:
            body = place + struct.pack("<QQQ", 0, 0, 0) + struct.pack("<II", 0, 0)
            summary.append(Record(layout.ATTACHMENT_INDEX, body))
        elif record.opcode == layout.METADATA:
            summary.append(Record(layout.METADATA_INDEX, place + struct.pack("<I", 0)))
    if closed:
        out += Record(layout.DATA_END, bytes(4)).written()
        start = len(out) if indexed and summary else 0
        if start:
            out += b"".join(record.written() for record in summary)
        out += Record(layout.FOOTER, struct.pack("<QQI", start, 0, 0)).written() + layout.MAGIC
    return bytes(out)


def _body_changed(draw: DrawFn, record: Record) -> Record:
    """Other numbers in it, or other bytes."""
    body = record.body
    if not body or draw(st.integers(0, 3)) == 0:
        return replace(record, body=draw(altered((body or b"\x00",), BYTES))[:20_000])
    layout_ = draw(st.sampled_from(["<H", "<I", "<Q"]))
    width = struct.calcsize(layout_)
    at = draw(st.integers(0, max(min(len(body), 80) - width, 0)))
    value = draw(st.sampled_from(_NUMBERS)) & (256**width - 1)
    return replace(record, body=(body[:at] + struct.pack(layout_, value) + body[at + width :]))


def _chunk_changed(draw: DrawFn, record: Record) -> Record:
    """What it says of itself, how it is compressed, or what is in it."""
    what = draw(
        st.sampled_from(["inner", "inner", "inner", "size", "crc", "packed", "name", "how"])
    )
    if what == "inner":
        return replace(record, inner=tuple(changed(draw, list(record.inner))))
    if what == "how":
        return replace(record, packed=draw(st.sampled_from(_PACKED)))
    if what == "name":
        return replace(
            record, said={"name": draw(st.sampled_from(["zstd", "lz4", "", "bz2", "zstd\x00"]))}
        )
    number = draw(st.sampled_from(_NUMBERS))
    return replace(record, said={what: number & 0xFFFFFFFF if what == "crc" else number})


def changed(draw: DrawFn, made: list[Record]) -> list[Record]:
    """One record away, many times, elsewhere, other, of another kind, or of another length."""
    if not made:
        return made
    at = draw(st.one_of(st.integers(0, min(12, len(made) - 1)), st.integers(0, len(made) - 1)))
    one = made[at]
    what = draw(
        st.sampled_from(["body", "body", "body", "away", "often", "exchange", "opcode", "length"])
    )
    if what == "away":
        return made[:at] + made[at + 1 :]
    if what == "exchange":
        other = draw(st.integers(0, len(made) - 1))
        made = list(made)
        made[at], made[other] = made[other], made[at]
        return made
    if what == "often":
        return [*made[:at], *[one] * draw(st.sampled_from([2, 40])), *made[at + 1 :]]
    if what == "opcode":
        one = replace(one, opcode=draw(st.sampled_from(_OPCODES)))
    elif what == "length":
        one = replace(one, length=draw(st.sampled_from(_NUMBERS)))
    elif one.opcode == layout.CHUNK:
        one = _chunk_changed(draw, one)
    else:
        one = _body_changed(draw, one)
    return [*made[:at], one, *made[at + 1 :]]


@st.composite
def mcaps(draw: DrawFn, samples: tuple[bytes, ...]) -> bytes:
    """One of the files: its bytes altered, its records with their old index, or with one made anew."""
    content = draw(st.sampled_from(samples))
    how = draw(st.sampled_from(["data", "data", "data", "all", "bytes"]))
    if how == "bytes":
        return draw(altered((content,), BYTES))
    made = records(content)
    if how == "data":
        end = next(index for index, record in enumerate(made) if record.opcode == layout.DATA_END)
        made = made[:end]
    for _ in range(draw(st.sampled_from([1, 1, 2, 3]))):
        made = changed(draw, made)
    if how == "data":
        closed = draw(st.sampled_from([True, True, True, False]))
        data = file_bytes(made, indexed=draw(st.sampled_from([True, True, False])), closed=closed)
    else:
        data = layout.MAGIC + b"".join(record.written() for record in made) + layout.MAGIC
    if draw(st.integers(0, 8)) == 8:  # not 0, which is drawn far more often
        data = data[: draw(st.integers(0, len(data)))]
    return data
