# SPDX-License-Identifier: Apache-2.0
"""Robots of files on this machine."""

import pytest

from hpccd_ros.middleware import robot_files
from hpccd_ros.robots.errors import RobotError


@pytest.mark.parametrize(
    "path", ["robots/arm.urdf", "./robots/arm.urdf", "{}/robots/arm.urdf", "file://{}/robots/arm.urdf"]
)
def test_relative_mesh_files_lie_beside_the_description_however_it_is_named(tmp_path, monkeypatch, path):
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "robots"
    folder.mkdir()
    (folder / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    shape = '<collision><geometry><mesh filename="a.obj"/></geometry></collision>'
    (folder / "arm.urdf").write_text(f'<robot name="r"><link name="a">{shape}</link></robot>')
    path = path.format(tmp_path)
    values = {"geometry": "collision", "tolerance": 1e-3}
    robot = robot_files.robot_of("arm", values, robot_files.text_of(path), None, robot_files.resolver(path))
    assert [len(mesh.topology.faces) for mesh in robot.meshes] == [1]


def test_a_missing_file_is_named_with_where_a_relative_path_starts(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(RobotError, match=f"^arm.urdf: no such file; correct the path, which starts at {tmp_path}$"):
        robot_files.text_of("arm.urdf")
    with pytest.raises(RobotError, match="/arm.urdf: no such file; correct the path$"):
        robot_files.text_of(f"{tmp_path}/arm.urdf")
