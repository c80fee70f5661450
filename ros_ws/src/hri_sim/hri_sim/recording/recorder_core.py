"""The recorder without ROS: a queue that never blocks its producer, and a thread that writes."""

from __future__ import annotations

import threading
import time
from collections import deque
from dataclasses import dataclass
from pathlib import Path

from hri_prediction.bags.metadata import BagMetadata, TopicInfo
from hri_prediction.bags.writer import BagWriter
from hri_prediction.config import parameter, validate
from hri_prediction.errors import DataError

_IDLE_S = 0.05
"""How often the writer looks at the queue [s]: seldom enough to leave the CPU to the producer."""


@dataclass(frozen=True)
class RecorderConfig:
    """How a bag is written."""

    flush_period: float = parameter(
        0.5,
        "Greatest age of a message in memory; kill -9 loses at most this and a tenth of a second. "
        "Shorter loses less and compresses worse",
        unit="s",
        low=0.05,
        high=1.0,
    )
    sync_period: float = parameter(
        1.0,
        "How often the disk itself is made to take what the operating system has; a power cut loses "
        "at most this and flush_period. 0 leaves it to the operating system, which may take half a "
        "minute",
        unit="s",
        low=0.0,
        high=60.0,
    )
    chunk_kilobytes: int = parameter(
        1024, "Uncompressed size of a chunk", unit="kB", low=16, high=65536
    )
    queue_messages: int = parameter(
        500_000, "Messages that may wait for the disk; more are dropped and counted", low=100
    )
    queue_megabytes: int = parameter(
        256, "Memory that may wait for the disk; more is dropped and counted", unit="MB", low=1
    )
    min_free_megabytes: int = parameter(
        64,
        "Free disk space below which nothing more is written, so that the bag can be closed; "
        "0 switches the check off",
        unit="MB",
        low=0,
    )
    on_error: str = parameter(
        "end",
        "When the disk does not take the messages: end (close the bag, exit with an error) or stay "
        "(keep trying; what does not fit the queue is dropped and counted)",
        choices=("end", "stay"),
    )

    def __post_init__(self) -> None:
        validate(self)


@dataclass(frozen=True)
class RecorderState:
    """Figures of a recorder at one moment.

    Attributes:
        received: Messages handed over.
        written: Messages that the operating system has.
        dropped: Messages dropped because the queue was full.
        lost: Messages given up at the end because the disk was full.
        queued: Messages in the queue.
        queued_bytes: Their size.
        received_bytes: Size of all messages handed over.
        file_bytes: Size of the bag file.
        error: Why the disk does not take messages at present, empty when it does.
        most_queued: Greatest length of the queue so far.
        queue_share: How full the queue is, by messages or by size, whichever is more (1: full).
        behind_s: For how long the writer has not got through with what was queued [s].
    """

    received: int
    written: int
    dropped: int
    lost: int
    queued: int
    queued_bytes: int
    received_bytes: int
    file_bytes: int
    error: str
    most_queued: int
    queue_share: float
    behind_s: float


@dataclass
class _Topic:
    info: TopicInfo
    channel: int = 0
    received: int = 0
    dropped: int = 0


