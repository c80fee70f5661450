"""C3D files: parameters are taken apart, altered, and put together so that one follows on the other."""

from __future__ import annotations

import struct
from dataclasses import dataclass, replace

from fuzz_bytes import BYTES, altered
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn

BLOCK = 512
_SIZES = (
    (),
    (0,),
    (1,),
    (2,),
    (5,),
    (255,),
    (0, 3),
    (4, 0),
    (1, 1, 1),
    (2, 3),
    (2, 2, 2),
    (1,) * 7,
    (1,) * 9,
    (1,) * 200,
)
_WHOLE = (0, 1, 2, 5, 64, 255, 1000, 32767, -1, -2, -32768)
_REAL = (
    0.0,
    -0.0,
    1.0,
    -1.0,
    1e-30,
    1e30,
    -1e30,
    100.0,
    1e9,
    float("nan"),
    float("inf"),
    float("-inf"),
)
_NAMES = (
    *("USED", "FRAMES", "RATE", "SCALE", "DATA_START", "LABELS", "UNITS", "OFFSET", "GEN_SCALE", "BITS"),
    *("POINT", "ANALOG", "ROTATION", "TRIAL", "FORCE_PLATFORM", "SHADOW", "RATIO", "LABELS2", "SCALE2", ""),
    *("ACTUAL_START_FIELD", "ACTUAL_END_FIELD", "DESCRIPTIONS", "Y_SCREEN", "FORMAT", "X" * 127),
)  # fmt: skip


@dataclass(frozen=True)
class Entry:
    """A group (a number below 0), or a parameter of one.

    Attributes:
        name: Its name.
        group: Its number.
        kind: Bytes of a value, -1 for texts.
        sizes: Of the values.
        values: As they stand there.
        text: What describes it.
    """

    name: str
    group: int
    kind: int = 2
    sizes: tuple[int, ...] = ()
    values: bytes = b""
    text: bytes = b""

    def written(self, end: str) -> bytes:
        """As it stands in a file of a byte order."""
        body = self.text_with_length()
        if self.group >= 0:
            body = (
                struct.pack("bB", self.kind, len(self.sizes))
                + bytes(self.sizes)
                + self.values
                + body
            )
        head = struct.pack("bb", len(self.name), self.group) + self.name.encode("latin-1")
        return head + struct.pack(f"{end}H", (len(body) + 2) & 0xFFFF) + body

    def text_with_length(self) -> bytes:
        """The description."""
        return bytes([len(self.text)]) + self.text


def order_of(content: bytes) -> str:
    """Byte order, as :mod:`struct` names it."""
    return ">" if content[(content[0] - 1) * BLOCK + 3] == 86 else "<"


def entries_of(content: bytes) -> list[Entry]:
    """The parameters of a file that is whole."""
    end, at, found = order_of(content), (content[0] - 1) * BLOCK + 4, []
    while content[at] and content[at + 1]:
        length, group = struct.unpack_from("bb", content, at)
        link = at + 2 + abs(length)
        name = content[at + 2 : link].decode("latin-1")
        (step,) = struct.unpack_from(f"{end}H", content, link)
        if group < 0:
            found.append(Entry(name, group, text=content[link + 3 : link + 3 + content[link + 2]]))
        else:
            kind, count = struct.unpack_from("bB", content, link + 2)
            sizes = tuple(content[link + 4 : link + 4 + count])
            start, stop = link + 4 + count, link + step - 1
            found.append(Entry(name, group, kind, sizes, content[start:stop]))
        at = link + step
    return found


def with_entries(content: bytes, entries: list[Entry]) -> bytes:
    """The file with other parameters; its data follow on them."""
    end, start = order_of(content), (content[0] - 1) * BLOCK
    data = (struct.unpack_from(f"{end}H", content, 16)[0] - 1) * BLOCK
    section = (
        content[start : start + 4] + b"".join(one.written(end) for one in entries) + b"\x00\x00"
    )
    section += bytes(-len(section) % BLOCK)
    blocks = len(section) // BLOCK
    section = section[:2] + bytes([blocks & 255]) + section[3:]
    header = bytearray(content[:start])
    struct.pack_into(f"{end}H", header, 16, (content[0] + blocks) & 0xFFFF)
    return bytes(header) + section + content[data:]


