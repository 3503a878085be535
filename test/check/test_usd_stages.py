# SPDX-License-Identifier: Apache-2.0
"""USD: transforms, units, time samples, topology, and prims that are left out."""

import os

import numpy as np
import pytest

from hpccd_core.sequences import open_sequence

Usd = pytest.importorskip("pxr.Usd", reason="reading USD needs the extra check")
from pxr import Gf, UsdGeom  # noqa: E402

SQUARE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]


def stage_of(path, unit=1.0):
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageMetersPerUnit(stage, unit)
    return stage


def add(stage, path, points=SQUARE, counts=(4,), corners=(0, 1, 2, 3), times=()):
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.GetFaceVertexCountsAttr().Set(list(counts))
    mesh.GetFaceVertexIndicesAttr().Set(list(corners))
    mesh.GetSubdivisionSchemeAttr().Set("none")
    for time in times:
        mesh.GetPointsAttr().Set([(x, y, z + time) for x, y, z in points], time)
    if not times:
        mesh.GetPointsAttr().Set(points)
    return mesh


def frames(path):
    sequence = open_sequence(path)
    return sequence, [sequence.frame(k) for k in range(len(sequence))]


@pytest.mark.parametrize("suffix", ["usd", "usda", "usdc"])
def test_frames_are_the_samples_of_points_and_transforms(suffix, tmp_path):
    stage = stage_of(tmp_path / f"a.{suffix}")
    group = UsdGeom.Xform.Define(stage, "/group")
    move = group.AddTranslateOp()
    move.Set(Gf.Vec3d(0, 0, 0), 2.0)
    move.Set(Gf.Vec3d(10, 0, 0), 4.0)
    add(stage, "/group/cloth", times=(0.0, 2.5))
    add(stage, "/floor")
    stage.Save()
    sequence, found = frames(tmp_path / f"a.{suffix}")
    assert [frame.name for frame in found] == [f"a.{suffix} @ {time}" for time in (0, 2, 2.5, 4)]
    assert [mesh.name for mesh in found[0].meshes] == ["cloth", "floor"]
    # USD interpolates points and transforms linearly, and holds them before the first sample and after the last one.
    assert [frame.vertices[2].tolist() for frame in found] == [[1, 1, 0], [1, 1, 2], [3.5, 1, 2.5], [11, 1, 2.5]]
    assert all(frame.meshes is found[0].meshes and frame.vertices[6].tolist() == [1, 1, 0] for frame in found)
    assert sequence.notes == ("units: 1 unit = 1 m", "the Y axis points up; transforms of the stage are applied")


def test_stacks_of_transforms(tmp_path):
    stage = stage_of(tmp_path / "a.usda")
    outer = UsdGeom.Xform.Define(stage, "/outer")
    outer.AddTranslateOp().Set(Gf.Vec3d(1, 2, 3))
    outer.AddRotateZOp().Set(90.0)
    outer.AddScaleOp().Set(Gf.Vec3f(2, 2, 2))
    inner = UsdGeom.Xform.Define(stage, "/outer/inner")
    inner.AddTranslateOp().Set(Gf.Vec3d(5, 0, 0))
    add(stage, "/outer/inner/moved")
    alone = add(stage, "/outer/inner/alone")
    alone.AddTranslateOp().Set(Gf.Vec3d(0, 0, 7))
    alone.SetResetXformStack(True)
    stage.Save()
    _, (frame,) = frames(tmp_path / "a.usda")
    # (x, y, z) -> translate by (5, 0, 0), scale by 2, (x, y) -> (-y, x), translate by (1, 2, 3).
    expected = [(1 - 2 * y, 2 + 2 * (x + 5), 3 + 2 * z) for x, y, z in SQUARE]
    assert np.allclose(frame.vertices[4:], expected, rtol=0, atol=1e-12)
    assert frame.vertices[:4].tolist() == [[x, y, 7] for x, y, _ in SQUARE]


@pytest.mark.parametrize("unit", [0.01, 0.0254, 1000.0])
def test_positions_are_in_metres(unit, tmp_path):
    stage = stage_of(tmp_path / "a.usda", unit)
    add(stage, "/cloth", [(0, 0, 0), (3, 0, 0), (1, 1, 0), (0, 1, 0)])
    UsdGeom.SetStageUpAxis(stage, "Z")
    stage.Save()
    sequence, (frame,) = frames(tmp_path / "a.usda")
    assert frame.vertices[1].tolist() == [3 * unit, 0, 0]
    assert sequence.up == "z" == open_sequence(tmp_path / "a.usda", split=True).up
    assert sequence.notes == (
        f"units: 1 unit = {unit:g} m, positions are scaled to metres",
        "the Z axis points up; transforms of the stage are applied",
    )


def test_a_stage_without_units_has_those_of_usd(tmp_path):
    stage = Usd.Stage.CreateNew(str(tmp_path / "a.usda"))
    add(stage, "/cloth")
    stage.Save()
    sequence, (frame,) = frames(tmp_path / "a.usda")
    assert frame.vertices[1].tolist() == [0.01, 0, 0] and frame.name == "a.usda"
    assert sequence.notes[0].startswith("units: 1 unit = 0.01 m (the default of USD: the file states none)")


