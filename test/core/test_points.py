# SPDX-License-Identifier: Apache-2.0
"""Points against points, ropes and faces, against exact oracles of all pairs."""

import itertools
import math
from fractions import Fraction

import numpy as np
import oracle
import pytest

import hpccd_core as hc
from hpccd_core.parts import hash_of

GRAINS, ROPE, CLOTH = 12, 6, 9
N = GRAINS + ROPE + CLOTH
ROPE_EDGES = np.array([[k, k + 1] for k in range(ROPE - 2)])  # the last vertex of its mesh is a point too
CLOTH_FACES = hc.shapes.grid(2, 2)[1]


def scene_of(points=True, radius=0.0, **pairs):
    scene = hc.Scene()
    if points:
        scene.add_points("grains", GRAINS, thickness=radius)
        scene.add_points("rope", ROPE, edges=ROPE_EDGES)
    else:
        scene.add_mesh("grains", n_vertices=GRAINS, thickness=radius)
        scene.add_mesh("rope", edges=ROPE_EDGES, n_vertices=ROPE)
    scene.add_mesh("cloth", CLOTH_FACES)
    for mesh_a, mesh_b in pairs.get("ignored", ()):
        scene.ignore_pair(mesh_a, mesh_b)
    return scene


POINTS = [*range(GRAINS), GRAINS + ROPE - 1]
EDGES = [(GRAINS + a, GRAINS + b) for a, b in ROPE_EDGES]
VV = list(itertools.combinations(POINTS, 2))
VE = [(v, *edge) for v in POINTS for edge in EDGES]


def motion(rng, dtype=float, coarse=False):
    start = rng.uniform(-1, 1, (N, 3))
    end = start + rng.normal(scale=0.4, size=start.shape)
    if coarse:  # many equal coordinates and distances that are met exactly
        start, end = np.round(4 * start) / 4, np.round(4 * end) / 4
    return start.astype(dtype), end.astype(dtype)


def queries(rows, start, end):
    """Of point and point, or point and edge: a point is an edge of one vertex."""
    vertices = np.array([[r[0], r[0], r[1], r[-1]] for r in rows])
    return np.concatenate([start[vertices], end[vertices]], 1).astype(float)


def expected(rows, start, end, distance):
    q = queries(rows, start, end)
    return oracle.separation_edge_edge(q, distance) if distance > 0 else oracle.edge_edge(q)


def assert_is(found, toc, rows, hits, times):
    assert found.tolist() == [list(row) for row, hit in zip(rows, hits, strict=True) if hit]
    assert np.abs(toc - times[hits]).max(initial=0) <= 1e-12


@pytest.mark.parametrize("coarse", [False, True])
@pytest.mark.parametrize("distance", [0.0, 0.25])
@pytest.mark.parametrize("threads", [1, 2])
def test_contacts_are_those_of_all_pairs(coarse, distance, threads):
    rng = np.random.default_rng(1)
    counts = np.zeros(2, int)
    for k in range(60):
        start, end = motion(rng, np.float32 if k % 2 else float, coarse)
        detector = hc.Detector(scene_of(), minimum_separation=distance, threads=threads)
        contacts = detector.detect(start, end)
        assert_is(contacts.vv, contacts.vv_toc, VV, *expected(VV, start, end, distance))
        assert_is(contacts.ve, contacts.ve_toc, VE, *expected(VE, start, end, distance))
        others = hc.Detector(scene_of(points=False), minimum_separation=distance).detect(start, end)
        assert contacts.vf.tolist() == others.vf.tolist()
        assert contacts.ee.tolist() == others.ee.tolist()
        assert hash_of(contacts) == contacts.hash
        counts += len(contacts.vv), len(contacts.ve)
        times = [t for kind in ("vf", "ee", "vv", "ve") for t in getattr(contacts, f"{kind}_toc")]
        assert contacts.first_toc == min(times, default=math.inf)
        step = detector.collision_free_step(start, end)
        assert min(times, default=2.0) - 1e-9 <= step <= min(times, default=1.0)
    assert counts.min() > 0 or (distance == 0 and not coarse)


