# SPDX-License-Identifier: Apache-2.0
"""Write MCAP recordings that rosbag2 accepts: profile ros2, CDR messages, ros2msg schemas, bag metadata."""

import contextlib
import math
import os
import textwrap
import time
from collections import Counter
from pathlib import Path

from hpccd_ros.bag import message_definitions, qos_yaml
from hpccd_ros.bag.bag_file import COMPRESSIONS, BagFile, Topic
from hpccd_ros.bag.disk_sync import DiskSync, sync_folder

__all__ = ["COMPRESSIONS", "BagWriter", "Topic"]


class BagWriter:
    """One recording: a single file, or a folder of files in rosbag2's layout, split by size or duration.

    path: ends in `.mcap`: one file, complete on its own. Otherwise a new folder, with
    `NAME_0.mcap`, `NAME_1.mcap`, ... and `metadata.yaml` of the finished ones.
    info: JSON-able dict, stored with each file for the replay (see `reader.Recording.info`).
    attachments: (name, bytes) of files that a replay needs, stored with each file too.
    compression: "none", "lz4" or "zstd", a chunk at a time.
    chunk_size: bytes of messages after which a chunk is closed, indexed and written.
    flush_interval: seconds after which an open chunk is closed anyway. A process killed at any moment
    loses at most the messages of the open chunk, those of the last `flush_interval`.
    sync: whatever is written survives a power failure too. Each time that an open chunk is older than `flush_interval`,
    and at the end, the file is made durable (fdatasync, fsync of its folder), in a thread of its own.
    max_bytes, max_seconds: split limits (0: none), for a folder only. `max_bytes` counts messages
    before compression, and the last one of a file may exceed it.

    The constructor raises ValueError for inconsistent options, FileExistsError instead of overwriting a recording,
    OSError if it cannot write. Later errors of the disk (full, gone) are not raised: the file ends after its last
    complete chunk, lost messages are counted, and after `retry_interval` seconds a new file is tried: the next number
    of the folder, or NAME-1.mcap beside NAME.mcap.

    If a file cannot be made durable, it is closed as it is, without index, and the next one begins at once, or after
    `retry_interval` seconds if such an error happened shortly before.

    write_errors, last_error: errors of the disk. not_written: messages by topic that are in no file. not_synced: number
    of messages that were written, but could not be made durable.
    """

    def __init__(
        self,
        path,
        *,
        info=None,
        attachments=(),
        compression="none",
        chunk_size=1 << 20,
        flush_interval=0.5,
        max_bytes=0,
        max_seconds=0.0,
        retry_interval=5.0,
        sync=False,
    ):
        self.path = Path(path)
        self.single_file = self.path.suffix == ".mcap"
        if why := unusable_options(path, compression, max_bytes, max_seconds):
            raise ValueError(why)
        if self.path.exists():
            raise FileExistsError(f"{self.path} exists: recordings are not overwritten; remove it or name another")
        folders = _missing_folders(self.path.parent if self.single_file else self.path)
        for folder in folders:
            folder.mkdir(exist_ok=folder != self.path)
        self._options = {
            "info": info or {},
            "attachments": list(attachments),
            "compression": compression,
            "chunk_size": chunk_size,
        }
        self._flush_interval = flush_interval
        self._retry_interval = retry_interval
        self._limits = (max_bytes, int(max_seconds * 1e9))
        self._topics: dict[str, Topic] = {}
        self._files: list[BagFile] = []
        self._listed: list[tuple[str, str]] = []  # parts of metadata.yaml of finished files
        self._file: BagFile | None = None  # None: after an error, until the next try
        self._try_again = 0.0
        self._last_sync_error = -math.inf
        self._unlisted = False  # the last metadata.yaml could not be written
        self._closed = False
        self.write_errors = 0
        self.last_error = ""
        self.not_written: Counter[str] = Counter()
        self.not_synced = 0
        self._disk = DiskSync() if sync else None
        try:
            if sync:
                for folder in folders:
                    sync_folder(folder.parent)
            self._open_file()
        except OSError as error:
            error.filename = error.filename or str(self.path)
            self._abandon_file()
            if self._disk is not None:
                self._disk.end()
            if not self.single_file:
                with contextlib.suppress(OSError):
                    self.path.rmdir()
            raise

    def add_topic(self, topic: Topic) -> None:
        """Announce a topic before its first message. Raises LookupError if its type is not installed."""
        message_definitions.definition_text(topic.type_name)  # fail before anything is written
        self._topics[topic.name] = topic
        if self._file is not None:
            self._guarded(lambda: self._file.register(topic))

    def attach(self, name: str, data: bytes) -> bool:
        """Add a file that a replay needs and that was not known at the start. An attachment with this name is not
        replaced: False if its content differs."""
        for known, there in self._options["attachments"]:
            if name == known:
                return there == data
        self._options["attachments"].append((name, data))
        if self._file is not None:
            self._guarded(lambda: self._file.attach(name, data))
        return True

    def write(self, topic_name: str, data: bytes, log_time: int, publish_time: int, sequence: int = 0) -> None:
        """Append the CDR bytes of one message; times in ns since the epoch."""
        if self._disk is not None:
            self._take_sync_errors()
        topic = self._topics[topic_name]
        message = (log_time, publish_time, sequence, data)
        if self._file is None and time.monotonic() >= self._try_again:
            self._guarded(lambda: self._go_on(log_time, topic))
        elif self._file is not None and self._is_full(log_time):
            self._guarded(lambda: self._split(log_time, topic))
        # The file counts messages that a failing write loses.
        if self._file is None:
            self.not_written[topic_name] += 1
        else:
            self._guarded(lambda: self._append(topic, *message))
        topic.last.append(message)

    def poll(self) -> None:
        """Close the open chunk if it is older than `flush_interval`. Call it also while no messages come, after
        `until_flush` seconds at the latest."""
        if self._disk is not None:
            self._take_sync_errors()
        if time.monotonic() - self._flushed > self._flush_interval:
            self.flush()

    @property
    def until_flush(self) -> float:
        """Seconds until `poll` closes the open chunk, at least 0; inf if it is empty."""
        if self._file is None or not self._file.open_chunk:
            return math.inf
        return max(0.0, self._flushed + self._flush_interval - time.monotonic())

    def flush(self) -> None:
        """Write everything so far, so that it survives the end of this process."""
        if self._file is not None:
            self._guarded(self._file.flush)
        if self._disk is not None and self._file is not None and self._file.flushed_count > self._file.to_sync:
            self._disk.written(self._file, self._file.flushed_count)
        self._flushed = time.monotonic()

    def close(self) -> None:
        """Finish the last file: index, statistics, footer. The recording is then complete."""
        self._closed = True
        if self._disk is not None:
            self._take_sync_errors()
        if self._file is not None:
            self._guarded(self._close_file)
        elif self._unlisted:
            self._guarded(self._list_files)
        if self._disk is not None:
            self._disk.end()
            self._take_sync_errors()

    @property
    def failing(self) -> bool:
        """Whether the last write failed, so that messages are being lost."""
        return self._file is None and not self._closed

    @property
    def message_count(self) -> int:
        return sum(file.message_count for file in self._files)

    @property
    def flushed_count(self) -> int:
        """Messages that survive the end of this process."""
        return sum(file.flushed_count for file in self._files)

    @property
    def synced_count(self) -> int:
        """Messages that survive a power failure; 0 without `sync`."""
        return sum(file.synced_count for file in self._files)

    @property
    def file_paths(self) -> list[Path]:
        return [file.path for file in self._files]

    @property
    def torn_files(self) -> list[Path]:
        """Files that were ended by an error."""
        return [file.path for file in self._files if file.torn]

    @property
    def size(self) -> int:
        """Bytes written so far, over all files."""
        return sum(file.size for file in self._files)

    def _guarded(self, action) -> None:
        """Do `action` with the current file; if the disk fails, count it and abandon the file."""
        try:
            action()
        except OSError as error:
            self._count(error)
            self._try_again = time.monotonic() + self._retry_interval
            if (file := self._abandon_file()) is not None and self._disk is not None:
                self._disk.finished(file, file.message_count)  # what was written before the error

    def _count(self, error: OSError) -> None:
        self.write_errors += 1
        self.last_error = f"{error.strerror}: {error.filename or (self._file and self._file.path) or self.path}"

    def _abandon_file(self) -> BagFile | None:
        """The current file, ended as it is; None if there is none, or if it had no messages and is removed."""
        file, self._file = self._file, None
        if file is None:
            return None
        self.not_written += file.open_chunk
        if file.abandon():
            return file
        self._files.remove(file)
        return None

    def _take_sync_errors(self) -> None:
        """Count files that could not be made durable. The current one is ended: what it contains is not known."""
        while self._disk.failures:
            file, error = self._disk.failures.popleft()
            self._count(error)
            if file.finished:  # it is durable, metadata.yaml is not
                continue
            now = time.monotonic()
            if file is self._file:
                self._abandon_file()
                recently = now - self._last_sync_error < self._retry_interval
                self._try_again = now + self._retry_interval if recently else now
            self._last_sync_error = now
            file.torn = True
            self.not_synced += file.flushed_count - file.synced_count

    def _next_path(self) -> Path:
        if self.single_file:
            return free_path(self.path)
        number = len(self._files)
        while (path := self.path / f"{self.path.name}_{number}.mcap").exists():
            number += 1
        return path

    def _open_file(self):
        self._file = BagFile(self._next_path(), **self._options)
        self._files.append(self._file)
        self._flushed = time.monotonic()
        if self._disk is not None:
            self._disk.opened(self._file)

    def _close_file(self):
        file = self._file
        file.finish(metadata_of_bag([file], list(self._topics.values())))
        self._file = None
        if self._disk is not None:
            self._disk.finished(file, file.message_count, lambda: self._complete(file))
            return
        try:
            self._complete(file)
        except OSError as error:  # of metadata.yaml: the recording goes on
            self._count(error)

    def _complete(self, file):
        file.finished = True
        if not self.single_file:
            self._list_files()

    def _list_files(self):
        self._unlisted = True
        finished = [file for file in list(self._files) if file.finished]
        # Earlier ones are already rendered: rendering all of them again takes longer at each split, and messages of the
        # stream would be lost meanwhile.
        for file in finished[len(self._listed) :]:
            parts = ([file.path.name], [metadata_of_file(file)])
            self._listed.append(tuple(textwrap.indent(qos_yaml.to_yaml(part), "  ") for part in parts))
        names, files = ("".join(parts) for parts in zip(*self._listed, strict=True))
        bag = {"rosbag2_bagfile_information": metadata_without_files(finished, list(self._topics.values()))}
        lists = f"  relative_file_paths:\n{names}  files:\n{files}"
        draft = self.path / "metadata.yaml.part"
        try:
            with open(draft, "w", encoding="utf-8") as stream:
                stream.write(qos_yaml.to_yaml(bag) + lists)
                if self._disk is not None:
                    stream.flush()
                    os.fsync(stream.fileno())
            os.replace(draft, self.path / "metadata.yaml")  # complete at any moment
        except OSError as error:
            error.filename = str(self.path / "metadata.yaml")
            with contextlib.suppress(OSError):
                draft.unlink()
            raise
        if self._disk is not None:
            sync_folder(self.path)
        self._unlisted = False

    def _split(self, log_time, cause):
        self._close_file()
        self._go_on(log_time, cause)

    def _go_on(self, log_time, cause):
        """Open the next file. It is complete on its own: it starts with the messages in force before that of
        `cause`."""
        self._open_file()
        for topic in self._topics.values():
            self._file.register(topic)
            outlived = topic is cause and len(topic.last) == topic.latched
            for earlier in list(topic.last)[int(outlived) :]:
                self._file.append(topic, log_time, *earlier[1:])

    def _is_full(self, log_time):
        max_bytes, max_ns = self._limits
        file = self._file
        return file.message_count and (
            (max_bytes and file.data_bytes >= max_bytes) or (max_ns and log_time - file.start >= max_ns)
        )

    def _append(self, topic, *message):
        self._file.append(topic, *message)
        self.poll()


