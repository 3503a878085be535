# SPDX-License-Identifier: Apache-2.0
"""hpccd_core.torch: gradients against differences of exact roots, and against PyTorch's own of a readable reference."""

import re

import numpy as np
import pytest
from differentiated import OUTPUTS, exact_slopes, falling, sheet_and_ball, without_contact

import hpccd_core as hc

torch = pytest.importorskip("torch", reason="PyTorch comes with the extra torch")

from hpccd_core import torch as hct  # noqa: E402


def tensors(*arrays, dtype=torch.float64):
    return [torch.tensor(x, dtype=dtype, requires_grad=True) for x in arrays]


def jacobian(values, *positions):
    """(n, V, 3) for each array of positions, by one batched backward pass."""
    rows = torch.eye(len(values), dtype=values.dtype)
    return [g.numpy() for g in torch.autograd.grad(values, positions, rows, is_grads_batched=True, retain_graph=True)]


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_times_against_differences_of_exact_roots(dtype):
    detector, start, end = sheet_and_ball(dtype=dtype)
    positions = tensors(start, end, dtype=torch.from_numpy(start).dtype)
    times, contacts = hct.times_of_impact(detector, *positions)
    assert contacts == detector.detect(start, end)
    assert times.dtype == torch.float64
    assert times.tolist() == [*contacts.vf_toc, *contacts.ee_toc] and min(len(contacts.vf), len(contacts.ee)) > 20
    found = jacobian(times, *positions)
    d0, d1 = np.random.default_rng(1).integers(-8, 9, (2, *start.shape))
    expected = exact_slopes(contacts, start, end, d0, d1)
    slopes = sum((g.astype(float) * d).sum((1, 2)) for g, d in zip(found, (d0, d1), strict=True))
    scale = sum(np.abs(g * d).sum((1, 2)) for g, d in zip(found, (d0, d1), strict=True))
    simple = np.isfinite(expected)
    assert simple.sum() > 0.9 * len(times)
    assert (np.abs(slopes - expected)[simple] <= 1e-6 * scale[simple]).all()
    times.sum().backward()  # many rows have a vertex in common
    for x, g in zip(positions, found, strict=True):
        assert x.grad.dtype == x.dtype
        np.testing.assert_allclose(x.grad, g.sum(0), rtol=1e-5, atol=1e-5 * np.abs(g).max())


PAIRS = {
    "vertex-face": [[0.25, 0.5, 1], [0, 0, 0], [1, 0.1, 0], [0.1, 1, 0.2]],
    "edge-edge": [[-1, 0.1, 1], [1, -0.1, 1.1], [0.1, -1, 0], [0, 1, 0.1]],
}


def detector_of_pair(kind, **options):
    scene = hc.Scene()
    if kind == "vertex-face":
        scene.add_mesh("vertex", n_vertices=1)
        scene.add_mesh("face", [[0, 1, 2]])
    else:
        scene.add_mesh("a", edges=[[0, 1]])
        scene.add_mesh("b", edges=[[0, 1]])
    return hc.Detector(scene, outputs=OUTPUTS, **options)


def gap(kind, x):
    """The distance of the vertex from the plane of the face, or of two lines."""
    p, a, b = (
        (x[0] - x[1], x[2] - x[1], x[3] - x[1]) if kind == "vertex-face" else (x[2] - x[0], x[1] - x[0], x[3] - x[2])
    )
    normal = torch.linalg.cross(a, b)
    return (p @ normal).abs() / normal.norm()


def time_at_gap(kind, start, end, separation):
    """Newton's method; PyTorch differentiates all of its iterations."""
    t = torch.tensor(0.4, dtype=start.dtype, requires_grad=True)
    for _ in range(20):
        value = gap(kind, start + t * (end - start)) - separation
        (slope,) = torch.autograd.grad(value, t, create_graph=True)
        t = t - value / slope
    return t


