# SPDX-License-Identifier: Apache-2.0
"""Checks an MCAP file record by record: its contents, and how much of a truncated or damaged one is readable."""

import contextlib
import dataclasses
from collections import Counter, defaultdict
from collections.abc import Callable
from pathlib import Path

from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Header, Message, Metadata, Schema
from mcap.writer import MCAP0_MAGIC

from hpccd_ros.bag.mcap_index import (
    Descriptions,
    miscounted,
    misplaced,
    misstated,
    mistimed,
    read_index,
    undescribed,
)
from hpccd_ros.bag.mcap_records import (
    DAMAGE,
    Place,
    data_section,
    inside,
    message_index,
    opened,
    parse,
    unpacked_message,
    within_chunk_times,
)
from hpccd_ros.bag.reader import RecordingError, stored_info
from hpccd_ros.bag.writer import COMPRESSIONS


@dataclasses.dataclass
class Examination:
    """Result of reading all records of a file."""

    path: Path
    size: int  # bytes
    readable: int = 0  # bytes from the start with complete, valid records
    finished: bool = False  # index and footer exist
    ended: bool = False  # like a finished file: it is not truncated
    problem: str = ""  # the first one, or ""
    profile: str = ""
    library: str = ""
    counts: dict[str, int] = dataclasses.field(default_factory=dict)  # messages by topic
    types: dict[str, str] = dataclasses.field(default_factory=dict)  # type by topic
    start: int = 0  # ns, smallest log time
    end: int = 0  # ns, largest log time
    chunks: int = 0
    damaged_chunks: int = 0  # in which records after the damage are skipped
    orphans: int = 0  # messages of channels without a readable description
    compression: str = "none"

    @property
    def message_count(self) -> int:
        return sum(self.counts.values())

    @property
    def sound(self) -> bool:
        """Finished, and every record readable."""
        return self.finished and not self.problem


def examine(path, visit: Callable = lambda record: None) -> Examination:
    """Read all records of `path` with their checksums. Does not raise for damage, which is in the result.

    visit: is called with each whole record; a schema and a channel come before the first message that needs them.
    Raises RecordingError if `path` cannot be opened.
    """
    return _Walk(Path(path), visit).result


