# SPDX-License-Identifier: Apache-2.0
"""Mesh files keep the numbering of the file, in which publishers send vertices."""

import builtins

import numpy as np
import pytest

from hpccd_ros.frames.mesh_file import MeshFileError, load_mesh, place

trimesh = pytest.importorskip("trimesh")

# Not sorted, with a vertex in no face (3) and a repeated position (4 = 0).
VERTICES = np.array([[2, 0, 0], [0, 1, 0], [1, 5, 0.125], [7, 7, 7], [2, 0, 0], [-0.0, 0, 3]], np.float64)
FACES = np.array([[2, 1, 0], [4, 5, 2], [1, 5, 0]])


def write_obj(path, extra=""):
    lines = [f"v {x} {y} {z}" for x, y, z in VERTICES] + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in FACES]
    path.write_text("\n".join(lines) + "\n" + extra)
    return str(path)


def test_obj(tmp_path):
    vertices, faces = load_mesh(write_obj(tmp_path / "m.obj"))
    assert np.array_equal(vertices, VERTICES) and np.array_equal(faces, FACES)
    assert vertices.dtype == np.float64 and faces.dtype == np.uint32


def test_obj_with_texture_and_normals_is_not_split(tmp_path):
    path = tmp_path / "m.obj"
    lines = [f"v {x} {y} {z}" for x, y, z in VERTICES] + [
        "vt 0 0",
        "vt 1 0",
        "vt 1 1",
        "vn 0 0 1",
        "vn 0 1 0",
    ]
    lines += ["f 3/1/1 2/2/2 1/3/1", "f 5/3/2 6/1/1 3/2/2", "f 2/1/1 6/2/2 1/1/1"]
    path.write_text("\n".join(lines) + "\n")
    vertices, faces = load_mesh(str(path))
    assert np.array_equal(vertices, VERTICES) and np.array_equal(faces, FACES)


@pytest.mark.parametrize("encoding", ["ascii", "binary"])
def test_ply(tmp_path, encoding):
    mesh = trimesh.Trimesh(VERTICES, FACES, process=False)
    path = tmp_path / "m.ply"
    path.write_bytes(mesh.export(file_type="ply", encoding=encoding))
    vertices, faces = load_mesh(str(path))
    assert np.array_equal(faces, FACES) and np.allclose(vertices, VERTICES)


def test_stl_corners_become_shared_vertices(tmp_path):
    box = trimesh.creation.box()
    path = tmp_path / "m.stl"
    path.write_bytes(box.export(file_type="stl"))
    vertices, faces = load_mesh(str(path))
    assert vertices.shape == (8, 3) and faces.shape == (12, 3)
    assert np.array_equal(vertices[faces], box.vertices[box.faces])
    assert faces[0].tolist() == [0, 1, 2], "numbered in order of first use"


def test_bad_files(tmp_path, monkeypatch):
    with pytest.raises(MeshFileError, match="no such file"):
        load_mesh(str(tmp_path / "none.obj"))
    with pytest.raises(MeshFileError, match=r"use one of .obj, .ply, .stl"):
        load_mesh(str(tmp_path / "m.step"))
    points = tmp_path / "points.obj"
    points.write_text("v 0 0 0\nv 1 0 0\n")
    with pytest.raises(MeshFileError, match=r"points.obj: (has no triangles|cannot be read)"):
        load_mesh(str(points))
    torn = tmp_path / "torn.ply"
    torn.write_bytes(b"ply\nformat binary_little_endian 1.0\nelement vertex 5\n")
    with pytest.raises(MeshFileError, match=r"torn.ply: cannot be read"):
        load_mesh(str(torn))
    far = tmp_path / "far.obj"
    far.write_text("v 0 0 0\nv 1 0 0\nv 0 1e151 0\nf 1 2 3\n")
    with pytest.raises(MeshFileError, match=r"far.obj: vertex 2 is .* must lie in"):
        load_mesh(str(far))
    for suffix, why in ((".stl", "neither a binary STL"), (".obj", "save it as UTF-8")):
        garbage = tmp_path / f"garbage{suffix}"
        garbage.write_bytes(bytes(range(128, 256)) * 8)
        with pytest.raises(MeshFileError, match=f"garbage{suffix}: (cannot be read: )?.*({why}|has no triangles)"):
            load_mesh(str(garbage))
    good = write_obj(tmp_path / "good.obj")
    real = builtins.__import__

    def without_trimesh(name, *args, **kwargs):
        if name == "trimesh":
            raise ImportError("No module named 'trimesh'")
        return real(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", without_trimesh)
    with pytest.raises(MeshFileError, match="pip install 'hpccd"):
        load_mesh(good)


@pytest.mark.parametrize(
    "path, why",
    [
        ("~nosuchuser/x.obj", "no such home folder; give the whole path"),
        (f"{'x' * 300}.obj", "File name too long"),
        (f"x.{'y' * 1000}", "use one of .obj"),
        (f"{'x/' * 5000}a.obj", "File name too long"),
        ("a\0b.obj", "no such file"),
        ("/", "use one of .obj"),
        ("/proc/self/mem.obj", "no such file"),
    ],
    ids=["nobody", "long-name", "long-suffix", "long-path", "nul", "root", "proc"],
)
def test_paths_that_cannot_be(path, why):
    with pytest.raises(MeshFileError, match=why) as caught:
        load_mesh(path)
    assert len(str(caught.value)) < 500


def test_pose():
    half = np.sqrt(0.5)
    assert place(VERTICES, [0, 0, 0, 0, 0, 0, 1]) is VERTICES, "no pose, no rounding"
    assert np.array_equal(place(VERTICES, [1, 2, 3, 0, 0, 0, 1]), VERTICES + [1, 2, 3])
    turned = place(VERTICES, [0, 0, 1, 0, 0, half, half])  # 90 degrees about z
    expected = np.stack([-VERTICES[:, 1], VERTICES[:, 0], VERTICES[:, 2] + 1], axis=1)
    assert np.allclose(turned, expected, atol=1e-15)
    with pytest.raises(MeshFileError, match="it must be 1"):
        place(VERTICES, [0, 0, 0, 0, 0, 0, 2])
    with pytest.raises(MeshFileError, match="7 finite numbers"):
        place(VERTICES, [0, 0, 0])
    with pytest.raises(MeshFileError, match="placed by it, vertex 0 is"):
        place(VERTICES, [0, 2e150, 0, 0, 0, 0, 1])
