# SPDX-License-Identifier: Apache-2.0
"""Check the frames and steps of a part of a sequence."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from .. import arguments
from ..contacts import Contacts
from ..detector import Detector
from ..proximity import Gap
from ..sequences import Frame, FrameSequence, SequenceError
from .frame_scene import FrameScene
from .report import FrameResult, StepResult

# Of a frame: time and memory grow with the number of pairs, to 8 s and 0.7 GB for this many.
MOST_MESHES = 1_000
# Pairs of vertices at one position or within the separation: a step has about 13 contacts of 100 bytes for each.
MOST_NEAR = 4_000_000
# Vertices of which these pairs are counted.
SAMPLED = 32


@dataclasses.dataclass(frozen=True)
class Options:
    """The options of a check.

    Parameters
    ----------
    separation : float
        Different meshes that are closer than this are reported, in the unit of the sequence; 0: only surfaces that
        touch.
    weld : bool
        Join vertices of a mesh that are at one position in the first frame of the sequence.
    changes : bool
        Accept meshes that change from frame to frame. Steps across a change are not checked.
    """

    separation: float = 0.0
    weld: bool = False
    changes: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "separation", arguments.length("separation", self.separation))


@dataclasses.dataclass(frozen=True)
class State:
    """A frame in the scene of its meshes. Scene and detectors are those of the frame before while the meshes stay."""

    frame: Frame
    scene: FrameScene
    x: NDArray[np.float64]
    motion: Detector
    distance: Detector


class Checker:
    """Reads frames of a sequence and checks frames and steps.

    Parameters
    ----------
    sequence : FrameSequence
    options : Options
    threads : int
        Threads of the core; 0: all cores.
    """

    def __init__(self, sequence: FrameSequence, options: Options, threads: int = 0) -> None:
        if options.weld and options.changes:
            raise SequenceError("--weld: joins vertices as in the first frame; do not combine it with --changes")
        self._sequence, self._options, self._threads = sequence, options, threads
        self._last: State | None = None
        self._first: Frame | None = None

    def state(self, index: int) -> State:
        """The frame with this number.

        Raises
        ------
        SequenceError
            A file cannot be used, or the meshes differ from those of the frame asked for before, without `changes`.
        """
        if self._last is not None and self._last.frame.index == index:
            return self._last
        frame, last = self._sequence.frame(index), self._last
        if last is not None and last.frame.meshes is frame.meshes:
            self._last = dataclasses.replace(last, frame=frame, x=last.scene.positions(frame))
            self._reject_many_near(self._last)
            return self._last
        if last is not None and not self._options.changes:
            raise SequenceError(
                f"{frame.name}: {_change(last.frame, frame)} since {last.frame.name}, so no motion is known between "
                "them; --changes checks each frame, and leaves out this step"
            )
        if self._options.weld and self._first is None:
            self._first = frame if index == 0 else self._sequence.frame(0)
        if len(frame.meshes) > MOST_MESHES:
            raise SequenceError(
                f"{frame.name}: has {len(frame.meshes):,} meshes, each pair of which is measured; check at most "
                f"{MOST_MESHES:,} at once, or join meshes"
            )
        scene = FrameScene(frame.meshes, self._options.separation, self._first)
        motion, distance = (
            Detector(of, backend="cpu", threads=self._threads, outputs=("points",)) for of in (scene.scene, scene.apart)
        )
        self._last = State(frame, scene, scene.positions(frame), motion, distance)
        self._reject_many_near(self._last)
        return self._last

    def _reject_many_near(self, state: State) -> None:
        """Raises SequenceError if the contacts of a frame would not fit into memory, by an estimate."""
        x, separation, ends = state.x, self._options.separation, np.cumsum(state.scene.counts)
        samples = np.unique(np.linspace(0, len(x) - 1, min(SAMPLED, len(x))).astype(np.intp))
        first_axis = np.ascontiguousarray(x[:, 0])
        mesh_of = np.searchsorted(ends, np.arange(len(x)), side="right")
        equal = near = 0
        for vertex in samples:
            beside = np.flatnonzero(np.abs(first_axis - x[vertex, 0]) <= separation)  # few: one axis rejects most
            apart = np.abs(x[beside] - x[vertex]).max(axis=1)
            equal += int((apart == 0).sum()) - 1
            near += int((apart[mesh_of[beside] != mesh_of[vertex]] <= separation).sum())
        equal, near = (count * len(x) // (2 * len(samples)) for count in (equal, near))
        if equal > MOST_NEAR:
            raise SequenceError(
                f"{state.frame.name}: about {equal:,} pairs of vertices are at one position; this frame has collapsed, "
                "check the others without it"
            )
        if near > MOST_NEAR:
            raise SequenceError(
                f"{state.frame.name}: about {near:,} pairs of vertices of different meshes are within the separation "
                f"{separation:g}; give a smaller one, in the unit of the positions (--separation)"
            )

    def frame(self, state: State, step: StepResult | None = None) -> FrameResult:
        """The defects of a frame. step: that to the next one; if it has no contact, the frame has none either."""
        gaps = state.distance.distances(state.x)
        smallest = min((gap.distance for gap in gaps), default=np.inf)
        inside = [pair for gap in gaps for pair in _inside(gap)]
        count = len(state.motion.intersections(state.x))
        near = False
        is_free = step is not None and step.contacts == 0
        if len(state.frame.meshes) > 1 and not is_free and (self._options.separation or not count):
            contacts = state.motion.detect(state.x, state.x)  # exact; distances are rounded
            apart = contacts.mesh_a != contacts.mesh_b
            near = bool(apart.any())
            if not (count or apart.all()):
                smallest = 0.0
        distance = float(smallest) if np.isfinite(smallest) else None
        return FrameResult(state.frame.index, state.frame.name, count, distance, tuple(inside), near)

    def step(self, start: State, end: State) -> tuple[StepResult, Contacts | None]:
        """The result of the step between two frames, and its contacts; None where the meshes changed."""
        indices = start.frame.index, end.frame.index
        if start.scene is not end.scene:
            return StepResult(*indices, None, None), None
        contacts = end.motion.detect(start.x, end.x)
        return StepResult(*indices, len(contacts), float(contacts.first_toc) if len(contacts) else None), contacts


def check_part(
    sequence: FrameSequence, options: Options, begin: int, end: int, threads: int = 0
) -> Iterator[tuple[FrameResult, StepResult | None]]:
    """Check the frames ``begin`` to ``end - 1``, and the step from each of them to the next frame, if there is one.

    Results do not depend on where a sequence is cut into parts.

    Parameters
    ----------
    sequence : FrameSequence
    options : Options
    begin, end : int
        Frames.
    threads : int
        Threads of the core; 0: all cores.

    Yields
    ------
    tuple of FrameResult and StepResult
        The results of one frame; None in place of the step after the last frame of the sequence.

    Raises
    ------
    SequenceError
        As :func:`hpccd_core.sequences.open_sequence`, or meshes change and `options.changes` is not set.
    """
    checker = Checker(sequence, options, threads)
    for index in range(begin, end):
        state, step = checker.state(index), None
        if index + 1 < len(sequence):
            step = checker.step(state, checker.state(index + 1))[0]
        yield checker.frame(state, step), step


def _inside(gap: Gap) -> list[tuple[str, str]]:
    """(inner mesh, outer mesh) of a gap."""
    a, b = (gap.mesh_a, gap.mesh_b), (gap.mesh_b, gap.mesh_a)
    return {"a": [a], "b": [b], "both": [a, b]}.get(gap.inside or "", [])


def _change(before: Frame, after: Frame) -> str:
    """How the meshes of a frame differ from those of another one, in a few words."""
    old, new = ({mesh.name: mesh for mesh in frame.meshes} for frame in (before, after))
    for name in [*old, *new]:
        if name not in new:
            return f"mesh {name!r} is missing"
        if name not in old:
            return f"mesh {name!r} is new"
        if old[name].n_vertices != new[name].n_vertices:
            return f"mesh {name!r} changed from {old[name].n_vertices:,} to {new[name].n_vertices:,} vertices"
    return "faces changed"
