# SPDX-License-Identifier: Apache-2.0
"""Shapes of a link become one mesh in its frame; mesh files are found by a resolver."""

from pathlib import Path

import numpy as np
import pytest

from hpccd_ros.middleware import robot_files
from hpccd_ros.robots import geometry, urdf
from hpccd_ros.robots.errors import RobotError
from hpccd_ros.robots.geometry import LinkMeshes, beside, no_files

OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


def link(*shapes):
    parts = "".join(f"<collision>{origin}<geometry>{s}</geometry></collision>" for s, origin in shapes)
    return urdf.parse(f'<robot name="r"><link name="a">{parts}</link></robot>').links[0]


def made(of, resolver=no_files):
    return LinkMeshes(resolver, 1e-3).of(of)


def test_shapes_are_placed_by_their_origins_and_become_one_mesh():
    vertices, faces = made(
        link(
            ('<box size="2 4 6"/>', '<origin xyz="10 0 0" rpy="0 0 1.5707963267948966"/>'),
            ('<cylinder radius="1" length="2"/>', '<origin rpy="0 1.5707963267948966 0"/>'),
        )
    )
    box, cylinder = vertices[:8], vertices[8:]
    assert box.min(axis=0) == pytest.approx([8, -1, -3]) and box.max(axis=0) == pytest.approx([12, 1, 3])
    assert np.abs(cylinder[:, 0]).max() == pytest.approx(1.0)  # its axis is along x now
    assert 1.0 < np.linalg.norm(cylinder[:, 1:], axis=1).max() <= 1.001
    assert faces.dtype == np.uint32 and faces[:12].max() == 7 and faces[12:].min() == 8
    assert faces.max() == len(vertices) - 1


def test_a_link_without_geometry_has_no_mesh():
    assert made(link()) is None


def test_mesh_files_are_scaled_read_once_and_placed(tmp_path):
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "a.obj").write_text(OBJ)
    asked = []

    def resolver(uri):
        asked.append(uri)
        return str(tmp_path / uri.removeprefix("package://p/"))

    mesh = '<mesh filename="package://p/meshes/a.obj" scale="2 -3 1"/>'
    vertices, faces = made(link((mesh, '<origin xyz="0 0 5"/>'), (mesh, "")), resolver)
    assert vertices.tolist() == [[0, 0, 5], [2, 0, 5], [0, -3, 5], [0, 0, 0], [2, 0, 0], [0, -3, 0]]
    assert faces.tolist() == [[0, 1, 2], [3, 4, 5]]
    assert asked == ["package://p/meshes/a.obj"]


def test_relative_paths_start_beside_the_description(tmp_path):
    (tmp_path / "a.obj").write_text(OBJ)
    relative = link(('<mesh filename="a.obj"/>', ""))
    vertices, _ = made(relative, beside(tmp_path, no_files))
    assert len(vertices) == 3
    assert beside(tmp_path, str.upper)("package://p/a") == "PACKAGE://P/A"
    assert beside(tmp_path, str.upper)("/x/a.obj") == "/X/A.OBJ"
    with pytest.raises(RobotError, match="link 'a': mesh a.obj: a relative path needs the folder"):
        made(relative, str)


@pytest.mark.parametrize("description", ["arm.urdf", "./arm.urdf", "robots/../arm.urdf"])
def test_the_description_itself_may_have_a_relative_path(tmp_path, monkeypatch, description):
    (tmp_path / "a.obj").write_text(OBJ)
    (tmp_path / "robots").mkdir()
    monkeypatch.chdir(tmp_path)
    vertices, _ = made(link(('<mesh filename="a.obj"/>', "")), robot_files.resolver(description))
    assert len(vertices) == 3


@pytest.mark.parametrize(
    "uri, resolver, message",
    [
        ("/nowhere/a.stl", str, r"URDF, line 1: link 'a': /nowhere/a.stl: no such file"),
        ("/nowhere/a.fbx", str, "link 'a': /nowhere/a.fbx: format '.fbx'; use one of"),
        ("package://p/a.stl", no_files, "link 'a': mesh 'package://p/a.stl': no files are read here"),
    ],
)
def test_what_is_wrong_with_a_file_names_the_link(uri, resolver, message):
    with pytest.raises(RobotError, match=message):
        made(link((f'<mesh filename="{uri}"/>', "")), resolver)


def test_coordinates_that_the_core_rejects_name_the_link():
    with pytest.raises(RobotError, match="link 'a': vertex 0 is"):
        made(link(('<box size="1 1 1"/>', '<origin xyz="1e300 0 0"/>')))


def test_the_triangles_of_a_robot_are_bounded(monkeypatch):
    monkeypatch.setattr(geometry, "MOST_TRIANGLES", 20)
    box = ('<box size="1 1 1"/>', "")
    assert made(link(box))
    with pytest.raises(RobotError, match="link 'a': more than 20 triangles up to here"):
        made(link(box, box))


def test_without_pycollada_the_package_is_named(tmp_path, monkeypatch):
    import sys

    (tmp_path / "a.dae").write_text("<COLLADA/>")
    (tmp_path / "a.obj").write_text(OBJ)
    monkeypatch.setitem(sys.modules, "collada", None)
    with pytest.raises(RobotError, match=r"link 'a': .*a\.dae: .* needs the Python package pycollada; install it with"):
        made(link(('<mesh filename="a.dae"/>', "")), beside(Path(tmp_path), no_files))
    assert made(link(('<mesh filename="a.obj"/>', "")), beside(Path(tmp_path), no_files))  # needs none
