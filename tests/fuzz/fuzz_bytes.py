"""Files altered as bytes and as text, whatever is in them."""

from __future__ import annotations

import re
import struct
from collections.abc import Callable

from hypothesis import strategies as st
from hypothesis.strategies import DrawFn

LONGEST = 200_000
"""Altered files are cut there, unless something else is said [bytes]."""
NUMBERS = (
    *(b"nan", b"inf", b"-inf", b"1e999", b"-1e308", b"1e-320", b"0", b"-0", b"-1", b"1", b"2", b"1e6"),
    *(b"65535", b"65536", b"2147483648", b"4294967295", b"1e9", b"9223372036854775807"),
    *(b"18446744073709551616", b"9" * 5000, b"1" * 60_000 + b"x", b"0." + b"0" * 3000 + b"1"),
    *(b"0x10", b"1_0", "²".encode(), "١٢".encode(), b"--5", b"+", b".", b"", b"1e", b"1,5", b"null"),
)  # fmt: skip
"""What may stand where a number is."""
PIECES = (
    *(b"\x00", b"\xff", b"\xff\xfe", b"\xef\xbb\xbf", b"\r", b"\n", b"\r\n", b"\t", b"\t\t\t", b","),
    *(b'"', b"#", b"{", b"}", b"[", b"]", b":", b"- ", b" ", b"\x1c", b"\x85", "\u2028".encode()),
    *(b"\xed\xa0\x80", b"\xf4\x90\x80\x80", b"A" * 200_000, b"\x00" * 4096, b"[" * 5000, b"{" * 5000),
)  # fmt: skip
"""What may be put in somewhere."""
_WORDS = (
    0,
    1,
    2,
    0x7F,
    0x80,
    0xFF,
    0x7FFF,
    0x8000,
    0xFFFF,
    2**31 - 1,
    2**31,
    2**32 - 1,
    2**63 - 1,
    2**63,
)
_NUMBER = re.compile(rb"[-+]?[0-9]+(?:\.[0-9]*)?(?:[eE][-+]?[0-9]+)?")

Change = Callable[[DrawFn, bytes], bytes]


def place(draw: DrawFn, size: int) -> int:
    """A position; those at the beginning, where headers are, as often as all others together."""
    near = min(size, 600)
    return draw(st.one_of(st.integers(0, near), st.integers(0, size)))


def _flip(draw: DrawFn, content: bytes) -> bytes:
    changed = bytearray(content)
    for _ in range(draw(st.integers(1, 4))):
        changed[place(draw, len(changed) - 1)] ^= 1 << draw(st.integers(0, 7))
    return bytes(changed)


def _byte(draw: DrawFn, content: bytes) -> bytes:
    changed = bytearray(content)
    changed[place(draw, len(changed) - 1)] = draw(st.integers(0, 255))
    return bytes(changed)


def _word(draw: DrawFn, content: bytes) -> bytes:
    """A number of 2, 4 or 8 bytes, of either order, over what is there."""
    layout = draw(st.sampled_from(["<H", ">H", "<I", ">I", "<Q", ">Q"]))
    width = struct.calcsize(layout)
    if len(content) < width:
        return content
    at = place(draw, len(content) - width)
    value = draw(st.one_of(st.sampled_from(_WORDS), st.integers(0, 300))) & (256**width - 1)
    return content[:at] + struct.pack(layout, value) + content[at + width :]


def _cut(draw: DrawFn, content: bytes) -> bytes:
    return content[: place(draw, len(content))]


def _put_in(draw: DrawFn, content: bytes) -> bytes:
    at = place(draw, len(content))
    piece = draw(st.one_of(st.sampled_from(PIECES), st.binary(min_size=1, max_size=20)))
    return content[:at] + piece + content[at:]


def _take_out(draw: DrawFn, content: bytes) -> bytes:
    at = place(draw, len(content))
    return content[:at] + content[at + draw(st.integers(1, 600)) :]


def _repeat(draw: DrawFn, content: bytes) -> bytes:
    at = place(draw, len(content))
    length, times = draw(st.integers(1, 2000)), draw(st.sampled_from([1, 2, 10, 300]))
    return content[:at] + content[at : at + length] * times + content[at:]


def _exchange(draw: DrawFn, content: bytes) -> bytes:
    one, two = sorted((place(draw, len(content)), place(draw, len(content))))
    length = min(draw(st.integers(1, 600)), two - one)
    first, second = content[one : one + length], content[two : two + length]
    return content[:one] + second + content[one + length : two] + first + content[two + length :]


def _number(draw: DrawFn, content: bytes) -> bytes:
    """Another number in a text."""
    found = list(_NUMBER.finditer(content))
    if not found:
        return content
    match = found[min(draw(st.one_of(st.integers(0, 40), st.integers(0, 10**6))), len(found) - 1)]
    value = draw(st.one_of(st.sampled_from(NUMBERS), st.integers(-300, 300).map(b"%d".__mod__)))
    return content[: match.start()] + value + content[match.end() :]


def _lines(draw: DrawFn, content: bytes) -> bytes:
    """A line away, twice, many times, elsewhere, cut, or joined with the next."""
    lines = content.splitlines(keepends=True)
    if not lines:
        return content
    last = len(lines) - 1
    at = min(draw(st.one_of(st.integers(0, 12), st.integers(0, 10**4))), last)
    what = draw(st.sampled_from(["away", "twice", "often", "elsewhere", "cut", "join"]))
    if what == "away":
        del lines[at]
    elif what == "elsewhere":
        lines.insert(draw(st.integers(0, last)), lines.pop(at))
    elif what == "cut":
        lines[at] = lines[at][: draw(st.integers(0, len(lines[at])))]
    elif what == "join":
        lines[at] = lines[at].rstrip(b"\r\n")
    else:
        lines[at:at] = [lines[at]] * (1 if what == "twice" else 200)
    return b"".join(lines)


def _cells(draw: DrawFn, content: bytes) -> bytes:
    """A cell of a line away, twice, many times, empty, or in the place of another."""
    lines = content.splitlines(keepends=True)
    if not lines:
        return content
    at = min(draw(st.one_of(st.integers(0, 12), st.integers(0, 10**4))), len(lines) - 1)
    separator = draw(st.sampled_from([b"\t", b",", b" ", b": "]))
    cells = lines[at].split(separator)
    one = min(draw(st.integers(0, 60)), len(cells) - 1)
    two = min(draw(st.integers(0, 60)), len(cells) - 1)
    what = draw(st.sampled_from(["away", "twice", "often", "empty", "exchange"]))
    if what == "away":
        del cells[one]
    elif what == "empty":
        cells[one] = b""
    elif what == "exchange":
        cells[one], cells[two] = cells[two], cells[one]
    else:
        cells[one:one] = [cells[one]] * (1 if what == "twice" else 3000)
    lines[at] = separator.join(cells)
    return b"".join(lines)


BYTES: tuple[Change, ...] = (_flip, _byte, _word, _cut, _put_in, _take_out, _repeat, _exchange)
TEXT: tuple[Change, ...] = (_number, _number, _lines, _cells, _cells)


@st.composite
def altered(
    draw: DrawFn,
    samples: tuple[bytes, ...],
    changes: tuple[Change, ...] = BYTES,
    longest: int = LONGEST,
) -> bytes:
    """One of the files, with one to four changes, cut where it is too long [bytes]."""
    content = draw(st.sampled_from(samples))
    for _ in range(draw(st.sampled_from([1, 1, 2, 3, 4]))):
        if content:
            content = draw(st.sampled_from(changes))(draw, content)[:longest]
    return content
