# SPDX-License-Identifier: Apache-2.0
"""Where a mesh is from step to step: its topologies, and the positions of each."""

import dataclasses

import numpy as np

from hpccd_ros.frames.types import Topology
from hpccd_ros.picture.page.packing import Grid, packed


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
