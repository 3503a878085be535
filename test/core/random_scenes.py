# SPDX-License-Identifier: Apache-2.0
"""Small deforming scenes: enough of everything to go wrong, small enough for brute force."""

import dataclasses

import numpy as np
import oracle

import hpccd_core as hc

NO_FACES, NO_EDGES = np.empty((0, 3), int), np.empty((0, 2), int)


@dataclasses.dataclass
class Meshes:
    """faces: for each mesh (F,3), its own indices; edges: those beside the faces' own, (E,2) likewise; vertices_t0,
    vertices_t1: (V,3), all meshes one after the other."""

    faces: list
    vertices_t0: np.ndarray
    vertices_t1: np.ndarray
    n_vertices: list
    edges: list

    def scene(self, *, no_self_collision=(), static=(), ignored_pairs=()):
        scene = hc.Scene()
        for i, (faces, edges, n) in enumerate(zip(self.faces, self.edges, self.n_vertices, strict=True)):
            rules = {"self_collision": i not in no_self_collision, "static": i in static}
            scene.add_mesh(f"mesh{i}", faces, edges=edges, n_vertices=n, **rules)
        for a, b in ignored_pairs:
            scene.ignore_pair(f"mesh{a}", f"mesh{b}")
        return scene

    @property
    def beside_faces(self):
        """What the oracles want to know of the meshes beside their faces."""
        return {"n_vertices": self.n_vertices, "edges_per_mesh": self.edges}

    def truth(self, **options):
        return oracle.brute_force(self.vertices_t0, self.vertices_t1, self.faces, **self.beside_faces, **options)


def sheet(n):
    """Faces of a square sheet of n x n vertices."""
    i = np.arange(n * n).reshape(n, n)
    a, b, c, d = i[:-1, :-1].ravel(), i[1:, :-1].ravel(), i[:-1, 1:].ravel(), i[1:, 1:].ravel()
    return np.concatenate([np.stack([a, b, d], axis=1), np.stack([a, d, c], axis=1)])


def crumpled_sheet(rng, n=9):
    """A sheet that passes through itself within the step."""
    flat = np.stack([*np.meshgrid(np.arange(n), np.arange(n)), np.zeros((n, n))], axis=2).reshape(-1, 3).astype(float)
    return sheet(n), flat + rng.normal(0, 0.3, flat.shape), flat + rng.normal(0, 1.2, flat.shape)


def lattice_sheet(rng, n=7):
    """A sheet on a coarse lattice: coincident vertices, flat triangles, coplanar motion."""
    flat = np.stack([*np.meshgrid(np.arange(n), np.arange(n)), np.zeros((n, n))], axis=2).reshape(-1, 3)
    return sheet(n), flat + rng.integers(-1, 2, flat.shape), flat // 2 + rng.integers(-1, 2, flat.shape)


def soup(rng, n_faces=40):
    """Triangles with random corners among few vertices; some name a vertex twice."""
    n = n_faces // 2
    return rng.integers(0, n, (n_faces, 3)), *rng.integers(-3, 4, (2, n, 3))


def tetrahedron(rng):
    """A body with a motion longer than itself."""
    faces = np.array([[0, 1, 2], [0, 3, 1], [1, 3, 2], [0, 2, 3]])
    body = rng.normal(0, 1, (4, 3))
    return faces, body + rng.normal(0, 2, 3), body + rng.normal(0, 2, 3)


def rope(rng, n=30):
    """Edges one after the other in a tangle, some given twice or from a vertex to itself."""
    edges = np.stack([np.arange(n - 1), np.arange(1, n)], axis=1)
    again = rng.integers(0, n - 1, 5)
    edges = np.concatenate([edges, edges[again, ::-1], np.stack([again, again], axis=1)])
    start = np.cumsum(rng.normal(0, 0.6, (n, 3)), axis=0)
    start -= start.mean(axis=0)
    return NO_FACES, start, start + rng.normal(0, 1, (n, 3)), rng.permutation(edges)


def lattice_rope(rng, n=24):
    """Edges between any two vertices of a coarse lattice: coincident, parallel, at rest."""
    return NO_FACES, *rng.integers(0, 4, (2, n, 3)), rng.integers(0, n, (n, 2))


