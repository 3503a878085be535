# SPDX-License-Identifier: Apache-2.0
"""Mutations of MCAP files that know records, and repair lengths, checksums and the index: otherwise nearly every input
would end at the first checksum.
"""

import json
import struct
import zlib
from dataclasses import dataclass, field
from random import Random

import lz4.frame
import zstandard

from .cdr_mutations import with_number
from .json_mutations import changed_json
from .mutations import NUMBERS, Mutate

MAGIC = b"\x89MCAP0\r\n"
(HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX, ATTACHMENT, ATTACHMENT_INDEX, STATISTICS,
 METADATA, METADATA_INDEX, SUMMARY_OFFSET, DATA_END) = range(1, 16)  # fmt: skip
# Fields of each record: numbers as in `struct`, "s" a text, "d" bytes with a length of 4 bytes (maps too), "D" with one
# of 8, "r" the rest.
_FIELDS = {
    HEADER: "ss", FOOTER: "QQI", SCHEMA: "Hssd", CHANNEL: "HHssd", MESSAGE: "HIQQr", CHUNK: "QQQIsD",
    MESSAGE_INDEX: "Hd", CHUNK_INDEX: "QQQQdQsQQ", ATTACHMENT: "QQssDI", ATTACHMENT_INDEX: "QQQQQss",
    STATISTICS: "QHIIIIQQd", METADATA: "sd", METADATA_INDEX: "QQs", SUMMARY_OFFSET: "BQQ", DATA_END: "I",
}  # fmt: skip
_LENGTHS = {"s": "I", "d": "I", "D": "Q"}
_COMPRESS = {b"": bytes, b"lz4": lz4.frame.compress, b"zstd": zstandard.compress}
_UNPACK = {b"": bytes, b"lz4": lz4.frame.decompress, b"zstd": zstandard.ZstdDecompressor().decompress}
# Most bytes that a chunk is unpacked to here.
_MOST = 1 << 20


@dataclass
class Record:
    """``fields``: empty: it is ``body`` instead. ``inner``: records of a chunk, which its data are made of."""

    opcode: int
    fields: list
    body: bytes = b""
    inner: "list[Record]" = field(default_factory=list)

    @classmethod
    def of(cls, opcode: int, body: bytes) -> "Record":
        try:
            record = cls(opcode, _decoded(_FIELDS[opcode], body))
        except (KeyError, struct.error, ValueError):
            return cls(opcode, [], body)
        if opcode == CHUNK and len(record.fields[5]) <= _MOST:
            try:
                if record.fields[2] <= _MOST:
                    record.inner = records(_UNPACK[record.fields[4]](record.fields[5]))[0]
            except (KeyError, RuntimeError, zstandard.ZstdError):
                pass
        return record

    def bytes(self) -> bytes:
        body = _encoded(_FIELDS[self.opcode], self.fields) if self.fields else self.body
        return struct.pack("<BQ", self.opcode, len(body)) + body

    def copy(self) -> "Record":
        return Record(self.opcode, list(self.fields), self.body, [record.copy() for record in self.inner])


def _decoded(layout: str, body: bytes) -> list:
    found, at = [], 0
    for code in layout:
        if code == "r":
            found.append(body[at:])
            at = len(body)
            continue
        number = f"<{_LENGTHS.get(code, code)}"
        value = struct.unpack_from(number, body, at)[0]
        at += struct.calcsize(number)
        if code in _LENGTHS:
            if at + value > len(body):
                raise ValueError
            value, at = body[at : at + value], at + value
        found.append(value)
    if at != len(body):
        raise ValueError
    return found


def _encoded(layout: str, fields: list) -> bytes:
    parts = []
    for code, value in zip(layout, fields, strict=True):
        if code == "r":
            parts.append(value)
        elif code in _LENGTHS:
            parts.append(struct.pack(f"<{_LENGTHS[code]}", len(value)) + value)
        else:
            parts.append(struct.pack(f"<{code}", value % 256 ** struct.calcsize(f"<{code}")))
    return b"".join(parts)


def records(data: bytes) -> tuple[list[Record], bytes]:
    """Complete records, and the bytes after them."""
    found, at = [], 0
    while at + 9 <= len(data):
        opcode, length = struct.unpack_from("<BQ", data, at)
        if at + 9 + length > len(data):
            break
        found.append(Record.of(opcode, data[at + 9 : at + 9 + length]))
        at += 9 + length
        if opcode == FOOTER:
            break
    return found, data[at:]


def mutate_file(rng: Random, data: bytes, mutate: Mutate) -> bytes:
    """A changed MCAP file. One in ten is changed anywhere, and not repaired."""
    if not data.startswith(MAGIC) or rng.random() < 0.1:
        return mutate(data, len(data) + 100)
    found, rest = records(data[len(MAGIC) :])
    if not found:
        return mutate(data, len(data) + 100)
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        _change(rng, found, mutate)
    # Sometimes one repair is left out.
    lacking = rng.choice(("chunks", "crc", "index", "footer")) if rng.random() < 0.1 else ""
    out = _repaired(found, lacking) + (rest if rest.startswith(MAGIC[:2]) else MAGIC)
    return out[: rng.randrange(len(out))] if rng.random() < 0.03 else out


