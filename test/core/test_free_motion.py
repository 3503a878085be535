# SPDX-License-Identifier: Apache-2.0
"""collision_free_motion: nothing touches in it, and no vertex keeps less than a step of one length would leave it."""

import dataclasses

import numpy as np
import oracle
import pytest
import random_scenes

import hpccd_core as hc

SCENES = pytest.mark.parametrize("generate", random_scenes.ALL)


def detector_of(meshes, **options):
    return hc.Detector(meshes.scene(), **({"backend": "cpu", "threads": 2} | options))


def vertices_of(found, meshes):
    before = np.cumsum([0, *meshes.n_vertices[:-1]])
    faces = np.concatenate([np.reshape(f, (-1, 3)) + b for f, b in zip(meshes.faces, before, strict=True)])
    return np.concatenate([np.concatenate([found.vf[:, :1], faces[found.vf[:, 1]]], 1), found.ee]).astype(int)


def assert_free(meshes, motion, detector, start, end):
    """All that the documentation promises. Returns the factors."""
    assert motion.vertices.dtype == start.dtype and motion.vertices.shape == start.shape
    assert motion.factors.dtype == np.float64 and ((motion.factors >= 0) & (motion.factors <= 1)).all()
    left = detector.detect(start, motion.vertices)
    touching = vertices_of(left, meshes)
    assert np.isin(touching, motion.stuck).all() and not np.concatenate([left.vf_toc, left.ee_toc]).any()
    assert (motion.factors[motion.stuck] == 0).all() and np.array_equal(motion.stuck, np.unique(motion.stuck))
    at_start = detector.detect(start, start)
    assert np.array_equal(np.unique(vertices_of(at_start, meshes)), motion.stuck)
    kept = motion.factors == 1
    assert np.array_equal(motion.vertices[kept], end[kept])
    assert np.array_equal(motion.vertices[motion.factors == 0], start[motion.factors == 0])
    exact = start + motion.factors[:, None] * (end.astype(float) - start)
    roundings = np.finfo(start.dtype).eps * np.maximum(np.abs(start), np.abs(end)).max(initial=0)
    assert np.abs(motion.vertices - exact).max(initial=0) <= 2 * roundings
    assert (motion.factors[(start == end).all(1) & ~np.isin(np.arange(len(start)), motion.stuck)] == 1).all()
    return motion.factors


@SCENES
@pytest.mark.parametrize("options", [{}, {"minimum_separation": 0.03125}, {"accuracy": "conservative"}], ids=str)
def test_nothing_touches(generate, options):
    for seed in range(4):
        meshes = generate(np.random.default_rng([45, seed]))
        start, end = meshes.vertices_t0, meshes.vertices_t1
        detector = detector_of(meshes, **options)
        motion = detector.collision_free_motion(start, end)
        factors = assert_free(meshes, motion, detector, start, end)
        step = detector.collision_free_step(start, end)
        moved = (start != end).any(1)
        assert factors[moved].min(initial=1) >= 0.9 * step * (1 - 1e-9)
        for other in ({"threads": 1, "simd": "scalar"}, {"threads": 5}, {"report": "any"}, {"method": "published"}):
            assert detector_of(meshes, **options, **other).collision_free_motion(start, end) == motion


@SCENES
@pytest.mark.parametrize("features", [("vertex_face",), ("edge_edge",), ("vertex_face", "edge_edge")], ids=str)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("n", [1, pytest.param(12, marks=pytest.mark.long)])
def test_by_the_exact_oracle(generate, features, dtype, n):
    """With a static mesh, one that passes through another, one that passes through itself, and a separation."""
    for seed in range(n):
        rng = np.random.default_rng([47, seed])
        meshes = generate(rng)
        several = len(meshes.faces) > 1
        rules = {"static": (1,), "ignored_pairs": ((0, 1),), "no_self_collision": (0,)} if several else {}
        separations = np.full((len(meshes.faces),) * 2, rng.choice([0, 2.0**-5]))
        start, end = meshes.vertices_t0.astype(dtype), meshes.vertices_t1.astype(dtype)
        if several:
            at_rest = np.repeat(np.arange(len(meshes.faces)) == 1, meshes.n_vertices)
            end[at_rest] = start[at_rest]
            separations[-1, 0] = separations[0, -1] = 2.0**-4
        detector = hc.Detector(meshes.scene(**rules), backend="cpu", threads=2, features=features)
        detector.set_separations(separations)
        motion = detector.collision_free_motion(start, end)
        found = oracle.brute_force(
            start,
            motion.vertices,
            meshes.faces,
            pair_separation=dict(np.ndenumerate(separations)),
            threads=2,
            **meshes.beside_faces,
            **rules,
        )
        if "vertex_face" not in features:
            found = dataclasses.replace(found, vf=found.vf[:0], vf_toc=found.vf_toc[:0])
        if "edge_edge" not in features:
            found = dataclasses.replace(found, ee=found.ee[:0], ee_toc=found.ee_toc[:0])
        assert not found.vf_toc.any() and not found.ee_toc.any()
        assert np.array_equal(np.unique(vertices_of(found, meshes)), motion.stuck)


