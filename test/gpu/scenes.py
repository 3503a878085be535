# SPDX-License-Identifier: Apache-2.0
"""Scenes of several meshes for comparing backends."""

import numpy as np

import hpccd_core as hc


def sheet(n):
    """Faces of a square sheet of n x n vertices."""
    i = np.arange(n * n).reshape(n, n)
    a, b, c, d = i[:-1, :-1].ravel(), i[1:, :-1].ravel(), i[:-1, 1:].ravel(), i[1:, 1:].ravel()
    return np.concatenate([np.stack([a, b, d], axis=1), np.stack([a, d, c], axis=1)])


def flat(n):
    """Vertices of such a sheet, on integers."""
    return np.stack([*np.meshgrid(np.arange(n), np.arange(n)), np.zeros((n, n))], axis=2).reshape(-1, 3).astype(float)


def crumpled(rng, n):
    """A sheet that passes through itself within the step."""
    return sheet(n), flat(n) + rng.normal(0, 0.3, (n * n, 3)), flat(n) + rng.normal(0, 1.0, (n * n, 3))


def lattice(rng, n):
    """A sheet on a coarse lattice: coincident vertices, flat triangles, coplanar motion."""
    return sheet(n), flat(n) + rng.integers(-1, 2, (n * n, 3)), flat(n) // 2 + rng.integers(-1, 2, (n * n, 3))


def soup(rng, n):
    """Triangles with random corners among few vertices; some name a vertex twice; the last vertices are in none."""
    return rng.integers(0, n, (2 * n, 3)), *rng.integers(-5, 6, (2, n + 3, 3)).astype(float)


def rope(rng, n):
    """Edges one after the other in a tangle."""
    start = np.cumsum(rng.normal(0, 0.6, (n, 3)), axis=0)
    start -= start.mean(axis=0)
    edges = np.stack([np.arange(n - 1), np.arange(1, n)], axis=1)
    return np.empty((0, 3), int), start, start + rng.normal(0, 1, (n, 3)), edges


def fringed(rng, n):
    """A sheet with as many threads as it has triangles, between any two vertices, on small integers."""
    faces, start, end = lattice(rng, n)
    return faces, start, end, rng.integers(0, n * n, (len(faces), 2))


def join(parts, **rules):
    """(scene, vertices_t0, vertices_t1) of meshes (faces, t0, t1) or (faces, t0, t1, edges). rules: no_self, static,
    ignored, accuracy."""
    scene = hc.Scene()
    for i, (faces, t0, _, *edges) in enumerate(parts):
        scene.add_mesh(
            f"mesh{i}",
            faces,
            edges=edges[0] if edges else (),
            n_vertices=len(t0),
            self_collision=i not in rules.get("no_self", ()),
            static=i in rules.get("static", ()),
        )
    for a, b in rules.get("ignored", ()):
        scene.ignore_pair(a, b)
    for a, b, accuracy in rules.get("accuracy", ()):
        scene.set_accuracy(a, b, accuracy)
    return scene, np.concatenate([p[1] for p in parts]), np.concatenate([p[2] for p in parts])
