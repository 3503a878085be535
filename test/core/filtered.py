# SPDX-License-Identifier: Apache-2.0
"""Random filters below the mesh, and which pairs they ignore: by breadth-first search and rational distances."""

import itertools
from fractions import Fraction
from functools import cache

import exact_geometry as exact
import numpy as np
from exact_intersections import place, rational
from fuzz.generators import EDGE_EDGE


class Filters:
    """Of random_scenes.Meshes. Calls and rows refer to the scene's numbers, graphs and positions at rest to all."""

    def __init__(self, meshes):
        self.meshes = meshes
        self.first_vertex = np.concatenate([[0], np.cumsum(meshes.n_vertices)])
        self.first_face = np.concatenate([[0], np.cumsum([len(f) for f in meshes.faces])])
        faces = zip(self.first_vertex, meshes.faces, strict=False)
        self.faces = [tuple(map(int, face + v)) for v, of_mesh in faces for face in of_mesh]
        edges = {tuple(sorted(e)) for f in self.faces for e in itertools.combinations(f, 2)}
        for v, given in zip(self.first_vertex, meshes.edges, strict=False):
            edges |= {tuple(sorted(map(int, e + v))) for e in given}
        self.edges = sorted(e for e in edges if e[0] != e[1])
        self.joined = {v: set() for v in range(self.first_vertex[-1])}
        for v, w in self.edges:
            self.joined[v].add(w), self.joined[w].add(v)
        self.rings, self.rest, self.against = {}, [], {}
        self.vf, self.ee, self.ef = set(), set(), set()
        self._calls = []
        self.reached = cache(self._reached)
        self.near_at_rest = cache(self._near_at_rest)

    def apply(self, scene):
        for name, arguments, named in self._calls:
            getattr(scene, name)(*arguments, **named)
        return scene

    def ignore_rings(self, mesh, rings):
        self.rings[mesh] = max(rings, self.rings.get(mesh, 0))
        self._calls.append(("ignore_within", (mesh,), {"rings": rings}))

    def ignore_at_rest(self, mesh, vertices, distance):
        self.rest.append((mesh, rational(vertices), Fraction(float(distance)) ** 2))
        self._calls.append(("ignore_within", (f"mesh{mesh}",), {"rest_vertices": vertices, "distance": distance}))

    def ignore_faces(self, mesh, faces, other):
        listed = {int(self.first_face[mesh] + f) for f in faces} | self.against.get((mesh, other), set())
        self.against[mesh, other] = listed
        self._calls.append(("ignore_faces", (mesh, faces, other), {}))

    def ignore_features(self, vf=(), ee=(), ef=()):
        self.vf |= {tuple(map(int, row)) for row in vf}
        self.ee |= {frozenset((frozenset(map(int, row[:2])), frozenset(map(int, row[2:])))) for row in ee}
        self.ef |= {(frozenset(map(int, row[:2])), int(row[2])) for row in ef}
        self._calls.append(("ignore_features", (vf, ee, ef), {}))

    def mesh(self, vertex):
        return int(np.searchsorted(self.first_vertex, vertex, "right") - 1)

    def _reached(self, vertex, rings):
        """Vertices joined to one by at most this number of edges."""
        reached = {vertex}
        for _ in range(rings):
            reached |= {w for v in reached for w in self.joined[v]}
        return reached

    def ignored(self, kind, row):
        """kind: "vf", "ee" or "ef"; row: as in the results."""
        row = tuple(map(int, row))
        a = row[:1] if kind == "vf" else row[:2]
        b = row[2:] if kind == "ee" else self.faces[row[-1]]
        meshes = self.mesh(a[0]), self.mesh(b[0])
        if meshes[0] == meshes[1]:
            rings = self.rings.get(meshes[0], 0)
            if any(w in self.reached(v, rings) for v in a for w in b):
                return True
            if any(mesh == meshes[0] and self.near_at_rest(i, a, b) for i, (mesh, _, _) in enumerate(self.rest)):
                return True
        sides = (a, None, *meshes), (b, None if kind == "ee" else row[-1], *meshes[::-1])
        if any(self._against(*side) for side in sides):
            return True
        if kind == "ee":
            return frozenset((frozenset(a), frozenset(b))) in self.ee
        return row in self.vf if kind == "vf" else (frozenset(a), row[-1]) in self.ef

    def _against(self, vertices, face, mesh, other):
        """A feature against another mesh: a listed face, or in a listed face and in no other."""
        listed = self.against.get((mesh, other), set())
        if face is not None:
            return face in listed
        of = {i for i, f in enumerate(self.faces) if set(vertices) <= set(f)}
        return bool(of) and of <= listed

    def _near_at_rest(self, number, a, b):
        mesh, positions, square = self.rest[number]
        x = [[positions[v - self.first_vertex[mesh]] for v in feature] for feature in (a, b)]
        if len(a) == 1:
            return exact.squared_distance_to_triangle(x[0][0], x[1]) <= square
        if len(b) == 2:
            between = exact.gap(EDGE_EDGE, [*x[0], *x[1]])
            return sum(c * c for c in between) <= square
        if place(tuple(x[0]), x[1]) is not None:
            return True
        return any(self._near_at_rest(number, (v,), b) for v in a) or any(
            self._near_at_rest(number, a, e) for e in itertools.combinations(b, 2)
        )