class _Walk:
    """Calls `visit` for each complete record of a file, schemas and channels before their messages."""

    def __init__(self, path: Path, visit: Callable):
        self._visit = visit
        self._described = Descriptions(self._note)
        self._visited: dict[int, Channel] = {}
        self._counts: Counter[int] = Counter()
        self._in_data: set[tuple[type, int]] = set()  # kinds and numbers of descriptions
        # Of the last chunk, what its message indexes contain, by channel; removed when found.
        self._places: defaultdict[int, list[tuple[int, int]]] = defaultdict(list)
        self._has_indexes = False
        with contextlib.ExitStack() as stack:
            try:
                self.result = Examination(path, path.stat().st_size)
                stream = stack.enter_context(opened(path))
            except OSError as error:
                raise RecordingError(f"{path} cannot be read: {error.strerror}") from error
            self._walk(stream)

    def _walk(self, stream):
        result = self.result
        index, data_end, index_problem = self._read_index(stream)
        places: list[Place] = []
        for raw in self._whole_records(stream):
            places.append(raw.place)
            for record in self._records_of(raw):
                self._visit_record(record)
            result.readable = stream.tell()
        if result.orphans:
            self._note(f"{result.orphans} messages of channels that nothing describes")
        if result.finished and data_end != result.readable:
            why = f"the data ends at byte {result.readable:,}, but according to the footer at {data_end:,}"
            index_problem = index_problem or why
        if result.finished and index_problem:
            self._note(index_problem)
            result.finished = False
        elif result.finished and index is not None and not result.damaged_chunks:
            result.readable = result.size
            counts = self._counts
            for why in (
                misplaced(index, places),
                undescribed(index, counts),
                miscounted(index, counts),
                mistimed(index, result.start, result.end) if counts else None,
                misstated(index, places),
            ):
                if why:
                    self._note(why)

    def _whole_records(self, stream):
        # Errors of `visit`, such as a full disk, are no damage: the loop is outside.
        try:
            yield from data_section(stream, self.result.size)
        except DAMAGE as error:
            self._note(_text(error))
        else:
            self.result.finished = True

    def _records_of(self, raw):
        result = self.result
        if raw.at == len(MCAP0_MAGIC) and raw.opcode != Opcode.HEADER:
            self._note("no header at the beginning")
        if raw.at != len(MCAP0_MAGIC) and raw.opcode == Opcode.HEADER:
            self._note(f"a header at byte {raw.at:,}")
        try:
            if raw.opcode == Opcode.MESSAGE_INDEX:
                self._check_message_index(raw)
            elif self._has_indexes and self._places:
                self._note(f"an index of messages is missing before byte {raw.at:,}")
                self._has_indexes = False
            record = parse(raw)
            if isinstance(record, Chunk):
                result.chunks += 1
                self._places, self._has_indexes = defaultdict(list), False
                result.compression = record.compression if record.compression in COMPRESSIONS else "none"
                for item in inside(record, self._places):
                    if not within_chunk_times(record, item):
                        self._note(f"the chunk at byte {raw.at:,} has a message outside of its times")
                    yield item
            elif record is not None:
                yield record
        except DAMAGE as error:
            # The frame of the record is complete, so later ones can be read.
            result.damaged_chunks += raw.opcode == Opcode.CHUNK
            self._note(_text(error))

    def _check_message_index(self, raw):
        channel, entries = message_index(raw)
        self._has_indexes = True
        if sorted(self._places.pop(channel, [])) != sorted(entries):
            self._note(f"the index of messages at byte {raw.at:,} does not match its chunk")

    def _read_index(self, stream):
        """(index or None, where the data must end, why there is none). The index may describe a damaged chunk."""
        try:
            stream.seek(max(0, self.result.size - len(MCAP0_MAGIC)))
            if stream.read() != MCAP0_MAGIC:
                return None, 0, "no end of a finished file"
            self.result.ended = True
            index, data_end = read_index(stream, self.result.size)
        except DAMAGE as error:
            return None, 0, _text(error)
        if index is not None:
            for record in (*index.schemas.values(), *index.channels.values()):
                self._described.add(record)
        return index, data_end, None

    def _visit_record(self, record):
        result = self.result
        if isinstance(record, Header):
            result.profile, result.library = result.profile or record.profile, result.library or record.library
        if isinstance(record, (Schema, Channel)):
            self._described.add(record)
            self._in_data.add((type(record), record.id))
            if isinstance(record, Channel) and record.schema_id:
                self._need(Schema, record.schema_id, f"schema {record.schema_id} is not described before its channels")
        elif isinstance(record, Message):
            self._visit_message(record)
        elif self._is_readable(record):
            self._visit(record)

    def _need(self, kind, number, otherwise) -> None:
        # The index may describe it too, but other readers go through the data in order.
        if (kind, number) not in self._in_data:
            self._note(otherwise)

    def _is_readable(self, record) -> bool:
        try:
            if isinstance(record, Metadata):
                stored_info(record)
        except ValueError as error:
            self._note(str(error))
            return False
        return True

    def _visit_message(self, record):
        result, number = self.result, record.channel_id
        if number not in self._described.channels:
            result.orphans += 1
            return
        channel = self._described.channels[number]
        if self._visited.get(number) is not channel:
            self._visited[number] = channel
            self._need(Channel, number, f"channel {number} is not described before its first message")
            if channel.schema_id in self._described.schemas:
                self._visit(self._described.schemas[channel.schema_id])
                result.types[channel.topic] = self._described.schemas[channel.schema_id].name
            self._visit(channel)
        self._counts[number] += 1
        try:
            record = unpacked_message(channel, record)
        except DAMAGE as error:
            self._note(f"a message of {channel.topic}: {_text(error)}")
            return
        result.start = min(result.start, record.log_time) if result.message_count else record.log_time
        result.end = max(result.end, record.log_time)
        result.counts[channel.topic] = result.counts.get(channel.topic, 0) + 1
        self._visit(record)

    def _note(self, problem: str) -> None:
        self.result.problem = self.result.problem or problem


def _text(error) -> str:
    return f"{type(error).__name__}: {error}".rstrip(": ")
