# SPDX-License-Identifier: Apache-2.0
"""Inputs that hpccd check cannot use. Each function writes one into a folder and returns (paths, options of
open_sequence); MALFORMED has them by name, PROBLEMS what the message says."""

import json
import struct
import zipfile

import numpy as np
import planted

MALFORMED = {}
PROBLEMS = {}
PACKAGES = {}

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n"
VERTICES = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
SHAPE = planted.positions([])
FACES = np.array([[0, 1, 2], [0, 2, 3]], np.uint32)


def malformed(problem, package=None):
    def add(function):
        name = function.__name__
        MALFORMED[name], PROBLEMS[name] = function, problem
        if package:
            PACKAGES[name] = package
        return function

    return add


def in_file(name, content, **options):
    """An input of one file."""

    def write(folder):
        file = folder / name
        file.write_bytes(content if isinstance(content, bytes) else content.encode())
        return [file], options

    return write


def add(name, problem, write, package=None):
    write.__name__ = name
    malformed(problem, package)(write)


def frames(folder, **contents):
    for name, content in contents.items():
        (folder / f"{name}.obj").write_text(content)
    return [folder], {}


# Paths and folders.
add("missing_path", "no such file or folder", lambda folder: ([folder / "cloth"], {}))
add("no_paths", "no file is given", lambda folder: ([], {}))
add("pattern_without_match", "no file matches", lambda folder: ([f"{folder}/*.obj"], {}))
add("empty_folder", "has no mesh files", lambda folder: ([folder], {}))
add("fractions", "looks like a fraction", lambda d: frames(d, **{f"f.{n}": SQUARE for n in ("1", "1.5", "2", "2.5")}))
add("unknown_format", "unknown format", in_file("cloth.fbx", "Kaydara"))
add("no_suffix", "unknown format", in_file("cloth", SQUARE))


@malformed("has no mesh files (it has notes.txt)")
def folder_of_other_files(folder):
    (folder / "notes.txt").write_text("no mesh")
    return [folder], {}


@malformed("has no mesh files (it has frame_1/); give")
def a_folder_for_each_frame(folder):
    (folder / "frame_1").mkdir()
    frames(folder / "frame_1", cloth=SQUARE)
    return [folder], {}


@malformed("did you mean")
def misspelt_path(folder):
    frames(folder, cloth_1=SQUARE)
    return [folder / "cloht_1.obj"], {}


@malformed("has .obj and .ply files")
def two_formats(folder):
    (folder / "a_1.obj").write_text(SQUARE)
    (folder / "a_2.ply").write_text("ply\n")
    return [folder], {}


@malformed("is a folder among other paths")
def folder_and_file(folder):
    (folder / "a_1.obj").write_text(SQUARE)
    return [folder, folder / "a_1.obj"], {}


@malformed("has all frames of a sequence; give it alone")
def two_whole_sequences(folder):
    for name in ("a.npz", "b.npz"):
        np.savez(folder / name, vertices=VERTICES[None], faces=FACES)
    return [folder / "a.npz", folder / "b.npz"], {}


@malformed("has the same frame number as")
def number_twice(folder):
    return frames(folder, f1=SQUARE, f001=SQUARE)


@malformed("have no frame 2")
def meshes_of_different_frames(folder):
    return frames(folder, a1=SQUARE, a2=SQUARE, b1=SQUARE, b3=SQUARE)


@malformed("leave out faces")
def faces_beside_obj(folder):
    paths, _ = frames(folder, a1=SQUARE, a2=SQUARE)
    return paths, {"faces": folder / "a1.obj"}


# Mesh files.
add("empty_obj", "is empty", in_file("a.obj", ""))
add("zeros", "holds zeros only", in_file("a.obj", bytes(100)))
add("text_as_obj", "has no triangles", in_file("a.obj", "hello\n"))
add("points_only", "has no triangles", in_file("a.obj", "v 0 0 0\nv 1 0 0\n"))
add("face_out_of_range", "names vertex 9", in_file("a.obj", SQUARE + "f 1 2 9\n"))
add("vertex_of_two_numbers", "expected a vertex and three numbers", in_file("a.obj", "v 0 0\n" + SQUARE))
add("nan", "coordinates must be finite", in_file("a.obj", SQUARE.replace("v 1 1 0", "v nan 1 0")))
add("infinite", "coordinates must be finite", in_file("a.obj", SQUARE.replace("v 1 1 0", "v 1e999 1 0")))
add("huge", "coordinates must lie in", in_file("a.obj", SQUARE.replace("v 1 1 0", "v 1e200 1 0")))
add("git_lfs_pointer", "Git LFS pointer", in_file("a.obj", "version https://git-lfs.github.com/spec/v1\n"))
add("ply_as_obj", "is a PLY file", in_file("a.obj", "ply\nformat ascii 1.0\nend_header\n"))
add(
    "ply_cut_off",
    "is cut off",
    in_file(
        "a.ply",
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n"
        "property float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n",
    ),
)
add("stl_cut_off", "declares 2 triangles", in_file("a.stl", bytes(80) + struct.pack("<I", 2) + bytes(50)))


