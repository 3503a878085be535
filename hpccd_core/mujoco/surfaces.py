# SPDX-License-Identifier: Apache-2.0
"""The surfaces of MuJoCo's geoms, in the coordinate frame of the geom.

Boxes, meshes and height fields are exact. Spheres and capsules are exact too: a point or a segment whose thickness is
the radius. Cylinders and ellipsoids become closed meshes that contain the shape and are at most `tolerance` larger.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from .. import shapes
from ..mesh_layout import Indices

_NO_FACES = np.empty((0, 3), np.uint32)
_NO_EDGES = np.empty((0, 2), np.uint32)
# Of the sides of a cylinder, and of the segments along an edge of an icosahedron.
_MOST_PARTS = 256


@dataclasses.dataclass(frozen=True, eq=False)
class Surface:
    """vertices: (n, 3) float64; faces: (F, 3); edges: (E, 2) of no face; thickness: the radius of points and edges."""

    vertices: NDArray[np.float64]
    faces: Indices = dataclasses.field(default_factory=lambda: _NO_FACES)
    edges: Indices = dataclasses.field(default_factory=lambda: _NO_EDGES)
    thickness: float = 0.0


def surface_of(model: Any, geom: int, name: str, tolerance: float, hulls: bool) -> Surface:
    """The surface of a geom that is not a plane.

    Raises ValueError for a shape that has no triangles here, and where `tolerance` needs too many.
    """
    kind = mujoco.mjtGeom(int(model.geom_type[geom]))
    size = model.geom_size[geom].astype(np.float64)
    if kind == mujoco.mjtGeom.mjGEOM_SPHERE:
        return Surface(np.zeros((1, 3)), thickness=float(size[0]))
    if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        ends = np.array([[0.0, 0.0, -size[1]], [0.0, 0.0, size[1]]])
        return Surface(ends, edges=np.array([[0, 1]], np.uint32), thickness=float(size[0]))
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        return Surface(*shapes.box(2.0 * size))
    if kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        return _cylinder(float(size[0]), float(size[1]), tolerance, name)
    if kind == mujoco.mjtGeom.mjGEOM_ELLIPSOID:
        return _ellipsoid(size, tolerance, name)
    data = int(model.geom_dataid[geom])
    if kind == mujoco.mjtGeom.mjGEOM_HFIELD:
        return _height_field(model, data)
    if data >= 0:  # a mesh, or a signed distance field, for which MuJoCo keeps one
        return _mesh(model, data, hulls and kind == mujoco.mjtGeom.mjGEOM_MESH)
    raise ValueError(f"geoms: {name!r} is of type {kind.name} and has no mesh; leave it out of geoms")


def _mesh(model: Any, mesh: int, hull: bool) -> Surface:
    first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
    vertices = model.mesh_vert[first : first + count].astype(np.float64)
    begin, n_faces = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
    faces = model.mesh_face[begin : begin + n_faces]
    graph = int(model.mesh_graphadr[mesh])
    if hull and graph >= 0:  # the hull: two counts, 3 (corners + faces) numbers about vertices and edges, its faces
        n_corners, n_faces = (int(n) for n in model.mesh_graph[graph : graph + 2])
        graph += 2 + 3 * (n_corners + n_faces)
        faces = model.mesh_graph[graph : graph + 3 * n_faces].reshape(n_faces, 3)
    used, compact = np.unique(faces, return_inverse=True)
    return Surface(vertices[used], compact.reshape(-1, 3).astype(np.uint32))


def _height_field(model: Any, field: int) -> Surface:
    """The upper surface, of the triangles that MuJoCo collides."""
    columns, rows = int(model.hfield_ncol[field]), int(model.hfield_nrow[field])
    x_size, y_size, top, _ = model.hfield_size[field].tolist()
    first = int(model.hfield_adr[field])
    heights = model.hfield_data[first : first + rows * columns].astype(np.float64) * top
    x, y = np.meshgrid(np.linspace(-x_size, x_size, columns), np.linspace(-y_size, y_size, rows))
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    right, above, opposite = corner + 1, corner + columns, corner + columns + 1
    faces = np.concatenate([np.stack([corner, right, opposite], 1), np.stack([corner, opposite, above], 1)])
    return Surface(np.stack([x.ravel(), y.ravel(), heights], axis=1), faces.astype(np.uint32))


def _cylinder(radius: float, half: float, tolerance: float, name: str) -> Surface:
    """A prism around it, with a vertex in the middle of each end."""
    n = 8
    while radius * (1.0 / math.cos(math.pi / n) - 1.0) > tolerance:
        n = _finer(n, tolerance, name)
    angles = 2.0 * np.pi * np.arange(n) / n
    ring = radius / math.cos(math.pi / n) * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    low, high = (np.column_stack([ring, np.full(n, z)]) for z in (-half, half))
    i, j = np.arange(n), np.roll(np.arange(n), -1)
    faces = [(i, j, n + j), (i, n + j, n + i), (j, i, np.full(n, 2 * n)), (n + i, n + j, np.full(n, 2 * n + 1))]
    corners = np.concatenate([low, high, [[0.0, 0.0, -half], [0.0, 0.0, half]]])
    return Surface(corners, np.concatenate([np.stack(f, axis=1) for f in faces]).astype(np.uint32))


def _ellipsoid(radii: NDArray[np.float64], tolerance: float, name: str) -> Surface:
    """The image of a polyhedron around the unit sphere."""
    n = 4
    while True:
        vertices, faces = shapes.icosphere(n)
        a, b, c = (vertices[faces[:, k]] for k in range(3))
        normals = np.cross(b - a, c - a)
        inside = float((np.einsum("fx,fx->f", normals, a) / np.linalg.norm(normals, axis=1)).min())
        if (1.0 / inside - 1.0) * float(radii.max()) <= tolerance:
            return Surface(vertices / inside * radii, faces)
        n = _finer(n, tolerance, name)


def _finer(n: int, tolerance: float, name: str) -> int:
    if 2 * n > _MOST_PARTS:
        raise ValueError(f"tolerance: {tolerance} needs too many triangles for geom {name!r}; give a larger one")
    return 2 * n
