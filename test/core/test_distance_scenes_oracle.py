# SPDX-License-Identifier: Apache-2.0
"""The oracles of whole scenes: the elementary ones on every pair, listed here in another way."""

import itertools

import numpy as np
import oracle
import pytest
import random_scenes

SEPARATIONS = {(0, 0): 0.5, (0, 1): 0.0, (1, 1): 2.0}
RULES = {"no_self_collision": [2], "ignored_pairs": [(0, 2)]}
SMALL = (random_scenes.lattice, random_scenes.triangle_soup, random_scenes.lone_vertices, random_scenes.lattice_ropes)


def with_a_triangle(rng):
    """Many meshes, none near all the others; the last is one triangle, which has no pair of features of its own."""
    triangle = np.array([[0, 1, 2]]), *rng.normal(0, 2, (2, 3, 3))
    sheet = random_scenes.crumpled_sheet(rng, 5)
    return random_scenes.combine(sheet, random_scenes.tetrahedron(rng), random_scenes.soup(rng, 16), triangle)


def scene_of(generate):
    meshes = generate(np.random.default_rng(21))
    offsets = np.concatenate([[0], np.cumsum(meshes.n_vertices)])
    faces = np.concatenate([f + o for f, o in zip(meshes.faces, offsets, strict=False)])
    mesh = np.repeat(np.arange(len(meshes.n_vertices)), meshes.n_vertices)
    beside = np.concatenate([e + o for e, o in zip(meshes.edges, offsets, strict=False)]).tolist()
    ends = beside + [e for f in faces.tolist() for e in itertools.combinations(f, 2)]
    edges = {(min(e), max(e)) for e in ends if e[0] != e[1]}
    return meshes, faces, mesh, np.array(sorted(edges))


def named_pairs(faces, edges, n_vertices):
    """Of vertex-face, edge-edge and edge-face pairs without a shared vertex: names, vertices, and one of each side."""
    vf = [(v, f) for v in range(n_vertices) for f in range(len(faces))]
    ee = list(itertools.combinations(range(len(edges)), 2))
    ef = [(e, f) for e in range(len(edges)) for f in range(len(faces))]
    for pairs, first, second in ((vf, np.arange(n_vertices)[:, None], faces), (ee, edges, edges), (ef, edges, faces)):
        a, b = first[[i for i, _ in pairs]], second[[j for _, j in pairs]]
        apart = ~(a[:, :, None] == b[:, None, :]).any(axis=(1, 2))
        names = [a, np.array(pairs)[:, 1:]] if second is faces else [a, b]
        yield np.hstack(names)[apart], np.hstack([a, b])[apart], (a[apart, 0], b[apart, 0])


@pytest.mark.parametrize("generate", SMALL)
def test_each_pair_by_itself(generate):
    meshes, faces, mesh, edges = scene_of(generate)
    v0, v1 = meshes.vertices_t0, meshes.vertices_t1
    options = meshes.beside_faces
    pairs = {k: v for k, v in SEPARATIONS.items() if max(k) < len(meshes.faces)}
    contacts = oracle.brute_force(v0, v1, meshes.faces, minimum_separation=0.125, pair_separation=pairs, **options)
    proximity = oracle.proximity(v1, 0.75, meshes.faces, **options)
    vf, ee, ef = named_pairs(faces, edges, len(v0))
    for kind, (names, points, (a, b)), separation, distance in (
        ("vf", vf, oracle.separation_vertex_face, oracle.distance_vertex_face),
        ("ee", ee, oracle.separation_edge_edge, oracle.distance_edge_edge),
    ):
        margin = np.array([pairs.get((i, j), 0.125) for i, j in np.sort([mesh[a], mesh[b]], axis=0).T])
        hit, toc = separation(np.hstack([v0[points], v1[points]]), margin)
        assert 0 < hit.sum() < len(hit)
        assert np.array_equal(getattr(contacts, kind), names[hit])
        assert np.array_equal(getattr(contacts, f"{kind}_toc"), toc[hit])
        apart = distance(v1[points])
        assert 0 < (apart <= 0.75).sum() < len(apart)
        assert np.array_equal(getattr(proximity, kind), names[apart <= 0.75])
        assert np.array_equal(getattr(proximity, f"{kind}_distance"), apart[apart <= 0.75])
    intersect = oracle.edge_face_intersect(v1[ef[1]])
    assert 0 < intersect.sum() < len(intersect)
    assert np.array_equal(oracle.intersections(v1, meshes.faces, **options), ef[0][intersect])


def test_smallest_distances_of_meshes_and_rules():
    meshes, *_ = scene_of(with_a_triangle)
    v1, options = meshes.vertices_t1, {"n_vertices": meshes.n_vertices}
    gaps = oracle.smallest_distances(v1, meshes.faces, **options, **RULES)
    named = {(g.mesh_a, g.mesh_b): g for g in gaps}
    n = len(meshes.faces)
    assert set(named) == {(a, b) for a in range(n) for b in range(a, n)} - {(2, 2), (0, 2)}
    assert (named[3, 3].distance, named[3, 3].intersect) == (np.inf, False)
    mesh = np.repeat(np.arange(n), meshes.n_vertices)
    first_faces = np.cumsum([0] + [len(f) for f in meshes.faces])
    found = oracle.intersections(v1, meshes.faces, **options, **RULES)
    of_face = np.searchsorted(first_faces, found[:, 2], side="right") - 1
    touching = {tuple(sorted(pair)) for pair in zip(mesh[found[:, 0]].tolist(), of_face.tolist(), strict=True)}
    assert touching == {pair for pair, g in named.items() if g.intersect}
    assert 0 < len(touching) < len(gaps)
    for (a, b), gap in named.items():
        if not 0 < gap.distance < np.inf:
            continue
        only = {**options, "ignored_pairs": [(i, j) for i in range(n) for j in range(n) if {i, j} != {a, b}]}
        above, below = (
            oracle.proximity(v1, gap.distance * factor, meshes.faces, **only) for factor in (1 + 1e-15, 1 - 1e-15)
        )
        assert len(above.vf) + len(above.ee) > 0 == len(below.vf) + len(below.ee)
