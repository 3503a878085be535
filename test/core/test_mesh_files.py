# SPDX-License-Identifier: Apache-2.0
"""Mesh files as people have them: vertices are numbered as in the file, and polygons are covered exactly."""

import itertools
import os
import struct
import subprocess
import sys
import threading
import time
import warnings
from collections import Counter
from fractions import Fraction

import mesh_file_variants as variants
import numpy as np
import pytest
from mesh_file_variants import ELL, FORMS, ply, stl, text_stl

import hpccd_core as hc
from hpccd_core.mesh_files import lines
from hpccd_core.mesh_files.load import _parse as parse_file
from hpccd_core.mesh_files.welding import joined

pytest.importorskip("mapbox_earcut")


@pytest.fixture
def load(tmp_path):
    def load(name, data):
        file = tmp_path / name
        file.write_bytes(data)
        return hc.load_mesh(file)

    return load


def assert_covers(vertices, polygon, triangles):
    """The triangles are a triangulation of the polygon, by rational arithmetic: each one turns as the polygon does or
    has no area, each side is in one of them, and each diagonal once in either direction."""
    n = len(polygon)
    sides = Counter((polygon[k], polygon[(k + 1) % n]) for k in range(n))
    edges = Counter((t[k], t[(k + 1) % 3]) for t in triangles for k in range(3))
    assert len(triangles) == n - 2
    diagonals = edges - sides
    assert not sides - edges and diagonals == Counter({(b, a): count for (a, b), count in diagonals.items()})
    exact = [[Fraction(float(x)) for x in vertices[corner]] for corner in range(len(vertices))]

    def area(a, b, c):
        u, v = ([q - p for p, q in zip(exact[a], exact[other], strict=True)] for other in (b, c))
        return [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]

    areas = [area(*t) for t in triangles]
    whole = [sum(axis) for axis in zip(*areas, strict=True)]
    assert all(sum(x * y for x, y in zip(one, whole, strict=True)) >= 0 for one in areas)


@pytest.mark.parametrize("name, data, vertices, polygons", variants.VARIANTS, ids=[v[0] for v in variants.VARIANTS])
def test_numbered_as_in_the_file(load, capfd, monkeypatch, name, data, vertices, polygons):
    vertices = np.array(vertices, np.float64)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found, faces = load(name, data)
        monkeypatch.setattr(lines, "CHUNK", 5)
        again = load(name, data)
    assert found.dtype == np.float64 and faces.dtype == np.uint32
    assert np.array_equal(found, vertices)
    left = [tuple(face) for face in faces.tolist()]
    for polygon in sorted((p for p in polygons if len(p) > 2), key=len):
        of_it = [face for face in left if set(face) <= set(polygon)][: len(polygon) - 2]
        assert_covers(vertices, list(polygon), of_it)
        for face in of_it:
            left.remove(face)
    assert not left
    assert np.array_equal(again[0], found) and np.array_equal(again[1], faces), "the same by chunks of other sizes"
    assert capfd.readouterr() == ("", "")


# As trimesh splits them, with which files were read before: contacts name triangles by their number.
MIXED_AS_BEFORE = {
    "quads.obj": [[0, 1, 2], [5, 1, 2], [2, 3, 0], [2, 3, 5]],
    "mixed.obj": [[0, 1, 2], [2, 3, 0], [3, 2, 1], [5, 1, 2], [0, 1, 4], [0, 4, 2], [0, 2, 3]],
    "quads-ascii.ply": [[0, 1, 2], [5, 1, 2], [2, 3, 0], [2, 3, 5]],
    "mixed-ascii.ply": [[3, 2, 1], [5, 1, 2], [0, 1, 2], [2, 3, 0], [0, 1, 4], [0, 4, 2], [0, 2, 3]],
}


@pytest.mark.parametrize("name", MIXED_AS_BEFORE)
def test_triangles_of_convex_polygons_keep_their_order(load, name):
    data = next(data for variant, data, *_ in variants.VARIANTS if variant == name)
    assert load(name, data)[1].tolist() == MIXED_AS_BEFORE[name]


