# SPDX-License-Identifier: Apache-2.0
"""The file under an MCAP writer: each write reaches the system whole, or leaves no trace."""

import contextlib
import os


class WholeWrites:
    """A new file that only grows by whole writes. The MCAP library writes a record, such as a chunk, at a time, so a
    file of a full disk ends behind its last whole record.

    Unbuffered: what `write` returned from survives the death of this process (not a loss of power: no fsync).
    size: bytes in the file.
    Raises FileExistsError rather than overwrite.
    """

    def __init__(self, path):
        self._file = open(path, "xb", buffering=0)
        self.size = 0

    def write(self, data: bytes) -> int:
        """Append all of `data`, or take it back and raise OSError."""
        view = memoryview(data)
        written = 0
        try:
            while written < len(view):
                written += self._file.write(view[written:])
        except OSError:
            # Should even this fail, the reader finds a torn record at the end, as of a killed process.
            with contextlib.suppress(OSError):
                self._file.seek(self.size)
                os.ftruncate(self._file.fileno(), self.size)
            raise
        self.size += written
        return written

    def tell(self) -> int:
        return self.size

    def flush(self) -> None:
        """Nothing waits here."""

    def close(self) -> None:
        self._file.close()
