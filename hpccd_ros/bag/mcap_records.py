# SPDX-License-Identifier: Apache-2.0
"""The records of an MCAP file, parsed so that no length or size is trusted before it is checked.

The reader of the library `mcap` trusts them: it reads into the next record if a length is too large, accepts partial
data at the end of the file, and unpacks a chunk to any size.
"""

import contextlib
import dataclasses
import struct
import zlib
from collections import defaultdict
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import BinaryIO, NamedTuple

import lz4.frame
import zstandard
from mcap import records as known
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile, McapError, UnsupportedCompressionError
from mcap.opcode import Opcode
from mcap.stream_reader import CRCValidationError
from mcap.writer import MCAP0_MAGIC

from hpccd_ros.bag import metadata_checksum

# Errors from reading truncated or flipped bytes: the above, decompressors (lz4: RuntimeError), text that is not UTF-8
# (a ValueError), a disk that cannot be read.
DAMAGE = (
    McapError,
    CRCValidationError,
    struct.error,
    zstandard.ZstdError,
    RuntimeError,
    ValueError,
    OSError,
    MemoryError,
)

# Recorders close a chunk after about a megabyte, or after one message; no DDS message is as large as this.
MOST_UNPACKED = 1 << 30
# A chunk of a megabyte has 34,000 of the smallest messages. Each costs a reader ten times its bytes.
MOST_RECORDS = 1 << 20

# First bytes of messages of `ros2 bag record --compression-mode message`. No CDR begins with them.
ZSTD = b"\x28\xb5\x2f\xfd"

_HEAD = struct.Struct("<BQ")
_MESSAGE = struct.Struct("<HIQQ")
_INDEX_HEAD, _INDEX_ENTRY = struct.Struct("<HI"), struct.Struct("<QQ")
_CHUNK_HEAD, _CHUNK_SIZE = struct.Struct("<QQQII"), struct.Struct("<Q")
_KINDS = {
    Opcode.HEADER: known.Header,
    Opcode.FOOTER: known.Footer,
    Opcode.SCHEMA: known.Schema,
    Opcode.CHANNEL: known.Channel,
    Opcode.CHUNK: known.Chunk,
    Opcode.CHUNK_INDEX: known.ChunkIndex,
    Opcode.ATTACHMENT: known.Attachment,
    Opcode.ATTACHMENT_INDEX: known.AttachmentIndex,
    Opcode.STATISTICS: known.Statistics,
    Opcode.METADATA: known.Metadata,
    Opcode.METADATA_INDEX: known.MetadataIndex,
    Opcode.DATA_END: known.DataEnd,
}


class Place(NamedTuple):
    """Position of a complete record in a file. content: what an index repeats of it."""

    opcode: int
    at: int
    length: int
    content: tuple = ()


class Raw(NamedTuple):
    """A complete record that is not parsed yet. at: its position in the file."""

    opcode: int
    at: int
    body: bytes

    @property
    def place(self) -> Place:
        return Place(self.opcode, self.at, _HEAD.size + len(self.body), _content(self))


@contextlib.contextmanager
def opened(path: Path) -> Iterator[BinaryIO]:
    """A file to read. Raises OSError if it cannot be opened; errors of closing it mean nothing."""
    stream = open(path, "rb")
    try:
        yield stream
    finally:
        with contextlib.suppress(OSError):
            stream.close()


def records(stream, begin: int, end: int) -> Iterator[Raw]:
    """The records between two positions of a file. Raises EndOfFile if one does not end within."""
    stream.seek(begin)
    at = begin
    while at < end:
        head = stream.read(_HEAD.size)
        if len(head) < _HEAD.size:
            raise EndOfFile(f"the file ends within a record at byte {at:,}")
        opcode, length = _HEAD.unpack(head)
        left = end - at - _HEAD.size
        body = stream.read(length) if length <= left else b""
        if len(body) < length:
            raise EndOfFile(f"the record at byte {at:,} has {length:,} bytes, {max(left, 0):,} are left")
        yield Raw(opcode, at, body)
        at += _HEAD.size + length


