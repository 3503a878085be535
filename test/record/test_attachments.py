# SPDX-License-Identifier: Apache-2.0
"""The files of a description, possibly untrusted, that a recording contains."""

import os
import re

import pytest

from hpccd_ros.record import attachments

VALUES = {"description": "robot_description", "geometry": "collision", "srdf": ""}


def description(uri):
    shape = f'<collision><geometry><mesh filename="{uri}"/></geometry></collision>'
    return f'<robot name="r"><link name="a">{shape}</link></robot>'


def test_mesh_files_are_attached(tmp_path):
    file = tmp_path / "a.stl"
    file.write_bytes(b"any")
    for uri in (str(file), f"file://{file}"):
        ((name, data),), missing = attachments.link_meshes("arm", VALUES, description(uri))
        assert re.fullmatch("robot/arm/mesh/[0-9a-f]{16}/a.stl", name) and (data, missing) == (b"any", [])
        assert name == attachments.link_mesh_name("arm", uri)


@pytest.mark.parametrize("encoding", ["utf-8", "iso-8859-1", "utf-16"])
def test_mesh_files_of_a_description_in_another_encoding_are_attached(tmp_path, encoding):
    (tmp_path / "hüfte.stl").write_bytes(b"any")
    file = tmp_path / "r.urdf"
    file.write_bytes(f'<?xml version="1.0" encoding="{encoding}"?>{description("hüfte.stl")}'.encode(encoding))
    found, missing = attachments.files({"meshes": [], "robots": ["arm"], "robot.arm.description": str(file)})
    assert [name.rpartition("/")[2] for name, _ in found] == ["description.urdf", "hüfte.stl"] and not missing


@pytest.mark.parametrize(
    "uri",
    [
        "{}/secret",
        "{}/pipe.stl",
        "{}/folder.stl",
        "~nobody-is-called-so/a.stl",
        "file://{}/%00.stl",
        "{}/" + 300 * "a" + ".stl",
    ],
)
def test_nothing_else_is_read(tmp_path, uri):
    (tmp_path / "secret").write_text("not for others")
    os.mkfifo(tmp_path / "pipe.stl")  # whoever reads it waits for ever
    (tmp_path / "folder.stl").mkdir()
    found, missing = attachments.link_meshes("arm", VALUES, description(uri.format(tmp_path)))
    assert found == []
    assert len(missing) == 1 and "is not in the recording" in missing[0]


def test_warnings_about_untrusted_text_are_short():
    (text,) = attachments.link_meshes("arm", VALUES, description("/" + 100_000 * "a" + ".stl"))[1]
    assert len(text) < 1000


def test_a_home_folder_that_there_is_not_ends_nothing():
    parameters = {"meshes": ["cloth"], "mesh.cloth.file": "~nobody-is-called-so/cloth.stl"}
    found, missing = attachments.files(parameters)
    assert found == [] and "is not in the recording" in missing[0]


def test_how_many_files_a_description_names_is_bounded(tmp_path):
    file = tmp_path / "a.stl"
    file.write_bytes(b"any")
    shapes = "".join(
        f'<collision><geometry><mesh filename="{"/" * k}{file}"/></geometry></collision>'
        for k in range(attachments.MOST_FILES + 5)
    )
    found, missing = attachments.link_meshes("arm", VALUES, f'<robot name="r"><link name="a">{shapes}</link></robot>')
    assert len(found) == attachments.MOST_FILES
    assert missing == ["robot arm names more than 1000 mesh files: only these are in the recording"]
