# SPDX-License-Identifier: Apache-2.0
"""The core's scene of the meshes with their current topologies. No ROS."""

from collections import defaultdict
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

import hpccd_core as hc
from hpccd_ros.base.quoting import counted
from hpccd_ros.detect.layout import Layout
from hpccd_ros.frames.types import MeshSettings, SceneFrame, Topology


@dataclass(frozen=True)
class PlaneSettings:
    """Settings of a plane (parameters ``plane.NAME.*``): the border of the half-space normal . x >= offset."""

    name: str
    normal: tuple[float, ...] = (0.0, 0.0, 1.0)
    offset: float = 0.0


def add_to(scene: hc.Scene, mesh: MeshSettings, topology: Topology) -> None:
    """Add a mesh to a scene. Raises the core's errors, and ValueError for triangles of a mesh in parameter
    ``points``."""
    how = {"edges": topology.edges, "self_collision": mesh.self_collision, "static": mesh.static}
    if not mesh.points:
        scene.add_mesh(mesh.name, topology.faces, n_vertices=topology.n_vertices, **how)
    elif len(topology.faces):
        raise ValueError(
            f"faces: {counted(len(topology.faces), 'triangle')} in a mesh of points; send none, or take {mesh.name} "
            "out of parameter points"
        )
    else:
        scene.add_points(mesh.name, topology.n_vertices, **how)


