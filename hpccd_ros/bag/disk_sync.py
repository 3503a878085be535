# SPDX-License-Identifier: Apache-2.0
"""Makes the files of a recording durable (fsync), in a thread of its own: a sync may take seconds, and messages that
arrive meanwhile must be written."""

import contextlib
import errno
import os
import queue
import threading
from collections import deque
from collections.abc import Callable
from pathlib import Path

from hpccd_ros.bag.bag_file import BagFile


class DiskSync:
    """Syncs files in the order of the calls. No method but `end` waits for the disk.

    failures: (file, error) of each file that could not be made durable. The system reports an error once and may then
    forget the data, so a later sync of this file proves nothing: none is tried.
    """

    def __init__(self) -> None:
        self.failures: deque[tuple[BagFile, OSError]] = deque()
        self._descriptors: dict[BagFile, int] = {}
        self._waiting: set[BagFile] = set()
        self._tasks: queue.SimpleQueue[tuple[BagFile, Callable[[], None]] | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._run, name="sync", daemon=True)
        self._thread.start()

    def opened(self, file: BagFile) -> None:
        """A new file: its name is made durable too. Raises OSError if there are too many open files."""
        # Its own descriptor: the other one may be closed, and its number reused, before a sync begins.
        self._descriptors[file] = file.duplicate_descriptor()
        self._tasks.put((file, lambda: sync_folder(file.path.parent)))

    def written(self, file: BagFile, count: int) -> None:
        """`count` messages are in closed chunks of the file: make them durable."""
        file.to_sync = count
        if file not in self._waiting:  # otherwise a sync that has not begun covers them
            self._waiting.add(file)
            self._tasks.put((file, lambda: self._sync(file)))

    def finished(self, file: BagFile, count: int, then: Callable[[], None] = lambda: None) -> None:
        """The last sync of a file; afterwards `then` is called."""
        file.to_sync = count
        self._tasks.put((file, lambda: self._finish(file, then)))

    def end(self) -> None:
        """Wait until all is done."""
        self._tasks.put(None)
        self._thread.join()

    def _run(self) -> None:
        while (task := self._tasks.get()) is not None:
            file, action = task
            if file not in self._descriptors:  # it has failed
                continue
            try:
                action()
            except OSError as error:
                self._close(file)
                error.filename = error.filename or str(file.path)
                self.failures.append((file, error))
        for file in list(self._descriptors):
            self._close(file)

    def _sync(self, file: BagFile) -> None:
        self._waiting.discard(file)  # before the count is read: what is written from now on needs another one
        count = file.to_sync
        os.fdatasync(self._descriptors[file])
        file.synced_count = count

    def _finish(self, file: BagFile, then: Callable[[], None]) -> None:
        self._sync(file)
        self._close(file)
        then()

    def _close(self, file: BagFile) -> None:
        self._waiting.discard(file)
        if file in self._descriptors:
            with contextlib.suppress(OSError):  # nothing was written through it
                os.close(self._descriptors.pop(file))


def sync_folder(path: Path) -> None:
    """Make the names of the files in a folder durable. Raises OSError."""
    descriptor = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno != errno.EINVAL:  # a file system that cannot
            error.filename = str(path)
            raise
    finally:
        os.close(descriptor)
