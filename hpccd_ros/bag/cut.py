# SPDX-License-Identifier: Apache-2.0
"""Cut a part out of a recording, including all messages in force at its beginning, so that it replays by itself."""

import dataclasses
import re
import struct
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from decimal import Decimal
from pathlib import Path

from hpccd_core.whole_file import whole_file
from hpccd_ros.bag.copied_file import CopiedFile
from hpccd_ros.bag.decode import make_decoder
from hpccd_ros.bag.examine import examine
from hpccd_ros.bag.reader import RecordedMessage, Recording, RecordingError, StoredMessage
from hpccd_ros.base.version import package_version
from hpccd_ros.middleware import transform_topics
from hpccd_ros.middleware.message_types import (
    DESCRIPTION,
    JOINT_STATES,
    MARKER,
    POINTS,
    POSE,
    SHAPE,
    TOPOLOGY,
    VERTICES,
)

# Types of topics on which a message is in force until the next one.
_HOLDS = (TOPOLOGY, VERTICES, POINTS, SHAPE, MARKER, POSE, DESCRIPTION)
# Types of messages that name frames or joints; for each of these the last message is in force. Positions are
# interpolated between two of them, also for earlier frames: so all messages of the last seconds are kept, as in
# transform_buffer.py.
_NAMES = {
    JOINT_STATES: lambda message: message.name,
    transform_topics.STAMPED: lambda message: [message.child_frame_id],
    transform_topics.TF2: lambda message: [transform.child_frame_id for transform in message.transforms],
}
_RECENT = 10 * 10**9  # ns
_STAMP = {"<": struct.Struct("<iI"), ">": struct.Struct(">iI")}
_HEADER_FIRST = re.compile(r"\A(\s|#[^\n]*\n)*std_msgs/(msg/)?Header\s")
_TIME = re.compile(r"(?P<seconds>\d+(\.\d*)?)s?|(?P<stamp>\d+)ns")


@dataclasses.dataclass(frozen=True)
class Time:
    """A time in a recording. value: ns since its first message was received, or a stamp in ns."""

    value: int
    is_stamp: bool = False

    @classmethod
    def of(cls, text: str) -> "Time":
        """From "12.5", "12.5s" (seconds) or "1700000000000000000ns" (a stamp). Raises ValueError."""
        if (match := _TIME.fullmatch(text)) is None:
            raise ValueError(
                f"{text!r} is not a time; give seconds from the beginning, such as 12.5, or a stamp, such as "
                "1700000000123456789ns"
            )
        if match["stamp"]:
            return cls(int(match["stamp"]), is_stamp=True)
        return cls(int(Decimal(match["seconds"]) * 10**9))


@dataclasses.dataclass(frozen=True)
class Part:
    """The part that was cut out. begin, end: ns since the first message of the whole recording was received. count:
    messages. in_force: how many of them were received before its beginning."""

    begin: int
    end: int
    count: int
    in_force: int


def cut(
    recording: Recording,
    target: Path,
    begin: Time | None,
    end: Time | None,
    compression: str | None = None,
    watch: Callable[[Iterable], Iterable] = iter,
) -> Part:
    """Copy the messages received from `begin` (included) to `end` (excluded) into the new, finished file `target`.

    If `begin` is a stamp, the part begins with the first message whose header has that stamp or a later one; if `end`
    is a stamp, the part ends with the last message whose header has that stamp or an earlier one (included). None: no
    limit. compression: None: that of the recording. watch: wraps each pass over the messages, to show progress.
    Raises RecordingError if no message is in between, FileExistsError if `target` exists.
    """
    first = next((stored.message.log_time for stored in recording.records()), None)
    if first is None:
        raise RecordingError(f"{recording.path} has no messages, so nothing can be cut out of it")
    start, stop = _limits(recording, first, begin, end, watch)
    with whole_file(target) as draft:
        count, last, in_force = _copy(recording, draft, first, start, stop, compression, watch)
        check = examine(draft)
        if not check.sound or check.message_count != count:
            raise RecordingError(f"{target} was not written correctly: {check.problem}; check its disk")
    return Part(start - first, min(last + 1, stop) - first, count, in_force)


def _copy(recording, draft, first, start, stop, compression, watch) -> tuple[int, int, int]:
    """(messages, receive time of the last one, how many of them were in force at the beginning)."""
    kept = _InForce(recording)
    count = 0
    last = first
    with CopiedFile(
        draft,
        profile=recording.profile,
        library=f"hpccd {package_version()} (cut)",
        compression=compression or recording.compression,
    ) as file:
        for record in recording.metadata:
            file.metadata(record)
        for record in recording.stored_attachments:
            file.attachment(record)
        for stored in watch(recording.records()):
            time = stored.message.log_time
            if time >= stop:
                break
            last = time
            # A description received at the time of the cut replaces the previous one: a replay accepts only one.
            if time < start or (time == start > first and getattr(stored.schema, "name", "") == DESCRIPTION):
                kept.add(stored)
                continue
            for earlier in kept.take():
                # In this file its receive time is that of the cut; the time at which it was sent is unchanged.
                file.message(*earlier[:2], dataclasses.replace(earlier.message, log_time=start))
                count += 1
            file.message(*stored)
            count += 1
        if not count:
            last = max(stored.message.log_time for stored in recording.records())
            raise RecordingError(
                f"{recording.path} has no message in this part; its messages are from 0 to {seconds(last - first)} s"
            )
    return count, last, kept.taken