@malformed("vertex 2 is [nan")
def nan_in_the_last_frame(folder):
    return frames(folder, a1=SQUARE, a2=SQUARE, a3=SQUARE.replace("v 1 1 0", "v nan 1 0"))


@malformed("names vertex 9")
def damaged_frame_in_the_middle(folder):
    return frames(folder, a1=SQUARE, a2=SQUARE + "f 7 8 9\n", a3=SQUARE)


@malformed("65 connected components")
def too_many_components(folder):
    lines = [f"v {k} 0 0\nv {k} 1 0\nv {k} 0 1\nf {3 * k + 1} {3 * k + 2} {3 * k + 3}" for k in range(65)]
    (folder / "a.obj").write_text("\n".join(lines))
    return [folder / "a.obj"], {"split": True}


# VTK.
POLY_DATA = "# vtk DataFile Version 3.0\na\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n0 0 0 1 0 0 1 1 0 0 1 0\n"
POLY_DATA += "POLYGONS 2 8\n3 0 1 2\n3 0 2 3\n"
add("text_as_vtk", "is not a legacy VTK file", in_file("a.vtk", "hello"))
add("vtk_header_only", "is not a legacy VTK file", in_file("a.vtk", "# vtk DataFile Version 3.0\na\n"))
add("vtk_cut_off", "is cut off", in_file("a.vtk", POLY_DATA[:-10]))
add("vtk_of_points", "has no faces", in_file("a.vtk", POLY_DATA[: POLY_DATA.index("POLYGONS")]))
add("vtk_face_out_of_range", "names vertex 7", in_file("a.vtk", POLY_DATA.replace("0 2 3", "0 2 7")))
add("vtk_of_voxels", "data set STRUCTURED_POINTS", in_file("a.vtk", POLY_DATA.replace("POLYDATA", "STRUCTURED_POINTS")))
add("vtk_strips", "has triangle strips", in_file("a.vtk", POLY_DATA.replace("POLYGONS", "TRIANGLE_STRIPS")))
BINARY = POLY_DATA.replace("ASCII", "BINARY")
add("vtk_of_negative_size", "is cut off", in_file("a.vtk", BINARY.replace("POINTS 4", "POINTS -1")))
add("vtk_of_huge_size", "is cut off", in_file("a.vtk", POLY_DATA.replace("POLYGONS 2 8", "POLYGONS 2000000000000 8")))
add(
    "vtk_of_long_words",
    "a word of more than 100 characters",
    in_file("a.vtk", POLY_DATA.replace("1 1 0", "1 1" + "0" * 999)),
)
add("vtk_of_many_sections", "too many sections", in_file("a.vtk", POLY_DATA + "LINES 1 1\n0\n" * 101))
add("text_as_vtu", "cannot be read as VTU", in_file("a.vtu", "hello"), "meshio")
VOXEL = """<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian"><UnstructuredGrid>
<Piece NumberOfPoints="8" NumberOfCells="1">
<Points><DataArray type="Float32" NumberOfComponents="3" format="ascii">
0 0 0 1 0 0 0 1 0 1 1 0 0 0 1 1 0 1 0 1 1 1 1 1</DataArray></Points>
<Cells><DataArray type="Int32" Name="connectivity" format="ascii">0 1 2 3 4 5 6 7</DataArray>
<DataArray type="Int32" Name="offsets" format="ascii">8</DataArray>
<DataArray type="UInt8" Name="types" format="ascii">11</DataArray></Cells>
</Piece></UnstructuredGrid></VTKFile>"""
add("vtu_of_voxels", "cells of other types: 1", in_file("a.vtu", VOXEL), "meshio")
add("vtu_of_hexahedra", "has cells of type hexahedron", in_file("a.vtu", VOXEL.replace(">11<", ">12<")), "meshio")
add("vtu_cut_off", "cannot be read as VTU", in_file("a.vtu", "<VTKFile type='UnstructuredGrid'><Unstr"), "meshio")


# Arrays.
def npz(name, problem, **arrays):
    def write(folder):
        np.savez(folder / "a.npz", **arrays)
        return [folder / "a.npz"], {}

    add(name, problem, write)


