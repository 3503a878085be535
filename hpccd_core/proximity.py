# SPDX-License-Identifier: Apache-2.0
"""Results of queries of one snapshot."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from . import _core
from .contours import Contour, EnclosedRegion
from .mesh_layout import Indices, MeshLayout
from .results import INTERSECTION_ARRAYS, WithSides, output
from .worlds import NO_PAIRS, NO_VALUES, ComparedByRows, OfWorlds, PairsOfWorlds, Slices

Kind = Literal["vertex-face", "edge-edge", "edge-face", "vertex-plane", "vertex-vertex", "vertex-edge", ""]
Inside = Literal["a", "b", "both"]


@dataclasses.dataclass(frozen=True, eq=False)
class Proximity(PairsOfWorlds, WithSides):
    """Pairs of features within a distance of each other: N vertex-face rows, then M edge-edge rows.

    :meth:`Detector.proximity` returns it. Order, equality and worlds as in :class:`Contacts`.

    Attributes
    ----------
    vf : ndarray, shape (N, 2), uint32
        Vertex and face, scene-wide indices, sorted lexicographically.
    vf_distance : ndarray, shape (N,), float64
        Euclidean distance of each row of `vf`, in the unit of the coordinates, minus the thickness of both features:
        negative where thick surfaces overlap.
    ee : ndarray, shape (M, 4), uint32
        Vertices a0 a1 b0 b1 of two edges, ordered as in Contacts.
    ee_distance : ndarray, shape (M,), float64
        The same of each row of `ee`.
    vp, vp_distance : ndarray, shape (L, 2) uint32 and (L,) float64
        Vertex and plane as in Contacts, and the signed distance: negative outside the half-space.
    vv, vv_distance, ve, ve_distance : ndarray
        Points, and points and edges, as in Contacts, with their distances.
    hash : int
        64-bit; the same for the same pairs and distances on any backend and with any number of threads.
    outputs : dict of str to ndarray
        The outputs that the detector was asked for; `normals`, `closest`, `vertices` and `weights` read it.
    """

    vf: Indices
    vf_distance: NDArray[np.float64]
    ee: Indices
    ee_distance: NDArray[np.float64]
    hash: int
    outputs: dict[str, NDArray[Any]] = dataclasses.field(default_factory=dict)
    slices: Slices | None = dataclasses.field(default=None, repr=False)
    layout: MeshLayout | None = dataclasses.field(default=None, repr=False, compare=False)
    vp: Indices = dataclasses.field(default_factory=lambda: NO_PAIRS["vp"])
    vp_distance: NDArray[np.float64] = dataclasses.field(default_factory=lambda: NO_VALUES)
    vv: Indices = dataclasses.field(default_factory=lambda: NO_PAIRS["vv"])
    vv_distance: NDArray[np.float64] = dataclasses.field(default_factory=lambda: NO_VALUES)
    ve: Indices = dataclasses.field(default_factory=lambda: NO_PAIRS["ve"])
    ve_distance: NDArray[np.float64] = dataclasses.field(default_factory=lambda: NO_VALUES)

    @property
    def closest(self) -> NDArray[np.float64]:
        """(N+M, 2, 3) float64, vertex-face first: the nearest points of both sides.

        They are the vertex and its nearest point on the face, or the points of edge a and edge b; for parallel edges
        the middle of the stretch along which they are nearest. Raises `OutputNotComputed` unless the detector was made
        with outputs=("closest",).
        """
        return output(self.outputs, "closest")

    @property
    def normals(self) -> NDArray[np.float64]:
        """(N+M, 3) float64, vertex-face first: unit vectors from face to vertex, or from edge a to edge b.

        Zero where the distance is 0. Raises `OutputNotComputed` unless the detector was made with
        outputs=("normals",).
        """
        return output(self.outputs, "normals")

    @property
    def vertices(self) -> Indices:
        """(N+M, 4) uint32, vertex-face first: scene-wide vertices of each pair, v f0 f1 f2, or a0 a1 b0 b1.

        Raises `OutputNotComputed` unless the detector was made with outputs=("weights",).
        """
        return output(self.outputs, "vertices")

    @property
    def weights(self) -> NDArray[np.float64]:
        """(N+M, 4) float64, vertex-face first: the weights of `vertices`, as in Contacts, of the nearest points.

        The derivative of the distance with respect to the position of vertex i of a row is weights[i] times the
        normal. Raises `OutputNotComputed` unless the detector was made with outputs=("weights",).
        """
        return output(self.outputs, "weights")

    def world(self, k: int) -> Proximity:
        """The pairs of world k, 0 <= k < W, bit-identical to those of a detector of that world alone."""
        k = self._world_number(k)
        if self.slices is None:
            return self
        return Proximity(**self._fields_of(k, "distance"))

    def __repr__(self) -> str:
        return f"Proximity({self._counts()})"


# As for Contacts.
for _kind in ("vp", "vv", "ve"):
    setattr(Proximity, _kind, NO_PAIRS[_kind])
    setattr(Proximity, f"{_kind}_distance", NO_VALUES)


@dataclasses.dataclass(frozen=True, eq=False)
class Intersections(WithSides, OfWorlds):
    """Edges that intersect or touch faces. An edge and a face that share a vertex do not count.

    :meth:`Detector.intersections` returns it. Equality and worlds as in :class:`Contacts`.

    Attributes
    ----------
    ef : ndarray, shape (K, 3), uint32
        Vertices a0 < a1 of the edge, and the face; scene-wide indices, sorted lexicographically.
    hash : int
        64-bit; the same for the same pairs on any backend and with any number of threads.
    outputs : dict of str to ndarray
        The outputs that the detector was asked for; `points`, `edge_parameters`, `weights`, `incidences` and
        `directions` read it.

    Examples
    --------
    >>> import numpy as np
    >>> import hpccd_core as hc
    >>> vertices, faces = hc.shapes.icosphere(2)
    >>> scene = hc.Scene()
    >>> _ = scene.add_mesh("left", faces), scene.add_mesh("right", faces)
    >>> both = np.concatenate([vertices, vertices + [1.0, 0.1, 0.2]])
    >>> hits = hc.Detector(scene, outputs=("points",)).intersections(both)
    >>> hits
    Intersections(38 edge-face)
    >>> contour, = hits.contours()
    >>> contour
    Contour(left and right, 38 points, closed)
    >>> region, = hits.regions()
    >>> len(region.vertices_a), len(region.vertices_b)
    (10, 10)
    """

    ef: Indices
    hash: int
    outputs: dict[str, NDArray[Any]] = dataclasses.field(default_factory=dict)
    slices: Slices | None = dataclasses.field(default=None, repr=False)
    layout: MeshLayout | None = dataclasses.field(default=None, repr=False, compare=False)
    #: (F, 3): of the scene, where contours can be asked for.
    faces: Indices | None = dataclasses.field(default=None, repr=False, compare=False)

    @property
    def points(self) -> NDArray[np.float64]:
        """(K, 3) float64: where the edge meets the face.

        Within 1e-12 of the length of the edge, for slivers too. Where they share a segment, because the edge lies in
        the plane of the face, it is the end of that nearer to the edge's first vertex. Raises `OutputNotComputed`
        unless the detector was made with outputs=("points",).
        """
        return self._output("points")

    @property
    def edge_parameters(self) -> NDArray[np.float64]:
        """(K,) float64: the position of the point on the edge, from 0 at its first vertex to 1 at its second.

        Raises `OutputNotComputed` unless the detector was made with outputs=("points",).
        """
        return self._output("edge_parameters")

    @property
    def weights(self) -> NDArray[np.float64]:
        """(K, 3) float64: the barycentric coordinates of the point on the face, in [0, 1].

        Raises `OutputNotComputed` unless the detector was made with outputs=("points",).
        """
        return self._output("weights")

    @property
    def incidences(self) -> NDArray[np.uint8]:
        """(K,) uint8: degenerate cases as bits, decided exactly.

        1, 2: they meet at the first, second vertex of the edge. 4, 8, 16: the weight of the first, second, third vertex
        of the face is 0. 32: the edge lies in the plane of the face, or the face has no area. Raises
        `OutputNotComputed` unless the detector was made with outputs=("points",).
        """
        return self._output("incidences")

    @property
    def directions(self) -> NDArray[np.float64]:
        """(K, 3) float64: how the edge should move relative to the face to shorten the intersection curves.

        The vector G = sum over the faces of the edge of R - 2 (E . R) / (E . N) N, with the edge's direction E, the
        normal N of the intersected face, and the direction R, away from the edge, in which the curve runs through the
        edge's face; all of unit length (Volino and Magnenat-Thalmann, "Resolving surface collisions through
        intersection contour minimization", 2006). If the material point of the edge moves by D / 2 and that of the face
        by -D / 2, the curves become longer by -G . D / 2 to first order: D = G is the steepest descent. G is not of
        unit length: it grows without bound as the edge becomes parallel to the face, so limit the displacement. Zero
        where it is parallel, and for edges without faces. Ends at a vertex of both sides do not contribute. Raises
        `OutputNotComputed` unless the detector was made with outputs=("directions",).
        """
        return self._output("directions")

    def contours(self) -> list[Contour]:
        """The intersection curves: points linked through pairs of intersecting triangles.

        Returns
        -------
        list of Contour
            Each row is in exactly one contour. A closed contour begins with its smallest row and goes on to the smaller
            one of both neighbours; an open one begins at the end with the smaller row. They are sorted by smallest row,
            world by world.

        Raises
        ------
        OutputNotComputed
            Unless the detector was made with outputs=("points",).

        Notes
        -----
        Degenerate cases are decided exactly. Where an edge passes through an edge or a vertex, the rows of the same
        point follow each other. Overlaps in a plane have no curve inside; the points there are contours of a single
        point, as are points where the meshes only touch. Where more than two segments meet, as at an edge of three
        faces, one curve contains the point, and the others end before it.
        """
        names = self._required_layout().mesh_names
        found = []
        for first, *arrays in self._of_each_world():
            for rows, closed, a, b in _core.contours(*arrays):
                rows += np.uint32(first)
                found.append(Contour(rows, self.points[rows], closed, names[a], names[b]))
        return found

    def regions(self) -> list[EnclosedRegion]:
        """The vertices enclosed by each contour, on both sides: global intersection analysis.

        Returns
        -------
        list of EnclosedRegion
            In the order of :meth:`contours`. Of the two parts into which a closed contour divides a mesh, the one with
            fewer vertices; empty where it passes between the vertices, or does not divide the mesh (as a ring around a
            torus), and for open contours. An open contour of one mesh that ends in two vertices of it is a loop on the
            mesh: it has the same region on both sides. Vertices on the contour are not enclosed.

        Raises
        ------
        OutputNotComputed
            Unless the detector was made with outputs=("points",).

        Notes
        -----
        By flood fill from the edges that the contour crosses (Baraff, Witkin and Kass, "Untangling cloth", 2003). The
        cost is that of the enclosed vertices, and of one pass over all faces.
        """
        found = [_core.enclosed_regions(*arrays) for _, *arrays in self._of_each_world()]
        return [EnclosedRegion(*vertices) for of_world in found for vertices in of_world]

    def _required_layout(self) -> MeshLayout:
        self._output("points")
        if self.layout is None or self.faces is None:
            raise ValueError("Intersections: has no faces; use a result of a detector with results='host'")
        return self.layout

    def _of_each_world(self) -> Iterator[tuple[Any, ...]]:
        """The first row of each world, and the arguments of the core."""
        layout, begin = self._required_layout(), self.ef_offsets.tolist()
        for first, last in itertools.pairwise(begin):
            rows = slice(first, last)
            yield first, self.ef[rows], self.incidences[rows], self.faces, layout.vertex_offsets

    def _output(self, name: str) -> NDArray[Any]:
        return output(self.outputs, name, arrays=INTERSECTION_ARRAYS)

    @property
    def ef_offsets(self) -> NDArray[np.int64]:
        """(W+1,) int64: the pairs of world k are the rows ef_offsets[k] to ef_offsets[k + 1]."""
        return self._offsets("ef", len(self.ef))

    def world(self, k: int) -> Intersections:
        """The pairs of world k, 0 <= k < W, bit-identical to those of a detector of that world alone."""
        k = self._world_number(k)
        if self.slices is None:
            return self
        begin, end = self.slices.ef[k : k + 2]
        return Intersections(
            ef=self.ef[begin:end],
            hash=int(self.slices.hashes[k]),
            outputs={name: rows[begin:end] for name, rows in self.outputs.items()},
            layout=self.layout,
            faces=self.faces,
        )

    def _pairs(self) -> dict[str, Indices]:
        return {"ef": self.ef}

    def __len__(self) -> int:
        return len(self.ef)

    def __repr__(self) -> str:
        return f"Intersections({len(self.ef)} edge-face)"


@dataclasses.dataclass(frozen=True, eq=False)
class Gap(ComparedByRows):
    """The smallest distance of two meshes at one time, or of the features of one mesh that share no vertex.

    :meth:`Detector.distances` returns a list of them. Gaps are equal if all fields are; they are not hashable.

    Attributes
    ----------
    mesh_a, mesh_b : str
        Names; `mesh_a` was added before `mesh_b`, or is the same.
    distance : float
        Euclidean, of the surfaces, in the unit of the coordinates; 0 if they touch or intersect, +inf if no pair of
        features exists. With thickness minus that of both features: negative where thick surfaces overlap. For
        "edge-face" then minus the thickness of the edge and face in `features`.
        From a plane: that of the vertex deepest outside the half-space, which is negative, or nearest to it.
    kind : str
        "vertex-face", "edge-edge", "edge-face" (they intersect), "vertex-plane", "vertex-vertex", "vertex-edge" or ""
        (no pair exists).
    features : tuple of int
        Scene-wide indices as in a row of Contacts.vf, Contacts.ee or Intersections.ef: of the nearest pairs the first
        in order, vertex-face before edge-edge.
    points : ndarray, shape (2, 3), float64
        The nearest points of both sides, in the order of `features`; shape (0, 3) if there are none.
    vertices : ndarray, shape (4,), uint32
        Scene-wide vertices of the nearest pair, as in Proximity; shape (0,) if the meshes intersect or have none.
    weights : ndarray, shape (4,), float64
        Their weights, as in Proximity, or shape (0,).
    normal : ndarray, shape (3,), float64
        As a row of Proximity.normals, or shape (0,). The derivative of `distance` with respect to the position of
        vertex i is weights[i] times the normal.
    inside : {"a", "b", "both"} or None
        "a" if a connected component of `mesh_a` lies inside `mesh_b` without touching it, "b" for the reverse. A
        component is what shared vertices connect: faces, edges, or a single vertex. Exact; None where the surfaces
        touch, without any thickness, and within a mesh. Where contacts of the two meshes are ignored, one vertex of
        each component decides, of a connected mesh also its box. Only closed meshes contain anything
        (:func:`hpccd_core.closed`): what their faces wind around, whichever way they are oriented.

    Examples
    --------
    >>> import hpccd_core as hc
    >>> scene, (vertices, faces) = hc.Scene(), hc.shapes.box((1.0, 1.0, 1.0))
    >>> numbers = scene.add_mesh("inner", faces), scene.add_mesh("outer", faces)
    >>> gap = hc.Detector(scene).distances({"inner": vertices, "outer": 4 * vertices})[1]
    >>> gap.distance, gap.inside
    (1.5, 'a')
    """

    mesh_a: str
    mesh_b: str
    distance: float
    kind: Kind
    features: tuple[int, ...]
    points: NDArray[np.float64]
    vertices: Indices = dataclasses.field(default_factory=lambda: np.empty(0, np.uint32))
    weights: NDArray[np.float64] = dataclasses.field(default_factory=lambda: np.empty(0))
    normal: NDArray[np.float64] = dataclasses.field(default_factory=lambda: np.empty(0))
    inside: Inside | None = None
