#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Untangle cloth: shorten the intersection curves until none is left (Volino and Magnenat-Thalmann 2006).

Scenes: "cloth", folded over and pushed through itself; "sleeve", sunk into a torso; "speared", a sleeve whose end is
inside the torso: its curve is a ring that cannot become shorter, so it stays, and the exit status is 1.
"""

import argparse
import sys

import numpy as np

import hpccd_core as hc
from hpccd_core import shapes


def folded_cloth():
    """Two layers, the lower one dented through the upper one."""
    (vertices, faces), layer = shapes.grid(40, 40), 0.04
    x, y = vertices[:, 0] - vertices[:, 0].mean(), vertices[:, 1] - vertices[:, 1].mean()
    bend = np.pi * layer / 2  # length of cloth in the fold
    turn = np.clip(x / bend, -0.5, 0.5) * np.pi
    out = np.where(np.abs(x) > bend / 2, np.abs(x) - bend / 2, 0.0)
    dent = 0.12 * np.exp(-((x - 0.25) ** 2 + y**2) / 0.005) * (x > 0)
    place = np.stack([layer / 2 * np.cos(turn) - out, y, dent - layer / 2 * np.sin(turn)], axis=1)
    return {"cloth": (place, faces, True)}


def tube(columns, rows, radius, length):
    """Open at both ends, along z."""
    angle, z = np.meshgrid(2 * np.pi * np.arange(columns) / columns, np.linspace(0, length, rows + 1))
    faces = shapes.grid_faces(columns, rows + 1, closed=True)[: 2 * columns * rows]  # not the row that closes a torus
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=2).reshape(-1, 3), faces


def torso():
    vertices, faces = shapes.icosphere(10)
    return vertices * [0.3, 0.2, 0.6], faces


def sleeve_in_torso():
    sleeve, sleeve_faces = tube(32, 50, 0.08, 0.8)
    body, body_faces = torso()
    return {"torso": (body, body_faces, False), "sleeve": (sleeve + [0.34, 0.013, -0.41], sleeve_faces, True)}


def speared_torso():
    sleeve, sleeve_faces = tube(32, 50, 0.08, 0.8)
    body, body_faces = torso()
    across = sleeve[:, [2, 1, 0]] + [0.1, 0.013, 0.017]
    return {"torso": (body, body_faces, False), "sleeve": (across, sleeve_faces, True)}


SCENES = {"cloth": folded_cloth, "sleeve": sleeve_in_torso, "speared": speared_torso}
VIEWS = {"cloth": (-60.0, 35.0), "sleeve": (70.0, 15.0), "speared": (-60.0, 15.0)}  # of pictures, degrees


def displacements(hits, n_vertices, free, most):
    """(V, 3): moves points of the curves along their directions, each by at most `most`, through its five vertices."""
    length = np.linalg.norm(hits.directions, axis=1, keepdims=True)
    step = most * hits.directions / np.maximum(1.0, length)
    vertices = np.concatenate([hits.ef[:, :2], hits.faces[hits.ef[:, 2]]], axis=1)
    s = hits.edge_parameters[:, None]
    weights = np.concatenate([1 - s, s, -hits.weights], axis=1)
    moved, shared = np.zeros((n_vertices, 3)), np.zeros((n_vertices, 1))
    np.add.at(moved, vertices, weights[:, :, None] * step[:, None])
    np.add.at(shared, vertices, np.abs(weights)[:, :, None])
    return free[:, None] * moved / np.maximum(1.0, shared)


def relax(x, edges, rest, free, sweeps=4):
    """Edges back to their lengths, all at once, each by half of what is missing at each vertex."""
    count = np.maximum(1, np.bincount(edges.ravel(), minlength=len(x)))[:, None]
    for _ in range(sweeps):
        along = x[edges[:, 1]] - x[edges[:, 0]]
        length = np.linalg.norm(along, axis=1, keepdims=True)
        pull = 0.5 * (length - rest) / length * along
        moved = np.zeros_like(x)
        np.add.at(moved, edges[:, 0], pull)
        np.add.at(moved, edges[:, 1], -pull)
        x = x + free[:, None] * moved / count
    return x


def sides(faces):
    """The edges of faces, each once."""
    return np.unique(np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)


def untangle(meshes, most_iterations):
    """(positions of all meshes, iterations, intersections at the start, intersections at the end)."""
    scene = hc.Scene()
    for name, (vertices, faces, is_cloth) in meshes.items():
        scene.add_mesh(name, faces, n_vertices=len(vertices), self_collision=is_cloth)
    detector = hc.Detector(scene, outputs=("points", "directions"))
    x = np.concatenate([vertices for vertices, _, _ in meshes.values()])
    free = np.repeat([float(is_cloth) for *_, is_cloth in meshes.values()], [len(v) for v, *_ in meshes.values()])
    first = hits = detector.intersections(x)
    edges = sides(hits.faces)
    rest = np.linalg.norm(x[edges[:, 1]] - x[edges[:, 0]], axis=1, keepdims=True)
    iteration = 0
    while len(hits) and iteration < most_iterations:
        if iteration % 20 == 0:
            contours = hits.contours()
            length = sum(contour.length for contour in contours)
            print(
                f"{iteration:5d}: {len(hits)} intersections, "
                f"{len(contours)} contour{'s'[: len(contours) != 1]} of length {length:.3f}"
            )
        x = relax(x + displacements(hits, len(x), free, 0.2 * rest.mean()), edges, rest, free)
        hits = detector.intersections(x)
        iteration += 1
    return x, iteration, first, hits


def layers(faces):
    """The faces of the upper and of the lower layer of the folded cloth, for pictures."""
    upper = np.arange(len(faces)) // 2 % 40 < 20
    return faces[upper], faces[~upper]


def save_picture(path, name, meshes, x, first, last):
    from hpccd_core.picture import panels

    before = [vertices for vertices, *_ in meshes.values()]
    after = np.split(x, np.cumsum([len(vertices) for vertices in before])[:-1])
    no_edges = np.empty((0, 2), int)
    # Both pictures show the surroundings of the curves before.
    low, high = first.points.min(axis=0), first.points.max(axis=0)
    margin = 0.5 * (high - low).max()
    framed = np.stack(np.meshgrid(*np.stack([low - margin, high + margin], axis=1)), axis=-1).reshape(-1, 3)
    drawn = [
        panels.Panel(
            f"{name}, {when}: {len(hits)} intersections",
            [
                (f"{mesh}{layer}", v, part, no_edges)
                for v, (mesh, (_, f, _)) in zip(places, meshes.items(), strict=True)
                for layer, part in enumerate(layers(f) if mesh == "cloth" else [f])
            ],
            contours=hits.contours(),
            framed=framed,
        )
        for when, places, hits in (("before", before, first), ("after", after, last))
    ]
    panels.save(drawn, path, *VIEWS[name])
    print(f"wrote {path}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    names = ", ".join(SCENES)
    parser.add_argument(
        "scenes", nargs="*", default=["cloth", "sleeve"], help=f"some of {names} (default: cloth sleeve)"
    )
    parser.add_argument("--iterations", type=int, default=500, help="limit of iterations (default: %(default)s)")
    parser.add_argument("--picture", action="store_true", help="write SCENE.png, before and after (needs hpccd)")
    options = parser.parse_args()
    if unknown := set(options.scenes) - set(SCENES):
        parser.error(f"scenes: {', '.join(sorted(unknown))}: not known; use {names}")
    still_tangled = []
    for name in options.scenes:
        meshes = SCENES[name]()
        x, iterations, first, last = untangle(meshes, options.iterations)
        if len(last):
            still_tangled.append(name)
            print(f"{name}: still {len(last)} intersections of {len(first)} after {iterations} iterations")
        else:
            print(f"{name}: {len(first)} intersections, none left after {iterations} iterations")
        if options.picture:
            save_picture(f"{name}.png", name, meshes, x, first, last)
    return f"not untangled: {', '.join(still_tangled)}" if still_tangled else 0


if __name__ == "__main__":
    sys.exit(main())
