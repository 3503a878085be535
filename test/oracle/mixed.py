# SPDX-License-Identifier: Apache-2.0
"""All results of scenes with planes, points, ropes, thickness per feature and filters, by exact tests of all pairs.

Numbers of meshes: in the order given, then those of the planes. The separation of a pair is d + (thickness_a +
thickness_b), in double precision and then taken exactly; d is that of their meshes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction

import numpy as np

from . import elementary

CONTACT_KINDS = ("vf", "ee", "vp", "vv", "ve")
PRECISE = 2**200  # denominator of square roots


@dataclass(frozen=True)
class MixedMesh:
    """faces (F,3), edges (E,2): its own indices; edges are those beside the faces' own. points: vertices in no face and
    no edge are tested against each other and against edges of no face."""

    faces: np.ndarray
    n_vertices: int
    edges: np.ndarray = field(default_factory=lambda: np.empty((0, 2), int))
    points: bool = False
    self_collision: bool = True
    static: bool = False


@dataclass(frozen=True)
class Filters:
    """rings: by mesh. rest: by mesh, positions (n,3) and a distance. faces: (mesh, its faces, other mesh). vf, ee:
    single pairs in scene-wide numbers."""

    rings: Mapping[int, int] = field(default_factory=dict)
    rest: Mapping[int, tuple[np.ndarray, float]] = field(default_factory=dict)
    faces: Sequence[tuple[int, Sequence[int], int]] = ()
    vf: Sequence[tuple[int, int]] = ()
    ee: Sequence[tuple[int, int, int, int]] = ()


@dataclass(frozen=True)
class Values:
    """What may change from call to call. planes: (P,4), normal and offset. separations: of two meshes or planes.
    thickness: for each mesh one number, or one for each face (edge, where there is no face; vertex, where there is
    neither)."""

    planes: np.ndarray
    separations: np.ndarray
    thickness: Sequence[np.ndarray]


@dataclass(frozen=True)
class MixedGap:
    """distance: between the surfaces; +inf where no pair of features exists. intersect: the centre surfaces do."""

    mesh_a: int
    mesh_b: int
    distance: float
    intersect: bool


class _Pairs:
    """first, second: features by number; rows: as in results; corners (N,4): of the query, where there is one."""

    def __init__(self, first: np.ndarray, second: np.ndarray, rows: np.ndarray, corners: np.ndarray) -> None:
        self.first, self.second, self.rows, self.corners = first, second, rows, corners

    def part(self, chosen: np.ndarray) -> _Pairs:
        return _Pairs(self.first[chosen], self.second[chosen], self.rows[chosen], self.corners[chosen])


class MixedScene:
    """Meshes, planes, and which pairs of features are tested."""

    def __init__(
        self,
        meshes: Sequence[MixedMesh],
        n_planes: int = 0,
        ignored_pairs: Sequence[tuple[int, int]] = (),
        filters: Filters = Filters(),
    ) -> None:
        self.meshes, self.n_planes, self.ignored_pairs, self.filters = meshes, n_planes, ignored_pairs, filters
        n = [mesh.n_vertices for mesh in meshes]
        self.first_vertex = np.cumsum([0, *n])
        self.first_face = np.cumsum([0, *[len(mesh.faces) for mesh in meshes]])
        self.n_vertices = sum(n)
        self.mesh_of_vertex = np.repeat(np.arange(len(meshes)), n)
        offsets = self.first_vertex[:-1]
        self.faces = np.concatenate([np.reshape(m.faces, (-1, 3)) + o for m, o in zip(meshes, offsets, strict=True)])
        self.mesh_of_face = self.mesh_of_vertex[self.faces[:, 0]]
        of_faces = _sorted_edges(np.concatenate([self.faces[:, [0, 1]], self.faces[:, [1, 2]], self.faces[:, [2, 0]]]))
        beside = [np.reshape(m.edges, (-1, 2)) + o for m, o in zip(meshes, offsets, strict=True)]
        self.edges = _sorted_edges(np.concatenate([of_faces, *beside]))
        in_faces = {tuple(edge) for edge in of_faces.tolist()}
        self.lone = np.array([tuple(edge) not in in_faces for edge in self.edges.tolist()], bool)
        self.mesh_of_edge = self.mesh_of_vertex[self.edges[:, 0]]
        used = np.zeros(self.n_vertices, bool)
        used[self.faces.ravel()] = used[self.edges.ravel()] = True
        with_points = np.array([mesh.points for mesh in meshes], bool)
        self.points = np.flatnonzero(~used & with_points[self.mesh_of_vertex])
        self.tested = self._tested_meshes()
        self.pairs = {kind: self._tested_pairs(kind) for kind in (*CONTACT_KINDS, "ef")}

    def _tested_meshes(self) -> np.ndarray:
        static = np.array([*[mesh.static for mesh in self.meshes], *[True] * self.n_planes])
        tested = ~(static[:, None] & static)
        for number, mesh in enumerate(self.meshes):
            tested[number, number] &= mesh.self_collision
        for a, b in self.ignored_pairs:
            tested[a, b] = tested[b, a] = False
        return tested

    def corners_of(self, side: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of a kind of feature: the vertices of each (N,k), its mesh, and its number where thickness is kept."""
        every = np.arange(self.n_vertices)
        if side == "v":
            return every[:, None], self.mesh_of_vertex, every
        if side == "point":
            return self.points[:, None], self.mesh_of_vertex[self.points], self.points
        if side == "f":
            return self.faces, self.mesh_of_face, np.arange(len(self.faces))
        if side == "p":
            planes = np.arange(self.n_planes)
            return np.full((self.n_planes, 1), -1), len(self.meshes) + planes, planes
        chosen = np.flatnonzero(self.lone) if side == "lone" else np.arange(len(self.edges))
        return self.edges[chosen], self.mesh_of_edge[chosen], chosen

    def _tested_pairs(self, kind: str) -> _Pairs:
        sides = {"vf": "v f", "ee": "e e", "vp": "v p", "vv": "point point", "ve": "point lone", "ef": "e f"}[
            kind
        ].split()
        (of_a, mesh_a, number_a), (of_b, mesh_b, number_b) = map(self.corners_of, sides)
        a, b = (axis.ravel() for axis in np.mgrid[0 : len(of_a), 0 : len(of_b)])
        keep = self.tested[mesh_a[a], mesh_b[b]]
        if kind in ("ee", "vv"):
            keep &= a < b
        keep &= ~(of_a[a][:, :, None] == of_b[b][:, None, :]).any(axis=(1, 2))
        a, b = a[keep], b[keep]
        v_a, v_b = of_a[a], of_b[b]
        rows = {
            "vf": lambda: np.stack([v_a[:, 0], number_b[b]], axis=1),
            "vp": lambda: np.stack([v_a[:, 0], number_b[b]], axis=1),
            "ef": lambda: np.column_stack([v_a, number_b[b]]),
        }.get(kind, lambda: np.hstack([v_a, v_b]))()
        if kind in ("vf", "ef"):
            corners = np.hstack([v_a, v_b])
        elif kind == "vp":
            corners = np.repeat(v_a, 4, axis=1)
        else:
            corners = np.hstack([v_a[:, [0, -1]], v_b[:, [0, -1]]])
        pairs = _Pairs(number_a[a], number_b[b], rows, corners)
        pairs = pairs.part(~self._ignored(kind, pairs, v_a, v_b, mesh_a[a], mesh_b[b]))
        return pairs.part(np.lexsort(pairs.rows.T[::-1]))

    def _ignored(
        self, kind: str, pairs: _Pairs, v_a: np.ndarray, v_b: np.ndarray, mesh_a: np.ndarray, mesh_b: np.ndarray
    ) -> np.ndarray:
        ignored = np.zeros(len(v_a), bool)
        if kind == "vp":
            return ignored
        for mesh, rings in self.filters.rings.items():
            joined = self._joined(mesh, rings)
            within = np.flatnonzero((mesh_a == mesh) & (mesh_b == mesh))
            ignored[within] |= joined[v_a[within][:, :, None], v_b[within][:, None, :]].any(axis=(1, 2))
        for mesh, (rest, distance) in self.filters.rest.items():
            within = np.flatnonzero((mesh_a == mesh) & (mesh_b == mesh))
            corners = pairs.corners[within] - self.first_vertex[mesh]
            ignored[within] |= _near(kind, np.asarray(rest, float)[corners], distance)
        for mesh, faces, other in self.filters.faces:
            in_a, in_b = (self._only_in(mesh, faces, v) for v in (v_a, v_b))
            ignored |= (in_a & (mesh_b == other)) | (in_b & (mesh_a == other))
        single = {"vf": self.filters.vf, "ee": self.filters.ee}.get(kind, ())
        listed = {_canonical(kind, row) for row in single}
        return ignored | np.array([tuple(row) in listed for row in pairs.rows.tolist()], bool)

    def _joined(self, mesh: int, rings: int) -> np.ndarray:
        """(V,V): a path of at most `rings` edges of the mesh."""
        step = np.eye(self.n_vertices, dtype=bool)
        of_mesh = self.edges[self.mesh_of_edge == mesh]
        step[of_mesh[:, 0], of_mesh[:, 1]] = step[of_mesh[:, 1], of_mesh[:, 0]] = True
        joined = np.eye(self.n_vertices, dtype=bool)
        for _ in range(rings):
            joined = joined @ step
        return joined

    def _only_in(self, mesh: int, faces: Sequence[int], vertices: np.ndarray) -> np.ndarray:
        """Features (N,k) by their vertices: one of these faces, or an edge or vertex of theirs and of no other."""
        corners = self.faces[self.mesh_of_face == mesh]
        chosen = np.isin(np.arange(len(corners)), list(faces))
        holds = (vertices[:, None, :, None] == corners[None, :, None, :]).any(axis=3).all(axis=2)  # (N,F)
        if vertices.shape[1] == 3:
            return (holds & chosen).any(axis=1)
        return (holds & chosen).any(axis=1) & ~(holds & ~chosen).any(axis=1)

    def thickness_of(self, values: Values) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of each vertex, edge and face."""
        of_vertex, of_edge, of_face = (np.zeros(n) for n in (self.n_vertices, len(self.edges), len(self.faces)))
        number = {tuple(edge): e for e, edge in enumerate(self.edges.tolist())}
        for m, (mesh, given) in enumerate(zip(self.meshes, values.thickness, strict=True)):
            given, start = np.asarray(given, float), self.first_vertex[m]
            if given.ndim == 0:
                of_vertex[self.mesh_of_vertex == m] = of_edge[self.mesh_of_edge == m] = given
                of_face[self.mesh_of_face == m] = given
            elif len(mesh.faces):
                for f, t in zip(range(self.first_face[m], self.first_face[m + 1]), given, strict=True):
                    of_face[f] = t
                    for pair in _sorted_edges(self.faces[f][[[0, 1], [1, 2], [2, 0]]]).tolist():
                        of_edge[number[tuple(pair)]] = max(of_edge[number[tuple(pair)]], t)
                    of_vertex[self.faces[f]] = np.maximum(of_vertex[self.faces[f]], t)
            elif len(mesh.edges):
                for edge, t in zip(np.sort(np.asarray(mesh.edges) + start, axis=1).tolist(), given, strict=True):
                    of_edge[number[tuple(edge)]] = max(of_edge[number[tuple(edge)]], t)
                    of_vertex[edge] = np.maximum(of_vertex[edge], t)
            else:
                of_vertex[start : start + mesh.n_vertices] = given
        return of_vertex, of_edge, of_face

    def thickness_of_pairs(self, kind: str, values: Values) -> np.ndarray:
        """The sum of both, for each pair of the kind."""
        v, e, f = self.thickness_of(values)
        pairs, none = self.pairs[kind], np.zeros(self.n_planes)
        a, b = {"vf": (v, f), "ee": (e, e), "vp": (v, none), "vv": (v, v), "ve": (v, e), "ef": (e, f)}[kind]
        return a[pairs.first] + b[pairs.second]

    def meshes_of_pairs(self, kind: str) -> tuple[np.ndarray, np.ndarray]:
        pairs = self.pairs[kind]
        second = len(self.meshes) + pairs.second if kind == "vp" else self.mesh_of_vertex[pairs.corners[:, 2]]
        return self.mesh_of_vertex[pairs.corners[:, 0]], second

    def contacts(self, t0: np.ndarray, t1: np.ndarray, values: Values) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """By kind, rows and times (rounded down) in canonical order."""
        found = {}
        for kind in CONTACT_KINDS:
            pairs, mesh = self.pairs[kind], self.meshes_of_pairs(kind)
            separation = np.asarray(values.separations)[mesh] + self.thickness_of_pairs(kind, values)
            if kind == "vp":
                times = [
                    plane_time(t0[v], t1[v], values.planes[p], s)
                    for (v, p), s in zip(pairs.rows, separation, strict=True)
                ]
                toc = np.array(times, float)
            else:
                ends = np.concatenate([t0[pairs.corners], t1[pairs.corners]], axis=1)
                toc = np.full(len(ends), np.inf)
                close = np.flatnonzero(~_farther(kind, ends, separation))
                toc[close] = _times(kind, ends[close], separation[close])
            hit = np.isfinite(toc)
            found[kind] = pairs.rows[hit], toc[hit]
        return found

    def proximity(self, x: np.ndarray, distance: float, values: Values) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """By kind, rows of pairs whose surfaces are within the distance, and the distances of the surfaces."""
        found = {}
        for kind in CONTACT_KINDS:
            thickness, pairs = self.thickness_of_pairs(kind, values), self.pairs[kind]
            within = distance + thickness
            if kind == "vp":
                near = np.array(
                    [plane_within(x[v], values.planes[p], s) for (v, p), s in zip(pairs.rows, within, strict=True)],
                    bool,
                )
            else:
                near = ~_farther(kind, x[pairs.corners], within)
                near[near] = _near(kind, x[pairs.corners[near]], within[near])
            found[kind] = pairs.rows[near], self._distances(kind, x, values)[near]
        return found

    def intersections(self, x: np.ndarray) -> np.ndarray:
        pairs = self.pairs["ef"]
        close = np.flatnonzero(~_farther("ef", x[pairs.corners], np.zeros(len(pairs.rows))))
        return pairs.rows[close[elementary.edge_face_intersect(x[pairs.corners[close]], 1)]]

    def gaps(self, x: np.ndarray, values: Values) -> list[MixedGap]:
        """Of all tested pairs of meshes and planes that are not two planes, mesh_a <= mesh_b."""
        n = len(self.meshes)
        smallest, intersect = np.full((n + self.n_planes,) * 2, np.inf), np.zeros((n + self.n_planes,) * 2, bool)
        for kind in CONTACT_KINDS:
            mesh = np.sort(np.stack(self.meshes_of_pairs(kind)), axis=0)
            np.minimum.at(smallest, tuple(mesh), self._distances(kind, x, values))
        pairs = self.pairs["ef"]
        meeting = np.flatnonzero(~_farther("ef", x[pairs.corners], np.zeros(len(pairs.rows))))
        meeting = meeting[elementary.edge_face_intersect(x[pairs.corners[meeting]], 1)]
        mesh = np.sort(np.stack(self.meshes_of_pairs("ef")), axis=0)[:, meeting]
        np.minimum.at(smallest, tuple(mesh), -self.thickness_of_pairs("ef", values)[meeting])
        intersect[tuple(mesh)] = True
        return [
            MixedGap(a, b, float(smallest[a, b]), bool(intersect[a, b]))
            for a in range(n)
            for b in range(a, n + self.n_planes)
            if self.tested[a, b]
        ]

    def _distances(self, kind: str, x: np.ndarray, values: Values) -> np.ndarray:
        pairs = self.pairs[kind]
        if kind == "vp":
            centre = np.array([plane_distance(x[v], values.planes[p]) for v, p in pairs.rows], float)
        elif kind == "vf":
            centre = elementary.distance_vertex_face(x[pairs.corners], 1)
        else:
            centre = elementary.distance_edge_edge(x[pairs.corners], 1)
        return centre - self.thickness_of_pairs(kind, values)


def plane_time(start: np.ndarray, end: np.ndarray, plane: np.ndarray, separation: float) -> float:
    """When a vertex is first within the separation of a half-space's border or beyond it, rounded down; +inf: never."""
    if plane_within(start, plane, separation):
        return 0.0
    if not plane_within(end, plane, separation):
        return math.inf
    first, last = _height(start, plane), _height(end, plane)
    square = Fraction(separation) ** 2 * _squared_length(plane)
    numerator = square.numerator * square.denominator * PRECISE**2  # root(a / b) = root(a b) / b
    root = math.isqrt(numerator)
    at = Fraction(root + (root * root < numerator), square.denominator * PRECISE)
    time = max(Fraction(0), (first - at) / (first - last))
    rounded = float(time)
    return rounded if Fraction(rounded) <= time else float(np.nextafter(rounded, 0.0))


