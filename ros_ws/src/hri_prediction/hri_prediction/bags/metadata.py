"""The ``metadata.yaml`` of a rosbag2 bag, as ROS 2 Jazzy writes it (version 9)."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from hri_prediction.bags import durable
from hri_prediction.errors import DataError, cut
from hri_prediction.files.content import read_text
from hri_prediction.files.values import MOST_CHARACTERS, parse_yaml

METADATA_VERSION = 9
METADATA_FILE = "metadata.yaml"
INFINITE_NS = 2**63 - 1
"""Duration that ROS 2 writes for "infinite"; also rosbag2's start time of an empty bag."""

_TOP_KEY = "rosbag2_bagfile_information"
# Up to version 8 the policies were written as the numbers of rmw's enumerations.
_NUMBERED = {
    "history": ("system_default", "keep_last", "keep_all", "unknown"),
    "reliability": ("system_default", "reliable", "best_effort", "unknown", "best_available"),
    "durability": ("system_default", "transient_local", "volatile", "unknown", "best_available"),
    "liveliness": (
        "system_default",
        "automatic",
        "manual_by_node",
        "manual_by_topic",
        "unknown",
        "best_available",
    ),
}


@dataclass(frozen=True)
class OfferedQos:
    """Quality of service that one publisher offered, in rosbag2's words; durations in ns."""

    history: str = "keep_last"
    depth: int = 10
    reliability: str = "reliable"
    durability: str = "volatile"
    deadline_ns: int = INFINITE_NS
    lifespan_ns: int = INFINITE_NS
    liveliness: str = "automatic"
    liveliness_lease_ns: int = INFINITE_NS
    avoid_ros_namespace_conventions: bool = False

    def to_mapping(self) -> dict[str, Any]:
        """The profile as a node of version 9."""
        return {
            "history": self.history,
            "depth": self.depth,
            "reliability": self.reliability,
            "durability": self.durability,
            "deadline": _split(self.deadline_ns),
            "lifespan": _split(self.lifespan_ns),
            "liveliness": self.liveliness,
            "liveliness_lease_duration": _split(self.liveliness_lease_ns),
            "avoid_ros_namespace_conventions": self.avoid_ros_namespace_conventions,
        }

    @classmethod
    def from_mapping(cls, node: Mapping[str, Any]) -> OfferedQos:
        """Read a profile of any version.

        Raises:
            KeyError, TypeError, ValueError: when it is no profile.
        """
        names = {key: _policy(key, node[key]) for key in _NUMBERED}
        return cls(
            depth=_whole(node["depth"]),
            deadline_ns=_join(node["deadline"]),
            lifespan_ns=_join(node["lifespan"]),
            liveliness_lease_ns=_join(node["liveliness_lease_duration"]),
            avoid_ros_namespace_conventions=bool(node["avoid_ros_namespace_conventions"]),
            **names,
        )


def _policy(key: str, value: Any) -> str:
    if isinstance(value, int) and not isinstance(value, bool):
        names = _NUMBERED[key]
        return names[value] if 0 <= value < len(names) else "unknown"
    return str(value)


def _split(nanoseconds: int) -> dict[str, int]:
    seconds, rest = divmod(nanoseconds, 10**9)
    return {"sec": seconds, "nsec": rest}


def _join(node: Mapping[str, Any]) -> int:
    return _whole(int(node["sec"]) * 10**9 + int(node["nsec"]))


def _whole(value: Any) -> int:
    """A number that ROS can hold, and this module can write."""
    number = int(value)
    if not 0 <= number < 2**64:
        raise ValueError(f"{number:.3g}")
    return number


def qos_to_yaml(profiles: tuple[OfferedQos, ...]) -> str:
    """The YAML text that stands in the metadata of an MCAP channel."""
    return _dump([profile.to_mapping() for profile in profiles]) if profiles else ""


def qos_from_yaml(node: Any) -> tuple[OfferedQos, ...]:
    """Profiles from the YAML text of a channel, or from a list of metadata.yaml.

    What cannot be understood counts as "not known" (an empty tuple): the messages of a bag stay
    readable whatever some other recorder wrote here.
    """
    try:
        loaded = parse_yaml(node) if isinstance(node, str) else node
        return tuple(OfferedQos.from_mapping(item) for item in loaded or ())
    except (yaml.YAMLError, ArithmeticError, LookupError, TypeError, ValueError):
        return ()


@dataclass(frozen=True)
class TopicInfo:
    """One recorded topic.

    Attributes:
        name: Full topic name.
        type: Message type, such as ``std_msgs/msg/String``.
        qos: What its publishers offered.
        type_hash: Type hash (``RIHS01_…``), empty when not known.
        message_count: Number of recorded messages.
        serialization_format: Always ``cdr`` in bags of ROS 2.
    """

    name: str
    type: str
    qos: tuple[OfferedQos, ...] = ()
    type_hash: str = ""
    message_count: int = 0
    serialization_format: str = "cdr"


@dataclass(frozen=True)
class FileInfo:
    """One file of a bag: its path in the folder, first stamp [ns], duration [ns], messages."""

    path: str
    starting_time_ns: int
    duration_ns: int
    message_count: int


