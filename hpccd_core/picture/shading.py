# SPDX-License-Identifier: Apache-2.0
"""Light for rasterised meshes: smooth normals, a key light with soft shadow, sky light, darker folds. Edges in no face
are thin tubes, as a line has no surface to shade."""

import numpy as np

import hpccd_core as hc
from hpccd_core.picture.camera import LightCamera
from hpccd_core.picture.raster import rasterize

SHADOW_RESOLUTION = 1200
FILL = 0.3
SKY = np.array([0.93, 0.97, 1.04], dtype=np.float32)
SUN = np.array([1.05, 1.0, 0.92], dtype=np.float32)


def vertex_normals(vertices, faces):
    """(V,3) unit normals, faces weighted by their area; zero for vertices in no face."""
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    out = np.zeros_like(vertices, dtype=np.float64)
    for corner in range(3):
        for axis in range(3):
            out[:, axis] += np.bincount(faces[:, corner], normals[:, axis], minlength=len(vertices))
    return out / np.maximum(np.linalg.norm(out, axis=1), 1e-30)[:, None]


def shade(buffers, camera, vertices, faces, casting, colours, light, paint):
    """(height, width, 3) linear colours of what `buffers` see, 0 where they see nothing.

    casting: the faces (C,3) that cast shadows. colours: (V,3) linear. light: direction towards the key light. paint:
    takes the positions (N,3) of pixels, their triangles (N,) and their own colours (N,3); returns their colours before
    they are lit.
    """
    vertices = vertices.astype(np.float32)
    seen = buffers.triangle >= 0
    triangle = buffers.triangle[seen]
    u, v = buffers.weights[seen].T
    weights = (1 - u - v, u, v)
    position = _interpolate(vertices, faces, triangle, weights)
    normal = _interpolate(vertex_normals(vertices, faces), faces, triangle, weights)
    _normalize(normal)
    view = camera.eye.astype(np.float32) - position
    _normalize(view)
    back = _dot(normal, view) < 0  # both sides are lit: a cloth has no inside
    normal[back] *= -1
    light = (np.asarray(light) / np.linalg.norm(light)).astype(np.float32)
    lit = _sunlight(vertices, casting, light, position + np.float32(1e-3 * np.ptp(vertices, axis=0).max()) * normal)
    crease = _crease_darkening(buffers.depth)[seen]
    half = light + view
    _normalize(half)
    gloss = np.clip(_dot(normal, half), 0, 1) ** 40
    facing = np.clip(_dot(normal, view), 0, 1)
    rim = (1 - facing) ** 4
    # A weak light at the camera: what turns away from sun and sky is not black.
    sky = 0.34 + 0.18 * normal[:, 2] + 0.10 * rim + FILL * facing
    sun = 0.80 * np.clip(normal @ light, 0, 1) * lit
    energy = (sky * crease)[:, None] * SKY + (sun * (0.45 + 0.55 * crease))[:, None] * SUN
    base = paint(position, triangle, _interpolate(colours, faces, triangle, weights))
    base *= np.where(back, np.float32(0.72), np.float32(1.0))[:, None]
    image = np.zeros((*buffers.depth.shape, 3), dtype=np.float32)
    image[seen] = base * energy + (0.10 * gloss * lit)[:, None]
    return image


def _interpolate(values, faces, triangle, weights):
    return sum(w[:, None] * values.astype(np.float32)[faces[triangle, k]] for k, w in enumerate(weights))


def _dot(a, b):
    return np.einsum("nd,nd->n", a, b)


def _normalize(vectors):
    vectors /= np.maximum(np.sqrt(_dot(vectors, vectors)), np.float32(1e-20))[:, None]


def _sunlight(vertices, faces, light, position):
    """(N,) share of the key light that arrives at `position` (N,3): 4 x 4 look-ups in a shadow map."""
    camera = LightCamera(np.concatenate([vertices, position]), light, SHADOW_RESOLUTION)
    depth = rasterize(camera.project(vertices)[faces], camera.size, perspective=False).depth
    x, y, z = camera.project(position).T.astype(np.float32)
    z -= np.float32(3e-3 * camera.extent)
    lit = np.zeros(len(position), dtype=np.float32)
    for dx in (-4, -1.5, 1.5, 4):
        column = np.clip((x + np.float32(dx)).astype(np.int32), 0, camera.size[0] - 1)
        for dy in (-4, -1.5, 1.5, 4):
            row = np.clip((y + np.float32(dy)).astype(np.int32), 0, camera.size[1] - 1)
            lit += depth[row, column] > z
    return lit / 16


