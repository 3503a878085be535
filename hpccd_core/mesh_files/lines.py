# SPDX-License-Identifier: Apache-2.0
"""Lines of a text file, a chunk at a time."""

from collections.abc import Iterator

BOM = b"\xef\xbb\xbf"

# Bytes. Splitting or converting a whole file of many megabytes in one call would block other threads.
CHUNK = 1 << 18


def chunks(data: bytes, start: int = 0) -> Iterator[list[bytes]]:
    """The lines from byte ``start`` on, many at a time. A line ends with LF, CR LF or CR."""
    while start < len(data):
        end = min(start + CHUNK, len(data))
        if end < len(data):
            end = _after_line_end(data, start, end)
        yield data[start:end].splitlines()
        start = end


def _after_line_end(data: bytes, start: int, end: int) -> int:
    """The byte after the last line that begins before ``end``."""
    last = max(data.rfind(b"\n", start, end), data.rfind(b"\r", start, end))
    if last < 0:  # a line longer than a chunk
        ends = [at for at in (data.find(b"\n", end), data.find(b"\r", end)) if at >= 0]
        last = min(ends, default=len(data) - 1)
    return last + 2 if data[last : last + 2] == b"\r\n" else last + 1


def words(line: bytes) -> list[bytes]:
    """The words of a line of numbers. Words like 1_0, a number in Python but in no mesh format, become empty."""
    found = line.split()
    return [b"" if b"_" in word else word for word in found] if b"_" in line else found


def shown(line: bytes) -> str:
    """The beginning of a line, for error messages."""
    text = line.decode("utf-8", "backslashreplace").strip()
    return repr(text if len(text) <= 60 else text[:60] + "...")
