# SPDX-License-Identifier: Apache-2.0
"""Random changes to the records of a finished recording, and an oracle that decides what a change means. Both parse
MCAP by themselves, without the code that ships and without the MCAP library.

python test/support/corruption.py --cases 10000     counts by kind of change; false verdicts with their case
python test/support/corruption.py --only 17          one case
"""

import argparse
import collections
import dataclasses
import json
import random
import struct
import sys
import tempfile
import zlib
from pathlib import Path

import damage
import lz4.frame
import recording_oracle
import zstandard
from bag_tools import raw_messages
from base_bags import write_all
from in_process import hpccd

from hpccd_ros.bag.examine import examine
from hpccd_ros.bag.reader import Recording
from hpccd_ros.bag.writer import COMPRESSIONS, BagWriter, Topic

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX = range(1, 9)
ATTACHMENT, ATTACHMENT_INDEX, STATISTICS, METADATA, METADATA_INDEX, SUMMARY_OFFSET, DATA_END = range(9, 16)
COMPRESS = {b"": bytes, b"lz4": lz4.frame.compress, b"zstd": zstandard.compress}
UNPACK = {b"": bytes, b"lz4": lz4.frame.decompress, b"zstd": lambda data: zstandard.ZstdDecompressor().decompress(data)}


class Contradiction(Exception):
    """The file contradicts itself or the format."""


# ---------------------------------------------------------------- records


def framed(opcode: int, body: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(body)) + body


def frames(data: bytes, at: int, end: int):
    """(position, opcode, body) of each record."""
    while at < end:
        if end - at < 9:
            raise Contradiction(f"no whole record at {at}")
        opcode, length = struct.unpack_from("<BQ", data, at)
        if length > end - at - 9:
            raise Contradiction(f"a record of {length} bytes at {at}")
        yield at, opcode, bytes(data[at + 9 : at + 9 + length])
        at += 9 + length


class Fields:
    """Reads the fields of a record in order."""

    def __init__(self, body: bytes):
        self._body, self._at = body, 0

    def number(self, size: int) -> int:
        return int.from_bytes(self.bytes(size), "little")

    def bytes(self, size: int) -> bytes:
        if size > len(self._body) - self._at:
            raise Contradiction(f"a field of {size} bytes")
        self._at += size
        return self._body[self._at - size : self._at]

    def text(self) -> bytes:
        return self.bytes(self.number(4))

    def pairs(self, key, value) -> list:
        whole = Fields(self.text())
        found = []
        while whole._at < len(whole._body):
            found.append((key(whole), value(whole)))
        return found

    def rest(self) -> bytes:
        return self.bytes(len(self._body) - self._at)


def text_field(data: bytes) -> bytes:
    return struct.pack("<I", len(data)) + data


@dataclasses.dataclass
class Chunk:
    start: int
    end: int
    size: int
    crc: int
    compression: bytes
    records: list[tuple[int, bytes]]

    @classmethod
    def read(cls, body: bytes) -> "Chunk":
        fields = Fields(body)
        start, end, size, crc = (fields.number(length) for length in (8, 8, 8, 4))
        compression = fields.text()
        packed = fields.bytes(fields.number(8))
        if fields.rest() or compression not in UNPACK:
            raise Contradiction("not a chunk")
        try:
            data = UNPACK[compression](packed)
        except (RuntimeError, zstandard.ZstdError) as error:
            raise Contradiction(str(error)) from error
        chunk = cls(start, end, size, crc, compression, [(op, body) for _, op, body in frames(data, 0, len(data))])
        if len(data) != size or crc not in (0, zlib.crc32(data)):
            raise Contradiction("size or checksum of a chunk")
        return chunk

    @property
    def data(self) -> bytes:
        return b"".join(framed(*record) for record in self.records)

    @property
    def times(self) -> list[int]:
        return [struct.unpack_from("<Q", body, 6)[0] for op, body in self.records if op == MESSAGE and len(body) >= 14]

    def body(self) -> bytes:
        packed = COMPRESS[self.compression](self.data)
        head = struct.pack("<QQQI", self.start, self.end, self.size, self.crc)
        return head + text_field(self.compression) + struct.pack("<Q", len(packed)) + packed

    def message_indexes(self) -> list[bytes]:
        found, at = collections.defaultdict(list), 0
        for op, body in self.records:
            if op == MESSAGE:
                channel, _, time = struct.unpack_from("<HIQ", body.ljust(14, b"\0"))
                found[channel].append(struct.pack("<QQ", time, at))
            at += 9 + len(body)
        return [struct.pack("<H", number) + text_field(b"".join(entries)) for number, entries in found.items()]


