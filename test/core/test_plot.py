# SPDX-License-Identifier: Apache-2.0
"""hpccd_core.plot: what PyVista and Polyscope are given, off the screen."""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import hpccd_core as hc

SHEET, BALL = hc.shapes.grid(12, 12), hc.shapes.icosphere(4)


def scene():
    scene = hc.Scene()
    scene.add_mesh("sheet", SHEET[1])
    scene.add_mesh("ball", BALL[1], static=True)
    scene.add_plane("floor", offset=-2.0)
    return scene


def frame(height):
    return np.concatenate([SHEET[0] + [0, 0, height], BALL[0]])


@pytest.fixture(scope="module")
def step():
    """A detector, its contacts, and the positions at the end of the step."""
    detector = hc.Detector(scene(), outputs=("points", "normals"))
    return detector, detector.detect(frame(1.1), frame(0.8)), frame(0.8)


@pytest.fixture
def pyvista():
    pyvista = pytest.importorskip("pyvista", reason="PyVista comes with the extra plot")
    before, pyvista.OFF_SCREEN = pyvista.OFF_SCREEN, True
    yield pyvista
    pyvista.OFF_SCREEN = before
    pyvista.close_all()


def drawn(pyvista, plotter, name):
    """The data set of an actor."""
    mapper = plotter.actors[name].mapper
    mapper.Update()
    return pyvista.wrap(mapper.GetInput())


def test_in_pyvista(step, pyvista):
    detector, contacts, x = step
    plotter = hc.plot(contacts, x, detector.faces)
    data = {name: drawn(pyvista, plotter, name) for name in ("sheet", "ball", "contacts", "normals")}
    np.testing.assert_array_equal(data["sheet"].points, x[: len(SHEET[0])])
    np.testing.assert_array_equal(data["ball"].regular_faces, BALL[1])
    np.testing.assert_array_equal(data["contacts"].points, contacts.points)
    np.testing.assert_array_equal(data["contacts"]["time of impact"], contacts._values("toc"))
    some = contacts.normals.any(1)
    assert 0 < (~some).sum() < 20 and some.sum() > 50, "some edges are parallel"
    arrows = data["normals"].points.reshape(some.sum(), -1, 3) - contacts.points[some][:, None]
    lengths = np.einsum("ijk,ik->ij", arrows, contacts.normals[some]).max(1)
    np.testing.assert_allclose(lengths, lengths[0], rtol=1e-3, err_msg="each along its normal")


def test_pixels_of_pyvista(step, pyvista):
    detector, contacts, x = step
    images = []
    for found in (contacts, hc.Contacts.none(outputs=("points",), layout=contacts.layout)):
        plotter = hc.plot(found, x, detector.faces)
        images.append(plotter.screenshot(None, return_img=True, window_size=(300, 200)).astype(int))
    assert images[0].shape == (200, 300, 3) and (np.abs(images[0] - images[1]).max(2) > 60).sum() > 200


IN_POLYSCOPE = """
import polyscope as ps
import hpccd_core as hc
from test_plot import frame, scene

ps.init("openGL_mock")
detector = hc.Detector(scene(), outputs=("points", "normals"))
x, contacts = frame(0.8), detector.detect(frame(1.1), frame(0.8))
assert hc.plot(contacts, x, detector.faces, backend="polyscope") is ps
sheet, ball, points = ps.get_surface_mesh("sheet"), ps.get_surface_mesh("ball"), ps.get_point_cloud("contacts")
print(sheet.n_vertices(), ball.n_faces(), points.n_points() == len(contacts) > 50)
none = hc.Contacts.none(outputs=("points",), layout=contacts.layout)
hc.plot(none, x, backend="polyscope")
print(ps.has_point_cloud("contacts"), ps.get_point_cloud("sheet").n_points())
"""


