# SPDX-License-Identifier: Apache-2.0
"""Sizes of the chunks of an MCAP file, before the library ``mcap`` unpacks them to whatever size they claim."""

import importlib
import os
import struct
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from .sequence import SequenceError

# Bytes. Recorders close a chunk after about a megabyte, or after one message.
MOST_UNPACKED = 1 << 30
_CHUNK = 6  # opcode
_RECORD = struct.Struct("<BQ")
_HEAD = struct.Struct("<QQQII")  # first and last time, unpacked size, checksum, length of the name of the compression
_LONGEST_HEAD = 100  # with the name, the packed size, and the header of a zstd or lz4 frame of at most 19 bytes


def check_chunks(path: Path, indexed: Iterable[int]) -> None:
    """Check the size of each chunk. indexed: where they begin, as the index has it; none: they are searched.

    Raises
    ------
    SequenceError
        A chunk declares more than MOST_UNPACKED bytes, or its compressed data more than the chunk.

    Notes
    -----
    Frames of lz4 need not tell their size; such a chunk unpacks to at most 255 times its bytes in the file.
    """
    with open(path, "rb") as file:
        for at in list(indexed) or _chunks(file.fileno()):
            head = os.pread(file.fileno(), _LONGEST_HEAD, at + _RECORD.size)
            if len(head) < _LONGEST_HEAD:
                continue  # the file ends here
            _, _, size, _, length = _HEAD.unpack_from(head)
            name, frame = head[_HEAD.size :][:length], head[_HEAD.size + length + 8 :]
            if max(size, _size_in(name, frame)) > MOST_UNPACKED:
                raise SequenceError(
                    f"{path}: has a chunk of more than {MOST_UNPACKED:,} bytes; record it in smaller chunks"
                )


def _chunks(file: int) -> Iterator[int]:
    """Where the chunks begin, by the lengths of all records."""
    at = 8  # after the magic
    while len(head := os.pread(file, _RECORD.size, at)) == _RECORD.size:
        opcode, length = _RECORD.unpack(head)
        if opcode == _CHUNK:
            yield at
        at += _RECORD.size + length


def _size_in(compression: bytes, frame: bytes) -> int:
    """The unpacked size that a compressed frame declares; 0: none."""
    try:
        if compression == b"zstd":
            zstandard: Any = importlib.import_module("zstandard")
            return int(zstandard.frame_content_size(frame))
        if compression == b"lz4":
            lz4: Any = importlib.import_module("lz4.frame")
            return int(lz4.get_frame_info(frame)["content_size"])
    except Exception:  # it is no frame, or the package is not installed, which mcap reports
        pass
    return 0