# ---------------------------------------------------------------- the oracle


def contradiction(data: bytes) -> str | None:
    """The first contradiction of a file to itself or to the format; None: it is whole. Left out: records that no reader
    needs (summary offsets), and unknown ones."""
    try:
        _check(data)
    except (Contradiction, struct.error, UnicodeDecodeError) as error:
        return str(error) or "a field is too short"
    return None


def _check(data: bytes) -> None:
    if data[:8] != MAGIC or data[-8:] != MAGIC or len(data) < 45:
        raise Contradiction("magic")
    footer_at = len(data) - 8 - 29
    if data[footer_at : footer_at + 9] != struct.pack("<BQ", FOOTER, 20):
        raise Contradiction("footer")
    begin, _, crc = struct.unpack_from("<QQI", data, footer_at + 9)
    found = _Data(data, begin or footer_at)
    if begin == 0:
        return
    if crc not in (0, zlib.crc32(data[begin : footer_at + 25])):
        raise Contradiction("checksum of the summary")
    expected = found.summary()
    seen = collections.defaultdict(list)
    for _, op, body in frames(data, begin, footer_at):
        seen[op].append(_statistics(body) if op == STATISTICS else _chunk_index(body) if op == CHUNK_INDEX else body)
    for op in (CHUNK_INDEX, METADATA_INDEX, ATTACHMENT_INDEX, STATISTICS):
        if seen[op] and sorted(seen[op]) != sorted(expected[op]):
            raise Contradiction(f"the summary's records of kind {op} are not those of the data")
    for op in (SCHEMA, CHANNEL):
        found.check_described(op, seen[op])
    for op in seen:
        if op in (HEADER, FOOTER, MESSAGE, CHUNK, MESSAGE_INDEX, ATTACHMENT, METADATA, DATA_END):
            raise Contradiction(f"a record of kind {op} in the summary")


def _statistics(body):
    fields = Fields(body)
    numbers = [fields.number(size) for size in (8, 2, 4, 4, 4, 4, 8, 8)]
    # Recorders count repeated descriptions differently.
    numbers[1:3] = 0, 0
    counts = fields.pairs(lambda f: f.number(2), lambda f: f.number(8))
    return (*numbers, tuple(sorted(pair for pair in counts if pair[1])))


def _chunk_index(body):
    fields = Fields(body)
    head = [fields.number(8) for _ in range(4)]
    offsets = fields.pairs(lambda f: f.number(2), lambda f: f.number(8))
    return (*head, tuple(sorted(offsets)), fields.number(8), fields.text(), fields.number(8), fields.number(8))