@dataclass(frozen=True)
class BagMetadata:
    """Contents of ``metadata.yaml``; times are log times in integer nanoseconds."""

    starting_time_ns: int = INFINITE_NS
    duration_ns: int = 0
    message_count: int = 0
    topics: tuple[TopicInfo, ...] = ()
    files: tuple[FileInfo, ...] = ()
    custom_data: dict[str, str] = field(default_factory=dict)
    ros_distro: str = "jazzy"
    storage_identifier: str = "mcap"
    compression_format: str = ""
    compression_mode: str = ""

    def to_mapping(self) -> dict[str, Any]:
        """The metadata as rosbag2's YAML node, without the top key."""
        return {
            "version": METADATA_VERSION,
            "storage_identifier": self.storage_identifier,
            "duration": {"nanoseconds": self.duration_ns},
            "starting_time": {"nanoseconds_since_epoch": self.starting_time_ns},
            "message_count": self.message_count,
            "topics_with_message_count": [
                {
                    "topic_metadata": {
                        "name": topic.name,
                        "type": topic.type,
                        "serialization_format": topic.serialization_format,
                        "offered_qos_profiles": [qos.to_mapping() for qos in topic.qos],
                        "type_description_hash": topic.type_hash,
                    },
                    "message_count": topic.message_count,
                }
                for topic in self.topics
            ],
            "compression_format": self.compression_format,
            "compression_mode": self.compression_mode,
            "relative_file_paths": [item.path for item in self.files],
            "files": [
                {
                    "path": item.path,
                    "starting_time": {"nanoseconds_since_epoch": item.starting_time_ns},
                    "duration": {"nanoseconds": item.duration_ns},
                    "message_count": item.message_count,
                }
                for item in self.files
            ],
            "custom_data": dict(self.custom_data),
            "ros_distro": self.ros_distro,
        }

    def to_yaml(self, *, top_key: bool = True) -> str:
        """YAML text; without the top key it is the ``serialized_metadata`` of an MCAP file."""
        mapping = self.to_mapping()
        return _dump({_TOP_KEY: mapping} if top_key else mapping)

    @classmethod
    def from_mapping(cls, node: Mapping[str, Any]) -> BagMetadata:
        """Read the node below the top key, of any rosbag2 version.

        Raises:
            KeyError, TypeError, ValueError, AttributeError: when it is not rosbag2 metadata.
        """
        paths = [str(path) for path in node["relative_file_paths"]]
        files = tuple(
            FileInfo(
                str(item["path"]),
                int(item["starting_time"]["nanoseconds_since_epoch"]),
                int(item["duration"]["nanoseconds"]),
                int(item["message_count"]),
            )
            for item in node.get("files") or ()
        )
        start = int(node["starting_time"]["nanoseconds_since_epoch"])
        duration = int(node["duration"]["nanoseconds"])
        count = int(node["message_count"])
        if [item.path for item in files] != paths:  # before version 5, and in some split bags
            files = tuple(FileInfo(path, start, duration, count) for path in paths)
        custom = node.get("custom_data") or {}
        return cls(
            starting_time_ns=start,
            duration_ns=duration,
            message_count=count,
            topics=tuple(_topic(item) for item in node["topics_with_message_count"] or ()),
            files=files,
            custom_data={str(key): str(value) for key, value in custom.items()},
            ros_distro=str(node.get("ros_distro", "")),
            storage_identifier=str(node["storage_identifier"]),
            compression_format=str(node.get("compression_format", "")),
            compression_mode=str(node.get("compression_mode", "")),
        )


def _topic(item: Mapping[str, Any]) -> TopicInfo:
    meta = item["topic_metadata"]
    return TopicInfo(
        name=str(meta["name"]),
        type=str(meta["type"]),
        qos=qos_from_yaml(meta.get("offered_qos_profiles")),
        type_hash=str(meta.get("type_description_hash", "")),
        message_count=int(item["message_count"]),
        serialization_format=str(meta["serialization_format"]),
    )


def _dump(node: Any) -> str:
    return yaml.safe_dump(node, sort_keys=False, allow_unicode=True, width=2**20)


def write_metadata(folder: Path, metadata: BagMetadata) -> None:
    """Put ``metadata.yaml`` in place in one step: a reader sees the old or the new file, whole.

    So it is after a power cut: the new file is on the disk before it takes the place of the old one.

    Raises:
        DataError: when the folder does not take it.
    """
    target = folder / METADATA_FILE
    draft = folder / f".{METADATA_FILE}.{os.getpid()}"
    try:
        with draft.open("w", encoding="utf-8") as stream:
            stream.write(metadata.to_yaml())
            stream.flush()
            durable.sync(stream.fileno())
        draft.replace(target)
        entries = os.open(folder, os.O_RDONLY)
        try:
            durable.sync(entries)
        finally:
            os.close(entries)
    except OSError as error:
        draft.unlink(missing_ok=True)
        raise DataError(
            f"cannot write {target}: {error.strerror or error}",
            hint="free some disk space or choose another folder",
        ) from error


def read_metadata(folder: Path) -> BagMetadata:
    """Read ``metadata.yaml`` of a bag folder.

    Raises:
        DataError: when it is missing, no YAML, or not rosbag2's.
    """
    path = folder / METADATA_FILE
    text = read_text(path, 4 * MOST_CHARACTERS)
    try:
        return BagMetadata.from_mapping(parse_yaml(text)[_TOP_KEY])
    except yaml.YAMLError as error:
        raise DataError(f"{path} is no YAML: {cut(' '.join(str(error).split()))}") from error
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise DataError(
            f"{path} is not rosbag2 metadata ({type(error).__name__}: {cut(str(error))})",
            expected=f"a mapping below {_TOP_KEY!r}",
        ) from error
