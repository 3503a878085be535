# SPDX-License-Identifier: Apache-2.0
"""The oracle of earliest contacts, which leaves out what it can prove to be later, against the one that leaves out
nothing."""

import numpy as np
import oracle
import pytest
import random_scenes
from fuzz.near_generators import NEAR_GENERATORS
from fuzz.questions import STEP
from fuzz.steps import SMALL_SCENES, STEP_MOTIONS, true_steps


def earliest_of_all(contacts):
    return min([*contacts.vf_toc, *contacts.ee_toc], default=np.inf)


@pytest.mark.parametrize("kind", SMALL_SCENES)
def test_small_scenes(kind):
    scene, times = SMALL_SCENES[kind], []
    for number, motions in enumerate(STEP_MOTIONS[kind].values()):
        queries, distances = motions(np.random.default_rng([5, number]), 8)
        touches, free = true_steps(kind, queries, distances, 0)
        for query, d, touch, step in zip(queries, distances, touches, free, strict=True):
            every = oracle.brute_force(
                *np.split(query, 2),
                scene.faces,
                edges_per_mesh=scene.edges,
                n_vertices=scene.n_vertices,
                minimum_separation=d,
            )
            expected = earliest_of_all(every)
            assert touch == np.isfinite(expected) and step == min(expected, 1.0)
            times.append(expected)
    assert 0 in times and np.inf in times and any(0 < t < 1 for t in times)


@pytest.mark.parametrize("generate", random_scenes.ALL[1:5])
def test_random_scenes(generate):
    for seed in range(2):
        meshes = generate(np.random.default_rng([50, seed]))
        rules = {"no_self_collision": [0], "ignored_pairs": [(0, len(meshes.faces) - 1)]} if seed else {}
        for separation in (0.0, 0.01):
            found = oracle.earliest_contacts(
                meshes.vertices_t0[None],
                meshes.vertices_t1[None],
                meshes.faces,
                **meshes.beside_faces,
                minimum_separation=separation,
                **rules,
            )
            assert found.tolist() == [earliest_of_all(meshes.truth(minimum_separation=separation, **rules))]


@pytest.mark.parametrize("kind", NEAR_GENERATORS)
def test_single_pairs_that_graze(kind):
    """Nothing is proven to be apart that touches: the times of single pairs are those of the exact tests."""
    faces = [np.array([[1, 2, 3]])] if kind == "vertex-face" else [np.array([[0, 1, 1], [2, 3, 3]])]
    ask = oracle.separation_vertex_face if kind == "vertex-face" else oracle.separation_edge_edge
    for generate in NEAR_GENERATORS[kind].values():
        queries, distances = generate(np.random.default_rng(6), 20)
        _, toc = ask(queries, distances)
        # With two edges their ends and the flat faces are pairs too, which are never earlier.
        found = oracle.earliest_contacts(
            queries[:, :4], queries[:, 4:], faces, n_vertices=[4], minimum_separation=distances
        )
        np.testing.assert_array_equal(found, toc)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"vertices_t1": np.zeros((2, 4, 3))}, "vertices_t1: shape"),
        ({"vertices_t0": np.zeros((4, 3)), "vertices_t1": np.zeros((4, 3))}, "vertices_t0: shape"),
        ({"vertices_t1": np.full((1, 4, 3), np.nan)}, "vertices_t1: NaN"),
        ({"minimum_separation": -1.0}, "minimum_separation"),
        ({"minimum_separation": [np.inf]}, "minimum_separation"),
    ],
)
def test_bad_arguments_are_rejected(change, text):
    good = {"vertices_t0": np.zeros((1, 4, 3)), "vertices_t1": np.zeros((1, 4, 3))}
    with pytest.raises(ValueError, match=text):
        oracle.earliest_contacts(**good | change, faces_per_mesh=[[[1, 2, 3]]])


def test_the_fuzzer_asks_about_these_scenes():
    from fuzz import questions

    assert questions.kinds_of(STEP) == tuple(SMALL_SCENES)
