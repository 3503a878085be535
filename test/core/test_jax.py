# SPDX-License-Identifier: Apache-2.0
"""hpccd_core.jax: gradients against differences of exact roots, inside and outside of jit."""

import os
import re
import subprocess
import sys

import numpy as np
import pytest
from differentiated import OUTPUTS, exact_slopes, falling, sheet_and_ball, without_contact

import hpccd_core as hc

jax = pytest.importorskip("jax", reason="JAX comes with the extra jax")

import jax.numpy as jnp  # noqa: E402

from hpccd_core import jax as hcj  # noqa: E402


@pytest.fixture(autouse=True)
def _in_double_precision():
    jax.config.update("jax_enable_x64", True)
    yield
    jax.config.update("jax_enable_x64", False)


def compiled(function):
    return jax.jit(function)


def as_it_is(function):
    return function


each_way = pytest.mark.parametrize("way", [compiled, as_it_is])


@each_way
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_times_against_differences_of_exact_roots(way, dtype):
    detector, start, end = sheet_and_ball(dtype=dtype)
    contacts = detector.detect(start, end)
    n, size = len(contacts), len(contacts) + 3

    def times(*positions):
        return hcj.times_of_impact(detector, *positions, size=size)

    rows = way(times)(start, end)
    assert rows.values.dtype == np.float64 and int(rows.count) == n
    assert rows.values[:n].tolist() == [*contacts.vf_toc, *contacts.ee_toc] and np.isinf(rows.values[n:]).all()
    assert np.array_equal(rows.vertices[:n], contacts.vertices) and (rows.vertices[n:] == -1).all()
    found = way(jax.jacrev(lambda *x: times(*x).values, argnums=(0, 1)))(start, end)
    assert all(g.dtype == dtype and not g[n:].any() for g in found)
    d0, d1 = np.random.default_rng(1).integers(-8, 9, (2, *start.shape))
    expected = exact_slopes(contacts, start, end, d0, d1)
    terms = [np.asarray(g[:n], float) * d for g, d in zip(found, (d0, d1), strict=True)]
    slopes, scale = sum(x.sum((1, 2)) for x in terms), sum(np.abs(x).sum((1, 2)) for x in terms)
    simple = np.isfinite(expected)
    assert simple.sum() > 0.9 * n
    assert (np.abs(slopes - expected)[simple] <= 1e-6 * scale[simple]).all()
    summed = way(jax.grad(lambda *x: times(*x).values[:n].sum()))(start, end)  # many rows have a vertex in common
    np.testing.assert_allclose(summed, found[0].sum(0), rtol=1e-5, atol=1e-5 * np.abs(found[0]).max())


@each_way
def test_distances(way):
    detector, start, _ = sheet_and_ball()
    change = 1e-5 * np.random.default_rng(3).normal(size=start.shape)
    near = detector.proximity(start, 0.3)

    def within(x):
        return hcj.proximity_distances(detector, x, 0.3, size=len(near)).values

    def smallest(x):
        return hcj.smallest_distances(detector, x)

    assert way(within)(start).tolist() == [*near.vf_distance, *near.ee_distance]
    assert way(smallest)(start).tolist() == [gap.distance for gap in detector.distances(start)]
    for function in (within, smallest):
        expected = (function(start + change) - function(start - change)) / 2
        found = way(jax.jacrev(function))(start)
        np.testing.assert_allclose((found * change).sum((1, 2)), expected, atol=1e-8)


def test_the_count_tells_what_is_left_out():
    detector, start, end = sheet_and_ball()
    whole = hcj.times_of_impact(detector, start, end, size=1000)
    for size in (0, 1, 7):
        part = hcj.times_of_impact(detector, start, end, size=size)
        assert part.values.tolist() == whole.values[:size].tolist() and int(part.count) == int(whole.count) > 7
    near = hcj.proximity_distances(detector, start, 0.3, size=2)
    assert int(near.count) == len(detector.proximity(start, 0.3))


def test_many_worlds_are_each_as_alone():
    worlds = 3
    steps = [sheet_and_ball(seed) for seed in range(worlds)]
    detector, _, _ = sheet_and_ball(worlds=worlds)
    start, end = (np.stack([step[k] for step in steps]) for k in (1, 2))

    def loss(detector, start, end):
        first = hcj.first_time_of_impact(detector, start, end)
        smallest = hcj.smallest_distances(detector, start)
        times = hcj.times_of_impact(detector, start, end, size=800).values
        return jnp.where(jnp.isfinite(times), times, 0).sum() + first.sum() + jnp.square(smallest).sum()

    assert hcj.first_time_of_impact(detector, start, end).shape == (worlds,)
    assert hcj.smallest_distances(detector, start).shape == (worlds, 2)
    together = jax.grad(loss, argnums=(1, 2))(detector, start, end)
    for k, (one, *ends) in enumerate(steps):
        for ours, all_worlds in zip(jax.grad(loss, argnums=(1, 2))(one, *ends), together, strict=True):
            np.testing.assert_allclose(ours, all_worlds[k], rtol=1e-12, atol=1e-12)
    rows = hcj.times_of_impact(detector, start, end, size=800)
    of_worlds = rows.vertices[: int(rows.count)] // detector.n_vertices
    assert sorted(set(of_worlds.ravel().tolist())) == [0, 1, 2]


@pytest.mark.parametrize("worlds", [None, 2])
def test_without_contacts(worlds):
    detector, start, end = without_contact(worlds=worlds)
    if worlds is not None:
        start, end = (np.stack([x] * worlds) for x in (start, end))

    def loss(start, end):  # infinite, and so are its derivatives by the times
        rows = hcj.times_of_impact(detector, start, end, size=2)
        return jnp.square(rows.values - 1).sum() + jnp.square(hcj.first_time_of_impact(detector, start, end) - 1).sum()

    value, gradients = jax.value_and_grad(loss, argnums=(0, 1))(start, end)
    assert np.isinf(value) and all(not g.any() for g in gradients)
    assert int(hcj.times_of_impact(detector, start, end, size=2).count) == 0