def test_the_same_as_another_library(load):
    """Random polygons, all convex: positions and triangles of trimesh, bit for bit."""
    trimesh = pytest.importorskip("trimesh")
    rng = np.random.default_rng(1)
    for case in range(30):
        sizes = rng.choice([[3], [4], [5], [3, 4], [3, 4, 5, 8]][case % 5], 20)
        vertices = np.zeros((0, 3))
        faces = []
        for size in sizes:
            angles = np.sort(rng.permutation(50)[:size] * 2 * np.pi / 50)
            turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
            round_it = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1) @ turn + rng.normal(size=3)
            faces.append(list(range(len(vertices), len(vertices) + size)))
            vertices = np.concatenate([vertices, round_it])
        rows = [(face,) for face in faces]
        elements = [("vertex", dict.fromkeys("xyz", "double"), vertices), ("face", variants._LIST, rows)]
        for name, data in (
            ("m.obj", (variants._v(vertices.tolist()) + variants._f(faces)).encode()),
            ("m.ply", ply("ascii", [("vertex", elements[0][1], vertices.tolist()), elements[1]])),
        ):
            options = {"maintain_order": True} if name == "m.obj" else {}
            stream = trimesh.util.wrap_as_stream(data)
            other = trimesh.load(stream, file_type=name[-3:], force="mesh", process=False, **options)
            found, triangles = load(name, data)
            assert np.array_equal(found, other.vertices) and np.array_equal(triangles, other.faces)


def random_polygon(rng, n):
    """Simple, in a random plane: corners in the order of their angle, on a grid so that some sides are straight."""
    while True:
        angles = np.sort(rng.uniform(0, 2 * np.pi, n))
        flat = np.round(np.stack([np.cos(angles), np.sin(angles)], axis=1) * rng.uniform(0.2, 1, (n, 1)) * 6)
        turns = flat * np.roll(flat, -1, axis=0)[:, ::-1] @ [1, -1]
        if (turns > 0).all():  # seen from the origin each side turns one way
            u, v = rng.integers(-3, 4, (2, 3))
            if np.cross(u, v).any():
                return flat[:, :1] * u + flat[:, 1:] * v + rng.integers(-9, 9, 3)


def test_polygons_are_covered_and_nothing_else(load):
    rng = np.random.default_rng(2)
    split = 0
    for size in np.repeat([4, 5, 6, 8, 12, 20], 15):
        polygon = random_polygon(rng, size)
        vertices, faces = load("m.obj", (variants._v(polygon.tolist()) + variants._f([range(size)])).encode())
        split += faces.tolist() != [[0, k + 1, k + 2] for k in range(size - 2)]
        assert_covers(vertices, list(range(size)), [tuple(face) for face in faces.tolist()])
    assert split > 20, "not all are fans"


@pytest.mark.parametrize("scale", [1e-140, 1e-3, 1e120])
def test_no_polygon_is_too_small_or_too_large(load, scale):
    vertices, faces = load("m.obj", (variants._v((np.array(ELL) * scale).tolist()) + variants._f([range(6)])).encode())
    assert_covers(vertices, list(range(6)), [tuple(face) for face in faces.tolist()])


def test_corners_on_a_straight_side_stay(load):
    """A neighbour uses them: without them the surface would tear as soon as it moves."""
    ell = [*ELL[:4], [0, 1, 0], [0, 0, 0], [0.5, 0, 0], [1, 0, 0], [2, 0, 0], [2, 0.5, 0]]
    for first in range(len(ell)):
        turned = ell[first:] + ell[:first]
        vertices, faces = load("m.obj", (variants._v(turned) + variants._f([range(10)])).encode())
        assert_covers(vertices, list(range(10)), [tuple(face) for face in faces.tolist()])


