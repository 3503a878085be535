# SPDX-License-Identifier: Apache-2.0
"""A tree of coordinate frames over time, as in tf2, to transform positions into one frame. No ROS.

tf2 has no wheel. Its rules hold here: the last ten seconds of each frame, interpolation between samples, no
extrapolation. The size is bounded, because anyone may publish transforms. samples.py describes clocks that are set
back.
"""

from bisect import bisect_left

from hpccd_core.rigid.transform import IDENTITY, Rigid
from hpccd_ros.base.quoting import counted, listed, quoted
from hpccd_ros.frames.samples import Run, Samples
from hpccd_ros.frames.types import ALWAYS, OUTDATED, UNKNOWN_TIME

MOST_FRAMES = 1000  # about 500 MB if every frame were full
LONGEST_NAME = 255


class NoTransformError(LookupError):
    """There is no transform; ``final``: none can arrive for this stamp.

    ``connected``: transforms connect both frames, but not at this stamp. If they do not, ``source`` is the first
    frame. ``reported``: another warning gives the cause.
    """

    def __init__(
        self, text: str, final: bool, connected: bool = True, source: str = "", reported: bool = False
    ) -> None:
        super().__init__(text)
        self.final = final
        self.connected = connected
        self.source = source
        self.reported = reported


class _Edge(Samples[Rigid]):
    """Poses of a frame in its parent; ``always``: a static one. ``outdated``: a newer transform was rejected."""

    def __init__(self, parent: str) -> None:
        super().__init__()
        self.parent = parent
        self.always: Rigid | None = None
        self.outdated = False

    def at(self, child: str, stamp: int) -> tuple[Rigid, int]:
        """As `at`, with the time at which the transform was sent."""
        if self.always is not None:
            return self.always, OUTDATED if self.outdated else ALWAYS
        at = bisect_left(self.stamps, stamp)
        if not self.stamps:
            raise NoTransformError(f"none from {child!r} to {self.parent!r} since the clock was set back", final=False)
        if at == len(self.stamps):
            late = f"the last one from {child!r} to {self.parent!r} is from {self.stamps[-1]} ns"
            raise NoTransformError(f"{late}, before the stamp {stamp} ns", final=False)
        if self.stamps[at] == stamp:
            return self.samples[at], OUTDATED if self.outdated else self.sent[at]
        if self.in_doubt(stamp):
            ahead = f"the last one from {child!r} to {self.parent!r} is from {self.stamps[-1]} ns"
            text = f"{ahead}, far ahead of the stamp {stamp} ns and all earlier ones"
            raise NoTransformError(f"{text}; the next one decides whether it is valid", final=False)
        if at == 0:
            early = f"the oldest stored one from {child!r} to {self.parent!r} is from {self.stamps[0]} ns"
            raise NoTransformError(f"{early}, after the stamp {stamp} ns", final=True)
        before, after = self.stamps[at - 1], self.stamps[at]
        rigid = self.samples[at - 1].between(self.samples[at], (stamp - before) / (after - before))
        return rigid, OUTDATED if self.outdated else min(self.sent[at - 1], self.sent[at])


