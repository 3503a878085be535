# SPDX-License-Identifier: Apache-2.0
"""Read recordings: one MCAP file, or a folder of them as rosbag2 and `hpccd record` write."""

import contextlib
import dataclasses
import heapq
import json
from collections.abc import Iterator
from pathlib import Path

from mcap.writer import MCAP0_MAGIC

from hpccd_ros.bag.mcap_file import McapFile
from hpccd_ros.bag.mcap_records import DAMAGE
from hpccd_ros.bag.writer import HPCCD_RECORD
from hpccd_ros.base.errors import UserError
from hpccd_ros.base.quoting import printable


class RecordingError(UserError, ValueError):
    """A recording cannot be read, or not used for what was asked; the text names the file and the remedy."""

    def __init__(self, text: str):
        super().__init__(printable(text))  # names in it are those of the recording


@dataclasses.dataclass(frozen=True)
class RecordedTopic:
    name: str
    type_name: str  # "pkg/msg/Name"
    definition: str  # text of the recorded schema
    type_hash: str  # "RIHS01_...", or "" where the recorder did not store it
    offered_qos: str  # rosbag2 YAML, or ""
    count: int


@dataclasses.dataclass(frozen=True)
class RecordedMessage:
    topic: str
    log_time: int  # ns since the epoch, when the recorder received it
    publish_time: int  # ns since the epoch, when it was sent
    sequence: int  # the publisher's number, 0 where the recorder did not store it
    data: bytes  # CDR, with its 4-byte header


class Recording:
    """A finished recording. Use as a context manager.

    path: an `.mcap` file or a folder of them.
    Raises RecordingError where it does not exist, is no MCAP file, is cut off or damaged, or holds no ROS 2 messages;
    `messages` too, where damage shows only then.

    topics: dict topic name -> RecordedTopic.
    info: what `hpccd record` stored beside the messages (dict), or None in a recording of another recorder.
    attachments: name -> bytes of the files that it stored, such as mesh files.
    """

    def __init__(self, path):
        self.path = Path(path)
        self.files = recording_files(self.path)
        self._stack = contextlib.ExitStack()
        self.topics: dict[str, RecordedTopic] = {}
        self.info: dict | None = None
        self.attachments: dict[str, bytes] = {}
        try:
            self._opened = [self._open(file) for file in self.files]
        except BaseException:
            self._stack.close()
            raise

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._stack.close()

    @property
    def message_count(self) -> int:
        return sum(topic.count for topic in self.topics.values())

    def messages(self, topics=None) -> Iterator[RecordedMessage]:
        """Messages in the order in which they were received, over all files. `topics`: only these names."""
        streams = [self._read(*opened, topics) for opened in zip(self.files, self._opened, strict=True)]
        yield from heapq.merge(*streams, key=lambda message: message.log_time)

    def _open(self, path) -> McapFile:
        check_ends(path)
        with _explained(path):
            stream = self._stack.enter_context(open(path, "rb"))
            file = McapFile(stream, path.stat().st_size)
        if file.header.profile != "ros2":
            raise RecordingError(f"{path} has MCAP profile {file.header.profile!r}: only ros2 recordings can be used")
        if file.index is None or file.index.statistics is None:
            raise RecordingError(f"{path} has no summary section: rewrite it with `hpccd doctor {path} --recover OUT`")
        for channel_id, channel in file.index.channels.items():
            schema = file.index.schemas.get(channel.schema_id)
            if channel.message_encoding != "cdr" or schema is None:
                raise RecordingError(
                    f"{path}: topic {channel.topic} has encoding {channel.message_encoding!r} and "
                    f"{'no' if schema is None else 'a'} schema; ROS 2 recordings hold cdr with a schema"
                )
            self._add_topic(channel, schema, file.index.statistics.channel_message_counts.get(channel_id, 0))
        stored = next((record for record in file.metadata if record.name == HPCCD_RECORD), None)
        if stored is not None and self.info is None:
            self.info = _info(path, stored)
        for attachment in file.attachments:  # what came to be needed later is in later files alone
            self.attachments.setdefault(attachment.name, attachment.data)
        return file

    def _add_topic(self, channel, schema, count):
        known = self.topics.get(channel.topic)
        topic = RecordedTopic(
            name=channel.topic,
            type_name=schema.name,
            definition=schema.data.decode(errors="replace") if schema.encoding == "ros2msg" else "",
            type_hash=channel.metadata.get("topic_type_hash", ""),
            offered_qos=channel.metadata.get("offered_qos_profiles", ""),
            count=count + (known.count if known else 0),
        )
        if known and known.type_name != topic.type_name:
            raise RecordingError(
                f"{self.path}: topic {topic.name} changes its type from {known.type_name} to {topic.type_name}"
            )
        self.topics[topic.name] = topic

    def _read(self, path, file, topics):
        with _explained(path):
            for channel, message in file.messages(topics):
                yield RecordedMessage(
                    channel.topic, message.log_time, message.publish_time, message.sequence, message.data
                )


def _info(path, stored) -> dict:
    try:
        info = json.loads(stored.metadata["json"])
    except (KeyError, ValueError, RecursionError) as error:
        raise RecordingError(f"{path}: what `hpccd record` stored of the node is no JSON ({_text(error)})") from error
    if not isinstance(info, dict):
        raise RecordingError(f"{path}: what `hpccd record` stored of the node is no object but a {type(info).__name__}")
    return info


def recording_files(path: Path) -> list[Path]:
    """The .mcap files of a recording, in order. Raises RecordingError where there is none, or something else."""
    if path.is_dir():
        files = sorted(path.glob("*.mcap"), key=_split_number)
        if not files:
            raise RecordingError(f"the folder {path} holds no .mcap file")
    else:
        files = [path]
    for file in files:
        if not file.exists():
            raise RecordingError(f"{file} does not exist")
        # Of a pipe, a device or a socket nothing may ever come, and nothing can be read twice.
        if not file.is_file():
            raise RecordingError(f"{file} is no file that can be read again: copy the recording into one")
    return files


def _split_number(path: Path):
    number = path.stem.rpartition("_")[2]
    return (int(number) if number.isdecimal() else -1, path.name)


def check_ends(path: Path) -> None:
    """Raise RecordingError where `path` does not begin as an MCAP file, or does not end as a finished one."""
    try:
        with open(path, "rb") as stream:
            begin = stream.read(len(MCAP0_MAGIC))
            size = stream.seek(0, 2)
            stream.seek(max(0, size - len(MCAP0_MAGIC)))
            end = stream.read()
    except OSError as error:
        raise RecordingError(f"{path} cannot be read: {error.strerror}") from error
    if size == 0:
        raise RecordingError(f"{path} is empty")
    if begin != MCAP0_MAGIC:
        raise RecordingError(f"{path} is not an MCAP file (it begins with {begin!r})")
    if size < 2 * len(MCAP0_MAGIC) or end != MCAP0_MAGIC:
        raise RecordingError(
            f"{path} is cut off: its recorder was killed, still writes, or the copy is incomplete. "
            f"`hpccd doctor {path} --recover OUT.mcap` saves everything that can be read"
        )


@contextlib.contextmanager
def _explained(path):
    """Turn what reading damaged bytes raises into one clear error."""
    try:
        yield
    except DAMAGE as error:
        raise RecordingError(
            f"{path} is damaged ({_text(error)}). "
            f"`hpccd doctor {path} --recover OUT.mcap` saves everything that can be read"
        ) from error


def _text(error) -> str:
    return f"{type(error).__name__}: {error}".rstrip(": ")
