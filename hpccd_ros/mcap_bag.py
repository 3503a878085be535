# SPDX-License-Identifier: Apache-2.0
"""Write MCAP recordings that rosbag2 accepts: profile ros2, CDR messages, ros2msg schemas, bag metadata."""

import dataclasses
import json
import time
from pathlib import Path

from mcap.writer import CompressionType, Writer

from hpccd_ros import mcap_qos, mcap_schema
from hpccd_ros.version import package_version

COMPRESSIONS = {"none": CompressionType.NONE, "lz4": CompressionType.LZ4, "zstd": CompressionType.ZSTD}

# Name of the metadata record with what a replay needs beside the messages (parameters, topic names).
HPCCD_RECORD = "hpccd"


@dataclasses.dataclass
class Topic:
    """A recorded topic. `qos` as from `mcap_qos.offered_qos`; `latched`: repeated at the start of each file."""

    name: str
    type_name: str
    qos: list[dict]
    latched: bool = False
    count: int = 0
    last: tuple | None = None  # (log_time, publish_time, sequence, data) of a latched topic


class BagWriter:
    """One recording: a single file, or a folder of files in rosbag2's layout, split by size or duration.

    path: ends in `.mcap`: one file, which `ros2 bag play` opens alone. Otherwise a folder, made here, with
    `NAME_0.mcap`, `NAME_1.mcap`, ... and `metadata.yaml`.
    info: JSON-able dict, stored with each file for the replay (see `mcap_reader.Recording.info`).
    attachments: (name, bytes) of files that a replay needs, stored with each file too.
    compression: "none", "lz4" or "zstd", a chunk at a time.
    chunk_size: bytes of messages after which a chunk is closed, indexed and handed to the system.
    flush_interval: seconds after which an open chunk is closed all the same. A process killed at any moment
    loses at most the messages of the open chunk, so at most those of the last `flush_interval`.
    max_bytes, max_seconds: split limits (0: none), for a folder only. Files pass `max_bytes` by at most a chunk.

    Raises ValueError for options that do not fit each other, FileExistsError rather than overwrite a recording.
    """

    def __init__(self, path, *, info=None, attachments=(), compression="none", chunk_size=1 << 20, flush_interval=0.5,
                 max_bytes=0, max_seconds=0.0):
        self.path = Path(path)
        self.single_file = self.path.suffix == ".mcap"
        if self.single_file and (max_bytes or max_seconds):
            raise ValueError(
                f"cannot split the single file {self.path}: give a folder (a path that does not end in .mcap)"
            )
        if compression not in COMPRESSIONS:
            raise ValueError(f"compression {compression!r} is none of {', '.join(COMPRESSIONS)}")
        if self.path.exists():
            raise FileExistsError(f"{self.path} exists: recordings are not overwritten; remove it or name another")
        self.path.parent.mkdir(parents=True, exist_ok=True)
        if not self.single_file:
            self.path.mkdir()
        self._info = json.dumps(info or {}, sort_keys=True)
        self._attachments = list(attachments)
        self._options = {"compression": COMPRESSIONS[compression], "chunk_size": chunk_size}
        self._flush_interval = flush_interval
        self._limits = (max_bytes, int(max_seconds * 1e9))
        self._topics: dict[str, Topic] = {}
        self._files: list[dict] = []
        self._open_file()

    def add_topic(self, topic: Topic) -> None:
        """Announce a topic before its first message. Raises LookupError where its type is not installed."""
        mcap_schema.definition_text(topic.type_name)  # fail before anything is written
        self._topics[topic.name] = topic
        self._register(topic)

    def write(self, topic_name: str, data: bytes, log_time: int, publish_time: int, sequence: int = 0) -> None:
        """Append the CDR bytes of one message; times in ns since the epoch."""
        topic = self._topics[topic_name]
        if self._file["count"] and self._is_full(log_time):
            self._close_file()
            self._open_file()
            for other in self._topics.values():
                self._register(other)
                if other.latched and other.last and other is not topic:
                    # A file of a split recording is complete alone: it starts with the topologies in force.
                    self._append(other, log_time, *other.last[1:])
        self._append(topic, log_time, publish_time, sequence, data)
        if topic.latched:
            topic.last = (log_time, publish_time, sequence, data)

    def poll(self) -> None:
        """Close the open chunk if it is older than `flush_interval`. Call it also while no messages come."""
        if time.monotonic() - self._flushed > self._flush_interval:
            self.flush()

    def flush(self) -> None:
        """Hand everything written so far to the operating system: it survives the death of this process."""
        self._writer.flush()
        self._flushed = time.monotonic()

    def close(self) -> None:
        """Finish the last file: index, statistics, footer. The recording is then complete."""
        self._close_file()
        if not self.single_file:
            text = mcap_qos.to_yaml({"rosbag2_bagfile_information": self._bag_metadata(self._files)})
            (self.path / "metadata.yaml").write_text(text, encoding="utf-8")

    @property
    def message_count(self) -> int:
        return sum(topic.count for topic in self._topics.values())

    @property
    def file_paths(self) -> list[Path]:
        return [Path(f["path"]) for f in self._files]

    @property
    def size(self) -> int:
        """Bytes handed to the system so far, over all files."""
        return sum(Path(f["path"]).stat().st_size for f in self._files)

    def _open_file(self):
        path = self.path if self.single_file else self.path / f"{self.path.name}_{len(self._files)}.mcap"
        self._stream = open(path, "xb")
        self._writer = Writer(self._stream, **self._options)
        self._writer.start(profile="ros2", library=f"hpccd {package_version()}")
        # First, so that even a file cut off later can be replayed.
        self._writer.add_metadata(HPCCD_RECORD, {"json": self._info})
        for name, data in self._attachments:
            now = time.time_ns()
            self._writer.add_attachment(now, now, name, "application/octet-stream", data)
        self._file = {"path": str(path), "count": 0, "start": 0, "end": 0, "bytes": 0, "topics": {}}
        self._files.append(self._file)
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}
        self.flush()

    def _close_file(self):
        bag = self._bag_metadata([self._file])
        self._writer.flush()
        self._writer.add_metadata("rosbag2", {"serialized_metadata": mcap_qos.to_yaml(bag)})
        self._writer.finish()
        self._stream.close()

    def _is_full(self, log_time):
        max_bytes, max_ns = self._limits
        return (max_bytes and self._file["bytes"] >= max_bytes) or (
            max_ns and log_time - self._file["start"] >= max_ns
        )

    def _register(self, topic):
        if topic.type_name not in self._schemas:
            text = mcap_schema.definition_text(topic.type_name)
            self._schemas[topic.type_name] = self._writer.register_schema(
                name=topic.type_name, encoding="ros2msg", data=text.encode()
            )
        self._channels[topic.name] = self._writer.register_channel(
            topic=topic.name,
            message_encoding="cdr",
            schema_id=self._schemas[topic.type_name],
            metadata={
                "offered_qos_profiles": mcap_qos.to_yaml(topic.qos) if topic.qos else "",
                "topic_type_hash": mcap_schema.type_hash(topic.type_name),
            },
        )

    def _append(self, topic, log_time, publish_time, sequence, data):
        self._writer.add_message(
            channel_id=self._channels[topic.name],
            log_time=log_time,
            publish_time=publish_time,
            data=data,
            sequence=sequence & 0xFFFFFFFF,  # MCAP has 32 bits for it
        )
        topic.count += 1
        file = self._file
        file["start"] = min(file["start"], log_time) if file["count"] else log_time
        file["end"] = max(file["end"], log_time)
        file["count"] += 1
        file["bytes"] += len(data)
        file["topics"][topic.name] = file["topics"].get(topic.name, 0) + 1
        self.poll()

    def _bag_metadata(self, files):
        """rosbag2's BagMetadata, version 9 (Jazzy), of the given files."""
        used = [f for f in files if f["count"]]
        start = min((f["start"] for f in used), default=0)
        end = max((f["end"] for f in used), default=0)
        counts = {name: sum(f["topics"].get(name, 0) for f in files) for name in self._topics}
        return {
            "version": 9,
            "storage_identifier": "mcap",
            "duration": {"nanoseconds": end - start},
            "starting_time": {"nanoseconds_since_epoch": start},
            "message_count": sum(counts.values()),
            "topics_with_message_count": [
                {
                    "topic_metadata": {
                        "name": name,
                        "type": topic.type_name,
                        "serialization_format": "cdr",
                        "offered_qos_profiles": topic.qos,
                        "type_description_hash": mcap_schema.type_hash(topic.type_name),
                    },
                    "message_count": counts[name],
                }
                for name, topic in self._topics.items()
            ],
            # MCAP compresses its own chunks; these two keys are about compression around the file.
            "compression_format": "",
            "compression_mode": "",
            "relative_file_paths": [Path(f["path"]).name for f in files],
            "files": [
                {
                    "path": Path(f["path"]).name,
                    "starting_time": {"nanoseconds_since_epoch": f["start"]},
                    "duration": {"nanoseconds": f["end"] - f["start"]},
                    "message_count": f["count"],
                }
                for f in files
            ],
            "custom_data": None,
            "ros_distro": "jazzy",
        }
