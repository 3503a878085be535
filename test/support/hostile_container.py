# SPDX-License-Identifier: Apache-2.0
"""The records around the messages: chunks, index, footer."""

import dataclasses
import struct

import zstandard
from hostile_kinds import LARGE, kind
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    Message,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
)
from mcap_model import COMPRESS, as_bytes, raw_record


def zeros(compression, size):
    """A small piece of data that unpacks to `size` zeros."""
    if compression == "zstd":
        packer = zstandard.ZstdCompressor(level=1).compressobj(size=size)
        return b"".join([*(packer.compress(bytes(1 << 22)) for _ in range(size >> 22)), packer.flush()])
    return COMPRESS[compression](bytes(size))


BOMB = 1 << 28


@kind
def bomb(rng, bag):
    """A chunk that unpacks to more than its header says, or whose header says more than there is memory."""
    compression = rng.choice(("zstd", "lz4"))
    data = zeros(compression, BOMB)
    says = rng.choice((0, 1000, BOMB, 2**33, 2**63, 2**64 - 1))
    which = iter(range(100))
    target = rng.randrange(3)

    def change(chunk):
        if next(which) != target:
            return chunk
        # Without a check sum, as the format allows: nothing else would stop it.
        return dataclasses.replace(
            chunk, compression=compression, data=data, uncompressed_size=says, uncompressed_crc=0
        )

    bag.chunk = change


@kind
def chunk_lies(rng, bag):
    which, target = iter(range(1000)), rng.randrange(3)
    name, value = rng.choice(
        (
            ("uncompressed_size", rng.choice(LARGE)),
            ("uncompressed_crc", rng.choice((0, 1))),
            ("message_start_time", rng.choice(LARGE)),
            ("message_end_time", rng.choice(LARGE)),
            ("compression", rng.choice(("", "lz4", "zstd", "LZ4", "gzip", "x" * 1000))),
            ("data", rng.choice((b"", b"\0" * 100, rng.randbytes(1000)))),
        )
    )
    bag.chunk = lambda chunk: dataclasses.replace(chunk, **{name: value}) if next(which) == target else chunk


@kind
def chunk_without_check_sum(rng, bag):
    """Flipped bytes in a chunk without a checksum: only the content can reveal them."""

    def change(chunk):
        if chunk.compression:
            return chunk
        data = bytearray(chunk.data)
        data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
        return dataclasses.replace(chunk, data=bytes(data), uncompressed_crc=0)

    bag.compression = ""
    bag.chunk = change


@kind
def records_inside_a_chunk(rng, bag):
    number = rng.choice(bag.channels).id
    head = struct.pack("<HIQQ", number, 0, 10**18, 10**18)
    strange = rng.choice(
        (
            raw_record(0x7F, b"x" * 10),
            raw_record(0xFF, b""),
            raw_record(0, b""),
            raw_record(Opcode.MESSAGE, head[:10]),
            raw_record(Opcode.MESSAGE, b""),
            raw_record(Opcode.MESSAGE, head),
            raw_record(Opcode.MESSAGE, head, 2**63),
            raw_record(Opcode.MESSAGE, head, 2**64 - 1),
            raw_record(Opcode.MESSAGE, head, 21),
            raw_record(Opcode.CHANNEL, b"\1\0"),
            raw_record(Opcode.CHANNEL, struct.pack("<HHI", 1, 1, 2**32 - 1)),
            raw_record(Opcode.SCHEMA, b""),
            raw_record(Opcode.SCHEMA, rng.randbytes(40)),
            as_bytes(Footer(0, 0, 0)),
            as_bytes(DataEnd(0)),
            as_bytes(Header("ros2", "x")),
            as_bytes(Metadata("hpccd", {"json": "{}"})),
            as_bytes(Chunk("", b"", 0, 0, 0, 0)),
            b"\5",
            b"",
            as_bytes(Channel(number, "/x", "cdr", {}, 1)),
            as_bytes(Channel(99, "/x", "cdr", {}, 99)),
            as_bytes(Schema(1, b"x", "ros2msg", "x/msg/X")),
            as_bytes(Message(number, 10**18, b"", 0, 0)),
            as_bytes(Message(12345, 10**18, b"abcd", 0, 0)),
        )
    )
    at = rng.random()
    bag.inside = lambda records: [*records[: int(at * len(records))], strange, *records[int(at * len(records)) :]]