class _Data:
    """The records of the data section. Raises Contradiction."""

    def __init__(self, data: bytes, end: int, strict: bool = True):
        self._strict = strict
        self.messages: list[tuple] = []
        self.metadata: list[tuple] = []
        self.attachments: list[tuple] = []
        self._described: dict[tuple, bytes] = {}
        self._lists = collections.defaultdict(list)
        self._chunk: tuple | None = None  # the last one, with its position and message indexes
        last = None
        for at, op, body in frames(data, len(MAGIC), end):
            if (op == HEADER) != (last is None) or last == DATA_END:
                raise Contradiction(f"a record of kind {op} at {at}")
            last = op
            self._take(data, at, op, body)
        self._end_chunk()
        if last != DATA_END:
            raise Contradiction("no end of the data")

    def _take(self, data, at, op, body):
        if op not in (CHUNK, MESSAGE_INDEX):
            self._end_chunk()
        length = 9 + len(body)
        if op == CHUNK:
            self._end_chunk()
            chunk = Chunk.read(body)
            self._chunk = chunk, at, length, []
            for inner, content in chunk.records:
                if inner in (SCHEMA, CHANNEL, MESSAGE):
                    self._record(inner, content)
            if any(not chunk.start <= time <= chunk.end for time in chunk.times):
                raise Contradiction("times of a chunk")
        elif op == MESSAGE_INDEX:
            if self._chunk is not None:
                self._chunk[3].append((at, body))
            elif self._strict:
                raise Contradiction("a message index behind no chunk")
        elif op in (SCHEMA, CHANNEL, MESSAGE):
            self._record(op, body)
        elif op == METADATA:
            fields = Fields(body)
            name = fields.text()
            self.metadata.append((name, tuple(fields.pairs(Fields.text, Fields.text))))
            self._lists[METADATA_INDEX].append(struct.pack("<QQ", at, length) + text_field(name))
        elif op == ATTACHMENT:
            self._attachment(at, body)
        elif op == DATA_END:
            stored = Fields(body).number(4)
            if stored not in (0, zlib.crc32(data[:at])):
                raise Contradiction("checksum of the data")
        elif op in (FOOTER, CHUNK_INDEX, ATTACHMENT_INDEX, STATISTICS, METADATA_INDEX, SUMMARY_OFFSET) or op == 0:
            raise Contradiction(f"a record of kind {op} in the data")

    def _record(self, op, body):
        fields = Fields(body)
        number = fields.number(2)
        if op == MESSAGE:
            sequence, log_time, publish_time = (fields.number(size) for size in (4, 8, 8))
            if self._strict and (CHANNEL, number) not in self._described:
                raise Contradiction(f"a message of channel {number}")
            self.messages.append((log_time, number, publish_time, sequence, fields.rest()))
            return
        if op == CHANNEL:
            schema = fields.number(2)
            if self._strict and schema and (SCHEMA, schema) not in self._described:
                raise Contradiction(f"a channel of schema {schema}")
            fields.text(), fields.text(), fields.pairs(Fields.text, Fields.text)
        else:
            fields.text(), fields.text(), fields.text()
            if number == 0:
                raise Contradiction("schema 0")
        if self._described.setdefault((op, number), body) != body:
            raise Contradiction(f"{number} described twice")

    def _attachment(self, at, body):
        fields = Fields(body)
        times = fields.number(8), fields.number(8)
        name, kind = fields.text(), fields.text()
        content = fields.bytes(fields.number(8))
        if fields.number(4) not in (0, zlib.crc32(body[:-4])) or fields.rest():
            raise Contradiction("checksum of an attachment")
        self.attachments.append((name, kind, content))
        self._lists[ATTACHMENT_INDEX].append(
            struct.pack("<QQQQQ", at, 9 + len(body), *times, len(content)) + text_field(name) + text_field(kind)
        )

    def _end_chunk(self):
        if self._chunk is None:
            return
        chunk, at, length, indexes = self._chunk
        self._chunk = None
        if self._strict and indexes and sorted(body for _, body in indexes) != sorted(chunk.message_indexes()):
            raise Contradiction("message indexes of a chunk")
        offsets = tuple(sorted((struct.unpack_from("<H", body)[0], place) for place, body in indexes))
        size = sum(9 + len(body) for _, body in indexes)
        packed = (
            len(COMPRESS[chunk.compression](chunk.data))
            if not chunk.compression
            else length - 9 - 40 - len(chunk.compression)
        )
        self._lists[CHUNK_INDEX].append(
            (chunk.start, chunk.end, at, length, offsets, size, chunk.compression, packed, chunk.size)
        )

    def summary(self) -> dict:
        """What the summary has to say."""
        counts = collections.Counter(message[1] for message in self.messages)
        times = [message[0] for message in self.messages] or [0]
        schemas = [body for (op, _), body in self._described.items() if op == SCHEMA]
        channels = [body for (op, _), body in self._described.items() if op == CHANNEL]
        statistics = (
            len(self.messages),
            0,
            0,
            len(self.attachments),
            len(self.metadata),
            len(self._lists[CHUNK_INDEX]),
            min(times),
            max(times),
            tuple(sorted(counts.items())),
        )
        return {**self._lists, SCHEMA: schemas, CHANNEL: channels, STATISTICS: [statistics]} | {
            op: self._lists[op] for op in (CHUNK_INDEX, METADATA_INDEX, ATTACHMENT_INDEX)
        }

    def meaning(self):
        """All that a reader is told."""
        by_time = sorted((m[0], *m[2:], *self._description(m[1])) for m in self.messages)
        metadata = [
            (name, tuple(pair for pair in pairs if name != b"rosbag2" or pair[0] == b"serialized_metadata"))
            for name, pairs in self.metadata
        ]
        return by_time, metadata, self.attachments

    def _description(self, channel: int) -> tuple[bytes, bytes]:
        """Of a channel and its schema, without their numbers."""
        body = self._described.get((CHANNEL, channel))
        if body is None:
            raise Contradiction(f"a message of channel {channel}")
        schema = struct.unpack_from("<H", body, 2)[0]
        return body[4:], self._described.get((SCHEMA, schema), b"")[2:]

    def check_described(self, op, seen: list[bytes]) -> None:
        """Raises Contradiction if the summary's descriptions lack one that is needed, or differ."""
        by_number = {number: body for (kind, number), body in self._described.items() if kind == op}
        used = {message[1] for message in self.messages}
        if op == SCHEMA:
            channels = {number: body for (kind, number), body in self._described.items() if kind == CHANNEL}
            used = {struct.unpack_from("<H", channels[number], 2)[0] for number in used} - {0}
        found: dict[int, bytes] = {}
        for body in seen:
            number = struct.unpack_from("<H", body)[0]
            if by_number.setdefault(number, body) != body or found.setdefault(number, body) != body:
                raise Contradiction(f"the summary describes {number} differently")
        if seen and used - set(found):
            raise Contradiction(f"the summary lacks a description: {used - set(found)}")


