# SPDX-License-Identifier: Apache-2.0
"""A scene: meshes, and the positions of their vertices in each frame."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from hpccd_ros.scenes.robot import SceneRobot


@dataclass(frozen=True)
class Mesh:
    """`faces` is (F,3) uint32 into the mesh's own `n_vertices` vertices; of a scene: as it is in frame 0.

    edges   (E,2) uint32 of edges that belong to no face, as those of ropes
    """

    name: str
    faces: np.ndarray
    n_vertices: int
    static: bool = False
    self_collision: bool = True
    edges: np.ndarray | tuple[()] = ()


@dataclass(frozen=True)
class Topology:
    """Faces (F,3) uint32 of a mesh of `n_vertices` vertices from some frame on; versions grow from 0."""

    version: int
    faces: np.ndarray
    n_vertices: int


class Frame(list):
    """Vertices of one frame: a list with one (V,3) float32 array for each mesh, in the scene's order.

    index       frame number
    time        seconds since frame 0
    topologies  {mesh name: Topology} of the meshes whose faces differ from those of the frame before
    start       None, or, where `topologies` is not empty, the vertices of the frame *before* in this frame's
                topology, so that the step into this frame can be tested although pieces came apart in it
    """

    def __init__(
        self,
        vertices: Sequence[np.ndarray],
        index: int,
        time: float,
        topologies: dict[str, Topology] | None = None,
        start: list[np.ndarray] | None = None,
    ):
        super().__init__(np.ascontiguousarray(v, dtype=np.float32) for v in vertices)
        self.index, self.time = index, time
        self.topologies = topologies or {}
        self.start = None if start is None else [np.ascontiguousarray(v, dtype=np.float32) for v in start]

    def stacked(self) -> np.ndarray:
        """All meshes' vertices one after the other, (sum of V, 3) float32, as `hpccd_core` takes them."""
        return np.concatenate(self)

    def stacked_start(self) -> np.ndarray | None:
        """`start` one mesh after the other, or None."""
        return None if self.start is None else np.concatenate(self.start)


@dataclass(frozen=True)
class Scene:
    """A deterministic deforming scene.

    `frame(k)` gives frame k, 0 <= k < n_frames, in any order; `frames()` gives all in order.
    `frame_period` is the time between frames in seconds; lengths are metres, z points up.
    `robots` have their links among `meshes`, as NAME/LINK, and frames have the links' vertices as any mesh's.
    `ignored_pairs`: names of meshes that are never tested against each other.
    """

    name: str
    title: str
    meshes: tuple[Mesh, ...]
    n_frames: int
    frame_period: float
    make_frame: Callable[[int], Frame] = field(repr=False)
    make_faces: Callable[[int], dict[str, np.ndarray]] | None = field(default=None, repr=False)
    robots: tuple[SceneRobot, ...] = ()
    ignored_pairs: tuple[tuple[str, str], ...] = ()

    def frame(self, index: int) -> Frame:
        """Frame `index`; IndexError outside 0 .. n_frames - 1."""
        if not 0 <= index < self.n_frames:
            raise IndexError(f"frame {index} of scene {self.name!r}: it has frames 0 to {self.n_frames - 1}")
        return self.make_frame(index)

    def faces(self, index: int = 0) -> list[np.ndarray]:
        """Faces (F,3) uint32 of each mesh as they are in frame `index`, own vertices' indices."""
        now = self.make_faces(index) if self.make_faces else {}
        return [now.get(mesh.name, mesh.faces) for mesh in self.meshes]

    def frames(self) -> Iterator[Frame]:
        """All frames in order."""
        return (self.make_frame(index) for index in range(self.n_frames))

    def __len__(self) -> int:
        return self.n_frames

    @property
    def mesh_names(self) -> list[str]:
        return [mesh.name for mesh in self.meshes]

    @property
    def sent_meshes(self) -> tuple[Mesh, ...]:
        """Those of no robot: over ROS a robot's links come as joint states."""
        links = {mesh.name for robot in self.robots for mesh in robot.meshes}
        return tuple(mesh for mesh in self.meshes if mesh.name not in links)

    @property
    def n_triangles(self) -> int:
        """Triangles of all meshes in frame 0."""
        return sum(len(mesh.faces) for mesh in self.meshes)

    @property
    def n_vertices(self) -> int:
        """Vertices of all meshes in frame 0."""
        return sum(mesh.n_vertices for mesh in self.meshes)


def core_scene(scene: Scene, index: int = 0):
    """An `hpccd_core.Scene` with the meshes of `scene` in order, as they are in frame `index`."""
    import hpccd_core

    core = hpccd_core.Scene()
    frame = scene.frame(index)
    for mesh, faces, vertices in zip(scene.meshes, scene.faces(index), frame, strict=True):
        core.add_mesh(
            mesh.name, faces, static=mesh.static, self_collision=mesh.self_collision, n_vertices=len(vertices)
        )
    for a, b in scene.ignored_pairs:
        core.ignore_pair(a, b)
    return core
