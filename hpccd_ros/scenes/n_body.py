# SPDX-License-Identifier: Apache-2.0
"""Rigid and deforming bodies falling into a pile in a shallow dish (after Kim et al. 2009, Fig. 5)."""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np

import hpccd_core.shapes
from hpccd_core.shapes import grid, icosphere
from hpccd_ros.scenes import cache, rigid, shapes
from hpccd_ros.scenes.exactmath import PI, normalized, random_stream, sincos
from hpccd_ros.scenes.scene import Frame, Mesh, Scene

FRAME_PERIOD = 1 / 60
BODIES = 60
DISH_DEPTH = 0.12  # of the dish z = DISH_DEPTH * (x^2 + y^2), 1/m
DISH_HALF_WIDTH = 2.2
OVERLAP = 0.93  # spheres are so much smaller than what they stand for: touching meshes overlap by some percent


@dataclass(frozen=True)
class Shape:
    """Unit-sized surface with the spheres that stand for it: rows of (x, y, z, radius)."""

    vertices: np.ndarray
    faces: np.ndarray
    spheres: np.ndarray


def _ring(count, radius, thickness):
    s, c = sincos(np.arange(count) * (2 * PI / count))
    zero = np.zeros_like(s)
    return np.stack([radius * c, radius * s, zero, zero + thickness], axis=1)


def _shapes(triangles: float) -> list[Shape]:
    """The five kinds of body, of about `triangles` triangles on average, within the unit ball."""
    frequency = max(2, round((triangles / 20) ** 0.5))
    # Icospheres come in steps of 20 f^2; the two tubes take up what the three of them leave or overdraw.
    in_tube = max(48.0, (5 * triangles - 3 * 20 * frequency * frequency) / 2)
    corners = np.array([(x, y, z, 0.47) for x in (-0.24, 0.24) for y in (-0.24, 0.24) for z in (-0.24, 0.24)])
    egg_spheres = np.array([(0, 0, -0.5, 0.45), (0, 0, 0, 0.53), (0, 0, 0.5, 0.45)])
    sphere, sphere_faces = icosphere(frequency)
    cube, cube_faces = shapes.rounded_cube(frequency)
    along, around = _tube_grid(in_tube, 2.0)
    ring = shapes.torus(along, around)
    along, around = _tube_grid(in_tube, 5.0)
    curve = shapes.torus_knot_curve(along, 2, 3, 0.55, 0.25)
    knot_centres = shapes.torus_knot_curve(14, 2, 3, 0.55, 0.25)[0]
    return [
        Shape(sphere, sphere_faces, np.array([(0, 0, 0, 0.97)])),
        Shape(cube * 0.75, cube_faces, corners),
        Shape(*ring, _ring(10, 0.7, 0.29)),
        Shape(sphere * (0.55, 0.55, 1.0), sphere_faces, egg_spheres),
        Shape(*shapes.tube(*curve, np.full((along, around), 0.2)), np.insert(knot_centres, 3, 0.18, axis=1)),
    ]


def _tube_grid(triangles: float, elongation: float) -> tuple[int, int]:
    """Cells along and around a tube of about `triangles` triangles, `elongation` girths long."""
    around = max(4, round((triangles / 2 / elongation) ** 0.5))
    return max(6, round(triangles / 2 / around)), around


def _dish(points):
    x, y = points[:, 0], points[:, 1]
    normals = normalized(np.stack([-2 * DISH_DEPTH * x, -2 * DISH_DEPTH * y, np.ones_like(x)], axis=1))
    return (points[:, 2] - DISH_DEPTH * (x * x + y * y)) * normals[:, 2], normals


