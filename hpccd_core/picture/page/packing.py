# SPDX-License-Identifier: Apache-2.0
"""Positions and contacts of all steps as arrays of integers in short byte strings, which `assets/unpack.js` reads."""

import dataclasses
import zlib
from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

import hpccd_core as hc
from hpccd_core.picture.lines import Depth, polylines

# Level of zlib: 9 takes twice as long for 1 % less.
LEVEL = 7


def packed(values: NDArray[np.unsignedinteger]) -> bytes:
    """(G,N,W) uint16 or uint32: differences from group to group, of these from row to row, folded so that small
    negative ones are small too, then all lowest bytes, all second ones and so on, through zlib.

    Groups are frames, rows are vertices: neighbours move alike, so most differences need one byte. All is computed
    modulo 2^16 or 2^32: nothing overflows.
    """
    differences = values.copy()
    differences[1:] -= values[:-1]
    differences[:, 1:] -= differences[:, :-1].copy()
    bits = 8 * differences.itemsize
    negative = differences >> (bits - 1)
    folded = (differences << 1) ^ (0 - negative)
    planes = np.ascontiguousarray(folded, f"<u{differences.itemsize}").view(np.uint8).reshape(-1, differences.itemsize)
    return zlib.compress(planes.T.tobytes(), LEVEL)


class Grid:
    """Places rounded to whole steps from `low`, of which `STEPS` reach over the longest side of the box around them.

    low, high: (3,), of the box. step: the unit; nothing is moved by more than half of it along an axis.
    """

    STEPS = 65535

    def __init__(self, low, high):
        self.low, self.high = np.asarray(low, np.float64), np.asarray(high, np.float64)
        # Halves: the difference of two finite numbers may be infinite.
        step = 2.0 * (float(np.max(0.5 * self.high - 0.5 * self.low)) / self.STEPS)
        self.step = step or 1.0

    def rounded(self, places) -> NDArray[np.uint16]:
        """(...,3) steps from `low`."""
        halves = 0.5 * np.asarray(places, np.float64) - 0.5 * self.low
        return np.clip(np.rint(halves / (0.5 * self.step)), 0, self.STEPS).astype(np.uint16)

    def described(self) -> dict:
        """For the page."""
        return {"low": self.low.tolist(), "high": self.high.tolist(), "step": self.step}


class Topology(Protocol):
    """What does not move of a mesh: faces (F, 3), edges (E, 2) beside theirs, of this many vertices."""

    @property
    def version(self) -> int: ...
    @property
    def n_vertices(self) -> int: ...
    @property
    def faces(self) -> NDArray[np.integer[Any]]: ...
    @property
    def edges(self) -> NDArray[np.integer[Any]]: ...


@dataclasses.dataclass
class _Motion:
    """A topology and its frames (V,3)."""

    topology: Topology
    frames: list[np.ndarray]


class MeshPositions:
    """Positions of one mesh at the steps of a page. bytes: what they take in the page before they are compressed."""

    def __init__(self, name: str):
        self.name = name
        self.bytes = 0
        self._motions: list[_Motion] = []
        self._shown: list[tuple[int, int] | None] = []

    def add(self, topology: Topology, vertices: np.ndarray) -> None:
        """At the next step. Where nothing has moved, as in static meshes, nothing is stored."""
        if not self._motions or self._motions[-1].topology is not topology:
            self._motions.append(_Motion(topology, []))
        frames = self._motions[-1].frames
        if not frames or not np.array_equal(frames[-1], vertices):
            frames.append(vertices)
            self.bytes += 2 * vertices.size
        self._shown.append((len(self._motions) - 1, len(frames) - 1))

    def add_nothing(self) -> None:
        """The next step has no frame."""
        self._shown.append(None)

    def described(self) -> tuple[dict, dict[str, bytes]]:
        """(what the page says of it, {"faces-T", "edges-T", "positions-T": bytes} of each topology T)."""
        frames = [frame for motion in self._motions for frame in motion.frames if len(frame)]
        low = np.min([frame.min(axis=0) for frame in frames], axis=0) if frames else np.zeros(3)
        high = np.max([frame.max(axis=0) for frame in frames], axis=0) if frames else np.zeros(3)
        grid = Grid(low, high)
        blobs, topologies = {}, []
        for number, motion in enumerate(self._motions):
            topology = motion.topology
            topologies.append(
                {
                    "version": topology.version,
                    "vertices": topology.n_vertices,
                    "faces": len(topology.faces),
                    "edges": len(topology.edges),
                    "frames": len(motion.frames),
                }
            )
            blobs[f"faces-{number}"] = packed(np.asarray(topology.faces, np.uint32).reshape(1, -1, 3))
            blobs[f"edges-{number}"] = packed(np.asarray(topology.edges, np.uint32).reshape(1, -1, 2))
            blobs[f"positions-{number}"] = packed(grid.rounded(np.stack(motion.frames)))
        return {"name": self.name, **grid.described(), "topologies": topologies, "shown": self._shown}, blobs


