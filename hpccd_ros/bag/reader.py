# SPDX-License-Identifier: Apache-2.0
"""Reads recordings: one MCAP file, or a folder of them, as written by rosbag2 and `hpccd record`."""

import contextlib
import dataclasses
import heapq
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

from mcap.records import Attachment, Channel, Message, Metadata, Schema
from mcap.writer import MCAP0_MAGIC

from hpccd_ros.bag.mcap_file import McapFile
from hpccd_ros.bag.mcap_records import DAMAGE, ZSTD, opened
from hpccd_ros.bag.metadata_checksum import HPCCD_RECORD
from hpccd_ros.base.errors import UserError
from hpccd_ros.base.quoting import listed, printable


class RecordingError(UserError, ValueError):
    """A recording cannot be read, or not used for the request; the text names the file and the remedy."""

    def __init__(self, text: str):
        super().__init__(printable(text))  # names in it are those of the recording


@dataclasses.dataclass(frozen=True)
class RecordedTopic:
    name: str
    type_name: str  # "pkg/msg/Name"
    definition: str  # text of the recorded schema
    type_hash: str  # "RIHS01_...", or "" if the recorder did not store it
    offered_qos: str  # rosbag2 YAML, or ""
    count: int


@dataclasses.dataclass(frozen=True)
class RecordedMessage:
    topic: str
    log_time: int  # ns since the epoch, when the recorder received it
    publish_time: int  # ns since the epoch, when it was sent
    sequence: int  # the publisher's sequence number, 0 if the recorder did not store it
    data: bytes  # CDR, with its 4-byte header


class StoredMessage(NamedTuple):
    """A message with its channel and schema. schema: None: the channel has none."""

    schema: Schema | None
    channel: Channel
    message: Message


class Recording:
    """A finished recording. Use as a context manager.

    path: an `.mcap` file or a folder of them.
    Raises RecordingError if it does not exist, is not an MCAP file, is truncated or damaged, or has no ROS 2 messages;
    so does `messages` for damage that is found while reading.

    topics: dict topic name -> RecordedTopic.
    skipped: topic name -> why its messages are not ROS 2 messages, and so are skipped.
    info: data of `hpccd record` about the node (dict), or None for other recorders.
    attachments: name -> bytes of the attached files, such as mesh files.
    """

    def __init__(self, path):
        self.path = Path(path)
        self.files = recording_files(self.path)
        self._stack = contextlib.ExitStack()
        self.topics: dict[str, RecordedTopic] = {}
        self.skipped: dict[str, str] = {}
        self.info: dict | None = None
        self.attachments: dict[str, bytes] = {}
        try:
            self._opened = [self._open(file) for file in self.files]
            self._check_usable()
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

    @property
    def notes(self) -> list[str]:
        """Sentences about the recording for the user."""
        skipped = listed(f"{topic} ({why})" for topic, why in self.skipped.items())
        return [printable(f"skipped, because these are not ROS 2 messages: {skipped}")] if skipped else []

    def messages(self, topics=None) -> Iterator[RecordedMessage]:
        """Messages in the order in which they were received, over all files. `topics`: only these names."""

        def wanted(schema, channel):
            return (topics is None or channel.topic in topics) and not _foreign(channel, schema)

        for _, channel, message in self._records(wanted):
            yield RecordedMessage(channel.topic, message.log_time, message.publish_time, message.sequence, message.data)

    def records(self) -> Iterator[StoredMessage]:
        """Like `messages`, but with channel and schema, and including messages that are not of ROS 2."""
        return self._records(lambda schema, channel: True)

    @property
    def metadata(self) -> list[Metadata]:
        """Metadata records of all files; equal ones once."""
        found = [record for file in self._opened for record in file.metadata]
        return [record for number, record in enumerate(found) if record not in found[:number]]

    @property
    def stored_attachments(self) -> list[Attachment]:
        """The `attachments` as records."""
        found = [record for file in self._opened for record in file.attachments]
        return list({record.name: record for record in reversed(found)}.values())

    @property
    def profile(self) -> str:
        return self._opened[0].header.profile

    @property
    def compression(self) -> str:
        return self._opened[0].compression or "none"

    def _records(self, wanted: Callable[[Schema | None, Channel], bool]) -> Iterator[StoredMessage]:
        streams = [self._read(*opened, wanted) for opened in zip(self.files, self._opened, strict=True)]
        yield from heapq.merge(*streams, key=lambda stored: stored.message.log_time)

    def _open(self, path) -> McapFile:
        check_ends(path)
        with _explained(path):
            stream = self._stack.enter_context(opened(path))
            file = McapFile(stream, path.stat().st_size)
        for number, channel in file.channels.items():
            schema = file.schemas.get(channel.schema_id)
            if why := _foreign(channel, schema):
                self.skipped.setdefault(channel.topic, why)
            else:
                self._add_topic(channel, schema, file.counts.get(number, 0))
        for record in file.metadata:
            try:
                info = stored_info(record)
            except ValueError as error:
                raise RecordingError(f"{path}: {error}") from error
            self.info = info if self.info is None else self.info
        for attachment in file.attachments:  # files that became necessary later are in later parts only
            self.attachments.setdefault(attachment.name, attachment.data)
        return file

    def _check_usable(self) -> None:
        profile = self._opened[0].header.profile
        if not self.topics and (self.skipped or profile not in ("", "ros2")):
            found = listed(f"{topic} ({why})" for topic, why in self.skipped.items()) or "none"
            raise RecordingError(
                f"{self.path} has no ROS 2 messages (MCAP profile {profile!r}; topics: {found}); record it with "
                "`hpccd record` or `ros2 bag record -s mcap`"
            )

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

    def _read(self, path, file, wanted):
        schemas = {number: file.schemas.get(channel.schema_id) for number, channel in file.channels.items()}
        numbers = {number for number, channel in file.channels.items() if wanted(schemas[number], channel)}
        with _explained(path):
            for channel, message in file.messages(numbers):
                yield StoredMessage(schemas[channel.id], channel, message)


