# SPDX-License-Identifier: Apache-2.0
"""hpccd_core.warp with real Newton models on Warp's CPU device. test/gpu has the device."""

import gc
import re

import numpy as np
import pytest

import hpccd_core as hc

newton = pytest.importorskip("newton", reason="Newton comes with the extra newton")

import warp as wp  # noqa: E402

from hpccd_core import warp as hcw  # noqa: E402

wp.config.log_level = wp.LOG_WARNING
SIZE = 6


def cloths(heights=(0.0, 0.25), seed=0):
    """A builder with crumpled grids of cloth at some heights."""
    rng = np.random.default_rng([4, seed])
    builder = newton.ModelBuilder()
    vertices, faces = hc.shapes.grid(SIZE, SIZE)
    for height in heights:
        bent = vertices + rng.normal(0, 0.03, vertices.shape) + [0, 0, height]
        builder.add_cloth_mesh(
            pos=wp.vec3(0, 0, 0),
            rot=wp.quat_identity(),
            scale=1.0,
            vertices=[wp.vec3(*x) for x in bent.tolist()],
            indices=faces.ravel().tolist(),
            vel=wp.vec3(0, 0, 0),
            density=0.1,
        )
    return builder


def moved(model, seed=1):
    """Two states; the vertices move at random."""
    start, end = model.state(), model.state()
    x = end.particle_q.numpy()
    x += np.random.default_rng(seed).normal(0, 0.2, x.shape).astype(np.float32)
    return start, end


def test_contacts_are_those_of_the_meshes():
    builder = cloths()
    model = builder.finalize(device="cpu")
    start, end = moved(model)
    scene = hcw.scene_of(model)
    assert scene.n_vertices == model.particle_count and hcw.worlds_of(model) is None
    found = hc.Detector(scene).detect(hcw.positions(model, start), hcw.positions(model, end))

    faces = hc.shapes.grid(SIZE, SIZE)[1]
    plain = hc.Scene()
    plain.add_mesh("both", np.concatenate([faces, faces + (SIZE + 1) ** 2]))
    x0, x1 = start.particle_q.numpy().astype(np.float64), end.particle_q.numpy().astype(np.float64)
    assert found == hc.Detector(plain).detect(x0, x1) and len(found.vf) > 10 and len(found.ee) > 50


def test_nothing_is_copied():
    model = cloths().finalize(device="cpu")
    start, end = moved(model)
    for state in (start, end.particle_q):
        array = hcw.positions(model, state)
        assert array.ctypes.data == getattr(state, "particle_q", state).ptr and array.dtype == np.float32
        assert hc.arguments.vertices("x", array, array.shape, None) is array, "the core reads it in place"
    contacts = hc.Detector(hcw.scene_of(model), outputs=("points", "weights")).detect(start.particle_q, end.particle_q)
    found = hcw.arrays(contacts)
    for name in ("vf", "vf_toc", "ee", "ee_toc", "points", "vertices", "weights"):
        array = getattr(contacts, name)
        assert found[name].ptr == array.ctypes.data and found[name].shape == array.shape
        assert found[name].dtype is wp.dtype_from_numpy(array.dtype)
    kept = contacts.vf_toc.tolist()
    del contacts, array
    gc.collect()
    assert found["vf_toc"].numpy().tolist() == kept


@wp.kernel
def count_contacts(vf: wp.array2d[wp.uint32], counts: wp.array[wp.int32]):
    wp.atomic_add(counts, wp.int32(vf[wp.tid(), 0]), 1)


def test_a_kernel_reads_the_contacts():
    model = cloths().finalize(device="cpu")
    start, end = moved(model)
    contacts = hc.Detector(hcw.scene_of(model)).detect(hcw.positions(model, start), hcw.positions(model, end))
    counts = wp.zeros(model.particle_count, dtype=wp.int32, device="cpu")
    vf = hcw.arrays(contacts)["vf"]
    wp.launch(count_contacts, dim=len(contacts.vf), inputs=[vf], outputs=[counts], device="cpu")
    assert counts.numpy().tolist() == np.bincount(contacts.vf[:, 0], minlength=model.particle_count).tolist()