@pytest.mark.parametrize("direction", [1, -1])
def test_corners_that_repeat_stay(load, direction):
    """As corners on a straight side; their triangles have no area."""
    for doubled in range(6):
        times = 2 + doubled % 2
        polygon = [corner for k, corner in enumerate(ELL) for _ in range(times if k == doubled else 1)][::direction]
        n = len(polygon)
        for first in (0, doubled, doubled + 1):
            turned = polygon[first:] + polygon[:first]
            vertices, faces = load("m.obj", (variants._v(turned) + variants._f([range(n)])).encode())
            assert_covers(vertices, list(range(n)), [tuple(face) for face in faces.tolist()])
    # Ear clipping by itself rejects this one in one of the directions.
    corners = [[11, -23, 14], [10, -20, 12], [8, -20, 4], [7, -14, 4], [7, -14, 4], [5, -5, 2], [4, -2, 0], [7, 4, 16]]
    vertices, faces = load("m.obj", (variants._v(corners[::direction]) + variants._f([range(8)])).encode())
    assert_covers(vertices, list(range(8)), [tuple(face) for face in faces.tolist()])


def test_the_triangles_of_a_polygon_that_is_not_convex_stay_the_same(load):
    """Recordings name triangles by their numbers: a version of mapbox_earcut that splits differently must not pass."""
    _, faces = load("m.obj", (variants._v(ELL) + variants._f([range(6)])).encode())
    assert faces.tolist() == [[4, 5, 0], [4, 0, 1], [4, 1, 2], [4, 2, 3]]


def test_polygons_without_area_are_fans(load):
    flat = [[float(x), 0, 0] for x in (0, 2, 1, 3)]
    assert load("m.obj", (variants._v(flat) + variants._f([range(4)])).encode())[1].tolist() == [[0, 1, 2], [2, 3, 0]]


LFS = b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a2146\nsize 12345\n"
HTML = b"\n<!DOCTYPE html>\n<html><body>Not found: facet</body></html>"
_PLY = ply("binary_little_endian", variants._ply_elements()["plain"][0])
_MIXED_PLY = ply("binary_big_endian", variants._ply_elements()["mixed"][0])
_ASCII_PLY = ply("ascii", variants._ply_elements()["plain"][0])
_OBJ = variants._PLAIN.encode()
BOW_TIE = [[0.0, 0, 0], [1, 1, 0], [1, 0, 0], [0, 1, 0]]
SIGNALLING = b"\x01\x00\x80\x7f"


def length_of_list(form, length):
    """A file whose lists of vertices have lengths of type double; that of the first triangle is this."""
    faces = ("face", {"vertex_indices": ("double", "int")}, variants._rows(variants.MIXED))
    data = ply(form, [variants._ply_elements()["plain"][0][0], faces])
    return data.replace(struct.pack(f"{FORMS[form]}d", 3), struct.pack(f"{FORMS[form]}d", length))