npz("npz_without_positions", "has no positions", faces=FACES)
npz("npz_without_faces", "has no faces", vertices=VERTICES[None])
npz("npz_of_one_frame_shape", "save arrays of shape (frames, vertices, 3)", vertices=VERTICES, faces=FACES)
npz("npz_of_two_coordinates", "has the shape (1, 4, 2)", vertices=VERTICES[None, :, :2], faces=FACES)
npz("npz_of_integers", "holds int64", vertices=VERTICES[None].astype(np.int64), faces=FACES)
npz("npz_face_out_of_range", "face 1 is [0, 2, 3]", vertices=VERTICES[None, :3], faces=FACES)
npz("npz_negative_face", "face 0 is [0, -1, 2]", vertices=VERTICES[None], faces=[[0, -1, 2]])
npz("npz_of_quads", "give integers of shape (faces, 3)", vertices=VERTICES[None], faces=[[0, 1, 2, 3]])
npz("npz_float_faces", "the faces are float64", vertices=VERTICES[None], faces=FACES.astype(float))
npz("npz_empty_faces", "has no faces", vertices=VERTICES[None], faces=np.empty((0, 3), int))
npz("npz_no_frames", "has no frames", vertices=np.empty((0, 4, 3)), faces=FACES)
npz("npz_nan", "coordinates must be finite", vertices=np.full((2, 4, 3), np.nan), faces=FACES)
npz(
    "npz_different_lengths",
    "have 1 and 2 frames",
    a_vertices=VERTICES[None],
    a_faces=FACES,
    b_faces=FACES,
    b_vertices=np.stack([VERTICES, VERTICES]),
)
npz("npz_positions_twice", "has both", vertices=VERTICES[None], positions=VERTICES[None], faces=FACES)
npz("npz_of_objects", "holds Python objects", vertices=np.array([VERTICES, None], object), faces=FACES)
add("text_as_npz", "is not an NPZ file", in_file("a.npz", "hello"))
add("text_as_npy", "is damaged", in_file("a.npy", "hello"))


@malformed("is damaged")
def npz_cut_off(folder):
    np.savez(folder / "b.npz", vertices=VERTICES[None], faces=FACES)
    (folder / "a.npz").write_bytes((folder / "b.npz").read_bytes()[:-100])
    return [folder / "a.npz"], {}


@malformed("is damaged")
def npz_with_a_wrong_checksum(folder):
    np.savez_compressed(folder / "a.npz", vertices=np.random.default_rng(1).random((4, 100, 3)), faces=FACES)
    data = bytearray((folder / "a.npz").read_bytes())
    data[2000] ^= 255
    (folder / "a.npz").write_bytes(data)
    return [folder / "a.npz"], {}


@malformed("is cut off")
def npy_cut_off(folder):
    np.save(folder / "b.npy", VERTICES[None])
    (folder / "a.npy").write_bytes((folder / "b.npy").read_bytes()[:-8])
    (folder / "a.obj").write_text(SQUARE)
    return [folder / "a.npy"], {"faces": folder / "a.obj"}


@malformed("has no faces; give faces (--faces FILE)")
def npy_without_faces(folder):
    np.save(folder / "a.npy", VERTICES[None])
    return [folder / "a.npy"], {}


@malformed("has 4 vertices, and the frames have 3")
def npy_with_faces_of_another_mesh(folder):
    np.save(folder / "a.npy", VERTICES[None, :3])
    (folder / "a.obj").write_text(SQUARE)
    return [folder / "a.npy"], {"faces": folder / "a.obj"}


@malformed("is compressed in Fortran order")
def npz_compressed_in_fortran_order(folder):
    np.savez_compressed(folder / "a.npz", vertices=np.asfortranarray(np.stack([VERTICES] * 2)), faces=FACES)
    return [folder / "a.npz"], {}


@malformed("is not a file with faces")
def faces_of_unknown_format(folder):
    np.save(folder / "a.npy", VERTICES[None])
    (folder / "a.txt").write_text("0 1 2")
    return [folder / "a.npy"], {"faces": folder / "a.txt"}


@malformed("is damaged")
def npy_of_an_open_bracket(folder):
    np.save(folder / "b.npy", VERTICES[None])
    (folder / "a.npy").write_bytes((folder / "b.npy").read_bytes().replace(b"(1, 4, 3)", b"((1, 4, 3"))
    (folder / "a.obj").write_text(SQUARE)
    return [folder / "a.npy"], {"faces": folder / "a.obj"}


@malformed("has a header of")
def npy_of_a_huge_header(folder):
    (folder / "a.npy").write_bytes(b"\x93NUMPY\x02\x00\xff\xff\xff\xff" + bytes(100))
    return [folder / "a.npy"], {}