def with_analogs(content: bytes, channels: int = 3) -> bytes:
    """The file with analogue channels and rotations, as far as its parameters go."""
    end = order_of(content)
    floats, shorts = struct.pack(f"{end}{channels}f", *[1.0] * channels), bytes(2 * channels)
    more = [
        Entry("ANALOG", -2),
        Entry("USED", 2, 2, (), struct.pack(f"{end}h", channels)),
        Entry("RATE", 2, 4, (), struct.pack(f"{end}f", 100.0)),
        Entry("GEN_SCALE", 2, 4, (), struct.pack(f"{end}f", 1.0)),
        Entry("SCALE", 2, 4, (channels,), floats),
        Entry("OFFSET", 2, 2, (channels,), shorts),
        Entry("LABELS", 2, -1, (2, channels), b"ab" * channels),
    ]
    found = bytearray(with_entries(content, entries_of(content) + more))
    struct.pack_into(f"{end}H", found, 4, channels)
    struct.pack_into(f"{end}H", found, 18, 1)
    points, first, last = struct.unpack_from(f"{end}HxxHH", found, 2)
    width = 4 if found[12 if end == ">" else 15] & 0x80 else 2
    data = (struct.unpack_from(f"{end}H", found, 16)[0] - 1) * BLOCK
    frame, rows = 4 * points * width, []
    for index in range(last - first + 1):
        rows.append(
            bytes(found[data + index * frame : data + (index + 1) * frame])
            + bytes(channels * width)
        )
    return bytes(found[:data]) + b"".join(rows) + bytes(BLOCK)


def _entry_changed(draw: DrawFn, one: Entry, end: str) -> Entry:
    what = draw(
        st.sampled_from(
            ["values", "values", "sizes", "sizes", "kind", "name", "group", "text", "cut"]
        )
    )
    if what == "name":
        return replace(one, name=draw(st.sampled_from(_NAMES)))
    if what == "group":
        return replace(one, group=draw(st.sampled_from([-128, -3, -2, -1, 1, 2, 3, 127])))
    if what == "text":
        return replace(one, text=b"d" * draw(st.sampled_from([0, 1, 127, 128, 200, 255])))
    if what == "cut":
        return replace(one, values=one.values[: draw(st.integers(0, len(one.values)))])
    kind, sizes = one.kind, one.sizes
    if what == "kind":
        kind = draw(st.sampled_from([-1, 1, 2, 4, 0, 3, 8, -2, -128]))
    elif what == "sizes":
        sizes = draw(st.sampled_from(_SIZES))
    count = 1
    for size in sizes:
        count *= size
    count = min(count, 3000)
    if kind == 4:
        values = b"".join(
            struct.pack(f"{end}f", draw(st.sampled_from(_REAL))) for _ in range(min(count, 8))
        )
        values = (values + bytes(4 * count))[: 4 * count]
    elif kind == 2:
        values = b"".join(
            struct.pack(f"{end}h", draw(st.sampled_from(_WHOLE))) for _ in range(min(count, 8))
        )
        values = (values + bytes(2 * count))[: 2 * count]
    else:
        values = (one.values + b"a" * count)[:count]
    return replace(one, kind=kind, sizes=sizes, values=values)


@st.composite
def c3ds(draw: DrawFn, samples: tuple[bytes, ...]) -> bytes:
    """One of the files: its parameters altered, then perhaps its bytes."""
    content = draw(st.sampled_from(samples))
    how = draw(st.sampled_from(["bytes", "parameters", "parameters", "parameters", "both"]))
    if how != "bytes":
        entries, end = entries_of(content), order_of(content)
        for _ in range(draw(st.sampled_from([1, 1, 2, 3]))):
            at = draw(st.integers(0, len(entries) - 1))
            change = draw(
                st.sampled_from(["one", "one", "one", "one", "away", "twice", "exchange"])
            )
            if change == "away" and len(entries) > 1:
                del entries[at]
            elif change == "twice":
                entries.append(entries[at])
            elif change == "exchange":
                other = draw(st.integers(0, len(entries) - 1))
                entries[at], entries[other] = entries[other], entries[at]
            else:
                entries[at] = _entry_changed(draw, entries[at], end)
        content = with_entries(content, entries)
    if how in ("bytes", "both"):
        content = draw(altered((content,), BYTES))
    return content