REJECTED = {
    **{
        f"lfs{suffix}": (LFS, "is a Git LFS pointer, not the mesh itself; run git lfs pull")
        for suffix in (".obj", ".ply", ".stl", ".dae")
    },
    **{f"web{suffix}": (HTML, r"is a web page \(HTML\)") for suffix in (".obj", ".ply", ".stl", ".dae")},
    **{f"empty{suffix}": (b" \n", "is empty") for suffix in (".obj", ".ply", ".stl", ".dae")},
    **{f"zip{suffix}": (b"PK\x03\x04\x14\0\0\0", "is a zip archive; unpack it") for suffix in (".obj", ".stl", ".dae")},
    "gzip.ply": (b"\x1f\x8b\x08\0\0\0", r"is compressed \(gzip\); unpack it"),
    "tar.stl": (b"m.stl".ljust(257, b"\0") + b"ustar\x0000" + bytes(300), "is a tar archive"),
    "zeros.stl": (bytes(500), "holds zeros only"),
    "glb.obj": (b"glTF\x02\0\0\0", "is a GLB file"),
    "json.stl": (b'{"message": "Not Found"}', "is a JSON file"),
    "utf-16.obj": (variants._PLAIN.encode("utf-16"), "is UTF-16 text; save it as UTF-8"),
    "ply.obj": (_ASCII_PLY, r"is a PLY file; name it \.ply"),
    "stl.ply": (text_stl(), r"is an STL file; name it \.stl"),
    "obj.ply": (_OBJ, "does not begin with ply"),
    "obj.stl": (_OBJ, "neither a binary STL"),
    "binary-stl.obj": (stl(), "has no triangles"),
    "underscore.obj": (_OBJ + b"f 1_0 2 3\n", "line 9: .*expected a face"),
    "underscore-alone.obj": (b"v 1_0 0 0\n" * 3 + b"f 1 2 3\n", "line 1: .*expected a vertex"),
    "underscore.ply": (_ASCII_PLY.replace(b"3 0 1 2", b"3 0 1 0_2"), "does not have the values that the header lists"),
    "underscore.stl": (text_stl().replace(b"vertex 0", b"vertex 0_0", 1), "line 4: .*not a number"),
    "signalling.ply": (_PLY.replace(struct.pack("<f", 7.0), SIGNALLING), "coordinates must be finite"),
    "signalling.stl": (stl()[:96] + SIGNALLING + stl()[100:], "coordinates must be finite"),
    "infinite-length.ply": (length_of_list("binary_little_endian", np.inf), "a list of length inf"),
    "nan-length.ply": (length_of_list("binary_big_endian", np.nan), "a list of length nan"),
    "huge-length.ply": (length_of_list("binary_little_endian", 1e300), "is cut off"),
    "archive-with-more.stl": (stl(b"PK\x03\x04") + b"more", "is a zip archive"),
    "points.obj": (b"v 0 0 0\nv 1 0 0\n", "has no triangles"),
    "index.obj": (_OBJ + b"f 1 2 7\n", "line 9: names vertex 7, and the file has 6"),
    "zero.obj": (_OBJ + b"f 0 1 2\n", "line 9: 'f 0 1 2': expected a face"),
    "negative.obj": (b"v 0 0 0\nv 1 0 0\nf -1 -2 -3\nv 0 1 0\n", "line 3: 'f -1 -2 -3'"),
    "word.obj": (_OBJ + b"v 1 two 3\n", "line 9: 'v 1 two 3': expected a vertex and three numbers"),
    "short.obj": (b"v 1 2\n" + _OBJ, "line 1: 'v 1 2'"),
    "comma.obj": (b"v 1,5 0,0 2\n" + _OBJ, "line 1: 'v 1,5 0,0 2'"),
    "huge-index.obj": (_OBJ + b"f 1 2 99999999999999999999999\n", "line 9"),
    "nan.obj": (_OBJ + b"v nan 0 0\n", "vertex 6 is .*; coordinates must be finite"),
    "far.obj": (_OBJ + b"v 0 1e151 0\n", "vertex 6 is .*; coordinates must lie in"),
    "crossing.obj": ((variants._v(BOW_TIE) + "f 1 2 3 4\n").encode(), r"polygon 0 \(of 4 corners\): crosses itself"),
    "star.obj": (
        (
            "".join(f"v {np.cos(k * 2.4 * np.pi / 3)} {np.sin(k * 2.4 * np.pi / 3)} 0\n" for k in range(5))
            + "f 1 2 3 4 5\n"
        ).encode(),
        "crosses itself",
    ),
    "many-corners.obj": (
        ("".join(f"v {k % 2} {k} 0\n" for k in range(9000)) + variants._f([range(9000)])).encode(),
        "more than 8000 corners; split it",
    ),
    "cut.ply": (_PLY[:-1], "is cut off: it ends before the last of its 2 rows of face"),
    "cut-vertices.ply": (_PLY[:-40], "is cut off: .* 6 rows of vertex"),
    "cut-mixed.ply": (_MIXED_PLY[:-1], "is cut off: .* 4 rows of face"),
    "cut-ascii.ply": (_ASCII_PLY[:-10], "is cut off|does not have the values"),
    "cut-header.ply": (_PLY[:60], "its header does not end"),
    "no-faces.ply": (ply("ascii", variants._ply_elements()["plain"][0][:1]), "has no triangles"),
    "no-z.ply": (_ASCII_PLY.replace(b"property float z\n", b""), "no element vertex with the properties x, y and z"),
    **{
        f"list-of-{axis}-{form}.ply": (data, f"property {axis} of its vertices is a list; export it again")
        for (axis, form), data in variants.LISTS_OF_COORDINATES.items()
    },
    "strips.ply": (_ASCII_PLY.replace(b"element face", b"element tristrips"), "triangle strips: convert it to faces"),
    "type.ply": (_ASCII_PLY.replace(b"float x", b"half x"), "line 4: 'property half x': not a line of a PLY header"),
    "index.ply": (_ASCII_PLY.replace(b"3 0 1 2", b"3 0 1 6"), "face 0 names vertex 6, and the file has 6"),
    "negative.ply": (_ASCII_PLY.replace(b"3 0 1 2", b"3 0 -1 2"), "face 0 names vertex -1"),
    "fraction.ply": (_ASCII_PLY.replace(b"3 0 1 2", b"3 0 1.5 2"), "does not have the values that the header lists"),
    "claims.ply": (_PLY.replace(b"face 2", b"face 4000000000"), "is cut off"),
    "length.ply": (
        _PLY.replace(b"uchar int", b"char int").replace(b"\x03\0\0\0\0\x01", b"\xfd\0\0\0\0\x01"),
        "a list of length -3",
    ),
    "cut.stl": (stl()[:-1], "declares 2 triangles but contains 1; copy or export it again"),
    "count.stl": (stl(count=2**32 - 1), "declares 4294967295 triangles but contains 2"),
    "none.stl": (stl(triangles=variants.TRIANGLES[:0], count=0)[:80] + b"\0\0\0\0", "zeros only|has no triangles"),
    "count-of-none.stl": (stl(count=0, header=b"x"), "neither a binary STL"),
    "cut-text.stl": (text_stl()[:-40], "is cut off or damaged|the facet before it|three numbers"),
    "two-corners.stl": (text_stl().replace(b"  vertex 0 0", b"  v 0 0", 1), "the facet before it has 2 vertices"),
    "word-text.stl": (text_stl().replace(b"vertex 0 0", b"vertex 0 x", 1), "line 4: .*not a number"),
    "garbage.stl": (bytes(range(128, 256)) * 8, "neither an ASCII STL nor a whole binary STL"),
    "garbage.obj": (bytes(range(128, 256)) * 8, "has no triangles"),
}


