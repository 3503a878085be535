# SPDX-License-Identifier: Apache-2.0
"""Detection on coarse meshes: the calls of a core detector, answered by one of a coarse scene.

Each face of a mesh is mapped to a coarse face, and no point of it is farther from its own point there than the
deviation of that coarse face. A pair of faces within a distance d is a pair of coarse faces within d and both
deviations: the coarse faces have the deviations as thickness, and the core does the rest.
"""

from __future__ import annotations

import dataclasses
import functools
import threading
import time
import types
from collections.abc import Callable, Sequence
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from . import _core, arguments
from .detail_full import Ends, FullMeshes, PlanesOfAll
from .detail_levels import Level
from .detail_meshes import CoarseScene, DetailedMesh, Doubles, check_thickness
from .detail_options import MeshDetail
from .detail_results import at_time, copied_rows, count, intersections, merged, nothing, renumbered, translated
from .mesh_layout import Indices, MeshLayout
from .scene import Scene

_LARGEST = {"motion": 1e150, "snapshot": 1e300}  # src/base/coordinate_limits.h
_BOTH = (True, True)

#: Levels of a mesh with an error, from the coarsest: parts of its faces. Then the mesh itself.
RATIOS = tuple(2.0**-k for k in range(7, 0, -1))


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
        self.scene = object.__new__(Scene)
        self.scene.__setstate__({"_calls": self.calls})
        self.options = options
        options.features = _core.TestedFeatures(*_BOTH)
        self.by_boxes = options.method == _core.Method.default
        self.pool = _core.DetailThreads(options.threads)
        firsts = self.layout.vertex_offsets.tolist()
        self.meshes: list[DetailedMesh] = []
        number = 0
        for name, values in self.calls:
            if name == "add_mesh":
                self.meshes.append(DetailedMesh(number, values, firsts[number], details[number]))
            number += name in ("add_mesh", "add_plane")
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
            check_thickness(mesh, mesh.thickness)
        of_scene = self.calls, self.layout
        self.full = FullMeshes(*of_scene, self.within, options, features) if refine and self.within else None
        self.planes = PlanesOfAll(*of_scene, self.meshes, options) if len(self.layout.planes) else None
        self._settings: dict[tuple[Any, ...], tuple[Any, ...]] = {}
        self._made: dict[tuple[float, ...], CoarseScene] = {}
        self._last: CoarseScene | None = None
        self._lock = threading.RLock()
        self._cancelled = False
        self._own: object = None
        self._given: dict[str, NDArray[Any]] = {}  # positions of this call, by the name of the argument
        self._kind = "motion"
        self._largest: dict[int, Doubles] | None = None  # coordinates of each mesh by id of its positions, if checked
        self._ends: dict[tuple[int, float], tuple[object, Doubles]] = {}
        self._ms = 0.0

    # The levels of a call.

    def owns(self, vertices: object) -> None:
        """Positions of the next call that nobody else writes to: the end of a step, which is the start of the next."""
        self._own = vertices

    def _measured(
        self, mesh: DetailedMesh, level: Level, ratio: float, ends: tuple[NDArray[Any], ...], most: float
    ) -> Doubles:
        """(C,) The deviation of each coarse face over the step. Above `most` it may be incomplete."""
        # Unequal ends of a static mesh are measured, which finds coordinates that are not allowed.
        still = mesh.static and all(np.array_equal(end[mesh.slice], ends[0][mesh.slice]) for end in ends)
        if still and mesh.at_rest is not None:
            last, of_ratio, found = mesh.at_rest
            if of_ratio == ratio and np.array_equal(last, ends[0][mesh.slice]):
                return found
        worst: Doubles = np.zeros(len(level.faces))
        for end in ends[:1] if still else ends:
            kept_end, kept = self._ends.get((mesh.number, ratio), (None, worst))
            if kept_end is None or kept_end is not end:
                kept = self._of_end(mesh, level, end, most)
                complete = not len(kept) or kept.max() <= most
                if end is self._own and complete:
                    self._ends[mesh.number, ratio] = (end, kept)
            worst = np.maximum(worst, kept)
            if len(worst) and worst.max() > most:
                return worst
        if still:
            mesh.at_rest = ends[0][mesh.slice].copy(), ratio, worst
        return worst

    def _of_end(self, mesh: DetailedMesh, level: Level, end: NDArray[Any], most: float) -> Doubles:
        # Whether coordinates were checked must not change the bound: it depends on these positions only.
        found = level.mesh.deviations(end, mesh.slice.start, None, most, self.pool)
        if found is not None:
            return found
        largest = float(self._checked_coordinates()[id(end)][mesh.number])
        found = level.mesh.deviations(end, mesh.slice.start, largest, most, self.pool)
        assert found is not None
        return found

    def _checked_coordinates(self) -> dict[int, Doubles]:
        """The largest coordinate of each mesh, by id of the positions. Raises ValueError if one is not allowed."""
        if self._largest is None:
            offsets, most = self.layout.vertex_offsets, _LARGEST[self._kind]
            self._largest = {
                id(vertices): self.pool.largest(name, vertices, offsets, most) for name, vertices in self._given.items()
            }
        return self._largest

    def _compact(self, coarse: CoarseScene, vertices: NDArray[Any]) -> NDArray[Any]:
        """The vertices of the coarse scene; those of an end that is the next start are kept."""
        if coarse.end is not None and coarse.end[0] is vertices:
            return coarse.end[1]
        compact: NDArray[Any]
        compact, good = self.pool.rows(vertices, coarse.vertices)
        if not good:
            self._checked_coordinates()
        if vertices is self._own:
            coarse.end = vertices, compact
        return compact

    def _choose(self, ends: tuple[NDArray[Any], ...]) -> tuple[CoarseScene, Doubles]:
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
                    self._checked_coordinates()  # what is rejected must not decide how coarse the mesh is
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
            made = self._made[key] = CoarseScene(
                self.calls,
                self.layout,
                self.meshes,
                tuple(levels),
                self.within,
                self.full is not None,
                self.options,
                self.pool,
            )
            for (name, *_), values in self._settings.items():  # changes since the scene was given
                getattr(made.core, name)(*values)
            if self._cancelled:
                made.core.cancel()
        coarse = self._last = self._made[key]
        self._thicken(coarse, found)
        self._ms = (time.perf_counter() - began) * 1e3
        return coarse, np.concatenate([*found, np.empty(0)])

    def _thicken(self, coarse: CoarseScene, deviations: list[Doubles]) -> None:
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

    def _positions(self, kind: str, *named: tuple[str, object]) -> tuple[NDArray[Any], ...]:
        """The positions of this call. Their coordinates are checked where they are read; in full only if in doubt."""
        self._given, self._kind, self._largest = {}, kind, None
        for name, vertices in named:
            if not isinstance(vertices, np.ndarray):
                raise ValueError(f"{name}: detail takes host arrays without a stream; copy them to the host")
            self._given[name] = vertices
        return tuple(self._given.values())

    def detect(self, vertices_t0: NDArray[Any], vertices_t1: NDArray[Any]) -> dict[str, Any]:
        with self._lock:
            ends = self._positions("motion", ("vertices_t0", vertices_t0), ("vertices_t1", vertices_t1))
            _core.require_static_at_rest(self.scene._core, *ends)
            coarse, deviations = self._choose(ends)
            start, end = (self._compact(coarse, vertices) for vertices in ends)
            results = [nothing(), self._of_coarse(coarse, (start, end), deviations)]
            crossing = self._crossing(coarse, start)
            for search in self._beside(coarse):
                if not (self.report == "any" and (len(crossing) or any(map(count, results)))):
                    results.append(search(ends))
            found = merged(results)
            if len(crossing):
                found["first_toc"] = 0.0
                crossing[:, :2] = coarse.vertices[crossing[:, :2]]
            if self.report == "first":
                found = at_time(found["first_toc"], found)
            found["ef"] = crossing[: 1 if self.report == "any" else None]
            found["hash"] = (
                _core.hash_of_contacts(types.SimpleNamespace(**found)) + _core.hash_of_intersections(found["ef"])
            ) % 2**64
            found["layout"] = self._layout_of(coarse)
            return found

    def _beside(self, coarse: CoarseScene) -> list[Callable[[Ends], dict[str, Any]]]:
        """Searches on the vertices of the scene."""
        found: list[Callable[[Ends], dict[str, Any]]] = []
        if self.full is not None:
            found.append(functools.partial(self.full.detect, first_face=len(coarse.faces)))
        if self.planes is not None:
            found.append(self.planes.detect)
        return found

    def _crossing(self, coarse: CoarseScene, start: NDArray[Any]) -> Indices:
        """Edges and faces of the coarse meshes that intersect at the start of the motion that was just searched."""
        core = coarse.core
        # Searches of the earliest contact may know pairs without their boxes.
        if self.by_boxes and self.report == "all" and core.last_backend == "cpu" and core.stats()["leaf_pairs"] == 0:
            return np.empty((0, 3), np.uint32)  # not even the boxes of their motions overlap
        return intersections(core, start)

    def _of_coarse(self, coarse: CoarseScene, compact: Ends, deviations: Doubles) -> dict[str, Any]:
        found = renumbered(copied_rows(coarse.core.detect(*compact)), coarse.vertices)
        found["bounds"] = coarse.bounds(found, deviations)
        return found

    def collision_free_steps(self, vertices_t0: NDArray[Any], vertices_t1: NDArray[Any]) -> Doubles:
        with self._lock:
            if self.within and self.full is None:
                name = self.within[0].values[0]
                raise ValueError(
                    f"detail: contacts within {name!r} are not all found on its coarse faces; for a step free of them "
                    "make the detector with refine='neighbours', or add the mesh with self_collision=False"
                )
            ends = self._positions("motion", ("vertices_t0", vertices_t0), ("vertices_t1", vertices_t1))
            _core.require_static_at_rest(self.scene._core, *ends)
            coarse, _ = self._choose(ends)
            start, end = (self._compact(coarse, vertices) for vertices in ends)
            step = float(coarse.core.collision_free_steps(start, end)[0])
            if len(intersections(coarse.core, start)):
                return np.zeros(1)
            # The detector without detail may be 1e-9 below the true time of impact, this one must not be above it.
            step = step if step == 1 else max(0.0, step - 1e-9)
            if self.full is not None:
                step = min(step, self.full.collision_free_step(ends))
            if self.planes is not None:
                step = min(step, float(self.planes.core.collision_free_steps(*ends)[0]))
            return np.array([step])

    def distances(self, vertices: NDArray[Any]) -> list[tuple[Any, ...]]:
        with self._lock:
            ends = self._positions("snapshot", ("vertices", vertices))
            coarse, _ = self._choose(ends)
            left_out = {mesh.number for mesh in self.within}
            gaps = [
                translated(gap, coarse.vertices)
                for gap in coarse.core.distances(self._compact(coarse, vertices))
                if gap[0] != gap[1] or gap[0] not in left_out
            ]
            if self.full is not None:
                gaps += self.full.distances(vertices, len(coarse.faces))
            if self.planes is not None:
                gaps += self.planes.core.distances(vertices)
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
            if self.planes is not None:
                self.planes.core.set_separation(mesh_a, mesh_b, separation)

    def set_separations(self, of_pairs: Doubles) -> None:
        if not np.array_equal(of_pairs, of_pairs.T):
            a, b = np.argwhere(of_pairs != of_pairs.T)[0].tolist()
            raise ValueError(f"of_pairs: meshes {a} and {b} have two separations; give the same in both places")
        for a in range(len(of_pairs)):
            for b in range(a + 1):
                self.set_separation(a, b, arguments.length("of_pairs", of_pairs[a, b]))

    def set_plane(self, number: int, normal: Sequence[float], offset: float) -> None:
        with self._lock:
            if self.planes is None:
                self._of_nothing.set_plane(number, normal, offset)  # raises
            else:
                self.planes.core.set_plane(number, normal, offset)

    def set_thickness(self, number: int, thickness: Doubles) -> None:
        with self._lock:
            mesh = self.by_number.get(number)
            if mesh is None or mesh.detail is None:
                self._set("set_thickness", (number, thickness), 1)
            if mesh is not None:
                check_thickness(mesh, thickness)
                mesh.thickness = thickness.copy()
                if self.full is not None and number in self.full.numbers:
                    self.full.core.set_thickness(self.full.numbers[number], thickness)
                if self.planes is not None:
                    self.planes.set_thickness(number, thickness)

    def _set(self, name: str, values: tuple[Any, ...], n_key: int) -> None:
        for coarse in self._made.values():
            getattr(coarse.core, name)(*values)
        self._settings[name, *values[:n_key]] = values

    # The last call.

    def cancel(self) -> None:
        self._cancelled = True
        self.pool.stop()
        for searching in (*self._made.values(), self.full, self.planes):
            if searching is not None:
                searching.core.cancel()

    def faces(self) -> Indices:
        """(F', 3) of the last call, in the vertices of the scene: coarse faces, then faces tested in full."""
        with self._lock:
            if self._last is None:
                return np.empty((0, 3), np.uint32)
            more = [] if self.full is None else [self.full.faces]
            faces: Indices = np.concatenate([self._last.faces, *more])
            return faces

    def _layout_of(self, coarse: CoarseScene) -> MeshLayout:
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
