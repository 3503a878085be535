# SPDX-License-Identifier: Apache-2.0
"""One vertex and face, or two edges, as a scene of their own; the same under other names; and many that touch."""

import functools
import itertools

import numpy as np
import pytest
from fuzz import generators
from fuzz.generators import EDGE_EDGE, VERTEX_FACE

import hpccd_core as hc

KINDS = pytest.mark.parametrize("kind", [VERTEX_FACE, EDGE_EDGE])
TEST = {VERTEX_FACE: hc.test_vertex_face, EDGE_EDGE: hc.test_edge_edge}

# Orders of the four points that name the same features, and whether the normal turns round with them.
VERTEX_FACE_NAMES = [((0, *corners), 1) for corners in itertools.permutations((1, 2, 3))]
EDGE_EDGE_NAMES = [
    (((*a, *b), 1) if a_first else ((*b, *a), -1))
    for a in ((0, 1), (1, 0))
    for b in ((2, 3), (3, 2))
    for a_first in (True, False)
]


def names(kind):
    return VERTEX_FACE_NAMES if kind == VERTEX_FACE else EDGE_EDGE_NAMES


def renamed(query, order):
    return np.concatenate([query[:4][list(order)], query[4:][list(order)]])


def _scene(faces):
    scene = hc.Scene()
    scene.add_mesh("pair", faces, n_vertices=4)
    return scene


# A face that names a vertex twice is an edge.
_SCENES = {True: _scene([[1, 2, 3]]), False: _scene([[0, 1, 1], [2, 3, 3]])}


def detector(kind, **options):
    return hc.Detector(_SCENES[kind == VERTEX_FACE], outputs=("points", "normals"), backend="cpu", threads=1, **options)


def contact(detector, kind, query):
    """toc, point and normal of the query's pair, which must touch."""
    found = detector.detect(query[:4], query[4:])
    if kind == VERTEX_FACE:
        at = found.vf.tolist().index([0, 0])
        return found.vf_toc[at], found.points[at], found.normals[at]
    at = found.ee.tolist().index([0, 1, 2, 3])
    return found.ee_toc[at], found.points[len(found.vf) + at], found.normals[len(found.vf) + at]


def small_steps(rng, n):
    queries = rng.uniform(-1, 1, (n, 8, 3))
    queries[:, 4:] = queries[:, :4] + rng.normal(0, 0.1, (n, 4, 3))
    return queries


def pinned(rng, n):
    """Edges and faces that turn about a point at rest."""
    queries = small_steps(rng, n)
    queries[:, 5] = queries[:, 1]
    return queries


def scaled(exponent):
    def small_steps_scaled(rng, n):
        return small_steps(rng, n) * 2.0**exponent

    return small_steps_scaled


def far_away(rng, n):
    return small_steps(rng, n) + 1e6


def all_magnitudes(rng, n, exponents=450):
    """Each coordinate times one of three powers of two."""
    powers = rng.integers(-exponents, exponents, size=(n, 1, 3)).repeat(8, axis=1)
    return np.ldexp(small_steps(rng, n), np.take_along_axis(powers, rng.integers(3, size=(n, 8, 3)), axis=2))


REGULAR = [small_steps, pinned, scaled(480), scaled(-900), far_away]
DEGENERATE = [
    generators.lattice,
    generators.still,
    generators.in_plane,
    generators.on_line,
    generators.meeting_vertex_face,
    generators.meeting_edge_edge,
    generators.parallel_at_root,
    generators.chosen_roots,
    generators.chosen_roots_edge_edge,
    generators.thin,
]


@functools.cache
def _contacts(kind, generate, accuracy):
    queries = generate(np.random.default_rng(5), 800 if generate in DEGENERATE else 15000)
    queries = queries[TEST[kind](queries, accuracy)[0]]
    queries.setflags(write=False)  # all callers have the same
    return queries


def contacts(kind, generate, number, accuracy="exact"):
    return _contacts(kind, generate, accuracy)[:number]
