# SPDX-License-Identifier: Apache-2.0
"""Whether to stop, and why: what is known about the steps so far, and how old it is. No ROS.

The promise: `stop` is false only if, for every enabled pair, the position of each moving mesh is known from messages
sent within the last `stop_timeout` seconds, each static mesh has a valid position, no newer message about either was
rejected, both stay farther apart than `stop_distance` throughout the last step, and neither lies inside the other.

While `stop` is true, the scale of the speed is 0. Otherwise it is that of the last step.

Ages are the system time minus the DDS source timestamp; they are accurate to within `clock_error`, by which the clocks
of the machines may differ.
"""

import threading
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

from hpccd_ros.base.clocks import CLOCK_ERROR, Clocks, ClockWatch
from hpccd_ros.detect.approach import Slowdown
from hpccd_ros.frames.drops import Aspect, Reason, Rejection
from hpccd_ros.frames.types import ALWAYS, OUTDATED, UNKNOWN_TIME, Origin
from hpccd_ros.node.stop_doubts import Doubt, Source, WatchedScene, leaves_unknown, text_of

_STILL = Slowdown(0.0)

# Part of the time-out after which silence makes stop true, so that listeners receive it within the time-out.
IN_TIME = 0.95


class Cause(StrEnum):
    """Why stop is true."""

    INACTIVE = "inactive"  # the node does not detect
    UNANSWERED = "unanswered"  # no step has a result yet
    NEAR = "near"
    INSIDE = "inside"  # a mesh lies inside another one
    REJECTED = "rejected"  # a message was rejected
    FAILED = "failed"  # a detection
    SILENT = "silent"  # no recent result
    HELD_UP = "held_up"  # the thread that publishes stop did not run
    CLOCKS = "clocks"  # ages cannot be trusted


@dataclass(frozen=True)
class Why:
    """text: a sentence without its full stop."""

    cause: Cause
    text: str