class TransformBuffer:
    """Transforms from child frames to their parents, and lookups between any two frames of the tree.

    ``received``: number of messages so far of each topic that may carry transforms, for the warnings; a text in place
    of a number: why the node does not subscribe to that topic.
    """

    def __init__(self) -> None:
        self.received: dict[str, int | str] = {}
        self._edges: dict[str, _Edge] = {}
        # When the newest rejected static transform was sent: of each child, and of any child.
        self._rejected_of: dict[str, int] = {}
        self._rejected_of_any = UNKNOWN_TIME
        self._run = Run(self._edges.values)

    def add(self, parent: str, child: str, rigid: Rigid, stamp: int | None, sent: int = UNKNOWN_TIME) -> int | None:
        """``rigid`` takes coordinates in ``child`` to coordinates in ``parent``; stamp ns, None: at all times. sent:
        when its message was sent.

        Returns the stamp of an earlier transform that was far ahead and was removed. Raises ValueError: an empty or too
        long name, a frame in itself, too many frames.
        """
        parent, child = parent.removeprefix("/"), child.removeprefix("/")
        if max(len(parent), len(child)) > LONGEST_NAME:
            raise ValueError(f"a frame's name has more than {LONGEST_NAME} characters")
        if not parent or not child or parent == child:
            raise ValueError(f"frames {parent!r} and {child!r}: two different names are needed")
        edge = self._edges.get(child)
        if edge is None and len(self._edges) >= MOST_FRAMES:
            raise ValueError(f"frame {child!r} exceeds the limit of {MOST_FRAMES} frames")
        if edge is None or edge.parent != parent:
            edge = self._edges[child] = _Edge(parent)
        if stamp is None:
            edge.always = rigid
            rejected = max(self._rejected_of.get(child, UNKNOWN_TIME), self._rejected_of_any)
            edge.outdated = UNKNOWN_TIME < sent <= rejected
            return None
        edge.outdated = False
        edge.always = None
        return self._run.add(stamp, [(edge, rigid)], sent)

    def rejected(self, child: str | None, static: bool, sent: int = UNKNOWN_TIME) -> bool:
        """A newer transform of ``child`` (None: the frame is unknown, so it may be any) was rejected: its pose is
        unknown until a valid transform arrives; a static one must have been sent later. static: on a topic of static
        transforms. Returns whether a known frame is concerned."""
        if static:
            self._keep_rejected(child, sent)
        if child is not None:
            edge = self._edges.get(child.removeprefix("/"))
            edges = [edge] if edge is not None else []
        else:
            edges = [edge for edge in self._edges.values() if (edge.always is not None) == static]
        for edge in edges:
            edge.outdated = True
        return bool(edges)

    def _keep_rejected(self, child: str | None, sent: int) -> None:
        """Remember a rejected static transform: an older one from another publisher may still arrive."""
        name = child.removeprefix("/") if child is not None else ""
        if child is None or (name not in self._rejected_of and len(self._rejected_of) >= MOST_FRAMES):
            self._rejected_of_any = max(self._rejected_of_any, sent)
        elif 0 < len(name) <= LONGEST_NAME:
            self._rejected_of[name] = max(self._rejected_of.get(name, UNKNOWN_TIME), sent)

    @property
    def begun(self) -> int:
        """How often their time went back, so that all were discarded."""
        return self._run.begun

    def forget_future(self, stamp: int) -> None:
        """A mesh restarts at ``stamp``: discard samples beyond it, except those that have restarted too."""
        self._run.forget_future(stamp)

    def lookup(self, source: str, target: str, stamp: int) -> Rigid:
        """The transform from coordinates in ``source`` to coordinates in ``target`` at ``stamp`` ns.

        Raises NoTransformError: unknown frame, no path, or no sample around the stamp.
        """
        return self.lookup_sent(source, target, stamp)[0]

    def lookup_sent(self, source: str, target: str, stamp: int) -> tuple[Rigid, int]:
        """As `lookup`, with the time at which the oldest transform used was sent."""
        source, target = source.removeprefix("/"), target.removeprefix("/")
        if source == target:
            return IDENTITY, ALWAYS
        up, down = self._ancestors(source), self._ancestors(target)
        common = next((frame for frame in up if frame in set(down)), None)
        if common is None:
            raise _unconnected(source, target)
        below, sent_below = self._to_ancestor(target, common, stamp)
        above, sent_above = self._to_ancestor(source, common, stamp)
        return below.inverse().after(above), min(sent_below, sent_above)

    def latest(self, source: str, target: str) -> int | None:
        """The last stamp, ns, at which `lookup` connects the two; None: at any time.

        Raises NoTransformError: unknown frame, no path, or no stamp that all samples have reached.
        """
        source, target = source.removeprefix("/"), target.removeprefix("/")
        up, down = self._ancestors(source), self._ancestors(target)
        common = next((frame for frame in up if frame in set(down)), None)
        if common is None:
            raise _unconnected(source, target)
        timed = [
            edge
            for path in (up, down)
            for frame in path[: path.index(common)]
            if (edge := self._edges[frame]).always is None
        ]
        if not all(edge.stamps for edge in timed):
            raise _unconnected(source, target)
        return min((edge.stamps[-1] for edge in timed), default=None)

    def account(self, frame: str) -> str:
        """In words: messages received, and known frames, first those whose name is ``frame`` with another prefix.
        Bounded."""
        topics = [f"{topic} {_messages(count)}" for topic, count in self.received.items()]
        last = frame.rpartition("/")[2]
        known = list(dict.fromkeys(name for child, edge in self._edges.items() for name in (child, edge.parent)))
        alike = [name for name in known if name.rpartition("/")[2] == last]
        frames = f"frames known: {listed(dict.fromkeys([*alike, *known])) or 'none'}"
        return "; ".join([f"received: {', '.join(topics)}", frames] if topics else [frames])

    def _ancestors(self, frame: str) -> list[str]:
        path = [frame]
        while (edge := self._edges.get(path[-1])) is not None:
            if edge.parent in path:
                text = f"the frames {' -> '.join(path)} form a loop"
                raise NoTransformError(text, final=False, connected=False, source=frame)
            path.append(edge.parent)
        return path

    def _to_ancestor(self, frame: str, ancestor: str, stamp: int) -> tuple[Rigid, int]:
        rigid, sent = IDENTITY, ALWAYS
        while frame != ancestor:
            edge = self._edges[frame]
            step, of_step = edge.at(frame, stamp)
            rigid, sent = step.after(rigid), min(sent, of_step)
            frame = edge.parent
        return rigid, sent


def _messages(count: int | str) -> str:
    return count if isinstance(count, str) else counted(count, "message") if count else "no messages"


def _unconnected(source: str, target: str) -> NoTransformError:
    text = f"no transform connects {quoted(source)} and {quoted(target)}"
    return NoTransformError(text, final=False, connected=False, source=source)
