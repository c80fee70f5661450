"""Streams of a motion capture server whose packets lie about their sizes, types and parts."""

from __future__ import annotations

import struct
from xml.sax.saxutils import escape

from hypothesis import strategies as st
from hypothesis.strategies import DrawFn

SIZES = (0, 1, 4, 7, 8, 9, 24, 2**24, 2**24 + 1, 2**31 - 1, 2**31, 2**32 - 1)
"""That a packet or a component may claim [bytes]."""
DATA, COMPONENT_3D = 3, 1
_COUNTS = (0, 1, 2, 5, 6, 1000, 2**31, 2**32 - 1)


def _size(draw: DrawFn, true: int) -> int:
    near = st.integers(max(true - 9, 0), true + 9)
    return draw(st.one_of(st.just(true), st.just(true), st.sampled_from(SIZES), near))


@st.composite
def _components(draw: DrawFn) -> bytes:
    kind = draw(st.sampled_from([COMPONENT_3D, COMPONENT_3D, COMPONENT_3D, 0, 2, 17, 40]))
    markers = draw(st.sampled_from([5, 5, 5, 0, 1, 6]))
    said = draw(st.one_of(st.just(markers), st.sampled_from(_COUNTS)))
    body = struct.pack("<Ihh", said, 0, 0) + draw(
        st.binary(min_size=12 * markers, max_size=12 * markers)
    )
    return struct.pack("<II", _size(draw, 8 + len(body)), kind) + body


@st.composite
def _packets(draw: DrawFn) -> bytes:
    kind = draw(st.sampled_from([DATA, DATA, DATA, *range(11), 2**32 - 1]))
    if kind == DATA:
        parts = draw(st.lists(_components(), max_size=3))
        count = draw(st.one_of(st.just(len(parts)), st.just(len(parts)), st.sampled_from(_COUNTS)))
        time, number = draw(st.integers(-(2**63), 2**63 - 1)), draw(st.integers(0, 2**32 - 1))
        body = struct.pack("<qII", time, number, count) + b"".join(parts)
    else:
        body = draw(st.binary(max_size=20))
    return struct.pack("<II", _size(draw, 8 + len(body)), kind) + body


@st.composite
def streams(draw: DrawFn, samples: tuple[bytes, ...]) -> bytes:
    """Packets that are right, and then some that are made here."""
    before = draw(st.sampled_from([b"", *samples]))
    return before + b"".join(draw(st.lists(_packets(), min_size=1, max_size=5)))


@st.composite
def layouts(draw: DrawFn) -> bytes:
    """Settings that are XML, with any names and values in them."""
    plain = st.text(st.characters(exclude_categories=("Cc", "Cs"))).map(escape)
    names = draw(st.lists(st.one_of(st.sampled_from(["RSHO", "RELB", "RWRA"]), plain), max_size=12))
    rate = draw(st.one_of(st.sampled_from(["100", "nan", "1e999", "-1", ""]), plain))
    up = draw(st.one_of(st.sampled_from(["+Z", "-y", ""]), plain))
    labels = "".join(f"<Label><Name>{name}</Name></Label>" for name in names)
    return (
        f"<QTM><General><Frequency>{rate}</Frequency></General><The_3D>"
        f"<AxisUpwards>{up}</AxisUpwards>{labels}</The_3D></QTM>"
    ).encode()