def first_within(p, end, distance):
    """The earliest t at which |p| <= distance, for p on its way to the end; None if never. A quadratic in t."""
    q = [y - x for x, y in zip(p, end, strict=True)]
    a, b, c = sum(x * x for x in q), sum(x * y for x, y in zip(p, q, strict=True)), sum(x * x for x in p) - distance**2
    if c <= 0:
        return 0.0
    if b >= 0 or b * b < a * c or (a + 2 * b + c > 0 and -b > a):
        return None
    n, d = (b * b - a * c).as_integer_ratio()
    root = Fraction(math.isqrt((n << 400) // d), 1 << 200)
    return float((-b - root) / a)


def test_spheres_against_rationals():
    rng = np.random.default_rng(2)
    n = 40
    n_hits = 0
    for k in range(30):
        scale = (1.0, 1e-3, 1e6)[k % 3]
        start = np.round(rng.uniform(-1, 1, (n, 3)) * 8) / 8 * scale if k % 2 else rng.uniform(-1, 1, (n, 3)) * scale
        end = start + rng.normal(scale=0.3 * scale, size=start.shape)
        radius = 0.0625 * scale
        scene = hc.Scene()
        scene.add_points("grains", n, thickness=radius)
        contacts = hc.Detector(scene).detect(start, end)
        rows, times = [], []
        for v, w in itertools.combinations(range(n), 2):
            p0 = [Fraction(float(a)) - Fraction(float(b)) for a, b in zip(start[v], start[w], strict=True)]
            p1 = [Fraction(float(a)) - Fraction(float(b)) for a, b in zip(end[v], end[w], strict=True)]
            time = first_within(p0, p1, 2 * Fraction(radius))
            if time is not None:
                rows.append([v, w])
                times.append(time)
        assert contacts.vv.tolist() == rows
        assert np.abs(contacts.vv_toc - times).max(initial=0) <= 1e-12
        n_hits += len(rows)
    assert n_hits > 100


def test_proximity_and_distances():
    rng = np.random.default_rng(3)
    kinds = set()
    for _ in range(40):
        x, _ = motion(rng, coarse=bool(rng.random() < 0.5))
        detector = hc.Detector(scene_of(ignored=[("rope", "rope")]), outputs=("closest", "normals", "weights"))
        near = detector.proximity(x, 0.3)
        rows_of = {"vv": VV, "ve": [row for row in VE if row[0] < GRAINS]}
        for kind, rows in rows_of.items():
            q = queries(rows, x, x)[:, :4]
            within = oracle.within_edge_edge(q, 0.3)
            assert getattr(near, kind).tolist() == [list(row) for row, hit in zip(rows, within, strict=True) if hit]
            true = oracle.distance_edge_edge(q)[within]
            np.testing.assert_allclose(getattr(near, f"{kind}_distance"), true, atol=1e-14)
        gaps = {(gap.mesh_a, gap.mesh_b): gap for gap in detector.distances(x)}
        least = {
            ("grains", "grains"): oracle.distance_edge_edge(
                queries([row for row in VV if row[1] < GRAINS], x, x)[:, :4]
            ).min()
        }
        both = [row for row in VV if row[0] < GRAINS <= row[1]]
        least["grains", "rope"] = min(
            oracle.distance_edge_edge(queries(rows, x, x)[:, :4]).min() for rows in (both, rows_of["ve"])
        )
        for pair, distance in least.items():
            assert gaps[pair].distance == pytest.approx(distance, abs=1e-14)
        for gap in gaps.values():
            kinds.add(gap.kind)
            if len(gap.vertices):
                between = (gap.weights[:, None] * x[gap.vertices]).sum(0)
                assert np.linalg.norm(between) == pytest.approx(gap.distance, abs=1e-12)
                np.testing.assert_allclose(between, gap.distance * gap.normal, atol=1e-12)
        assert len(detector.intersections(x).ef) == len(
            hc.Detector(scene_of(points=False, ignored=[("rope", "rope")])).intersections(x).ef
        )
    assert kinds >= {"vertex-vertex", "vertex-edge", "vertex-face"}


def test_outputs_lead_from_the_point_to_the_edge():
    """Also where the point has the larger number, and is edge b of the core."""
    for point_first in (True, False):
        scene = hc.Scene()
        for name in ("grain", "rope") if point_first else ("rope", "grain"):
            if name == "grain":
                scene.add_points("grain", 1)
            else:
                scene.add_mesh("rope", edges=[[0, 1]])
        detector = hc.Detector(
            scene, outputs=("points", "normals", "closest", "weights"), minimum_separation=0.5, features="edge_edge"
        )
        start = {"grain": np.array([[1.0, 0, 2]]), "rope": np.array([[0.0, 0, 0], [4, 0, 0]])}
        end = {"grain": np.array([[1.0, 0, 0]]), "rope": start["rope"]}
        contacts = detector.detect(start, end)
        point, a, b = (0, 1, 2) if point_first else (2, 0, 1)
        assert contacts.ve.tolist() == [[point, a, b]]
        assert contacts.ve_toc == pytest.approx([0.75], abs=1e-12)
        np.testing.assert_allclose(contacts.normals, [[0, 0, -1]], atol=1e-12)
        np.testing.assert_allclose(contacts.closest, [[[1, 0, 0.5], [1, 0, 0]]], atol=1e-12)
        np.testing.assert_allclose(contacts.points, [[1, 0, 0.25]], atol=1e-12)
        assert contacts.vertices.tolist() == [[point, point, a, b]]
        np.testing.assert_allclose(contacts.weights[0, 2:], [0.75, 0.25], atol=1e-12)
        np.testing.assert_allclose(contacts.weights.sum(1), 0, atol=1e-15)
        np.testing.assert_allclose(contacts.approach, [-2], atol=1e-12)
        assert [scene.mesh_names[k] for k in (contacts.mesh_a[0], contacts.mesh_b[0])] == ["grain", "rope"]
        assert contacts.local_a.tolist() == [[0, 2**32 - 1]] and contacts.local_b.tolist() == [[0, 1]]


@pytest.mark.parametrize("report", ["first", "any"])
def test_reports(report):
    rng = np.random.default_rng(4)
    seen = set()
    for _ in range(60):
        start, end = motion(rng)
        every = hc.Detector(scene_of(radius=0.1)).detect(start, end)
        contacts = hc.Detector(scene_of(radius=0.1), report=report).detect(start, end)
        if report == "any":
            assert len(contacts) == min(1, len(every))
            continue
        for kind in ("vf", "ee", "vv", "ve"):
            earliest = getattr(every, f"{kind}_toc") == every.first_toc
            assert getattr(contacts, kind).tolist() == getattr(every, kind)[earliest].tolist()
            seen |= {kind} if earliest.any() else set()
        assert hash_of(contacts) == contacts.hash
    assert report == "any" or {"vv", "ve"} <= seen


def test_worlds_are_those_of_each_alone():
    rng = np.random.default_rng(5)
    starts, ends = (np.stack(x) for x in zip(*(motion(rng) for _ in range(6)), strict=True))
    outputs = ("points", "normals", "closest", "weights")
    scene = scene_of(radius=0.15)
    scene.add_plane("floor", offset=-1.0)
    together = hc.Detector(scene, worlds=6, outputs=outputs)
    alone = hc.Detector(scene, outputs=outputs)
    contacts, near = together.detect(starts, ends), together.proximity(ends, 0.2)
    assert min(len(contacts.vv), len(contacts.ve), len(contacts.vp), len(contacts.vf)) > 0
    for k in range(6):
        assert contacts.world(k) == alone.detect(starts[k], ends[k])
        assert near.world(k) == alone.proximity(ends[k], 0.2)


def test_motions_are_free():
    rng = np.random.default_rng(6)
    for k in range(30):
        start, end = motion(rng, np.float32 if k % 2 else float)
        detector = hc.Detector(scene_of(radius=0.02))
        motion_ = detector.collision_free_motion(start, end)
        contacts = detector.detect(start, motion_.vertices)
        stuck = set(motion_.stuck.tolist())
        for kind in ("vv", "ve", "ee"):
            assert all(stuck & set(row) for row in getattr(contacts, kind).tolist())
        assert (contacts.vf_toc == 0).all()


def test_coincident_points_touch_without_a_thickness():
    scene = hc.Scene()
    scene.add_points("grains", 3)
    start = np.array([[0.0, 0, 0], [1, 2, 3], [-1, 0, 0]])
    end = np.array([[1.0, 2, 3], [0, 0, 0], [-1, 0, 0]])  # they meet in the middle
    contacts = hc.Detector(scene).detect(start, end)
    assert contacts.vv.tolist() == [[0, 1]] and contacts.vv_toc.tolist() == [0.5]
    end[1, 0] = np.nextafter(0.0, 1)  # they miss by half of the smallest number
    assert len(hc.Detector(scene).detect(start, end)) == 0


def test_options_of_points():
    scene = hc.Scene()
    scene.add_points("grains", 2, thickness=[0.25, 0.5], self_collision=False)
    x = np.zeros((2, 3))
    assert len(hc.Detector(scene).detect(x, x)) == 0
    with pytest.raises(ValueError, match="thickness"):
        scene.add_points("others", 2, thickness=[1.0, 2, 3])
    with pytest.raises(ValueError, match="n"):
        scene.add_points("others", -1)
    for options, name in (({"detail": {"grains": 0.5}}, "no faces"), ({"results": "device"}, "results")):
        with pytest.raises(ValueError, match=name):
            hc.Detector(scene, **options)
