# SPDX-License-Identifier: Apache-2.0
"""Recorded messages in the order in which the node took them, according to the lists in its results.

A first pass over the recording reads the lists and determines the order. The second pass then delays only messages that
reached the recorder earlier than the node. The node did not take messages that no result lists, with one exception: if
the lists begin late, or results are missing in between, messages sent until then are taken in the order of the
recording.
"""

from array import array
from collections import Counter, defaultdict, deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpccd_ros.bag.reader import RecordedMessage, Recording
from hpccd_ros.base.quoting import shortened
from hpccd_ros.frames import taken_inputs
from hpccd_ros.frames.taken_inputs import TakenInput
from hpccd_ros.frames.types import SceneFrame
from hpccd_ros.middleware import fields
from hpccd_ros.middleware.result_fields import ListedInputs, read_inputs
from hpccd_ros.replay.frames import FrameSource

_LATEST = 2**63 - 1  # recordings may have later times, lists cannot
_NOT_LISTED = -1

Key = tuple[str, int]  # key of a message: its topic as the node names it, and when it was sent


class _FrameKey(NamedTuple):
    """``inputs``: number that the node had taken; _NOT_LISTED: unknown, but before those that results list."""

    session: int
    inputs: int
    stamp: int


@dataclass(eq=False)
class OrderedResult:
    """Properties of a result before anything is computed.

    ``sent``, ``start``, ``end``: ns. ``problem``: why it cannot be verified, or "". ``listed``: None: it has no list.
    ``session``: how often the node had been configured before, or its process started. ``begun``: inputs of the session
    taken before those that results list without a gap up to this one. ``unlisted``: messages to take before its list.
    ``missing``: the first input of its list that the recording lacks, in words; ``early``: all that it lacks were sent
    before the first recorded message of their topic. ``complete``: all inputs of its list have been pushed.
    ``distances``: results about distances for its frame that have not been read.
    """

    sent: int
    step: int
    start: int = 0
    end: int = 0
    problem: str = ""
    listed: ListedInputs | None = None
    session: int = 0
    begun: int = 0
    unlisted: list[Key] = field(default_factory=list)
    missing: str = ""
    early: bool = True
    complete: bool = False
    distances: int = 0

    @property
    def start_keys(self) -> list[_FrameKey]:
        if self.problem or self.listed is None:
            return []
        keys = [_FrameKey(self.session, self.listed.start, self.start)]
        return keys + [_FrameKey(self.session, _NOT_LISTED, self.start)] * (self.listed.start <= self.begun)

    @property
    def end_keys(self) -> list[_FrameKey]:
        return [] if self.problem or self.listed is None else [_FrameKey(self.session, self.listed.end, self.end)]