@kind
def many_records(rng, bag):
    """Very many of the smallest records: each costs a reader more than its bytes."""
    strange = rng.choice(
        (
            raw_record(0x7F, b"") * 300_000,
            as_bytes(Message(bag.channels[0].id, 10**18, b"", 0, 0)) * 200_000,
            b"".join(as_bytes(Channel(k, f"/t{k}", "cdr", {}, 1)) for k in range(100, 5000)),
        )
    )
    done = []
    bag.inside = lambda records: records if done else [*records, done.append(1) or strange]


@kind
def records_of_the_data(rng, bag):
    strange = rng.choice(
        (
            raw_record(0x7F, b"x"),
            raw_record(0, b""),
            raw_record(Opcode.CHUNK, b""),
            raw_record(Opcode.CHUNK, b"", 2**64 - 1),
            raw_record(0x99, b"", 2**40),
            as_bytes(Header("ros2", "again")),
            as_bytes(Header("ros1", "")),
            as_bytes(DataEnd(0)),
            as_bytes(Footer(0, 0, 0)),
            as_bytes(Footer(8, 0, 0)),
            raw_record(Opcode.METADATA, struct.pack("<I", 2**32 - 1)),
            raw_record(Opcode.METADATA, struct.pack("<II", 0, 2**32 - 1)),
            raw_record(Opcode.MESSAGE_INDEX, struct.pack("<HI", 1, 2**32 - 1)),
            raw_record(Opcode.MESSAGE, b""),
            raw_record(Opcode.MESSAGE, b"\1"),
            raw_record(Opcode.STATISTICS, b""),
            as_bytes(Message(1, 0, b"", 0, 0)),
            as_bytes(Schema(0, b"", "", "")),
            as_bytes(Channel(1, "/x", "cdr", {}, 1)),
            raw_record(Opcode.ATTACHMENT, b"x" * 50),
            raw_record(Opcode.HEADER, b"\xff" * 20),
        )
    )
    at = rng.random()

    def change(records):
        place = int(at * (len(records) + 1))
        return [*records[:place], strange, *records[place:]]

    bag.data = change


@kind
def file_without_its_header(rng, bag):
    bag.data = rng.choice(
        (lambda records: records[1:], lambda records: [], lambda records: records[:1], lambda records: records[::-1])
    )


@kind
def chunks_reordered(rng, bag):
    def change(records):
        places = [k for k, record in enumerate(records) if isinstance(record, Chunk)]
        mixed = rng.sample(places, len(places))
        out = list(records)
        for place, other in zip(places, mixed, strict=True):
            out[place] = records[other]
        if rng.random() < 0.4:
            out.insert(rng.choice(places), records[rng.choice(places)])
        return out

    bag.data = change


@kind
def index_lies(rng, bag):
    def change(records):
        out = [dataclasses.replace(record) for record in records]
        chosen = rng.choice([r for r in out if isinstance(r, ChunkIndex)])
        how = rng.randrange(8)
        if how == 0:
            chosen.chunk_start_offset = rng.choice((*LARGE, rng.randrange(100_000)))
        elif how == 1:
            chosen.chunk_length = rng.choice(LARGE)
        elif how == 2:
            chosen.message_start_time = rng.choice(LARGE)
        elif how == 3:
            chosen.message_index_offsets = {rng.choice((1, 2, 3, 99)): rng.choice(LARGE)}
        elif how == 4:
            out = [r for r in out if r is not chosen]
        elif how == 5:
            out.append(chosen)
        elif how == 6:
            other = rng.choice([r for r in out if isinstance(r, ChunkIndex)])
            chosen.chunk_start_offset = other.chunk_start_offset
        else:
            out = [r for r in out if not isinstance(r, ChunkIndex)]
        return out

    bag.index = change