# Drawn of one step: more could not be told apart, and would be most of the page.
MOST = 20_000
# Steps of times of impact, which are 0..1.
TIMES = 65535


def sampled(toc: NDArray[np.float64]) -> NDArray[np.intp]:
    """The rows that are drawn of a step, ascending: at most MOST, evenly by time."""
    by_time = np.argsort(toc, kind="stable")
    return np.sort(by_time if len(toc) <= MOST else by_time[np.arange(MOST) * len(toc) // MOST])


class ContactColumns:
    """Contacts of each step: numbers of their meshes, their features in these, times and points."""

    def __init__(self) -> None:
        self._meshes = [np.empty((0, 2), np.uint32)]
        self._features = [np.empty((0, 4), np.uint32)]
        self._toc, self._points = [np.empty(0)], [np.empty((0, 3))]

    def add(self, meshes, features, toc, points) -> None:
        """N contacts of the next step, vertex-face first.

        meshes: (N, 2). features: (N, 4), two numbers of each side, the second one NO_INDEX for vertices and faces. toc:
        (N,). points: (N, 3).
        """
        self._meshes.append(np.asarray(meshes, np.uint32))
        self._features.append(np.asarray(features, np.uint32))
        self._toc.append(toc)
        self._points.append(np.asarray(points, np.float64))

    def described(self) -> tuple[dict, dict[str, bytes]]:
        """(what the page says of them, {column: bytes})."""
        toc, points = np.concatenate(self._toc), np.concatenate(self._points)
        grid = Grid(points.min(axis=0), points.max(axis=0)) if len(points) else Grid(np.zeros(3), np.zeros(3))
        blobs = {
            "meshes": packed(np.concatenate(self._meshes)[None]),
            "features": packed(np.concatenate(self._features)[None]),
            # One row: times are in no order that would make differences small.
            "toc": packed(np.rint(toc * TIMES).astype(np.uint16).reshape(1, 1, -1)),
            "points": packed(grid.rounded(points)[None]),
        }
        return {**grid.described(), "count": len(toc), "times": TIMES}, blobs


class FaceLists:
    """For each step the faces of each mesh that intersect another mesh: their numbers in it, mesh after mesh."""

    def __init__(self) -> None:
        self._faces = [np.empty(0, np.uint32)]

    def add(self, marked: Sequence[NDArray[np.bool_]]) -> list[int]:
        """marked: (F,) of each mesh. How many of each mesh they are."""
        faces = [np.flatnonzero(of_mesh).astype(np.uint32) for of_mesh in marked]
        self._faces += faces
        return [len(of_mesh) for of_mesh in faces]

    def packed(self) -> bytes:
        return packed(np.concatenate(self._faces).reshape(1, -1, 1))


# Points of intersection curves that are drawn of one step.
MOST_OF_CURVES = 4_000


class Curves:
    """The intersection curves of each step, and then the starts and ends of its depths."""

    def __init__(self) -> None:
        self._points: list[np.ndarray] = [np.empty((0, 3))]
        self._lengths: list[int] = []

    def add(self, contours: Sequence[hc.Contour], depths: Sequence[Depth]) -> tuple[int, int]:
        """How many curves are drawn of this step, and how many points they have."""
        lines = polylines(contours, MOST_OF_CURVES)
        lengths = [len(line) for line in lines]
        self._points += lines + [np.stack([depth.start, depth.end]) for depth in depths]
        self._lengths += lengths
        return len(lengths), sum(lengths)

    def described(self) -> tuple[dict, dict[str, bytes]]:
        """(what the page says of them, {name: bytes})."""
        points = np.concatenate(self._points)
        grid = Grid(points.min(axis=0), points.max(axis=0)) if len(points) else Grid(np.zeros(3), np.zeros(3))
        lengths = np.array(self._lengths, np.uint32)
        blobs = {"points": packed(grid.rounded(points)[None]), "lengths": packed(lengths.reshape(1, -1, 1))}
        return {**grid.described(), "count": len(points), "lines": len(lengths)}, blobs