def meaning(data: bytes):
    """What a file means to its readers; None: it contradicts itself before its end."""
    try:
        begin = struct.unpack_from("<Q", data, len(data) - 8 - 20)[0]
        return _Data(data, begin or len(data) - 37, strict=False).meaning()
    except (Contradiction, struct.error):
        return None


# ---------------------------------------------------------------- changes

REPAIRS = ("sizes", "checksums", "times", "index", "counts", "footer")


class Bag:
    """A sound file as lists of records, in which tests change things. repairs: what is made to agree afterwards."""

    def __init__(self, data: bytes):
        begin = struct.unpack_from("<Q", data, len(data) - 8 - 20)[0]
        self.data = [[op, Chunk.read(body) if op == CHUNK else body] for _, op, body in frames(data, 8, begin)]
        self.index = [[op, body] for _, op, body in frames(data, begin, len(data) - 37) if op != SUMMARY_OFFSET]
        self.footer = [begin, 0, struct.unpack_from("<I", data, len(data) - 12)[0]]

    @property
    def chunks(self) -> list[Chunk]:
        return [body for op, body in self.data if op == CHUNK]

    def bytes(self, repairs=REPAIRS) -> bytes:
        for chunk in self.chunks:
            self._repair_chunk(chunk, repairs)
        if "index" in repairs:
            self._rebuild_message_indexes()
        out = bytearray(MAGIC)
        for op, body in self.data:
            out += framed(op, body.body() if op == CHUNK else self._body(op, body, out, repairs))
        begin = len(out)
        try:
            found = _Data(bytes(out), begin).summary()
        except (Contradiction, struct.error):
            found = None  # nothing agrees with it
        for op, body in self._index(found, repairs):
            out += framed(op, body)
        footer = [begin, 0, 0] if "footer" in repairs else list(self.footer)
        out += struct.pack("<BQQQ", FOOTER, 20, *footer[:2])
        out += struct.pack("<I", zlib.crc32(out[begin:]) if "footer" in repairs else footer[2]) + MAGIC
        return bytes(out)

    def _repair_chunk(self, chunk, repairs):
        data = chunk.data
        if "sizes" in repairs:
            chunk.size = len(data)
        if "checksums" in repairs:
            chunk.crc = zlib.crc32(data)
        if "times" in repairs and chunk.times:
            chunk.start, chunk.end = min(chunk.times), max(chunk.times)

    def _rebuild_message_indexes(self):
        rebuilt = []
        for op, body in self.data:
            if op != MESSAGE_INDEX:
                rebuilt.append([op, body])
            if op == CHUNK:
                rebuilt += [[MESSAGE_INDEX, index] for index in body.message_indexes()]
        self.data = rebuilt

    @staticmethod
    def _body(op, body, out, repairs):
        if "checksums" in repairs and op == ATTACHMENT:
            return body[:-4] + struct.pack("<I", zlib.crc32(body[:-4]))
        if "checksums" in repairs and op == DATA_END and any(body):
            return struct.pack("<I", zlib.crc32(out))
        return body

    def _index(self, found, repairs):
        if found is None:
            return self.index
        rebuilt = {op for op, name in ((STATISTICS, "counts"),) if name in repairs}
        if "index" in repairs:
            rebuilt |= {SCHEMA, CHANNEL, CHUNK_INDEX, METADATA_INDEX, ATTACHMENT_INDEX}
        kept = [(op, body) for op, body in self.index if op not in rebuilt]
        return kept + [(op, _written(op, thing)) for op in sorted(rebuilt) for thing in found[op]]


