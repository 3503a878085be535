# SPDX-License-Identifier: Apache-2.0
"""What in a mesh disturbs collision detection: seams, T-junctions, degenerate faces. No ROS, no files."""

from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

import hpccd_core as hc
from hpccd_core.mesh_files.welding import components

#: Vertices count as doubled within this part of the median edge length.
PART_OF_EDGE = 1e-3


@dataclass(frozen=True)
class Defect:
    """indices: (k, m), a row for each place where the mesh has this defect, in vertices or faces of the mesh."""

    name: str
    indices: NDArray[np.intp]
    of: str  # what the indices number
    effect: str
    remedy: str


@dataclass(frozen=True)
class MeshReport:
    """Counts of a mesh, lengths of its edges, and its defects, those without a place left out.

    smallest_gap: of the welded mesh, the smallest distance between features that share no vertex; inf without such a
    pair.
    """

    vertices: int
    faces: int
    components: int
    closed: bool
    boundary_edges: int
    components_if_welded: int
    closed_if_welded: bool
    shortest_edge: float
    median_edge: float
    smallest_gap: float
    distance: float
    defects: tuple[Defect, ...]


def examine(vertices: NDArray[np.float64], faces: NDArray[np.uint32], distance: float | None = None) -> MeshReport:
    """The report of a mesh with at least one face.

    distance: up to which vertices count as doubled, and as lying on an edge; default `PART_OF_EDGE` of the median edge.
    """
    edges = _Edges(faces)
    a, b = edges.unique.T
    lengths = np.linalg.norm(vertices[b] - vertices[a], axis=1)
    shortest, median = (float(lengths.min()), float(np.median(lengths))) if len(lengths) else (0.0, 0.0)
    if distance is None:
        distance = PART_OF_EDGE * median
    welded, triangles, index = hc.weld(vertices, faces, distance)
    first = np.unique(index, return_index=True)[1]
    equal = hc.weld(vertices, faces)[2]
    used = np.zeros(len(vertices), bool)
    used[faces] = True
    t_junctions = _t_junctions(welded, triangles, first, distance, used)
    defects = (
        Defect(
            "doubled vertices",
            _later_of_groups(equal),
            "vertex and the earlier one at its position",
            "Faces on both sides of such a seam touch at all times: collision_free_step is 0, and every call reports "
            "contacts there.",
            "vertices, faces, index = hpccd_core.weld(vertices, faces)",
        ),
        Defect(
            "nearly doubled vertices",
            _different(_later_of_groups(index), equal),
            "vertex and an earlier one within the distance",
            "Any separation or thickness of that size finds contacts along the seam.",
            f"vertices, faces, index = hpccd_core.weld(vertices, faces, {distance:.3g})",
        ),
        Defect(
            "T-junctions",
            t_junctions,
            "vertex, and the two ends of the edge that it lies on",
            "The vertex touches faces of the edge at all times, as a doubled vertex does; welding does not help.",
            "split those faces at the vertex, or ignore pairs that touch at rest: "
            "scene.ignore_within(mesh, rest_vertices=vertices, distance=...)",
        ),
        Defect(
            "self-intersections",
            _crossings(welded, triangles, index, first, faces, t_junctions),
            "the ends of an edge, and the face that it intersects",
            "Parts that intersect already are not kept apart: moving on together is no contact.",
            "pull the parts apart; docs/inside.md untangles a cloth with detector.intersections(vertices)",
        ),
        Defect(
            "faces without area",
            _flat(vertices, faces)[:, None],
            "face",
            "Contacts are found, but normals may be arbitrary and a closed mesh may have no inside there.",
            "remove them: weld removes those that name a vertex twice; dissolve the others in a mesh editor",
        ),
        Defect(
            "faces that occur twice",
            _repeated(faces),
            "face and the earlier one with its vertices",
            "Contacts are reported twice, and the mesh is not closed.",
            "keep one of them",
        ),
        Defect(
            "edges in more than two faces",
            edges.unique[edges.counts > 2],
            "vertices",
            "The surface branches: it has no inside there. Detection is not affected.",
            "separate the sheets, or leave the mesh as it is if it need not be closed",
        ),
        Defect(
            "edges with faces of opposite orientation",
            edges.unique[(edges.counts == 2) & (edges.forward != 1)],
            "vertices",
            "The mesh is not closed, so winding numbers, signed distances and `inside` do not apply. Detection is not "
            "affected.",
            "reverse one of the two faces (recalculate normals in a mesh editor)",
        ),
        Defect(
            "isolated vertices",
            np.flatnonzero(~used)[:, None],
            "vertex",
            "They are tested against faces as points.",
            "remove vertices that are in no face, unless they are particles",
        ),
    )
    return MeshReport(
        vertices=len(vertices),
        faces=len(faces),
        components=_n_components(faces, len(vertices)),
        closed=hc.closed(faces),
        boundary_edges=int((edges.counts == 1).sum()),
        components_if_welded=_n_components(triangles, len(welded)),
        closed_if_welded=hc.closed(triangles),
        shortest_edge=shortest,
        median_edge=median,
        smallest_gap=_smallest_gap(welded, triangles),
        distance=distance,
        defects=tuple(defect for defect in defects if len(defect.indices)),
    )


