# SPDX-License-Identifier: Apache-2.0
"""The index of an MCAP file (its summary section), and whether the data agrees with it."""

import struct
import zlib
from collections import Counter
from collections.abc import Callable, Iterable

from mcap import records as known
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.stream_reader import CRCValidationError
from mcap.summary import Summary
from mcap.writer import MCAP0_MAGIC

from hpccd_ros.bag.mcap_records import Place, parse, records

_FOOTER = struct.Struct("<BQQQI")


class Descriptions:
    """Schemas and channels by their numbers, from the index and from the data.

    complain: called with a text for each contradicting description; the later one counts.
    """

    def __init__(self, complain: Callable[[str], None]) -> None:
        self.schemas: dict[int, known.Schema] = {}
        self.channels: dict[int, known.Channel] = {}
        self._complain = complain

    def add(self, record: known.Schema | known.Channel) -> None:
        kind, into = ("schema", self.schemas) if isinstance(record, known.Schema) else ("channel", self.channels)
        if into.setdefault(record.id, record) != record:
            self._complain(f"{kind} {record.id} is described twice, differently")
            into[record.id] = record

    def lack(self, number: int) -> bool:
        """Whether the index lacks a channel, or the schema that it names."""
        channel = self.channels.get(number)
        return channel is None or (channel.schema_id != 0 and channel.schema_id not in self.schemas)


def read_index(stream, size: int) -> tuple[Summary | None, int]:
    """(index or None, where the data must end) of a file of `size` bytes. Raises the errors in mcap_records.DAMAGE."""
    footer_at = size - len(MCAP0_MAGIC) - _FOOTER.size
    if footer_at < len(MCAP0_MAGIC):
        raise McapError("no room for a footer")
    stream.seek(footer_at)
    raw = stream.read(_FOOTER.size)
    opcode, length, begin, _, stored = _FOOTER.unpack(raw)
    if opcode != Opcode.FOOTER or length != _FOOTER.size - 9:
        raise McapError("no footer at its end")
    if begin == 0:
        return None, footer_at
    if not len(MCAP0_MAGIC) <= begin <= footer_at:
        raise McapError(f"the footer says that the index begins at byte {begin:,}, {footer_at:,} is the footer's own")
    stream.seek(begin)
    found = zlib.crc32(raw[:-4], zlib.crc32(stream.read(footer_at - begin)))
    if stored not in (0, found):
        raise CRCValidationError(stored, found, known.Footer(begin, 0, stored))
    return _summary(records(stream, begin, footer_at)), begin


def _summary(raws) -> Summary:
    def complain(text):
        raise McapError(f"in the index, {text}")

    described = Descriptions(complain)
    summary = Summary()
    lists = {
        known.ChunkIndex: summary.chunk_indexes,
        known.AttachmentIndex: summary.attachment_indexes,
        known.MetadataIndex: summary.metadata_indexes,
    }
    for raw in raws:
        record = parse(raw)
        if isinstance(record, (known.Schema, known.Channel)):
            described.add(record)
        elif isinstance(record, known.Statistics):
            if summary.statistics is not None:
                complain("the statistics are there twice")
            summary.statistics = record
        elif type(record) in lists:
            lists[type(record)].append(record)
        elif record is not None:
            raise McapError(f"a {type(record).__name__} in the index")
    summary.schemas.update(described.schemas)
    summary.channels.update(described.channels)
    return summary


def misplaced(summary: Summary, data: list[Place]) -> str | None:
    """How the index differs from the records of the `data`, in position or content, or None.

    An index may lack all records of a kind, or the positions of message indexes.
    """
    for opcode, name, indexed in (
        (Opcode.CHUNK, "chunk", [_of_chunk(i) for i in summary.chunk_indexes]),
        (Opcode.ATTACHMENT, "attachment", [_of_attachment(i) for i in summary.attachment_indexes]),
        (Opcode.METADATA, "metadata record", [(i.offset, i.length, i.name) for i in summary.metadata_indexes]),
    ):
        there = [(place.at, place.length, *place.content) for place in data if place.opcode == opcode]
        if indexed and sorted(indexed) != there:
            wrong = sorted(set(indexed).symmetric_difference(there)) or indexed
            return f"the index is wrong about the {name} at byte {wrong[0][0]:,}"
    by_chunk = _message_indexes(data)
    for index in summary.chunk_indexes:
        indexed = index.message_index_offsets, index.message_index_length
        if indexed not in (({}, 0), by_chunk[index.chunk_start_offset]):
            return f"the index is wrong about the message indexes of the chunk at byte {index.chunk_start_offset:,}"
    return None