def _written(op, thing):
    if op == STATISTICS:
        *numbers, counts = thing
        body = b"".join(struct.pack("<HQ", *pair) for pair in counts)
        return struct.pack("<QHIIIIQQ", *numbers) + text_field(body)
    if op == CHUNK_INDEX:
        start, end, at, length, offsets, size, compression, packed, unpacked = thing
        body = b"".join(struct.pack("<HQ", *pair) for pair in offsets)
        head = struct.pack("<QQQQ", start, end, at, length) + text_field(body)
        return head + struct.pack("<Q", size) + text_field(compression) + struct.pack("<QQ", packed, unpacked)
    return thing


def _flipped(rng, body: bytes) -> bytes:
    if not body:
        return b"\0"
    changed = bytearray(body)
    for _ in range(rng.choice((1, 1, 1, 2, 5))):
        changed[rng.randrange(len(changed))] ^= 1 << rng.randrange(8)
    return bytes(changed)


def _place(rng, records, *opcodes) -> int:
    return rng.choice([k for k, record in enumerate(records) if not opcodes or record[0] in opcodes])


def _rearrange(rng, records, *opcodes):
    """Swap two records, duplicate, remove or move one."""
    a, b = _place(rng, records, *opcodes), _place(rng, records, *opcodes)
    how = rng.choice(("swap", "duplicate", "remove", "move"))
    if how == "swap":
        records[a], records[b] = records[b], records[a]
    elif how == "duplicate":
        records.insert(b, list(records[a]))
    elif how == "remove":
        del records[a]
    else:
        records.insert(b, records.pop(a))


def flip_in_a_message(rng, bag):
    chunk = rng.choice(bag.chunks)
    at = _place(rng, chunk.records, MESSAGE)
    chunk.records[at] = (MESSAGE, _flipped(rng, chunk.records[at][1]))


def flip_in_a_head_of_a_message(rng, bag):
    chunk = rng.choice(bag.chunks)
    at = _place(rng, chunk.records, MESSAGE)
    body = chunk.records[at][1]
    chunk.records[at] = (MESSAGE, _flipped(rng, body[:22]) + body[22:])