def _crease_darkening(depth):
    """(height, width) factor 0..1, darker where the surroundings are nearer: unsharp masking of the depth buffer
    (Luft, Colditz, Deussen 2006), cheap ambient occlusion that lets folds and layers be told apart."""
    # A factor this smooth needs no full resolution.
    coarse = depth[::2, ::2]
    seen = np.isfinite(coarse)
    if not seen.any():
        return np.ones_like(depth)
    size = max(coarse.shape)
    spread = np.ptp(coarse[seen]) or 1.0
    total = np.ones(coarse.shape, dtype=np.float32)
    for radius, strength in ((size // 160, 5.0), (size // 45, 3.0), (size // 14, 1.2)):
        radius = max(radius, 1)
        weight = blur(seen.astype(np.float32), radius)
        mean = blur(np.where(seen, coarse, np.float32(0)), radius) / np.maximum(weight, 1e-6)
        behind = np.where(seen, coarse - mean, 0.0) / spread
        total *= 1.0 - 0.75 * np.clip(strength * behind, 0, 0.75)
    fine = np.repeat(np.repeat(total, 2, axis=0), 2, axis=1)
    return fine[: depth.shape[0], : depth.shape[1]]


def blur(image, radius):
    """Nearly Gaussian blur of a (height, width) array: three box filters along each axis."""
    for axis in (0, 1):
        n = image.shape[axis]
        for _ in range(3):
            padded = np.pad(image, [(radius + 1, radius) if a == axis else (0, 0) for a in (0, 1)], mode="edge")
            sums = np.cumsum(padded, axis, dtype=np.float64)
            upper = np.take(sums, range(2 * radius + 1, 2 * radius + 1 + n), axis)
            image = ((upper - np.take(sums, range(n), axis)) / (2 * radius + 1)).astype(np.float32)
    return image


SIDES = 5
RADIUS = 0.0035  # of the scene's extent


def tubes(vertices: np.ndarray, edges: np.ndarray, radii: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions (N,3), faces (F,3) of these, and for each of them the vertex (N,) whose colour it has.

    vertices: (V,3). edges: (E,2), indices of them. radii: (E,). An edge without length has no tube.
    """
    length = np.linalg.norm(vertices[edges[:, 1]] - vertices[edges[:, 0]], axis=1)
    edges, radii, length = edges[length > 0], radii[length > 0], length[length > 0]
    ends = vertices[edges]
    along = (ends[:, 1] - ends[:, 0]) / length[:, None]
    # Across the axis along which the edge goes least, so that the cross product does not vanish.
    least = np.eye(3)[np.abs(along).argmin(axis=1)]
    first = np.cross(along, least)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(along, first)
    angle = np.arange(SIDES) * 2 * np.pi / SIDES
    ring = np.cos(angle)[:, None] * first[:, None] + np.sin(angle)[:, None] * second[:, None]  # (E, SIDES, 3)
    positions = ends[:, :, None] + radii[:, None, None, None] * ring[:, None]  # (E, 2, SIDES, 3)
    low = np.arange(SIDES)
    high, next_low = low + SIDES, (low + 1) % SIDES
    quads = np.concatenate([np.stack([low, next_low, high], 1), np.stack([high, next_low, next_low + SIDES], 1)])
    faces = quads + 2 * SIDES * np.arange(len(edges))[:, None, None]
    return positions.reshape(-1, 3), faces.reshape(-1, 3), np.repeat(edges.reshape(-1), SIDES)


# Beads that are drawn round: more of them are octahedra.
MOST_ROUND = 5_000


def beads(vertices: np.ndarray, numbers: np.ndarray, radii: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Balls around some of the vertices, as `tubes` returns them. numbers, radii: (N,), indices of these vertices."""
    corners, triangles = hc.shapes.icosphere(2)
    if len(numbers) > MOST_ROUND:
        corners = np.concatenate([np.eye(3), -np.eye(3)])
        octants = [[x, y, z] if (x + y + z) % 2 else [y, x, z] for x in (0, 3) for y in (1, 4) for z in (2, 5)]
        triangles = np.array(octants)
    faces = triangles.astype(np.int64) + len(corners) * np.arange(len(numbers))[:, None, None]
    positions = vertices[numbers][:, None] + radii[:, None, None] * corners
    return positions.reshape(-1, 3), faces.reshape(-1, 3), np.repeat(numbers, len(corners))