class StopState:
    """Updated by the threads that learn something; read by the one that publishes, which waits in `next`.

    distance: that asked for; a result for a smaller one does not count. timeout: s after which listeners must have
    received that a result is too old, from when the oldest message was sent that determines the position of a moving
    mesh at the end of its step. approach_time: s; a result for a shorter one has no scale. busy: whether a
    frame is being processed. clock_error: s. rises: how often stop became true, by cause.
    """

    def __init__(
        self,
        distance: float,
        timeout: float,
        busy: Callable[[], bool] = lambda: False,
        *,
        approach_time: float = 0.0,
        clock_error: float = CLOCK_ERROR,
        clocks: Clocks | None = None,
    ) -> None:
        self.distance = distance
        self.approach_time = approach_time
        self._held_up = timeout
        self._timeout_ns = round(IN_TIME * 1e9 * timeout)
        self._busy = busy
        self._clocks = clocks or Clocks()
        self._clock_error_ns = round(1e9 * clock_error)
        self._ages = ClockWatch(clock_error, timeout)
        self._condition = threading.Condition()
        self._active = self._closed = False
        self._scene = WatchedScene()
        self._why: Why | None = Why(Cause.INACTIVE, "the node is not active")
        self._doubts: dict[tuple[Cause, Source], Doubt] = {}
        self._newest: dict[str, int] = {}  # mesh or topic -> when the newest message received was sent
        self._robots: Mapping[str, str] = {}
        self._in_use: Mapping[str, Origin] = {}
        self._outdated = ""  # a mesh whose position in the last clear step was outdated
        self._slowdown = self._published_slowdown = _STILL  # of the last clear step
        self._unpublished: Why | None = None
        self._published: Why | None = None
        self._looked: float | None = None  # when the publishing thread last ran, in steady time
        self._oldest, self._oldest_of = 0, ""  # oldest message of the last result: when it was sent, and its mesh
        self.rises: Counter[Cause] = Counter()

    def begin(self, scene: WatchedScene) -> None:
        """Steps of this scene will be answered from now on. Doubts about the inputs of its meshes stay."""
        with self._condition:
            self._scene = scene
            self._doubts = {
                (cause, source): replace(doubt, meshes=meshes)
                for (cause, source), doubt in self._doubts.items()
                if (meshes := scene.concerned(source.what, source.name)) or not source.of_mesh
            }
        self._set_cause(Cause.UNANSWERED, "no step has a result since the node was activated", active=True)

    def end(self, text: str = "the node is not active") -> None:
        """Results from now on no longer count."""
        self._set_cause(Cause.INACTIVE, text, active=False)

    def close(self) -> None:
        """For good: `next` returns at once, with a reason."""
        self.end("the node has ended")
        with self._condition:
            self._closed = True
            self._condition.notify_all()

    @property
    def closed(self) -> bool:
        return self._closed

    def first(self) -> None:
        """A frame came that ends no step: nothing is known of the motion to it."""
        self._set_cause(Cause.UNANSWERED, "no step has a result since the stream, or a topology, restarted")

    def answered(
        self,
        near: tuple[str, str] | None,
        distance: float,
        origins: Sequence[Origin],
        slowdown: Slowdown = _STILL,
        approach_time: float = 0.0,
        *,
        inside: tuple[str, str] | None = None,
    ) -> None:
        """The result of a step for this distance and time of approach. near: names of two meshes that came within it;
        None: none did. origins: of the meshes at its end, in the order of the scene. inside: names of a mesh and of
        that inside which it lies at the end."""
        with self._condition:
            if not self._active:
                return
            scene, now = self._scene, self._clocks.system()
            by_name = self._in_use = dict(zip(scene.meshes, origins, strict=True))
            moving = [
                (origin.place, mesh)
                for mesh, moves, origin in zip(scene.meshes, scene.moving, origins, strict=True)
                if moves and origin.place != ALWAYS
            ]
            for sent, mesh in moving:
                self._ages.hear(f"a message of mesh {mesh}", 1e-9 * (sent - now), self._clocks.steady())
            if not self._ages.why(self._clocks.steady()):  # otherwise it is unknown which of two messages is newer
                self._doubts = {key: item for key, item in self._doubts.items() if not item.settled(by_name)}
            if near or inside:
                self._oldest, self._oldest_of = min(moving, default=(ALWAYS, ""))
        if near:
            pair = " and ".join(near)
            self._set_cause(Cause.NEAR, f"{pair} came within {distance:g} of each other in the last step")
            return
        if inside:
            self._set_cause(Cause.INSIDE, f"{inside[0]} is inside {inside[1]}")
            return
        with self._condition:
            if distance < self.distance or scene is not self._scene or not self._active:
                return
            before = self._now()
            if text := self._ages.why(self._clocks.steady()):
                self._set_cause(Cause.CLOCKS, text)
                return
            self._outdated = next((mesh for mesh, origin in by_name.items() if origin.place == OUTDATED), "")
            self._oldest, self._oldest_of = min(moving, default=(ALWAYS, ""))
            self._why = None
            self._slowdown = slowdown if approach_time >= self.approach_time else _STILL
            self._rise(before)

    def changed(self, distance: float, approach_time: float = 0.0) -> None:
        """Another distance or time of approach is asked for from now on."""
        with self._condition:
            if approach_time > self.approach_time:
                self._slowdown = _STILL  # until a step has a result for it
            self.approach_time = approach_time
            self._condition.notify_all()
        larger, self.distance = distance > self.distance, distance
        if larger:
            self._set_cause(Cause.UNANSWERED, f"no step has a result since stop_distance became {distance:g}")

    def rejected(self, rejection: Rejection) -> None:
        """The meshes that the message is about are unknown until a valid message about them is in use."""
        if rejection.reason is Reason.DETECTION_FAILED:
            self.failed("the detection of the last step failed")
            return
        with self._condition:
            if leaves_unknown(rejection):
                source = Source(rejection.what, rejection.mesh, rejection.aspect)
                self._doubt(Cause.REJECTED, source, rejection.sent, text_of(rejection))

    def failed(self, text: str) -> None:
        """A step was not answered: earlier frames say nothing about the present."""
        with self._condition:
            if self._active:
                self._doubt_all(Cause.FAILED, text)

    def robots(self, doubts: Mapping[str, str]) -> None:
        """Robots with a newer description that is not in use, and why; this replaces the previous ones."""
        with self._condition:
            before = self._now()
            self._robots = dict(doubts)
            self._rise(before)

    def received(self, what: str, name: str, info: Mapping[str, int]) -> None:
        """An input message was received; name: of its mesh or topic; info: source_timestamp and received_timestamp, ns
        of the system clock."""
        sent, received = info["source_timestamp"], info["received_timestamp"]
        self._newest[name] = max(self._newest.get(name, 0), sent)
        ahead = 1e-9 * (sent - min(received or ALWAYS, self._clocks.system()))
        if ahead <= 0:
            return
        with self._condition:
            before = self._now()
            if self._ages.hear(what, ahead, self._clocks.steady()):
                self._rise(before)

    def why(self) -> Why | None:
        """As it is now; None: no reason to stop."""
        with self._condition:
            return self._now()

    def slowdown(self) -> Slowdown:
        """As it is now."""
        with self._condition:
            return _STILL if self._now() is not None else self._slowdown

    def next(self, until: float) -> Why | None:
        """The state to publish: waits until it differs from the one published last, but no longer than ``until``, in
        steady time. Each rise is published, however short; a scale is part of the state while there is no reason."""
        with self._condition:
            while True:
                steady, system = self._read_clocks()
                why = self._unpublished or self._now()
                if self._unpublished or (why is None) != (self._published is None) or steady >= until or self._closed:
                    break
                if why is None and self._slowdown.scale != self._published_slowdown.scale:
                    break
                left = until - steady
                if why is None:
                    left = min(left, 1e-9 * (self._oldest + self._timeout_ns - system))
                self._condition.wait(max(left, 0.0))
            if why is not None and self._published is None:
                self.rises[why.cause] += 1
            self._unpublished, self._published, self._published_slowdown = None, why, self._slowdown
            return why

    def _read_clocks(self) -> tuple[float, int]:
        """The clocks, as the publishing thread reads them, several times in each time-out if it can run."""
        steady, system = self._clocks.steady(), self._clocks.system()
        before = self._now()
        self._ages.look(steady, system)
        if self._active and self._why is None and (text := self._ages.why(steady)):
            self._why = Why(Cause.CLOCKS, text)  # the age of the last step is unknown now
        gap = 0.0 if self._looked is None else steady - self._looked
        if gap > self._held_up:
            self._doubt_all(Cause.HELD_UP, f"the thread that publishes stop did not run for {gap:.3g} s")
        self._looked = steady
        # If the clock was set back, later frames are newer than messages rejected before. For inputs without an age
        # this cannot be decided: their doubt stays until the clock has caught up.
        moving = set(self._scene.concerned(None, ""))
        for key, doubt in self._doubts.items():
            if doubt.sent > system and doubt.aspect is Aspect.PLACE and moving.issuperset(doubt.meshes):
                self._doubts[key] = replace(doubt, sent=system)
        self._rise(before)
        return steady, system

    def _now(self) -> Why | None:
        if self._why is not None:
            if self._why.cause in (Cause.NEAR, Cause.INSIDE) and (old := self._too_old()):
                return replace(old, text=f"{old.text}; the last result: {self._why.text}")
            return self._why
        for (cause, _), doubt in self._doubts.items():
            if doubt.meshes:
                return Why(cause, doubt.text)
        if self._outdated:
            text = f"a newer message about the position of mesh {self._outdated} was rejected, or is not in use yet"
            return Why(Cause.REJECTED, text)
        for name, text in self._robots.items():
            return Why(Cause.REJECTED, f"robot {name}: {text}")
        if text := self._ages.why(self._clocks.steady()):
            return Why(Cause.CLOCKS, text)
        return self._too_old()

    def _too_old(self) -> Why | None:
        """Whether the messages of the last step with a result say nothing about the present."""
        age = self._clocks.system() - self._oldest
        if self._oldest == ALWAYS or -self._clock_error_ns <= age < self._timeout_ns:
            return None
        if age < 0:
            return Why(Cause.CLOCKS, f"a message of mesh {self._oldest_of} was sent {-1e-9 * age:.3g} s in the future")
        if self._oldest == UNKNOWN_TIME:
            text = f"the middleware does not provide source timestamps for messages of mesh {self._oldest_of}"
            return Why(Cause.SILENT, text)
        since = "a later frame is being processed" if self._busy() else "no later frame has a result"
        text = f"mesh {self._oldest_of}: the last result is based on a message sent {1e-9 * age:.3g} s ago; {since}"
        return Why(Cause.SILENT, text)

    def _doubt_all(self, cause: Cause, text: str) -> None:
        self._doubt(cause, Source(None, "", Aspect.PLACE), None, text)

    def _doubt(self, cause: Cause, source: Source, sent: int | None, text: str) -> None:
        """sent: when the message was sent; None, UNKNOWN_TIME: unknown."""
        before, now, key = self._now(), self._clocks.system(), (cause, source)
        meshes, aspect = self._scene.concerned(source.what, source.name), source.aspect
        if not meshes and source.of_mesh:
            return
        # Later than the messages in use and those received that may still come into use, whatever the clocks said.
        used = [origin.of(aspect) for mesh, origin in self._in_use.items() if mesh in meshes]
        came = [one for mesh in meshes if (one := self._newest.get(mesh, 0)) > now]
        sent = max([min(sent or now, now), *(one for one in used if one != ALWAYS), *came])
        if key in self._doubts:
            sent = max(sent, self._doubts.pop(key).sent)
        self._doubts[key] = Doubt(meshes, aspect, sent, text)
        self._rise(before)

    def _set_cause(self, cause: Cause, text: str, *, active: bool | None = None) -> None:
        with self._condition:
            if active is not None:
                self._active = active
            elif not self._active:
                return
            before = self._now()
            self._why = Why(cause, text)
            self._rise(before)

    def _rise(self, before: Why | None) -> None:
        """The state has changed. before: why stop was true before the change."""
        if before is None and self._unpublished is None:
            self._unpublished = self._now()
        self._condition.notify_all()
