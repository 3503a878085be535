# SPDX-License-Identifier: Apache-2.0
"""Meshes of a USD stage, placed by its transforms, in metres."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..mesh_files.errors import MeshFileError, shortened
from .packages import needed
from .sequence import FrameSequence, SequenceError, SequenceMesh
from .topology import checked_polygons, same_or, short_names
from .usd_crate import check_counts

SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")
_LEFT_OUT = ("guide", "proxy")  # purposes


class UsdStage(FrameSequence):
    """The mesh prims of a stage. Its frames are the time samples of their points, topology and transforms.

    Parameters
    ----------
    path : Path
        The root layer; references and payloads are loaded.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        geom = self._module("UsdGeom")
        stage = self._stage()
        prims, notes = self._meshes_of(stage)
        if not prims:
            others = f" ({shortened('; '.join(notes))})" if notes else ""
            raise SequenceError(f"{path}: has no Mesh prims{others}; export surfaces as meshes")
        names = short_names([str(prim.GetPath()) for prim in prims], "/")
        self._prims = dict(sorted(zip(names, (str(prim.GetPath()) for prim in prims), strict=True)))
        self._times = sorted(set().union(*(self._samples(prim) for prim in prims)))
        self._unit = float(geom.GetStageMetersPerUnit(stage))
        if not 0 < self._unit < np.inf:
            raise SequenceError(f"{path}: metersPerUnit is {self._unit}; it must be finite and positive")
        origin = "" if geom.StageHasAuthoredMetersPerUnit(stage) else " (the default of USD: the file states none)"
        scaled = ", positions are scaled to metres" if self._unit != 1 else ""
        notes = [f"units: 1 unit = {self._unit:g} m{origin}{scaled}", *notes]
        up = str(geom.GetStageUpAxis(stage))
        notes.insert(1, f"the {up} axis points up; transforms of the stage are applied")
        super().__init__(str(path), max(1, len(self._times)), tuple(notes), up=up.lower())

    def _module(self, name: str) -> Any:
        return needed(f"pxr.{name}", "usd-core", self._path)

    def _stage(self) -> Any:
        if "stage" not in self._opened:
            usd, tf = self._module("Usd"), self._module("Tf")
            check_counts(self._path)
            try:
                stage = usd.Stage.Open(str(self._path))
                # USD shares layers of the process, as they were read first. Those with changes are the caller's.
                for layer in stage.GetUsedLayers():
                    if not layer.dirty:
                        layer.Reload()
            except tf.ErrorException:
                raise SequenceError(f"{self._path}: cannot be opened as USD; copy or export it again") from None
            if errors := stage.GetCompositionErrors():
                raise SequenceError(f"{self._path}: is not complete: {_line(errors[0])}; add the files that it names")
            self._opened["stage"] = stage
        return self._opened["stage"]

    def _meshes_of(self, stage: Any) -> tuple[list[Any], list[str]]:
        """Mesh prims in the order of the stage, and notes about all other prims."""
        geom, usd = self._module("UsdGeom"), self._module("Usd")
        prims, left_out, hidden, others, subdivided, holes, flickering = [], [], [], set(), 0, 0, 0
        walk = iter(usd.PrimRange.Stage(stage, usd.TraverseInstanceProxies()))
        for prim in walk:
            if prim.IsA(geom.PointInstancer):
                others.add("PointInstancer")
                walk.PruneChildren()
            elif prim.IsA(geom.Mesh):
                if geom.Imageable(prim).ComputePurpose() in _LEFT_OUT:
                    left_out.append(str(prim.GetPath()))
                    continue
                if not (visible := self._visible(prim)).any():
                    hidden.append(str(prim.GetPath()))
                    continue
                self._check_not_skinned(prim)
                mesh = geom.Mesh(prim)
                subdivided += mesh.GetSubdivisionSchemeAttr().Get() != "none"
                holes += bool(mesh.GetHoleIndicesAttr().Get())
                flickering += not visible.all()
                prims.append(prim)
            elif prim.IsA(geom.Gprim):
                others.add(str(prim.GetTypeName()))
        notes = []
        if others:
            notes.append(f"prims that are not meshes are left out: {', '.join(sorted(others))}")
        if left_out:
            notes.append(f"meshes of purpose guide or proxy are left out: {shortened(', '.join(left_out))}")
        if hidden:
            notes.append(f"invisible meshes are left out: {shortened(', '.join(hidden))}")
        if flickering:
            notes.append(f"meshes that are invisible for a while ({flickering}) are in all frames")
        if subdivided:
            notes.append(f"subdivision surfaces ({subdivided}): their control meshes are used")
        if holes:
            notes.append(f"holes of meshes ({holes}) are filled")
        return prims, notes

    def _check_not_skinned(self, prim: Any) -> None:
        for name in ("primvars:skel:jointIndices", "skel:blendShapes"):
            if prim.GetAttribute(name).HasAuthoredValue():
                raise SequenceError(
                    f"{self._path}: {prim.GetPath()} is moved by a skeleton or blend shapes; bake it into points"
                )

    def _visible(self, prim: Any) -> NDArray[np.bool_]:
        """Whether a mesh is visible, at each time at which that changes."""
        geom, time = self._module("UsdGeom"), self._module("Usd").TimeCode
        times = [time.EarliestTime()]
        above = prim
        while above and not above.IsPseudoRoot():
            if imageable := geom.Imageable(above):
                times += map(time, imageable.GetVisibilityAttr().GetTimeSamples())
            above = above.GetParent()
        return np.array([geom.Imageable(prim).ComputeVisibility(at) != "invisible" for at in times])

    def _samples(self, prim: Any) -> set[float]:
        """Times at which a mesh or one of its transforms has a sample."""
        geom = self._module("UsdGeom")
        mesh = geom.Mesh(prim)
        times: set[float] = set()
        for attribute in (mesh.GetPointsAttr(), mesh.GetFaceVertexCountsAttr(), mesh.GetFaceVertexIndicesAttr()):
            times.update(attribute.GetTimeSamples())
        while prim and not prim.IsPseudoRoot():
            if xformable := geom.Xformable(prim):
                times.update(xformable.GetTimeSamples())
                if xformable.GetResetXformStack():
                    break
            prim = prim.GetParent()
        return times

    def _read(self, index: int) -> tuple[str, tuple[SequenceMesh, ...], NDArray[np.float64]]:
        geom, usd, stage = self._module("UsdGeom"), self._module("Usd"), self._stage()
        time = usd.TimeCode(self._times[index]) if self._times else usd.TimeCode.Default()
        cache = geom.XformCache(time)
        meshes, positions = [], []
        for name, path in self._prims.items():
            mesh = geom.Mesh(stage.GetPrimAtPath(path))
            points = self._points(mesh, time)
            meshes.append(self._mesh(name, mesh, points, time))
            matrix = np.array(cache.GetLocalToWorldTransform(mesh.GetPrim()))
            if (matrix != np.eye(4)).any():
                points = sum((points[:, k, None] * matrix[k, :3] for k in range(3)), matrix[3, :3])
            positions.append(points * self._unit if self._unit != 1 else points)
        self._opened["meshes"] = same = same_or(self._opened.get("meshes"), tuple(meshes))
        label = f"{self._path.name} @ {self._times[index]:.12g}" if self._times else self._path.name
        return label, same, np.concatenate(positions)

    def _points(self, mesh: Any, time: Any) -> NDArray[np.float64]:
        """(V, 3) in the mesh's own coordinates."""
        points = mesh.GetPointsAttr().Get(time)
        if not points:
            raise SequenceError(f"{self._path}: {mesh.GetPath()} has no points at time {time}; export it again")
        return np.array(points, np.float64)

    def _mesh(self, name: str, mesh: Any, points: NDArray[np.float64], time: Any) -> SequenceMesh:
        """Polygons are split by their shape in the first frame wherever it has the same, as in MeshFolder."""
        counts, corners = self._polygons(mesh, time)
        last: tuple[NDArray[np.int64], NDArray[np.int64], SequenceMesh] | None = self._opened.get(f"settled {name}")
        if (
            last is not None
            and last[2].n_vertices == len(points)
            and _equal(counts, last[0])
            and _equal(corners, last[1])
        ):
            return last[2]
        is_settled = not (counts > 3).any() or not self._times
        if not is_settled:
            first = self._module("Usd").TimeCode(self._times[0])
            shape, then = self._points(mesh, first), self._polygons(mesh, first)
            if len(shape) == len(points) and _equal(counts, then[0]) and _equal(corners, then[1]):
                points, is_settled = shape, True
        what = f"{self._path}: {mesh.GetPath()}"
        try:
            faces = checked_polygons(what, points, corners, counts).triangles().astype(np.uint32)
        except SequenceError:
            raise
        except MeshFileError as error:
            raise SequenceError(f"{what}: {error}") from error
        if mesh.GetOrientationAttr().Get() == "leftHanded":
            faces = faces[:, [0, 2, 1]]
        made = SequenceMesh(name, np.ascontiguousarray(faces), len(points))
        if is_settled:
            self._opened[f"settled {name}"] = counts, corners, made
        return made

    def _polygons(self, mesh: Any, time: Any) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """(counts, corners)."""
        counts, corners = mesh.GetFaceVertexCountsAttr().Get(time), mesh.GetFaceVertexIndicesAttr().Get(time)
        if not counts or not corners:
            raise SequenceError(f"{self._path}: {mesh.GetPath()} has no faces; export the surface, not only points")
        return np.array(counts, np.int64), np.array(corners, np.int64)


def _equal(a: NDArray[np.int64], b: NDArray[np.int64]) -> bool:
    return a is b or np.array_equal(a, b)


def _line(error: object) -> str:
    return shortened(" ".join(str(error).split()))