def _simulate(frames: int, seed: int, kinds: list[Shape], show_progress: bool):
    """Body b is of kind b % 5 and scale 0.2 to 0.3; the motion does not depend on how finely it is meshed."""
    random = random_stream(seed)
    scale = 0.2 + 0.1 * random.random_sample(BODIES)
    # A loose stack of layers of 4 x 4, close enough to touch in the first frames.
    slot = np.arange(BODIES)
    lattice = np.stack([slot % 4 - 1.5, slot // 4 % 4 - 1.5, slot // 16], axis=1) * (0.5, 0.5, 0.48)
    position = lattice + 0.1 * (random.random_sample((BODIES, 3)) - 0.5) + (0, 0, 0.5)
    spheres = [kinds[b % len(kinds)].spheres * scale[b] for b in range(BODIES)]
    every = np.concatenate(spheres)
    every[:, 3] *= OVERLAP
    bodies = rigid.Bodies(
        position=position,
        velocity=0.8 * (random.random_sample((BODIES, 3)) - 0.5) + (0, 0, -1.0),
        spin=8.0 * (random.random_sample((BODIES, 3)) - 0.5),
        mass=scale * scale * scale * 1e3,
        radius=0.9 * scale,
        sphere_centre=every[:, :3],
        sphere_radius=every[:, 3],
        sphere_body=np.repeat(np.arange(BODIES), [len(s) for s in spheres]),
    )
    motion = rigid.simulate(bodies, _dish, frames, FRAME_PERIOD, rigid.Material(), show_progress)
    return {**motion, "scale": scale}


def _wobble(points, phase, time):
    """Deform unit-sized points (V,3): stretch along z at constant volume and a wave running along x."""
    stretch = 1.0 + 0.16 * sincos(9.0 * time + phase)[0]
    narrow = 1.0 / np.sqrt(stretch)
    x, y, z = points[:, 0] * narrow, points[:, 1] * narrow, points[:, 2] * stretch
    return np.stack([x, y, z + 0.08 * sincos(4.0 * x - 11.0 * time + phase)[0]], axis=1)


def make(name: str, title: str, triangles: int, size: float, frames: int, seed: int, show_progress: bool) -> Scene:
    """The scene with about `triangles` * size triangles. Every other body deforms; each half is one mesh."""
    total = triangles * size
    cells = max(4, round((0.02 * total / 2) ** 0.5))
    kinds = _shapes((total - 2 * cells * cells) / BODIES)
    motion = cache.cached(
        "n-body",
        (frames, seed),
        [rigid, hpccd_core.shapes, shapes, sys.modules[__name__]],
        lambda: _simulate(frames, seed, kinds, show_progress),
    )
    ground, ground_faces = grid(cells, cells)
    ground *= DISH_HALF_WIDTH
    ground[:, 2] = DISH_DEPTH * (ground[:, 0] * ground[:, 0] + ground[:, 1] * ground[:, 1])
    ground = ground.astype(np.float32)

    halves = [list(range(first, BODIES, 2)) for first in (0, 1)]
    points, owners, faces = [], [], []
    for half in halves:
        parts = [kinds[b % len(kinds)] for b in half]
        starts = np.cumsum([0] + [len(p.vertices) for p in parts])
        points.append([p.vertices for p in parts])
        owners.append(np.repeat(half, [len(p.vertices) for p in parts]))
        faces.append(np.concatenate([p.faces + np.uint32(s) for p, s in zip(parts, starts, strict=False)]))
    scales = [motion["scale"][owner][:, None] for owner in owners]

    def frame(index: int) -> Frame:
        at, turned = motion["positions"][index], motion["orientations"][index]
        time = index * FRAME_PERIOD
        wobbling = [_wobble(p, 2.4 * b, time) for p, b in zip(points[1], halves[1], strict=True)]
        shaped = [np.concatenate(points[0]), np.concatenate(wobbling)]
        moved = [rigid.placed(p * s, owner, at, turned) for p, s, owner in zip(shaped, scales, owners, strict=True)]
        return Frame([*moved, ground], index, time)

    meshes = (
        Mesh("rigid_bodies", faces[0], len(owners[0])),
        Mesh("deforming_bodies", faces[1], len(owners[1])),
        Mesh("ground", ground_faces, len(ground), static=True, self_collision=False),
    )
    return Scene(name, title, meshes, frames, FRAME_PERIOD, frame)