@pytest.mark.parametrize("name", REJECTED)
def test_errors_say_what_the_file_is(load, capfd, name):
    data, why = REJECTED[name]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(hc.MeshFileError, match=rf"/{name}: .*({why})") as caught:
            load(name, data)
    assert len(str(caught.value)) < 800
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("form", FORMS)
def test_any_torn_ply_is_read_or_rejected(load, form):
    """Each length of a file with all kinds of rows: no other error, and no other vertices."""
    elements, _ = variants._ply_elements()["mixed-and-more"]
    data = ply(form, elements)
    whole = load("m.ply", data)
    for length in range(len(data)):
        try:
            vertices, faces = load("m.ply", data[:length])
        except hc.MeshFileError:
            continue
        # Text may end within the last number, which belongs to a property that is ignored.
        assert form == "ascii" and np.array_equal(vertices, whole[0]) and np.array_equal(faces, whole[1])


def test_any_changed_file_is_read_or_rejected():
    """Bytes at random, words and numbers that Python or numpy read in their own way: no other error, no warning."""
    rng = np.random.default_rng(5)
    odd = [b"nan", b"inf", b"1e999", b"-1", b"1_0", b"9" * 5000, b"1e30", b"", b"0x1", b"\xff", b"0.5", b"\\", b"#"]
    floats = {"vertex_indices": ("double", "float")}
    for (name, data, *_), _ in itertools.product(variants.VARIANTS, range(15)):
        changed = bytearray(data)
        if name.endswith(".ply") and rng.random() < 0.3:
            form = list(FORMS)[rng.integers(1, 3)]
            elements = variants._ply_elements()["mixed"][0]
            changed = bytearray(ply(form, [elements[0], (elements[1][0], floats, elements[1][2])]))
            at = changed.index(b"end_header") + 11 + 72 + int(rng.integers(0, 60))
            changed[at : at + 8] = struct.pack(f"{FORMS[form]}d", rng.choice([np.nan, np.inf, -np.inf, 1e300, 0.5]))
        elif rng.random() < 0.5:
            for at in rng.integers(0, len(data), 3):
                changed[at] = rng.choice([0, 0x7F, 0x80, 0xFF, rng.integers(256)])
        else:
            words = data.split(b" ")
            words[rng.integers(len(words))] = odd[rng.integers(len(odd))]
            changed = bytearray(b" ".join(words))
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            try:
                parse_file(bytes(changed), f".{name.rpartition('.')[2]}")
            except hc.MeshFileError:
                pass


