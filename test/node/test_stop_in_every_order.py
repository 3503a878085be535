# SPDX-License-Identifier: Apache-2.0
"""`stop` is false only when its promise allows it, after every sequence of a few events.

The search visits all sequences of EVENTS up to a depth, and each state once. It drives the class that decides about
`stop`, whose clocks are those of the search; the network, the executor and the detection thread are states of the
search itself, so that each message may wait in them. `stop_promise` decides what is allowed.
"""

import copy
import math
from collections import Counter

import pytest
from stop_promise import Promise

from hpccd_ros.base.clocks import Clocks
from hpccd_ros.frames.drops import Reason, Rejection
from hpccd_ros.frames.types import ALWAYS, Origin
from hpccd_ros.node.stop_doubts import WatchedScene
from hpccd_ros.node.stop_state import StopState

TIMEOUT, ERROR = 0.5, 0.02
DISTANCES = 0.25, 0.75
FAR, NEAR, BAD = 1.0, 0.5, math.nan  # heights of the hand above the table; NEAR is so for one of the distances
MOST_WAITING = 2
SCENE = WatchedScene(("hand", "table"), (True, False))
JUMP = 0.35  # s; less than TIMEOUT, so that a wrong age may look right


class World:
    """The node's `StopState`, and what surrounds it."""

    def __init__(self):
        self.now, self.offset = 1000.0, 0.0  # true time, and what the system clock adds to it
        self.offset_seen = 0.0  # at the last look
        self.sent = []  # messages that the executor has not taken: (true time, by its clock, height)
        self.frames = []  # at most one that waits for its detection
        self.held = False  # the thread that publishes
        self.active = self.streaming = False
        self.word = True
        self.distance = DISTANCES[1]
        self.promise = Promise({"hand": "frame"}, ["table"], TIMEOUT, self.distance, ERROR)
        self.promise.take("table", "place", self.now, 0, 0.0)
        self.state = StopState(
            self.distance, TIMEOUT, clock_error=ERROR, clocks=Clocks(lambda: self.now, lambda: self.system())
        )
        self.activate()

    def system(self):
        return round(1e9 * (self.now + self.offset))

    # Events. Each returns whether it can happen now.

    def send(self, height):
        if len(self.sent) == MOST_WAITING:
            return False
        # Heights differ, so that the model knows which message a frame has.
        number = 1e-4 * len(self.promise.taken["hand", "place"]) + 1e-5 * len(self.sent)
        self.sent.append((self.now, self.system(), height + number))
        return True

    def send_far(self):
        return self.send(FAR)

    def send_near(self):
        return self.send(NEAR)

    def send_bad(self):
        return self.send(BAD)

    def take(self):
        """The executor takes a message. A valid one completes a frame, which replaces one that waits."""
        if not self.sent or not self.active:
            return False
        now, stamp, height = self.sent.pop(0)
        self.promise.take("hand", "place", now, 0, height)
        if 1e-9 * (stamp - self.system()) > ERROR:
            self.promise.clocks = self.now
        self.state.received("a message", "hand", {"source_timestamp": stamp, "received_timestamp": self.system()})
        if math.isnan(height):
            self.state.rejected(Rejection("hand", Reason.NOT_FINITE, sent=stamp))
        else:
            self.frames = [(stamp, height)]
        return True

    def detect(self):
        """The first frame of a stream ends no step."""
        if not self.frames or not self.active:
            return False
        ((stamp, height),) = self.frames
        self.frames = []
        if not self.streaming:
            self.streaming = True
            self.state.first()
            self.promise.last = None
            return True
        near = ("hand", "table") if height < self.distance else None
        self.state.answered(near, self.distance, [Origin(stamp), Origin(ALWAYS)])
        self.promise.last = {"hand": height, "table": 0.0}, {"hand": height, "table": 0.0}, 0
        return True

    def fail(self):
        """The detection of a step fails."""
        if not self.frames or not self.active or not self.streaming:
            return False
        self.frames = []
        self.state.rejected(Rejection("hand", Reason.DETECTION_FAILED))
        return True

    def activate(self):
        if self.active:
            return False
        self.active = self.promise.active = True
        self.promise.last = None
        self.state.begin(SCENE)
        return True

    def deactivate(self):
        if not self.active:
            return False
        self.active = self.streaming = self.promise.active = False
        self.sent, self.frames = [], []
        self.state.end()
        return True

    def restart(self):
        """The stream, or a topology, restarts."""
        if not self.streaming:
            return False
        self.state.first()
        self.promise.last = None
        return True

    def change_distance(self):
        """The parameter changes; the detection thread uses the new value from its next step on."""
        self.distance = self.promise.distance = DISTANCES[self.distance == DISTANCES[0]]
        self.state.changed(self.distance)
        return True

    def wait(self):
        self.now += 0.6 * TIMEOUT
        return True

    def hold(self):
        self.held = not self.held
        return True

    def set_back(self):
        self.offset -= JUMP
        return True

    def set_forward(self):
        self.offset += JUMP
        return True

    def look(self):
        """The thread that publishes looks after each event unless it is held up. Returns whether `stop` is false, and
        whether it may be."""
        if self.held:
            return False, False
        if self.offset != self.offset_seen:  # two jumps that cancel each other make no message seem younger
            self.offset_seen, self.promise.clocks = self.offset, self.now
        self.word = self.state.next(0.0) is not None
        broken = self.promise.broken(self.now)
        assert self.word or not broken, f"stop is false, but {broken}"
        return not self.word, not broken

    # The search.

    def save(self):
        own = {name: value for name, value in vars(self).items() if name not in ("state", "promise")}
        own |= {"sent": list(self.sent), "frames": list(self.frames)}
        promise = vars(self.promise) | {"taken": copy.copy(self.promise.taken)}
        for key, messages in promise["taken"].items():
            promise["taken"][key] = list(messages)
        state = {
            name: copy.copy(value) if isinstance(value, dict) or name == "_ages" else value
            for name, value in vars(self.state).items()
        }
        return own, promise, state

    def load(self, saved):
        for target, values in zip((self, self.promise, self.state), saved, strict=True):
            vars(target).update(values)
        # `saved` is loaded once for each event, and an event changes these in place.
        own, promise, state = self.save()
        for target, values in zip((self, self.promise, self.state), (own, promise, state), strict=True):
            vars(target).update(values)

    def key(self):
        """Two states with the same key have the same future: times are relative to now, older ones are alike."""
        state, ages, system = self.state, self.state._ages, self.system()

        def ago(ns):
            return ns if ns == ALWAYS else round(1e-7 * (system - ns))

        def past(seconds):
            return round(1e2 * max(min(self.now - seconds, 20.0), -20.0))

        messages = self.promise.taken["hand", "place"]
        last = self.promise.last and self.promise.used("hand", self.promise.last[1]["hand"], 0)
        return (
            tuple((past(now), ago(stamp), _kind(height)) for now, stamp, height in self.sent),
            tuple((ago(stamp), _kind(height)) for stamp, height in self.frames),
            self.distance,
            (
                self.offset != self.offset_seen,
                self.held,
                self.active,
                self.streaming,
                self.word,
                past(self.promise.clocks),
            ),
            last
            and (past(last[0].sent), _kind(last[0].height), self.promise.rejected_since("hand", "place", last[0].sent)),
            tuple(past(m.sent) for m in messages[-1:]),
            (
                state._active,
                state._why and state._why.cause,
                state._outdated,
                ago(state._oldest),
                ago(state._newest.get("hand", 0)),
            ),
            tuple(sorted((key[0], ago(doubt.sent), doubt.meshes) for key, doubt in state._doubts.items())),
            tuple((mesh, ago(origin.place)) for mesh, origin in state._in_use.items()),
            (state._unpublished and state._unpublished.cause, state._published and state._published.cause),
            state._looked and past(state._looked),
            ages._offset is not None and round(1e2 * (1e-9 * system - self.now - ages._offset)),
            (past(ages._steady), past(ages._until)),
        )


