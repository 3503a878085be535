# SPDX-License-Identifier: Apache-2.0
"""hpccd_core.warp and hpccd_core.sensor on a GPU: nothing is copied, and results are those of the CPU."""

import numpy as np
import pytest

import hpccd_core as hc
from hpccd_core.sensor import ContactSensor

SIZE = 12


def bent(heights=(0.0, 0.25)):
    rng = np.random.default_rng(46)
    vertices, faces = hc.shapes.grid(SIZE, SIZE)
    sheets = [vertices + rng.normal(0, 0.02, vertices.shape) + [0, 0, height] for height in heights]
    return sheets, faces


@pytest.fixture
def warp():
    pytest.importorskip("newton", reason="Newton comes with the extra newton")
    import warp

    warp.config.log_level = warp.LOG_WARNING
    if not warp.is_cuda_available():
        pytest.skip("Warp finds no CUDA device")
    return warp


@pytest.fixture
def model(warp):
    import newton

    one, builder = newton.ModelBuilder(), newton.ModelBuilder()
    sheets, faces = bent()
    for sheet in sheets:
        one.add_cloth_mesh(
            pos=warp.vec3(0, 0, 0),
            rot=warp.quat_identity(),
            scale=1.0,
            vertices=[warp.vec3(*x) for x in sheet.tolist()],
            indices=faces.ravel().tolist(),
            vel=warp.vec3(0, 0, 0),
            density=0.1,
        )
    for _ in range(3):
        builder.add_world(one)
    return builder.finalize(device="cuda:0")


def address(array):
    return array.__cuda_array_interface__["data"][0]


def test_newton_states_in_and_warp_arrays_out(warp, model):
    from hpccd_core import warp as hcw

    before, after = model.state(), model.state()
    fallen = before.particle_q.numpy().reshape(3, 2, -1, 3)
    fallen[1:, 1, :, 2] -= 0.4
    after.particle_q.assign(fallen.reshape(-1, 3))
    start, end = hcw.positions(model, before), hcw.positions(model, after)
    assert (address(start), address(end)) == (before.particle_q.ptr, after.particle_q.ptr)

    scene = hcw.scene_of(model)
    detector = hc.Detector(scene, worlds=hcw.worlds_of(model), results="device", backend="gpu", outputs=("weights",))
    contacts = detector.detect(start, end, stream=warp.get_stream("cuda:0"))
    found = hcw.arrays(contacts)
    for name in ("vf", "vf_toc", "ee", "ee_toc", "weights", "vf_offsets"):
        assert found[name].ptr == address(getattr(contacts, name)) and found[name].device.is_cuda
    host = hc.Detector(scene, worlds=3, backend="cpu", outputs=("weights",)).detect(
        before.particle_q.numpy().reshape(3, -1, 3), after.particle_q.numpy().reshape(3, -1, 3)
    )
    assert contacts.to_host() == host and len(host) > 200 and detector.stats["gpu_fallbacks"] == 0
    assert found["vf"].numpy().tolist() == host.vf.tolist()
    assert found["vf_toc"].numpy().tolist() == host.vf_toc.tolist()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_sensor(dtype):
    torch = pytest.importorskip("torch", reason="PyTorch comes with the extra torch")
    (lower, upper), faces = bent((0.0, 0.05))
    scene = hc.Scene()
    for name in ("lower", "upper"):
        scene.add_mesh(name, faces, self_collision=False)
    frames = np.stack([np.concatenate([lower, upper + [0, 0, z]]) for z in (0, 0.02, 0.05, 1.0)]).astype(dtype)
    groups = {"upper": "upper", "corner": ("lower", [0, 1, SIZE + 1]), "lower": "lower"}
    options = {"worlds": len(frames), "outputs": ("normals", "weights")}
    on_host = ContactSensor(hc.Detector(scene, backend="cpu", **options), groups, 0.06).read(frames)
    sensor = ContactSensor(hc.Detector(scene, backend="gpu", results="device", **options), groups, 0.06)
    for stream in (None, torch.cuda.current_stream()):
        found = sensor.read(torch.from_numpy(frames).cuda(), stream=stream)
        for name in ("counts", "distances", "normals", "pressures"):
            tensor, expected = getattr(found, name), getattr(on_host, name)
            assert tensor.is_cuda and tensor.cpu().numpy().dtype == expected.dtype
            assert tensor.tolist() == expected.tolist()
    assert (on_host.counts[:3, 0] > 50).all() and not on_host.counts[3].any()
