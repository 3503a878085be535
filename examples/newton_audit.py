#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Compare the self-contacts that Newton's soft bodies are given with all pairs of features within the same distance.

Newton (newton.CollisionPipeline with its defaults, on Warp's CPU device) lists vertex-triangle and edge-edge pairs in
buffers of fixed size, and decides in float32. Detector.proximity reads the same float32 positions. Wherever one of them
has a pair that the other has not, rational arithmetic decides on these positions. Scenes:

folded   two layers of cloth, all edges of one parallel to those of the other
fine     the same ten times smaller: edges of 2 mm
pile     cloth folded in ten layers: more pairs than the buffers hold
level    two layers, tilted, as far apart as the radius but for the rounding of their positions

Columns of the table: pairs that both list; pairs nearer than the radius that Newton misses, and how many of these
because a buffer was full; pairs that only Newton lists; disagreements decided in rationals, with large buffers; pairs
exactly at the radius, which hpccd counts and Newton does not; decisions that are wrong by each one's own definition.
"""

import argparse
import itertools
import json
import sys
from dataclasses import dataclass
from fractions import Fraction

import newton
import numpy as np
import warp as wp

import hpccd_core as hc
from hpccd_core import warp as hcw

ROOM = 4096  # of each row of the buffers, where none may overflow
KINDS = ("vertex-triangle", "edge-edge")


# --- scenes -----------------------------------------------------------------------------------------------------------


def folded(across, layers, edge, gap, tilt=0.0):
    """Vertices (V, 3) float32 and triangles of a strip folded into layers."""
    column, row = np.divmod(np.arange(layers * across * (across + 1)), across + 1)
    layer, x = np.divmod(column, across)
    x = np.where(layer % 2, across - x, x)
    vertices = np.stack([edge * x, edge * row, gap * layer], axis=1)
    turn = np.array([[1, 0, 0], [0, np.cos(tilt), -np.sin(tilt)], [0, np.sin(tilt), np.cos(tilt)]])
    faces = hc.shapes.grid_faces(across, layers * across - 1)
    return (vertices @ turn.T).astype(np.float32), faces


@dataclass
class Scene:
    """Cloth, and the radius within which pairs are wanted, in metres. It is a float32, as Newton stores it."""

    vertices: np.ndarray
    faces: np.ndarray
    radius: float

    def model(self):
        builder = newton.ModelBuilder()
        builder.add_cloth_mesh(
            pos=wp.vec3(0, 0, 0),
            rot=wp.quat_identity(),
            scale=1.0,
            vertices=[wp.vec3(*x) for x in self.vertices.tolist()],
            indices=self.faces.ravel().tolist(),
            vel=wp.vec3(0, 0, 0),
            density=0.1,
        )
        return builder.finalize(device="cpu")


SCENES = {
    "folded": lambda: Scene(*folded(12, 2, edge=0.02, gap=0.006), radius=float(np.float32(0.01))),
    "fine": lambda: Scene(*folded(12, 2, edge=0.002, gap=0.0006), radius=float(np.float32(0.001))),
    "pile": lambda: Scene(*folded(5, 10, edge=0.02, gap=0.001), radius=float(np.float32(0.01))),
    "level": lambda: Scene(*folded(12, 2, edge=0.02, gap=0.01, tilt=0.3), radius=float(np.float32(0.01))),
}


# --- pairs of both ----------------------------------------------------------------------------------------------------


def pairs_of_newton(model, radius, **room):
    """Sets of vertex-triangle and of edge-edge pairs, numbered as in Detector.proximity."""
    pipeline = newton.CollisionPipeline(model)
    pipeline.init_soft_self_contact(margin=radius, **room)  # leaves out pairs that an edge joins
    contacts = pipeline.contacts()
    pipeline.collide(model.state(), contacts, soft_self_contact=True)
    found = contacts.soft_self_contact_data
    rows = found.vertex_colliding_triangles.numpy().reshape(-1, 2)
    vertex_triangle = set(map(tuple, rows[rows[:, 0] >= 0].tolist()))
    ends = np.sort(model.edge_indices.numpy()[:, 2:], axis=1)
    rows = found.edge_colliding_edges.numpy().reshape(-1, 2)
    both = ends[rows[rows[:, 0] >= 0]].tolist()  # each pair from either side, if both have room
    return vertex_triangle, {(*min(a, b), *max(a, b)) for a, b in both}


def pairs_of_hpccd(model, radius):
    """The same of Detector.proximity."""
    scene = hcw.scene_of(model)
    scene.ignore_within(hcw.PARTICLES, rings=1)  # what Newton leaves out
    near = hc.Detector(scene).proximity(hcw.positions(model, model.state()), radius)
    return {tuple(row) for row in near.vf.tolist()}, {tuple(row) for row in near.ee.tolist()}


# --- the truth, in rational numbers -----------------------------------------------------------------------------------


def minus(a, b):
    return [x - y for x, y in zip(a, b, strict=True)]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def point_segment(p, a, b):
    """Squared distance."""
    along, to = minus(b, a), minus(p, a)
    t = min(max(dot(to, along) / dot(along, along), 0), 1) if any(along) else 0
    off = [x - t * y for x, y in zip(to, along, strict=True)]
    return dot(off, off)


def point_triangle(p, *corners):
    """Squared distance."""
    a, b, c = corners
    normal = cross(minus(b, a), minus(c, a))
    sides = [dot(cross(minus(y, x), minus(p, x)), normal) for x, y in ((a, b), (b, c), (c, a))]
    if any(normal) and all(side >= 0 for side in sides):  # the foot of the perpendicular lies in the triangle
        return dot(minus(p, a), normal) ** 2 / dot(normal, normal)
    return min(point_segment(p, x, y) for x, y in ((a, b), (b, c), (c, a)))


def segment_segment(a, b, c, d):
    """Squared distance."""
    along, other, to = minus(b, a), minus(d, c), minus(c, a)
    normal = cross(along, other)
    if area := dot(normal, normal):
        s, t = (dot(cross(to, x), normal) / area for x in (other, along))
        if 0 <= s <= 1 and 0 <= t <= 1:
            return dot(to, normal) ** 2 / area
    ends = ((a, c, d), (b, c, d), (c, a, b), (d, a, b))
    return min(point_segment(*x) for x in ends)


def beyond_radius(scene, kind, pair):
    """-1, 0 or 1: the features are nearer than the radius, exactly that far apart, or farther."""
    corners = [pair[0], *scene.faces[pair[1]].tolist()] if kind == "vertex-triangle" else pair
    points = [[Fraction(x) for x in scene.vertices[k].tolist()] for k in corners]
    squared = point_triangle(*points) if kind == "vertex-triangle" else segment_segment(*points)
    return int(np.sign(squared - Fraction(scene.radius) ** 2))


# --- the comparison ---------------------------------------------------------------------------------------------------


def compare(name):
    """One row of the table for each kind of pair, and the midpoints of those that Newton missed."""
    scene = SCENES[name]()
    model = scene.model()
    usual = pairs_of_newton(model, scene.radius)
    roomy = pairs_of_newton(model, scene.radius, vertex_buffer_pre_alloc=ROOM, edge_buffer_pre_alloc=ROOM)
    ours = pairs_of_hpccd(model, scene.radius)
    rows, missed = [], []
    for kind, theirs, with_room, own in zip(KINDS, usual, roomy, ours, strict=True):
        side = {pair: beyond_radius(scene, kind, pair) for pair in own ^ with_room}  # of all disagreements
        near, level, far = ({pair for pair, found in side.items() if found == k} for k in (-1, 0, 1))
        dropped = with_room - theirs
        rows.append(
            {
                "scene": name,
                "kind": kind,
                "hpccd": len(own),
                "newton": len(theirs),
                "missed_by_newton": len(dropped) + len(near - with_room),
                "buffer_full": len(dropped),
                "only_newton": len(theirs - own),
                "decided": len(side),
                "at_radius": len(level),
                "newton_wrong": len(near - with_room) + len((level | far) & with_room),
                "hpccd_wrong": len((near | level) - own) + len(far & own),
            }
        )
        missed += [scene.vertices[list(pair[:1] if kind == KINDS[0] else pair)].mean(axis=0) for pair in own - theirs]
    return rows, scene, np.array(missed).reshape(-1, 3)


TITLES = {
    "scene": "scene",
    "kind": "pairs",
    "hpccd": "hpccd",
    "newton": "Newton",
    "missed_by_newton": "missed by Newton",
    "buffer_full": "buffer full",
    "only_newton": "only Newton",
    "decided": "decided",
    "at_radius": "at radius",
    "newton_wrong": "Newton wrong",
    "hpccd_wrong": "hpccd wrong",
}


def table(rows):
    cells = [list(TITLES.values()), *([str(row[key]) for key in TITLES] for row in rows)]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    return "\n".join(
        "  ".join(
            x.ljust(w) if k < 2 else x.rjust(w) for k, (x, w) in enumerate(zip(line, widths, strict=True))
        ).rstrip()
        for line in cells
    )


def draw(path, found):
    """The cloth of each scene, and red points where Newton missed pairs."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5 * len(found), 4.5), layout="constrained")
    for k, (name, (rows, scene, missed)) in enumerate(found.items(), 1):
        axes = figure.add_subplot(1, len(found), k, projection="3d")
        x, y, z = scene.vertices.T
        axes.plot_trisurf(x, y, z, triangles=scene.faces, color=(0.7, 0.75, 0.8, 0.4), edgecolor=(0, 0, 0, 0.15))
        axes.plot(*missed.T, "r.", markersize=2)
        axes.set_title(f"{name}: {sum(row['missed_by_newton'] for row in rows)} pairs missed by Newton")
        axes.set_axis_off()
    figure.savefig(path, dpi=120)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", metavar="SCENE", help=f"{', '.join(SCENES)}; default: all")
    parser.add_argument("--json", metavar="FILE", help="write the table as JSON")
    parser.add_argument("--png", metavar="FILE", help="write a picture of the missed pairs")
    arguments = parser.parse_args()
    for name in arguments.scenes:
        if name not in SCENES:
            parser.error(f"SCENE: {name!r} is not known; use some of {', '.join(SCENES)}")
    wp.config.log_level = wp.LOG_WARNING
    found = {name: compare(name) for name in arguments.scenes or SCENES}
    rows = list(itertools.chain.from_iterable(rows for rows, *_ in found.values()))
    print(table(rows))
    if arguments.json:
        with open(arguments.json, "w") as file:
            json.dump(rows, file, indent=1)
    if arguments.png:
        draw(arguments.png, found)
    return 0


if __name__ == "__main__":
    sys.exit(main())
