# SPDX-License-Identifier: Apache-2.0
"""Save what is readable of a cut-off or damaged MCAP file."""

from pathlib import Path

from mcap.records import Attachment, Channel, Message, Metadata, Schema

from hpccd_core.whole_file import whole_file
from hpccd_ros.bag.copied_file import CopiedFile
from hpccd_ros.bag.examine import Examination, examine
from hpccd_ros.bag.reader import RecordingError


def recover(source, target, compression=None) -> Examination:
    """Copy every whole record of `source` into the new, finished file `target`; the result tells what was there.

    compression: "none", "lz4", "zstd"; None: that of the source.
    Raises RecordingError where `source` holds nothing to save or `target` does not hold what was saved, FileExistsError
    where `target` exists.
    """
    source, target = Path(source), Path(target)
    first = examine(source)
    if first.message_count == 0:
        raise RecordingError(f"{source} has no complete message ({first.problem or 'an empty recording'})")
    with whole_file(target) as draft:
        with CopiedFile(
            draft,
            profile=first.profile,
            library=f"{first.library} (recovered)",
            compression=compression or first.compression,
        ) as file:
            found = examine(source, _Copy(file))
        check = examine(draft)
        if not check.sound or check.message_count != found.message_count:
            raise RecordingError(f"{target} was not written correctly: {check.problem}; check its disk")
    return found


class _Copy:
    """Visitor that writes each record into a new file."""

    def __init__(self, file: CopiedFile):
        self._file = file
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}

    def __call__(self, record):
        if isinstance(record, Schema):
            self._schemas[record.id] = record
        elif isinstance(record, Channel):
            self._channels[record.id] = record
            self._file.describe(self._schemas.get(record.schema_id), record)
        elif isinstance(record, Message):
            channel = self._channels[record.channel_id]
            self._file.message(self._schemas.get(channel.schema_id), channel, record)
        elif isinstance(record, Metadata):
            self._file.metadata(record)
        elif isinstance(record, Attachment):
            self._file.attachment(record)