def _of_chunk(index: known.ChunkIndex) -> tuple:
    place = index.chunk_start_offset, index.chunk_length
    times = index.message_start_time, index.message_end_time
    return *place, *times, index.compression, index.compressed_size, index.uncompressed_size


def _of_attachment(index: known.AttachmentIndex) -> tuple:
    times = index.log_time, index.create_time
    return index.offset, index.length, *times, index.name, index.media_type, index.data_size


def _message_indexes(data: list[Place]) -> dict[int, tuple[dict[int, int], int]]:
    """Position of a chunk -> ({channel: position of its message index}, size of all these)."""
    found: dict[int, tuple[dict[int, int], int]] = {}
    offsets: dict[int, int] = {}
    chunk, size = 0, 0
    for place in data:
        if place.opcode == Opcode.CHUNK:
            chunk, size, offsets = place.at, 0, {}
        elif place.opcode == Opcode.MESSAGE_INDEX and place.content:
            offsets[place.content[0]] = place.at
            size += place.length
        found[chunk] = offsets, size
    return found


def undescribed(summary: Summary, channels: Iterable[int]) -> str | None:
    """The first of the `channels` with messages that the index lacks, or whose schema it lacks, in words, or None.

    An index may have no channels, and no schemas.
    """
    for number in channels if summary.channels else ():
        if number not in summary.channels:
            return f"the index does not describe channel {number}"
        schema = summary.channels[number].schema_id
        if summary.schemas and schema and schema not in summary.schemas:
            return f"the index does not describe schema {schema}"
    return None


def stored_counts(summary: Summary) -> dict[int, int] | None:
    """Message counts by channel, for channels that have messages; None: the index has no counts."""
    statistics = summary.statistics
    if statistics is None or (statistics.message_count and not statistics.channel_message_counts):
        return None
    return {number: count for number, count in statistics.channel_message_counts.items() if count}


def miscounted(summary: Summary, counts: dict[int, int]) -> str | None:
    """How the statistics of the index differ from `counts`, the messages by channel, or None.

    Statistics may lack the counts by channel.
    """
    if summary.statistics is None:
        return None
    indexed = stored_counts(summary)
    if indexed is None:
        indexed = dict(counts)
    if indexed == dict(counts) and summary.statistics.message_count == sum(counts.values()):
        return None
    where = next((n for n in {**indexed, **counts} if indexed.get(n, 0) != counts.get(n, 0)), None)
    if where is None:
        return f"the index lists {summary.statistics.message_count:,} messages, the file has {sum(counts.values()):,}"
    listed = f"{indexed.get(where, 0):,} messages of channel {where}"
    return f"the index lists {listed}, the file has {counts.get(where, 0):,}"


def mistimed(summary: Summary, first: int, last: int) -> str | None:
    """That the statistics of the index have other times than ``first`` and ``last``, the smallest and largest log time
    of the messages, or None."""
    statistics = summary.statistics
    if statistics is None or (statistics.message_start_time, statistics.message_end_time) == (first, last):
        return None
    return "the index is wrong about the time of the first or last message"


def misstated(summary: Summary, data: list[Place]) -> str | None:
    """How the numbers of records in the statistics of the index differ from the `data`, or None.

    Not compared: schemas and channels, because recorders count repeated descriptions differently.
    """
    statistics = summary.statistics
    if statistics is None:
        return None
    found = Counter(place.opcode for place in data)
    for name, listed, there in (
        ("chunks", statistics.chunk_count, found[Opcode.CHUNK]),
        ("attachments", statistics.attachment_count, found[Opcode.ATTACHMENT]),
        ("metadata records", statistics.metadata_count, found[Opcode.METADATA]),
    ):
        if listed != there:
            return f"the index lists {listed:,} {name}, the file has {there:,}"
    return None