def flip_in_a_description(rng, bag):
    described = [c for c in bag.chunks if any(op != MESSAGE for op, _ in c.records)]
    chunk = rng.choice(described)
    at = _place(rng, chunk.records, SCHEMA, CHANNEL)
    chunk.records[at] = (chunk.records[at][0], _flipped(rng, chunk.records[at][1]))


def rearrange_a_chunk(rng, bag):
    chunk = rng.choice([chunk for chunk in bag.chunks if len(chunk.records) > 1])
    _rearrange(rng, chunk.records)


def move_to_another_chunk(rng, bag):
    one, other = rng.choice(bag.chunks), rng.choice(bag.chunks)
    at = _place(rng, one.records, MESSAGE)
    record = one.records.pop(at)
    other.records.insert(rng.randrange(len(other.records) + 1), record)


def rearrange_the_data(rng, bag):
    _rearrange(rng, bag.data)


def head_of_a_chunk(rng, bag):
    chunk = rng.choice(bag.chunks)
    name = rng.choice(("start", "end", "size", "crc", "compression"))
    if name == "compression":
        chunk.compression = rng.choice(list(COMPRESS))
    else:
        bits = 32 if name == "crc" else 64
        value = getattr(chunk, name)
        new = rng.choice((0, value + 1, value - 1, value ^ (1 << rng.randrange(bits)), 2**bits - 1))
        setattr(chunk, name, new % 2**bits)


def flip_in_metadata(rng, bag):
    at = _place(rng, bag.data, METADATA)
    bag.data[at][1] = _flipped(rng, bag.data[at][1])


def flip_in_the_data(rng, bag):
    at = _place(rng, bag.data, HEADER, MESSAGE_INDEX, ATTACHMENT, METADATA, DATA_END)
    bag.data[at][1] = _flipped(rng, bag.data[at][1])


def flip_in_the_index(rng, bag):
    at = _place(rng, bag.index)
    bag.index[at][1] = _flipped(rng, bag.index[at][1])


def index_of_a_chunk(rng, bag):
    at = _place(rng, bag.index, CHUNK_INDEX)
    fields = list(_chunk_index(bag.index[at][1]))
    k = rng.choice((0, 1, 2, 3, 4, 5, 7, 8))
    if k == 4:
        pairs = [list(pair) for pair in fields[4]]
        rng.choice(pairs)[rng.randrange(2)] += rng.choice((1, 9, 16))
        fields[4] = pairs if rng.random() < 0.7 else pairs[1:]
    else:
        fields[k] = max(0, fields[k] + rng.choice((-1, 1, -9, 1000, 10**9)))
    bag.index[at][1] = _written(CHUNK_INDEX, fields)


def rearrange_the_index(rng, bag):
    _rearrange(rng, bag.index)


def footer(rng, bag):
    at = rng.randrange(3)
    bag.footer[at] ^= 1 << rng.randrange(32)


CHANGES = (
    flip_in_a_message,
    flip_in_a_head_of_a_message,
    flip_in_a_description,
    rearrange_a_chunk,
    move_to_another_chunk,
    rearrange_the_data,
    head_of_a_chunk,
    flip_in_metadata,
    flip_in_the_data,
    flip_in_the_index,
    index_of_a_chunk,
    rearrange_the_index,
    footer,
)


