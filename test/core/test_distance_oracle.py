# SPDX-License-Identifier: Apache-2.0
"""The oracles of distances themselves: against other ways to the same truth, most of them as exact."""

from fractions import Fraction

import numpy as np
import oracle
import pytest
from exact_geometry import squared_distance_to_triangle
from fuzz.disturbances import disturb_near
from fuzz.generators import EDGE_EDGE, GENERATORS, VERTEX_FACE
from fuzz.near_generators import NEAR_GENERATORS
from single_pairs import names, renamed

KINDS = pytest.mark.parametrize("kind", [VERTEX_FACE, EDGE_EDGE])
CONTACT = {VERTEX_FACE: oracle.vertex_face, EDGE_EDGE: oracle.edge_edge}
SEPARATION = {VERTEX_FACE: oracle.separation_vertex_face, EDGE_EDGE: oracle.separation_edge_edge}
DISTANCE = {VERTEX_FACE: oracle.distance_vertex_face, EDGE_EDGE: oracle.distance_edge_edge}
SQUARED = {VERTEX_FACE: oracle.squared_distance_vertex_face, EDGE_EDGE: oracle.squared_distance_edge_edge}
WITHIN = {VERTEX_FACE: oracle.within_vertex_face, EDGE_EDGE: oracle.within_edge_edge}


def near_queries(kind, seed, n):
    """n queries of each generator, as it makes them and disturbed."""
    for name, generate in NEAR_GENERATORS[kind].items():
        for disturbed in (False, True):
            rng = np.random.default_rng(seed)
            queries, distance = generate(rng, n)
            yield name, *(disturb_near(rng, queries, distance, kind) if disturbed else (queries, distance))


def rational(points):
    return [[Fraction(float(x)) for x in point] for point in points]


def squared_distance(kind, points):
    """In rational numbers. For two edges: how far the parallelogram of their differences stays from the origin."""
    p, q, r, s = points
    if kind == VERTEX_FACE:
        return squared_distance_to_triangle(p, [q, r, s])
    origin, minus = [Fraction(0)] * 3, lambda x, y: [c - d for c, d in zip(x, y, strict=True)]
    near, far = minus(p, r), minus(q, s)
    return min(squared_distance_to_triangle(origin, [near, minus(*c), far]) for c in ((q, r), (p, s)))


def at_time(query, t):
    """Points of one query (8,3) at a rational time, in rational numbers."""
    points = rational(query)
    return [[x + t * (y - x) for x, y in zip(points[i], points[i + 4], strict=True)] for i in range(4)]


@KINDS
def test_squared_distances_in_rational_numbers(kind):
    for _, queries, _ in near_queries(kind, 1, 12):
        points = queries[:, :4]
        truth = [squared_distance(kind, rational(p)) for p in points]
        assert SQUARED[kind](points) == truth
        for p, square, rounded in zip(points, truth, DISTANCE[kind](points), strict=True):
            beside = np.nextafter(rounded, [0, rounded, np.inf])
            below, here, above = (Fraction(float(x)) for x in beside)
            assert ((below + here) / 2) ** 2 <= square <= ((here + above) / 2) ** 2, p.tolist()
            within = [square <= x * x for x in (below, here, above)]
            assert WITHIN[kind](np.repeat(p[None], 3, axis=0), beside).tolist() == within


@KINDS
def test_distance_at_toc_and_not_before(kind):
    """At toc features are as far apart as asked, but for the rounding of toc, and never nearer before."""
    found = 0
    for name, queries, distance in near_queries(kind, 2, 12):
        hit, toc = SEPARATION[kind](queries, distance)
        for query, d, is_hit, t in zip(queries, distance, hit, toc, strict=True):
            d = Fraction(float(d))
            for sample in range(13):
                sample = Fraction(sample, 12)
                if sample < t:
                    assert squared_distance(kind, at_time(query, sample)) > d * d, (name, query.tolist())
            if is_hit and t > 0:
                found += 1
                square = squared_distance(kind, at_time(query, Fraction(float(t))))
                speed = max(
                    sum(abs(x - y) for x, y in zip(p, q, strict=True))
                    for p, q in zip(rational(query[:4]), rational(query[4:]), strict=True)
                )
                one_rounding = Fraction(float(np.spacing(t)))
                assert d * d <= square <= (d + 2 * speed * one_rounding) ** 2, (name, query.tolist())
            elif is_hit:
                assert squared_distance(kind, rational(query[:4])) <= d * d
            else:
                assert squared_distance(kind, rational(query[4:])) > d * d, (name, query.tolist())
    assert found > 100


@KINDS
def test_no_distance_is_contact(kind):
    for generate in GENERATORS[kind].values():
        queries = generate(np.random.default_rng(3), 400)
        for plain, separated in zip(CONTACT[kind](queries), SEPARATION[kind](queries, 0.0), strict=True):
            assert np.array_equal(plain, separated)


