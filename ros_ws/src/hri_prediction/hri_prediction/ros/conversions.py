"""Between messages and the dataclasses of the cores. Messages are checked here, once."""

from __future__ import annotations

from array import array

import numpy as np
from numpy.typing import ArrayLike
from std_msgs.msg import Header

from hri_prediction.arm.geometry import KEYPOINTS
from hri_prediction.errors import DataError
from hri_prediction.prediction.output import Prediction
from hri_prediction.ros.messages import HumanArm, HumanPrediction
from hri_prediction.ros.template import templates
from hri_prediction.ros.time import NANO, to_ns, to_time
from hri_prediction.tracks.track import ArmSample

WORLD = "world"


def flat(values: ArrayLike) -> array[float]:
    """Row-major float64 sequence of a message; rosidl takes it without looking at each element."""
    return array("d", np.ascontiguousarray(values, dtype=float).tobytes())


def sample_from_message(message: HumanArm, frame: str = WORLD) -> ArmSample:
    """Sample of a ``HumanArm``; a keypoint with a non-finite position counts as not seen.

    Raises:
        DataError: when the frame or the side is not what this graph uses.
    """
    if message.header.frame_id != frame:
        raise DataError(
            f"HumanArm of {message.body_id!r} is in frame {message.header.frame_id!r}",
            expected=f"frame {frame!r}",
            hint="transform at the source, or set the source's frame",
        )
    if message.side not in ("left", "right"):
        raise DataError(f"HumanArm.side is {message.side!r}", expected="'left' or 'right'")
    keypoints = np.asarray(message.keypoints, dtype=float).reshape(4, 3)
    valid = np.array(message.valid, dtype=bool)
    finite = np.isfinite(keypoints)
    if not finite.all():
        valid &= finite.all(axis=1)
    return ArmSample(
        stamp_ns=to_ns(message.header.stamp), keypoints=keypoints, valid=valid, side=message.side
    )


def current_sample(message: HumanArm, now_ns: int, max_future_s: float) -> ArmSample:
    """Sample of a ``HumanArm`` that was taken before now, as far as clocks agree.

    Args:
        message: The message.
        now_ns: The node's time [ns].
        max_future_s: So far ahead of it a stamp may be [s].

    Raises:
        DataError: as :func:`sample_from_message`, or when the stamp is further ahead.
    """
    sample = sample_from_message(message)
    ahead_s = (sample.stamp_ns - now_ns) / NANO
    if ahead_s > max_future_s:
        raise DataError(
            f"sample of {message.body_id} is stamped {ahead_s:.3f} s in the future",
            expected=f"at most {max_future_s} s",
            hint="synchronise the clocks, or check the unit of the stamps",
        )
    return sample


def check_finite(message: HumanArm) -> None:
    """Name a source that calls a keypoint valid and gives no number for it; it counts as not seen.

    Raises:
        DataError: when there is one.
    """
    keypoints = np.array(message.keypoints, dtype=float).reshape(4, 3)
    wrong = np.array(message.valid, dtype=bool) & ~np.isfinite(keypoints).all(axis=1)
    if wrong.any():
        names = " and ".join(
            name.replace("_", " ")
            for name, is_wrong in zip(KEYPOINTS, wrong, strict=True)
            if is_wrong
        )
        raise DataError(
            f"the {message.side} {names} of {message.body_id} is said to be valid, and is not finite",
            expected="numbers, or valid = false for what is not seen",
            hint="it counts as not seen; mend the source",
        )


def message_from_sample(sample: ArmSample, body_id: str, frame: str = WORLD) -> HumanArm:
    """``HumanArm`` of a sample: NaN is never published."""
    valid = sample.valid & np.isfinite(sample.keypoints).all(axis=1)
    keypoints = np.where(valid[:, None], sample.keypoints, 0.0)
    return HumanArm(
        header=Header(stamp=to_time(sample.stamp_ns), frame_id=frame),
        body_id=body_id,
        side=sample.side,
        keypoints=keypoints.ravel(),
        valid=[bool(flag) for flag in valid],
    )


class ArmEncoder:
    """Serialised ``HumanArm`` messages of samples, for who sends many: see :mod:`.template`.

    Args:
        frame: Of the keypoints.
    """

    def __init__(self, frame: str = WORLD) -> None:
        self._template = templates(
            lambda body_id, side: HumanArm(
                header=Header(frame_id=frame), body_id=body_id, side=side
            )
        )

    def encoded(self, sample: ArmSample, body_id: str) -> bytes:
        """The bytes of :func:`message_from_sample`."""
        template = self._template(body_id, sample.side)
        template.stamp(sample.stamp_ns)
        seen = sample.valid
        keypoints = (
            sample.keypoints if seen.all() else np.where(seen[:, None], sample.keypoints, 0.0)
        )
        template.write(keypoints=keypoints.ravel(), valid=seen)
        return template.encoded()


def message_from_prediction(
    prediction: Prediction, body_id: str, library: str, frame: str = WORLD
) -> HumanPrediction:
    """``HumanPrediction`` of a prediction."""
    return HumanPrediction(
        header=Header(stamp=to_time(prediction.stamp_ns), frame_id=frame),
        body_id=body_id,
        side=prediction.side,
        state=int(prediction.state),
        reason=prediction.reason,
        library=library,
        times=flat(prediction.times_s),
        mean=flat(prediction.mean),
        covariance=flat(prediction.covariance),
        onset=to_time(prediction.onset_ns),
        duration_mean=float(prediction.duration_mean_s),
        duration_sd=float(prediction.duration_std_s),
        tasks=list(prediction.task_names),
        task_probabilities=flat(prediction.task_probabilities),
    )