@malformed("f.npz: is damaged")
def faces_of_objects(folder):
    np.save(folder / "a.npy", VERTICES[None])
    np.savez(folder / "f.npz", faces=np.array([None]))
    return [folder / "a.npy"], {"faces": folder / "f.npz"}


@malformed("f.npy: is damaged")
def damaged_faces(folder):
    np.save(folder / "a.npy", VERTICES[None])
    np.save(folder / "f.npy", FACES)
    (folder / "f.npy").write_bytes((folder / "f.npy").read_bytes()[:-4])
    return [folder / "a.npy"], {"faces": folder / "f.npy"}


# Point caches.
def cache(name, problem, suffix, data, faces=True):
    def write(folder):
        (folder / f"a{suffix}").write_bytes(data)
        (folder / "a.obj").write_text(SQUARE)
        return [folder / f"a{suffix}"], {"faces": folder / "a.obj"} if faces else {}

    add(name, problem, write)


def pc2(n_vertices=4, n_frames=2, version=1):
    head = struct.pack("<12siiffi", b"POINTCACHE2\0", version, n_vertices, 0, 1, n_frames)
    return head + np.zeros((2, 4, 3), "<f4").tobytes()


cache("text_as_pc2", "is not a PC2 file", ".pc2", b"hello")
cache("pc2_version_2", "of version 2", ".pc2", pc2(version=2))
cache("pc2_cut_off", "is cut off", ".pc2", pc2()[:-4])
cache("pc2_too_long", "is too long", ".pc2", pc2() + bytes(12))
cache("pc2_no_frames", "has no frames", ".pc2", pc2(n_frames=0)[:32])
cache("pc2_negative", "declares -1 frames", ".pc2", pc2(n_frames=-1))
cache("pc2_without_faces", "has no faces", ".pc2", pc2(), faces=False)
cache("pc2_of_another_mesh", "the frames have 8", ".pc2", pc2(n_vertices=8, n_frames=1))
cache("mdd_header_only", "is not an MDD file", ".mdd", b"\0\0\0")
cache("mdd_cut_off", "is cut off", ".mdd", struct.pack(">ii2f", 2, 4, 0, 1) + bytes(90))


# USD.
def usd(name, problem, text, file="a.usda"):
    add(name, problem, in_file(file, text if isinstance(text, bytes) else f"#usda 1.0\n{text}"), "pxr")


MESH = 'def Mesh "a" {{\n int[] faceVertexCounts = [3]\n int[] faceVertexIndices = [{}]\n point3f[] points = {}\n}}'
POINTS = "[(0,0,0),(1,0,0),(0,1,0)]"
usd("text_as_usda", "cannot be opened as USD", b"hello")
usd("text_as_usdc", "cannot be opened as USD", b"hello", "a.usdc")
usd("usdz_of_nothing", "cannot be opened as USD", b"PK\x05\x06" + bytes(18), "a.usdz")
usd("usd_without_meshes", "has no Mesh prims", 'def Xform "a" {}')
usd("usd_of_a_sphere", "has no Mesh prims", 'def Sphere "a" {}')
usd("usd_missing_reference", "is not complete", 'def "a" (references = @missing.usda@) {}')
usd("usd_without_points", "has no points", MESH.format("0,1,2", "[]"))
usd("usd_without_faces", "has no faces", MESH.format("", POINTS))
usd("usd_face_out_of_range", "names vertex 9", MESH.format("0,1,9", POINTS))
usd("usd_corners_missing", "have 3 corners, and 2 are listed", MESH.format("0,1", POINTS))
CROSSED = MESH.replace("[3]", "[4]").format("0,1,2,3", "[(0,0,0),(2,1,0),(3,0,0),(0,1,0)]")
usd("usd_crossed_polygon", "/a: polygon 0 (of 4 corners): crosses itself", CROSSED)
usd("usd_infinite", "coordinates must be finite", MESH.format("0,1,2", "[(0,0,0),(1,inf,0),(0,1,0)]"))
usd("usd_unit_of_zero", "metersPerUnit is 0", f"(metersPerUnit = 0)\n{MESH.format('0,1,2', POINTS)}")
usd("usd_skinned", "is moved by a skeleton", MESH.format("0,1,2", f"{POINTS}\n int[] primvars:skel:jointIndices = [0]"))


# glTF.
SAMPLER = ["animations", 0, "samplers", 0]


