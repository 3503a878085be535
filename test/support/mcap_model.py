# SPDX-License-Identifier: Apache-2.0
"""A recording as a list of records, written with valid checksums whatever the content: for hostile files."""

import dataclasses
import struct
import zlib
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path

import lz4.frame
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    Message,
    MessageIndex,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
)
from mcap.stream_reader import StreamReader
from mcap.writer import MCAP0_MAGIC

COMPRESS = {"": bytes, "lz4": lz4.frame.compress, "zstd": zstandard.compress}


def unchanged(thing):
    return thing


@dataclasses.dataclass
class Bag:
    """Records by kind. Tests may change or replace them; bytes are written as they are.

    chunk: each Chunk, with its data compressed. data: all records of the data section, chunks as records or bytes.
    index: those of the summary. footer: the Footer, before its check sum is made. end: all bytes of the file.
    """

    schemas: list[Schema]
    channels: list[Channel]
    messages: list[Message]
    metadata: list[Metadata]
    attachments: list[Attachment]
    profile: str = "ros2"
    library: str = "test"
    compression: str = ""
    chunk_bytes: int = 20_000  # 0: messages outside of chunks
    summary: bool = True
    check_sums: bool = True  # the format allows to leave them out, and rosbag2 leaves out most
    inside: Callable = unchanged  # list of the records of a chunk
    chunk: Callable = unchanged
    data: Callable = unchanged
    index: Callable = unchanged
    footer: Callable = unchanged
    end: Callable = unchanged

    @classmethod
    def read(cls, source) -> "Bag":
        """All records of a sound file, in the order of the file."""
        found = defaultdict(list)
        with open(source, "rb") as stream:
            for record in StreamReader(stream).records:
                if isinstance(record, DataEnd):
                    break
                found[type(record)].append(record)
        for record in found[Metadata]:
            record.metadata.pop("crc32", None)  # tests change parameters; without it they count
        return cls(found[Schema], found[Channel], found[Message], found[Metadata], found[Attachment])

    def copy(self) -> "Bag":
        """A copy whose records can be changed without changing this one's."""
        changed = {
            name: [dataclasses.replace(record) for record in getattr(self, name)]
            for name in ("schemas", "channels", "messages", "metadata", "attachments")
        }
        for channel in changed["channels"]:
            channel.metadata = dict(channel.metadata)
        for record in changed["metadata"]:
            record.metadata = dict(record.metadata)
        return dataclasses.replace(self, **changed)

    def channel(self, topic: str) -> Channel:
        return next(channel for channel in self.channels if channel.topic == topic)

    def of_topic(self, topic: str) -> list[Message]:
        number = self.channel(topic).id
        return [message for message in self.messages if message.channel_id == number]

    def bytes(self) -> bytes:
        records = [Header(self.profile, self.library), *self.metadata, *self.attachments]
        described = [*self.schemas, *self.channels]
        if self.chunk_bytes:
            groups = [[]]
            size = 0
            for message in self.messages:
                if size > self.chunk_bytes:
                    groups.append([])
                    size = 0
                groups[-1].append(message)
                size += len(message.data)
            for number, group in enumerate(groups):
                records += self._chunk([*(described if number == 0 else []), *group])
        else:
            records += [*described, *self.messages]
        out = bytearray(MCAP0_MAGIC)
        places = []
        for record in self.data(records):
            raw = as_bytes(record)
            places.append((record, len(out), len(raw)))
            out += raw
        out += as_bytes(DataEnd(zlib.crc32(out) if self.check_sums else 0))
        start = len(out)
        summary = self.index(self._index(places)) if self.summary else []
        out += b"".join(map(as_bytes, summary))
        footer = self.footer(Footer(start if summary else 0, 0, 0))
        head = struct.pack("<BQQQ", Opcode.FOOTER, 20, footer.summary_start, footer.summary_offset_start)
        if self.check_sums and not footer.summary_crc:
            footer.summary_crc = zlib.crc32(bytes(out[start:]) + head)
        out += as_bytes(footer) + MCAP0_MAGIC
        return bytes(self.end(out))

    def write(self, path) -> Path:
        Path(path).write_bytes(self.bytes())
        return Path(path)

    def _chunk(self, records):
        content = b"".join(map(as_bytes, self.inside(records)))
        times = [record.log_time for record in records if isinstance(record, Message)] or [0]
        chunk = Chunk(
            compression=self.compression,
            data=COMPRESS[self.compression](content),
            message_start_time=min(times),
            message_end_time=max(times),
            uncompressed_crc=zlib.crc32(content) if self.check_sums else 0,
            uncompressed_size=len(content),
        )
        places, at = defaultdict(list), 0
        for record in records:
            if isinstance(record, Message):
                places[record.channel_id].append((record.log_time, at))
            at += len(as_bytes(record))
        return [self.chunk(chunk), *(MessageIndex(number, entries) for number, entries in places.items())]

    def _index(self, places):
        counts = defaultdict(int)
        for message in self.messages:
            counts[message.channel_id] += 1
        times = [message.log_time for message in self.messages] or [0]
        chunks = [place for place in places if isinstance(place[0], Chunk)]
        statistics = Statistics(
            attachment_count=len(self.attachments),
            channel_count=len(self.channels),
            channel_message_counts=dict(counts),
            chunk_count=len(chunks),
            message_count=len(self.messages),
            message_start_time=min(times),
            message_end_time=max(times),
            metadata_count=len(self.metadata),
            schema_count=len(self.schemas),
        )
        records = [*self.schemas, *self.channels, statistics]
        for record, at, length in places:
            if isinstance(record, Chunk):
                records.append(
                    ChunkIndex(
                        chunk_start_offset=at,
                        chunk_length=length,
                        message_start_time=record.message_start_time,
                        message_end_time=record.message_end_time,
                        message_index_offsets={},
                        message_index_length=0,
                        compression=record.compression,
                        compressed_size=len(record.data),
                        uncompressed_size=record.uncompressed_size,
                    )
                )
            elif isinstance(record, Metadata):
                records.append(MetadataIndex(at, length, record.name))
            elif isinstance(record, Attachment):
                records.append(
                    AttachmentIndex(
                        at,
                        length,
                        record.log_time,
                        record.create_time,
                        len(record.data),
                        record.name,
                        record.media_type,
                    )
                )
        return records


def as_bytes(record) -> bytes:
    """A record as it is written; bytes as they are."""
    if isinstance(record, (bytes, bytearray)):
        return bytes(record)
    builder = RecordBuilder()
    record.write(builder)
    return builder.end()


def raw_record(opcode: int, body: bytes, length: int | None = None) -> bytes:
    """A record of any kind; `length`: a false length for its header."""
    return struct.pack("<BQ", opcode, len(body) if length is None else length) + body
