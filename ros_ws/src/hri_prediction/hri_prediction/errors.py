"""The one family of errors that this project raises on purpose."""

from __future__ import annotations


class HriError(Exception):
    """Base of every error raised on purpose.

    The text is one line: what was got, what was expected, and how to mend it. The parts stay
    available as attributes, so that callers need not parse the text.

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
    """A parameter, option or configuration file has an unusable value."""


class DataError(HriError):
    """A recording, model file or message holds something that cannot be used."""


class PlanningError(HriError):
    """No usable motion exists for the request, or it is malformed."""


class GraphError(HriError):
    """The node graph is not what was expected: a node, topic or process is missing or dead."""