class InputOrder:
    """Reads ``recording`` once; then give it the recorded inputs (`put`), and let it push them into ``source``.

    contacts: name of the topic of results; distances: of results about distances, or None. decode: topic -> decoder,
    for both. ``results``: in the order of the recording; ``of_distances``: for each result about distances the
    result about the same frame, or None. ``made``: frames so far. ``not_taken``: topic -> number of messages that the
    node did not take although it took later ones.
    """

    def __init__(
        self,
        recording: Recording,
        source: FrameSource,
        contacts: str,
        distances: str | None,
        decode: Mapping[str, Callable[[RecordedMessage], Any]],
    ) -> None:
        self._source = source
        self.results: list[OrderedResult] = []
        self.made = 0
        about_distances: list[OrderedResult] = []
        sent: dict[str, array] = defaultdict(lambda: array("q"))
        place: dict[str, array] = defaultdict(lambda: array("q"))
        topics = [*source.topics, contacts, *([distances] if distances else [])]
        for number, message in enumerate(recording.messages(topics)):
            if message.topic == contacts:
                self.results.append(_read(decode[contacts](message), message))
            elif message.topic == distances:
                about_distances.append(_read_stamp(decode[distances](message), message))
            else:
                name, time = self._key(message)
                sent[name].append(time)
                place[name].append(number)
        # Each file of a split recording begins with the messages in force: only the first copy of each counts.
        self._recorded: dict[str, NDArray[np.int64]] = {}
        self._place: dict[str, NDArray[np.int64]] = {}
        for name, times in sent.items():
            self._recorded[name], first = np.unique(np.frombuffer(times, np.int64), return_index=True)
            self._place[name] = np.frombuffer(place[name], np.int64)[first]
        self._settle()
        self.of_distances = self._nearest(about_distances)
        self._inbox: dict[Key, deque[RecordedMessage]] = {}
        self._frames: dict[_FrameKey, SceneFrame] = {}
        self._wanted = Counter(key for result in self.results for key in result.start_keys + result.end_keys)
        self._way = self._push_all()

    def put(self, message: RecordedMessage) -> None:
        key = self._key(message)
        if self._uses_left(key):
            held = self._inbox.setdefault(key, deque())
            if all(message.data != other.data for other in held):
                held.append(message)

    def advance(self) -> None:
        """Push all messages that can be pushed by now."""
        next(self._way, None)

    def frames(self, result: OrderedResult) -> tuple[SceneFrame | None, SceneFrame | None]:
        """The frames at the start and the end of its step, if they could be made. Call it once, when ``complete``."""
        start, end = (
            next((self._frames[key] for key in keys if key in self._frames), None)
            for keys in (result.start_keys, result.end_keys)
        )
        for key in result.start_keys + result.end_keys:
            self._wanted[key] -= 1
            if not self._wanted[key]:
                self._frames.pop(key, None)
        return start, end

    def _key(self, message: RecordedMessage) -> Key:
        return self._source.listed_name(message.topic), min(message.publish_time, _LATEST)

    def _settle(self) -> None:
        """Determine sessions, messages taken without being listed, and how often each message is taken."""
        runs = self._runs()
        listed: dict[str, list[NDArray[np.int64]]] = defaultdict(list)
        spans = []  # of each run: topic -> first and last time listed
        for run in runs:
            times: dict[str, list[NDArray[np.int64]]] = defaultdict(list)
            for result in run:
                topic, sent = np.asarray(result.listed.topic), np.asarray(result.listed.sent, np.int64)
                for index, name in enumerate(result.listed.topics):
                    times[name].append(sent[topic == index])
            joined = {name: np.concatenate(parts) for name, parts in times.items()}
            spans.append({name: (part.min(), part.max()) for name, part in joined.items() if len(part)})
            for name, part in joined.items():
                listed[name].append(part)
        of_all = {name: np.concatenate(parts) for name, parts in listed.items()}
        upto: dict[str, int] = {}
        for run, span in zip(runs, spans, strict=True):
            first = run[0]
            if first.begun:
                found = []
                for name, times in self._recorded.items():
                    until = span[name][0] if name in span else first.sent
                    free = (times < until) & ~np.isin(times, of_all.get(name, ()))
                    if name in upto:
                        free &= times > upto[name]
                    found += [
                        (place, name, time)
                        for place, time in zip(self._place[name][free].tolist(), times[free].tolist(), strict=True)
                    ]
                    upto[name] = max(upto.get(name, until), until)
                first.unlisted = [(name, time) for _, name, time in sorted(found)]
            for name, (_, last) in span.items():
                upto[name] = max(upto.get(name, last), last)
        for run in runs:
            for name, time in run[0].unlisted:
                listed[name].append(np.array([time]))
        self._uses = {name: np.unique(np.concatenate(parts), return_counts=True) for name, parts in listed.items()}
        self.not_taken: Counter[str] = Counter()
        for name, times in self._recorded.items():
            if len(of_all.get(name, ())):
                left = (times < of_all[name].max()) & ~np.isin(times, self._uses[name][0])
                self.not_taken[name] = int(left.sum())

    def _runs(self) -> list[list[OrderedResult]]:
        """Runs of results whose lists continue each other without a gap."""
        runs: list[list[OrderedResult]] = []
        session = taken = begun = 0
        for result in self.results:
            if result.listed is None:
                continue
            before = result.listed.before
            if not runs or before != taken:
                if runs and not before:
                    session += 1
                elif runs and before < taken:
                    # A node that was configured again begins its lists at 0. Either its first result was lost, or a
                    # list is wrong; in no case did this list begin before the recording.
                    result.problem = result.problem or "its list does not continue that of the previous result"
                begun = before
                runs.append([])
            result.session, result.begun, taken = session, begun, result.listed.end
            runs[-1].append(result)
        return runs

    def _nearest(self, about_distances: list[OrderedResult]) -> list[OrderedResult | None]:
        """For each result about distances the result about the same frame that was sent with it, or None if that is not
        recorded, even if a result for another frame with the same stamp is."""
        alike: dict[tuple[int, int], list[OrderedResult]] = defaultdict(list)
        for result in self.results:
            if not result.problem:
                alike[result.step, result.end].append(result)
        found: list[OrderedResult | None] = []
        nearest: dict[OrderedResult, tuple[int, int]] = {}  # time between both, number of distances
        for number, one in enumerate(about_distances):
            beside = alike.get((one.step, one.end), ())
            result = min(beside, key=lambda other, sent=one.sent: abs(other.sent - sent), default=None)
            found.append(result)
            if result is not None:
                nearest[result] = min(nearest.get(result, (_LATEST, 0)), (abs(result.sent - one.sent), number))
        for number, result in enumerate(found):
            if result is not None and nearest[result][1] != number:
                found[number] = None
            elif result is not None:
                result.distances += 1
        return found

    def _uses_left(self, key: Key) -> int:
        at = self._use(key)
        return int(self._uses[key[0]][1][at]) if at is not None else 0

    def _use(self, key: Key) -> int | None:
        times = self._uses[key[0]][0] if key[0] in self._uses else ()
        at = int(np.searchsorted(times, key[1])) if len(times) else 0
        return at if at < len(times) and times[at] == key[1] else None

    def _is_recorded(self, key: Key) -> bool:
        times = self._recorded.get(key[0], ())
        at = int(np.searchsorted(times, key[1])) if len(times) else 0
        return at < len(times) and times[at] == key[1]

    def _push_all(self) -> Iterator[None]:
        """Yields whenever the next message has not been read yet."""
        session = None
        for result in self.results:
            if result.listed is not None:
                if result.session != session:
                    session = result.session
                    self._source.restart(all_known=result.begun > 0)
                for key in result.unlisted:
                    while (message := self._take(key)) is None:
                        yield
                    self._made(result, _NOT_LISTED, self._source.push(message))
                for taken in result.listed:
                    if taken.topic.startswith(taken_inputs.EVENT):
                        self._happen(result, taken)
                        continue
                    key = taken.topic, taken.sent
                    if not self._is_recorded(key):
                        self._lack(result, taken)
                        continue
                    while (message := self._take(key)) is None:
                        yield
                    self._made(result, taken.number, self._source.push(message, taken.flags))
            result.complete = True

    def _take(self, key: Key) -> RecordedMessage | None:
        held = self._inbox.get(key)
        if not held:
            return None
        at = self._use(key)
        self._uses[key[0]][1][at] -= 1
        if not self._uses[key[0]][1][at]:
            del self._inbox[key]
        return held.popleft() if len(held) > 1 else held[0]

    def _made(self, result: OrderedResult, inputs: int, frames: list[SceneFrame]) -> None:
        self.made += len(frames)
        for frame in frames:
            if (key := _FrameKey(result.session, inputs, frame.stamp)) in self._wanted:
                self._frames[key] = frame

    def _happen(self, result: OrderedResult, taken: TakenInput) -> None:
        if taken.topic == taken_inputs.STOPPED and result.early:
            result.missing = ""  # all that could depend on it was forgotten
        try:
            self._made(result, taken.number, self._source.happen(taken.topic, taken.sent))
        except ValueError as error:
            result.missing, result.early = result.missing or str(error), False

    def _lack(self, result: OrderedResult, taken: TakenInput) -> None:
        times = self._recorded.get(taken.topic, ())
        result.early &= not len(times) or taken.sent < times[0]
        result.missing = result.missing or (
            f"it lists a message of {shortened(taken.topic)} sent at {taken.sent} ns, which the recording lacks"
        )


def _read(result: Any, message: RecordedMessage) -> OrderedResult:
    found = _read_stamp(result, message)
    try:
        found.listed = read_inputs(result)
        if found.listed is None:
            found.problem = "it does not list the inputs taken, although the first result of the recording does"
        found.start = fields.stamp_to_ns(result.start)
    except ValueError as error:
        found.problem = f"the result is malformed: {error}"
    return found


def _read_stamp(result: Any, message: RecordedMessage) -> OrderedResult:
    found = OrderedResult(min(message.publish_time, _LATEST), result.step)
    try:
        found.end = fields.stamp_to_ns(result.header.stamp)
    except ValueError as error:
        found.problem = f"the result is malformed: {error}"
    return found