def seconds(nanoseconds: int) -> str:
    """The exact number of seconds, as `Time.of` reads it."""
    return f"{nanoseconds // 10**9}.{nanoseconds % 10**9:09}"


def _limits(recording, first, begin, end, watch) -> tuple[int, int]:
    """Receive times, ns: of the first message of the part, and of the first one after it."""
    start = first + begin.value if begin is not None and not begin.is_stamp else first
    stop = first + end.value if end is not None and not end.is_stamp else 2**64
    by_stamp = [time for time in (begin, end) if time is not None and time.is_stamp]
    if by_stamp:
        found: list[int | None] = [None, None]
        for stamp, received in _stamps(recording, watch):
            if begin in by_stamp and stamp >= begin.value and found[0] is None:
                found[0] = received
            if end in by_stamp and stamp <= end.value:
                found[1] = received + 1
        for time, place in zip((begin, end), found, strict=True):
            if time in by_stamp and place is None:
                way = "later" if time is begin else "earlier"
                raise RecordingError(
                    f"{recording.path} has no message with the stamp {time.value} ns or {way}; give another stamp, or "
                    "seconds from the beginning"
                )
        start, stop = found[0] or start, found[1] or stop
    if start > stop and begin is not None and end is not None:
        raise RecordingError(f"{recording.path}: the part would end before it begins; swap --from and --to")
    return start, stop


def _stamps(recording: Recording, watch) -> Iterator[tuple[int, int]]:
    """(stamp, receive time) of all messages that begin with a header, except topologies, whose stamp has no effect."""
    topics = [
        topic.name
        for topic in recording.topics.values()
        if _HEADER_FIRST.match(topic.definition) and topic.type_name != TOPOLOGY
    ]
    for message in watch(recording.messages(topics)):
        if len(message.data) >= 12:
            sec, nanosec = _STAMP["<" if message.data[1] & 1 else ">"].unpack_from(message.data, 4)
            yield sec * 10**9 + nanosec, message.log_time


class _InForce:
    """The messages from before a part that are in force in it. ``taken``: how many `take` has returned."""

    def __init__(self, recording: Recording) -> None:
        self._recording = recording
        self._decoders: dict[str, Callable | None] = {}
        self._last: dict[tuple[str, str], tuple[int, StoredMessage]] = {}
        self._recent: deque[tuple[int, list[tuple[str, str]], StoredMessage]] = deque()
        self._number = 0
        self.taken = 0

    def add(self, stored: StoredMessage) -> None:
        """Add the next message, in the order in which they were received."""
        topic = self._recording.topics.get(stored.channel.topic)
        if topic is None or stored.schema is None or topic.type_name != stored.schema.name:
            return
        self._number += 1
        if topic.type_name in _NAMES:
            names = [(topic.name, name) for name in self._names(topic, stored)]
            self._recent.append((self._number, names, stored))
            while self._recent[0][2].message.log_time < stored.message.log_time - _RECENT:
                self._forget()
        elif topic.type_name in _HOLDS or "transient_local" in topic.offered_qos:
            self._last[topic.name, ""] = self._number, stored

    def take(self) -> list[StoredMessage]:
        """All messages in force, and forget them."""
        if not self._number:
            return []
        found = dict(self._last.values()) | {number: stored for number, _, stored in self._recent}
        self._last.clear()
        self._recent.clear()
        self._number = 0
        self.taken += len(found)
        return [stored for _, stored in sorted(found.items())]

    def _forget(self) -> None:
        number, names, stored = self._recent.popleft()
        for name in names:
            self._last[name] = number, stored

    def _names(self, topic, stored) -> Iterable[str]:
        if topic.name not in self._decoders:
            try:
                self._decoders[topic.name] = make_decoder(topic)
            except RecordingError:
                self._decoders[topic.name] = None  # its package is not installed: no replay can use the topic
        decode, message = self._decoders[topic.name], stored.message
        if decode is None:
            return [""]
        try:
            recorded = RecordedMessage(topic.name, message.log_time, message.publish_time, 0, message.data)
            return _NAMES[topic.type_name](decode(recorded))
        except RecordingError:
            return [""]  # an invalid message, which a replay ignores
