# SPDX-License-Identifier: Apache-2.0
"""Check an MCAP file record by record, and save what is readable of a cut-off or damaged one."""

import dataclasses
from pathlib import Path

from mcap.reader import SeekingReader
from mcap.records import Attachment, Channel, Chunk, DataEnd, Header, Message, Metadata, Schema
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import CompressionType, Writer

from hpccd_ros.mcap_bag import COMPRESSIONS
from hpccd_ros.mcap_reader import DAMAGE, RecordingError


@dataclasses.dataclass
class Examination:
    """What a walk over all records of a file found."""

    path: Path
    size: int  # bytes
    readable: int = 0  # bytes from the start that hold whole, valid records
    finished: bool = False  # index and footer are there
    problem: str = ""  # why the walk ended before the end, or ""
    profile: str = ""
    library: str = ""
    counts: dict[str, int] = dataclasses.field(default_factory=dict)  # messages by topic
    types: dict[str, str] = dataclasses.field(default_factory=dict)  # type by topic
    start: int = 0  # ns, smallest log time
    end: int = 0  # ns, largest log time
    chunks: int = 0
    damaged_chunks: int = 0  # skipped: their check sum or compression is wrong
    orphans: int = 0  # messages of channels that only a damaged chunk described
    compression: str = "none"

    @property
    def message_count(self) -> int:
        return sum(self.counts.values())

    @property
    def sound(self) -> bool:
        """Finished, and every record readable."""
        return self.finished and not self.problem


def examine(path) -> Examination:
    """Walk over all records of `path` with their check sums. Never raises for damage: it is in the result."""
    return _walk(Path(path), lambda record: None)


def recover(source, target, compression=None) -> Examination:
    """Copy every whole record of `source` into the new, finished file `target`; the result tells what was there.

    compression: "none", "lz4", "zstd"; None: that of the source.
    Raises RecordingError where `source` holds nothing to save, FileExistsError where `target` exists.
    """
    source, target = Path(source), Path(target)
    first = examine(source)
    if first.message_count == 0:
        raise RecordingError(f"{source} holds no whole message ({first.problem or 'an empty recording'})")
    with open(target, "xb") as stream:
        copy = _Copy(Writer(stream, compression=_compression(compression or first.compression)))
        result = _walk(source, copy)
        copy.finish()
    return result


def _compression(name) -> CompressionType:
    if name not in COMPRESSIONS:
        raise ValueError(f"compression {name!r} is none of {', '.join(COMPRESSIONS)}")
    return COMPRESSIONS[name]


def _walk(path, visit) -> Examination:
    result = Examination(path, path.stat().st_size)
    schemas, channels = _described_in_summary(path)
    announced: set[int] = set()

    def take(record):
        if isinstance(record, Schema):
            schemas[record.id] = record
        elif isinstance(record, Channel):
            channels[record.id] = record
        elif isinstance(record, Message):
            if record.channel_id not in channels:
                result.orphans += 1
                return
            channel = channels[record.channel_id]
            if record.channel_id not in announced:
                announced.add(record.channel_id)
                if channel.schema_id in schemas:
                    visit(schemas[channel.schema_id])
                    result.types[channel.topic] = schemas[channel.schema_id].name
                visit(channel)
            result.start = min(result.start, record.log_time) if result.message_count else record.log_time
            result.end = max(result.end, record.log_time)
            result.counts[channel.topic] = result.counts.get(channel.topic, 0) + 1
            visit(record)
        else:
            visit(record)

    with open(path, "rb") as stream:
        try:
            for record in StreamReader(stream, emit_chunks=True, validate_crcs=True).records:
                if isinstance(record, Header):
                    result.profile, result.library = record.profile, record.library
                    visit(record)
                elif isinstance(record, Chunk):
                    result.chunks += 1
                    result.compression = record.compression or "none"
                    try:
                        inner = breakup_chunk(record, validate_crc=True)
                    except DAMAGE as error:
                        # The frame of the chunk is whole: what follows it can be read.
                        result.damaged_chunks += 1
                        result.problem = result.problem or _text(error)
                        continue
                    for item in inner:
                        take(item)
                elif isinstance(record, DataEnd):
                    result.finished = True  # unless the rest, the index, proves unreadable
                elif not result.finished:
                    take(record)
                result.readable = stream.tell()
        except DAMAGE as error:
            result.problem = result.problem or _text(error)
            result.finished = False
    return result


def _text(error) -> str:
    return f"{type(error).__name__}: {error}".rstrip(": ")


def _described_in_summary(path):
    """Schemas and channels of the index, where the file has one: they may stand in a damaged chunk otherwise."""
    try:
        with open(path, "rb") as stream:
            summary = SeekingReader(stream).get_summary()
    except DAMAGE:
        summary = None  # what this module is for
    return (dict(summary.schemas), dict(summary.channels)) if summary else ({}, {})


class _Copy:
    """Visitor that writes each record it is given into a new file, with channel and schema ids of that file."""

    def __init__(self, writer: Writer):
        self._writer = writer
        self._schemas: dict[int, int] = {}
        self._channels: dict[int, int] = {}

    def __call__(self, record):
        writer = self._writer
        if isinstance(record, Header):
            writer.start(profile=record.profile, library=f"{record.library} (recovered)")
        elif isinstance(record, Schema) and record.id not in self._schemas:
            self._schemas[record.id] = writer.register_schema(record.name, record.encoding, record.data)
        elif isinstance(record, Channel):
            schema_id = self._schemas.get(record.schema_id, 0)  # 0: no schema, in the words of the format
            self._channels[record.id] = writer.register_channel(
                record.topic, record.message_encoding, schema_id, dict(record.metadata)
            )
        elif isinstance(record, Message):
            writer.add_message(
                self._channels[record.channel_id], record.log_time, record.data, record.publish_time, record.sequence
            )
        elif isinstance(record, Metadata) and record.name != "rosbag2":  # its counts are no longer true
            writer.add_metadata(record.name, dict(record.metadata))
        elif isinstance(record, Attachment):
            writer.add_attachment(
                record.create_time, record.log_time, record.name, record.media_type, record.data
            )

    def finish(self):
        self._writer.finish()