def gltf(name, problem, change, suffix=".glb"):
    """change: (document, bytes) -> the same, or the bytes of the file."""

    def write(folder):
        whole = {name: of_mesh[:3] for name, of_mesh in SHAPE.items()}
        document, binary = planted.gltf_of(whole)
        changed = change(document, binary)
        data = changed if isinstance(changed, bytes) else planted.glb(document, binary)
        (folder / f"a{suffix}").write_bytes(data)
        return [folder / f"a{suffix}"], {}

    add(name, problem, write)


def put(keys, value):
    def change(document, _):
        for key in keys[:-1]:
            document = document[key]
        document[keys[-1]] = value

    return change


gltf("text_as_glb", "is not a GLB file", lambda *_: b"hello")
gltf("text_as_gltf", "is not a glTF file", lambda *_: b"hello", ".gltf")
gltf("glb_cut_off", "is cut off or damaged", lambda *parts: planted.glb(*parts)[:-100])
gltf("gltf_version_1", "of version 1.0", put(["asset", "version"], "1.0"))
gltf("gltf_draco", "is compressed with Draco", put(["extensionsRequired"], ["KHR_draco_mesh_compression"]))
gltf("gltf_meshopt", "is compressed with meshopt", put(["extensionsRequired"], ["EXT_meshopt_compression"]))
gltf("gltf_unknown_extension", "needs the extension", put(["extensionsRequired"], ["ACME_noise"]))
gltf("gltf_without_meshes", "has no meshes", put(["scenes", 0, "nodes"], []))
gltf("gltf_buffer_missing", "has no data", lambda document, _: json.dumps(document).encode(), ".gltf")
gltf("gltf_accessor_too_long", "ends beyond its buffer", put(["accessors", 0, "count"], 10**6))
gltf("gltf_index_out_of_range", "is damaged", put(["meshes", 0, "primitives", 0, "attributes", "POSITION"], 999))
gltf("gltf_lines", "has no faces", put(["meshes", 0, "primitives", 0, "mode"], 1))
gltf("gltf_node_of_two_parents", "has two parents", put(["nodes", 0, "children"], [1]))
gltf(
    "gltf_unknown_interpolation", "is unknown; use LINEAR", put(["animations", 0, "samplers", 0, "interpolation"], "X")
)


@malformed("does not exist; copy it beside it")
def gltf_buffer_file_missing(folder):
    document, _ = planted.gltf_of({name: of_mesh[:1] for name, of_mesh in SHAPE.items()}, morph=False)
    document["buffers"][0]["uri"] = "missing.bin"
    (folder / "a.gltf").write_text(json.dumps(document))
    return [folder / "a.gltf"], {}


@malformed("several animations move")
def gltf_two_animations_of_a_node(folder):
    document, binary = planted.gltf_of({name: of_mesh[:2] for name, of_mesh in SHAPE.items()})
    document["animations"] *= 2
    (folder / "a.glb").write_bytes(planted.glb(document, binary))
    return [folder / "a.glb"], {}


# Recordings.
def mcap(name, problem, after=None, **options):
    def write(folder):
        shape = {name: SHAPE[name][:3] for name in ("cloth", "probe")}
        planted.write_recording(folder / "b.mcap", shape, **options)
        data = (folder / "b.mcap").read_bytes()
        (folder / "a.mcap").write_bytes(after(data) if after else data)
        return [folder / "a.mcap"], {}

    add(name, problem, write, "mcap_ros2")


add("text_as_mcap", "is not a whole MCAP file", in_file("a.mcap", "hello, this is no recording"), "mcap_ros2")
mcap("mcap_cut_off", "recover it with hpccd doctor", lambda data: data[: len(data) // 2])
mcap("mcap_of_two_coordinate_frames", "different coordinate frames", frame_ids=("world", "hand"))
mcap("mcap_with_ropes", "edges of no face", edges=(0, 1))
mcap("mcap_of_two_runs", "stamps of", backwards=True)
mcap("mcap_with_an_escape", "is not text", lambda data: data.replace(b"uint64 step", b"uint64 \x1b[m "))
mcap("mcap_without_topology", "has no topology of version 0", version=7)


@malformed("has no messages hpccd/msg/MeshVertices", "mcap_ros2")
def mcap_without_meshes(folder):
    planted.write_recording(folder / "a.mcap", {})
    return [folder / "a.mcap"], {}


@malformed("is damaged")
def npz_encrypted(folder):
    np.savez(folder / "a.npz", vertices=VERTICES[None], faces=FACES)
    data = bytearray((folder / "a.npz").read_bytes())
    with zipfile.ZipFile(folder / "a.npz") as archive:
        begin = archive.start_dir
    data[begin + 8] |= 1
    data[6] |= 1
    (folder / "a.npz").write_bytes(data)
    return [folder / "a.npz"], {}
