"""A section of the report: what it measures, and how that is written down."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from hri_sim.readability_report.laboratory import Laboratory


@dataclass(frozen=True)
class Section:
    """A part of the report.

    Attributes:
        name: Of its results in ``dmp.json``.
        title: Of its text.
        measure: Gives its results, values that JSON can hold.
        lines: Its text in Markdown, from these results.
    """

    name: str
    title: str
    measure: Callable[[Laboratory], dict[str, Any]]
    lines: Callable[[Mapping[str, Any]], list[str]]