@dataclass(frozen=True)
class SceneBuilder:
    """Makes core scenes of the same meshes with changing topologies; equal builders make equal scenes. Planes come
    after the meshes and have no topology."""

    meshes: tuple[MeshSettings, ...]
    ignored_pairs: tuple[tuple[str, str], ...] = ()
    pair_accuracies: tuple[tuple[str, str, str], ...] = ()
    pair_features: tuple[tuple[str, str, tuple[str, ...]], ...] = ()
    planes: tuple[PlaneSettings, ...] = ()

    def build(self, topologies: tuple[Topology, ...], rest: Sequence[np.ndarray | None] = ()) -> hc.Scene:
        """One topology for each mesh, in order. rest: the shape at rest of each mesh, if its topology has none. Raises
        the core's errors, and ValueError for a mesh whose shape at rest is needed and unknown."""
        scene = hc.Scene()
        for mesh, topology in zip(self.meshes, topologies, strict=True):
            add_to(scene, mesh, topology)
        for plane in self.planes:
            scene.add_plane(plane.name, plane.normal, plane.offset)
        for number, (mesh, topology) in enumerate(zip(self.meshes, topologies, strict=True)):
            if not mesh.self_collision or mesh.static:
                continue
            if mesh.ignored_rings:
                scene.ignore_within(mesh.name, rings=mesh.ignored_rings)
            if mesh.ignored_at_rest is not None:
                shape = topology.rest if topology.rest is not None else rest[number] if rest else None
                if shape is None:
                    raise ValueError(
                        f"mesh.{mesh.name}.ignored_at_rest: the shape at rest is unknown here; give "
                        f"mesh.{mesh.name}.file"
                    )
                scene.ignore_within(mesh.name, rest_vertices=shape, distance=mesh.ignored_at_rest)
        for a, b in self.ignored_pairs:
            scene.ignore_pair(a, b)
        for a, b, accuracy in self.pair_accuracies:
            scene.set_accuracy(a, b, accuracy)
        for a, b, features in self.pair_features:
            scene.set_features(a, b, features)
        return scene

    @cached_property
    def tested_pairs(self) -> tuple[tuple[str, str], ...]:
        """Names of the pairs of meshes that are tested, the same name twice for within a mesh, in the order of the
        scene."""
        ignored: dict[str, set[str]] = defaultdict(set)
        for a, b in self.ignored_pairs:
            ignored[a].add(b)
            ignored[b].add(a)
        found = []
        for number, mesh in enumerate(self.meshes):
            if mesh.self_collision and not mesh.static:
                found.append((mesh.name, mesh.name))
            left_out = ignored[mesh.name]  # looked up once: a robot with a thousand links has half a million pairs
            found += [
                (mesh.name, other.name)
                for other in self.meshes[number + 1 :]
                if other.name not in left_out and not (mesh.static and other.static)
            ]
            found += [(mesh.name, p.name) for p in self.planes if p.name not in left_out and not mesh.static]
        return tuple(found)

    @property
    def names(self) -> tuple[str, ...]:
        """Of the meshes and planes, in the order of the scene."""
        return tuple(part.name for part in (*self.meshes, *self.planes))

    @property
    def plane_names(self) -> tuple[str, ...]:
        return tuple(plane.name for plane in self.planes)

    def layout(self, topologies: tuple[Topology, ...]) -> Layout:
        """Of the scene that `build` makes."""
        return Layout.of(self.names, topologies, self.plane_names)

    @property
    def rest_of_frames(self) -> tuple[int, ...]:
        """Numbers of the meshes for which `build` needs a shape at rest, if their topology has none."""
        return tuple(
            number
            for number, mesh in enumerate(self.meshes)
            if mesh.ignored_at_rest is not None and mesh.self_collision and not mesh.static
        )

    @property
    def rigid(self) -> tuple[bool, ...]:
        """Which meshes move by poses."""
        return tuple(mesh.rigid for mesh in self.meshes)

    def of_rigid_pairs(self) -> "SceneBuilder":
        """A builder that tests only pairs of meshes of which at least one moves by poses."""
        return self._restricted(of_rigid=True)

    def of_other_pairs(self) -> "SceneBuilder | None":
        """A builder that tests only the other pairs; None if there are none."""
        left = self._restricted(of_rigid=False)
        return left if left.tested_pairs else None

    def _restricted(self, of_rigid: bool) -> "SceneBuilder":
        """Keep only the tested pairs in which a mesh moves by poses, or only those in which none does."""
        rigid = {mesh.name for mesh in self.meshes if mesh.rigid}
        ignored = tuple((a, b) for a, b in self.tested_pairs if a != b and of_rigid != (a in rigid or b in rigid))
        meshes = tuple(
            replace(mesh, self_collision=mesh.self_collision and not (of_rigid or mesh.rigid)) for mesh in self.meshes
        )
        return replace(self, meshes=meshes, ignored_pairs=self.ignored_pairs + ignored)

    def among(self, names: list[str], planes: Collection[str] = ()) -> "SceneBuilder":
        """The builder for these meshes, in this order, and planes; unknown names are meshes with default settings."""
        known, wanted = {mesh.name: mesh for mesh in self.meshes}, {*names, *planes}
        return SceneBuilder(
            tuple(known.get(name, MeshSettings(name)) for name in names),
            tuple(pair for pair in self.ignored_pairs if wanted.issuperset(pair)),
            tuple(entry for entry in self.pair_accuracies if wanted.issuperset(entry[:2])),
            tuple(entry for entry in self.pair_features if wanted.issuperset(entry[:2])),
            tuple(plane for plane in self.planes if plane.name in wanted),
        )

    @property
    def between_meshes(self) -> "SceneBuilder":
        """A builder for pairs of different meshes only, with all features."""
        meshes = tuple(replace(mesh, self_collision=False) for mesh in self.meshes)
        return SceneBuilder(meshes, self.ignored_pairs, planes=self.planes)

    @property
    def pairs(self) -> list[tuple[str, str]]:
        """Pairs of different meshes that are tested."""
        return [(a, b) for a, b in self.tested_pairs if a != b]

    def parts(self, frame: SceneFrame, static_of: SceneFrame) -> list[np.ndarray]:
        """Positions of each mesh; those of static meshes from ``static_of``."""
        return [static_of.vertices[i] if mesh.static else frame.vertices[i] for i, mesh in enumerate(self.meshes)]

    def concatenate(self, frame: SceneFrame, static_of: SceneFrame) -> np.ndarray:
        """(V,3) positions of all meshes; those of static meshes from ``static_of``. No copy of a single mesh.

        One float64 mesh makes the whole float64, which holds the others' float32 exactly.
        """
        parts = self.parts(frame, static_of)
        return parts[0] if len(parts) == 1 else np.concatenate(parts)
