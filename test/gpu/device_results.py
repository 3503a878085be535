# SPDX-License-Identifier: Apache-2.0
"""Results on the device, and of many worlds, beside those of CPUs."""

import numpy as np
import scenes

import hpccd_core as hc

OUTPUTS = ("points", "normals", "closest", "vertices", "weights", "approach")
ARRAYS = ("vf", "vf_toc", "ee", "ee_toc", "vf_distance", "ee_distance", "ef", *OUTPUTS)
OFFSETS = ("vf_offsets", "ee_offsets", "ef_offsets", "first_tocs")


def assert_same(found, expected):
    """Every array, offset and hash. Data on the device is copied to the host first."""
    if hasattr(found, "to_host"):
        found = found.to_host()
    for name in (name for name in (*ARRAYS, *OFFSETS, "first_toc") if hasattr(expected, name)):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name), err_msg=name)
    assert found.hash == expected.hash


def first_pair(contacts):
    """Of all contacts the first in canonical order, as report="any" gives it on the device."""
    return contacts.vf[:1], (contacts.ee[:1] if len(contacts.vf) == 0 else contacts.ee[:0])


def assert_on_gpu(detector):
    assert detector.stats["gpu_fallbacks"] == 0, detector.last_gpu_error


def garments(worlds, n=14, seed=0, dtype=np.float32):
    """(scene, t0, t1) of a crumpling sheet in W worlds, of different scale and place; the last of many rests."""
    rng = np.random.default_rng(seed)
    scene = hc.Scene()
    scene.add_mesh("sheet", scenes.sheet(n))
    t0 = np.stack([scenes.flat(n) + rng.normal(0, 0.3, (n * n, 3)) for _ in range(worlds)])
    t1 = t0 + rng.normal(0, 0.6, t0.shape)
    t0[1::3] = 1000 * t0[1::3] + 5
    t1[1::3] = 1000 * t1[1::3] + 5
    if worlds > 2:
        t0[-1] = t1[-1] = scenes.flat(n)
    return scene, t0.astype(dtype), t1.astype(dtype)


def needle_through_plates(n):
    """A needle goes through n triangles: its three corners and edges have as many contacts each."""
    angle = np.linspace(0, 2 * np.pi, n, endpoint=False)
    height = 0.001 * np.arange(n)
    corners = [np.stack([np.cos(angle + a), np.sin(angle + a), height], axis=1) for a in (0, 2, 4)]
    plates = np.stack(corners, axis=1).reshape(-1, 3)
    needle = np.array([[0, 0, -1], [0.01, 0, -1], [0, 0.01, -1]])
    scene = hc.Scene()
    scene.add_mesh("plates", np.arange(3 * n).reshape(-1, 3), self_collision=False)
    scene.add_mesh("needle", np.array([[0, 1, 2]]))
    return scene, np.concatenate([plates, needle]), np.concatenate([plates, needle + [0, 0, 0.001 * n + 3]])
