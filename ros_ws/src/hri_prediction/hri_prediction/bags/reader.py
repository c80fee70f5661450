"""Reading bags: a folder of rosbag2 or a single .mcap file."""

from __future__ import annotations

import contextlib
import heapq
import os
from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from operator import attrgetter
from pathlib import Path
from typing import Any

import yaml
from mcap.reader import McapReader, make_reader

from hri_prediction.bags.condition import Condition, salvage_command
from hri_prediction.bags.mcap_file import MAGIC
from hri_prediction.bags.metadata import (
    METADATA_FILE,
    BagMetadata,
    FileInfo,
    TopicInfo,
    qos_from_yaml,
    read_metadata,
)
from hri_prediction.bags.scan import Scan, ScannedAttachment, ScannedChannel, ScannedMessage
from hri_prediction.bags.schemas import ROS2MSG, as_installed, message_class
from hri_prediction.bags.structure import check_structure, is_closed, reading
from hri_prediction.errors import DataError, cut
from hri_prediction.files.content import open_file
from hri_prediction.files.values import parse_yaml

_LOG_TIME = attrgetter("log_time_ns")


@dataclass(frozen=True)
class BagMessage:
    """One message of a bag.

    Attributes:
        topic: Topic name.
        type: Message type.
        data: CDR bytes.
        log_time_ns: Time of receipt [ns].
        publish_time_ns: Time of sending [ns].
        sequence: Publisher's sequence number, 0 when it was not known.
        definition: Of its type with dependencies, as the bag has it; empty when it has none.
    """

    topic: str
    type: str
    data: bytes
    log_time_ns: int
    publish_time_ns: int
    sequence: int
    definition: str = ""

    def decode(self) -> Any:
        """The message as an object of its class.

        Raises:
            DataError: its type is not installed, or with other fields, or the bytes are not of that type.
        """
        # rclpy only where a message is really decoded: bags are read on machines without it.
        from rclpy.serialization import deserialize_message

        cls = message_class(self.type)
        if not as_installed(self.type, self.definition):
            raise DataError(
                f"{cut(self.topic)} was recorded with another version of {cut(self.type)}, whose "
                "fields are not those of the installed one",
                hint="read the bag with the release that recorded it",
            )
        try:
            return deserialize_message(self.data, cls)
        except Exception as error:
            raise DataError(
                f"a message on {cut(self.topic)} is no valid {cut(self.type)}"
            ) from error


