"""Bags of two people: takes on clocks that began anew, frames that are not one."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from rclpy.serialization import serialize_message
from two_arms import arm_track

from hri_prediction.bags.arms import ARM_TYPE
from hri_prediction.bags.metadata import OfferedQos, TopicInfo
from hri_prediction.bags.writer import BagWriter
from hri_prediction.errors import DataError
from hri_prediction.ontology.cutting import segments_of
from hri_prediction.ontology.recordings import segments_of_bag, tracks_of_bag
from hri_prediction.ros.conversions import message_from_sample

A = arm_track([(0.5, 0.8, 0.3), (2.0, 0.8, -0.3)], 3.5)
B = arm_track([(0.7, 0.9, 0.2)], 3.5, away=0.6, name="b")
NAMES = ("a", "b")


def bag_of(
    path: Path, takes: Sequence[tuple[int, ...]], frames: tuple[str, str] = ("world", "world")
) -> Path:
    """A bag in which some of the two do the same in each take, by clocks that begin anew."""
    received_ns = 0
    with BagWriter(path) as writer:
        channels = [
            writer.add_topic(
                TopicInfo(f"/humans/bodies/{name}/arm", ARM_TYPE, (OfferedQos(depth=50),))
            )
            for name in NAMES
        ]
        for take in takes:
            samples = [
                (sample.stamp_ns, agent, sample)
                for agent, track in enumerate((A, B))
                if agent in take
                for sample in track.samples(10**9)
            ]
            for stamp_ns, agent, sample in sorted(samples, key=lambda item: item[:2]):
                message = message_from_sample(sample, NAMES[agent])
                message.header.frame_id = frames[agent]
                writer.write(channels[agent], serialize_message(message), received_ns + stamp_ns)
            received_ns += 10 * 10**9
        writer.close()
    return path


def test_each_take_has_the_segments_that_it_has_alone(tmp_path: Path) -> None:
    alone = [s for s in segments_of((A, B)) if s.features is not None]
    pair, found = segments_of_bag(bag_of(tmp_path / "bag", [(0, 1), (0, 1)]))
    assert pair == NAMES
    features = [s.features for s in found if s.features is not None]
    assert len(features) == 2 * len(alone)
    for own, one, other in zip(alone, features[: len(alone)], features[len(alone) :], strict=True):
        np.testing.assert_allclose(one, own.features, atol=1e-9)
        np.testing.assert_allclose(other, one, atol=1e-12)
    with pytest.raises(DataError, match="it holds 2 takes"):
        tracks_of_bag(tmp_path / "bag")


def test_clocks_of_which_one_began_anew_are_refused(tmp_path: Path) -> None:
    bag = bag_of(tmp_path / "bag", [(0, 1), (0,)])
    with pytest.raises(DataError, match=r"go back, and not of both as often \(a 1, b 0 times\)"):
        segments_of_bag(bag)


def test_arms_in_two_frames_are_refused(tmp_path: Path) -> None:
    bag = bag_of(tmp_path / "bag", [(0, 1)], ("world", "lab"))
    with pytest.raises(DataError, match=r"frames 'world' .* and 'lab' .*expected one frame"):
        segments_of_bag(bag)
