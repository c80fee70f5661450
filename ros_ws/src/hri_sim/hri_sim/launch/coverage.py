"""How well the predictions of a run were calibrated: shares of the truth within their regions."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from hri_prediction.bags.reader import BagReader
from hri_prediction.ros.messages import HumanPrediction
from hri_prediction.ros.time import NANO, to_ns

FloatArray = NDArray[np.float64]
WRIST = 2


@dataclass(frozen=True)
class Coverage:
    """Calibration of the wrist predictions made while the person was reaching.

    Attributes:
        predictions: Predictions looked at.
        points: Predicted points with a known truth.
        share_50: Share of true points within the 50 % region.
        share_95: Share within the 95 % region.
        error_m: Median distance of mean and truth, all horizons [m].
    """

    predictions: int
    points: int
    share_50: float
    share_95: float
    error_m: float


def prediction_coverage(bag: Path, body_id: str) -> Coverage | None:
    """Compare what was predicted with what truly came; none without a reaching prediction.

    Args:
        bag: Bag of a run with /sim/bodies/<id>/arm.
        body_id: Whose arms.
    """
    reader = BagReader(bag, allow_unclosed=True)
    truth_topic = f"/sim/bodies/{body_id}/arm"
    prediction_topic = f"/humans/bodies/{body_id}/prediction"
    true: dict[str, dict[int, FloatArray]] = {}
    predictions = []
    for message in reader.messages({truth_topic, prediction_topic}):
        decoded = message.decode()
        if message.topic == truth_topic:
            wrist = np.array(decoded.keypoints).reshape(4, 3)[WRIST]
            true.setdefault(decoded.side, {}).setdefault(to_ns(decoded.header.stamp), wrist)
        elif decoded.state == HumanPrediction.REACHING:
            predictions.append(decoded)
    predictions = [item for item in predictions if len(true.get(item.side, ())) > 1]
    if not predictions:
        return None
    paths = {
        side: (
            np.array(sorted(wrists), dtype=np.int64),
            np.array([wrists[t] for t in sorted(wrists)]),
        )
        for side, wrists in true.items()
    }
    distances, squared = [], []
    for prediction in predictions:
        times, path = paths[prediction.side]
        count = len(prediction.times)
        stamp = to_ns(prediction.header.stamp)
        ahead = np.array(prediction.times)
        known = stamp + ahead * NANO <= times[-1]
        seconds = (times - stamp) / NANO
        truth = np.stack([np.interp(ahead, seconds, column) for column in path.T], axis=1)
        mean = np.array(prediction.mean).reshape(count, 4, 3)[:, WRIST]
        covariance = np.array(prediction.covariance).reshape(count, 4, 3, 3)[:, WRIST]
        gap = (truth - mean)[known]
        solved = np.linalg.solve(covariance[known], gap[..., None])[..., 0]
        squared.append(np.einsum("ij,ij->i", gap, solved))
        distances.append(np.linalg.norm(gap, axis=1))
    mahalanobis = np.concatenate(squared)
    return Coverage(
        predictions=len(predictions),
        points=len(mahalanobis),
        share_50=float((mahalanobis <= chi2.ppf(0.50, 3)).mean()),
        share_95=float((mahalanobis <= chi2.ppf(0.95, 3)).mean()),
        error_m=float(np.median(np.concatenate(distances))),
    )
