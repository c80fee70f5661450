"""The one family of errors that this project raises on purpose."""

from __future__ import annotations

from collections.abc import Sequence

_SHOWN = 200
_FAULTS_SHOWN = 50


def cut(text: str, most: int = _SHOWN) -> str:
    """A text as an error shows it: no more of it than can be read."""
    return text if len(text) <= most else f"{text[:most]}…"


def shown(value: object) -> str:
    """A value as an error shows it: as Python writes it, cut."""
    return cut(repr(value))


class HriError(Exception):
    """Base of every error raised on purpose.

    The text is one line: what was got, what was expected, and how to mend it. The parts stay
    available as attributes, so that callers need not parse the text. Only :func:`all_of` makes more
    lines, one a fault.

    Args:
        problem: What is wrong, naming the thing that was got.
        expected: What would have been right (may be empty).
        hint: What the user can do (may be empty).
    """

    def __init__(self, problem: str, *, expected: str = "", hint: str = "") -> None:
        self.problem = problem
        self.expected = expected
        self.hint = hint
        parts = [problem]
        if expected:
            parts.append(f"expected {expected}")
        if hint:
            parts.append(hint)
        super().__init__("; ".join(parts))


class ConfigError(HriError):
    """A parameter, option or configuration file has an unusable value.

    Attributes:
        faults: All that is wrong, each by itself; mostly only this one.
    """

    def __init__(self, problem: str, *, expected: str = "", hint: str = "") -> None:
        super().__init__(problem, expected=expected, hint=hint)
        self.faults: tuple[ConfigError, ...] = (self,)


def all_of(where: str, faults: Sequence[ConfigError]) -> ConfigError:
    """One error of all faults that were found, so that a file is mended in one go.

    Args:
        where: What has them, such as a file; may be empty.
        faults: At least one; one alone stays one line.
    """
    before = f"{where}: " if where else ""
    if len(faults) == 1:
        (only,) = faults
        return ConfigError(before + only.problem, expected=only.expected, hint=only.hint)
    lines = "".join(f"\n  {fault}" for fault in faults[:_FAULTS_SHOWN])
    if len(faults) > _FAULTS_SHOWN:
        lines += f"\n  and {len(faults) - _FAULTS_SHOWN} more"
    error = ConfigError(f"{before}{len(faults)} faults{lines}")
    error.faults = tuple(faults)
    return error


class DataError(HriError):
    """A recording, model file or message holds something that cannot be used."""


class PlanningError(HriError):
    """No usable motion exists for the request, or it is malformed."""


class GraphError(HriError):
    """The node graph is not what was expected: a node, topic or process is missing or dead."""
