# SPDX-License-Identifier: Apache-2.0
"""The floating-point mode that another library has set in a thread changes no result, and is restored afterwards."""

import contextlib
import ctypes
import dataclasses
import itertools
import platform
import struct

import mesh_file_variants as variants
import numpy as np
import pytest
import random_scenes

import hpccd_core as hc

pytestmark = pytest.mark.skipif(
    platform.machine() != "x86_64" or platform.libc_ver()[0] != "glibc", reason="fenv_t is known of glibc on x86-64"
)
MODES = {"flush to zero": 0x8040, "upward": 0x4000, "downward": 0x2000}  # bits of MXCSR


def _environment():
    environment = ctypes.create_string_buffer(32)
    assert ctypes.CDLL(None).fegetenv(environment) == 0
    return environment


@contextlib.contextmanager
def arithmetic(bits):
    before, set_ = _environment(), _environment()
    set_[28:32] = struct.pack("<I", struct.unpack("<I", before[28:32])[0] | bits)
    ctypes.CDLL(None).fesetenv(set_)
    try:
        yield
        assert struct.unpack("<I", _environment()[28:32])[0] & 0xE040 == bits, "it stays as the caller had it"
    finally:
        ctypes.CDLL(None).fesetenv(before)


def same(query, bits):
    expected = query()
    with arithmetic(bits):
        found = query()
    return found, expected


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("test", [hc.test_vertex_face, hc.test_edge_edge])
@pytest.mark.parametrize(("dtype", "scale"), [(np.float64, 1e-310), (np.float32, 1e-40), (np.float64, 0.1)])
def test_elementary_queries(test, mode, dtype, scale):
    queries = (np.random.default_rng(0).integers(-9, 10, (500, 8, 3)) * scale).astype(dtype)
    for d in (0.0, 2 * scale):
        found, expected = same(lambda d=d: test(queries, minimum_separation=d), MODES[mode])
        assert expected[0].any() and not expected[0].all()
        for x, y in zip(found, expected, strict=True):
            assert x.tobytes() == y.tobytes()


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("scale", [1.0, 2.0**-1050])
def test_detectors(mode, scale):
    meshes = random_scenes.many_meshes(np.random.default_rng(1))
    start, end, d = meshes.vertices_t0 * scale, meshes.vertices_t1 * scale, 0.125 * scale

    def results():
        detector = hc.Detector(meshes.scene(), threads=2, outputs=("points", "normals", "closest"), backend="cpu")
        detector.set_separation(0, 1, d)
        near, gaps = detector.proximity(start, d), detector.distances(start)
        return detector.detect(start, end), near, gaps, detector.collision_free_step(start, end)

    found, expected = same(results, MODES[mode])
    assert len(expected[0]) and len(expected[1]) and found == expected


@pytest.mark.parametrize("mode", MODES)
def test_motions_of_two_dtypes(mode):
    scene = hc.Scene()
    scene.add_mesh("v", n_vertices=1)
    scene.add_mesh("f", [[0, 1, 2]])
    end = np.array([[0, 0, -1], [-9, -9, 0], [9, -9, 0], [0, 9, 0]]) * 1e-40
    start = (end * [1, 1, -1]).astype(np.float32)
    detector = hc.Detector(scene, backend="cpu", outputs=("normals",))
    found, expected = same(lambda: detector.detect(start, end), MODES[mode])
    assert expected.vf.tolist() == [[0, 0]] and found == expected


DENORMAL = np.float32(3e-45)
FLAT = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)


def two_triangles():
    scene = hc.Scene()
    scene.add_mesh("a", [[0, 1, 2]])
    scene.add_mesh("b", [[0, 1, 2]])
    return scene