def test_worlds():
    one, many = cloths(), newton.ModelBuilder()
    for _ in range(3):
        many.add_world(one)
    model, alone = many.finalize(device="cpu"), one.finalize(device="cpu")
    start, end = moved(model)
    scene = hcw.scene_of(model)
    assert (hcw.worlds_of(model), scene.n_vertices) == (3, alone.particle_count)
    x0, x1 = hcw.positions(model, start), hcw.positions(model, end)
    assert x0.shape == (3, alone.particle_count, 3) and x0.ctypes.data == start.particle_q.ptr
    contacts = hc.Detector(scene, worlds=hcw.worlds_of(model)).detect(x0, x1)
    single = hc.Detector(hcw.scene_of(alone))
    for k in range(3):
        assert contacts.world(k) == single.detect(x0[k], x1[k]) and len(contacts.world(k)) > 50
    assert hcw.arrays(contacts)["vf_offsets"].numpy().tolist() == contacts.vf_offsets.tolist()


def test_springs_of_ropes_are_edges_those_of_cloth_are_not():
    builder = cloths(heights=(0.0,))
    n = builder.particle_count
    for x in (-1.0, 0.0, 1.0):
        builder.add_particle(pos=wp.vec3(x, 0.05, 0.5), vel=wp.vec3(0, 0, 0), mass=0.1)
    for a, b in ((n, n + 1), (n + 1, n + 2), (0, n), (0, 2)):
        builder.add_spring(a, b, 1.0, 0.0, 0.0)
    model = builder.finalize(device="cpu")
    start, end = model.state(), model.state()
    hcw.positions(model, end)[n:, 2] -= 1
    scene = hcw.scene_of(model)
    contacts = hc.Detector(scene).detect(hcw.positions(model, start), hcw.positions(model, end))
    edges = {tuple(row) for row in contacts.ee[:, 2:].tolist()}
    assert edges == {(n, n + 1), (n + 1, n + 2)}, "the rope meets the cloth, the other springs do not"
    assert scene.n_vertices == n + 3


def test_proximity_and_intersections():
    model = cloths(heights=(0.0, 0.05)).finalize(device="cpu")
    x = hcw.positions(model, model.state())
    detector = hc.Detector(hcw.scene_of(model), outputs=("points",))
    near, crossing = detector.proximity(x, 0.05), detector.intersections(x)
    assert hcw.arrays(near)["vf_distance"].numpy().tolist() == near.vf_distance.tolist() != []
    assert hcw.arrays(crossing)["ef"].numpy().tolist() == crossing.ef.tolist() != []
    assert hcw.arrays(crossing)["points"].shape == (len(crossing), 3)


def differing():
    builder = newton.ModelBuilder()
    for heights in ((0.0,), (0.0, 1.0)):
        builder.add_world(cloths(heights))
    return builder


def in_world_and_none():
    builder = cloths()
    builder.add_world(cloths())
    return builder


@pytest.mark.parametrize(
    ("builder", "message"),
    [
        (newton.ModelBuilder, "model: has no particles; rigid shapes are not part of the scene"),
        (differing, "model: its worlds differ in particles or tri_indices; make a model of equal worlds"),
        (
            in_world_and_none,
            "model: has particles in worlds and others in none (world -1); add the latter to each world",
        ),
    ],
)
def test_models_that_are_rejected(builder, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        hcw.scene_of(builder().finalize(device="cpu"))


def test_states_that_are_rejected():
    model = cloths().finalize(device="cpu")
    n = model.particle_count
    for wrong, message in (
        (wp.zeros(3, dtype=wp.vec3, device="cpu"), f"for {n} particles, got vec3f of shape (3,)"),
        (wp.zeros(n, dtype=wp.vec3d, device="cpu"), f"for {n} particles, got vec3d of shape ({n},)"),
        (np.zeros((n, 3)), "got ndarray"),
        (wp.zeros(2 * n, dtype=wp.vec3, device="cpu")[::2], "state: must be C-contiguous"),
    ):
        with pytest.raises(ValueError, match=re.escape(message)):
            hcw.positions(model, wrong)


@pytest.mark.parametrize(
    "call", [hcw.scene_of, hcw.worlds_of, lambda builder: hcw.positions(builder, None)], ids=["scene", "worlds", "x"]
)
def test_a_builder_is_no_model(call):
    with pytest.raises(TypeError, match=re.escape("model: expected newton.Model, got ModelBuilder")):
        call(cloths())


def test_arrays_of_something_else_are_a_sentence():
    with pytest.raises(TypeError, match="^result: expected that of detect, .*distances, got list$"):
        hcw.arrays([])