class RecorderCore:
    """Takes serialised messages from one thread and writes them with another.

    :meth:`add_topic` and :meth:`push` are for one producer thread and cost a microsecond; they
    never wait for the disk.

    Args:
        folder: Bag folder to create.
        config: Queue and flush policy.
        custom_data: Provenance strings for metadata.yaml.
        attachments: Files to put into the bag: (name, media type, content).

    Raises:
        ConfigError: the folder exists already or cannot be created.
        DataError: the disk is full.
    """

    def __init__(
        self,
        folder: str | Path,
        config: RecorderConfig | None = None,
        *,
        custom_data: dict[str, str] | None = None,
        attachments: tuple[tuple[str, str, bytes], ...] = (),
    ) -> None:
        self.config = config or RecorderConfig()
        self._writer = BagWriter(
            folder,
            custom_data=custom_data,
            flush_period=self.config.flush_period,
            sync_period=self.config.sync_period,
            chunk_bytes=self.config.chunk_kilobytes * 1024,
            min_free_bytes=self.config.min_free_megabytes * 1_000_000,
        )
        for attachment in attachments:
            self._writer.add_attachment(*attachment)
        self.folder = self._writer.folder
        self._topics: list[_Topic] = []
        self._registered = 0
        self._queue: deque[tuple[int, bytes, int, int, int]] = deque()
        self._max_bytes = self.config.queue_megabytes * 1_000_000
        self._received = 0
        self._dropped = 0
        self._most_queued = 0
        # Each is written by one thread only, so the difference needs no lock.
        self._bytes_in = 0
        self._bytes_out = 0
        self._error = ""
        self._through_s = time.monotonic()
        self._metadata: BagMetadata | None = None
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="bag writer", daemon=True)
        self._thread.start()

    def add_topic(self, info: TopicInfo) -> int:
        """Announce a topic; returns the number that :meth:`push` takes."""
        self._topics.append(_Topic(info))
        return len(self._topics) - 1

    def push(
        self, topic: int, data: bytes, log_time_ns: int, publish_time_ns: int, sequence: int = 0
    ) -> bool:
        """Queue one message; False (and counted) when the queue is full.

        Args:
            topic: What :meth:`add_topic` returned.
            data: CDR bytes.
            log_time_ns: Time of receipt [ns].
            publish_time_ns: Time of sending [ns].
            sequence: Publisher's sequence number, 0 when not known.
        """
        self._received += 1
        self._topics[topic].received += 1
        waiting = len(self._queue)
        if (
            waiting >= self.config.queue_messages
            or self._bytes_in - self._bytes_out + len(data) > self._max_bytes
        ):
            self._dropped += 1
            self._topics[topic].dropped += 1
            return False
        if waiting > self._most_queued:
            self._most_queued = waiting
        self._bytes_in += len(data)
        self._queue.append((topic, data, log_time_ns, publish_time_ns, sequence))
        return True

    @property
    def state(self) -> RecorderState:
        """Present figures."""
        queued, queued_bytes = len(self._queue), self._bytes_in - self._bytes_out
        behind_s = time.monotonic() - self._through_s - _IDLE_S
        return RecorderState(
            received=self._received,
            written=self._writer.message_count,
            dropped=self._dropped,
            lost=self._writer.lost_messages,
            queued=queued,
            queued_bytes=queued_bytes,
            received_bytes=self._bytes_in,
            file_bytes=self._writer.size,
            error=self._error,
            most_queued=self._most_queued,
            queue_share=max(queued / self.config.queue_messages, queued_bytes / self._max_bytes),
            behind_s=max(behind_s, 0.0) if self._thread.is_alive() else 0.0,
        )

    @property
    def dropped_by_topic(self) -> dict[str, int]:
        """Topics of which messages were dropped, with how many."""
        return {topic.info.name: topic.dropped for topic in self._topics if topic.dropped}

    @property
    def missing_by_topic(self) -> dict[str, int]:
        """Topics of which messages did not get into the bag, with how many; for a closed bag."""
        written = {topic.name: topic.message_count for topic in self._writer.topics}
        missing = {
            topic.info.name: topic.received - written.get(topic.info.name, 0)
            for topic in self._topics
        }
        return {name: count for name, count in missing.items() if count}

    @property
    def must_end(self) -> bool:
        """The disk does not take messages, and the policy is to end."""
        return bool(self._error) and self.config.on_error == "end"

    def close(self) -> BagMetadata:
        """Write what is queued, close the bag and end the thread; a second call does nothing.

        Raises:
            DataError: the disk did not even take the index. The messages stay readable by salvage.
        """
        self._stop.set()
        self._thread.join()
        if self._metadata is None:
            lost = len(self._queue)
            self._queue.clear()
            self._writer.lost_messages += lost
            self._metadata = self._writer.close()
        return self._metadata

    def _run(self) -> None:
        while not self._stop.wait(_IDLE_S):
            self._drain()
            while self._error and not self._stop.wait(self.config.flush_period):
                self._retry()
        if self._error:
            self._retry()
        self._drain()

    def _drain(self) -> None:
        """Write all that is queued; the thread that produces may go on meanwhile."""
        queue, writer, topics = self._queue, self._writer, self._topics
        try:
            if self._error:
                return
            while self._registered < len(topics):
                topic = topics[self._registered]
                topic.channel = writer.add_topic(topic.info)
                self._registered += 1
            for _ in range(len(queue)):
                number, data, log_ns, publish_ns, sequence = queue.popleft()
                self._bytes_out += len(data)
                if number >= self._registered:
                    topics[number].channel = writer.add_topic(topics[number].info)
                writer.write(topics[number].channel, data, log_ns, publish_ns, sequence)
            writer.flush_if_due()
            self._through_s = time.monotonic()
        except DataError as error:
            self._error = str(error)
        except Exception as error:  # a recorder never dies silently: the node reports this
            self._error = f"{type(error).__name__}: {error}"

    def _retry(self) -> None:
        try:
            self._writer.flush()
        except DataError as error:
            self._error = str(error)
        except Exception as error:  # as when it is written: the next try may go well
            self._error = f"{type(error).__name__}: {error}"
        else:
            self._error = ""