def random_filters(rng, meshes, rows=None):
    """Some of each. rows: vf, ee and ef of results, of which single pairs are ignored."""
    filters = Filters(meshes)
    n = len(meshes.faces)
    for mesh in range(n):
        begin, end = filters.first_vertex[mesh : mesh + 2]
        if rng.random() < 0.4:
            filters.ignore_rings(mesh, int(rng.integers(0, 3)))
        if rng.random() < 0.4:
            rest = meshes.vertices_t0[begin:end] + rng.integers(-1, 2, (end - begin, 3)) / 2
            filters.ignore_at_rest(mesh, rest, float(rng.choice([0.0, 0.5, 1.0])))
    for _ in range(n):
        mesh, other = rng.integers(0, n, 2)
        if len(meshes.faces[mesh]):
            some = rng.integers(0, len(meshes.faces[mesh]), len(meshes.faces[mesh]) // 2 + 1)
            filters.ignore_faces(int(mesh), some, int(other))
    for name in rows or ():
        filters.ignore_features(**{name: rows[name][rng.random(len(rows[name])) < 0.2]})
    return filters


def kept(result, filters, names=("vf", "ee"), value="toc"):
    """The rows of a result without filters, and their values, that remain."""
    remains = {name: [not filters.ignored(name, row) for row in getattr(result, name).tolist()] for name in names}
    rows = {name: getattr(result, name)[np.array(remains[name], bool)] for name in names}
    values = {
        f"{name}_{value}": getattr(result, f"{name}_{value}")[np.array(remains[name], bool)] for name in names if value
    }
    return {**rows, **values}


def smallest_distances(meshes, filters):
    """(mesh_a, mesh_b) -> squared distance of the nearest features that remain, by brute force in rationals."""
    x = rational(meshes.vertices_t0)
    features = [((v,), "vertex") for v in range(len(x))] + [(e, "edge") for e in filters.edges]
    features += [(f, "face") for f in filters.faces]
    least = {}
    for (i, (a, kind_a)), (j, (b, kind_b)) in itertools.product(enumerate(features), repeat=2):
        if (kind_a, kind_b) not in (("vertex", "face"), ("edge", "edge"), ("edge", "face")) or set(a) & set(b):
            continue
        if kind_b == "edge" and i >= j:
            continue
        face = j - len(x) - len(filters.edges)
        row = (*a, *b) if kind_b == "edge" else (*a, face)
        name = {"vertex": "vf", "edge": "ee" if kind_b == "edge" else "ef"}[kind_a]
        if filters.ignored(name, row):
            continue
        at = [[x[v] for v in feature] for feature in (a, b)]
        if name == "ef":
            square = 0 if place(tuple(at[0]), at[1]) is not None else None
        elif name == "vf":
            square = exact.squared_distance_to_triangle(at[0][0], at[1])
        else:
            square = sum(c * c for c in exact.gap(EDGE_EDGE, [*at[0], *at[1]]))
        pair = tuple(sorted((filters.mesh(a[0]), filters.mesh(b[0]))))
        if square is not None and square < least.get(pair, float("inf")):
            least[pair] = square
    return least
