# SPDX-License-Identifier: Apache-2.0
"""A new MCAP file with records of other files."""

from pathlib import Path

from mcap.records import Attachment, Channel, Message, Metadata, Schema
from mcap.writer import Writer

from hpccd_ros.bag.bag_file import COMPRESSIONS
from hpccd_ros.bag.metadata_checksum import ROSBAG2_RECORD


class CopiedFile:
    """A context manager: its end finishes the file. `path` does not exist yet, or is replaced.

    compression: "none", "lz4" or "zstd". Raises ValueError for another one.
    """

    def __init__(self, path: Path, *, profile: str, library: str, compression: str):
        if compression not in COMPRESSIONS:
            raise ValueError(f"compression {compression!r} is none of {', '.join(COMPRESSIONS)}")
        self._stream = open(path, "wb")
        self._writer = Writer(self._stream, compression=COMPRESSIONS[compression])
        self._header = {"profile": profile, "library": library}
        self._numbers: dict[tuple, int] = {}
        self._channels: dict[int, tuple[Channel, int]] = {}

    def __enter__(self) -> "CopiedFile":
        self._writer.start(**self._header)
        return self

    def __exit__(self, error, *_) -> None:
        with self._stream:
            if error is None:
                self._writer.finish()

    def describe(self, schema: Schema | None, channel: Channel) -> int:
        """The number of a channel in this file; channels with equal descriptions have one number."""
        known = self._channels.get(id(channel))
        if known is None or known[0] is not channel:
            number = 0  # in MCAP: no schema
            if schema is not None:
                number = self._once(self._writer.register_schema, schema.name, schema.encoding, schema.data)
            key = (channel.topic, channel.message_encoding, number, tuple(channel.metadata.items()))
            known = self._channels[id(channel)] = channel, self._once(self._register_channel, *key)
        return known[1]

    def message(self, schema: Schema | None, channel: Channel, message: Message) -> None:
        number = self.describe(schema, channel)
        self._writer.add_message(number, message.log_time, message.data, message.publish_time, message.sequence)

    def metadata(self, record: Metadata) -> None:
        """Add a metadata record, except that of rosbag2: its counts are those of the other file."""
        if record.name != ROSBAG2_RECORD:
            self._writer.add_metadata(record.name, dict(record.metadata))

    def attachment(self, record: Attachment) -> None:
        self._writer.add_attachment(record.create_time, record.log_time, record.name, record.media_type, record.data)

    def _register_channel(self, topic, encoding, schema_id, metadata):
        return self._writer.register_channel(topic, encoding, schema_id, dict(metadata))

    def _once(self, register, *key) -> int:
        if key not in self._numbers:
            self._numbers[key] = register(*key)
        return self._numbers[key]