def test_messages_are_one_printable_line(load):
    """Names in a PLY header may be any."""
    header = b"ply\nformat ascii 1.0\nelement a\x07\x9b 1\nproperty int x\nelement vertex 1\nproperty float x\n"
    header += b"property float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_index\nend_header\n"
    with pytest.raises(hc.MeshFileError, match=r"rows of a\\x07\\x9b") as caught:
        load("a.ply", header)
    assert str(caught.value).isprintable()


def test_files_that_are_not_there(load, tmp_path, monkeypatch):
    with pytest.raises(hc.MeshFileError, match=r"none\.obj: no such file"):
        hc.load_mesh(str(tmp_path / "none.obj"))
    with pytest.raises(hc.MeshFileError, match=r"use one of \.obj, \.ply, \.stl, \.dae"):
        hc.load_mesh(tmp_path / "m.step")
    monkeypatch.setenv("HOME", str(tmp_path))
    load("m.OBJ", _OBJ)
    assert hc.load_mesh("~/m.OBJ")[0].shape == (6, 3)
    if os.geteuid():
        (tmp_path / "m.OBJ").chmod(0)
        with pytest.raises(hc.MeshFileError, match="Permission denied"):
            hc.load_mesh(tmp_path / "m.OBJ")


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
    with pytest.raises(hc.MeshFileError, match=why) as caught:
        hc.load_mesh(path)
    assert len(str(caught.value)) < 500


@pytest.mark.parametrize("bad", [None, 3, b"mesh.obj", ["mesh.obj"]])
def test_what_is_no_path(bad):
    with pytest.raises(TypeError, match="^path: expected a string or os.PathLike, got"):
        hc.load_mesh(bad)


def test_without_earcut_it_says_what_to_install(load, monkeypatch):
    monkeypatch.setitem(sys.modules, "mapbox_earcut", None)
    assert len(load("m.obj", (variants._v() + variants._f(variants.MIXED)).encode())[1]) == 7, "convex ones need none"
    with pytest.raises(hc.MeshFileError, match="is not convex, .*pip install 'mapbox_earcut"):
        load("m.obj", (variants._v(ELL) + variants._f([range(6)])).encode())


def test_the_example_of_the_documentation_runs():
    code = "import doctest, hpccd_core.mesh_files.load as load; print(doctest.testmod(load))"
    done = subprocess.run([sys.executable, "-c", code], text=True, capture_output=True, timeout=100)
    assert done.stdout.strip() == "TestResults(failed=0, attempted=7)", done.stdout + done.stderr


def test_welding_lets_other_threads_go_on():
    """The longest time for which another thread cannot run is a small part of the whole, in CPU time."""
    n = 400
    grid = np.stack(np.meshgrid(np.arange(n) * 0.01, np.arange(n) * 0.01, [0.5]), axis=-1).reshape(-1, 3)
    points = np.random.default_rng(3).permutation(np.repeat(grid, 6, axis=0))
    shares = []
    for _ in range(5):
        done = threading.Event()
        ticks = [time.process_time()]

        def tick(done=done, ticks=ticks):
            while not done.wait(0.0005):
                ticks.append(time.process_time())

        thread = threading.Thread(target=tick)
        thread.start()
        first, vertex_of = joined(points)
        done.set()
        thread.join()
        ticks.append(time.process_time())
        assert len(first) == n * n and np.array_equal(points[first][vertex_of], points)
        shares.append(np.diff(ticks).max() / (ticks[-1] - ticks[0]))
        if shares[-1] < 0.4:
            return
    raise AssertionError(f"it held up the other thread for these parts of its time: {shares}")