def _kind(height):
    return "bad" if math.isnan(height) else round(height, 1)


EVENTS = (
    World.send_far,
    World.send_near,
    World.send_bad,
    World.take,
    World.detect,
    World.fail,
    World.restart,
    World.deactivate,
    World.activate,
    World.change_distance,
    World.wait,
    World.hold,
    World.set_back,
    World.set_forward,
)


def search(depth, begin=()):
    """Visit all states within this many events. Returns how many states, transitions, and looks there were at which
    stop was false and at which it might have been."""
    world, seen, counts, path = World(), {}, Counter(), []
    world.look()
    for event in begin:
        assert event(world)
        world.look()

    def visit(left):
        key = world.key()
        if seen.get(key, -1) >= left:
            return
        counts["states"] += key not in seen
        seen[key] = left
        if not left:
            return
        saved = world.save()
        for event in EVENTS:
            world.load(saved)
            if not event(world):
                continue
            path.append(event.__name__)
            try:
                false, allowed = world.look()
            except AssertionError as error:
                raise AssertionError(f"{error}, after {', '.join(path)}") from error
            counts["transitions"] += 1
            counts["false"] += false
            counts["allowed"] += allowed
            visit(left - 1)
            path.pop()

    visit(depth)
    return counts


# Up to the first false: two messages, since the first one begins the stream.
CLEAR = [World.send_far, World.take, World.detect] * 2


BEGINNINGS = pytest.mark.parametrize("begin", [(), CLEAR], ids=["from the start", "from false"])


def look_at_all(depth, begin):
    counts = search(depth, begin)
    print(f"{depth} events: {dict(counts)}")
    assert counts["transitions"] > 10_000
    if begin:
        assert counts["false"] >= counts["allowed"] / 3 > 100


@BEGINNINGS
def test_every_order_of_five_events(begin):
    look_at_all(5, begin)


@pytest.mark.long
@pytest.mark.timeout(3600)
@BEGINNINGS
def test_every_order_of_eight_events(begin):
    """Minutes: there are more than a million states."""
    look_at_all(8, begin)
