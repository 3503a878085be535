# SPDX-License-Identifier: Apache-2.0
"""Detection with separation and queries of one snapshot: the same bytes and hash with any instruction set and any
number of threads, on a new detector and on one that has computed other queries before."""

import numpy as np
import pytest
import random_scenes
from fuzz.differential import usable_simd

import hpccd_core as hc

OUTPUTS = ("points", "normals", "closest", "weights")
ARRAYS = (
    "vf",
    "vf_toc",
    "ee",
    "ee_toc",
    "points",
    "normals",
    "closest",
    "vertices",
    "weights",
    "approach",
    "vf_distance",
    "ee_distance",
    "ef",
)


def as_bytes(result):
    """All that a result holds."""
    if isinstance(result, list):
        arrays = ("points", "vertices", "weights", "normal")
        return [
            (g.mesh_a, g.mesh_b, float(g.distance).hex(), g.kind, tuple(g.features))
            + tuple(getattr(g, name).tobytes() for name in arrays)
            for g in result
        ]
    arrays = {name: getattr(result, name) for name in ARRAYS if hasattr(result, name)}
    return result.hash, {name: (a.shape, a.dtype.str, a.tobytes()) for name, a in arrays.items()}


QUERIES = {
    "separation": lambda detector, v0, v1: detector.detect(v0, v1),
    "proximity": lambda detector, v0, v1: detector.proximity(v1, 0.25),
    "intersections": lambda detector, v0, v1: detector.intersections(v1),
    "distances": lambda detector, v0, v1: detector.distances(v1),
}


def crowd(rng):
    """Enough blocks of triangles that there is work for many threads."""
    return random_scenes.combine(
        random_scenes.crumpled_sheet(rng, 14), random_scenes.lattice_sheet(rng, 9), random_scenes.soup(rng, 60)
    )


@pytest.mark.parametrize("generate", [crowd, random_scenes.lone_vertices, random_scenes.huge_and_tiny])
def test_the_same_bytes(generate):
    meshes = generate(np.random.default_rng(51))
    results = {query: [] for query in QUERIES}
    for simd in usable_simd():
        for threads in (1, 2, 16):
            options = {"simd": simd, "threads": threads, "backend": "cpu", "outputs": OUTPUTS}
            detector = hc.Detector(meshes.scene(), minimum_separation=0.125, **options)
            for _ in range(2):
                for query, ask in QUERIES.items():
                    results[query].append(as_bytes(ask(detector, meshes.vertices_t0, meshes.vertices_t1)))
    for query, given in results.items():
        assert all(result == given[0] for result in given), query
    found = QUERIES["separation"](detector, meshes.vertices_t0, meshes.vertices_t1)
    assert len(found.vf) and len(found.ee) and len(QUERIES["intersections"](detector, None, meshes.vertices_t1).ef)


def test_what_is_compared_tells_results_apart():
    meshes = crowd(np.random.default_rng(52))
    detector = hc.Detector(meshes.scene(), minimum_separation=0.125, backend="cpu", outputs=OUTPUTS)
    for ask in QUERIES.values():
        before = as_bytes(ask(detector, meshes.vertices_t0, meshes.vertices_t1))
        assert before == as_bytes(ask(detector, meshes.vertices_t0, meshes.vertices_t1))
        assert before != as_bytes(ask(detector, meshes.vertices_t0, 0.9 * meshes.vertices_t1))
