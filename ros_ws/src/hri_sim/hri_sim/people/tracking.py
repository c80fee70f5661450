"""Motion capture of a simulated arm: noise, latency and drop-outs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hri_prediction.arm.geometry import FloatArray
from hri_prediction.tracks.track import ArmSample
from hri_sim.people.person import SimulatedPerson
from hri_sim.scenario.schema import PersonSpec

SAMPLE_RATE_HZ = 250
SAMPLE_PERIOD_NS = 1_000_000_000 // SAMPLE_RATE_HZ


@dataclass(frozen=True, eq=False)
class TrackedSample:
    """What the tracking system makes of one capture.

    Attributes:
        sample: The keypoints, stamped with the time of capture.
        delivery_ns: When a receiver gets it [ns]; same clock as the stamp.
    """

    sample: ArmSample
    delivery_ns: int


class TrackingModel:
    """Adds isotropic noise to the truth, delays it and loses keypoints.

    Drop-outs come in bursts, as when a marker is hidden: they begin at random (Poisson) and last
    for exponentially distributed times, both of single keypoints and of the whole arm. A lost
    keypoint is marked as not valid; the sample itself is still delivered.

    Captures must come in the order of time. Each takes the same number of random values, so equal
    seeds give equal samples.

    Args:
        spec: Whose noise, latency and drop-out rates to use.
        rng: Source of all randomness.
    """

    def __init__(self, spec: PersonSpec, rng: np.random.Generator) -> None:
        self._spec = spec
        self._rng = rng
        # Rates of the bursts of the four keypoints, then of the whole arm.
        self._rates = np.array([spec.marker_dropout_rate] * 4 + [spec.dropout_rate])
        self._lost_until_ns = np.full(5, -np.inf)
        self._last_ns: int | None = None
        self._latency_ns = round(spec.latency * 1e9)

    def observe(self, stamp_ns: int, keypoints: FloatArray) -> TrackedSample:
        """Track one capture.

        Args:
            stamp_ns: Time of capture [ns].
            keypoints: True keypoints (4, 3) [m], world frame.
        """
        elapsed_s = 0.0 if self._last_ns is None else 1e-9 * (stamp_ns - self._last_ns)
        self._last_ns = stamp_ns
        noise = self._spec.noise_sd * self._rng.standard_normal((4, 3))
        begins = self._rng.random(5) < -np.expm1(-self._rates * elapsed_s)
        lengths_ns = 1e9 * self._spec.dropout_duration * self._rng.standard_exponential(5)
        # At least the capture at which a burst begins is lost, however short the burst.
        ends = np.where(begins, stamp_ns + 1 + lengths_ns, -np.inf)
        self._lost_until_ns = np.maximum(self._lost_until_ns, ends)
        lost = self._lost_until_ns > stamp_ns
        valid = ~(lost[:4] | lost[4])
        sample = ArmSample(stamp_ns, keypoints + noise, valid, self._spec.side)
        return TrackedSample(sample, stamp_ns + self._latency_ns)


def tracked_samples(
    person: SimulatedPerson, model: TrackingModel, start_ns: int, count: int
) -> list[TrackedSample]:
    """Captures at 250 Hz.

    Args:
        person: Whose truth to track; its reaches are already planned.
        model: The tracking system.
        start_ns: Time of the first capture [ns].
        count: Number of captures.
    """
    stamps = [start_ns + index * SAMPLE_PERIOD_NS for index in range(count)]
    truth = person.truth(1e-9 * np.array(stamps, dtype=float))
    return [model.observe(stamp, points) for stamp, points in zip(stamps, truth, strict=True)]
