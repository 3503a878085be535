# SPDX-License-Identifier: Apache-2.0
"""The core's scene of the meshes, whatever their topologies are at the time. No ROS."""

import itertools
from dataclasses import dataclass, replace

import numpy as np

import hpccd_core as hc
from hpccd_ros.frames.types import MeshSettings, SceneFrame, Topology


@dataclass(frozen=True, eq=False)
class SceneBuilder:
    """Makes core scenes of the same meshes with changing topologies."""

    meshes: tuple[MeshSettings, ...]
    ignored_pairs: tuple[tuple[str, str], ...] = ()
    pair_accuracies: tuple[tuple[str, str, str], ...] = ()
    pair_features: tuple[tuple[str, str, tuple[str, ...]], ...] = ()

    def build(self, topologies: tuple[Topology, ...]) -> hc.Scene:
        """One topology for each mesh, in order. Raises what the core raises."""
        scene = hc.Scene()
        for mesh, topology in zip(self.meshes, topologies, strict=True):
            scene.add_mesh(
                mesh.name,
                topology.faces,
                edges=topology.edges,
                n_vertices=topology.n_vertices,
                self_collision=mesh.self_collision,
                static=mesh.static,
            )
        for a, b in self.ignored_pairs:
            scene.ignore_pair(a, b)
        for a, b, accuracy in self.pair_accuracies:
            scene.set_accuracy(a, b, accuracy)
        for a, b, features in self.pair_features:
            scene.set_features(a, b, features)
        return scene

    def tested_pairs(self) -> list[tuple[str, str]]:
        """Names of the meshes that are tested against each other, and of those within themselves twice; in the order of
        the scene."""
        ignored = {frozenset(pair) for pair in self.ignored_pairs}
        found = []
        for number, a in enumerate(self.meshes):
            if a.self_collision and not a.static:
                found.append((a.name, a.name))
            for b in self.meshes[number + 1 :]:
                if not (a.static and b.static) and frozenset((a.name, b.name)) not in ignored:
                    found.append((a.name, b.name))
        return found

    def among(self, names: list[str]) -> "SceneBuilder":
        """The scene of these meshes, in this order; names that it does not have are meshes of their own."""
        known = {mesh.name: mesh for mesh in self.meshes}
        return SceneBuilder(
            tuple(known.get(name, MeshSettings(name)) for name in names),
            tuple(pair for pair in self.ignored_pairs if set(pair) <= set(names)),
            tuple(entry for entry in self.pair_accuracies if set(entry[:2]) <= set(names)),
            tuple(entry for entry in self.pair_features if set(entry[:2]) <= set(names)),
        )

    @property
    def between_meshes(self) -> "SceneBuilder":
        """Pairs of different meshes alone, each tested in whole."""
        return SceneBuilder(tuple(replace(mesh, self_collision=False) for mesh in self.meshes), self.ignored_pairs)

    @property
    def pairs(self) -> list[tuple[str, str]]:
        """Different meshes that are tested against each other."""
        ignored = {frozenset(pair) for pair in self.ignored_pairs}
        return [
            (a.name, b.name)
            for a, b in itertools.combinations(self.meshes, 2)
            if not (a.static and b.static) and frozenset((a.name, b.name)) not in ignored
        ]

    def same_scene(self, other: "SceneBuilder") -> bool:
        """Whether equal topologies make equal scenes."""
        return (self.meshes, self.ignored_pairs, self.pair_accuracies, self.pair_features) == (
            other.meshes,
            other.ignored_pairs,
            other.pair_accuracies,
            other.pair_features,
        )

    def concatenate(self, frame: SceneFrame, static_of: SceneFrame) -> np.ndarray:
        """(V,3) positions of all meshes; those of static meshes from ``static_of``. No copy of a single mesh.

        One float64 mesh makes the whole float64, which holds the others' float32 exactly.
        """
        parts = [static_of.vertices[i] if mesh.static else frame.vertices[i] for i, mesh in enumerate(self.meshes)]
        return parts[0] if len(parts) == 1 else np.concatenate(parts)