def test_in_polyscope(tmp_path):
    """In a folder of its own: Polyscope writes files when it ends."""
    pytest.importorskip("polyscope", reason="Polyscope is not installed")
    paths = os.pathsep.join([str(Path(__file__).parent), str(Path(hc.__file__).parents[1])])
    environment = {**os.environ, "PYTHONPATH": paths}
    command = [sys.executable, "-c", IN_POLYSCOPE]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=60)
    n, n_ball = len(SHEET[0]), len(BALL[1])
    assert done.stdout.splitlines()[1:] == [f"{n} {n_ball} True", f"False {n}"], done.stdout + done.stderr


def test_positions_by_mesh_without_faces_and_normals(step, pyvista):
    _, contacts, x = step
    plain = hc.Detector(scene(), outputs="points").detect(frame(1.1), x)
    plotter = hc.plot(plain, {"sheet": x[: len(SHEET[0])], "ball": BALL[0]})
    assert "normals" not in plotter.actors
    np.testing.assert_array_equal(drawn(pyvista, plotter, "ball").points, BALL[0])


def test_a_mesh_with_the_name_of_what_is_drawn(pyvista):
    scene = hc.Scene()
    (sheet, sheet_faces), (ball, ball_faces) = hc.shapes.grid(4, 4), hc.shapes.icosphere(2)
    scene.add_mesh("contacts", sheet_faces)
    scene.add_mesh("normals", ball_faces)
    of_both = hc.Detector(scene, outputs=("points", "normals"))
    start, end = (np.concatenate([sheet + [0, 0, z], ball]) for z in (1.1, 0.9))
    plotter = hc.plot(of_both.detect(start, end), end, of_both.faces)
    assert {"contacts", "normals", "mesh contacts", "mesh normals"} <= set(plotter.actors)
    with pytest.raises(ValueError, match=r"faces: \[0, 1, 30\] belongs to several meshes; give those of the scene"):
        hc.plot(of_both.detect(start, end), end, [[0, 1, 30]])


def test_import_of_the_core_imports_neither():
    program = "import sys, hpccd_core as hc; hc.plot; print(sorted({'pyvista', 'polyscope', 'vtk'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    assert done.stdout == "[]\n", done.stderr


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        (
            {"backend": "pyvsta"},
            ValueError,
            "backend: 'pyvsta' is not known; use one of pyvista, polyscope; did you mean",
        ),
        ({"contacts": 3}, TypeError, "contacts: expected hpccd_core.Contacts, got int"),
        ({"contacts": hc.Contacts.none(worlds=2)}, ValueError, "give contacts.world(k) and vertices[k]"),
        ({"contacts": hc.Contacts.none()}, ValueError, "contacts: has no layout of meshes"),
        ({"vertices": np.zeros((3, 3))}, ValueError, "vertices: expected shape (331, 3)"),
        ({"faces": [[0, 1, 331]]}, ValueError, "faces: names vertex 331, and there are 331"),
    ],
)
def test_mistakes_are_explained(step, change, error, message):
    detector, contacts, x = step
    given = {"contacts": contacts, "vertices": x, "faces": detector.faces} | change
    with pytest.raises(error, match=re.escape(message)):
        hc.plot(given.pop("contacts"), given.pop("vertices"), **given)


def test_contacts_without_points(step, pyvista):
    contacts = hc.Detector(scene()).detect(frame(1.1), frame(0.8))
    with pytest.raises(hc.OutputNotComputed, match=re.escape("outputs=('points',)")):
        hc.plot(contacts, frame(0.8))


@pytest.mark.parametrize(("backend", "remedy"), [("pyvista", "'hpccd-core[plot]'"), ("polyscope", "polyscope")])
def test_without_the_library(step, monkeypatch, backend, remedy):
    monkeypatch.setitem(sys.modules, backend, None)
    with pytest.raises(ModuleNotFoundError, match=re.escape(f"pip install {remedy}")):
        hc.plot(step[1], step[2], backend=backend)