def _foreign(channel, schema) -> str | None:
    """Why the messages of a channel are not ROS 2 messages, or None."""
    if channel.message_encoding != "cdr":
        return f"encoding {channel.message_encoding!r}"
    return None if schema is not None else "no schema"


def stored_info(record: Metadata) -> dict | None:
    """Data of `hpccd record` about the node; None for other records. Raises ValueError if it cannot be read."""
    if record.name != HPCCD_RECORD:
        return None
    try:
        info = json.loads(record.metadata["json"])
    except (KeyError, ValueError, RecursionError) as error:
        raise ValueError(f"what `hpccd record` stored about the node is not JSON ({_text(error)})") from error
    if not isinstance(info, dict):
        raise ValueError(f"what `hpccd record` stored about the node is not an object but a {type(info).__name__}")
    return info


def recording_files(path: Path) -> list[Path]:
    """The .mcap files of a recording, in order. Raises RecordingError if there is none, or something else."""
    try:
        files = _files_of_folder(path) if path.is_dir() else [path]
        for file in files:
            if not file.exists():
                raise RecordingError(f"{file} does not exist")
            # A pipe, device or socket may never return data, and cannot be read twice.
            if not file.is_file():
                raise RecordingError(f"{file} is not a regular file: copy the recording into one")
            _check_format(file)
    except OSError as error:
        raise RecordingError(f"{path} cannot be read: {error.strerror}") from error
    return files


def _files_of_folder(path: Path) -> list[Path]:
    if any(not packed.with_suffix("").exists() for packed in path.glob("*.mcap.zstd")):
        raise RecordingError(f"{path} {_PACKED}: `zstd -d {path}/*.mcap.zstd`")
    if files := sorted(path.glob("*.mcap"), key=_split_number):
        return files
    if any(path.glob("*.db3*")):
        raise RecordingError(_convert(path, path))
    raise RecordingError(f"the folder {path} has no .mcap file")


_PACKED = "is compressed as whole files (`ros2 bag record --compression-mode file`); unpack it"


def _check_format(file: Path) -> None:
    """Raise RecordingError for other formats of rosbag2, with the command that converts them."""
    try:
        with opened(file) as stream:
            begin = stream.read(16)
    except OSError:
        return  # reading it raises the error
    if begin.startswith(b"SQLite format 3\0"):
        raise RecordingError(_convert(file, file.parent if (file.parent / "metadata.yaml").exists() else file))
    if begin.startswith(ZSTD):
        raise RecordingError(f"{file} {_PACKED}: `zstd -d {file}`")


def _convert(path: Path, source: Path) -> str:
    target = source.absolute().with_name(f"{source.absolute().stem}-mcap")
    return (
        f"{path} is not an MCAP file but an sqlite3 recording; convert it: `echo 'output_bags: [{{uri: {target}, "
        f"storage_id: mcap, all: true}}]' > convert.yaml && ros2 bag convert -i {source} -o convert.yaml`"
    )


def _split_number(path: Path):
    number = path.stem.rpartition("_")[2]
    return (int(number) if number.isdecimal() else -1, path.name)


def check_ends(path: Path) -> None:
    """Raise RecordingError if `path` does not begin like an MCAP file, or does not end like a finished one."""
    try:
        with opened(path) as stream:
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
    """Turn errors from damaged bytes into one clear error."""
    try:
        yield
    except DAMAGE as error:
        raise RecordingError(
            f"{path} is damaged ({_text(error)}). "
            f"`hpccd doctor {path} --recover OUT.mcap` saves everything that can be read"
        ) from error


def _text(error) -> str:
    return f"{type(error).__name__}: {error}".rstrip(": ")
