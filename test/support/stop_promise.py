# SPDX-License-Identifier: Apache-2.0
"""A model of the promise of `stop`: decides from all sent and received messages whether `stop` may be false. It shares
no code with the node; its times are true seconds, which no clock of the model shows."""

import math
from collections import defaultdict
from typing import NamedTuple


class Taken(NamedTuple):
    """A message that the node has taken. height: of its mesh; NaN: it is invalid, and rejected."""

    sent: float
    stamp: int
    height: float


class Promise:
    """moving: mesh -> whether each message is a place of its own ("frame"), or places lie between two ("between").
    fixed: meshes that stand still. error: s, by which a clock may be wrong."""

    def __init__(self, moving, fixed, timeout, distance, error):
        self.moving, self.fixed = moving, fixed
        self.timeout, self.distance, self.error = timeout, distance, error
        self.taken = defaultdict(list)  # (mesh, what of it) -> messages
        self.last = None  # heights of all meshes at both ends of the last step, and its stamp
        self.active, self.clocks = True, -math.inf  # clocks: when they disagreed last

    def take(self, mesh, what, *message):
        self.taken[mesh, what].append(Taken(*message))

    def used(self, mesh, height, stamp):
        """The messages of which a frame has this height of a mesh."""
        valid = [message for message in self.taken[mesh, "place"] if not math.isnan(message.height)]
        said = [message for message in valid if abs(message.height - height) < 1e-9]
        if said or self.moving.get(mesh) != "between":
            return said[-1:]
        before = [message for message in valid if message.stamp <= stamp]
        after = [message for message in valid if message.stamp >= stamp]
        if not before or not after:
            return []
        return [max(before, key=lambda m: (m.stamp, m.sent)), min(after, key=lambda m: (m.stamp, -m.sent))]

    def rejected_since(self, mesh, what, sent):
        return any(math.isnan(message.height) and message.sent > sent for message in self.taken[mesh, what])

    def broken(self, now):
        """Why stop must be true; "": it may be false."""
        if not self.active or self.last is None:
            return "no step"
        if now - self.clocks < self.timeout:
            return "clocks"
        start, end, stamp = self.last
        for mesh in (*self.moving, *self.fixed):
            used = self.used(mesh, end[mesh], stamp)
            if not used or self.rejected_since(mesh, "place", max(message.sent for message in used)):
                return f"{mesh} is not known"
            if mesh in self.moving and now - min(message.sent for message in used) > self.timeout + self.error:
                return f"{mesh} is old"
            for fixed in self.fixed if mesh in self.moving else ():
                if min(start[mesh] - end[fixed], end[mesh] - end[fixed]) <= self.distance:
                    return f"{mesh} is near"
        for (mesh, what), messages in self.taken.items():
            valid = [message.sent for message in messages if not math.isnan(message.height)]
            if what != "place" and self.rejected_since(mesh, what, max(valid, default=-math.inf)):
                return f"{what} of {mesh} is not known"
        return ""
