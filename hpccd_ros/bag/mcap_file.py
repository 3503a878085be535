# SPDX-License-Identifier: Apache-2.0
"""One finished MCAP file: its contents, and its messages in the order of time, with all checksums.

The index has the topics and their message counts, so that the data need not be unpacked for them. Recorders may omit
them; then the data is unpacked once more. The positions of the messages come from the data: a message that is missing
or misplaced in the index would otherwise be skipped silently.
"""

import heapq
import operator
from collections import Counter
from collections.abc import Container, Iterator
from typing import NamedTuple

from mcap import records as known
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.summary import Summary

from hpccd_ros.bag.mcap_index import (
    Descriptions,
    miscounted,
    misplaced,
    misstated,
    mistimed,
    read_index,
    stored_counts,
    undescribed,
)
from hpccd_ros.bag.mcap_records import (
    Place,
    Raw,
    data_section,
    inside,
    parse,
    records,
    unpacked_message,
    within_chunk_times,
)

# Bytes of messages, with Python's overhead, that may wait for earlier ones of later chunks. Recorders write messages
# nearly in order: about a chunk waits.
MOST_WAITING = 2 << 30
_OF_A_MESSAGE = 400


class _Waiting(NamedTuple):
    """A message, or a position with messages from `time` on. Equal times: in the order of the file."""

    time: int
    at: int
    number: int  # within a chunk
    thing: known.Message | Place


class McapFile:
    """`stream` stays open while messages are read. Raises the errors in mcap_records.DAMAGE; the methods too.

    channels, schemas: by number. counts: number of a channel -> number of its messages, if it has any.
    compression: that of the first chunk.
    """

    def __init__(self, stream, size: int):
        self._stream = stream
        self.header: known.Header | None = None
        self.metadata: list[known.Metadata] = []
        self.attachments: list[known.Attachment] = []
        self.compression = ""
        self._places: list[_Waiting] = []
        self._loose: list[tuple[int, known.Schema | known.Channel]] = []
        places = [self._sort_in(raw) for raw in data_section(stream, size)]
        index, begin = read_index(stream, size)
        end = places[-1].at + places[-1].length
        if begin != end:
            raise McapError(f"the data ends at byte {end:,}, but according to the footer at {begin:,}")
        self._index = index or Summary()
        if why := misplaced(self._index, places) or misstated(self._index, places):
            raise McapError(why)
        described = self._indexed()
        counts = stored_counts(self._index)
        if counts is None or any(described.lack(number) for number in counts):
            described, counts = self._scanned()
        else:
            for _, record in self._loose:
                described.add(record)
        self.channels, self.schemas, self.counts = described.channels, described.schemas, counts

    def messages(self, wanted: Container[int]) -> Iterator[tuple[known.Channel, known.Message]]:
        """In the order of log_time. wanted: numbers of channels."""
        described = Descriptions(_complain)
        for record in (*self.schemas.values(), *self.channels.values()):
            described.add(record)
        counts: Counter[int] = Counter()
        first, last = 2**64, -1
        in_data = {record.id for _, record in self._loose if isinstance(record, known.Channel)}
        waiting = list(self._places)
        heapq.heapify(waiting)
        held = 0
        while waiting:
            _, at, _, thing = heapq.heappop(waiting)
            if isinstance(thing, known.Message):
                held -= len(thing.data) + _OF_A_MESSAGE
                yield self.channels[thing.channel_id], thing
                continue
            for number, record in enumerate(self._records_at(thing)):
                if not isinstance(record, known.Message):
                    described.add(record)
                    if isinstance(record, known.Channel):
                        in_data.add(record.id)
                    continue
                self._check_described(described, record)
                counts[record.channel_id] += 1
                if record.log_time < first:  # min and max would take longer
                    first = record.log_time
                if record.log_time > last:
                    last = record.log_time
                if record.channel_id in wanted:
                    record = unpacked_message(described.channels[record.channel_id], record)
                    heapq.heappush(waiting, _Waiting(record.log_time, at, number, record))
                    held += len(record.data) + _OF_A_MESSAGE
                    if held > MOST_WAITING:
                        raise McapError(f"messages of {held:,} bytes are not in the order of their times")
        if why := miscounted(self._index, counts) or (counts and mistimed(self._index, first, last)):
            raise McapError(why)
        if only_indexed := set(counts) - in_data:
            raise McapError(f"channel {min(only_indexed)} is described in the index only")

    def _indexed(self) -> Descriptions:
        described = Descriptions(_complain)
        for record in (*self._index.schemas.values(), *self._index.channels.values()):
            described.add(record)
        return described

    def _scanned(self) -> tuple[Descriptions, Counter[int]]:
        """The schemas and channels in the whole data, and the message counts by channel."""
        described, counts = self._indexed(), Counter()
        parts = [*((place.at, place.thing) for place in self._places), *self._loose]
        for _, part in sorted(parts, key=operator.itemgetter(0)):  # in the order of the file
            for record in self._records_at(part) if isinstance(part, Place) else (part,):
                if isinstance(record, known.Message):
                    self._check_described(described, record)
                    counts[record.channel_id] += 1
                else:
                    described.add(record)
        return described, counts

    def _check_described(self, described: Descriptions, message: known.Message) -> None:
        number = message.channel_id
        if why := undescribed(self._index, [number]):
            raise McapError(why)
        if number not in described.channels:
            raise McapError(f"channel {number} is not described before its first message")

    def _sort_in(self, raw: Raw) -> Place:
        if (raw.opcode == Opcode.HEADER) != (self.header is None):
            raise McapError("no header at the beginning" if self.header is None else "a second header")
        if raw.opcode == Opcode.CHUNK:
            chunk = parse(raw)
            self.compression = self.compression or chunk.compression
            self._places.append(_Waiting(chunk.message_start_time, raw.at, -1, raw.place))
        elif raw.opcode == Opcode.MESSAGE:
            self._places.append(_Waiting(parse(raw).log_time, raw.at, -1, raw.place))
        else:
            record = parse(raw)
            if isinstance(record, known.Header):
                self.header = record
            elif isinstance(record, known.Metadata):
                self.metadata.append(record)
            elif isinstance(record, known.Attachment):
                self.attachments.append(record)
            elif isinstance(record, (known.Schema, known.Channel)):
                self._loose.append((raw.at, record))
        return raw.place

    def _records_at(self, place: Place):
        (raw,) = records(self._stream, place.at, place.at + place.length)
        record = parse(raw)
        if isinstance(record, known.Message):
            yield record
            return
        for item in inside(record):
            if not within_chunk_times(record, item):
                raise McapError(f"the chunk at byte {place.at:,} has a message outside of its times")
            yield item


def _complain(text: str) -> None:
    raise McapError(text)
