"""Recovering a bag whose recorder was killed, or whose file is cut or damaged."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from hri_prediction.bags.condition import Condition
from hri_prediction.bags.metadata import METADATA_FILE, BagMetadata, read_metadata
from hri_prediction.bags.reader import custom_data_of, topic_of
from hri_prediction.bags.scan import Scan, ScannedChannel, ScanResult
from hri_prediction.bags.schemas import MessageDefinition
from hri_prediction.bags.writer import BagWriter
from hri_prediction.errors import DataError

NOT_SALVAGED = "not_salvaged"
"""Key of ``custom_data`` of a salvaged bag: what was not whole in the one that it was made of."""


@dataclass(frozen=True)
class SalvageReport:
    """What was recovered.

    Attributes:
        folder: The new bag.
        metadata: Its metadata.
        files: What was found in each file of the old one, by file name.
        missing: What was not whole in it, in words.
    """

    folder: Path
    metadata: BagMetadata
    files: dict[str, ScanResult]
    missing: tuple[str, ...]

    @property
    def damaged_chunks(self) -> int:
        """Chunks that had to be passed over."""
        return sum(result.damaged_chunks for result in self.files.values())

    @property
    def partial_messages(self) -> int:
        """Messages that come from chunks in which a file ended."""
        return sum(result.partial_messages for result in self.files.values())


def salvage(source: str | Path, out: str | Path) -> SalvageReport:
    """Copy every message that is whole into a new, proper bag.

    Chunks with a wrong checksum are passed over, whatever is damaged between chunks too: every whole
    chunk before and behind it is kept. Of a chunk in which the file ends, the messages that are
    complete are kept, which no checksum covers. The original is only read. Topics, QoS, type hashes,
    attachments and custom_data are kept; custom_data gains ``salvaged_from``, and ``not_salvaged`` with
    what was not whole.

    Args:
        source: Bag folder (metadata.yaml is used where readable, but not needed) or .mcap file.
        out: Folder to create.

    Raises:
        DataError: there is no MCAP file, or the new bag cannot be written.
        ConfigError: ``out`` exists already or cannot be made.
    """
    source = Path(source)
    files = sorted(source.glob("*.mcap")) if os.path.isdir(source) else [source]
    if not files:
        raise DataError(f"{source} holds no .mcap file", expected="a bag folder or an .mcap file")
    scans = [Scan(file) for file in files]  # refuses what is no MCAP before making anything
    custom = _custom_data(source, files)
    custom["salvaged_from"] = source.absolute().name
    results: dict[str, ScanResult] = {}
    with BagWriter(out, custom_data=custom) as writer:
        for file, scan in zip(files, scans, strict=True):
            channels: dict[str, int] = {}
            for message in scan:
                topic = message.channel.topic
                if topic not in channels:
                    channels[topic] = _register(writer, message.channel)
                writer.write(
                    channels[topic],
                    message.data,
                    message.log_time_ns,
                    message.publish_time_ns,
                    message.sequence,
                )
            for channel in scan.channels:
                _register(writer, channel)
            for item in scan.result.attachments:
                writer.add_attachment(item.name, item.media_type, item.data)
            results[file.name] = scan.result
        conditions = [Condition.of(name, found) for name, found in results.items()]
        missing = tuple(text for condition in conditions for text in condition.words())
        if missing:
            # A bag that is salvaged twice keeps what has been missing since the first time.
            before = [custom[NOT_SALVAGED]] if NOT_SALVAGED in custom else []
            writer.add_custom_data(NOT_SALVAGED, "; ".join([*before, *missing]))
        metadata = writer.close()
    return SalvageReport(writer.folder, metadata, results, missing)


def _register(writer: BagWriter, channel: ScannedChannel) -> int:
    definition = MessageDefinition(channel.type, channel.encoding, channel.definition)
    return writer.add_topic(topic_of(channel), definition)


def _custom_data(source: Path, files: list[Path]) -> dict[str, str]:
    """custom_data of metadata.yaml, else of the metadata within the first file that has any."""
    folder = source if os.path.isdir(source) else source.parent
    if os.path.isfile(folder / METADATA_FILE):
        try:
            return dict(read_metadata(folder).custom_data)
        except DataError:
            pass  # a damaged metadata.yaml is no reason to give up the messages
    for file in files:
        scan = Scan(file)
        for _ in scan:
            pass
        if scan.result.serialized_metadata:
            return custom_data_of(scan.result.serialized_metadata)
    return {}
