"""How well the segmentation agrees with labels: what it finds, and how far boundaries lie apart."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from hri_prediction.tracks.segmentation import Reach

Array = NDArray[np.float64]
MIN_OVERLAP = 0.5
"""A found reach matches a label when what both cover is at least this share of what either covers."""


@dataclass(frozen=True, eq=False)
class BoundaryErrors:
    """Found against labelled boundaries.

    Args:
        labels: Number of labelled movements.
        extra: Found reaches that match no label.
        onset_s: (m,) found minus labelled begin of the movements that are matched.
        end_s: (m,) likewise, of the ends.
    """

    labels: int
    extra: int
    onset_s: Array
    end_s: Array

    @property
    def matched(self) -> int:
        """Number of labelled movements that were found."""
        return int(self.onset_s.size)

    def figures(self) -> dict[str, Any]:
        """What goes into results: counts, and boundary errors [ms] (null when nothing is matched)."""
        if not self.matched:
            rest: dict[str, Any] = dict.fromkeys(
                ("median_ms", "p95_ms", "onset_bias_ms", "end_bias_ms")
            )
        else:
            apart = 1e3 * np.abs(np.concatenate([self.onset_s, self.end_s]))
            rest = {
                "median_ms": float(np.median(apart)),
                "p95_ms": float(np.percentile(apart, 95.0)),
                "onset_bias_ms": 1e3 * float(np.median(self.onset_s)),
                "end_bias_ms": 1e3 * float(np.median(self.end_s)),
            }
        return {
            "labels": self.labels,
            "matched": self.matched,
            "matched_share": self.matched / self.labels if self.labels else None,
            **rest,
            "extra": self.extra,
        }


def overlap(a: Reach, b: Reach) -> float:
    """Time that both cover over the time that either covers, 0 to 1."""
    both = min(a.end_s, b.end_s) - max(a.onset_s, b.onset_s)
    either = max(a.end_s, b.end_s) - min(a.onset_s, b.onset_s)
    return max(0.0, both) / either if either > 0.0 else 0.0


def match_boundaries(
    found: Sequence[Reach], labels: Sequence[Reach], min_overlap: float = MIN_OVERLAP
) -> BoundaryErrors:
    """Match found reaches to labelled movements, one to one, for the largest sum of overlaps.

    Args:
        found: What the segmentation cut out of one recording.
        labels: What a person marked in it.
        min_overlap: Pairs that overlap less are no match.
    """
    shares = np.array([[overlap(f, label) for label in labels] for f in found])
    shares = shares.reshape(len(found), len(labels))
    shares[shares < min_overlap] = 0.0
    rows, columns = linear_sum_assignment(-shares)
    pairs = [(f, c) for f, c in zip(rows, columns, strict=True) if shares[f, c] > 0.0]
    return BoundaryErrors(
        labels=len(labels),
        extra=len(found) - len(pairs),
        onset_s=np.array([found[f].onset_s - labels[c].onset_s for f, c in pairs]),
        end_s=np.array([found[f].end_s - labels[c].end_s for f, c in pairs]),
    )


def pooled(parts: Iterable[BoundaryErrors]) -> BoundaryErrors:
    """The errors of several recordings together."""
    every = list(parts)
    return BoundaryErrors(
        labels=sum(part.labels for part in every),
        extra=sum(part.extra for part in every),
        onset_s=np.concatenate([np.zeros(0), *(part.onset_s for part in every)]),
        end_s=np.concatenate([np.zeros(0), *(part.end_s for part in every)]),
    )