def test_scenes_without_vertices():
    scene = hc.Scene()
    scene.add_mesh("none", n_vertices=0)
    detector, none = hc.Detector(scene, outputs=OUTPUTS), np.zeros((0, 3))
    gradient = jax.grad(lambda x: hcj.times_of_impact(detector, x, none, size=2).values.sum())(none)
    assert gradient.shape == (0, 3) and hcj.smallest_distances(detector, none).shape == (1,)


def test_zero_where_there_is_no_derivative():
    detector, start, end = falling()
    start[0, 2] = 0  # touches already
    assert hcj.first_time_of_impact(detector, start, end) == 0
    gradients = jax.grad(lambda *x: hcj.first_time_of_impact(detector, *x), argnums=(0, 1))(start, end)
    assert all(not g.any() for g in gradients)


def test_transforms():
    detector, start, end = falling()

    def time(start, end):
        return hcj.first_time_of_impact(detector, start, end)

    value, gradient = jax.value_and_grad(time, argnums=1)(start, end)
    assert value == 0.5 and gradient[0].tolist() == [0, 0, 0.25]
    starts = jnp.stack([start, start + np.array([0, 0, 1.0]) * (np.arange(6) < 3)[:, None]])
    assert jax.vmap(time, in_axes=(0, None))(starts, end).tolist() == pytest.approx([0.5, 2 / 3])
    gradients = jax.vmap(jax.grad(time), in_axes=(0, None))(starts, end)
    assert gradients[:, 0, 2].tolist() == pytest.approx([1 / 4, 1 / 9])
    for forbidden in (jax.hessian(time), jax.jacfwd(time), jax.grad(lambda x, y: jax.grad(time)(x, y).sum())):
        with pytest.raises((TypeError, ValueError)):
            forbidden(start, end)


@pytest.mark.parametrize("change, message", [
    (lambda x: x.astype(np.float16), "expected float32 or float64, got dtype float16; convert with vertices_t1.astype"),
    (lambda x: x.astype(int), "expected float32 or float64, got dtype int64; convert with vertices_t1.astype"),
    (lambda x: x.T, "expected shape (6, 3), "),
    (lambda x: x[:5], "expected shape (6, 3), "),
])  # fmt: skip
@each_way
def test_rejected_positions(way, change, message):
    detector, start, end = falling()
    with pytest.raises((TypeError, ValueError), match=f"^vertices_t1: {re.escape(message)}"):
        way(lambda x, y: hcj.first_time_of_impact(detector, x, y))(start, change(end))


def test_rejected_detectors_sizes_and_coordinates():
    detector, start, end = falling()
    with pytest.raises(TypeError, match="^detector: expected hpccd_core.Detector, got NoneType"):
        hcj.smallest_distances(None, start)
    with pytest.raises(ValueError, match=r"outputs=\('normals', 'weights'\)$"):
        hcj.first_time_of_impact(hc.Detector(hc.Scene()), start, end)
    with pytest.raises(ValueError, match="^size: "):
        hcj.times_of_impact(detector, start, end, size=-1)
    with pytest.raises(TypeError, match="^size: expected a number, got a traced value; make it a static argument"):
        jax.jit(lambda n: hcj.times_of_impact(detector, start, end, size=n))(2)
    with pytest.raises(TypeError, match="^distance: expected a number, got a traced value"):
        jax.grad(lambda d: hcj.proximity_distances(detector, start, d, size=2).values[0])(1.0)
    with pytest.raises(TypeError, match="^vertices: expected an array, got dict; concatenate the meshes"):
        hcj.smallest_distances(detector, {"falling": start})
    with pytest.raises(TypeError, match="; for derivatives see hpccd_core.jax"):
        jax.jit(detector.distances)(start)
    any_contact = hc.Detector(hc.Scene(), outputs=("normals", "weights"), report="any")
    with pytest.raises(ValueError, match="^detector: .*no contact is surely the earliest; use report='first'$"):
        hcj.first_time_of_impact(any_contact, start, end)
    end[0, 0] = np.nan
    with pytest.raises(jax.errors.JaxRuntimeError, match=r"vertices_t1\[0, 0\] is NaN"):
        jax.block_until_ready(hcj.first_time_of_impact(detector, start, end))


def test_single_precision():
    detector, start, end = falling()
    jax.config.update("jax_enable_x64", False)
    value, gradient = jax.value_and_grad(lambda x: hcj.first_time_of_impact(detector, x, end))(start)
    assert value.dtype == gradient.dtype == np.float32 and gradient[0].tolist() == [0, 0, 0.25]


def test_large_scenes_on_one_core():
    """Callbacks of JAX wait for copies that need their own thread: with pure_callback most runs of this never end."""
    program = """
import numpy as np, jax, hpccd_core as hc
from hpccd_core import jax as hcj, shapes
vertices, faces = shapes.grid(300, 300)
scene = hc.Scene()
scene.add_mesh("sheet", faces)
detector = hc.Detector(scene, outputs=("normals", "weights"))
time = jax.jit(jax.grad(lambda x, y: hcj.first_time_of_impact(detector, x, y)))
for step in range(8):
    print(time(vertices, vertices + 0.1 * step).shape)
"""
    core = min(os.sched_getaffinity(0))
    done = subprocess.run(
        [sys.executable, "-c", f"import os; os.sched_setaffinity(0, [{core}])\n{program}"],
        capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    assert done.stdout == 8 * "(90601, 3)\n", done.stderr
