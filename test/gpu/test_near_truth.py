# SPDX-License-Identifier: Apache-2.0
"""Distance queries against the exact truth of published scenes."""

import numpy as np
import pytest

import hpccd_core as hc


def load(data_folder, name):
    path = data_folder / "distance" / f"{name}-distance.npz"
    if not path.exists():
        path = data_folder / "distance" / f"{name}.npz"
    if not path.exists():
        pytest.skip(f"{path} is not here")
    truth = np.load(path)
    motion = truth if "faces" in truth.files else np.load(data_folder / f"{name}.npz")
    scene = hc.Scene()
    scene.add_mesh("scene", motion["faces"], n_vertices=len(motion["vertices_t0"]))
    return truth, scene, motion["vertices_t0"], motion["vertices_t1"]


NAMES = pytest.mark.parametrize("name", ("cloth-ball", "cloth-funnel", "thick-cloth", "two-cubes"))


@NAMES
@pytest.mark.parametrize("backend", ("gpu", "hybrid"))
@pytest.mark.parametrize("accuracy", ("conservative", "exact"))
def test_separation(data_folder, name, backend, accuracy):
    truth, scene, t0, t1 = load(data_folder, name)
    for key in ("s", "s2", "s3"):
        if f"{key}_d" not in truth.files:
            continue
        options = {"minimum_separation": float(truth[f"{key}_d"]), "accuracy": accuracy}
        detector = hc.Detector(scene, backend=backend, **options)
        contacts = detector.detect(t0, t1)
        assert detector.backend == backend
        for kind in ("vf", "ee"):
            np.testing.assert_array_equal(getattr(contacts, kind), truth[f"{key}_{kind}"])
            tocs = getattr(contacts, f"{kind}_toc")
            np.testing.assert_allclose(tocs, truth[f"{key}_{kind}_toc"], rtol=0, atol=1e-12)
        assert contacts.hash == hc.Detector(scene, backend="cpu", **options).detect(t0, t1).hash


@NAMES
def test_proximity_and_intersections(data_folder, name):
    truth, scene, _, vertices = load(data_folder, name)
    size = np.abs(vertices).max()
    cpu, gpu = hc.Detector(scene, backend="cpu"), hc.Detector(scene, backend="gpu")
    for key in ("p", "p2"):
        if f"{key}_d" not in truth.files:
            continue
        distance = float(truth[f"{key}_d"])
        near = gpu.proximity(vertices, distance)
        assert gpu.backend == "gpu"
        for kind in ("vf", "ee"):
            np.testing.assert_array_equal(getattr(near, kind), truth[f"{key}_{kind}"])
            distances = getattr(near, f"{kind}_distance")
            np.testing.assert_allclose(distances, truth[f"{key}_{kind}_distance"], rtol=0, atol=1e-12 * size)
        assert near.hash == cpu.proximity(vertices, distance).hash
    hits = gpu.intersections(vertices)
    assert gpu.backend == "gpu"
    np.testing.assert_array_equal(hits.ef, truth["x_ef"])
    assert hits.hash == cpu.intersections(vertices).hash


@pytest.mark.parametrize("distance", (1e-4, 1e-3))
def test_many_bodies(data_folder, distance):
    """No truth of its own: the CPU's result, which tests of its own compare with integers."""
    data = np.load(data_folder / "n-body.npz")
    scene = hc.Scene()
    scene.add_mesh("scene", data["faces"], n_vertices=len(data["vertices_t0"]))
    t0, t1 = data["vertices_t0"], data["vertices_t1"]
    cpu, gpu = hc.Detector(scene, backend="cpu"), hc.Detector(scene, backend="gpu")
    assert gpu.proximity(t1, distance).hash == cpu.proximity(t1, distance).hash
    assert gpu.intersections(t1).hash == cpu.intersections(t1).hash
    hashes = {
        hc.Detector(scene, backend=b, minimum_separation=distance).detect(t0, t1).hash for b in ("cpu", "gpu", "hybrid")
    }
    assert len(hashes) == 1
