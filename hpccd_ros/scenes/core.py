# SPDX-License-Identifier: Apache-2.0
"""From a scene description to the collision detector's own Scene."""

from __future__ import annotations

from hpccd_ros.scenes.scene import Scene


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
