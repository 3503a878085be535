# SPDX-License-Identifier: Apache-2.0
"""Counts in binary USD files (crate), before the library of USD reserves memory for whatever they claim: 12 GB for a
damaged file of 1.5 kB.
"""

import os
import struct
from collections.abc import Iterator
from pathlib import Path

from .sequence import SequenceError

_IDENT = b"PXR-USDC"
_BOOT = struct.Struct("<8s3B5xq")  # identifier, version, offset of the table of contents
_COUNT = struct.Struct("<Q")
_SECTION = struct.Struct("<16sqq")  # name, begin, size
_MOST_SECTIONS = 100
_COMPRESSED = (0, 4, 0)  # the first version in which integers are compressed
# Blocks of bytes behind the count, each after its length; tokens have their uncompressed length before.
_BLOCKS = {b"TOKENS": 1, b"FIELDS": 2, b"FIELDSETS": 1, b"PATHS": 3, b"SPECS": 3}
# LZ4 packs at most 255 bytes into one, and an integer has two bits or more before.
_MOST_BYTES, _MOST_INTEGERS = 255, 4 * 255


def check_counts(path: Path) -> None:
    """Check that the sections of a crate file lie in it and can hold what they claim. Other files are left alone.

    Raises
    ------
    SequenceError
        They do not.
    """
    with open(path, "rb") as file:
        head = file.read(_BOOT.size)
        if len(head) < _BOOT.size or not head.startswith(_IDENT):
            return
        _, *version, toc = _BOOT.unpack(head)
        size = os.fstat(file.fileno()).st_size
        if tuple(version) < _COMPRESSED:
            return
        try:
            for name, begin, length in _sections(file.fileno(), toc, size):
                _check_section(file.fileno(), name, begin, length)
        except (OverflowError, struct.error, ValueError) as error:
            raise SequenceError(f"{path}: is damaged: its sections do not fit; copy or export it again") from error


def _sections(file: int, toc: int, size: int) -> Iterator[tuple[bytes, int, int]]:
    """(name, begin, size) of each. Raises ValueError."""
    count = _number(file, toc)
    if count > _MOST_SECTIONS:
        raise ValueError
    for k in range(count):
        name, begin, length = _SECTION.unpack(os.pread(file, _SECTION.size, toc + _COUNT.size + k * _SECTION.size))
        if begin < 0 or length < 0 or begin + length > size:
            raise ValueError
        yield name.rstrip(b"\0"), begin, length


def _check_section(file: int, name: bytes, at: int, size: int) -> None:
    """Raises ValueError."""
    end = at + size
    if name == b"STRINGS":
        if _number(file, at) > size // 4:
            raise ValueError
        return
    if name not in _BLOCKS:
        return
    count, at = _number(file, at), at + _COUNT.size
    if name in (b"TOKENS", b"PATHS"):  # bytes of all tokens; the number of paths again
        second, at = _number(file, at), at + _COUNT.size
        if second > size * (_MOST_BYTES if name == b"TOKENS" else _MOST_INTEGERS):
            raise ValueError
    if count > size * (_MOST_BYTES if name == b"TOKENS" else _MOST_INTEGERS):
        raise ValueError
    for _ in range(_BLOCKS[name]):
        at += _COUNT.size + _number(file, at)
        if at > end:
            raise ValueError


def _number(file: int, at: int) -> int:
    return int(_COUNT.unpack(os.pread(file, _COUNT.size, at))[0])
