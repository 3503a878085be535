# SPDX-License-Identifier: Apache-2.0
"""One MCAP file of a recording that is being written: each write is complete, or leaves no trace."""

import contextlib
import dataclasses
import json
import os
import time
from collections import Counter, deque
from pathlib import Path

from mcap.writer import CompressionType, Writer

from hpccd_ros.bag import message_definitions, qos_yaml
from hpccd_ros.bag.metadata_checksum import HPCCD_RECORD, ROSBAG2_RECORD, with_checksum
from hpccd_ros.base.version import package_version


class WholeWrites:
    """A new file that only grows by complete writes. The MCAP library writes one record, such as a chunk, at a time, so
    on a full disk the file ends after its last complete record.

    Unbuffered: data survives the end of this process once `write` has returned; disk_sync.py makes it survive a power
    failure.
    size: bytes in the file.
    Raises FileExistsError instead of overwriting a file.
    """

    def __init__(self, path):
        self._file = open(path, "xb", buffering=0)
        self.size = 0

    def write(self, data: bytes) -> int:
        """Append all of `data`, or undo the write and raise OSError."""
        view = memoryview(data)
        written = 0
        try:
            while written < len(view):
                written += self._file.write(view[written:])
        except OSError:
            # If this fails too, the reader finds an incomplete record at the end, as of a killed process.
            with contextlib.suppress(OSError):
                self._file.seek(self.size)
                os.ftruncate(self._file.fileno(), self.size)
            raise
        self.size += written
        return written

    def tell(self) -> int:
        return self.size

    def fileno(self) -> int:
        return self._file.fileno()

    def flush(self) -> None:
        """Nothing is buffered here."""

    def close(self) -> None:
        self._file.close()


COMPRESSIONS = {"none": CompressionType.NONE, "lz4": CompressionType.LZ4, "zstd": CompressionType.ZSTD}


@dataclasses.dataclass
class Topic:
    """A recorded topic. `qos` as from `qos_yaml.offered_qos`.

    `latched`: number of its last messages that are repeated at the start of each file; `last`: these, as (log_time,
    publish_time, sequence, data).
    """

    name: str
    type_name: str
    qos: list[dict]
    latched: int = 0
    last: deque[tuple] = dataclasses.field(init=False)

    def __post_init__(self):
        self.last = deque(maxlen=self.latched)


class BagFile:
    """An open file. counts: messages by topic. open_chunk: those that are not written yet.

    start, end: smallest and largest log time, ns. data_bytes: size of all messages, uncompressed. finished: it is
    complete, and durable where that was asked for. torn: it was ended by an error. to_sync, synced_count: messages that
    are to be, and that are, durable (disk_sync.py).
    Every method except `abandon` raises OSError if the disk fails; then only `abandon` may be called.
    """

    def __init__(self, path: Path, *, info: dict, attachments, compression: str, chunk_size: int):
        self.path = path
        self.counts: Counter[str] = Counter()
        self.open_chunk: Counter[str] = Counter()
        self.start = self.end = self.data_bytes = 0
        self.to_sync = self.synced_count = 0
        self.finished = self.torn = False
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}
        self._stream = WholeWrites(path)
        self._writer = Writer(self._stream, chunk_size=chunk_size, compression=COMPRESSIONS[compression])
        try:
            self._writer.start(profile="ros2", library=f"hpccd {package_version()}")
            # First, so that even a file cut off later can be replayed.
            self._add_metadata(HPCCD_RECORD, {"json": json.dumps(info, sort_keys=True)})
            for name, data in attachments:
                self.attach(name, data)
        except OSError:
            self.abandon()
            raise

    @property
    def message_count(self) -> int:
        return self.counts.total()

    @property
    def flushed_count(self) -> int:
        """Messages in closed chunks."""
        return self.message_count - self.open_chunk.total()

    @property
    def size(self) -> int:
        """Bytes written."""
        return self._stream.size

    def duplicate_descriptor(self) -> int:
        """A second file descriptor. Raises OSError."""
        return os.dup(self._stream.fileno())

    def attach(self, name: str, data: bytes) -> None:
        now = time.time_ns()
        self._writer.add_attachment(now, now, name, "application/octet-stream", data)

    def _add_metadata(self, name: str, values: dict[str, str]) -> None:
        self._writer.add_metadata(name, with_checksum(name, values))

    def register(self, topic: Topic) -> None:
        """Describe a topic before its first message."""
        before = self.size
        try:
            self._describe(topic)
        finally:
            self._watch(before)

    def _describe(self, topic: Topic) -> None:
        if topic.type_name not in self._schemas:
            text = message_definitions.definition_text(topic.type_name)
            self._schemas[topic.type_name] = self._writer.register_schema(
                name=topic.type_name, encoding="ros2msg", data=text.encode()
            )
        self._channels[topic.name] = self._writer.register_channel(
            topic=topic.name,
            message_encoding="cdr",
            schema_id=self._schemas[topic.type_name],
            metadata={
                "offered_qos_profiles": qos_yaml.to_yaml(topic.qos) if topic.qos else "",
                "topic_type_hash": message_definitions.type_hash(topic.type_name),
            },
        )

    def append(self, topic: Topic, log_time: int, publish_time: int, sequence: int, data: bytes) -> None:
        self.start = min(self.start, log_time) if self.counts else log_time
        self.end = max(self.end, log_time)
        self.counts[topic.name] += 1
        self.open_chunk[topic.name] += 1
        self.data_bytes += len(data)
        before = self.size
        try:
            self._writer.add_message(
                channel_id=self._channels[topic.name],
                log_time=log_time,
                publish_time=publish_time,
                data=data,
                sequence=sequence & 0xFFFFFFFF,  # MCAP has 32 bits for it
            )
        finally:
            self._watch(before)

    def _watch(self, size_before: int) -> None:
        """Notice that the open chunk has been written; its indexes come afterwards, and may fail."""
        if self.size != size_before:
            self.open_chunk.clear()

    def flush(self) -> None:
        """Close the open chunk: all messages so far survive the end of this process."""
        before = self.size
        try:
            self._writer.flush()
        finally:
            self._watch(before)

    def finish(self, bag_metadata: dict) -> None:
        """Close the open chunk, write index, statistics and footer, close the file. bag_metadata: rosbag2's metadata of
        this file."""
        self.flush()
        self._add_metadata(ROSBAG2_RECORD, {"serialized_metadata": qos_yaml.to_yaml(bag_metadata)})
        self._writer.finish()
        self._stream.close()

    def abandon(self) -> bool:
        """Close without index and footer, after an error: `hpccd doctor` recovers the closed chunks, and the counts are
        those of the closed chunks. A file without any is removed. Returns whether there is still a file."""
        self.torn = True
        self.counts -= self.open_chunk
        self.open_chunk.clear()
        with contextlib.suppress(OSError):  # the error that led here is reported
            self._stream.close()
        if self.message_count:
            return True
        try:
            self.path.unlink(missing_ok=True)
        except OSError:
            return True
        return False
