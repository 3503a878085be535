# SPDX-License-Identifier: Apache-2.0
"""One finished MCAP file: what it holds, and its messages in the order of time, with all check sums.

The index tells the topics and how many messages they have, before the data is unpacked. Where the messages are, the
data itself tells: one that the index did not name, or named elsewhere, would be left out in silence.
"""

import heapq
from collections import Counter
from collections.abc import Iterator
from typing import NamedTuple

from mcap import records as known
from mcap.exceptions import McapError
from mcap.opcode import Opcode

from hpccd_ros.bag.mcap_index import Descriptions, miscounted, misplaced, read_index, undescribed
from hpccd_ros.bag.mcap_records import Place, Raw, data_section, inside, parse, records, within_chunk_times

# Bytes of messages, with what Python needs for each, that may wait for earlier ones of later chunks. Recorders write
# messages nearly in order: what waits is about a chunk.
MOST_WAITING = 2 << 30
_OF_A_MESSAGE = 400


class _Waiting(NamedTuple):
    """A message, or a place where messages are from `time` on. Equal times: in the order of the file."""

    time: int
    at: int
    number: int  # within a chunk
    thing: known.Message | Place


class McapFile:
    """`stream` stays open while messages are read. Raises what is in mcap_records.DAMAGE; the methods too.

    index: None where the file has none; then there are no topics either.
    """

    def __init__(self, stream, size: int):
        self._stream = stream
        self.header: known.Header | None = None
        self.metadata: list[known.Metadata] = []
        self.attachments: list[known.Attachment] = []
        self._places: list[_Waiting] = []
        self._loose = Descriptions(_complain)
        places = [self._sort_in(raw) for raw in data_section(stream, size)]
        self.index, begin = read_index(stream, size)
        end = places[-1].at + places[-1].length
        if begin != end:
            raise McapError(f"the data ends at byte {end:,}, the footer says {begin:,}")
        if self.index is not None and (why := misplaced(self.index, places)):
            raise McapError(why)

    def messages(self, topics=None) -> Iterator[tuple[known.Channel, known.Message]]:
        """In the order of log_time; `topics`: only these names."""
        described = Descriptions(_complain)
        for record in (*self.index.schemas.values(), *self.index.channels.values(), *self._loose.schemas.values(),
                       *self._loose.channels.values()):  # fmt: skip
            described.add(record)
        wanted = {n for n, c in self.index.channels.items() if topics is None or c.topic in topics}
        counts: Counter[int] = Counter()
        waiting = list(self._places)
        heapq.heapify(waiting)
        held = 0
        while waiting:
            _, at, _, thing = heapq.heappop(waiting)
            if isinstance(thing, known.Message):
                held -= len(thing.data) + _OF_A_MESSAGE
                yield self.index.channels[thing.channel_id], thing
                continue
            for number, record in enumerate(self._records_at(thing)):
                if not isinstance(record, known.Message):
                    described.add(record)
                    continue
                if (why := undescribed(self.index, [record.channel_id])) is not None:
                    raise McapError(why)
                counts[record.channel_id] += 1
                if record.channel_id in wanted:
                    heapq.heappush(waiting, _Waiting(record.log_time, at, number, record))
                    held += len(record.data) + _OF_A_MESSAGE
                    if held > MOST_WAITING:
                        raise McapError(f"messages of {held:,} bytes are not in the order of their times")
        if why := miscounted(self.index, counts):
            raise McapError(why)

    def _sort_in(self, raw: Raw) -> Place:
        if (raw.opcode == Opcode.HEADER) != (self.header is None):
            raise McapError("no header at its begin" if self.header is None else "a second header")
        if raw.opcode == Opcode.CHUNK:
            begin = parse(raw).message_start_time
            self._places.append(_Waiting(begin, raw.at, -1, raw.place))
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
                self._loose.add(record)
        return raw.place

    def _records_at(self, place: Place):
        (raw,) = records(self._stream, place.at, place.at + place.length)
        record = parse(raw)
        if isinstance(record, known.Message):
            yield record
            return
        for item in inside(record):
            if not within_chunk_times(record, item):
                raise McapError(f"the chunk at byte {place.at:,} has a message outside of the times that it tells")
            yield item


def _complain(text: str) -> None:
    raise McapError(text)
