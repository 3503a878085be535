# SPDX-License-Identifier: Apache-2.0
"""The contacts of one motion step."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .mesh_layout import Indices, MeshLayout
from .results import OUTPUT_ARRAYS, WithSides, output
from .worlds import NO_PAIRS, NO_VALUES, PairsOfWorlds, Slices


def toc_gradients(
    toc: NDArray[np.float64],
    weights: NDArray[np.float64],
    normals: NDArray[np.float64],
    approach: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """What `Contacts.toc_gradients` returns, of arrays with one row for each contact."""
    arms = weights[:, :, None] * normals[:, None, :]
    speed = np.where((toc > 0) & (approach != 0), -approach, np.nan)[:, None, None]
    with np.errstate(over="ignore"):  # of motions near the smallest double
        return (1 - toc)[:, None, None] * arms / speed, toc[:, None, None] * arms / speed


_NO_EF = np.empty((0, 3), np.uint32)
_NO_EF.flags.writeable = False


@dataclasses.dataclass(frozen=True, eq=False)
class Contacts(PairsOfWorlds, WithSides):
    """Contacts of one step in canonical order: N vertex-face rows, then M edge-edge rows.

    :meth:`Detector.detect` and :meth:`Detector.step` return it. ``len(contacts)`` is the number of rows of all kinds.
    Scenes with planes or points have further kinds, whose rows follow in all outputs in the order `vp`, `vv`, `ve`. Two
    results are equal if all their arrays are; they are not hashable: use `hash` as a key.

    Attributes
    ----------
    vf : ndarray, shape (N, 2), uint32
        Vertex and face, scene-wide indices, sorted lexicographically.
    vf_toc : ndarray, shape (N,), float64
        Time of impact (TOI) of each row of `vf`, as a fraction of the step in [0, 1].
    ee : ndarray, shape (M, 4), uint32
        Vertices a0 a1 b0 b1 of two edges, scene-wide: a0 < a1, b0 < b1, (a0, a1) < (b0, b1); sorted.
    ee_toc : ndarray, shape (M,), float64
        Time of impact of each row of `ee`.
    vp, vp_toc : ndarray, shape (L, 2) uint32 and (L,) float64
        Vertex and plane, counted among the planes in the order added, and their time of impact: 0 for a vertex that
        starts outside the half-space.
    vv, vv_toc : ndarray, shape (P, 2) uint32 and (P,) float64
        Two points (see :meth:`Scene.add_points`), the lower number first.
    ve, ve_toc : ndarray, shape (Q, 3) uint32 and (Q,) float64
        A point, and the vertices of an edge that is in no face, the lower number first.
    ef : ndarray, shape (K, 3), uint32
        With `detail`: edges and faces of the coarse meshes that intersect at the start, as in Intersections.ef; their
        time is 0.
    first_toc : float
        The earliest time of impact; +inf if there are no contacts. With report="any", that of the one contact reported.
    hash : int
        64-bit; the same for the same contacts on any backend and with any number of threads.
    outputs : dict of str to ndarray
        The outputs that the detector was asked for; `points`, `normals`, `closest`, `vertices`, `weights` and
        `approach` read it.

    Notes
    -----
    Result of W worlds: rows of the first world, then of the second, and so on; `vf_offsets`, `ee_offsets` and
    :meth:`world` separate them. Indices are those of one world. `hash` is the sum of each world's hash times 2 k + 1,
    modulo 2**64. Without worlds the result is that of one.

    Examples
    --------
    >>> import numpy as np
    >>> import hpccd_core as hc
    >>> scene = hc.Scene()
    >>> _ = scene.add_mesh("falling", [[0, 1, 2]])
    >>> _ = scene.add_mesh("ground", [[0, 1, 2]], static=True)
    >>> start = np.array([[0, 0, 1], [1, 0, 3], [0, 1, 3], [-5, -5, 0], [5, -5, 0], [0, 5, 0]], float)
    >>> end = start.copy()
    >>> end[:3, 2] -= 2
    >>> contacts = hc.Detector(scene, outputs=("normals",)).detect(start, end)
    >>> contacts
    Contacts(1 vertex-face, 0 edge-edge, first at 0.5)
    >>> contacts.vf.tolist(), contacts.vf_toc.tolist(), contacts.normals.tolist()
    ([[0, 1]], [0.5], [[0.0, 0.0, 1.0]])
    >>> [scene.mesh_names[k] for k in (contacts.mesh_a[0], contacts.mesh_b[0])]
    ['falling', 'ground']
    """

    vf: Indices
    vf_toc: NDArray[np.float64]
    ee: Indices
    ee_toc: NDArray[np.float64]
    first_toc: float
    hash: int
    outputs: dict[str, NDArray[Any]] = dataclasses.field(default_factory=dict)
    ef: Indices = dataclasses.field(default_factory=lambda: _NO_EF)
    slices: Slices | None = dataclasses.field(default=None, repr=False)
    layout: MeshLayout | None = dataclasses.field(default=None, repr=False, compare=False)
    vp: Indices = dataclasses.field(default_factory=lambda: NO_PAIRS["vp"])
    vp_toc: NDArray[np.float64] = dataclasses.field(default_factory=lambda: NO_VALUES)
    vv: Indices = dataclasses.field(default_factory=lambda: NO_PAIRS["vv"])
    vv_toc: NDArray[np.float64] = dataclasses.field(default_factory=lambda: NO_VALUES)
    ve: Indices = dataclasses.field(default_factory=lambda: NO_PAIRS["ve"])
    ve_toc: NDArray[np.float64] = dataclasses.field(default_factory=lambda: NO_VALUES)

    @property
    def bounds(self) -> NDArray[np.float64]:
        """(N+M,) float64, vertex-face first: what the separation of each pair grew by, because its faces are coarse.

        It is the sum of the deviations of both sides from the meshes of the scene, in the unit of the coordinates; zero
        without `detail`.
        """
        bounds = self.outputs.get("bounds")
        return np.zeros(len(self) - len(self.ef)) if bounds is None else bounds

    @property
    def points(self) -> NDArray[np.float64]:
        """(N+M, 3) float64, vertex-face first: where the sides touch at their time of impact.

        It is the vertex, or the point of the shorter edge where the other crosses it; for edges that are parallel
        during the whole step the middle of the stretch they share. With a minimum separation it is the midpoint of the
        nearest points. Raises `OutputNotComputed` unless the detector was made with outputs=("points",).
        """
        return output(self.outputs, "points")

    @property
    def normals(self) -> NDArray[np.float64]:
        """(N+M, 3) float64, vertex-face first: unit vectors from the face to the vertex, or from edge a to edge b.

        In rows of `vp` the normal of the plane; in `vv` and `ve` from the first point to the other one, or to the edge.
        The normal is perpendicular to the face, or to both edges, at the time of impact, and points to the side on
        which the vertex or edge b is just before. For contact at t = 0 it is the side from which the straight motion
        would have come had it begun earlier. With a minimum separation it is the direction between the nearest points.
        It is zero where no side is defined (the motion is coplanar throughout) or no direction (the face has no area,
        the edges are parallel or points). Raises `OutputNotComputed` unless the detector was made with
        outputs=("normals",).
        """
        return output(self.outputs, "normals")

    @property
    def closest(self) -> NDArray[np.float64]:
        """(N+M, 2, 3) float64, vertex-face first: the nearest points of both sides at the time of impact.

        Raises `OutputNotComputed` unless the detector was made with outputs=("closest",).
        """
        return output(self.outputs, "closest")

    @property
    def vertices(self) -> Indices:
        """(N+M, 4) uint32, vertex-face first: scene-wide vertices of each pair, v f0 f1 f2, or a0 a1 b0 b1.

        Raises `OutputNotComputed` unless the detector was made with outputs=("weights",).
        """
        return output(self.outputs, "vertices")

    @property
    def weights(self) -> NDArray[np.float64]:
        """(N+M, 4) float64, vertex-face first: the weights of `vertices` at the time of impact; each row sums to 0.

        Vertex-face: 1, -l0, -l1, -l2 with the barycentric coordinates l of the point on the face. Edge-edge: -(1 - s),
        -s, 1 - u, u with the place s of the point on edge a, from a0 to a1, and u on edge b. The sum of weights times
        positions at the time of impact is the vector from face to vertex, or from edge a to edge b: zero in plain
        contact, the gap with a minimum separation. Coordinates and places are in [0, 1]. For parallel edges they are
        those of the middle of the stretch they share. Raises `OutputNotComputed` unless the detector was made with
        outputs=("weights",).
        """
        return output(self.outputs, "weights")

    @property
    def approach(self) -> NDArray[np.float64]:
        """(N+M,) float64, vertex-face first: how fast the gap grows at the time of impact, in coordinates per step.

        It is the normal times the sum of weights times motions: negative while the features approach each other. It is
        0 if they only graze each other, as at a double root, within rounding errors of the motion, or if the normal is
        zero. Contacts at t = 0 may be moving apart. Raises `OutputNotComputed` unless the detector was made with
        outputs=("weights",).
        """
        return output(self.outputs, "approach")

    def toc_gradients(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Derivatives of the times of impact with respect to the positions at both ends of the step.

        Returns
        -------
        g0, g1 : ndarray, shape (N+M, 4, 3), float64
            Derivatives with respect to the positions of `vertices` at the start of the step and at its end. NaN where
            the time is 0 or `approach` is 0: there the time has no derivative.

        Raises
        ------
        OutputNotComputed
            Unless the detector was made with outputs=("normals", "weights").

        Notes
        -----
        By the implicit function theorem for gap(toc) = separation: d toc / d x0 = -(1 - toc) w n / approach and d toc /
        d x1 = -toc w n / approach, with the weights w and the normal n. Where the nearest points leave a face's
        interior or an edge, the time has derivatives on both sides; this is one of them.

        Examples
        --------
        >>> import numpy as np
        >>> import hpccd_core as hc
        >>> scene = hc.Scene()
        >>> _ = scene.add_mesh("falling", [[0, 1, 2]])
        >>> _ = scene.add_mesh("ground", [[0, 1, 2]], static=True)
        >>> start = np.array([[0, 0, 1], [1, 0, 3], [0, 1, 3], [-5, -5, 0], [5, -5, 0], [0, 5, 0]], float)
        >>> end = start.copy()
        >>> end[:3, 2] -= 2
        >>> contacts = hc.Detector(scene, outputs=("normals", "weights")).detect(start, end)
        >>> contacts.vertices.tolist(), contacts.weights.tolist(), contacts.approach.tolist()
        ([[0, 3, 4, 5]], [[1.0, -0.25, -0.25, -0.5]], [-2.0])
        >>> g0, g1 = contacts.toc_gradients()
        >>> g0[0, 0].tolist(), g1[0, 0].tolist()  # the vertex
        ([0.0, 0.0, 0.25], [0.0, 0.0, 0.25])
        """
        toc = self._values("toc")
        weights, normals = output(self.outputs, "weights", "normals"), self.normals
        return toc_gradients(toc, weights, normals, self.approach)

    @property
    def first_tocs(self) -> NDArray[np.float64]:
        """(W,) float64: the earliest time of impact of each world, +inf if it has no contacts."""
        return np.array([self.first_toc]) if self.slices is None else self.slices.first_tocs

    def world(self, k: int) -> Contacts:
        """The contacts of world k, bit-identical to those of a detector of that world alone.

        Parameters
        ----------
        k : int
            Number of the world, 0 <= k < W.

        Returns
        -------
        Contacts

        Raises
        ------
        TypeError, ValueError
            If there is no such world.
        """
        k = self._world_number(k)
        if self.slices is None:
            return self
        return Contacts(**self._fields_of(k, "toc"), first_toc=float(self.slices.first_tocs[k]))

    def _pairs(self) -> dict[str, Indices]:
        pairs = super()._pairs()
        return {**pairs, "ef": self.ef} if len(self.ef) else pairs

    def __len__(self) -> int:
        return super().__len__() + len(self.ef)

    def __repr__(self) -> str:
        crossing = f", {len(self.ef)} edge-face" if len(self.ef) else ""
        return f"Contacts({self._counts()}{crossing}, first at {self.first_toc:.6g})"

    @classmethod
    def none(cls, worlds: int | None = None, outputs: Iterable[str] = (), layout: MeshLayout | None = None) -> Contacts:
        """No contacts at all.

        Parameters
        ----------
        worlds : int, optional
            Number of worlds; None for one.
        outputs : iterable of str
            Outputs that the result has, without rows.
        layout : MeshLayout, optional
            Meshes of the scene.

        Returns
        -------
        Contacts
        """
        empty, asked = np.empty, tuple(outputs)
        return cls(
            vf=empty((0, 2), np.uint32),
            vf_toc=empty(0),
            ee=empty((0, 4), np.uint32),
            ee_toc=empty(0),
            first_toc=np.inf,
            hash=0,
            outputs={
                name: empty((0, *array.row), array.dtype)
                for name, array in OUTPUT_ARRAYS.items()
                if array.asked in asked
            },
            slices=None if worlds is None else Slices.of_none(worlds),
            layout=layout,
        )


# Results of the core have no arrays of kinds without rows: these are read.
for _kind in ("vp", "vv", "ve"):
    setattr(Contacts, _kind, NO_PAIRS[_kind])
    setattr(Contacts, f"{_kind}_toc", NO_VALUES)
Contacts.ef = _NO_EF  # of results of the core, which have none