def fringed_sheet(rng, n=5):
    """A sheet with threads at its border; some edges are the sheet's own, the last vertices are in nothing."""
    faces, start, end = crumpled_sheet(rng, n)
    n_sheet, n_threads = n * n, 2 * n
    ends = rng.normal(0, 2, (2, n_threads + 2, 3)) + [n / 2, n / 2, 0]
    border = rng.integers(0, n_sheet, n_threads)
    threads = np.stack([border, n_sheet + np.arange(n_threads)], axis=1)
    edges = rng.permutation(np.concatenate([threads, faces[:6, :2]]))
    return faces, np.concatenate([start, ends[0]]), np.concatenate([end, ends[1]]), edges


def combine(*meshes):
    """Of (faces, vertices_t0, vertices_t1) or (faces, vertices_t0, vertices_t1, edges) each."""
    return Meshes(
        faces=[m[0] for m in meshes],
        vertices_t0=np.concatenate([m[1] for m in meshes]).astype(float),
        vertices_t1=np.concatenate([m[2] for m in meshes]).astype(float),
        n_vertices=[len(m[1]) for m in meshes],
        edges=[m[3] if len(m) > 3 else NO_EDGES for m in meshes],
    )


def free_at_first(rng):
    """Flat sheets and bodies above each other, which touch nothing before they have moved."""
    layers = []
    for level, n in enumerate((9, 5)):
        flat = np.stack([*np.meshgrid(np.arange(n), np.arange(n)), np.full((n, n), 4 * level)], axis=2)
        flat = flat.reshape(-1, 3).astype(float)
        layers.append((sheet(n), flat + rng.normal(0, 0.05, flat.shape), flat + rng.normal(0, 1.5, flat.shape)))
    for level in (2, 3, 4):
        faces, _, end = tetrahedron(rng)
        layers.append((faces, 0.5 * rng.normal(0, 1, (4, 3)) + [4, 4, 4 * level], end + [4, 4, 0]))
    return combine(*layers)


def single_mesh(rng):
    return combine(crumpled_sheet(rng))


def lattice(rng):
    return combine(lattice_sheet(rng))


def triangle_soup(rng):
    return combine(soup(rng))


def many_meshes(rng):
    return combine(crumpled_sheet(rng, 6), lattice_sheet(rng, 5), tetrahedron(rng), tetrahedron(rng), soup(rng, 16))


def lone_vertices(rng):
    """Particles, which are in no face, among bodies."""
    particles = NO_FACES, *rng.normal(0, 2, (2, 40, 3))
    return combine(crumpled_sheet(rng, 5), particles, tetrahedron(rng))


def huge_and_tiny(rng):
    """A body 2^40 times as large as the others and far away bodies as small."""
    small = combine(crumpled_sheet(rng, 5), tetrahedron(rng))
    faces, start, end = tetrahedron(rng)
    tiny = [faces, start * 2.0**-40 + 1, end * 2.0**-40 + 1]
    return combine(
        *[
            (small.faces[i], small.vertices_t0[rows], small.vertices_t1[rows])
            for i, rows in enumerate((slice(0, 25), slice(25, 29)))
        ],
        (faces, start * 2.0**40, end * 2.0**40),
        tiny,
    )


def spread(rng):
    """Bodies far apart for their size, a vertex farther than all, a face that leads there, and a body between them that
    goes far."""
    sheet_faces, start, end = crumpled_sheet(rng, 5)
    by = np.array([3e8, -2e8, 1e8])
    faces, body, moved = tetrahedron(rng)
    escaped = np.concatenate([sheet_faces, [[0, 1, 25]]])
    far = [[-4e9, 5e9, 6e9]]
    return combine(
        (escaped, np.concatenate([start, far]), np.concatenate([end, far])),
        (faces, body, moved),
        (sheet_faces, start + by, end + by),
        (faces, body + by, moved + by),
        (faces, body + [2, 2, 0], moved - [7e7, 0, 0]),
    )


def ropes(rng):
    """Edges in no face, among sheets, bodies and particles."""
    particles = NO_FACES, *rng.normal(0, 2, (2, 10, 3))
    return combine(rope(rng), fringed_sheet(rng), rope(rng, 9), particles, tetrahedron(rng))


def lattice_ropes(rng):
    return combine(lattice_rope(rng), lattice_sheet(rng, 4), lattice_rope(rng, 12))


ALL = (single_mesh, lattice, triangle_soup, many_meshes, lone_vertices, huge_and_tiny, spread, ropes, lattice_ropes)
