# SPDX-License-Identifier: Apache-2.0
"""A hollow statue that a boulder shatters: its topology changes as it breaks (after Kim et al. 2009, Fig. 2).

The statue is a thick-walled, bumpy torus knot: an outer and an inner surface with the same connectivity.
Its pieces are the Voronoi cells of random points on it. The break runs outward from the place of impact;
each piece, once reached, becomes a closed solid: outer wall, inner wall, and new walls along the crack.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

import hpccd_core.shapes
from hpccd_core.shapes import grid, icosphere
from hpccd_ros.scenes import cache, rigid, shapes
from hpccd_ros.scenes.exactmath import PI, dot, length, normalized, random_stream, rotate, sincos
from hpccd_ros.scenes.scene import Frame, Mesh, Scene, Topology

FRAME_PERIOD = 1 / 60
PIECES = 160
HIT_FRAME = 5
CRACK_FRAMES = 16  # the crack runs through the statue in this many frames, a new topology in each that frees a piece
GROUND = -1.215  # just below the statue
BOULDER_RADIUS = 0.42
BOULDER_VELOCITY = np.array([-7.0, 2.0, -1.0])
IMPACT = np.array([0.55, 0.11, 0.33])  # on the statue's surface
WALL = 0.28  # thickness of the statue's wall as a part of the tube's radius


def _statue(quads: float):
    """Outer and inner vertices (V,3 each) and the faces (F,3) of one of them; F is about 2 * quads."""
    around = max(6, round((quads / 9.0) ** 0.5))
    along = max(24, round(quads / around))
    points, normals, tangents = shapes.torus_knot_curve(along, 2, 3, 0.62, 0.34)
    a = np.arange(along)[:, None] * (2 * PI / along)
    b = np.arange(around)[None, :] * (2 * PI / around)
    bumps = 0.16 * sincos(14 * a + 3 * b)[0] + 0.10 * sincos(9 * a - 2 * b)[0] + 0.06 * sincos(31 * a + 5 * b)[0]
    radius = 0.25 * (1.0 + bumps)
    # Stand it up: the knot's axis z becomes horizontal.
    swap = [2, 0, 1]
    outer, faces = shapes.tube(points, normals, tangents, radius)
    inner, _ = shapes.tube(points, normals, tangents, radius * (1.0 - WALL))
    return outer[:, swap], inner[:, swap], faces


def _boulder(triangles: float):
    vertices, faces = icosphere(max(3, round((triangles / 20) ** 0.5)))
    x, y, z = vertices[:, 0], vertices[:, 1], vertices[:, 2]
    rough = 1.0 + 0.06 * sincos(5 * x + 3 * y)[0] + 0.05 * sincos(7 * z - 4 * x)[0] + 0.02 * sincos(17 * y + 13 * z)[0]
    return vertices * (BOULDER_RADIUS * rough)[:, None], faces


def _nearest(points, seeds):
    """Index of the nearest seed for each point; the first of equals."""
    best = np.zeros(len(points), dtype=np.int64)
    least = np.full(len(points), np.inf)
    for number, seed in enumerate(seeds):
        gap = points - seed
        squared = dot(gap, gap)
        nearer = squared < least
        best[nearer], least[nearer] = number, squared[nearer]
    return best


def _simulate(frames: int, seed: int, show_progress: bool):
    """Motion of the pieces (bodies 0 .. PIECES-1) and the boulder (body PIECES), whatever the meshing."""
    outer, inner, faces = _statue(20_000)
    random = random_stream(seed)
    middle = 0.5 * (outer + inner)
    seeds = middle[(random.random_sample(PIECES) * len(middle)).astype(np.int64)]
    cell = _nearest(middle, seeds)
    count = np.maximum(np.bincount(cell, minlength=PIECES), 1)
    centre = np.stack([np.bincount(cell, weights=middle[:, k], minlength=PIECES) for k in range(3)], axis=1)
    centre = centre / count[:, None]
    # A few spheres inside each piece's wall, and one at least: at its seed.
    proxies = np.concatenate([seeds, middle[(random.random_sample(5 * PIECES) * len(middle)).astype(np.int64)]])
    owner = _nearest(proxies, seeds)
    out = centre - IMPACT
    distance = length(out)
    release = (HIT_FRAME + np.floor(distance * (CRACK_FRAMES / distance.max()))) * FRAME_PERIOD
    start = IMPACT - BOULDER_VELOCITY * (HIT_FRAME * FRAME_PERIOD) - normalized(BOULDER_VELOCITY) * BOULDER_RADIUS
    boulder = np.array([[0.0, 0.0, 0.0]])
    kick = 2.2 / (0.35 + distance)
    bodies = rigid.Bodies(
        position=np.concatenate([centre, start[None]]),
        velocity=np.concatenate(
            [
                normalized(out) * kick[:, None]
                + normalized(BOULDER_VELOCITY) * (0.5 * kick)[:, None]
                + 0.6 * (random.random_sample((PIECES, 3)) - 0.5),
                BOULDER_VELOCITY[None],
            ]
        ),
        spin=np.concatenate([12.0 * (random.random_sample((PIECES, 3)) - 0.5), [[1.0, -2.0, 6.0]]]),
        mass=np.concatenate([0.02 + count / count.sum(), [1.5]]),
        radius=np.full(PIECES + 1, 0.12) + np.arange(PIECES + 1) // PIECES * (BOULDER_RADIUS - 0.12),
        sphere_centre=np.concatenate([proxies - centre[owner], boulder]),
        sphere_radius=np.concatenate([np.full(len(proxies), 0.035), [0.95 * BOULDER_RADIUS]]),
        sphere_body=np.concatenate([owner, [PIECES]]),
        release=np.concatenate([release, [0.0]]),
    )
    motion = rigid.simulate(
        bodies,
        rigid.flat_ground(GROUND),
        frames,
        FRAME_PERIOD,
        rigid.Material(stiffness=8e3, damping=20.0, friction=0.5),
        show_progress,
        description="simulating the break",
    )
    first = np.concatenate([np.rint(release / FRAME_PERIOD), [0]]).astype(np.int64)
    return {**motion, "seeds": seeds, "release_frame": first}


@dataclass(frozen=True)
class Statue:
    """The unbroken statue: surface vertices (outer, then inner), outer faces, the piece of each face."""

    points: np.ndarray
    faces: np.ndarray
    piece: np.ndarray

    def broken(self, free: np.ndarray):
        """Topology once the pieces `free` (PIECES,) bool have come off.

        Returns faces (F,3), and for each vertex its point (index into `points`) and its piece, -1 for what
        still stands together. Points on a crack appear once for each side of it.
        """
        part = np.where(free[self.piece], self.piece, -1)
        surface = len(self.points) // 2
        outer, inner = self.faces.astype(np.int64), self.faces[:, ::-1].astype(np.int64) + surface
        walls, wall_part = _walls(outer, part, surface)
        corners, parts = np.concatenate([outer, inner, walls]), np.concatenate([part, part, wall_part])
        key = (parts[:, None] + 1) * len(self.points) + corners
        unique, faces = np.unique(key, return_inverse=True)
        return (faces.reshape(-1, 3).astype(np.uint32), unique % len(self.points), unique // len(self.points) - 1)


def _walls(faces, part, surface):
    """Two triangles from outer to inner surface at each edge of a face whose neighbour is in another part."""
    a, b = faces.ravel(), faces[:, [1, 2, 0]].ravel()
    owner = np.repeat(np.arange(len(faces)), 3)
    # In a closed surface each edge runs once in each direction, so sorting both ways pairs the neighbours.
    forward, backward = np.lexsort((b, a)), np.lexsort((a, b))
    cut = part[owner[forward]] != part[owner[backward]]
    here = forward[cut]
    a, b, side = a[here], b[here], part[owner[here]]
    walls = np.concatenate([np.stack([b, a, a + surface], axis=1), np.stack([b, a + surface, b + surface], axis=1)])
    return walls, np.concatenate([side, side])


def make(name: str, title: str, size: float, frames: int, seed: int, show_progress: bool) -> Scene:
    """The scene with about 252 K * size triangles before it breaks; walls along the cracks come on top."""
    motion = cache.cached(
        "breaking",
        (frames, seed),
        [rigid, hpccd_core.shapes, shapes, sys.modules[__name__]],
        lambda: _simulate(frames, seed, show_progress),
    )
    cells = max(2, round(8 * size**0.5))
    boulder, boulder_faces = _boulder(50_000 * size)
    outer, inner, faces = _statue((252_000 * size - len(boulder_faces) - 2 * cells * cells) / 4)
    middle = 0.5 * (outer + inner)
    piece = _nearest(middle[faces].sum(axis=1) / 3.0, motion["seeds"])
    statue = Statue(np.concatenate([outer, inner]), faces, piece)
    ground, ground_faces = grid(cells, cells)
    ground = (ground * (2.5, 2.5, 0) + (0, 0, GROUND)).astype(np.float32)
    release, home = motion["release_frame"], motion["positions"][0]

    # Version v is in force from frame changes[v] on.
    changes = [0] + sorted({int(f) for f in release[np.unique(piece)] if 0 < f < frames})

    @lru_cache(maxsize=4)
    def topology(version: int):
        return statue.broken(release[:PIECES] <= changes[version] if version else np.zeros(PIECES, dtype=bool))

    def version_of(index: int) -> int:
        return int(np.searchsorted(changes, index, side="right")) - 1

    def vertices(version: int, index: int):
        _, point, owner = topology(version)
        moved = statue.points[point].copy()
        # A piece is free from its release frame on, and so has moved in the frames after it.
        off = (owner >= 0) & (release[owner] < index)
        body = owner[off]
        moved[off] = motion["positions"][index][body] + rotate(
            motion["orientations"][index][body], moved[off] - home[body]
        )
        return moved

    def rest(index: int):
        at, turned = motion["positions"][index], motion["orientations"][index]
        return [rigid.placed(boulder, np.full(len(boulder), PIECES), at, turned), ground]

    def frame(index: int) -> Frame:
        version = version_of(index)
        changed, start = {}, None
        if version and changes[version] == index:
            new_faces, point, _ = topology(version)
            changed["statue"] = Topology(version, new_faces, len(point))
            start = [vertices(version, index - 1), *rest(index - 1)]
        return Frame([vertices(version, index), *rest(index)], index, index * FRAME_PERIOD, changed, start)

    whole_faces, whole_points, _ = topology(0)
    meshes = (
        Mesh("statue", whole_faces, len(whole_points)),
        Mesh("boulder", boulder_faces, len(boulder), self_collision=False),
        Mesh("ground", ground_faces, len(ground), static=True, self_collision=False),
    )

    def faces_of(index: int) -> dict[str, np.ndarray]:
        return {"statue": topology(version_of(index))[0]}

    return Scene(name, title, meshes, frames, FRAME_PERIOD, frame, faces_of)