def plane_within(x: np.ndarray, plane: np.ndarray, separation: float) -> bool:
    height = _height(x, plane)
    return height <= 0 or height**2 <= Fraction(float(separation)) ** 2 * _squared_length(plane)


def plane_distance(x: np.ndarray, plane: np.ndarray) -> float:
    """Negative outside the half-space; off by about one rounding."""
    height, square = _height(x, plane), _squared_length(plane)
    squared = height**2 / square
    root = Fraction(math.isqrt(squared.numerator * squared.denominator * PRECISE**2), squared.denominator * PRECISE)
    return math.copysign(float(root), height)


def _height(x: np.ndarray, plane: np.ndarray) -> Fraction:
    return sum(
        (Fraction(float(n)) * Fraction(float(c)) for n, c in zip(plane, x, strict=False)), -Fraction(float(plane[3]))
    )


def _squared_length(plane: np.ndarray) -> Fraction:
    return sum((Fraction(float(n)) ** 2 for n in plane[:3]), Fraction(0))


def _times(kind: str, ends: np.ndarray, separation: np.ndarray) -> np.ndarray:
    plain, separated = {
        "vf": (elementary.vertex_face, elementary.separation_vertex_face),
        "ee": (elementary.edge_edge, elementary.separation_edge_edge),
    }.get(kind, (None, elementary.separation_edge_edge))
    if plain is None:  # degenerate edges
        return separated(ends, separation, 1)[1]
    toc, zero = np.empty(len(ends)), separation == 0
    toc[zero] = plain(ends[zero], 1)[1]
    toc[~zero] = separated(ends[~zero], separation[~zero], 1)[1]
    return toc


