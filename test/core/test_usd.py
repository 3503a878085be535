# SPDX-License-Identifier: Apache-2.0
"""hpccd_core.usd: what pxr reads back is what the contacts hold."""

import re
import sys

import numpy as np
import pytest

import hpccd_core as hc
from hpccd_core.usd import export_contacts

pytest.importorskip("pxr", reason="usd-core comes with the extra usd")

from pxr import Usd, UsdGeom

OUTPUTS = ("points", "normals")
FLOAT = dict(rtol=0, atol=1e-6)


def scene():
    """A sheet, a ball and points that fall on a floor."""
    scene = hc.Scene()
    scene.add_mesh("sheet", hc.shapes.grid(6, 6)[1])
    scene.add_mesh("ball", hc.shapes.icosphere(2)[1], static=True)
    scene.add_points("grains", 2, thickness=0.3)
    scene.add_plane("floor", offset=-0.2)
    return scene


def frames(heights):
    sheet, ball = hc.shapes.grid(6, 6)[0], hc.shapes.icosphere(2)[0]
    grains = np.array([[2.0, 0, 0.5], [2.5, 0, 0.6]])
    return [np.concatenate([sheet + [0, 0, z], ball, grains * [z, 1, z]]) for z in heights]


@pytest.fixture(scope="module")
def steps():
    detector = hc.Detector(scene(), outputs=OUTPUTS)
    return [detector.step(x) for x in frames((1.6, 1.3, 0.9, 0.6, -0.3))][1:]


def primvar(points, name, code):
    return np.array(UsdGeom.PrimvarsAPI(points).GetPrimvar(name).Get(code))


@pytest.mark.parametrize("ending", ["usda", "usdc", "usd"])
def test_what_is_read_back(tmp_path, steps, ending):
    path = tmp_path / f"contacts.{ending}"
    export_contacts(path, steps, time_codes=[10, 11, 12, 20], width=0.02, up_axis="Y", meters_per_unit=0.01)
    stage = Usd.Stage.Open(str(path))
    assert UsdGeom.GetStageUpAxis(stage) == "Y" and UsdGeom.GetStageMetersPerUnit(stage) == 0.01
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (10, 20)
    points = UsdGeom.Points(stage.GetDefaultPrim())
    assert points.GetPointsAttr().GetTimeSamples() == [10, 11, 12, 20]
    kinds = UsdGeom.PrimvarsAPI(points).GetPrimvar("kindNames").Get()
    meshes = UsdGeom.PrimvarsAPI(points).GetPrimvar("meshNames").Get()
    assert list(meshes) == ["sheet", "ball", "grains", "floor"]
    seen = set()
    for code, step in zip((10, 11, 12, 20), steps, strict=True):
        assert len(points.GetPointsAttr().Get(code)) == len(step)
        np.testing.assert_allclose(np.array(points.GetPointsAttr().Get(code)).reshape(-1, 3), step.points, **FLOAT)
        np.testing.assert_allclose(np.array(points.GetNormalsAttr().Get(code)).reshape(-1, 3), step.normals, **FLOAT)
        np.testing.assert_allclose(primvar(points, "toc", code), step._values("toc"), **FLOAT)
        assert primvar(points, "meshA", code).tolist() == step.mesh_a.tolist()
        assert primvar(points, "meshB", code).tolist() == step.mesh_b.tolist()
        assert not primvar(points, "world", code).any()
        features = primvar(points, "features", code).reshape(-1, 4).tolist()
        named = [kinds[int(k)] for k in primvar(points, "kind", code)]
        expected = [
            (name, row + [-1] * (4 - len(row)))
            for kind, name in zip(("vf", "ee", "vp", "vv", "ve"), kinds, strict=True)
            for row in getattr(step, kind).tolist()
        ]
        assert list(zip(named, features, strict=True)) == expected
        seen |= set(named)
        red, _, blue = primvar(points, "displayColor", code).reshape(-1, 3).T
        np.testing.assert_allclose(red, step._values("toc"), **FLOAT)
        np.testing.assert_allclose(red + blue, 1, **FLOAT)
        low, high = np.array(points.GetExtentAttr().Get(code))
        if len(step):
            assert (low <= step.points.min(0)).all() and (high >= step.points.max(0)).all()
    assert seen == {"vertex-face", "edge-edge", "vertex-plane", "vertex-vertex"}
    assert UsdGeom.PrimvarsAPI(points).GetPrimvar("features").GetElementSize() == 4
    assert points.GetWidthsInterpolation() == "constant" and list(points.GetWidthsAttr().Get()) == [np.float32(0.02)]