@pytest.mark.parametrize("mode", MODES)
def test_lengths_of_another_type(mode):
    """Lengths become float64 before the core gets them."""
    there = np.vstack([FLAT, FLAT + [0, 0, 2e-45]])

    def results():
        of_options = hc.Detector(two_triangles(), minimum_separation=DENORMAL, backend="cpu")
        of_scene = two_triangles()
        of_scene.set_separation("a", "b", DENORMAL)
        of_detector = [hc.Detector(two_triangles(), backend="cpu") for _ in range(3)]
        of_detector[0].set_separation("a", "b", DENORMAL)
        of_detector[1].set_separations(np.full((2, 2), DENORMAL))
        of_detector[2].set_separations([[0.0, DENORMAL], [DENORMAL, 0.5]])
        detectors = of_options, hc.Detector(of_scene, backend="cpu"), *of_detector
        found = [len(d.detect(there, there)) for d in detectors] + [len(of_options.proximity(there, DENORMAL))]
        query = [there[3] + [0.2, 0.2, 0], *FLAT]
        return [*found, hc.test_vertex_face([query * 2], minimum_separation=DENORMAL)[0].tolist()]

    found, expected = same(results, MODES[mode])
    assert all(expected) and found == expected


@pytest.mark.parametrize("mode", MODES)
def test_negative_lengths(mode):
    def ask():
        for d in (-5e-324, -DENORMAL):
            with pytest.raises(ValueError, match="must be finite and not negative"):
                hc.Detector(two_triangles(), minimum_separation=d)
        hc.Detector(two_triangles(), minimum_separation=-0.0)

    same(ask, MODES[mode])


@pytest.mark.parametrize("mode", MODES)
def test_equality(mode):
    contacts = hc.Detector(two_triangles(), backend="cpu", outputs=("closest",)).detect(*[np.vstack([FLAT, FLAT])] * 2)
    assert len(contacts)

    def results():
        equal = []
        for x, y in ((0.0, 5e-324), (0.0, -0.0), (np.nan, np.nan), (1.0, 2.0)):
            filled = [{"closest": np.full_like(contacts.closest, z)} for z in (x, y)]
            pair = [dataclasses.replace(contacts, outputs=outputs) for outputs in filled]
            times = [dataclasses.replace(contacts, first_toc=z) for z in (x, y)]
            equal += [pair[0] == pair[1], times[0] == times[1]]
        return equal

    found, expected = same(results, MODES[mode])
    assert found == expected == [False, False, True, True, True, True, False, False]


def mesh_files(folder):
    """Files of each format whose numbers have to be rounded, or are denormal."""
    rng = np.random.default_rng(4)
    ell = 1.1 * np.array(variants.ELL)
    denormal = [rng.normal(size=(20, 3)) * 1e-310, [[1e-40, 3e-45, -7e-39]]]
    vertices = np.concatenate([rng.normal(size=(60, 3)), *denormal, ell])
    n = len(vertices)
    faces = [[k, k + 1, k + 2] for k in range(n - 2)]
    data = {"m.obj": (variants._v(vertices) + variants._f([*faces, range(n - 6, n)])).encode(), "m.dae": dae(vertices)}
    for kind, form in itertools.product(("float", "double"), variants.FORMS):
        rows = [("vertex", dict.fromkeys("xyz", kind), [tuple(p) for p in vertices])]
        rows.append(("face", {"vertex_indices": ("uchar", "int")}, [(face,) for face in faces]))
        data[f"{kind}-{form}.ply"] = variants.ply(form, rows)
    corners = vertices[np.array(faces)]
    data["m.stl"], data["text.stl"] = variants.stl(triangles=corners), variants.text_stl(triangles=corners)
    for name, content in data.items():
        (folder / name).write_bytes(content)
    return [folder / name for name in data]


def dae(vertices):
    import test_collada_files  # skips where pycollada is missing

    return test_collada_files.dae(
        vertices=vertices,
        asset='<unit name="inch" meter="0.0254"/>',
        nodes='<node><rotate>1 2 3 40</rotate><instance_geometry url="#g"/></node>',
    ).encode()


@pytest.mark.parametrize("mode", MODES)
def test_mesh_files(mode, tmp_path):
    pytest.importorskip("mapbox_earcut")
    for file in mesh_files(tmp_path):
        found, expected = same(lambda file=file: hc.load_mesh(file), MODES[mode])
        for x, y in zip(found, expected, strict=True):
            assert x.tobytes() == y.tobytes(), file.name
    with arithmetic(MODES[mode]), pytest.raises(hc.MeshFileError):
        hc.load_mesh(tmp_path / "none.obj")