def data_section(stream, size: int) -> Iterator[Raw]:
    """The records of a file of `size` bytes up to and including its DataEnd, whose checksum is verified.

    Raises the errors in DAMAGE.
    """
    stream.seek(0)
    if (magic := stream.read(len(MCAP0_MAGIC))) != MCAP0_MAGIC:
        raise McapError(f"the file begins with {magic!r}")
    check_sum = zlib.crc32(magic)
    for raw in records(stream, len(magic), size):
        if raw.opcode == Opcode.FOOTER:
            raise McapError(f"a footer at byte {raw.at:,}, before the end of the data")
        if raw.opcode == Opcode.DATA_END:
            end = parse(raw)
            if end.data_section_crc not in (0, check_sum):
                raise CRCValidationError(end.data_section_crc, check_sum, end)
            yield raw
            return
        check_sum = zlib.crc32(raw.body, zlib.crc32(_HEAD.pack(raw.opcode, len(raw.body)), check_sum))
        yield raw
    raise EndOfFile("the data has no end")


def parse(raw: Raw) -> known.McapRecord | None:
    """The record, or None if its kind is not needed here. Raises the errors in DAMAGE."""
    if raw.opcode == Opcode.MESSAGE:
        return _message(raw.body)
    if raw.opcode == Opcode.MESSAGE_INDEX:
        _check_message_index(raw.body)
    kind = _KINDS.get(raw.opcode)
    if kind is None:
        return None
    record = kind.read(_Whole(raw.body))
    if isinstance(record, known.Metadata):
        metadata_checksum.check(record)
    if isinstance(record, known.Attachment):
        # All except its own four bytes, which the library skips.
        stored, found = int.from_bytes(raw.body[-4:], "little"), zlib.crc32(raw.body[:-4])
        if stored not in (0, found):
            raise CRCValidationError(stored, found, record)
    return record


def inside(
    chunk: known.Chunk, places: defaultdict[int, list[tuple[int, int]]] | None = None
) -> Iterator[known.Schema | known.Channel | known.Message]:
    """The records of a chunk, whose checksum is verified. Raises the errors in DAMAGE.

    places: gets what indexes of its messages contain, as from `message_index`.
    """
    data = memoryview(_unpacked(chunk))
    at = 0
    for _ in range(MOST_RECORDS):
        if at == len(data):
            return
        opcode, length = _HEAD.unpack_from(data, at)
        at += _HEAD.size
        if length > len(data) - at:
            raise EndOfFile(f"a record of {length:,} bytes in a chunk with {len(data) - at:,} left")
        if opcode in (Opcode.MESSAGE, Opcode.SCHEMA, Opcode.CHANNEL):
            record = parse(Raw(opcode, 0, bytes(data[at : at + length])))
            if places is not None and opcode == Opcode.MESSAGE:
                places[record.channel_id].append((record.log_time, at - _HEAD.size))
            yield record
        at += length
    raise McapError(f"a chunk of more than {MOST_RECORDS:,} records")


def within_chunk_times(chunk: known.Chunk, record: known.McapRecord) -> bool:
    """Whether a record is within the times of its chunk, by which chunks are ordered."""
    inner = isinstance(record, known.Message)
    return not inner or chunk.message_start_time <= record.log_time <= chunk.message_end_time


def unpacked_message(channel: known.Channel, message: known.Message) -> known.Message:
    """The data of a ROS 2 message as it was sent; other messages as they are stored. Raises the errors in DAMAGE."""
    if channel.message_encoding != "cdr" or not message.data.startswith(ZSTD):
        return message
    size = zstandard.frame_content_size(message.data)
    if not 0 <= size <= MOST_UNPACKED:
        raise McapError(f"a compressed message of {size:,} bytes; the limit is {MOST_UNPACKED:,}")
    data = zstandard.ZstdDecompressor().decompress(message.data, max_output_size=size + 1)
    if len(data) != size:
        raise McapError(f"a compressed message of {size:,} bytes unpacks to {len(data):,}")
    return dataclasses.replace(message, data=data)


