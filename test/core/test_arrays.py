# SPDX-License-Identifier: Apache-2.0
"""Accepted layouts of arrays; suitable ones are read in place."""

import threading
import tracemalloc

import numpy as np
import pytest
import random_scenes

import hpccd_core as hc
from hpccd_core import _core, shapes


@pytest.fixture
def meshes():
    return random_scenes.single_mesh(np.random.default_rng(3))


@pytest.fixture
def expected(meshes):
    return hc.Detector(meshes.scene()).detect(meshes.vertices_t0, meshes.vertices_t1).hash


def _strided(array):
    wide = np.full((2 * len(array), *array.shape[1:-1], 5), np.nan)
    wide[::2, ..., 1:4] = array
    return wide[::2, ..., 1:4]


def _misaligned(array):
    raw = bytearray(1) + array.tobytes()
    view = np.frombuffer(raw, array.dtype, offset=1).reshape(array.shape)
    assert not view.flags.aligned
    return view


def _read_only(array):
    array = array.copy()
    array.flags.writeable = False
    return array


LAYOUTS = [
    np.asfortranarray,
    _strided,
    _misaligned,
    _read_only,
    lambda a: a.astype(">f8"),
    lambda a: a[::-1].copy()[::-1],
    lambda a: a.tolist(),
]


@pytest.mark.parametrize("layout", LAYOUTS)
def test_layout_changes_nothing(meshes, expected, layout):
    contacts = hc.Detector(meshes.scene()).detect(layout(meshes.vertices_t0), layout(meshes.vertices_t1))
    assert contacts.hash == expected


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("worlds", [None, 2])
def test_layout_changes_nothing_mesh_by_mesh(layout, worlds):
    """Positions as a dict: numpy concatenates arrays in Fortran order to one in Fortran order."""
    random = np.random.default_rng(5)
    vertices, faces = shapes.icosphere(1)
    scene = hc.Scene()
    for name in ("left", "right"):
        scene.add_mesh(name, faces)
    copies = 1 if worlds is None else worlds
    ends = random.uniform(-1, 1, (2, copies, 2 * len(vertices), 3))
    start, end = ends[:, 0] if worlds is None else ends
    detector = hc.Detector(scene, worlds=worlds)

    def by_mesh(positions):
        of_left, of_right = np.split(positions, 2, axis=-2)
        return {"right": layout(of_right), "left": layout(of_left)}

    truth = detector.detect(start, end)
    assert len(truth) > 100 and detector.detect(by_mesh(start), by_mesh(end)) == truth
    assert detector.proximity(by_mesh(start), 0.05) == detector.proximity(start, 0.05)


def test_the_core_itself_takes_only_rows(meshes):
    start, end = np.asfortranarray(meshes.vertices_t0), np.ascontiguousarray(meshes.vertices_t1)
    with pytest.raises(ValueError, match="must be C-contiguous"):
        _core.Positions(start)
    with pytest.raises(TypeError, match="incompatible"):
        hc.Detector(meshes.scene())._core.detect(start, end)


@pytest.mark.parametrize("dtype", [np.int8, np.uint8, np.int16, np.int32, np.uint32, np.int64, np.uint64, ">i4"])
def test_dtype_of_faces_changes_nothing(meshes, expected, dtype):
    scene = hc.Scene()
    scene.add_mesh("sheet", np.asfortranarray(meshes.faces[0].astype(dtype)))
    assert hc.Detector(scene).detect(meshes.vertices_t0, meshes.vertices_t1).hash == expected


def test_inputs_are_left_as_they_were(meshes):
    v0, v1, faces = meshes.vertices_t0.copy(), meshes.vertices_t1.copy(), meshes.faces[0].copy()
    hc.Detector(meshes.scene(), outputs=("points", "normals")).detect(meshes.vertices_t0, meshes.vertices_t1)
    assert np.array_equal(v0, meshes.vertices_t0) and np.array_equal(v1, meshes.vertices_t1)
    assert np.array_equal(faces, meshes.faces[0])


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_arrays_in_order_are_not_copied(dtype):
    n = 100_000
    scene = hc.Scene()
    scene.add_mesh("particles", np.empty((0, 3), int), n_vertices=n)
    v0 = np.random.default_rng(0).random((n, 3)).astype(dtype)
    v1 = v0 + dtype(1e-4)
    detector = hc.Detector(scene)
    detector.detect(v0, v1)
    tracemalloc.start()  # sees what numpy allocates
    try:
        detector.detect(v0, v1)
        peak = tracemalloc.get_traced_memory()[1]
        detector.detect(_strided(v0).astype(dtype)[:, ::-1][:, ::-1], np.asfortranarray(v1))
        assert tracemalloc.get_traced_memory()[1] >= v1.nbytes, "a copy would be seen"
    finally:
        tracemalloc.stop()
    assert peak < v0.nbytes / 10


def test_results_outlive_detector_and_next_step(meshes):
    detector = hc.Detector(meshes.scene())
    contacts = detector.detect(meshes.vertices_t0, meshes.vertices_t1)
    vf, toc = contacts.vf.copy(), contacts.vf_toc.copy()
    detector.detect(meshes.vertices_t1, meshes.vertices_t0)
    del detector
    assert np.array_equal(vf, contacts.vf) and np.array_equal(toc, contacts.vf_toc)


def test_other_python_threads_run_during_a_call():
    """Detectors on several Python threads at once: the lock is released and they do not disturb each other."""
    meshes = random_scenes.combine(random_scenes.crumpled_sheet(np.random.default_rng(4), 14))
    expected = hc.Detector(meshes.scene()).detect(meshes.vertices_t0, meshes.vertices_t1).hash
    found = []

    def work():
        detector = hc.Detector(meshes.scene(), threads=2)
        for _ in range(5):
            found.append(detector.detect(meshes.vertices_t0, meshes.vertices_t1).hash)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == 20 * [expected]
