"""The newest samples of an arm in a ring, and what they say of its speed: compiled, 250 times a second."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hri_prediction.compiled import njit

RING = 64
"""Samples that are kept: what comes in a window of 48 ms from any capture system."""
NANO = 1_000_000_000
LEAST = 3
"""Samples of a keypoint without which its speed is not told."""
FITS, JUMPS = 0, 1
"""Verdicts on a sample; limbs of a length that none has are -1 - limb."""


@njit
def judge(
    stamp_ns: int,
    keypoints: Any,
    places: Any,
    seen_ns: Any,
    plausible_speed: float,
    jump: float,
    shortest: float,
    longest: float,
) -> int:
    """What a sample is: FITS, JUMPS, or -1 (upper arm) or -2 (forearm) for a length that no limb has.

    Args:
        stamp_ns: Its time [ns].
        keypoints: Shoulder, elbow, wrist, hand tip (4, 3) [m]; NaN where not seen.
        places: Where they were seen last (4, 3) [m]; NaN: never.
        seen_ns: When that was (4,) [ns].
        plausible_speed: No point is faster [m/s].
        jump: So much may a place jump all the same [m].
        shortest: Length of a limb [m].
        longest: Length of a limb [m].
    """
    for limb in range(2):
        squares = 0.0
        for k in range(3):
            squares += (keypoints[limb + 1, k] - keypoints[limb, k]) ** 2
        length = math.sqrt(squares)
        if length < shortest or length > longest:  # NaN is neither
            return -1 - limb
    for point in range(4):
        squares = 0.0
        for k in range(3):
            squares += (keypoints[point, k] - places[point, k]) ** 2
        seconds = (stamp_ns - seen_ns[point]) / NANO
        if math.sqrt(squares) > plausible_speed * seconds + jump:
            return JUMPS
    return FITS


@njit
def store(
    stamp_ns: int,
    keypoints: Any,
    places: Any,
    seen_ns: Any,
    ring_ns: Any,
    ring: Any,
    span: Any,
    window_ns: int,
) -> None:
    """Put a sample into the ring, drop what is older than the window, and note what is seen.

    Args:
        stamp_ns: Its time [ns].
        keypoints: (4, 3) [m]; NaN where not seen.
        places: Get the keypoints that are seen (4, 3) [m].
        seen_ns: Get when (4,) [ns].
        ring_ns: Times of the samples (RING,) [ns].
        ring: The samples (RING, 4, 3) [m].
        span: Index of the oldest sample, and how many there are (2,).
        window_ns: Samples of so long are kept [ns].
    """
    if span[1] == RING:
        span[0] = (span[0] + 1) % RING
        span[1] -= 1
    at = (span[0] + span[1]) % RING
    ring_ns[at] = stamp_ns
    ring[at] = keypoints
    span[1] += 1
    while ring_ns[span[0]] < stamp_ns - window_ns:
        span[0] = (span[0] + 1) % RING
        span[1] -= 1
    for point in range(4):
        if not math.isnan(keypoints[point, 0]):
            places[point] = keypoints[point]
            seen_ns[point] = stamp_ns


@njit
def velocities(ring_ns: Any, ring: Any, span: Any, out: Any, spreads: Any) -> float:
    """Slopes of straight lines through the samples; returns half of how long these take [s].

    Noise of a standard deviation s in the samples becomes one of s/√Σ(t - t̄)² in a slope: of a few
    samples, as after a gap, many times that of a whole window.

    Args:
        ring_ns: Times of the samples (RING,) [ns].
        ring: The samples (RING, 4, 3) [m].
        span: Index of the oldest sample, and how many there are (2,).
        out: Result (4, 3) [m/s]; NaN for what is not in the newest sample, or was seen too seldom.
        spreads: Result (4,): standard deviation of each slope per metre of noise [1/s]; NaN likewise.
    """
    first, count = span
    newest = (first + count - 1) % RING
    for point in range(4):
        seen, mean = 0, 0.0
        for n in range(count):
            at = (first + n) % RING
            if not math.isnan(ring[at, point, 0]):
                seen += 1
                mean += (ring_ns[at] - ring_ns[newest]) / NANO
        if seen < LEAST or math.isnan(ring[newest, point, 0]):
            out[point] = spreads[point] = np.nan
            continue
        mean /= seen
        squares = 0.0
        out[point] = 0.0
        for n in range(count):
            at = (first + n) % RING
            if not math.isnan(ring[at, point, 0]):
                off = (ring_ns[at] - ring_ns[newest]) / NANO - mean
                squares += off * off
                for k in range(3):
                    out[point, k] += off * ring[at, point, k]
        squares = max(squares, 1e-12)
        spreads[point] = 1.0 / math.sqrt(squares)
        for k in range(3):
            out[point, k] /= squares
    return 0.5 * (ring_ns[newest] - ring_ns[first]) / NANO