def _near(kind: str, corners: np.ndarray, distance: np.ndarray | float) -> np.ndarray:
    distance = np.broadcast_to(np.asarray(distance, float), (len(corners),))
    if kind == "vf":
        return elementary.within_vertex_face(corners, distance, 1)
    if kind != "ef":
        return elementary.within_edge_edge(corners, distance, 1)
    near = elementary.edge_face_intersect(corners, 1)
    for end in (0, 1):
        near |= elementary.within_vertex_face(corners[:, [end, 2, 3, 4]], distance, 1)
    for side in ([2, 3], [3, 4], [4, 2]):
        near |= elementary.within_edge_edge(corners[:, [0, 1, *side]], distance, 1)
    return near


def _farther(kind: str, corners: np.ndarray, distance: np.ndarray) -> np.ndarray:
    """Whether boxes prove it; corners (N,k,3) of one end of the step, or of both."""
    n = {"vf": 1, "ef": 2}.get(kind, 2)
    half = {"vf": 4, "ef": 5}.get(kind, 4)
    if len(corners) == 0:
        return np.zeros(0, bool)
    ends = corners.reshape(len(corners), -1, half, 3)
    a, b = ends[:, :, :n].reshape(len(ends), -1, 3), ends[:, :, n:].reshape(len(ends), -1, 3)
    beyond = (distance * (1 + 2.0**-50))[:, None]
    with np.errstate(over="ignore"):
        apart = (b.min(axis=1) - a.max(axis=1) > beyond) | (a.min(axis=1) - b.max(axis=1) > beyond)
    return apart.any(axis=1)


def _sorted_edges(edges: np.ndarray) -> np.ndarray:
    edges = np.sort(np.reshape(edges, (-1, 2)), axis=1).astype(int)
    return np.unique(edges[edges[:, 0] != edges[:, 1]], axis=0)


def _canonical(kind: str, row: Sequence[int]) -> tuple[int, ...]:
    if kind == "vf":
        return tuple(int(i) for i in row)
    a, b = sorted((tuple(sorted(row[:2])), tuple(sorted(row[2:]))))
    return (*(int(i) for i in a), *(int(i) for i in b))
