"""Writing a bag that stays readable whatever happens: crash, kill, full disk."""

from __future__ import annotations

import shutil
import time
from dataclasses import replace
from pathlib import Path
from types import TracebackType

from hri_prediction.bags.mcap_file import McapFile
from hri_prediction.bags.metadata import (
    BagMetadata,
    FileInfo,
    TopicInfo,
    qos_to_yaml,
    write_metadata,
)
from hri_prediction.bags.schemas import MessageDefinition, message_definition
from hri_prediction.errors import ConfigError, DataError

MAX_SEQUENCE = 2**32


class BagWriter:
    """Writes ``FOLDER/FOLDER_0.mcap`` and ``FOLDER/metadata.yaml`` as rosbag2 Jazzy does.

    Messages are collected in memory and go to the operating system as whole compressed chunks:
    when a chunk is full, at :meth:`flush`, and when :meth:`flush_if_due` finds the oldest message
    older than ``flush_period``. ``kill -9`` therefore loses at most that much. What the operating
    system has goes to the disk itself at :meth:`flush_if_due` every ``sync_period``, and at the end: a
    power cut loses at most the two periods together. A first metadata.yaml is written at the start,
    the final one at the end.

    Not thread-safe: one thread writes. As a context it closes itself, and raises :class:`DataError`
    when the disk did not take all messages.

    Args:
        folder: Folder to create; it must not exist or be empty.
        custom_data: Free strings for metadata.yaml (seed, git revision, …).
        flush_period: Greatest age of a message in memory [s].
        sync_period: Greatest age of a chunk that the disk itself does not have yet [s]; 0 leaves it to
            the operating system until the end.
        chunk_bytes: Uncompressed size of a chunk [bytes]. Larger compresses better.
        min_free_bytes: Free space below which nothing more is written, so that the bag can still
            be closed in order [bytes]; 0 switches the check off.

    Raises:
        ConfigError: the folder exists already or cannot be created.
        DataError: the disk takes nothing, or has less than ``min_free_bytes`` left.
    """

    def __init__(
        self,
        folder: str | Path,
        *,
        custom_data: dict[str, str] | None = None,
        flush_period: float = 0.5,
        sync_period: float = 0.0,
        chunk_bytes: int = 1 << 20,
        min_free_bytes: int = 0,
    ) -> None:
        self.folder = Path(folder).absolute()
        self._custom_data = dict(custom_data or {})
        self._flush_ns = round(flush_period * 1e9)
        self._sync_ns = round(sync_period * 1e9)
        self._synced_bytes = 0
        self._next_sync_ns = 0
        self._unsure: DataError | None = None
        self._min_free = min_free_bytes
        self._topics: list[TopicInfo] = []
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}
        self._oldest: int | None = None
        self._closed: BagMetadata | None = None
        self.lost_messages = 0
        self._make_folder()
        self._check_space()
        self._file = McapFile(self.folder / f"{self.folder.name}_0.mcap", chunk_bytes=chunk_bytes)
        write_metadata(self.folder, self._metadata())

    def _make_folder(self) -> None:
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            taken = any(self.folder.iterdir())
        except OSError as error:
            raise ConfigError(
                f"cannot make the bag folder {self.folder}: {error.strerror}",
                hint="choose a folder that you may write to",
            ) from error
        if taken:
            raise ConfigError(
                f"the bag folder {self.folder} exists already",
                expected="a new or an empty folder",
                hint="choose another name or remove it",
            )

    def _check_space(self) -> None:
        if not self._min_free:
            return
        try:
            free = shutil.disk_usage(self.folder).free
        except OSError as error:
            raise DataError(
                f"the disk of {self.folder} does not answer: {error.strerror or error}",
                hint="is it still there?",
            ) from error
        if free < self._min_free:
            raise DataError(
                f"the disk of {self.folder} has {free / 1e6:.0f} MB left",
                expected=f"at least {self._min_free / 1e6:.0f} MB",
                hint="free some disk space or record to another disk",
            )

    @property
    def path(self) -> Path:
        """The .mcap file."""
        return self._file.path

    @property
    def size(self) -> int:
        """Bytes written to the operating system."""
        return self._file.size

    @property
    def message_count(self) -> int:
        """Messages written to the operating system."""
        return self._file.message_count

    @property
    def topics(self) -> tuple[TopicInfo, ...]:
        """Topics with the number of messages that are written to the operating system."""
        counts = self._file.channel_counts
        return tuple(replace(t, message_count=c) for t, c in zip(self._topics, counts, strict=True))

    def add_topic(self, topic: TopicInfo, definition: MessageDefinition | None = None) -> int:
        """Register a topic and return its channel, the first argument of :meth:`write`.

        A topic that is registered already keeps its channel.

        Args:
            topic: Name, type, QoS and type hash.
            definition: Definition of its type; looked up in the ament prefixes when not given.
        """
        if topic.name in self._channels:
            return self._channels[topic.name]
        if topic.type not in self._schemas:
            found = definition or message_definition(topic.type)
            self._schemas[topic.type] = self._file.add_schema(
                topic.type, found.encoding, found.text.encode()
            )
        metadata = {
            "offered_qos_profiles": qos_to_yaml(topic.qos),
            "topic_type_hash": topic.type_hash,
        }
        channel = self._file.add_channel(topic.name, self._schemas[topic.type], metadata)
        self._topics.append(replace(topic, message_count=0))
        self._channels[topic.name] = channel
        return channel

    def write(
        self,
        channel: int,
        data: bytes,
        log_time_ns: int,
        publish_time_ns: int | None = None,
        sequence: int = 0,
    ) -> None:
        """Add one serialised message.

        Args:
            channel: What :meth:`add_topic` returned.
            data: CDR bytes.
            log_time_ns: Time of receipt [ns].
            publish_time_ns: Time of sending [ns]; the time of receipt when not known.
            sequence: Publisher's sequence number, 0 when not known.

        Raises:
            DataError: the disk does not take the full chunk, or has too little space left. The message
                is kept in memory: do not write it again, but call :meth:`flush` when there may be
                space.
        """
        if self._oldest is None:
            self._oldest = time.monotonic_ns()
        publish = log_time_ns if publish_time_ns is None else publish_time_ns
        self._file.add_message(channel, log_time_ns, publish, data, sequence % MAX_SEQUENCE)
        if self._file.full:
            self.flush()

    def flush(self) -> None:
        """Hand everything to the operating system.

        Raises:
            DataError: the disk is full; the messages are kept for another try.
        """
        if self._file.pending_messages:
            self._check_space()
        self._file.flush()
        self._oldest = None

    def flush_if_due(self) -> None:
        """Flush when the oldest message in memory is older than the flush period; sync likewise.

        Raises:
            DataError: as :meth:`flush`; or the disk itself did not take what it was given.
        """
        now_ns = time.monotonic_ns()
        if self._oldest is not None and now_ns - self._oldest >= self._flush_ns:
            self.flush()
        if self._sync_ns and now_ns >= self._next_sync_ns and self.size != self._synced_bytes:
            self._next_sync_ns = now_ns + self._sync_ns
            self._synced_bytes = self.size
            try:
                self._file.sync()
            except DataError as error:
                self._unsure = error  # asked again, the disk would say that all is well
                raise

    def add_attachment(self, name: str, media_type: str, data: bytes) -> None:
        """Put a whole file into the bag.

        Raises:
            DataError: the disk does not take it.
        """
        self._file.add_attachment(name, media_type, data, time.time_ns())

    def add_custom_data(self, name: str, text: str) -> None:
        """Put a string into ``custom_data`` of the final metadata.yaml, in place of one of that name."""
        self._custom_data[name] = text

    def close(self) -> BagMetadata:
        """Write what is in memory, the index and the final metadata.yaml.

        On a full disk the messages in memory are given up (``lost_messages``) rather than the
        index. A second call returns the same metadata.

        Raises:
            DataError: not even the index found room: the messages stay readable by salvage. Or the
                disk has at some time not taken what it was given.
        """
        if self._closed is not None:
            return self._closed
        try:
            self._file.flush()
        except DataError:
            self.lost_messages += self._file.discard_pending()
        metadata = self._metadata()
        self._closed = metadata
        # Before the index: a bag whose writer ends in between is not closed, rather than closed and empty.
        final = self._try_metadata(metadata)
        try:
            serialized = {"serialized_metadata": metadata.to_yaml(top_key=False)}
            self._file.add_metadata("rosbag2", serialized)
            self._file.finish()
        finally:
            self._file.release()
        if not final:
            write_metadata(self.folder, metadata)
        if self._unsure is not None:
            raise self._unsure
        return metadata

    def _try_metadata(self, metadata: BagMetadata) -> bool:
        """Write metadata.yaml if there is room: if not, the index may take what there is."""
        try:
            write_metadata(self.folder, metadata)
        except DataError:
            return False
        return True

    def _metadata(self) -> BagMetadata:
        file = self._file
        base = BagMetadata()
        start = file.start_ns if file.message_count else base.starting_time_ns
        duration = file.end_ns - file.start_ns if file.message_count else 0
        return BagMetadata(
            starting_time_ns=start,
            duration_ns=duration,
            message_count=file.message_count,
            topics=self.topics,
            files=(FileInfo(file.path.name, start, duration, file.message_count),),
            custom_data=self._custom_data,
        )

    def __enter__(self) -> BagWriter:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()
        if error is None and self.lost_messages:
            raise DataError(
                f"{self.lost_messages} messages did not fit the disk of {self.folder}",
                hint="free some disk space and try again, or choose another disk",
            )