def test_one_step_and_no_steps(tmp_path, steps):
    path = tmp_path / "one.usda"
    export_contacts(path, steps[-1], prim="/World/Contacts")
    stage = Usd.Stage.Open(str(path))
    assert stage.GetDefaultPrim().GetPath() == "/World"
    points = UsdGeom.Points(stage.GetPrimAtPath("/World/Contacts"))
    assert points.GetPointsAttr().GetTimeSamples() == [0]
    export_contacts(tmp_path / "none.usda", [])
    stage = Usd.Stage.Open(str(tmp_path / "none.usda"))
    points = UsdGeom.Points(stage.GetPrimAtPath("/Contacts"))
    assert points.GetPointsAttr().GetTimeSamples() == []


def test_worlds(tmp_path):
    x = np.stack(frames((1.1, 0.9)))
    detector = hc.Detector(scene(), worlds=2, outputs=OUTPUTS)
    contacts = detector.detect(x, x - [[[0, 0, 0.3]]] * (np.arange(x.shape[1]) < 49)[None, :, None])
    export_contacts(tmp_path / "worlds.usdc", contacts)
    stage = Usd.Stage.Open(str(tmp_path / "worlds.usdc"))
    points = UsdGeom.Points(stage.GetDefaultPrim())
    counts = np.bincount(primvar(points, "world", 0), minlength=2)
    assert counts.tolist() == [len(contacts.world(k)) for k in range(2)] and counts.min() > 0


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"path": "contacts.obj"}, ValueError, "path: 'contacts.obj' is no USD file; use the ending .usda"),
        ({"path": "missing/contacts.usda"}, OSError, "does not exist; create it first"),
        ({"path": "folder.usda"}, OSError, "path: cannot write"),
        ({"prim": "Contacts"}, ValueError, "prim: 'Contacts' is no path of a prim; give one such as '/Contacts'"),
        ({"prim": "/"}, ValueError, "prim: '/' is no path of a prim"),
        ({"up_axis": "X"}, ValueError, "up_axis: 'X' is not known; use one of Y, Z"),
        ({"time_codes": [1]}, ValueError, "time_codes: expected 4, one for each step, got 1"),
        ({"time_codes": [1, 2, 2, 3]}, ValueError, "time_codes: must increase from step to step"),
        ({"time_codes": [0, 1, 2, np.nan]}, ValueError, "time_codes: must be finite"),
        ({"time_codes": 3}, TypeError, "time_codes: expected 4 numbers, one for each step, got int"),
        ({"meters_per_unit": 0}, ValueError, "meters_per_unit: must be greater than 0"),
        ({"prim": None}, TypeError, "prim: expected a string, got NoneType"),
        ({"contacts": None}, TypeError, "contacts: expected hpccd_core.Contacts or several, got NoneType"),
        ({"contacts": [1]}, TypeError, "contacts: expected hpccd_core.Contacts or several, got int"),
        ({"contacts": hc.Contacts.none()}, hc.OutputNotComputed, "outputs=('points',)"),
    ],
)
def test_mistakes_are_explained(tmp_path, steps, options, error, message):
    (tmp_path / "folder.usda").mkdir()
    given = {"path": "contacts.usda", "contacts": steps} | options
    with pytest.raises(error, match=re.escape(message)):
        export_contacts(tmp_path / given.pop("path"), given.pop("contacts"), **given)


def test_without_usd(tmp_path, steps, monkeypatch):
    monkeypatch.setitem(sys.modules, "pxr", None)
    with pytest.raises(ModuleNotFoundError, match=re.escape("pip install 'hpccd-core[usd]'")):
        export_contacts(tmp_path / "contacts.usda", steps)


def test_points_beyond_float32(tmp_path):
    detector, (start, end) = hc.Detector(scene(), outputs=OUTPUTS), np.stack(frames((1.1, 0.9))) * 1e100
    contacts = detector.detect(start, end)
    with pytest.raises(ValueError, match="contacts: USD stores points as float32, .* scale the scene down"):
        export_contacts(tmp_path / "far.usda", contacts)
