from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from hri_prediction.bags.metadata import (
    BagMetadata,
    FileInfo,
    OfferedQos,
    TopicInfo,
    qos_from_yaml,
    qos_to_yaml,
    read_metadata,
    write_metadata,
)
from hri_prediction.errors import DataError

QOS = st.builds(
    OfferedQos,
    history=st.sampled_from(["keep_last", "keep_all", "unknown"]),
    depth=st.integers(0, 10_000),
    reliability=st.sampled_from(["reliable", "best_effort"]),
    durability=st.sampled_from(["volatile", "transient_local"]),
    deadline_ns=st.integers(0, 2**63 - 1),
    avoid_ros_namespace_conventions=st.booleans(),
)
# YAML cannot hold control characters and lone surrogates; a bag's strings are ordinary text.
TEXT = st.text(st.characters(codec="utf-8", exclude_categories=["Cc", "Cs", "Zl", "Zp"]))


@given(
    qos=st.lists(QOS, max_size=3),
    custom=st.dictionaries(TEXT, TEXT, max_size=3),
    start=st.integers(0, 2**62),
)
def test_yaml_gives_back_what_was_put_in(tmp_path_factory, qos, custom, start) -> None:
    folder = tmp_path_factory.mktemp("meta")
    topic = TopicInfo("/a", "std_msgs/msg/String", tuple(qos), "RIHS01_00", 3)
    metadata = BagMetadata(start, 5, 3, (topic,), (FileInfo("a.mcap", start, 5, 3),), custom)
    write_metadata(folder, metadata)
    assert read_metadata(folder) == metadata
    assert [path.name for path in folder.iterdir()] == ["metadata.yaml"]


@given(st.lists(QOS, max_size=3))
def test_qos_text_gives_back_what_was_put_in(qos) -> None:
    assert qos_from_yaml(qos_to_yaml(tuple(qos))) == tuple(qos)


def test_version_and_infinite_durations_are_as_in_jazzy() -> None:
    topic = TopicInfo("/a", "std_msgs/msg/String", (OfferedQos(),))
    node = yaml.safe_load(BagMetadata(topics=(topic,)).to_yaml())["rosbag2_bagfile_information"]
    assert node["version"] == 9
    assert node["starting_time"] == {"nanoseconds_since_epoch": 9223372036854775807}
    profile = node["topics_with_message_count"][0]["topic_metadata"]["offered_qos_profiles"][0]
    assert profile["deadline"] == {"sec": 9223372036, "nsec": 854775807}
    assert profile["reliability"] == "reliable"


def test_numbered_policies_of_older_bags_are_read() -> None:
    text = """
- history: 1
  depth: 7
  reliability: 2
  durability: 1
  deadline: {sec: 0, nsec: 5}
  lifespan: {sec: 1, nsec: 0}
  liveliness: 1
  liveliness_lease_duration: {sec: 0, nsec: 0}
  avoid_ros_namespace_conventions: false
"""
    (profile,) = qos_from_yaml(text)
    assert (profile.history, profile.reliability, profile.durability) == (
        "keep_last",
        "best_effort",
        "transient_local",
    )
    assert (profile.depth, profile.deadline_ns, profile.lifespan_ns) == (7, 5, 10**9)


@pytest.mark.parametrize("text", ["", "[", "rosbag2_bagfile_information: 3", "a: b", "- 1"])
def test_what_is_no_metadata_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "metadata.yaml").write_text(text)
    with pytest.raises(DataError, match=r"metadata\.yaml"):
        read_metadata(tmp_path)