@SCENES
def test_free_starts(generate):
    """Scenes that are apart at first: nothing is stuck."""
    for seed in range(4):
        meshes = generate(np.random.default_rng([46, seed]))
        rest = np.arange(len(meshes.vertices_t0))[:, None] * np.array([1, 0, 0]) * 4.0 * np.ptp(meshes.vertices_t0)
        detector = detector_of(meshes)
        motion = detector.collision_free_motion(meshes.vertices_t0 + rest, meshes.vertices_t1)
        factors = assert_free(meshes, motion, detector, meshes.vertices_t0 + rest, meshes.vertices_t1)
        step = detector.collision_free_step(meshes.vertices_t0 + rest, meshes.vertices_t1)
        if step > 0:
            assert not len(motion.stuck) and factors.min() >= 0.9 * step * (1 - 1e-9)


def flat_sheet(n):
    x, y = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n), indexing="ij")
    return np.stack([x, y, 0 * x], -1).reshape(-1, 3)


def stack(n_sheets=5, n=12, gap=0.05):
    """Sheets above each other, of which the uppermost falls fast: each pushes the next."""
    faces, flat = random_scenes.sheet(n), flat_sheet(n)
    start = np.concatenate([flat + [0, 0, gap * k] for k in range(n_sheets)])
    end = start.copy()
    end[-n * n :, 2] -= 10 * gap
    sheets = zip(start.reshape(n_sheets, -1, 3), end.reshape(n_sheets, -1, 3), strict=True)
    return random_scenes.combine(*[(faces, a, b) for a, b in sheets])


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_chain(dtype):
    meshes = stack()
    start, end = meshes.vertices_t0.astype(dtype), meshes.vertices_t1.astype(dtype)
    detector = detector_of(meshes)
    motion = detector.collision_free_motion(start, end)
    factors = assert_free(meshes, motion, detector, start, end)
    assert (factors[:-144] == 1).all() and (np.abs(factors[-144:] - 0.09) < 1e-3).all()