class _Edges:
    """unique: (E, 2), a < b. counts: (E,), the faces of each. forward: (E,), how many of them go from a to b. Without
    faces that name a vertex twice."""

    def __init__(self, faces: NDArray[np.uint32]) -> None:
        a, b, c = faces.T
        proper = faces[(a != b) & (b != c) & (c != a)].astype(np.intp)
        ways = np.concatenate([proper[:, [0, 1]], proper[:, [1, 2]], proper[:, [2, 0]]])
        ends = np.sort(ways, axis=1)
        n = int(ends.max(initial=0)) + 1
        keys, edge = np.unique(ends[:, 0] * n + ends[:, 1], return_inverse=True)
        self.unique = np.stack([keys // n, keys % n], axis=1)
        self.counts = np.bincount(edge, minlength=len(keys))
        self.forward = np.bincount(edge[ways[:, 0] < ways[:, 1]], minlength=len(keys))


def _scene(vertices: NDArray[np.float64], faces: NDArray[np.uint32]) -> hc.Scene:
    scene = hc.Scene()
    scene.add_mesh("mesh", faces, n_vertices=len(vertices))
    return scene


def _smallest_gap(vertices: NDArray[np.float64], faces: NDArray[np.uint32]) -> float:
    return min((gap.distance for gap in hc.Detector(_scene(vertices, faces)).distances(vertices)), default=np.inf)


def _crossings(
    vertices: NDArray[np.float64],
    faces: NDArray[np.uint32],
    index: NDArray[np.intp],
    first: NDArray[np.intp],
    given: NDArray[np.uint32],
    t_junctions: NDArray[np.intp],
) -> NDArray[np.intp]:
    """(K, 3) edges and faces of the welded mesh that share a point and no vertex, numbered as in the mesh; those at
    T-junctions left out. index, first: from the vertices of the mesh to those of the welded one, and back. given: the
    faces of the mesh."""
    found = hc.Detector(_scene(vertices, faces)).intersections(vertices).ef.astype(np.intp)
    at_junction = np.zeros(len(vertices), bool)
    at_junction[index[t_junctions[:, 0]]] = True
    found = found[~at_junction[np.column_stack([found[:, :2], faces[found[:, 2]]])].any(axis=1)]
    a, b, c = index[given].T
    kept = np.flatnonzero((a != b) & (b != c) & (c != a))
    return np.column_stack([first[found[:, :2]], kept[found[:, 2]]])


def _n_components(faces: NDArray[np.uint32], n_vertices: int) -> int:
    roots = components(np.concatenate([faces[:, :2], faces[:, 1:]]), n_vertices)
    return len(np.unique(roots[faces]))


def _later_of_groups(index: NDArray[np.intp]) -> NDArray[np.intp]:
    """Vertices that are not the first of their group, each with that one."""
    first = np.unique(index, return_index=True)[1][index]
    later = np.flatnonzero(first != np.arange(len(index)))
    return np.stack([later, first[later]], axis=1)


def _different(pairs: NDArray[np.intp], group: NDArray[np.intp]) -> NDArray[np.intp]:
    return pairs[group[pairs[:, 0]] != group[pairs[:, 1]]]


def _repeated(faces: NDArray[np.uint32]) -> NDArray[np.intp]:
    _, group = np.unique(np.sort(faces, axis=1), axis=0, return_inverse=True)
    return _later_of_groups(group.reshape(-1))


def _flat(vertices: NDArray[np.float64], faces: NDArray[np.uint32]) -> NDArray[np.intp]:
    """Faces whose area is exactly 0."""
    a, b, c = vertices[faces].transpose(1, 0, 2)
    u, v = b - a, c - a
    plus = np.stack([u[:, 1] * v[:, 2], u[:, 2] * v[:, 0], u[:, 0] * v[:, 1]])
    minus = np.stack([u[:, 2] * v[:, 1], u[:, 0] * v[:, 2], u[:, 1] * v[:, 0]])
    # Two differences and a product for each term, then one more: less than 7 * 2**-53 of the terms, and underflow.
    certain = np.abs(plus - minus) > 1e-15 * (np.abs(plus) + np.abs(minus)) + 1e-300
    open_ = np.flatnonzero(~certain.any(axis=0))
    return np.array([k for k in open_.tolist() if _is_flat(vertices[faces[k]].tolist())], np.intp)


def _is_flat(corners: list[list[float]]) -> bool:
    a, b, c = ([Fraction(x) for x in corner] for corner in corners)
    u, v = ([x - y for x, y in zip(end, a, strict=True)] for end in (b, c))
    return all(u[i] * v[j] == u[j] * v[i] for i, j in ((0, 1), (1, 2), (2, 0)))


def _t_junctions(
    vertices: NDArray[np.float64],
    faces: NDArray[np.uint32],
    first: NDArray[np.intp],
    distance: float,
    used: NDArray[np.bool_],
) -> NDArray[np.intp]:
    """Vertices of faces within the distance of an edge, and farther than that from its ends. The mesh is welded; first:
    the number of each vertex in the original mesh, which the result names."""
    if not len(faces):
        return np.empty((0, 3), np.intp)
    # A vertex near an edge is near a face of that edge.
    near = hc.Detector(_scene(vertices, faces), features="vertex_face").proximity(vertices, distance).vf
    vertex = near[:, 0]
    found = [np.empty((0, 3), np.intp)]
    for corner in range(3):
        ends = faces[near[:, 1]][:, [corner, (corner + 1) % 3]]
        a, b = vertices[ends].transpose(1, 0, 2)
        p = vertices[vertex]
        way = b - a
        square = np.einsum("ij,ij->i", way, way)
        t = np.einsum("ij,ij->i", p - a, way) / np.where(square > 0, square, 1)
        off = np.linalg.norm(a + np.clip(t, 0, 1)[:, None] * way - p, axis=1)
        inside = (np.linalg.norm(p - a, axis=1) > distance) & (np.linalg.norm(p - b, axis=1) > distance)
        on = (off <= distance * (1 + 1e-9)) & inside & (t > 0) & (t < 1) & used[first[vertex]]
        found.append(np.column_stack([first[vertex[on]], np.sort(first[ends[on]], axis=1)]))
    return np.unique(np.concatenate(found), axis=0)