def unusable_options(path, compression: str, max_bytes: float, max_seconds: float) -> str | None:
    """Why a recording cannot be made with these options, or None."""
    if Path(path).suffix == ".mcap" and (max_bytes or max_seconds):
        return f"cannot split the single file {path}: give a folder (a path that does not end in .mcap)"
    if compression not in COMPRESSIONS:
        return f"compression {compression!r} is none of {', '.join(COMPRESSIONS)}"
    return None


def _missing_folders(folder: Path) -> list[Path]:
    """``folder`` and those on the way to it that do not exist, in the order in which they can be made."""
    missing = []
    while not folder.exists():
        missing.append(folder)
        folder = folder.parent
    return missing[::-1]


def free_path(path: Path) -> Path:
    """`path`, or if it exists NAME-1, NAME-2, ... beside it: recordings are not overwritten."""
    candidate, number = path, 0
    while candidate.exists():
        number += 1
        candidate = path.with_name(f"{path.stem}-{number}{path.suffix}")
    return candidate


def metadata_of_bag(files: list[BagFile], topics: list[Topic]) -> dict:
    """rosbag2's metadata of the given files."""
    return metadata_without_files(files, topics) | {
        "relative_file_paths": [f.path.name for f in files],
        "files": [metadata_of_file(f) for f in files],
    }


