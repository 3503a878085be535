# SPDX-License-Identifier: Apache-2.0
"""Detection on coarse meshes: the calls of a core detector, answered by one of a coarse scene.

Each face of a mesh is mapped to a coarse face, and no point of it is farther from its own point there than the
deviation of that coarse face. A pair of faces within a distance d is a pair of coarse faces within d and both
deviations: the coarse faces have the deviations as thickness, and the core does the rest.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import threading
import time
import types
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from . import _core, arguments
from .detail_levels import Level, propose
from .detail_options import MeshDetail
from .mesh_layout import Indices, MeshLayout
from .results import OUTPUT_ARRAYS
from .scene import Scene
from .worlds import PAIR_KINDS

Doubles = NDArray[np.float64]
Ends = tuple[NDArray[Any], ...]

_LARGEST = {"motion": 1e150, "snapshot": 1e300}  # src/base/coordinate_limits.h
_BOTH = (True, True)

#: Levels of a mesh with an error, from the coarsest: parts of its faces. Then the mesh itself.
RATIOS = tuple(2.0**-k for k in range(7, 0, -1))


class _Mesh:
    """One mesh of the scene, and its levels of detail, made when they are first used."""

    def __init__(self, number: int, values: tuple[Any, ...], first_vertex: int, detail: MeshDetail | None) -> None:
        self.number, self.values, self.detail = number, values, detail
        _, self.faces, self.n_vertices, self.self_collision, self.static, edges, *_ = values
        self.slice = slice(first_vertex, first_vertex + self.n_vertices)
        used = np.zeros(self.n_vertices, bool)
        used[self.faces] = True
        self.lone_edges = _lone(edges, self.faces)
        in_edges = np.zeros(self.n_vertices, bool)
        in_edges[self.lone_edges] = True
        self.kept = np.flatnonzero(~used | in_edges).astype(np.uint32)
        self.thickness: Doubles = np.zeros(1)
        self.rest: Doubles | None = None if detail is None else detail.rest_vertices
        self._levels: dict[float, Level] = {}
        self.at_rest: tuple[NDArray[Any], float, Doubles] | None = None  # of a static mesh: its last deviations

    def level(self, ratio: float, threads: _core.DetailThreads) -> Level:
        if ratio not in self._levels:
            assert self.rest is not None
            proposal = propose(self.faces, self.rest, ratio)
            mesh = _core.CoarseMesh(self.faces, proposal.faces, proposal.survivor, self.rest, threads)
            self._levels[ratio] = Level(mesh, len(self.faces), self.kept)
        return self._levels[ratio]


def _lone(edges: Indices, faces: Indices) -> Indices:
    """The edges that are in no face."""
    edges = edges[edges[:, 0] != edges[:, 1]]
    if not len(edges):
        return edges
    low, high = edges.min(axis=1), edges.max(axis=1)
    sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    there = _keys(sides.min(axis=1), sides.max(axis=1))
    lone: Indices = edges[~np.isin(_keys(low, high), there)]
    return lone


def _keys(low: Indices, high: Indices) -> NDArray[np.uint64]:
    keys: NDArray[np.uint64] = low.astype(np.uint64) << np.uint64(32) | high
    return keys


class _Coarse:
    """A detector of coarse meshes at one choice of levels, and how its numbers translate."""

    def __init__(self, core: DetailedCore, levels: tuple[Level | None, ...]) -> None:
        scene = Scene()
        vertices, faces = [np.empty(0, np.uint32)], [np.empty((0, 3), np.uint32)]
        begin = [0]
        self.pairs: list[tuple[NDArray[Any], NDArray[Any], NDArray[Any]]] = []
        self.levels = levels
        meshes = iter(zip(core.meshes, levels, strict=True))
        n_vertices = 0
        for name, values in core.calls:
            if name == "add_mesh":
                mesh, level = next(meshes)
                if level is None:
                    of_mesh, coarse = np.arange(mesh.n_vertices, dtype=np.uint32), mesh.faces
                    scene._repeat(name, values)
                else:
                    of_mesh, coarse = level.vertices, level.faces
                    local = (np.searchsorted(of_mesh, given).astype(np.uint32) for given in (coarse, mesh.lone_edges))
                    compact, edges = local
                    scene._repeat(name, (values[0], compact, len(of_mesh), *values[3:5], edges, *values[6:]))
                vertices.append(of_mesh + np.uint32(mesh.slice.start))
                faces.append(coarse + np.uint32(mesh.slice.start))
                begin.append(begin[-1] + len(coarse))
                n_vertices += len(of_mesh)
            elif core.applies(name, values):
                scene._repeat(name, values)
        self.vertices, self.faces = np.concatenate(vertices), np.concatenate(faces)
        self.layout = MeshLayout(core.layout.mesh_names, core.layout.vertex_offsets, np.array(begin, np.int64))
        self.face_slices = [slice(a, b) for a, b in zip(begin[:-1], begin[1:], strict=True)]
        core.ignore_neighbours(scene, self)
        self.core = _core.Detector(scene._core, core.options)
        core.apply_settings(self.core)
        self.end: tuple[object, NDArray[Any]] | None = None

    def deviations_of(self, vf: Indices, ee: Indices, of_faces: Doubles) -> Doubles:
        """The sum of the deviations of both sides of each row, rounded up. Edges and vertices have the greatest of
        their faces."""
        sums = [np.empty(0)] * 2
        if len(vf):
            sums[0] = _greatest(vf[:, 0], self._faces_of_vertices, of_faces) + of_faces[vf[:, 1]]
        if len(ee):
            rows, n = _keys(*ee.reshape(-1, 2).T), len(self._edges)
            at = np.minimum(np.searchsorted(self._edges, rows), n - 1)
            # An edge of no face is where it was.
            number = np.where(self._edges[at] == rows, at, n) if n else np.zeros(len(rows), np.intp)
            sums[1] = _greatest(number, self._faces_of_edges, of_faces).reshape(-1, 2).sum(axis=1)
        both = np.concatenate(sums)
        rounded: Doubles = np.where(both > 0, np.nextafter(both, np.inf), 0)
        return rounded

    @functools.cached_property
    def _sides(self) -> NDArray[np.uint64]:
        f = self.faces
        sides = np.concatenate([f[:, [0, 1]], f[:, [1, 2]], f[:, [2, 0]]])
        return _keys(sides.min(axis=1), sides.max(axis=1))

    @functools.cached_property
    def _edges(self) -> NDArray[np.uint64]:
        return np.unique(self._sides)

    @functools.cached_property
    def _faces_of_edges(self) -> _FacesOf:
        return _FacesOf.grouped(
            np.searchsorted(self._edges, self._sides), np.tile(np.arange(len(self.faces)), 3), len(self._edges) + 1
        )

    @functools.cached_property
    def _faces_of_vertices(self) -> _FacesOf:
        n = int(self.layout.vertex_offsets[-1])
        return _FacesOf.grouped(self.faces.ravel(), np.repeat(np.arange(len(self.faces)), 3), n)


@dataclasses.dataclass(frozen=True, eq=False)
class _FacesOf:
    """The faces of each of n features: faces[begin[i] : begin[i + 1]]."""

    begin: NDArray[np.intp]
    faces: NDArray[np.intp]

    @classmethod
    def grouped(cls, features: NDArray[Any], faces: NDArray[np.intp], n: int) -> _FacesOf:
        begin = np.append(0, np.cumsum(np.bincount(features, minlength=n)))
        return cls(begin, faces[np.argsort(features, kind="stable")])


def _greatest(features: NDArray[Any], of: _FacesOf, values: Doubles) -> Doubles:
    """The greatest value of the faces of each feature; 0 without faces."""
    those, place = np.unique(features, return_inverse=True)
    begin, count = of.begin[those], np.diff(of.begin)[those]
    some = count > 0
    found = np.zeros(len(those))
    if some.any():
        begin, count = begin[some], count[some]
        ends = np.cumsum(count)
        each = np.arange(ends[-1]) + np.repeat(begin - (ends - count), count)
        found[some] = np.maximum.reduceat(values[of.faces[each]], ends - count)
    each_row: Doubles = found[place]
    return each_row


#: The columns that are vertices.
_KINDS = {"vf": 1, "ee": 4, "vp": 1, "vv": 2, "ve": 3}


class DetailedCore:
    """What `Detector` calls instead of `_core.Detector` where meshes have a detail.

    Parameters
    ----------
    scene : Scene
        Copied.
    options : _core.Options
        Both kinds of features are tested, whatever they say.
    details : list of MeshDetail or None
        By mesh.
    refine : bool
        Whether contacts within a coarse mesh are tested on its own faces.
    report : {"all", "first", "any"}
        As in the options.
    features : (bool, bool)
        Kinds of features that are tested within the meshes with `refine`.
    """

    def __init__(
        self,
        scene: Scene,
        options: _core.Options,
        details: list[MeshDetail | None],
        refine: bool,
        report: str,
        features: tuple[bool, bool],
    ) -> None:
        self.calls, self.layout, self.report = list(scene._calls), scene.layout, report
        if len(self.layout.planes) or scene._has_points():
            raise ValueError(
                "detail: not offered for scenes with planes or points; test those with a detector without detail"
            )
        self.scene = object.__new__(Scene)
        self.scene.__setstate__({"_calls": self.calls})
        self.options = options
        options.features = _core.TestedFeatures(*_BOTH)
        self.by_boxes = options.method == _core.Method.default
        self.pool = _core.DetailThreads(options.threads)
        firsts = self.layout.vertex_offsets.tolist()
        self.meshes: list[_Mesh] = []
        for name, values in self.calls:
            if name == "add_mesh":
                number = len(self.meshes)
                self.meshes.append(_Mesh(number, values, firsts[number], details[number]))
        self.by_number = {mesh.number: mesh for mesh in self.meshes}
        ignored = {values[0] for name, values in self.calls if name == "ignore_pair" and values[0] == values[1]}
        #: Coarse meshes that are tested against themselves.
        self.within = [
            mesh
            for mesh in self.meshes
            if mesh.detail and mesh.self_collision and not mesh.static and mesh.number not in ignored
        ]
        for name, values in self.calls:
            if name == "set_thickness":
                self.by_number[values[0]].thickness = values[1]
        for mesh in self.meshes:
            _check_thickness(mesh, mesh.thickness)
        self.full = _FullMeshes(self, features) if refine and self.within else None
        self._settings: dict[tuple[Any, ...], tuple[Any, ...]] = {}
        self._made: dict[tuple[float, ...], _Coarse] = {}
        self._last: _Coarse | None = None
        self._lock = threading.RLock()
        self._cancelled = False
        self._own: object = None
        self._largest: dict[int, Doubles] = {}  # coordinates of each mesh, by the id of the positions of this call
        self._largest_last: tuple[object, Doubles] = (None, np.empty(0))
        self._ends: dict[tuple[int, float], tuple[object, Doubles]] = {}
        self._ms = 0.0

    # What the coarse scene is made of.

    def applies(self, name: str, values: tuple[Any, ...]) -> bool:
        """Whether a call of the scene is one of the coarse scene too. A filter that is not, leaves pairs in doubt."""
        if name == "set_thickness" or name == "ignore_rings" or name == "ignore_at_rest":
            return self.by_number[values[0]].detail is None
        return name in ("ignore_pair", "set_accuracy", "set_separation")

    def ignore_neighbours(self, scene: Scene, coarse: _Coarse) -> None:
        """Ignore what is outside the promise, and pairs of coarse faces whose faces are all ignored."""
        for mesh, level in zip(self.meshes, coarse.levels, strict=True):
            if self.full and mesh in self.within:
                scene._repeat("ignore_pair", (mesh.number, mesh.number))
            elif level is not None and mesh in self.within:
                pairs = level.mesh.neighbour_pairs(mesh.lone_edges, mesh.n_vertices, self.pool)
                first_vertex = np.searchsorted(coarse.vertices, mesh.slice.start)
                first_face = coarse.face_slices[mesh.number].start
                for rows, columns in zip(pairs, (1, 4, 2), strict=True):
                    rows[:, :columns] = np.searchsorted(level.vertices, rows[:, :columns]) + first_vertex
                    rows[:, columns:] += np.uint32(first_face)
                if any(map(len, pairs)):
                    scene._repeat("ignore_features", pairs)
        ignored: dict[tuple[int, int], list[Indices]] = {}
        for name, values in self.calls:
            if name == "ignore_faces":
                ignored.setdefault((values[0], values[2]), []).append(values[1])
        levels = {mesh.number: level for mesh, level in zip(self.meshes, coarse.levels, strict=True)}
        for (number, other), faces in ignored.items():
            listed, level = np.unique(np.concatenate(faces)), levels[number]
            if level is not None:  # those with no face that is not listed
                others = level.held[~np.isin(level.held[:, 1], listed), 0]
                listed = np.setdiff1d(np.arange(len(level.faces), dtype=np.uint32), others)
            scene._repeat("ignore_faces", (number, listed.astype(np.uint32), other))

    def apply_settings(self, core: _core.Detector) -> None:
        """Repeat the changes since this was made."""
        for (name, *_), values in self._settings.items():
            getattr(core, name)(*values)

    # The levels of a call.

    def owns(self, vertices: object) -> None:
        """Positions of the next call that nobody else writes to: the end of a step, which is the start of the next."""
        self._own = vertices

    def _measured(
        self, mesh: _Mesh, level: Level, ratio: float, ends: tuple[NDArray[Any], ...], most: float
    ) -> Doubles:
        """(C,) The deviation of each coarse face over the step. Above `most` it may be incomplete."""
        if mesh.static and mesh.at_rest is not None:
            last, of_ratio, found = mesh.at_rest
            if of_ratio == ratio and np.array_equal(last, ends[0][mesh.slice]):
                return found
        worst: Doubles = np.zeros(len(level.faces))
        for end in ends[:1] if mesh.static else ends:
            kept_end, kept = self._ends.get((mesh.number, ratio), (None, worst))
            if kept_end is None or kept_end is not end:
                kept = level.mesh.deviations(
                    end, mesh.slice.start, self._largest[id(end)][mesh.number], most, self.pool
                )
                complete = not len(kept) or kept.max() <= most
                if end is self._own and complete:
                    self._ends[mesh.number, ratio] = (end, kept)
            worst = np.maximum(worst, kept)
            if len(worst) and worst.max() > most:
                return worst
        if mesh.static:
            mesh.at_rest = ends[0][mesh.slice].copy(), ratio, worst
        return worst

    def _compact(self, coarse: _Coarse, vertices: NDArray[Any]) -> NDArray[Any]:
        """The vertices of the coarse scene; those of an end that is the next start are kept."""
        if coarse.end is not None and coarse.end[0] is vertices:
            return coarse.end[1]
        compact = self.pool.rows(vertices, coarse.vertices)
        if vertices is self._own:
            coarse.end = vertices, compact
        return compact

    def _choose(self, ends: tuple[NDArray[Any], ...]) -> tuple[_Coarse, Doubles]:
        """The coarse detector for these positions, with its thickness set, and the deviations of its faces."""
        began = time.perf_counter()
        levels: list[Level | None] = []
        ratios: list[float] = []
        found: list[Doubles] = []
        for mesh in self.meshes:
            chosen: Level | None = None
            ratio, deviations = 1.0, np.broadcast_to(0.0, len(mesh.faces))
            if mesh.detail is not None:
                if mesh.rest is None:
                    mesh.rest = np.array(ends[0][mesh.slice], np.float64)
                error = np.inf if mesh.detail.error is None else mesh.detail.error
                for tried in RATIOS if mesh.detail.ratio is None else (mesh.detail.ratio,):
                    level = mesh.level(tried, self.pool)
                    if level.same:
                        break
                    measured = self._measured(mesh, level, tried, ends, error)
                    if not len(measured) or measured.max() <= error:
                        chosen, ratio, deviations = level, tried, measured
                        break
            levels.append(chosen)
            ratios.append(ratio)
            found.append(deviations)
        key = tuple(ratios)
        if key not in self._made:
            self._made[key] = _Coarse(self, tuple(levels))
            if self._cancelled:
                self._made[key].core.cancel()
        coarse = self._last = self._made[key]
        self._thicken(coarse, found)
        self._ms = (time.perf_counter() - began) * 1e3
        return coarse, np.concatenate([*found, np.empty(0)])

    def _thicken(self, coarse: _Coarse, deviations: list[Doubles]) -> None:
        """Give each coarse face the greatest thickness of its patch, plus its deviation.

        The core rounds the sum d + (a + b) of a separation and two thicknesses, which may lose u (2 d + 8 T) beside the
        sum for the full meshes, with u = 2^-53 and T the greatest thickness: those that deviate get 8 u (d + 2 T)
        more, which holds the rounding of the sum here too.
        """
        full = [
            mesh.thickness if level is None else level.greatest(mesh.thickness)
            for mesh, level in zip(self.meshes, coarse.levels, strict=True)
        ]
        most = max(
            (float(t.max(initial=0) + d.max(initial=0)) for t, d in zip(full, deviations, strict=True)), default=0
        )
        extra = 2.0**-50 * (self._largest_separation() + 2 * most)
        for mesh, level, thickness, deviation in zip(self.meshes, coarse.levels, full, deviations, strict=True):
            if level is None:
                coarse.core.set_thickness(mesh.number, np.ascontiguousarray(thickness))
            elif len(deviation):
                grown = np.where(deviation > 0, thickness + deviation + extra, thickness)
                coarse.core.set_thickness(mesh.number, grown)

    def _largest_separation(self) -> float:
        of_scene = [values[2] for name, values in self.calls if name == "set_separation"]
        changed = [
            np.max(values[-1], initial=0) for (name, *_), values in self._settings.items() if "separation" in name
        ]
        return float(max([self.options.minimum_separation, *of_scene, *changed]))

    # Queries.

    def _checked(self, kind: str, *named: tuple[str, object]) -> tuple[NDArray[Any], ...]:
        self._largest.clear()
        checked = []
        for name, vertices in named:
            if not isinstance(vertices, np.ndarray):
                raise ValueError(f"{name}: detail takes host arrays without a stream; copy them to the host")
            kept, largest = self._largest_last
            if vertices is not kept:
                largest = self.pool.largest(name, vertices, self.layout.vertex_offsets, _LARGEST[kind])
            if vertices is self._own:
                self._largest_last = vertices, largest
            self._largest[id(vertices)] = largest
            checked.append(vertices)
        return tuple(checked)

    def detect(self, vertices_t0: NDArray[Any], vertices_t1: NDArray[Any]) -> dict[str, Any]:
        with self._lock:
            ends = self._checked("motion", ("vertices_t0", vertices_t0), ("vertices_t1", vertices_t1))
            _core.require_static_at_rest(self.scene._core, *ends)
            coarse, deviations = self._choose(ends)
            start, end = (self._compact(coarse, vertices) for vertices in ends)
            results = [_nothing(), self._of_coarse(coarse, (start, end), deviations)]
            crossing = self._crossing(coarse, start)
            if self.full is not None and not (self.report == "any" and (len(crossing) or _count(results[1]))):
                results.append(self.full.detect(ends, len(coarse.faces)))
            found = _merged(results)
            if len(crossing):
                found["first_toc"] = 0.0
                crossing[:, :2] = coarse.vertices[crossing[:, :2]]
            if self.report == "first":
                found = _at(found["first_toc"], found)
            found["ef"] = crossing[: 1 if self.report == "any" else None]
            found["hash"] = (
                _core.hash_of_contacts(types.SimpleNamespace(**found)) + _core.hash_of_intersections(found["ef"])
            ) % 2**64
            found["layout"] = self._layout_of(coarse)
            return found

    def _crossing(self, coarse: _Coarse, start: NDArray[Any]) -> Indices:
        """Edges and faces of the coarse meshes that intersect at the start of the motion that was just searched."""
        core = coarse.core
        # Searches of the earliest contact may know pairs without their boxes.
        if self.by_boxes and self.report == "all" and core.last_backend == "cpu" and core.stats()["leaf_pairs"] == 0:
            return np.empty((0, 3), np.uint32)  # not even the boxes of their motions overlap
        return _intersections(core, start)

    def _of_coarse(self, coarse: _Coarse, compact: Ends, deviations: Doubles) -> dict[str, Any]:
        found = _renumbered(_rows(coarse.core.detect(*compact)), coarse.vertices)
        found["bounds"] = np.zeros(_count(found))
        of_pairs = coarse.deviations_of(found["vf"], found["ee"], deviations)
        found["bounds"][: len(of_pairs)] = of_pairs
        return found

    def collision_free_steps(self, vertices_t0: NDArray[Any], vertices_t1: NDArray[Any]) -> Doubles:
        with self._lock:
            if self.within and self.full is None:
                name = self.within[0].values[0]
                raise ValueError(
                    f"detail: contacts within {name!r} are not all found on its coarse faces; for a step free of them "
                    "make the detector with refine='neighbours', or add the mesh with self_collision=False"
                )
            ends = self._checked("motion", ("vertices_t0", vertices_t0), ("vertices_t1", vertices_t1))
            _core.require_static_at_rest(self.scene._core, *ends)
            coarse, _ = self._choose(ends)
            start, end = (self._compact(coarse, vertices) for vertices in ends)
            step = float(coarse.core.collision_free_steps(start, end)[0])
            if len(_intersections(coarse.core, start)):
                return np.zeros(1)
            # The detector without detail may be 1e-9 below the true time of impact, this one must not be above it.
            step = step if step == 1 else max(0.0, step - 1e-9)
            if self.full is not None:
                step = min(step, self.full.collision_free_step(ends))
            return np.array([step])

    def distances(self, vertices: NDArray[Any]) -> list[tuple[Any, ...]]:
        with self._lock:
            ends = self._checked("snapshot", ("vertices", vertices))
            coarse, _ = self._choose(ends)
            left_out = {mesh.number for mesh in self.within}
            gaps = [
                _translated(gap, coarse.vertices)
                for gap in coarse.core.distances(self._compact(coarse, vertices))
                if gap[0] != gap[1] or gap[0] not in left_out
            ]
            if self.full is not None:
                gaps += self.full.distances(vertices, len(coarse.faces))
            return sorted(gaps, key=lambda gap: gap[:2])

    def __getattr__(self, name: str) -> NoReturn:
        if name.startswith("_"):
            raise AttributeError(name)
        public = {"prepare", "collision_free_motion", "proximity", "intersections", "winding_numbers"}
        public |= {"signed_distances", "separating_translation", "penetration"}
        if name not in public:
            raise AttributeError(name)
        raise ValueError(
            f"detail: {name} is not offered on coarse meshes; call it on a detector of the same scene without detail"
        )

    # Settings.

    def set_separation(self, mesh_a: int, mesh_b: int, separation: float) -> None:
        with self._lock:
            self._set("set_separation", (*sorted((mesh_a, mesh_b)), separation), 2)
            if self.full is not None and mesh_a == mesh_b and mesh_a in self.full.numbers:
                number = self.full.numbers[mesh_a]
                self.full.core.set_separation(number, number, separation)

    def set_separations(self, of_pairs: Doubles) -> None:
        if not np.array_equal(of_pairs, of_pairs.T):
            a, b = np.argwhere(of_pairs != of_pairs.T)[0].tolist()
            raise ValueError(f"of_pairs: meshes {a} and {b} have two separations; give the same in both places")
        for a in range(len(of_pairs)):
            for b in range(a + 1):
                self.set_separation(a, b, arguments.length("of_pairs", of_pairs[a, b]))

    def set_thickness(self, number: int, thickness: Doubles) -> None:
        with self._lock:
            mesh = self.by_number.get(number)
            if mesh is None or mesh.detail is None:
                self._set("set_thickness", (number, thickness), 1)
            if mesh is not None:
                _check_thickness(mesh, thickness)
                mesh.thickness = thickness.copy()
                if self.full is not None and number in self.full.numbers:
                    self.full.core.set_thickness(self.full.numbers[number], thickness)

    def _set(self, name: str, values: tuple[Any, ...], n_key: int) -> None:
        for coarse in self._made.values():
            getattr(coarse.core, name)(*values)
        self._settings[name, *values[:n_key]] = values

    # The last call.

    def cancel(self) -> None:
        self._cancelled = True
        self.pool.stop()
        for core in [made.core for made in self._made.values()] + ([self.full.core] if self.full else []):
            core.cancel()

    def faces(self) -> Indices:
        """(F', 3) of the last call, in the vertices of the scene: coarse faces, then faces tested in full."""
        with self._lock:
            if self._last is None:
                return np.empty((0, 3), np.uint32)
            more = [] if self.full is None else [self.full.faces]
            faces: Indices = np.concatenate([self._last.faces, *more])
            return faces

    def _layout_of(self, coarse: _Coarse) -> MeshLayout:
        if self.full is None:
            return coarse.layout
        # Faces that are tested in full follow all coarse ones: a second range of each mesh.
        counts = [
            mesh_faces if number in self.full.numbers else 0
            for number, mesh_faces in enumerate(np.diff(self.layout.face_offsets).tolist())
        ]
        more = len(coarse.faces) + np.cumsum(counts)
        return dataclasses.replace(coarse.layout, face_offsets=np.concatenate([coarse.layout.face_offsets, more]))

    def profile(self) -> dict[str, float]:
        with self._lock:
            if self._last is None:
                return {}
            stages = dict(self._last.core.profile())
            stages["total"] = stages.get("total", 0.0) + self._ms
            return {**stages, "deviations": self._ms}

    def stats(self) -> dict[str, int]:
        with self._lock:
            if self._last is None:
                return {}
            return {**self._last.core.stats(), "coarse_faces": len(self._last.faces)}

    @functools.cached_property
    def _of_nothing(self) -> _core.Detector:
        return _core.Detector(_core.Scene(), self.options)

    @property
    def last_backend(self) -> str:
        return (self._last.core if self._last else self._of_nothing).last_backend

    @property
    def last_gpu_error(self) -> str:
        return self._last.core.last_gpu_error if self._last else ""

    @property
    def threads(self) -> int:
        return self._of_nothing.threads

    @property
    def simd(self) -> str:
        return self._of_nothing.simd


class _FullMeshes:
    """A detector of contacts within the coarse meshes, on their own faces."""

    def __init__(self, core: DetailedCore, features: tuple[bool, bool]) -> None:
        self.numbers = {mesh.number: k for k, mesh in enumerate(core.within)}
        scene = Scene()
        number = -1
        for name, values in core.calls:
            if name == "add_mesh":
                number += 1
                if number in self.numbers:
                    scene._repeat(name, values)
            elif name in ("set_thickness", "ignore_rings", "ignore_at_rest"):
                if values[0] in self.numbers:
                    scene._repeat(name, (self.numbers[values[0]], *values[1:]))
            elif name == "ignore_faces":
                if values[0] == values[2] and values[0] in self.numbers:
                    scene._repeat(name, (self.numbers[values[0]], values[1], self.numbers[values[0]]))
            elif name in ("set_accuracy", "set_separation", "set_features"):
                if values[0] == values[1] and values[0] in self.numbers:
                    scene._repeat(name, (self.numbers[values[0]],) * 2 + values[2:])
        for pair in itertools.combinations(range(len(self.numbers)), 2):
            scene._repeat("ignore_pair", pair)
        self._slices = [mesh.slice for mesh in core.within]
        self.vertices = np.concatenate([np.arange(s.start, s.stop, dtype=np.uint32) for s in self._slices])
        self.faces = np.concatenate([mesh.faces + np.uint32(mesh.slice.start) for mesh in core.within])
        self._translate(scene, core)
        core.options.features = _core.TestedFeatures(*features)
        self.core = _core.Detector(scene._core, core.options)
        core.options.features = _core.TestedFeatures(*_BOTH)

    def _translate(self, scene: Scene, core: DetailedCore) -> None:
        """Repeat the ignored pairs of features whose both sides are in these meshes."""
        new_vertex = np.full(int(core.layout.vertex_offsets[-1]), -1, np.int64)
        new_vertex[self.vertices] = np.arange(len(self.vertices))
        new_face = np.full(int(core.layout.face_offsets[-1]), -1, np.int64)
        faces = [np.arange(*core.layout.face_offsets[mesh.number : mesh.number + 2]) for mesh in core.within]
        new_face[np.concatenate(faces)] = np.arange(len(self.faces))
        for name, rows in core.calls:
            if name == "ignore_features":
                new = []
                for pairs, columns in zip(rows, (1, 4, 2), strict=True):
                    both = np.concatenate([new_vertex[pairs[:, :columns]], new_face[pairs[:, columns:]]], axis=1)
                    new.append(both[(both >= 0).all(axis=1)].astype(np.uint32))
                scene._repeat(name, tuple(new))

    def _of_meshes(self, vertices: NDArray[Any]) -> NDArray[Any]:
        return np.concatenate([vertices[s] for s in self._slices])

    def detect(self, ends: Ends, first_face: int) -> dict[str, Any]:
        found = _renumbered(_rows(self.core.detect(*map(self._of_meshes, ends))), self.vertices, first_face)
        found["bounds"] = np.zeros(_count(found))
        return found

    def collision_free_step(self, ends: Ends) -> float:
        return float(self.core.collision_free_steps(*map(self._of_meshes, ends))[0])

    def distances(self, vertices: NDArray[Any], first_face: int) -> list[tuple[Any, ...]]:
        numbers = list(self.numbers)
        return [
            (numbers[a], numbers[b], *_translated((a, b, *others), self.vertices, first_face)[2:])
            for a, b, *others in self.core.distances(self._of_meshes(vertices))
        ]


def _check_thickness(mesh: _Mesh, thickness: Doubles) -> None:
    """Raises ValueError for what a coarse mesh cannot have."""
    if mesh.detail is None or not thickness.any():
        return
    if len(thickness) not in (1, len(mesh.faces)):
        raise ValueError(
            f"thickness: expected one number or {len(mesh.faces)}, one for each face, got {len(thickness)}"
        )
    if len(mesh.kept):
        raise ValueError(
            f"detail: {mesh.values[0]!r} has a thickness, and edges or points beside its faces; add those as another "
            "mesh"
        )


def _rows(found: Any) -> dict[str, Any]:
    """The result of a core detector on the host. Rows that a GPU wrote are copied: they are renumbered in place."""
    return {
        name: value if not isinstance(value, np.ndarray) or value.flags.owndata else value.copy()
        for name, value in found.items()
    }


def _intersections(core: _core.Detector, vertices: NDArray[Any]) -> Indices:
    found: Any = core.intersections(vertices)
    crossing: Indices = found["ef"].copy()
    return crossing


def _count(found: dict[str, Any]) -> int:
    """The number of rows with places in the outputs."""
    return sum(len(found[kind]) for kind in _KINDS if kind in found)


def _nothing() -> dict[str, Any]:
    """A result without rows."""
    rows: dict[str, Any] = {kind: np.empty((0, columns), np.uint32) for kind, columns in PAIR_KINDS.items()}
    rows |= {f"{kind}_toc": np.empty(0) for kind in PAIR_KINDS}
    rows |= {name: np.empty((0, *kind.row), kind.dtype) for name, kind in OUTPUT_ARRAYS.items()}
    return {**rows, "bounds": np.empty(0), "first_toc": np.inf, "hash": 0}


def _renumbered(found: dict[str, Any], vertices: Indices, first_face: int = 0) -> dict[str, Any]:
    """The result with the vertices of the scene, and faces numbered from this one."""
    for kind, columns in _KINDS.items():
        if kind in found:
            found[kind][:, :columns] = vertices[found[kind][:, :columns]]
    found["vf"][:, 1] += np.uint32(first_face)
    found["vertices"] = vertices[found["vertices"]]
    return found


def _translated(gap: tuple[Any, ...], vertices: Indices, first_face: int = 0) -> tuple[Any, ...]:
    """A gap with the vertices of the scene. Coarse meshes do not tell what is inside."""
    a, b, distance, kind, features, points, of_gap, *others, _ = gap
    faces = {"vertex-face": 1, "edge-face": 2}.get(kind, len(features))
    new = [int(vertices[f]) if k < faces else f + first_face for k, f in enumerate(features)]
    return (a, b, distance, kind, new, points, vertices[of_gap], *others, None)


def _merged(results: list[dict[str, Any]]) -> dict[str, Any]:
    """The rows of all results, in canonical order."""
    if len([found for found in results if _count(found)]) == 1:  # the usual case, without copies
        (found,) = (found for found in results if _count(found))
        return {**results[0], **found}
    merged, places = dict(results[0]), []
    begins = np.cumsum([0, *map(_count, results)])[:-1]
    for kind in PAIR_KINDS:
        rows = np.concatenate([found.get(kind, results[0][kind]) for found in results])
        order = np.lexsort(rows.T[::-1])
        merged[kind] = rows[order]
        toc = f"{kind}_toc"
        merged[toc] = np.concatenate([found.get(toc, results[0][toc]) for found in results])[order]
        counts = [len(found.get(kind, ())) for found in results]
        places.append(np.concatenate([b + np.arange(n) for b, n in zip(begins, counts, strict=True)])[order])
        begins = begins + counts
    place = np.concatenate(places).astype(np.intp)
    for name in (*OUTPUT_ARRAYS, "bounds"):
        rows = np.concatenate([found.get(name, results[0][name]) for found in results])
        merged[name] = rows[place] if len(rows) == len(place) else results[0][name]
    merged["first_toc"] = min(found["first_toc"] for found in results)
    return merged


def _at(time_of_impact: float, found: dict[str, Any]) -> dict[str, Any]:
    """The rows with this time."""
    kept = {kind: found[f"{kind}_toc"] == time_of_impact for kind in PAIR_KINDS}
    place = np.concatenate(list(kept.values()))
    if place.all():
        return found
    for kind, those in kept.items():
        found[kind], found[f"{kind}_toc"] = found[kind][those], found[f"{kind}_toc"][those]
    for name in (*OUTPUT_ARRAYS, "bounds"):
        if len(found[name]) == len(place):
            found[name] = found[name][place]
    return found
