"""Contents of files are damaged as it is said."""

from __future__ import annotations

import numpy as np

from hri_sim.reliability.damage import cut, digit_changed, flipped

CONTENT = bytes(range(50))


def test_a_cut_file_is_the_beginning_of_it() -> None:
    rng = np.random.default_rng(0)
    found = [cut(rng, CONTENT) for _ in range(300)]
    assert all(CONTENT.startswith(part) for part in found)
    assert {len(part) for part in found} == set(range(len(CONTENT)))


def test_one_to_eight_bits_are_wrong() -> None:
    """Never the same one twice, after which it would be right again."""
    rng = np.random.default_rng(0)
    counts = set()
    for content in (CONTENT, b"a"):
        for _ in range(300):
            changed = flipped(rng, content)
            assert len(changed) == len(content)
            counts.add(sum((a ^ b).bit_count() for a, b in zip(changed, content, strict=True)))
    assert counts == set(range(1, 9))


def test_one_digit_is_another() -> None:
    rng = np.random.default_rng(0)
    content = b'{"a": 10.5, "b": [2]}'
    found = {digit_changed(rng, content) for _ in range(500)}
    for changed in found:
        (at,) = (n for n, (a, b) in enumerate(zip(content, changed, strict=True)) if a != b)
        assert content[at : at + 1].isdigit()
        assert changed[at : at + 1].isdigit()
    assert len(found) == 4 * 9