class BagReader:
    """A bag that is read from the disk.

    Args:
        path: Folder with metadata.yaml and .mcap files, a folder with .mcap files alone, or one
            .mcap file.
        allow_unclosed: Also read files whose recorder was killed: what is whole in them, in file
            order within each. Otherwise such a file is an error.
        allow_damaged: Read all files so, and those in the folder where metadata.yaml is damaged.

    Raises:
        DataError: nothing there, not a bag, of another storage, or not closed.
    """

    def __init__(
        self, path: str | Path, *, allow_unclosed: bool = False, allow_damaged: bool = False
    ) -> None:
        self.path = Path(path)
        self._stored: BagMetadata | None = None
        self._checked: set[Path] = set()
        self._scans: dict[Path, Scan] = {}
        self.files = self._whole_files() if allow_damaged else self._find_files()
        self.unclosed = tuple(file for file in self.files if not is_closed(file))
        if self.unclosed and not (allow_unclosed or allow_damaged):
            raise DataError(
                f"{self.unclosed[0]} was not closed (its recorder was killed, or it is cut)",
                hint=f"recover it with: {salvage_command(self.path)}",
            )
        self._by_scan = self.files if allow_damaged else self.unclosed

    def _whole_files(self) -> tuple[Path, ...]:
        """The files that are there, whatever metadata.yaml says of them."""
        try:
            return self._find_files()
        except DataError:
            found = tuple(sorted(self.path.glob("*.mcap")))
            if not found:
                raise
            return found

    def _find_files(self) -> tuple[Path, ...]:
        if not os.path.isdir(self.path):
            if not os.path.lexists(self.path):
                raise DataError(
                    f"there is no bag {self.path}", expected="a folder or an .mcap file"
                )
            with reading(self.path), open_file(self.path) as stream:
                begin = stream.read(len(MAGIC))
            if not MAGIC.startswith(begin):
                raise DataError(f"{self.path} is no bag", expected="a folder or an .mcap file")
            return (self.path,)
        found = tuple(sorted(self.path.glob("*.mcap")))
        if (self.path / METADATA_FILE).exists():
            self._stored = self._read_metadata()
            if self._stored.storage_identifier != "mcap":
                storage = cut(self._stored.storage_identifier)
                raise DataError(
                    f"{self.path} is a bag of storage {storage} by its {METADATA_FILE}",
                    expected="storage mcap",
                    hint="convert it with: ros2 bag convert",
                )
            listed = tuple(self.path / Path(item.path).name for item in self._stored.files)
            missing = [file for file in listed if not os.path.isfile(file)]
            if missing:
                raise DataError(f"{cut(str(missing[0]))} is listed in {METADATA_FILE}, but missing")
            found = listed or found
        if not found:
            raise DataError(f"{self.path} holds no .mcap file", expected="a bag folder")
        return found

    def _read_metadata(self) -> BagMetadata:
        try:
            return read_metadata(self.path)
        except DataError as error:
            raise DataError(
                error.problem,
                expected=error.expected,
                hint=f"make it anew with: {salvage_command(self.path)}",
            ) from error

    @property
    def custom_data(self) -> dict[str, str]:
        """Provenance strings of metadata.yaml."""
        return dict(self.metadata.custom_data)

    @property
    def topics(self) -> dict[str, TopicInfo]:
        """Recorded topics by name."""
        return {topic.name: topic for topic in self.metadata.topics}

    @cached_property
    def metadata(self) -> BagMetadata:
        """metadata.yaml, rebuilt from the files where it is missing or not final.

        Raises:
            DataError: a file is damaged.
        """
        if self._stored is not None and not self._by_scan and not self.outdated:
            return self._stored
        return self._rebuilt()

    @cached_property
    def outdated(self) -> bool:
        """Whether metadata.yaml is that of the beginning: it knows of no message, the files of some.

        So it is when the disk was so full that the file could be closed, but not replaced.

        Raises:
            DataError: a file is damaged.
        """
        if self._stored is None or self._stored.message_count or self._by_scan:
            return False
        for file in self.files:
            with self._closed(file) as reader:
                summary = reader.get_summary()
            if summary and summary.statistics and summary.statistics.message_count:
                return True
        return False

    @cached_property
    def conditions(self) -> tuple[Condition, ...]:
        """What of the files that were not closed, or may be damaged, is whole.

        Raises:
            DataError: a file cannot be read.
        """
        return tuple(Condition.of(file.name, self._scanned(file).result) for file in self._by_scan)

    @cached_property
    def definitions(self) -> dict[str, str]:
        """Message definitions (ros2msg text with dependencies) by type; empty text: not known.

        Raises:
            DataError: a file is damaged.
        """
        found: dict[str, str] = {}
        for channel in self._channels():
            found[channel.type] = channel.definition
        return found

    def messages(
        self,
        topics: Collection[str] | None = None,
        start_ns: int | None = None,
        end_ns: int | None = None,
    ) -> Iterator[BagMessage]:
        """Messages by log time (of an unclosed file: as they stand in it).

        Args:
            topics: Only these topics; all when None.
            start_ns: First log time [ns].
            end_ns: Log time before which to end [ns].

        Raises:
            DataError: a file is damaged where it is read.
        """
        wanted = None if topics is None else set(topics)
        streams = [self._file_messages(file, wanted, start_ns, end_ns) for file in self.files]
        yield from streams[0] if len(streams) == 1 else heapq.merge(*streams, key=_LOG_TIME)

    def attachments(self) -> list[ScannedAttachment]:
        """Files within the bag, such as ``provenance.json``.

        Raises:
            DataError: a file is damaged.
        """
        found: list[ScannedAttachment] = []
        for file in self.files:
            if file in self._by_scan:
                found += self._scanned(file).result.attachments
                continue
            with self._closed(file) as reader:
                for item in reader.iter_attachments():
                    found.append(ScannedAttachment(item.name, item.media_type, item.data))
        return found

    @contextlib.contextmanager
    def _closed(self, file: Path) -> Iterator[McapReader]:
        """The package's reader of a closed file, whose lengths and index have been checked."""
        if file not in self._checked:
            check_structure(file)
            self._checked.add(file)
        with reading(file), open_file(file) as stream:
            yield make_reader(stream, validate_crcs=True)

    def _file_messages(
        self, file: Path, topics: set[str] | None, start_ns: int | None, end_ns: int | None
    ) -> Iterator[BagMessage]:
        if file in self._by_scan:
            for scanned in Scan(file):
                late = end_ns is not None and scanned.log_time_ns >= end_ns
                early = start_ns is not None and scanned.log_time_ns < start_ns
                if not (late or early) and (topics is None or scanned.channel.topic in topics):
                    yield _message(scanned)
            return
        definitions: dict[int, str] = {}
        with self._closed(file) as reader:
            for schema, channel, message in reader.iter_messages(
                topics=topics, starting_at=start_ns, ending_before=end_ns
            ):
                if schema and schema.id not in definitions:
                    definitions[schema.id] = _text_of(schema.encoding, schema.data)
                yield BagMessage(
                    channel.topic,
                    schema.name if schema else "",
                    message.data,
                    message.log_time,
                    message.publish_time,
                    message.sequence,
                    definitions[schema.id] if schema else "",
                )

    def _channels(self) -> Iterator[ScannedChannel]:
        for file in self.files:
            if file in self._by_scan:
                yield from self._scanned(file).channels
                continue
            with self._closed(file) as reader:
                summary = reader.get_summary()
                for channel in summary.channels.values() if summary else ():
                    schema = summary.schemas.get(channel.schema_id) if summary else None
                    name, encoding, data = (
                        (schema.name, schema.encoding, schema.data) if schema else ("", "", b"")
                    )
                    yield ScannedChannel(
                        channel.topic,
                        name,
                        encoding,
                        data.decode(),
                        channel.message_encoding,
                        channel.metadata,
                    )

    def _rebuilt(self) -> BagMetadata:
        """Metadata counted from the messages themselves."""
        counts: dict[str, int] = {}
        files: list[FileInfo] = []
        for file in self.files:
            first, last, number = 2**63 - 1, 0, 0
            for message in self._file_messages(file, None, None, None):
                counts[message.topic] = counts.get(message.topic, 0) + 1
                first, last = min(first, message.log_time_ns), max(last, message.log_time_ns)
                number += 1
            files.append(FileInfo(file.name, first, last - first if number else 0, number))
        topics = {channel.topic: topic_of(channel) for channel in self._channels()}
        start = min(item.starting_time_ns for item in files)
        end = max(item.starting_time_ns + item.duration_ns for item in files)
        total = sum(item.message_count for item in files)
        return BagMetadata(
            starting_time_ns=start,
            duration_ns=end - start if total else 0,
            message_count=total,
            topics=tuple(replace(t, message_count=counts.get(n, 0)) for n, t in topics.items()),
            files=tuple(files),
            custom_data=self._custom(),
            ros_distro=self._stored.ros_distro if self._stored else "",
        )

    def _scanned(self, file: Path) -> Scan:
        """The scan of a file, which is complete."""
        if file not in self._scans:
            scan = Scan(file)
            for _ in scan:
                pass
            self._scans[file] = scan
        return self._scans[file]

    def _custom(self) -> dict[str, str]:
        if self._stored is not None:
            return dict(self._stored.custom_data)
        for file in self.files:
            if file in self._by_scan:
                continue
            with self._closed(file) as reader:
                for item in reader.iter_metadata():
                    text = item.metadata.get("serialized_metadata", "")
                    if item.name == "rosbag2" and text:
                        return custom_data_of(text)
        return {}


def custom_data_of(serialized: str) -> dict[str, str]:
    """custom_data of the metadata text within an MCAP file; empty when it is unreadable."""
    try:
        return BagMetadata.from_mapping(parse_yaml(serialized)).custom_data
    except (yaml.YAMLError, ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
        return {}


def topic_of(channel: ScannedChannel) -> TopicInfo:
    """Topic as metadata.yaml describes it."""
    return TopicInfo(
        channel.topic,
        channel.type,
        qos_from_yaml(channel.metadata.get("offered_qos_profiles", "")),
        channel.metadata.get("topic_type_hash", ""),
        serialization_format=channel.message_encoding,
    )


def _message(scanned: ScannedMessage) -> BagMessage:
    return BagMessage(
        scanned.channel.topic,
        scanned.channel.type,
        scanned.data,
        scanned.log_time_ns,
        scanned.publish_time_ns,
        scanned.sequence,
        scanned.channel.definition if scanned.channel.encoding == ROS2MSG else "",
    )


def _text_of(encoding: str, data: bytes) -> str:
    """A definition that can be compared; empty where it is of another kind, or no text."""
    return data.decode(errors="replace") if encoding == ROS2MSG else ""
