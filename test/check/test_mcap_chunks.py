# SPDX-License-Identifier: Apache-2.0
"""Chunks that claim to be huge are rejected before the library mcap unpacks them."""

import struct

import pytest

from hpccd_core.sequences.mcap_chunks import MOST_UNPACKED, check_chunks
from hpccd_core.sequences.sequence import SequenceError

zstandard = pytest.importorskip("zstandard")
lz4 = pytest.importorskip("lz4.frame")

CONTENT = bytes(1000)


def zstd_of_size(size):
    """The beginning of a frame with a content size of eight bytes."""
    return b"\x28\xb5\x2f\xfd\xe0" + struct.pack("<Q", size) + bytes(100)


def file_with(tmp_path, compression, size, data):
    """An MCAP file whose second record is a chunk; returns where it begins."""
    chunk = struct.pack("<QQQII", 0, 0, size, 0, len(compression)) + compression + struct.pack("<Q", len(data)) + data
    first = b"\x01" + struct.pack("<Q", 8) + bytes(8)
    path = tmp_path / "a.mcap"
    path.write_bytes(b"\x89MCAP0\r\n" + first + b"\x06" + struct.pack("<Q", len(chunk)) + chunk + bytes(100))
    return path, 8 + len(first)


@pytest.mark.parametrize("indexed", [False, True])
@pytest.mark.parametrize(
    ("compression", "size", "data"),
    [
        (b"", MOST_UNPACKED + 1, CONTENT),
        (b"zstd", MOST_UNPACKED + 1, zstandard.compress(CONTENT)),
        (b"zstd", 1000, zstd_of_size(MOST_UNPACKED + 1)),
        (b"zstd", 1000, zstd_of_size(2**63)),
        (b"lz4", 2**63, lz4.compress(CONTENT)),
    ],
)
def test_huge_chunks(tmp_path, compression, size, data, indexed):
    path, at = file_with(tmp_path, compression, size, data)
    with pytest.raises(SequenceError, match="a chunk of more than 1,073,741,824 bytes; record it in smaller chunks"):
        check_chunks(path, [at] if indexed else [])


@pytest.mark.parametrize("indexed", [False, True])
@pytest.mark.parametrize(
    ("compression", "data"),
    [
        (b"", CONTENT),
        (b"zstd", zstandard.compress(CONTENT)),
        (b"lz4", lz4.compress(CONTENT)),
        (b"zstd", b"no frame of zstd"),
        (b"lz4", b"no frame of lz4"),
    ],
)
def test_others_are_left_to_the_library(tmp_path, compression, data, indexed):
    path, at = file_with(tmp_path, compression, MOST_UNPACKED, data)
    check_chunks(path, [at] if indexed else [])