@KINDS
def test_a_single_moving_feature_sweeps_a_larger_one(kind):
    """A vertex past a still face is a segment and a triangle; an edge that keeps its direction past a still edge a
    segment and a parallelogram. Whether they come within a distance is a question about what is swept."""
    for _, queries, distance in near_queries(kind, 4, 40):
        q = np.round(queries)  # so that the end of a shifted edge does not round
        q = q[(np.abs(q) < 2**40).all(axis=(1, 2))]
        d = distance[: len(q)]
        if kind == VERTEX_FACE:
            q[:, 5:] = q[:, 1:4]
            swept = _segment_near_triangle(q[:, 0], q[:, 4], q[:, 1:4], d)
        else:
            q[:, 6:] = q[:, 2:4]
            q[:, 5] = q[:, 4] + (q[:, 1] - q[:, 0])
            a0, a1, a2, a3 = (q[:, i] for i in (0, 1, 4, 5))
            still = q[:, 2], q[:, 3]
            swept = _segment_near_triangle(*still, np.stack([a0, a1, a2], axis=1), d)
            swept |= _segment_near_triangle(*still, np.stack([a1, a2, a3], axis=1), d)
        assert np.array_equal(SEPARATION[kind](q, d)[0], swept)


def _segment_near_triangle(start, end, corners, distance):
    near = oracle.edge_face_intersect(np.concatenate([start[:, None], end[:, None], corners], axis=1))
    for point in (start, end):
        near |= oracle.within_vertex_face(np.concatenate([point[:, None], corners], axis=1), distance)
    for i in range(3):
        pair = np.stack([start, end, corners[:, i - 1], corners[:, i]], axis=1)
        near |= oracle.within_edge_edge(pair, distance)
    return near


def test_an_edge_meets_a_face_where_a_vertex_that_runs_along_it_does():
    seen = set()
    for _, queries, _ in near_queries(VERTEX_FACE, 5, 200):
        along = queries.copy()
        along[:, 5:] = along[:, 1:4]
        truth = oracle.vertex_face(along)[0]
        ends = np.stack([along[:, 0], along[:, 4]], axis=1)
        assert np.array_equal(oracle.edge_face_intersect(np.concatenate([ends, along[:, 1:4]], axis=1)), truth)
        seen |= set(truth.tolist())
    assert seen == {True, False}


@KINDS
def test_names_signs_and_powers_of_two_change_nothing(kind):
    for _, queries, distance in near_queries(kind, 6, 10):
        result = SEPARATION[kind](queries, distance)
        same = [(np.array([renamed(q, order) for q in queries]), distance) for order, _ in names(kind)]
        same += [(queries[:, :, ::-1], distance), (-queries, distance)]
        for scaled in (np.ldexp(1.0, 480), np.ldexp(1.0, -400)):
            exact = (queries * scaled / scaled == queries).all(axis=(1, 2)) & (distance * scaled / scaled == distance)
            part = SEPARATION[kind](queries[exact] * scaled, distance[exact] * scaled)
            assert all(np.array_equal(a[exact], b) for a, b in zip(result, part, strict=True))
        for others in same:
            for a, b in zip(result, SEPARATION[kind](*others), strict=True):
                assert np.array_equal(a, b)


@KINDS
def test_a_larger_distance_is_reached_no_later(kind):
    for _, queries, distance in near_queries(kind, 7, 20):
        rising = (0 * distance, distance, np.nextafter(distance, np.inf), 2 * distance)
        tocs = np.array([SEPARATION[kind](queries, d)[1] for d in rising])
        assert (tocs[1:] <= tocs[:-1]).all()


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("over_a_face", VERTEX_FACE),
        ("over_a_border", VERTEX_FACE),
        ("crossing_planes", EDGE_EDGE),
        ("end_over_an_edge", EDGE_EDGE),
    ],
)
def test_distances_by_construction(name, kind):
    """The distance is often reached; where features only pass each other, the next smaller double never is."""
    queries, distance = NEAR_GENERATORS[kind][name](np.random.default_rng(8), 1500)
    passing = "over_a_border" in name or "end" in name
    hit, _ = SEPARATION[kind](queries, distance)
    below, _ = SEPARATION[kind](queries, np.nextafter(distance, 0))
    assert 0.15 < hit.mean() < 0.9
    assert not below.any() if passing else (below <= hit).all() and (hit & ~below).mean() > 0.05


def test_a_vertex_that_grazes():
    # Past the corner of a still triangle, five away at half the way.
    triangle = [[0, 0, 0], [-7, -2, 0], [-5, -9, 0]]
    start, end = np.array([3, 4, 0]) - [4, -3, 0], np.array([3, 4, 0]) + [4, -3, 0]
    query = np.array([[start, *triangle, end, *triangle]])
    assert oracle.separation_vertex_face(query, 5.0)[1].tolist() == [0.5]
    assert oracle.separation_vertex_face(query, np.nextafter(5.0, 0))[1].tolist() == [np.inf]