def test_left_handed_faces_are_turned(tmp_path):
    stage = stage_of(tmp_path / "a.usda")
    add(stage, "/cloth").GetOrientationAttr().Set("leftHanded")
    stage.Save()
    _, (frame,) = frames(tmp_path / "a.usda")
    assert frame.meshes[0].faces.tolist() == [[0, 2, 1], [0, 3, 2]]


def test_polygons_are_split_as_in_the_first_frame(tmp_path):
    pytest.importorskip("mapbox_earcut", reason="dented polygons need the extra meshes")
    stage = stage_of(tmp_path / "a.usda")
    mesh = add(stage, "/cloth")
    for time, dent in ((1, 0.25), (2, 1), (3, 2)):
        mesh.GetPointsAttr().Set([(0, 0, 0), (dent, 1 - dent, 0), (1, 1, 0), (0, 1, 0)], time)
    stage.Save()
    sequence, found = frames(tmp_path / "a.usda")
    dented = found[0].meshes[0].faces.tolist()
    assert dented != [[0, 1, 2], [0, 2, 3]] and all(frame.meshes is found[0].meshes for frame in found)
    assert open_sequence(tmp_path / "a.usda").frame(2).meshes[0].faces.tolist() == dented


def test_topology_that_changes(tmp_path):
    stage = stage_of(tmp_path / "a.usda")
    mesh = UsdGeom.Mesh.Define(stage, "/cloth")
    for time, n in ((0.0, 3), (1.0, 3), (2.0, 4)):
        mesh.GetFaceVertexCountsAttr().Set([n], time)
        mesh.GetFaceVertexIndicesAttr().Set(list(range(n)), time)
        mesh.GetPointsAttr().Set(SQUARE[:n], time)
    stage.Save()
    _, found = frames(tmp_path / "a.usda")
    assert found[0].meshes is found[1].meshes and found[1].meshes is not found[2].meshes
    assert [len(frame.vertices) for frame in found] == [3, 3, 4]
    assert [len(frame.meshes[0].faces) for frame in found] == [1, 1, 2]


def test_prims_that_are_left_out_are_named(tmp_path):
    stage = stage_of(tmp_path / "a.usda")
    add(stage, "/cloth").GetSubdivisionSchemeAttr().Set("catmullClark")
    add(stage, "/render/guide").GetPurposeAttr().Set("guide")
    add(stage, "/proxy").GetPurposeAttr().Set("proxy")
    add(stage, "/group/hidden")
    UsdGeom.Xform.Define(stage, "/group").MakeInvisible()
    blinking = add(stage, "/blinking")
    for time, visibility in ((0.0, "invisible"), (1.0, "inherited")):
        blinking.GetVisibilityAttr().Set(visibility, time)
    blinking.GetHoleIndicesAttr().Set([0])
    UsdGeom.Sphere.Define(stage, "/ball")
    instancer = UsdGeom.PointInstancer.Define(stage, "/grass")
    add(stage, "/grass/prototypes/blade")
    instancer.CreatePrototypesRel().AddTarget("/grass/prototypes/blade")
    stage.Save()
    sequence, (frame,) = frames(tmp_path / "a.usda")
    assert [mesh.name for mesh in frame.meshes] == ["blinking", "cloth"]
    assert sequence.notes[2:] == (
        "prims that are not meshes are left out: PointInstancer, Sphere",
        "meshes of purpose guide or proxy are left out: /render/guide, /proxy",
        "invisible meshes are left out: /group/hidden",
        "meshes that are invisible for a while (1) are in all frames",
        "subdivision surfaces (1): their control meshes are used",
        "holes of meshes (1) are filled",
    )


def test_a_file_that_was_written_again(tmp_path):
    """USD shares the layers of a process, and sequences keep their stages open for a while."""
    path, text = tmp_path / "a.usda", tmp_path / "b.usda"
    for x, file in ((0, path), (5, text)):
        stage = stage_of(file)
        add(stage, "/m", [(x, y, z) for x, y, z in np.array(SQUARE, float) + [x, 0, 0]])
        stage.Save()
    before = open_sequence(path)
    assert before.frame(0).vertices.max() == 1
    del stage
    path.write_text(text.read_text())
    os.utime(path, (2e9, 2e9))
    assert open_sequence(path).frame(0).vertices.max() == 6


def test_references_and_instances(tmp_path):
    asset = stage_of(tmp_path / "asset.usda")
    root = UsdGeom.Xform.Define(asset, "/asset")
    add(asset, "/asset/mesh", times=(0.0, 1.0))
    asset.SetDefaultPrim(root.GetPrim())
    asset.Save()
    stage = stage_of(tmp_path / "a.usda")
    for k in range(2):
        xform = UsdGeom.Xform.Define(stage, f"/copy{k}")
        xform.GetPrim().GetReferences().AddReference("./asset.usda")
        xform.GetPrim().SetInstanceable(True)
        xform.AddTranslateOp().Set(Gf.Vec3d(10 * k, 0, 0))
    stage.Save()
    _, found = frames(tmp_path / "a.usda")
    assert len(found) == 2 and [mesh.name for mesh in found[0].meshes] == ["/copy0/mesh", "/copy1/mesh"]
    assert found[1].vertices[[2, 6]].tolist() == [[1, 1, 1], [11, 1, 1]]