def _unpacked(chunk) -> bytes:
    size = chunk.uncompressed_size
    if size > MOST_UNPACKED:
        raise McapError(f"a chunk of {size:,} bytes, more than {MOST_UNPACKED:,}")
    # One byte more than declared is enough to find that it is wrong.
    if chunk.compression == "zstd":
        if zstandard.frame_content_size(chunk.data) > size:
            raise McapError(f"a chunk of {size:,} bytes unpacks to more")
        # In one piece: a stream does not notice that the end is missing, and other readers reject it.
        data = zstandard.ZstdDecompressor().decompress(chunk.data, max_output_size=size + 1)
    elif chunk.compression == "lz4":
        decompressor = lz4.frame.LZ4FrameDecompressor()
        data = decompressor.decompress(chunk.data, max_length=size + 1)
        if len(data) == size and not decompressor.eof:
            raise McapError("a chunk whose compressed data has no end")
    elif chunk.compression == "":
        data = chunk.data
    else:
        raise UnsupportedCompressionError(chunk.compression[:20])
    if len(data) != size:
        raise McapError(f"a chunk of {size:,} bytes unpacks to {'more' if len(data) > size else f'{len(data):,}'}")
    if chunk.uncompressed_crc not in (0, found := zlib.crc32(data)):
        raise CRCValidationError(chunk.uncompressed_crc, found, chunk)
    return data


def _content(raw: Raw) -> tuple:
    """What an index repeats of a record: of a chunk its times, sizes and compression."""
    body = raw.body
    try:
        if raw.opcode == Opcode.CHUNK:
            start, end, size, _, length = _CHUNK_HEAD.unpack_from(body)
            (packed,) = _CHUNK_SIZE.unpack_from(body, _CHUNK_HEAD.size + length)
            return start, end, str(body[_CHUNK_HEAD.size :][:length], "utf-8"), packed, size
        if raw.opcode == Opcode.MESSAGE_INDEX:
            return (_INDEX_HEAD.unpack_from(body)[0],)
        if raw.opcode == Opcode.METADATA:
            return (_Whole(body).read_prefixed_string(),)
        if raw.opcode == Opcode.ATTACHMENT:
            stream = _Whole(body)
            times = stream.read8(), stream.read8()
            return (*times, stream.read_prefixed_string(), stream.read_prefixed_string(), stream.read8())
    except DAMAGE:
        pass  # `parse` raises it
    return ()


def message_index(raw: Raw) -> tuple[int, list[tuple[int, int]]]:
    """(channel, [(log time, position in the chunk)]) of an index of messages. Raises the errors in DAMAGE."""
    _check_message_index(raw.body)
    channel, size = _INDEX_HEAD.unpack_from(raw.body)
    return channel, list(_INDEX_ENTRY.iter_unpack(raw.body[_INDEX_HEAD.size :][:size]))


def _check_message_index(body: bytes) -> None:
    # Not needed here, but other readers fail on an incomplete one.
    entries = _INDEX_HEAD.unpack_from(body)[1]
    if entries % _INDEX_ENTRY.size or entries > len(body) - _INDEX_HEAD.size:
        raise EndOfFile(f"an index of messages of {entries:,} bytes, {len(body) - _INDEX_HEAD.size:,} are left")


def _message(body: bytes) -> known.Message:
    channel_id, sequence, log_time, publish_time = _MESSAGE.unpack_from(body)
    return known.Message(channel_id, log_time, body[_MESSAGE.size :], publish_time, sequence)


class _Whole(ReadDataStream):
    """A stream that raises at the end of the data; that of the library returns partial data."""

    def __init__(self, body: bytes):
        super().__init__(BytesIO(body))
        self._size = len(body)

    def read(self, length: int) -> bytes:
        if length > self._size - self.count:
            raise EndOfFile(f"a field of {length:,} bytes, {self._size - self.count:,} are left")
        return super().read(length)
