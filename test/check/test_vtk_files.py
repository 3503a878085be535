# SPDX-License-Identifier: Apache-2.0
"""VTK and VTU: versions and encodings of the file, polygons, tetrahedra."""

import numpy as np
import pytest

import hpccd_core as hc
from hpccd_core import MeshFileError
from hpccd_core.sequences import open_sequence

# A triangle, a quad and a pentagon in one plane, and positions that float32 holds.
POINTS = np.array([(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0), (1, 1, 0), (2, 1, 0.5), (1, 2, 0), (0.5, 2.5, 0)])
POLYGONS = [(0, 1, 3), (1, 2, 4, 3), (3, 4, 6, 7)]
TRIANGLES = [[0, 1, 3], [1, 2, 4], [1, 4, 3], [3, 4, 6], [3, 6, 7]]


def frame_of(path):
    return open_sequence(path).frame(0)


def numbers(values, dtype, binary):
    values = np.asarray(values)
    return values.astype(dtype).tobytes() if binary else " ".join(map(str, values.reshape(-1).tolist())).encode()


@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize("version", ["3.0", "5.1"])
@pytest.mark.parametrize("kind", ["POLYDATA", "UNSTRUCTURED_GRID"])
@pytest.mark.parametrize("real, dtype", [("float", ">f4"), ("double", ">f8")])
def test_legacy_files(binary, version, kind, real, dtype, tmp_path):
    counts = [len(polygon) for polygon in POLYGONS]
    corners = np.concatenate(POLYGONS)
    section = "POLYGONS" if kind == "POLYDATA" else "CELLS"
    lines = [f"# vtk DataFile Version {version}\ntitle\n{'BINARY' if binary else 'ASCII'}\nDATASET {kind}".encode()]
    lines += [b"FIELD FieldData 1\nTimeValue 1 1 double", numbers([0.5], ">f8", binary)]
    lines += [f"POINTS {len(POINTS)} {real}".encode(), numbers(POINTS, dtype, binary)]
    lines += [b"METADATA\nINFORMATION 0\n"]
    if kind == "POLYDATA":
        old = (b"LINES 1 3", numbers([2, 0, 1], ">i4", binary))
        new = (b"LINES 2 2\nOFFSETS vtktypeint64", numbers([0, 2], ">i8", binary))
        lines += old if version == "3.0" else (*new, b"CONNECTIVITY vtktypeint64", numbers([0, 1], ">i8", binary))
    if version == "3.0":
        flat = np.concatenate([[len(polygon), *polygon] for polygon in POLYGONS])
        lines += [f"{section} {len(POLYGONS)} {len(flat)}".encode(), numbers(flat, ">i4", binary)]
    else:
        lines += [f"{section} {len(POLYGONS) + 1} {len(corners)}\nOFFSETS vtktypeint64".encode()]
        lines += [numbers(np.cumsum([0, *counts]), ">i8", binary)]
        lines += [b"CONNECTIVITY vtktypeint64", numbers(corners, ">i8", binary)]
    if kind != "POLYDATA":
        lines += [b"CELL_TYPES 3", numbers([5, 9, 7], ">i4", binary)]
    lines += [b"POINT_DATA 8\nSCALARS a float 1\nLOOKUP_TABLE default", numbers(np.arange(8), ">f4", binary)]
    (tmp_path / "a.vtk").write_bytes(b"\n".join(lines))
    frame = frame_of(tmp_path / "a.vtk")
    assert np.array_equal(frame.vertices, POINTS) and frame.meshes[0].faces.tolist() == TRIANGLES


@pytest.mark.parametrize("suffix", ["vtk", "vtu"])
def test_files_of_meshio(suffix, tmp_path):
    meshio = pytest.importorskip("meshio", reason="VTU needs the extra check")
    cells = [("line", [(0, 1)]), ("triangle", [POLYGONS[0]]), ("quad", POLYGONS[1:])]
    meshio.Mesh(POINTS, cells).write(tmp_path / f"a.{suffix}")
    frame = frame_of(tmp_path / f"a.{suffix}")
    assert np.array_equal(frame.vertices, POINTS) and frame.meshes[0].faces.tolist() == TRIANGLES


@pytest.mark.parametrize("suffix", ["vtk", "vtu"])
def test_the_boundary_of_tetrahedra(suffix, tmp_path):
    meshio = pytest.importorskip("meshio", reason="VTU needs the extra check")
    points = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)])
    tetrahedra = [(0, 1, 2, 3), (1, 2, 3, 4)]
    for name, cells in (("a", []), ("b", [("triangle", [(0, 2, 1)])])):  # a triangle of the boundary counts once
        meshio.Mesh(points, [*cells, ("tetra", tetrahedra)]).write(tmp_path / f"{name}.{suffix}")
        frame = frame_of(tmp_path / f"{name}.{suffix}")
        faces = frame.meshes[0].faces
        assert len(faces) == 6 and hc.closed(faces)
        scene = hc.Scene()
        scene.add_mesh("a", faces)
        detector = hc.Detector(scene, threads=1)
        assert detector.winding_numbers(frame.vertices, [[0.25, 0.25, 0.25], [2, 2, 2]], "a")[0].tolist() == [1, 0]


@pytest.mark.parametrize("offsets", [(0, 3, 2**33), (0, 3, 2), (1, 2, 6), (0, 2**62, 2**63 - 1)])
def test_offsets_that_do_not_fit(offsets, tmp_path):
    """Rejected before an array of their sizes is made: 1.7 GB for a file of 300 bytes."""
    path = tmp_path / "a.vtk"
    path.write_bytes(
        b"# vtk DataFile Version 5.1\nt\nBINARY\nDATASET POLYDATA\nPOINTS 4 float\n"
        + numbers(POINTS[:4], ">f4", True)
        + b"\nPOLYGONS 3 6\nOFFSETS vtktypeint64\n"
        + numbers(offsets, ">i8", True)
        + b"\nCONNECTIVITY vtktypeint64\n"
        + numbers([0, 1, 2, 0, 2, 3], ">i8", True)
    )
    with pytest.raises(MeshFileError, match="numbers of corners of its cells do not add up to 6; export it again"):
        frame_of(path)


def test_frames_of_a_folder(tmp_path):
    meshio = pytest.importorskip("meshio", reason="VTU needs the extra check")
    for k in range(3):
        meshio.Mesh(POINTS + [0, 0, k], [("quad", POLYGONS[1:])]).write(tmp_path / f"a_{k}.vtu")
    sequence = open_sequence(tmp_path)
    frames = [sequence.frame(k) for k in range(3)]
    assert [frame.vertices[0, 2] for frame in frames] == [0, 1, 2]
    assert frames[0].meshes is frames[1].meshes is frames[2].meshes


def test_files_of_pyvista(tmp_path):
    pyvista = pytest.importorskip("pyvista", reason="pyvista comes with the extra plot")
    ball = pyvista.Sphere(theta_resolution=7, phi_resolution=6)
    both = ball.append_polydata(pyvista.Plane(center=(3, 0, 0), i_resolution=3, j_resolution=2))
    for name, mesh in (("ball", ball), ("both", both), ("grid", both.cast_to_unstructured_grid())):
        mesh.save(tmp_path / f"{name}.vtk")
        frame = frame_of(tmp_path / f"{name}.vtk")
        assert np.array_equal(frame.vertices, mesh.points)
        areas = mesh.compute_cell_sizes()["Area"].sum()
        corners = frame.vertices[frame.meshes[0].faces]
        own = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
        assert np.isclose(own, areas, rtol=1e-6)
