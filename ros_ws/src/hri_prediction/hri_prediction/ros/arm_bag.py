"""Tracks as motion capture bags: ``/humans/bodies/<id>/arm``, readable by everything of ROS."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from rclpy.serialization import serialize_message

from hri_prediction.bags.arms import ARM_TYPE
from hri_prediction.bags.metadata import BagMetadata, OfferedQos, TopicInfo
from hri_prediction.bags.writer import BagWriter
from hri_prediction.errors import ConfigError
from hri_prediction.ros.conversions import message_from_sample
from hri_prediction.tracks.track import ArmTrack

START_NS = 10**9
"""Stamp of the first sample [ns]: the same track always gives the same messages."""


def body_id_of(subject: str) -> str:
    """A body id made of the name of a person; ``person1`` where it has no letter or digit."""
    name = re.sub(r"\W+", "_", subject, flags=re.ASCII).strip("_")[:50]
    if not name:
        return "person1"
    return f"person_{name}" if name[0].isdigit() else name


def write_arm_bag(
    folder: str | Path, track: ArmTrack, progress: Callable[[int], None] = lambda count: None
) -> BagMetadata:
    """Write a track as a bag, each sample received at its stamp.

    Args:
        folder: New or empty folder.
        track: In the frame ``world``.
        progress: Called with the number of samples written so far.

    Returns:
        What stands in the bag's metadata.yaml.

    Raises:
        ConfigError: the folder holds something or cannot be made.
        DataError: the disk takes nothing more.
    """
    return write_arms_bag(folder, (track,), about_tracks((track,)), progress)


def about_tracks(tracks: Sequence[ArmTrack]) -> dict[str, str]:
    """What a bag says of itself: who did what, from which files; the task and trial of the first."""
    return {
        "subject": ", ".join(track.subject for track in tracks),
        "task": tracks[0].task,
        "trial": str(tracks[0].trial),
        "source": "; ".join(dict.fromkeys(track.source for track in tracks)),
    }


def write_arms_bag(
    folder: str | Path,
    tracks: Sequence[ArmTrack],
    about: Mapping[str, str],
    progress: Callable[[int], None] = lambda count: None,
) -> BagMetadata:
    """Write arms of one or several bodies that were recorded together; as :func:`write_arm_bag`.

    Args:
        folder: New or empty folder.
        tracks: In the frame ``world``, on the same clock, which begins with the first row of any.
        about: What the bag says of itself.
        progress: Called with the number of samples written so far.

    Raises:
        ConfigError: two of them are the same arm of a body; as :func:`write_arm_bag`.
        DataError: as there.
    """
    bodies = [body_id_of(track.subject) for track in tracks]
    arms = [(body, track.side) for body, track in zip(bodies, tracks, strict=True)]
    if len(set(arms)) < len(arms):
        told = ", ".join(f"{side} of {body}" for body, side in arms)
        raise ConfigError(f"arms {told}", expected="each arm of a body once")
    qos = OfferedQos(depth=50, reliability="best_effort")
    first_s = min(float(track.time_s[0]) for track in tracks)
    samples = sorted(
        (
            (sample.stamp_ns, number, sample)
            for number, track in enumerate(tracks)
            for sample in track.samples(START_NS + round((float(track.time_s[0]) - first_s) * 1e9))
        ),
        key=lambda item: item[:2],
    )
    with BagWriter(folder, custom_data=dict(about)) as writer:
        channels = {
            body: writer.add_topic(TopicInfo(f"/humans/bodies/{body}/arm", ARM_TYPE, (qos,)))
            for body in dict.fromkeys(bodies)
        }
        counts = dict.fromkeys(channels, 0)
        for count, (stamp_ns, number, sample) in enumerate(samples, start=1):
            body = bodies[number]
            counts[body] += 1
            message = serialize_message(message_from_sample(sample, body))
            writer.write(channels[body], message, stamp_ns, sequence=counts[body])
            progress(count)
        return writer.close()