def test_far_vertices_keep_all_of_their_motion():
    """One pair meets at 1e-9 of the step; five edges away the cloth moves freely."""
    n = 24
    faces, flat = random_scenes.sheet(n), flat_sheet(n)
    scene = hc.Scene()
    scene.add_mesh("cloth", faces)
    scene.add_mesh("pin", np.empty((0, 3), int), n_vertices=1)
    middle = n // 2 * n + n // 2
    start = np.concatenate([flat, [flat[middle] + [1e-3, 1e-3, 1e-9]]])
    end = start.copy()
    end[:-1, 2] += 1
    motion = hc.Detector(scene, backend="cpu").collision_free_motion(start, end)
    rows, columns = np.divmod(np.arange(n * n), n)
    away = np.maximum(abs(rows - n // 2), abs(columns - n // 2))
    assert (motion.factors[:-1][away >= 5] == 1).all()
    assert motion.factors.min() < 2e-9 and motion.factors.mean() > 0.99


def test_groups_share_a_factor():
    meshes = stack(2, 6)
    detector = detector_of(meshes)
    start, end = meshes.vertices_t0, meshes.vertices_t1
    end[36:40, 2] = start[36:40, 2]  # a part of the upper sheet stays
    alone = detector.collision_free_motion(start, end).factors
    groups = np.full(72, -1)
    groups[40:72] = 7
    together = detector.collision_free_motion(start, end, groups)
    assert_free(meshes, together, detector, start, end)
    assert len(set(together.factors[40:])) == 1 and together.factors[40] <= alone[40:].min()
    assert (together.factors[:40] == 1).all()


def test_a_group_stays_with_a_resting_vertex_in_contact():
    scene = hc.Scene()
    scene.add_mesh("points", np.empty((0, 3), int), n_vertices=3)
    scene.add_mesh("face", [[0, 1, 2]])
    start = np.array([[0.25, 0.25, 0], [5, 5, 5], [6, 6, 6], [0, 0, 0], [1, 0, 0], [0, 1, 0]])
    end = start + [[0, 0, 0], [0, 0, 1], [0, 0, 1], [0, 0, 0], [0, 0, 0], [0, 0, 0]]
    motion = hc.Detector(scene, backend="cpu").collision_free_motion(start, end, [4, 4, -1, -1, 9, 9])
    assert motion.factors.tolist() == [0, 0, 1, 0, 0, 0] and motion.stuck.tolist() == [0, 3, 4, 5]
    assert np.array_equal(motion.vertices[:2], start[:2])


@pytest.mark.parametrize("gap", 10.0 ** -np.arange(1, 300, 13))
def test_only_vertices_in_contact_at_the_start_are_stuck(gap):
    """However soon others would be: their times are rounded to 0 in the end."""
    scene = hc.Scene()
    scene.add_mesh("point", np.empty((0, 3), int), n_vertices=1)
    scene.add_mesh("face", [[0, 1, 2]])
    start = np.array([[0.25, 0.25, gap], [0, 0, 0], [1, 0, 0], [0, 1, 0]])
    end = start - [[0, 0, 1], [0, 0, 0], [0, 0, 0], [0, 0, 0]]
    motion = hc.Detector(scene, backend="cpu").collision_free_motion(start, end)
    assert not len(motion.stuck) and (motion.factors[1:] == 1).all() and motion.vertices[0, 2] > 0


def test_worlds_are_computed_one_by_one():
    rng = np.random.default_rng(3)
    meshes = random_scenes.many_meshes(rng)
    ends = np.stack([meshes.vertices_t1 + 0.1 * k for k in range(5)])
    starts = np.stack([meshes.vertices_t0] * 5)
    alone = [detector_of(meshes).collision_free_motion(a, b) for a, b in zip(starts, ends, strict=True)]
    for threads in (1, 3):
        motion = detector_of(meshes, worlds=5, threads=threads).collision_free_motion(starts, ends)
        assert motion.vertices.shape == starts.shape and motion.factors.shape == starts.shape[:2]
        for k, one in enumerate(alone):
            assert np.array_equal(motion.vertices[k], one.vertices) and np.array_equal(motion.factors[k], one.factors)
        n = starts.shape[1]
        assert motion.stuck.tolist() == [k * n + v for k, one in enumerate(alone) for v in one.stuck]


def test_beside_other_queries():
    """The motion has boxes of its own; other queries of the detector do not notice."""
    meshes = stack()
    detector, other = detector_of(meshes), detector_of(meshes)
    start, end = meshes.vertices_t0, meshes.vertices_t1
    for k in range(4):
        now = start + 0.001 * k
        fresh = detector_of(meshes, minimum_separation=0.01 * max(k - 1, 0))
        assert detector.collision_free_motion(now, end) == fresh.collision_free_motion(now, end)
        assert detector.detect(now, end) == other.detect(now, end)
        assert detector.collision_free_step(now, end) == other.collision_free_step(now, end)
        assert detector.proximity(now, 0.06) == other.proximity(now, 0.06)
        detector.set_separations(np.full((5, 5), 0.01 * k))
        other.set_separations(np.full((5, 5), 0.01 * k))


def test_groups_of_any_integers():
    meshes = stack(2, 6)
    detector, ends = detector_of(meshes), (meshes.vertices_t0, meshes.vertices_t1)
    given = [np.full(72, 3, kind) for kind in (np.int8, np.uint64, ">i4")]
    given += [[2**63 - 1] * 72, np.broadcast_to(3, 72), np.full(144, 3)[::2]]
    one = detector.collision_free_motion(*ends, groups=np.zeros(72, int))
    assert one.factors.min() == one.factors.max() < 1
    assert all(detector.collision_free_motion(*ends, groups) == one for groups in given)


@pytest.mark.parametrize(
    "groups, error, text",
    [
        ([0, 1], ValueError, r"groups: expected shape \(72,\), a number for each vertex, got \(2,\)"),
        ([], ValueError, r"groups: .*, got \(0,\)$"),
        ([0, 1], ValueError, r"; from one of each mesh: numpy.repeat\(groups, n\), with the numbers n of th"),
        (np.zeros(71, int), ValueError, r"groups: .*, got \(71,\)$"),
        (np.zeros((3, 72), int), ValueError, r"got \(3, 72\); all worlds have the same groups: groups\[0\]$"),
        (np.zeros((72, 1), int), ValueError, r"got \(72, 1\); reshape it: groups.reshape\(-1\)$"),
        (np.zeros(72), TypeError, r"got dtype float64; convert with groups.astype\(int\); -1: a vertex on its own$"),
        (np.zeros(72, bool), TypeError, r"got dtype bool; write numpy.where\(groups, 0, -1\); -1: a vertex"),
        (np.full(72, -2), ValueError, r"groups: numbers from 0 to 2\*\*63 - 1, or -1 for a vertex .*, got -2$"),
        (np.full(72, 2**64 - 1, np.uint64), ValueError, f"groups: numbers from 0 to .*, got {2**64 - 1}$"),
        ("arm", TypeError, "groups: expected integers, got str; give a number for each vertex, in their order"),
        ({"arm": 0}, TypeError, "groups: expected integers, got dict; give a number for each vertex"),
    ],
)
def test_wrong_groups(groups, error, text):
    meshes = stack(2, 6)
    with pytest.raises(error, match=text):
        detector_of(meshes).collision_free_motion(meshes.vertices_t0, meshes.vertices_t1, groups)


def test_wrong_positions_and_cancelled():
    meshes = stack(2, 6)
    detector, end = detector_of(meshes), meshes.vertices_t1.copy()
    end[3, 1] = np.nan
    with pytest.raises(ValueError, match=r"vertices_t1\[3, 1\] is NaN"):
        detector.collision_free_motion(meshes.vertices_t0, end)
    detector.cancel()
    with pytest.raises(hc.Cancelled):
        detector.collision_free_motion(meshes.vertices_t0, meshes.vertices_t1)


def test_no_vertices_and_nothing_in_the_way():
    nothing = np.empty((0, 3))
    empty = hc.Detector(hc.Scene(), backend="cpu").collision_free_motion(nothing, nothing, [])
    assert empty.vertices.shape == (0, 3)
    assert repr(empty) == "CollisionFreeMotion(0 vertices, mean factor none, 0 stuck)"
    meshes = stack(2, 6)
    free = detector_of(meshes).collision_free_motion(meshes.vertices_t0, meshes.vertices_t0 + 1)
    assert (free.factors == 1).all() and repr(free) == "CollisionFreeMotion(72 vertices, mean factor 1, 0 stuck)"


def test_candidates_of_one_kind_after_both_kinds():
    """Lists of vertices and faces that an earlier motion filled, and this one leaves empty: two threads joined them at
    once, which freed their memory twice."""
    n = 400
    scene = hc.Scene()
    scene.add_mesh("plates", np.arange(3 * n).reshape(-1, 3), self_collision=False)
    scene.add_mesh("pins", n_vertices=n)
    for name in ("rods", "bars"):
        scene.add_mesh(name, edges=np.arange(2 * n).reshape(-1, 2), self_collision=False)
    at = 3.0 * np.arange(n)[:, None, None] * [1, 0, 0]
    parts = (
        [[0, 0, 0], [1, 0, 0], [0, 1, 0]],
        [[0.2, 0.2, 0.5]],
        [[0, 5, 0], [1, 5, 0]],
        [[0.5, 4.5, 0.5], [0.5, 5.5, 0.5]],
    )
    start = np.concatenate([(at + part).reshape(-1, 3) for part in parts])
    ends = []
    for way in (-1, 1):  # of the pins; the bars always move onto the rods
        end = start.copy()
        end[3 * n : 4 * n, 2] += way
        end[6 * n :, 2] -= 1
        ends.append(end)
    one, two = (hc.Detector(scene, backend="cpu", threads=threads) for threads in (1, 2))
    expected = [one.collision_free_motion(start, end) for end in ends]
    assert [(motion.factors < 1).sum() for motion in expected] == [3 * n, 2 * n]
    for turn in range(400):
        assert two.collision_free_motion(start, ends[turn % 2]) == expected[turn % 2]