def _change(rng: Random, found: list[Record], mutate: Mutate) -> None:
    chunks = [record.inner for record in found if record.inner]
    group = rng.choice(chunks) if chunks and rng.random() < 0.6 else found
    at = rng.randrange(len(group))
    match rng.choice(("field", "field", "field", "field", "repeat", "drop", "swap", "move", "end")):
        case "field":
            _change_field(rng, group[at], mutate)
        case "repeat":
            group.insert(rng.randrange(len(group) + 1), group[at].copy())
        case "drop" if len(group) > 1:
            del group[at]
        case "swap":
            other = rng.randrange(len(group))
            group[at], group[other] = group[other], group[at]
        case "move":  # into a chunk, or out of one
            other = rng.choice([found, *chunks])
            other.insert(rng.randrange(len(other) + 1), group[at].copy())
        case _:
            del found[rng.randrange(len(found)) + 1 :]


def _change_field(rng: Random, record: Record, mutate: Mutate) -> None:
    if not record.fields:
        record.body = mutate(record.body, len(record.body) + 100)
        return
    at = rng.randrange(len(record.fields))
    value, code = record.fields[at], _FIELDS[record.opcode][at]
    if isinstance(value, int):
        record.fields[at] = rng.choice((*NUMBERS, value + 1, value - 1, value ^ 1, value + 10**9, 10**18))
    elif record.opcode == CHUNK:
        record.fields[4] = rng.choice((b"", b"lz4", b"zstd", b"zstd", b"none"))
    elif record.opcode == METADATA and code == "d":
        record.fields[at] = _change_map(rng, value, mutate)
    elif code == "r" and rng.random() < 0.5:
        record.fields[at] = with_number(rng, value)
    else:
        record.fields[at] = mutate(value, len(value) + 100)


def _change_map(rng: Random, data: bytes, mutate: Mutate) -> bytes:
    """Of texts; JSON in one is changed as such."""
    try:
        key, *values = _texts(data)
        tree = json.loads(values[0])
    except (ValueError, struct.error, RecursionError, IndexError):
        return mutate(data, len(data) + 100)
    if rng.random() < 0.3:
        values[0] = mutate(values[0], len(values[0]) + 100)
    else:
        values[0] = json.dumps(changed_json(rng, tree)).encode("utf-8", "replace")
    return b"".join(struct.pack("<I", len(text)) + text for text in (key, *values))


def _texts(data: bytes) -> list[bytes]:
    found, at = [], 0
    while at < len(data):
        length = struct.unpack_from("<I", data, at)[0]
        found.append(data[at + 4 : at + 4 + length])
        at += 4 + length
    return found


def _repaired(found: list[Record], lacking: str) -> bytes:
    """The file before its last magic, with fitting checksums, chunks, index and footer."""
    out = bytearray(MAGIC)
    places: dict[int, list[tuple[int, int, Record]]] = {CHUNK: [], ATTACHMENT: [], METADATA: []}
    summary = len(out)
    for record in found:
        if record.opcode == CHUNK and record.fields and record.inner and lacking != "chunks":
            _pack(record)
        if record.opcode == ATTACHMENT and record.fields and lacking != "crc":
            record.fields[5] = zlib.crc32(record.bytes()[9:-4])
        if record.opcode == DATA_END and record.fields and lacking != "crc":
            record.fields[0] = zlib.crc32(out)
        if lacking != "index":
            _index(record, places)
        if record.opcode == FOOTER and record.fields and lacking != "footer":
            record.fields[0] = summary if summary < len(out) else 0
            record.fields[2] = zlib.crc32(bytes(out[summary:]) + record.bytes()[:-4])
        raw = record.bytes()
        if record.opcode in places:
            places[record.opcode].append((len(out), len(raw), record))
        out += raw
        if record.opcode == DATA_END:
            summary = len(out)
    return bytes(out)


def _pack(chunk: Record) -> None:
    content = b"".join(record.bytes() for record in chunk.inner)
    times = [record.fields[2] for record in chunk.inner if record.opcode == MESSAGE and record.fields]
    if times:
        chunk.fields[:2] = min(times), max(times)
    chunk.fields[2:4] = len(content), zlib.crc32(content)
    chunk.fields[5] = _COMPRESS.get(chunk.fields[4], bytes)(content)


def _index(record: Record, places) -> None:
    """Let an index name the next record of its kind."""
    if not record.fields:
        return
    if record.opcode == CHUNK_INDEX and places[CHUNK]:
        at, length, chunk = places[CHUNK].pop(0)
        if chunk.fields:
            sizes = len(chunk.fields[5]), chunk.fields[2]
            record.fields[:4] = chunk.fields[0], chunk.fields[1], at, length
            record.fields[6:] = chunk.fields[4], *sizes
    elif record.opcode == ATTACHMENT_INDEX and places[ATTACHMENT]:
        at, length, attachment = places[ATTACHMENT].pop(0)
        if attachment.fields:
            log, create, name, media, data, _ = attachment.fields
            record.fields = [at, length, log, create, len(data), name, media]
    elif record.opcode == METADATA_INDEX and places[METADATA]:
        at, length, metadata = places[METADATA].pop(0)
        record.fields[:2] = at, length
        if metadata.fields:
            record.fields[2] = metadata.fields[0]
