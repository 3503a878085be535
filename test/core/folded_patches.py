# SPDX-License-Identifier: Apache-2.0
"""Connected patches that touch themselves at a known time, or never, though much about them says the opposite: normals
that agree all the time while the patch overlaps itself, normals that turn while it stays free.

A shape is (faces, start, end, time), time None where nothing touches.
"""

import numpy as np
from fuzz.step_scenes import grid, octahedron, ring


def band(middles, across):
    """Faces and vertices of a band along middles (n,3) with half widths across (n,3)."""
    n = len(middles)
    a = np.arange(n - 1)
    faces = np.concatenate([np.stack([a, a + 1, a + n], 1), np.stack([a + n, a + 1, a + n + 1], 1)])
    return faces, np.concatenate([middles - across, middles + across])


def circle(n, turns):
    angle = np.linspace(0, 2 * np.pi * turns, n)
    return angle, np.stack([np.cos(angle), np.sin(angle), 0 * angle], 1)


def spiral_stairs(end_pitch=-0.5):
    """A ramp that climbs twice around: its normals agree, its contour crosses itself seen from above."""
    angle, out = circle(17, 2)  # the same places in each turn
    up = angle[:, None] * [0, 0, 1]
    faces, start = band(3 * out + 0.5 * up, out)
    return faces, start, band(3 * out + end_pitch * up, out)[1], 0.5 / (0.5 - end_pitch)


def square_stairs():
    """The same around a square, on small integers: all in one plane at one time, exactly."""
    corners = np.array([[3, 3], [0, 3], [-3, 3], [-3, 0], [-3, -3], [0, -3], [3, -3], [3, 0]] * 2 + [[3, 3]], float)
    height = np.arange(17.0)
    faces, start = band(np.column_stack([corners, height]), np.column_stack([corners / 3, 0 * height]))
    return faces, start, start * [1, 1, -3], 0.25


def rolled_carpet():
    """Layers of a roll that come closer until all lie on each other."""
    angle, out = circle(19, 2)
    wide = np.tile([0, 0, 0.7], (19, 1))
    faces, start = band((2 + 0.3 * angle)[:, None] * out, wide)
    return faces, start, band((2 - 0.1 * angle)[:, None] * out, wide)[1], 0.75


def unrolled_carpet():
    """Normals that turn twice around, and no contact."""
    angle, out = circle(19, 2)
    wide = np.tile([0, 0, 0.7], (19, 1))
    faces, start = band((2 + 0.3 * angle)[:, None] * out, wide)
    return faces, start, band((2 + 0.5 * angle)[:, None] * out, wide)[1], None


def half_a_turn():
    """On straight ways every vertex passes through the middle, while all normals stay as they are."""
    faces, start = grid(4, 5)
    return faces, start, start * [-1, -1, 1], 0.5


def nearly_half_a_turn():
    faces, start = grid(4, 5)
    turn = np.deg2rad(179.0)
    c, s = np.cos(turn), np.sin(turn)
    return faces, start, start @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]), None


def mirrored():
    """Normals agree at the start and at the end, by turning over."""
    faces, start = grid(4, 4)
    return faces, start, start * [1, -1, 1], 0.5


def ring_that_closes(part=1.0):
    """The ends of a flat open ring meet at the end of the step, or part of the way beyond."""
    angle, _ = circle(13, 0.75)
    start, end = (np.stack([np.cos(k * angle), np.sin(k * angle), 0 * angle], 1) for k in (1.0, 4 / 3))
    end[-1] = end[0]
    faces, first = band(2 * start, 0.5 * start)
    _, last = band(2 * end, 0.5 * end)
    return faces, first, first + part * (last - first), 1 / part if part >= 1 else None


def ring_that_stays_open():
    return ring_that_closes(0.9375)


def discs_joined_at_a_vertex():
    """A fan above another, with one vertex in common."""
    angle = np.linspace(-1, 1, 7)
    fan = np.stack([2 * np.cos(angle), 2 * np.sin(angle), 0 * angle], 1)
    a = np.arange(1, 7)
    faces = np.concatenate([np.stack([0 * a, a, a + 1], 1), np.stack([0 * a, a + 7, a + 8], 1)])
    tilt = fan[:, :1] * [0, 0, 0.5]
    start, end = (np.concatenate([[[0, 0, 0]], fan, fan + up * tilt]) for up in (1, -3))
    return faces, start, end, 0.25


