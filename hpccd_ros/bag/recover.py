# SPDX-License-Identifier: Apache-2.0
"""Save what is readable of a cut-off or damaged MCAP file."""

from pathlib import Path

from mcap.records import Attachment, Channel, Message, Metadata, Schema
from mcap.writer import CompressionType, Writer

from hpccd_ros.bag.examine import Examination, examine
from hpccd_ros.bag.reader import RecordingError
from hpccd_ros.bag.writer import COMPRESSIONS


def recover(source, target, compression=None) -> Examination:
    """Copy every whole record of `source` into the new, finished file `target`; the result tells what was there.

    compression: "none", "lz4", "zstd"; None: that of the source.
    Raises RecordingError where `source` holds nothing to save, FileExistsError where `target` exists.
    """
    source, target = Path(source), Path(target)
    first = examine(source)
    if first.message_count == 0:
        raise RecordingError(f"{source} holds no whole message ({first.problem or 'an empty recording'})")
    with open(target, "xb") as stream:
        try:
            copy = _Copy(Writer(stream, compression=_compression(compression or first.compression)), first)
            result = examine(source, copy)
            copy.finish()
        except BaseException:
            target.unlink()
            raise
    return result


def _compression(name) -> CompressionType:
    if name not in COMPRESSIONS:
        raise ValueError(f"compression {name!r} is none of {', '.join(COMPRESSIONS)}")
    return COMPRESSIONS[name]


class _Copy:
    """Visitor that writes each record it is given into a new file, with channel and schema ids of that file."""

    def __init__(self, writer: Writer, found: Examination):
        self._writer = writer
        self._schemas: dict[int, int] = {}
        self._channels: dict[int, int] = {}
        self._known: dict[tuple, int] = {}
        writer.start(profile=found.profile, library=f"{found.library} (recovered)")

    def __call__(self, record):
        writer = self._writer
        if isinstance(record, Schema):
            key = (record.name, record.encoding, record.data)
            self._schemas[record.id] = self._once(writer.register_schema, *key)
        elif isinstance(record, Channel):
            schema_id = self._schemas.get(record.schema_id, 0)  # 0: no schema, in the words of the format
            key = (record.topic, record.message_encoding, schema_id, tuple(record.metadata.items()))
            self._channels[record.id] = self._once(self._register_channel, *key)
        elif isinstance(record, Message):
            writer.add_message(
                self._channels[record.channel_id], record.log_time, record.data, record.publish_time, record.sequence
            )
        elif isinstance(record, Metadata) and record.name != "rosbag2":  # its counts are no longer true
            writer.add_metadata(record.name, dict(record.metadata))
        elif isinstance(record, Attachment):
            writer.add_attachment(
                record.create_time, record.log_time, record.name, record.media_type, record.data
            )

    def _once(self, register, *key) -> int:
        # A damaged file may tell the same again and again.
        if key not in self._known:
            self._known[key] = register(*key)
        return self._known[key]

    def _register_channel(self, topic, encoding, schema_id, metadata):
        return self._writer.register_channel(topic, encoding, schema_id, dict(metadata))

    def finish(self):
        self._writer.finish()