def test_edges_that_glide_in_parallel():
    # Side by side on two lines one apart; the second comes along its own line until their ends face each other at 3/4.
    still, start, end = [[0, 0, 0], [1, 0, 0]], [[4, 1, 0], [6, 1, 0]], [[0, 1, 0], [2, 1, 0]]
    query = np.array([[*still, *start, *still, *end]], dtype=float)
    assert oracle.separation_edge_edge(query, 1.0)[1].tolist() == [0.75]
    assert oracle.separation_edge_edge(query, np.nextafter(1.0, 0))[1].tolist() == [np.inf]


@pytest.mark.parametrize(
    ("points", "truth"),
    [
        ([[0, 0, -1], [0, 0, 1], [-1, -1, 0], [2, -1, 0], [-1, 2, 0]], True),
        ([[0, 0, 0], [0, 0, 1], [-1, -1, 0], [2, -1, 0], [-1, 2, 0]], True),
        ([[0, 0, 5e-324], [0, 0, 1], [-1, -1, 0], [2, -1, 0], [-1, 2, 0]], False),
        ([[-5, 0, 0], [5, 0, 0], [-1, -1, 0], [2, -1, 0], [-1, 2, 0]], True),
        ([[0, 0, 0], [0.25, 0.25, 0], [-1, -1, 0], [2, -1, 0], [-1, 2, 0]], True),
        ([[-5, 0, 0], [-1, 4, 0], [-1, -1, 0], [2, -1, 0], [-1, 2, 0]], False),
        ([[0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]], True),
        ([[0, 0, 0], [0, 0, 0], [1, 0, 0], [1, 0, 0], [1, 0, 0]], False),
        ([[0, 0, 0], [2, 2, 2], [1, 1, 1], [1, 1, 1], [1, 1, 1]], True),
        ([[0, 0, 0], [2, 0, 0], [1, -1, 0], [1, 1, 0], [1, 5, 0]], True),
    ],
)
def test_intersections_one_sees(points, truth):
    assert oracle.edge_face_intersect(np.array([points], dtype=float))[0] == truth


@pytest.mark.parametrize("bad", [-1.0, np.nan, np.inf, np.zeros(3)])
def test_bad_distances_are_rejected(bad):
    with pytest.raises(ValueError, match="distance"):
        oracle.separation_vertex_face(np.zeros((1, 8, 3)), bad)


def test_queries_with_ground_truth(data_folder):
    with np.load(data_folder / "distance" / "queries.npz") as file:
        for kind, name in ((VERTEX_FACE, "vf"), (EDGE_EDGE, "ee")):
            hit, toc = SEPARATION[kind](file[f"{name}_q"], file[f"{name}_d"])
            assert np.array_equal(hit, file[f"{name}_hit"])
            assert np.abs(toc[hit] - file[f"{name}_toc"][hit]).max() < 1e-15
            within = WITHIN[kind](file[f"p_{name}_q"], file[f"p_{name}_d"])
            assert np.array_equal(within, file[f"p_{name}_hit"])
            np.testing.assert_array_max_ulp(DISTANCE[kind](file[f"p_{name}_q"]), file[f"p_{name}_distance"], 1)
        assert np.array_equal(oracle.edge_face_intersect(file["x_q"]), file["x_hit"])


@pytest.mark.parametrize("name", ["two-cubes", "thick-cloth"])
def test_scenes_with_ground_truth(data_folder, name):
    with np.load(data_folder / "distance" / f"{name}.npz") as file:
        v0, v1, faces = file["vertices_t0"], file["vertices_t1"], [file["faces"]]
        n_vertices = [len(v0)]
        compared = 0
        for key in ("s", "s2", "s3", "p", "p2"):
            if f"{key}_d" not in file.files:
                continue
            d = float(file[f"{key}_d"])
            if key.startswith("s"):
                found = oracle.brute_force(v0, v1, faces, n_vertices=n_vertices, minimum_separation=d)
            else:
                found = oracle.proximity(v1, d, faces, n_vertices=n_vertices)
            value = "toc" if key.startswith("s") else "distance"
            for pairs in ("vf", "ee"):
                assert np.array_equal(getattr(found, pairs), file[f"{key}_{pairs}"])
                truth = file[f"{key}_{pairs}_{value}"]
                np.testing.assert_allclose(getattr(found, f"{pairs}_{value}"), truth, rtol=1e-15, atol=4e-16)
                compared += len(truth)
        assert compared > 500
        assert np.array_equal(oracle.intersections(v1, faces, n_vertices=n_vertices), file["x_ef"])
