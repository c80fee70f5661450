"""A track as a motion capture bag: ``/humans/bodies/<id>/arm``, readable by everything of ROS."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

from rclpy.serialization import serialize_message

from hri_prediction.bags.arms import ARM_TYPE
from hri_prediction.bags.metadata import BagMetadata, OfferedQos, TopicInfo
from hri_prediction.bags.writer import BagWriter
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
    body = body_id_of(track.subject)
    about = {
        "subject": track.subject,
        "task": track.task,
        "trial": str(track.trial),
        "source": track.source,
    }
    qos = OfferedQos(depth=50, reliability="best_effort")
    with BagWriter(folder, custom_data=about) as writer:
        channel = writer.add_topic(TopicInfo(f"/humans/bodies/{body}/arm", ARM_TYPE, (qos,)))
        for count, sample in enumerate(track.samples(START_NS), start=1):
            message = message_from_sample(sample, body)
            writer.write(channel, serialize_message(message), sample.stamp_ns, sequence=count)
            progress(count)
        return writer.close()
