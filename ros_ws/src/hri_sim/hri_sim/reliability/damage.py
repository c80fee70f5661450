"""Contents of files, damaged at random."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

DIGITS = b"0123456789"
Damage = Callable[[np.random.Generator, bytes], bytes]


def cut(rng: np.random.Generator, content: bytes) -> bytes:
    """The file ends earlier; none of it may be left."""
    return content[: int(rng.integers(len(content)))]


def flipped(rng: np.random.Generator, content: bytes) -> bytes:
    """One to eight bits are wrong."""
    changed = bytearray(content)
    count = min(int(rng.integers(1, 9)), 8 * len(content))
    for bit in rng.choice(8 * len(content), count, replace=False):
        changed[bit // 8] ^= 1 << (bit % 8)
    return bytes(changed)


def digit_changed(rng: np.random.Generator, content: bytes) -> bytes:
    """One digit of a text is another."""
    places = [at for at, byte in enumerate(content) if byte in DIGITS]
    at = places[int(rng.integers(len(places)))]
    others = DIGITS.replace(content[at : at + 1], b"")
    return content[:at] + others[rng.integers(len(others)) :][:1] + content[at + 1 :]