def metadata_of_file(file: BagFile) -> dict:
    """Its entries about one file."""
    return {
        "path": file.path.name,
        "starting_time": {"nanoseconds_since_epoch": file.start},
        "duration": {"nanoseconds": file.end - file.start},
        "message_count": file.message_count,
    }


def metadata_without_files(files: list[BagFile], topics: list[Topic]) -> dict:
    """The metadata without its two lists of files."""
    used = [f for f in files if f.message_count]
    start = min((f.start for f in used), default=0)
    end = max((f.end for f in used), default=0)
    counts: Counter[str] = Counter()
    for file in files:
        counts.update(file.counts)
    return {
        "version": 9,
        "storage_identifier": "mcap",
        "duration": {"nanoseconds": end - start},
        "starting_time": {"nanoseconds_since_epoch": start},
        "message_count": counts.total(),
        "topics_with_message_count": [
            {
                "topic_metadata": {
                    "name": topic.name,
                    "type": topic.type_name,
                    "serialization_format": "cdr",
                    "offered_qos_profiles": topic.qos,
                    "type_description_hash": message_definitions.type_hash(topic.type_name),
                },
                "message_count": counts[topic.name],
            }
            for topic in topics
        ],
        # MCAP compresses its own chunks; these two keys are about compression around the file.
        "compression_format": "",
        "compression_mode": "",
        "custom_data": None,
        "ros_distro": "jazzy",
    }