def tongue_across_a_hole():
    """A tongue that grows from the inner border of a flat annulus across the hole to the other side."""
    faces, points = ring(12, 0, flat=True)
    inner = points[:12]
    root, tip = np.array([11, 1]), len(points)  # beside vertex 0, towards the middle
    faces = np.concatenate([faces, [[11, 0, tip], [0, 1, tip]]])
    start = np.concatenate([points, [inner[root].mean(axis=0) * [0.5, 1, 1]]])
    end = start.copy()
    end[tip, 0] = inner[6, 0] - (start[tip, 0] - inner[6, 0])
    return faces, start, end, 0.5


def fold(turned_over):
    """A sheet folded over its middle; with turned_over the faces of one half run the other way, so that the normals of
    both halves agree when they lie on each other."""
    faces, flat = grid(3, 7)
    half = flat[:, 0] > 0.5
    if turned_over:
        on_half = flat[faces, 0].mean(axis=1) > 0
        faces = np.where(on_half[:, None], faces[:, ::-1], faces)
    over = np.maximum(flat[:, 0], 0)
    start, end = (
        flat * np.where(half, x, 1)[:, None] ** [1, 0, 0] + over[:, None] * [0, 0, z]
        for x, z in ((-0.75, 0.5), (-0.75, -0.5))
    )
    return faces, start, end, 0.5


def book():
    """Three pages on one edge; one is turned through another."""
    n = 5
    spine = np.stack([np.zeros(n), np.arange(n), np.zeros(n)], 1)
    a = np.arange(n - 1)

    def page(first):
        return np.concatenate([np.stack([a, a + 1, a + first], 1), np.stack([a + first, a + 1, a + 1 + first], 1)])

    faces = np.concatenate([page(n), page(2 * n), page(3 * n)])
    away = [spine + way for way in ([2, 0.25, 0], [2, 0, 1], [1, 0.5, 2])]
    turned = [spine + way for way in ([2, 0.25, 0], [2, 0, -3], [1, 0.5, 2])]
    return faces, np.concatenate([spine, *away]), np.concatenate([spine, *turned]), 0.25


def sphere(n=1):
    faces, points = octahedron()
    for _ in range(n):
        edges = {tuple(sorted(e)) for f in faces for e in (f[:2], f[1:], f[[0, 2]])}
        middle = {e: len(points) + i for i, e in enumerate(sorted(edges))}
        points = np.concatenate([points, [points[list(e)].mean(axis=0) for e in sorted(edges)]])
        points /= np.linalg.norm(points, axis=1)[:, None]
        at = [[middle[tuple(sorted(e))] for e in (f[:2], f[1:], f[[0, 2]])] for f in faces]
        faces = np.array(
            [
                t
                for (a, b, c), (ab, bc, ca) in zip(faces, at, strict=True)
                for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
            ]
        )
    return faces, points


def sphere_turned_inside_out():
    faces, start = sphere(1)
    return faces, start, -start, 0.5


def sphere_pressed_flat():
    faces, start = sphere(1)
    return faces, start, start * [1, 1, 0], 1.0


def sphere_that_swells():
    faces, start = sphere(1)
    return faces, start, 3 * start, None


def cylinder_that_shrinks():
    faces, start = ring(8, 0)
    return faces, start, start * [-1, -1, 1], 0.5


def inner_vertex_that_leaves():
    """All in one plane: a vertex slides out of the ring of its neighbours and over the next triangles."""
    faces, start = grid(5, 5)
    end = start.copy()
    end[12] += [2.25, 0.125, 0]
    return faces, start, end, None  # the time is the oracle's: it is asked all the same


SHAPES = {
    f.__name__: f
    for f in (
        spiral_stairs,
        square_stairs,
        rolled_carpet,
        unrolled_carpet,
        half_a_turn,
        nearly_half_a_turn,
        mirrored,
        ring_that_closes,
        ring_that_stays_open,
        discs_joined_at_a_vertex,
        tongue_across_a_hole,
        book,
        sphere_turned_inside_out,
        sphere_pressed_flat,
        sphere_that_swells,
        cylinder_that_shrinks,
    )
} | {
    "stairs pressed flat": lambda: spiral_stairs(0.0),
    "stairs that stay open": lambda: (*spiral_stairs(0.125)[:3], None),
    "ring that overlaps its start": lambda: ring_that_closes(1.25),
    "fold": lambda: fold(False),
    "fold turned over": lambda: fold(True),
}