@pytest.mark.parametrize("separation", [0.125, 1e-3])
@pytest.mark.parametrize("kind", PAIRS)
def test_times_of_one_pair_against_pytorch(kind, separation):
    start = np.array(PAIRS[kind])
    end = start + np.random.default_rng(2).normal(0, 0.05, start.shape)
    end[: 1 if kind == "vertex-face" else 2, 2] -= 1.9
    positions = tensors(start, end)
    expected = time_at_gap(kind, *positions, separation)
    gradients = torch.autograd.grad(expected, positions)
    time = hct.first_time_of_impact(detector_of_pair(kind, minimum_separation=separation), *positions)
    assert time.shape == () and time.item() == pytest.approx(expected.item(), abs=1e-12)
    for found, reference in zip(torch.autograd.grad(time, positions), gradients, strict=True):
        np.testing.assert_allclose(found, reference, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("kind", PAIRS)
def test_distances_of_one_pair_against_pytorch(kind):
    detector, (x,) = detector_of_pair(kind), tensors(PAIRS[kind])
    expected = gap(kind, x)
    (gradient,) = torch.autograd.grad(expected, x)
    distances, near = hct.proximity_distances(detector, x, 2.0)
    row = distances.tolist().index(pytest.approx(expected.item(), abs=1e-12))
    assert near == detector.proximity(x.detach().numpy(), 2.0) and len(distances) == len(near)
    np.testing.assert_allclose(torch.autograd.grad(distances[row], x)[0], gradient, rtol=1e-6, atol=1e-9)
    smallest, gaps = hct.smallest_distances(detector, x)
    assert [g.distance for g in gaps] == smallest.tolist()
    between = [(g.mesh_a == g.mesh_b) for g in gaps].index(False)
    assert smallest[between].item() == pytest.approx(expected.item(), abs=1e-12)
    np.testing.assert_allclose(torch.autograd.grad(smallest[between], x)[0], gradient, rtol=1e-6, atol=1e-9)


def test_distances_of_many_pairs():
    """Along a change, distances are linear but for a second order."""
    detector, start, _ = sheet_and_ball()
    (x,) = tensors(start)
    change = 1e-5 * np.random.default_rng(3).normal(size=start.shape)
    for function, arguments in ((hct.proximity_distances, (0.3,)), (hct.smallest_distances, ())):
        distances, _ = function(detector, x, *arguments)
        (of_x,) = jacobian(distances, x)
        ends = [function(detector, torch.tensor(start + s * change), *arguments)[0] for s in (-1, 1)]
        expected = (ends[1] - ends[0]).numpy() / 2
        np.testing.assert_allclose((of_x * change).sum((1, 2)), expected, atol=1e-8)


def test_many_worlds_are_each_as_alone():
    worlds = 3
    steps = [sheet_and_ball(seed) for seed in range(worlds)]
    detector, _, _ = sheet_and_ball(worlds=worlds)
    together = tensors(*(np.stack([step[k] for step in steps]) for k in (1, 2)))
    first = hct.first_time_of_impact(detector, *together)
    smallest, gaps = hct.smallest_distances(detector, together[0])
    times, contacts = hct.times_of_impact(detector, *together)
    near, found = hct.proximity_distances(detector, together[0], 0.3)
    assert first.shape == (worlds,) and smallest.shape == (worlds, len(gaps[0]))
    every = torch.autograd.grad(times.square().sum() + near.square().sum(), together, retain_graph=True)
    firsts = torch.autograd.grad(first.sum() + smallest.square().sum(), together)
    for k, (one, start, end) in enumerate(steps):
        alone = tensors(start, end)
        time, (distances, _) = hct.first_time_of_impact(one, *alone), hct.smallest_distances(one, alone[0])
        assert time.item() == first[k].item() and distances.tolist() == smallest[k].tolist()
        for ours, all_worlds in zip(torch.autograd.grad(time + distances.square().sum(), alone), firsts, strict=True):
            assert torch.equal(ours, all_worlds[k])
        loss = hct.times_of_impact(one, *alone)[0].square().sum()
        loss = loss + hct.proximity_distances(one, alone[0], 0.3)[0].square().sum()
        for ours, all_worlds in zip(torch.autograd.grad(loss, alone), every, strict=True):
            np.testing.assert_allclose(ours, all_worlds[k], rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("worlds", [None, 2])
def test_without_contacts(worlds):
    detector, start, end = without_contact(worlds=worlds)
    positions = tensors(*(x if worlds is None else np.stack([x] * worlds) for x in (start, end)))
    times, contacts = hct.times_of_impact(detector, *positions)
    first = hct.first_time_of_impact(detector, *positions)
    assert times.shape == (0,) and len(contacts) == 0 and torch.isinf(first).all()
    loss = times.sum() + (first - 1).square().sum()  # infinite, and so are its derivatives by the times
    assert all(not g.any() for g in torch.autograd.grad(loss, positions))


def test_zero_where_there_is_no_derivative():
    detector, start, end = falling()
    start[0, 2] = 0  # touches already
    positions = tensors(start, end)
    first = hct.first_time_of_impact(detector, *positions)
    smallest, gaps = hct.smallest_distances(detector, positions[0])
    assert first.item() == 0 and 0 in smallest
    loss = first + smallest[torch.isfinite(smallest)].sum()
    assert all(not g.any() for g in torch.autograd.grad(loss, positions))


def test_gradients_where_they_are_needed():
    detector, start, end = falling()
    for wanted in (0, 1):
        positions = [torch.tensor(x, requires_grad=k == wanted) for k, x in enumerate((start, end))]
        hct.first_time_of_impact(detector, *positions).backward()
        assert [x.grad is not None for x in positions] == [k == wanted for k in (0, 1)]
        assert positions[wanted].grad[0].tolist() == [0, 0, 0.25]
    with torch.no_grad():
        assert not hct.first_time_of_impact(detector, *tensors(start, end)).requires_grad
    assert not hct.first_time_of_impact(detector, torch.tensor(start), torch.tensor(end)).requires_grad


def test_transforms():
    detector, start, end = falling()
    x0, x1 = torch.tensor(start), torch.tensor(end)

    def time(start, end=x1):
        return hct.first_time_of_impact(detector, start, end)

    def rows(start):
        return hct.times_of_impact(detector, start, x1)[0]

    assert torch.func.grad(time)(x0)[0].tolist() == [0, 0, 0.25]
    assert torch.func.jacrev(rows)(x0)[0, 0].tolist() == [0, 0, 0.25]
    with pytest.raises(NotImplementedError, match="first derivatives only"):
        torch.autograd.functional.hessian(time, x0)
    with pytest.raises(NotImplementedError, match="first derivatives only"):
        torch.func.grad(lambda start: torch.func.grad(time)(start).sum())(x0)
    with pytest.raises(NotImplementedError, match="no vmap; create the detector with worlds="):
        torch.func.vmap(time)(x0[None], x1[None])


def test_tensors_in_any_memory_layout():
    detector, start, end = falling()
    for change in (
        lambda x: x.repeat_interleave(2, 0)[::2],
        lambda x: x.T.contiguous().T,
        lambda x: torch.complex(x, -x).conj().imag,  # a view that numpy does not have: negated when it is read
    ):
        x = torch.tensor(start, requires_grad=True)
        time = hct.first_time_of_impact(detector, change(x), torch.tensor(end))
        time.backward()
        assert time == 0.5 and x.grad[0].tolist() == [0, 0, 0.25]


@pytest.mark.parametrize("change, message", [
    (lambda x: x.half(), "expected float32 or float64, got torch.float16; convert with vertices_t1.double()"),
    (lambda x: x.bfloat16(), "expected float32 or float64, got torch.bfloat16; convert with vertices_t1.double()"),
    (lambda x: x.int(), "expected float32 or float64, got torch.int32; convert with vertices_t1.double()"),
    (lambda x: {"faces": x}, "expected torch.Tensor, got dict; use torch.cat of the meshes in the order added"),
    (lambda x: x.numpy(), "expected torch.Tensor, got ndarray; use torch.as_tensor(vertices_t1)"),
    (lambda x: x.to_sparse(), "expected a dense tensor, got torch.sparse_coo; convert with vertices_t1.to_dense()"),
    (lambda x: x.T, "expected shape (6, 3), "),
    (lambda x: x[:5], "expected shape (6, 3), "),
])  # fmt: skip
@pytest.mark.parametrize("function", [hct.times_of_impact, hct.first_time_of_impact])
def test_rejected_positions(function, change, message):
    detector, start, end = falling()
    with pytest.raises((TypeError, ValueError), match=f"^vertices_t1: {re.escape(message)}"):
        function(detector, torch.tensor(start), change(torch.tensor(end)))


def test_rejected_detectors():
    x = torch.zeros(6, 3)
    scene = hc.Scene()
    scene.add_mesh("faces", [[0, 1, 2], [3, 4, 5]])
    with pytest.raises(TypeError, match=r"^detector: expected hpccd_core.Detector, got Scene; create one of a Scene$"):
        hct.first_time_of_impact(scene, x, x)
    closest = hc.Detector(scene, outputs=("closest",))
    with pytest.raises(ValueError, match=r"create it with outputs=\('closest', 'normals', 'weights'\)$"):
        hct.proximity_distances(closest, x, 1.0)
    any_contact = hc.Detector(scene, outputs=OUTPUTS, report="any")
    with pytest.raises(ValueError, match="^detector: .*no contact is surely the earliest; use report='first'$"):
        hct.first_time_of_impact(any_contact, x, x)
    with pytest.raises(TypeError, match="^vertices: .*; for derivatives see hpccd_core.torch$"):
        closest.distances(x.requires_grad_())
    x = x.detach()
    hct.smallest_distances(closest, x)  # gaps always have their weights
    if "gpu" in hc.backends():
        on_device = hc.Detector(scene, outputs=OUTPUTS, results="device")
        with pytest.raises(ValueError, match="^detector: gradients are computed on the host; .* results='host'$"):
            hct.times_of_impact(on_device, x, x)


def test_in_a_compiled_function():
    detector, start, end = falling()
    time = torch.compiler.disable(hct.first_time_of_impact)
    start, x = tensors(start, end)
    loss = torch.compile(lambda x: 2 * time(detector, start, x), backend="eager")
    (gradient,) = torch.autograd.grad(loss(x), x)
    assert gradient[0].tolist() == [0, 0, 0.5]


@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a GPU that PyTorch can use")
def test_tensors_on_a_gpu():
    detector, start, end = sheet_and_ball()
    on_host, on_device = tensors(start, end), [x.detach().cuda().requires_grad_() for x in tensors(start, end)]
    (here, _), (there, _) = (hct.times_of_impact(detector, *positions) for positions in (on_host, on_device))
    assert there.is_cuda and torch.equal(there.cpu(), here)
    gradients = [torch.autograd.grad(t.sum(), x) for t, x in ((here, on_host), (there, on_device))]
    for ours, of_device in zip(*gradients, strict=True):
        np.testing.assert_allclose(of_device.cpu(), ours, rtol=1e-12, atol=1e-12)