@kind
def index_of_other_topics(rng, bag):
    """The index has other topics, types or numbers than the data."""

    def change(records):
        out = [dataclasses.replace(record) for record in records]
        channels = [r for r in out if isinstance(r, Channel)]
        one, two = rng.sample(channels, 2)
        how = rng.randrange(6)
        if how == 0:
            one.topic, two.topic = two.topic, one.topic
        elif how == 1:
            one.id, two.id = two.id, one.id
        elif how == 2:
            one.topic = "/other"
        elif how == 3:
            out = [r for r in out if r is not one]
        elif how == 4:
            out = [r for r in out if not isinstance(r, Schema)]
        else:
            one.schema_id = two.schema_id
        return out

    bag.index = change


@kind
def statistics_lie(rng, bag):
    def change(records):
        out = []
        for record in records:
            if isinstance(record, Statistics):
                counts = dict(record.channel_message_counts)
                counts[rng.choice(list(counts))] = rng.choice(LARGE)
                record = rng.choice(
                    (
                        dataclasses.replace(record, channel_message_counts=counts),
                        dataclasses.replace(record, channel_message_counts={}),
                        dataclasses.replace(record, message_count=rng.choice(LARGE)),
                        None,
                        dataclasses.replace(record, message_start_time=2**64 - 1, message_end_time=0),
                    )
                )
            out += [record] if record is not None else []
        return out

    bag.index = change


@kind
def places_of_the_index(rng, bag):
    def change(records):
        out = [dataclasses.replace(record) for record in records]
        for record in out:
            if isinstance(record, MetadataIndex) or hasattr(record, "media_type"):
                record.offset = rng.choice((*LARGE, 17, rng.randrange(50_000)))
        return out

    bag.index = change


@kind
def strange_records_in_the_index(rng, bag):
    strange = rng.choice(
        (
            raw_record(0x7F, b"x"),
            raw_record(Opcode.CHUNK_INDEX, b""),
            raw_record(Opcode.STATISTICS, b"\0" * 20),
            raw_record(Opcode.CHANNEL, b"", 2**40),
            as_bytes(Footer(0, 0, 0)),
            as_bytes(DataEnd(0)),
            raw_record(Opcode.CHUNK_INDEX, bytes(32) + struct.pack("<I", 2**32 - 1)),
            as_bytes(Message(1, 0, b"x", 0, 0)),
            raw_record(Opcode.STATISTICS, bytes(42) + struct.pack("<I", 2**32 - 1)),
        )
    )
    bag.index = lambda records: [*records, strange] if rng.random() < 0.5 else [strange, *records]


@kind
def footer_lies(rng, bag):
    def change(footer):
        name = rng.choice(("summary_start", "summary_start", "summary_offset_start", "summary_crc"))
        old = getattr(footer, name)
        return dataclasses.replace(
            footer, **{name: rng.choice((*LARGE[:5], max(0, old - 1), old + 1, old + 9, 8, 2**32 - 1))}
        )

    bag.footer = change


@kind
def end_of_the_file(rng, bag):
    bag.end = rng.choice(
        (
            lambda data: data[:-8],
            lambda data: data + data[-8:],
            lambda data: data[:-37],
            lambda data: data + bytes(1000),
            lambda data: data[:8],
            lambda data: data[:8] + data[:8],
            lambda data: data[:8] + data,
            lambda data: data + data,
            lambda data: data[:-8] + bytes(8),
            lambda data: data[:8] + data[-37:],
            lambda data: data[:8] + bytes(29) + data[-8:],
        )
    )
