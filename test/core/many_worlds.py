# SPDX-License-Identifier: Apache-2.0
"""Scenes many times over, and how a result for all is compared with a detector of each world."""

import dataclasses

import numpy as np
import random_scenes

import hpccd_core as hc

CONTACTS = ("vf", "vf_toc", "ee", "ee_toc")
PROXIMITY = ("vf", "vf_distance", "ee", "ee_distance")


@dataclasses.dataclass
class Worlds:
    """One scene; start and end (W,V,3)."""

    scene: hc.Scene
    start: np.ndarray
    end: np.ndarray

    def __len__(self):
        return len(self.start)

    def detector(self, backend="cpu", threads=2, **options):
        return hc.Detector(self.scene, backend=backend, threads=threads, worlds=len(self), **options)

    def alone(self, backend="cpu", **options):
        """A detector for each world."""
        return [hc.Detector(self.scene, backend=backend, threads=1, **options) for _ in range(len(self))]


def of(generate, n, seed=0, **scene):
    """n poses of a random scene, moved, turned, and scaled by up to a million: some far apart, some crossing."""
    rng = np.random.default_rng([17, seed])
    meshes = generate(rng)
    v0, v1 = meshes.vertices_t0, meshes.vertices_t1
    mesh = np.repeat(np.arange(len(meshes.faces)), meshes.n_vertices)
    starts, ends = [], []
    for _ in range(n):
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        apart = rng.choice([0, 0, 3, 1e3]) * mesh[:, None] * [0, 0, 1]
        scale = 10.0 ** rng.integers(-6, 7) if rng.integers(2) else 1.0
        to, far = rng.normal(size=(3,)) * rng.choice([0, 1, 100]), rng.uniform(0, 1.2)
        noise = rng.normal(0, 0.05, v0.shape)
        starts.append(scale * ((v0 + noise + apart) @ turn + to))
        ends.append(scale * ((v0 + far * (v1 - v0) + noise + apart) @ turn + to))
    start, end = np.array(starts), np.array(ends)
    for number in scene.get("static", ()):
        end[:, mesh == number] = start[:, mesh == number]
    return Worlds(meshes.scene(**scene), start, end)


def crumpled(n, seed=0):
    return of(random_scenes.single_mesh, n, seed)


def assert_rows(found, expected, names):
    outputs = getattr(expected, "outputs", {})
    assert getattr(found, "outputs", {}).keys() == outputs.keys()
    for name in (*names, *outputs):
        a, b = getattr(found, name), getattr(expected, name)
        assert a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes(), name
    assert found.hash == expected.hash


def assert_offsets(offsets, counts):
    assert offsets.dtype == np.int64
    np.testing.assert_array_equal(offsets, np.cumsum([0, *counts]))


def hash_of(results):
    return sum(a.hash * (2 * k + 1) for k, a in enumerate(results)) % 2**64


def assert_contacts(found, alone):
    """Every world's contacts, bit for bit, and how they stand together."""
    for k, expected in enumerate(alone):
        world = found.world(k)
        assert_rows(world, expected, CONTACTS)
        assert world.first_toc == expected.first_toc
    assert_offsets(found.vf_offsets, [len(a.vf) for a in alone])
    assert_offsets(found.ee_offsets, [len(a.ee) for a in alone])
    assert found.hash == hash_of(alone)
    assert found.first_tocs.dtype == np.float64
    np.testing.assert_array_equal(found.first_tocs, [a.first_toc for a in alone])
    assert found.first_toc == min(a.first_toc for a in alone)
    np.testing.assert_array_equal(found.vf, np.concatenate([a.vf for a in alone]))
    np.testing.assert_array_equal(found.ee_toc, np.concatenate([a.ee_toc for a in alone]))
    if "points" in found.outputs:
        both = [np.concatenate([a.points[: len(a.vf)] for a in alone]), *(a.points[len(a.vf) :] for a in alone)]
        np.testing.assert_array_equal(found.points, np.concatenate(both))
    assert len(found) == sum(map(len, alone))


def assert_proximity(found, alone):
    for k, expected in enumerate(alone):
        assert_rows(found.world(k), expected, PROXIMITY)
    assert_offsets(found.vf_offsets, [len(a.vf) for a in alone])
    assert_offsets(found.ee_offsets, [len(a.ee) for a in alone])
    assert found.hash == hash_of(alone)


def assert_intersections(found, alone):
    for k, expected in enumerate(alone):
        assert_rows(found.world(k), expected, ("ef",))
    assert_offsets(found.ef_offsets, [len(a.ef) for a in alone])
    assert found.hash == hash_of(alone)


def assert_gaps(found, alone):
    assert len(found) == len(alone)
    for gaps, expected in zip(found, alone, strict=True):
        assert [dataclasses.astuple(g)[:5] for g in gaps] == [dataclasses.astuple(g)[:5] for g in expected]
        for g, e in zip(gaps, expected, strict=True):
            assert g.points.tobytes() == e.points.tobytes()
