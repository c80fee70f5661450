"""Reading bags: a folder of rosbag2 or a single .mcap file."""

from __future__ import annotations

import contextlib
import heapq
from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from operator import attrgetter
from pathlib import Path
from typing import Any

import yaml
from mcap.reader import make_reader

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
from hri_prediction.bags.schemas import message_class
from hri_prediction.errors import DataError

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
    """

    topic: str
    type: str
    data: bytes
    log_time_ns: int
    publish_time_ns: int
    sequence: int

    def decode(self) -> Any:
        """The message as an object of its class.

        Raises:
            DataError: its type is not installed, or the bytes are not of that type.
        """
        # rclpy only where a message is really decoded: bags are read on machines without it.
        from rclpy.serialization import deserialize_message

        cls = message_class(self.type)
        try:
            return deserialize_message(self.data, cls)
        except Exception as error:
            raise DataError(f"a message on {self.topic} is no valid {self.type}") from error


class BagReader:
    """A bag that is read from the disk.

    Args:
        path: Folder with metadata.yaml and .mcap files, a folder with .mcap files alone, or one
            .mcap file.
        allow_unclosed: Also read files whose recorder was killed: what is whole in them, in file
            order within each. Otherwise such a file is an error.

    Raises:
        DataError: nothing there, not a bag, of another storage, or not closed.
    """

    def __init__(self, path: str | Path, *, allow_unclosed: bool = False) -> None:
        self.path = Path(path)
        self._stored: BagMetadata | None = None
        self.files = self._find_files()
        self.unclosed = tuple(file for file in self.files if not is_closed(file))
        if self.unclosed and not allow_unclosed:
            raise DataError(
                f"{self.unclosed[0]} was not closed (its recorder was killed, or it is cut)",
                hint=f"recover it with: inspect_bag.py {self.path} --salvage NEW_FOLDER",
            )

    def _find_files(self) -> tuple[Path, ...]:
        if self.path.is_file():
            with _reading(self.path), self.path.open("rb") as stream:
                begin = stream.read(len(MAGIC))
            if not MAGIC.startswith(begin):
                raise DataError(f"{self.path} is no bag", expected="a folder or an .mcap file")
            return (self.path,)
        if not self.path.is_dir():
            raise DataError(f"there is no bag {self.path}", expected="a folder or an .mcap file")
        found = tuple(sorted(self.path.glob("*.mcap")))
        if (self.path / METADATA_FILE).exists():
            self._stored = read_metadata(self.path)
            if self._stored.storage_identifier != "mcap":
                raise DataError(
                    f"{self.path} is a bag of storage {self._stored.storage_identifier}",
                    expected="storage mcap",
                    hint="convert it with: ros2 bag convert",
                )
            listed = tuple(self.path / Path(item.path).name for item in self._stored.files)
            missing = [file for file in listed if not file.is_file()]
            if missing:
                raise DataError(f"{missing[0]} is listed in {METADATA_FILE}, but missing")
            found = listed or found
        if not found:
            raise DataError(f"{self.path} holds no .mcap file", expected="a bag folder")
        return found

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
        if self._stored is not None and not self.unclosed:
            return self._stored
        return self._rebuilt()

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
            if file in self.unclosed:
                found += _scanned(file).result.attachments
                continue
            with _reading(file), file.open("rb") as stream:
                for item in make_reader(stream, validate_crcs=True).iter_attachments():
                    found.append(ScannedAttachment(item.name, item.media_type, item.data))
        return found

    def _file_messages(
        self, file: Path, topics: set[str] | None, start_ns: int | None, end_ns: int | None
    ) -> Iterator[BagMessage]:
        if file in self.unclosed:
            for scanned in Scan(file):
                late = end_ns is not None and scanned.log_time_ns >= end_ns
                early = start_ns is not None and scanned.log_time_ns < start_ns
                if not (late or early) and (topics is None or scanned.channel.topic in topics):
                    yield _message(scanned)
            return
        with _reading(file), file.open("rb") as stream:
            reader = make_reader(stream, validate_crcs=True)
            for schema, channel, message in reader.iter_messages(
                topics=topics, starting_at=start_ns, ending_before=end_ns
            ):
                yield BagMessage(
                    channel.topic,
                    schema.name if schema else "",
                    message.data,
                    message.log_time,
                    message.publish_time,
                    message.sequence,
                )

    def _channels(self) -> Iterator[ScannedChannel]:
        for file in self.files:
            if file in self.unclosed:
                yield from _scanned(file).channels
                continue
            with _reading(file), file.open("rb") as stream:
                summary = make_reader(stream).get_summary()
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

    def _custom(self) -> dict[str, str]:
        if self._stored is not None:
            return dict(self._stored.custom_data)
        for file in self.files:
            if file in self.unclosed:
                continue
            with _reading(file), file.open("rb") as stream:
                for item in make_reader(stream).iter_metadata():
                    text = item.metadata.get("serialized_metadata", "")
                    if item.name == "rosbag2" and text:
                        return custom_data_of(text)
        return {}


def custom_data_of(serialized: str) -> dict[str, str]:
    """custom_data of the metadata text within an MCAP file; empty when it is unreadable."""
    try:
        return BagMetadata.from_mapping(yaml.safe_load(serialized)).custom_data
    except (yaml.YAMLError, KeyError, TypeError, ValueError, AttributeError):
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


def is_closed(file: Path) -> bool:
    """Whether an MCAP file ends with its final magic, as a recorder that ended in order leaves it.

    Raises:
        DataError: the file cannot be read.
    """
    try:
        with file.open("rb") as stream:
            size = stream.seek(0, 2)
            if size < 2 * len(MAGIC):
                return False
            stream.seek(-len(MAGIC), 2)
            return stream.read() == MAGIC
    except OSError as error:
        raise DataError(f"cannot read {file}: {error.strerror}") from error


def _message(scanned: ScannedMessage) -> BagMessage:
    return BagMessage(
        scanned.channel.topic,
        scanned.channel.type,
        scanned.data,
        scanned.log_time_ns,
        scanned.publish_time_ns,
        scanned.sequence,
    )


def _scanned(file: Path) -> Scan:
    scan = Scan(file)
    for _ in scan:
        pass
    return scan


@contextlib.contextmanager
def _reading(file: Path) -> Iterator[None]:
    """Turn whatever the mcap package raises on a damaged file into one DataError."""
    try:
        yield
    except DataError:
        raise
    except OSError as error:
        raise DataError(f"cannot read {file}: {error.strerror or error}") from error
    except Exception as error:  # the package raises errors of a dozen kinds
        text = " ".join(str(error).split()) or type(error).__name__
        raise DataError(
            f"{file} is damaged: {text}",
            hint="recover what is whole with: inspect_bag.py BAG --salvage NEW_FOLDER",
        ) from error
