"""The parameter section of a C3D file, read without believing any count in it."""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass

import numpy as np

from hri_prediction.arm.geometry import FloatArray
from hri_prediction.errors import DataError

TEXT, BYTE, WORD, REAL = -1, 1, 2, 4
"""Kinds of values, by the bytes that one takes."""
_MOST_SIZES = 7
_LONGEST_TEXT = 127
"""ezc3d takes the length of a description for a number with a sign."""


@dataclass(frozen=True)
class Parameter:
    """One parameter.

    Attributes:
        kind: Of its values.
        count: How many there are; characters of texts.
        values: As they stand in the file.
        order: Byte order: ``Intel``, ``DEC`` or ``MIPS``.
    """

    kind: int
    count: int
    values: bytes
    order: str

    @property
    def numbers(self) -> FloatArray:
        """The values as ezc3d reads them; none of a text."""
        if self.kind == TEXT:
            return np.empty(0)
        if self.kind != REAL:
            layout = {BYTE: "i1", WORD: ">i2" if self.order == "MIPS" else "<i2"}[self.kind]
            return np.frombuffer(self.values, layout).astype(float)
        if self.order == "MIPS":
            return np.frombuffer(self.values, ">f4").astype(float)
        if self.order == "Intel":
            return np.frombuffer(self.values, "<f4").astype(float)
        # A VAX has the halves exchanged and an exponent that is larger by two.
        words = np.frombuffer(self.values, "<u2").reshape(-1, 2).astype(np.uint32)
        bits = (words[:, 0] << 16) | words[:, 1]
        return bits.view(np.float32).astype(float) / 4.0


def parameters_of(content: bytes, order: str, at: int) -> dict[str, Parameter]:
    """All parameters by ``GROUP:NAME``; of several with one name, the last one. Entries begin at ``at``.

    Raises:
        DataError: when one does not end where the next begins, or is of a kind that there is not.
    """
    end = ">" if order == "MIPS" else "<"
    groups: dict[int, str] = {}
    found: list[tuple[int, str, Parameter]] = []
    try:
        while content[at] and content[at + 1]:
            length, group = struct.unpack_from("bb", content, at)
            link = at + 2 + abs(length)
            (step,) = struct.unpack_from(f"{end}H", content, link)
            text = link + 2
            name = content[at + 2 : link].decode("latin-1").upper()
            if group < 0:
                groups[-group] = name
            else:
                parameter, text = _parameter(content, order, text)
                found.append((group, name, parameter))
            beyond = text + 1 + content[text]
            # ezc3d reads on from there, wherever the file says that the next one is.
            if beyond > len(content) or (step and beyond != link + step):
                raise IndexError(beyond)
            if content[text] > _LONGEST_TEXT:
                raise IndexError(text)
            if not step:
                break
            at = link + step
    except (struct.error, IndexError) as error:
        raise DataError(
            f"the C3D file is damaged: its parameter section does not hold together at byte {at}",
            expected="a whole C3D file",
        ) from error
    return {f"{groups.get(group, '')}:{name}": parameter for group, name, parameter in found}


def _parameter(content: bytes, order: str, at: int) -> tuple[Parameter, int]:
    """The parameter whose kind stands at a byte, and the byte behind it; ``IndexError``: it is none."""
    kind, count = struct.unpack_from("bB", content, at)
    sizes = content[at + 2 : at + 2 + count]
    start = at + 2 + count
    number = math.prod(sizes)
    stop = start + abs(kind) * number
    # A text without a size has no length.
    if kind not in (TEXT, BYTE, WORD, REAL) or count > _MOST_SIZES or (kind == TEXT and not count):
        raise IndexError(kind)
    if stop >= len(content):
        raise IndexError(stop)
    return Parameter(kind, number, content[start:stop], order), stop
