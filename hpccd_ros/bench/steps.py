# SPDX-License-Identifier: Apache-2.0
"""What is measured: motion steps of scenes, wherever they come from."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

import hpccd_core as hc
from hpccd_ros.scenes.scene import Mesh


@dataclasses.dataclass(frozen=True, eq=False)
class Step:
    """Motion of all meshes from vertices_t0 to vertices_t1, each (V,3), meshes one after the other.

    topology   equal for steps between which no mesh changes its faces
    truth      {"vf", "vf_toc", "ee", "ee_toc"} as in hpccd_core.Contacts where it is known, else None
    """

    meshes: tuple[Mesh, ...]
    topology: object
    vertices_t0: np.ndarray
    vertices_t1: np.ndarray
    ignored_pairs: tuple[tuple[str, str], ...] = ()
    truth: dict[str, np.ndarray] | None = None

    @property
    def triangles(self) -> int:
        return sum(len(mesh.faces) for mesh in self.meshes)

    def scene(self) -> hc.Scene:
        scene = hc.Scene()
        for mesh in self.meshes:
            scene.add_mesh(
                mesh.name,
                mesh.faces,
                n_vertices=mesh.n_vertices,
                static=mesh.static,
                self_collision=mesh.self_collision,
            )
        for a, b in self.ignored_pairs:
            scene.ignore_pair(a, b)
        return scene

    def faces(self) -> np.ndarray:
        """Faces of all meshes (F,3) int64, scene-wide indices."""
        offsets = np.cumsum([0] + [mesh.n_vertices for mesh in self.meshes])
        return np.concatenate([m.faces.astype(np.int64) + o for m, o in zip(self.meshes, offsets, strict=False)])

    def as_one_mesh(self) -> Step:
        """The same triangles, everything tested against everything: what a peer without such options tests."""
        whole = Mesh("all", self.faces().astype(np.uint32), len(self.vertices_t0))
        return dataclasses.replace(self, meshes=(whole,), ignored_pairs=(), truth=None)


@dataclasses.dataclass(frozen=True)
class Source:
    """A named sequence of steps. `step(k)`, 0 <= k < n_steps, in any order; None where step k has no motion that
    could be tested (a topology that changes without saying where its new vertices came from)."""

    name: str
    n_steps: int
    step: Callable[[int], Step | None]

    def spread(self, count: int) -> list[int]:
        """`count` steps evenly spread over the sequence, its last among them; all where count is 0."""
        if count <= 0 or count >= self.n_steps:
            return list(range(self.n_steps))
        return sorted({round((k + 1) * self.n_steps / count) - 1 for k in range(count)})