class Bases:
    """Sound recordings as `hpccd record` writes them, each in all compressions."""

    def __init__(self, folder: Path):
        self.files: list[bytes] = []
        write_all(folder)
        for name in ("streams", "everything"):
            for compression in COMPRESSIONS:
                path = folder / f"{name}-{compression}.mcap"
                _as_recorded(folder / f"{name}.mcap", path, compression)
                self.files.append(path.read_bytes())
        self.meanings = [meaning(data) for data in self.files]
        for data in self.files:
            assert contradiction(data) is None, contradiction(data)

    def case(self, number: int) -> tuple[int, str, tuple, bytes]:
        """(base, kind of change, repairs or ("bytes",), bytes of the file)."""
        rng = random.Random(f"corruption/{number}")
        base = rng.randrange(len(self.files))
        if rng.random() < 0.4:
            kind = rng.choice(damage.KINDS)
            data = bytearray(self.files[base])
            kind(rng, data)
            return base, kind.__name__, ("bytes",), bytes(data)
        kind = rng.choice(CHANGES)
        bag = Bag(self.files[base])
        few = tuple(name for name in REPAIRS if rng.random() < 0.8)
        repairs = rng.choice(((), REPAIRS, few, few))
        if kind in (flip_in_the_index, index_of_a_chunk, rearrange_the_index) and rng.random() < 0.8:
            repairs = ("footer",)
        if kind is footer:
            repairs = tuple(name for name in repairs if name != "footer")
        kind(rng, bag)
        return base, kind.__name__, repairs, bag.bytes(repairs)


def _as_recorded(source, target, compression):
    with Recording(source) as recording:
        info, attachments, topics = recording.info, list(recording.attachments.items()), recording.topics
    bag = BagWriter(target, info=info, attachments=attachments, compression=compression, chunk_size=20_000)
    for topic in topics.values():
        bag.add_topic(Topic(topic.name, topic.type_name, []))
    for message in raw_messages(source):
        bag.write(message.topic, message.data, message.log_time, message.publish_time, message.sequence)
    bag.close()


# ---------------------------------------------------------------- verdicts


def run_case(bases: Bases, number: int, folder: Path) -> dict:
    """What doctor and replay say of a case, and the false verdicts in it (texts)."""
    base, kind, repairs, data = bases.case(number)
    path, table, steps = (folder / name for name in ("in.mcap", "x.json", "x.csv"))
    path.write_bytes(data)
    problems = []
    why = contradiction(data)
    changed = meaning(data) != bases.meanings[base]
    forged = bool(set(repairs) & {"checksums", "counts", "index", "footer"})
    sound = examine(path).sound
    if sound and why is not None:
        problems.append(f"doctor says sound: {why}")
    if sound and changed and not forged:
        problems.append("doctor says sound: the meaning has changed, and no checksum was repaired")
    table.unlink(missing_ok=True)
    steps.unlink(missing_ok=True)
    done = hpccd("replay", path, "--json", table, "--csv", steps, "--backend", "cpu", "--threads", 1)
    if done.traceback:
        problems.append(done.traceback)
    result = json.loads(table.read_text())[0]["result"] if table.exists() else "unusable"
    if result == "VERIFIED" and data != bases.files[base]:
        if why is not None and changed:
            problems.append(f"replay verifies: {why}")
        if changed and not forged:
            problems.append("replay verifies: the meaning has changed, and no checksum was repaired")
        if changed:
            row = json.loads(table.read_text())[0]
            problems += recording_oracle.lies(path, row, steps, done.out)
    return {
        "number": number,
        "base": base,
        "kind": kind,
        "repairs": "+".join(repairs),
        "sound": sound,
        "result": result,
        "changed": changed,
        "contradiction": why,
        "problems": problems,
    }


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=10_000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--only", type=int)
    args = parser.parse_args()
    counts = collections.Counter()
    false = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        bases = Bases(folder)
        numbers = [args.only] if args.only is not None else range(args.first, args.first + args.cases)
        for number in numbers:
            result = run_case(bases, number, folder)
            counts[result["result"], "changed" if result["changed"] else "same", result["sound"]] += 1
            false += bool(result["problems"])
            if result["problems"] or args.only is not None:
                print(json.dumps(result), flush=True)
    for (result, changed, sound), count in sorted(counts.items()):
        print(f"{count:7} replay {result}, doctor {'sound' if sound else 'damaged'}, meaning {changed}")
    print(f"{sum(counts.values())} cases, {false} with a false verdict")
    return 1 if false else 0


if __name__ == "__main__":
    sys.exit(main())
