# SPDX-License-Identifier: Apache-2.0
"""Detection with a minimum separation against the exact oracle: single pairs, and scenes."""

import itertools

import numpy as np
import oracle
import pytest
import random_scenes
from fuzz.disturbances import rotate
from fuzz.generators import EDGE_EDGE, GENERATORS, VERTEX_FACE
from fuzz.near_generators import NEAR_GENERATORS
from scene_pairs import assert_pairs, renamed, rows
from single_pairs import names
from single_pairs import renamed as query_renamed

import hpccd_core as hc

TEST = {VERTEX_FACE: hc.test_vertex_face, EDGE_EDGE: hc.test_edge_edge}
ORACLE = {VERTEX_FACE: oracle.separation_vertex_face, EDGE_EDGE: oracle.separation_edge_edge}
KINDS = pytest.mark.parametrize("kind", [VERTEX_FACE, EDGE_EDGE])
# "conservative" is computed as "exact": test_conservative_gives_the_same_pairs_as_exact.
CONSERVATIVE = pytest.param("conservative", marks=pytest.mark.long)
ACCURACIES = pytest.mark.parametrize("accuracy", ["exact", CONSERVATIVE])
EXACT_DISTANCES = [
    (VERTEX_FACE, "over_a_face"),
    (VERTEX_FACE, "over_a_border"),
    (EDGE_EDGE, "crossing_planes"),
    (EDGE_EDGE, "end_over_an_edge"),
]
SCENES = pytest.mark.parametrize("generate", random_scenes.ALL)
SEPARATION = 0.25


def five_small_meshes(rng):
    """Few enough features for an oracle that asks about each pair again whenever a separation changes."""
    sheets = random_scenes.crumpled_sheet(rng, 4), random_scenes.lattice_sheet(rng, 4)
    bodies = random_scenes.tetrahedron(rng), random_scenes.tetrahedron(rng), random_scenes.soup(rng, 10)
    return random_scenes.combine(*sheets, *bodies)


def asked(kind, queries, distances, accuracy="exact", **options):
    """One call for each distance."""
    hit, toc = np.zeros(len(queries), bool), np.full(len(queries), np.inf)
    for d in np.unique(distances):
        same = distances == d
        hit[same], toc[same] = TEST[kind](queries[same], accuracy, minimum_separation=float(d), **options)
    return hit, toc


def assert_kept(accuracy, found, truth):
    """What the accuracy promises of (hit, toc)."""
    (hit, toc), (true_hit, true_toc) = found, truth
    assert not (true_hit & ~hit).any(), "missed"
    assert not (hit & ~true_hit).any(), "invented"
    assert (toc[true_hit] <= true_toc[true_hit] + (1e-12 if accuracy == "exact" else 0)).all(), "late"
    if accuracy == "exact":
        assert (np.abs(toc[hit] - true_toc[hit]) <= 1e-12).all()


@ACCURACIES
@pytest.mark.parametrize(("kind", "name"), EXACT_DISTANCES)
@pytest.mark.parametrize(
    ("scale", "offset"), [(1.0, 0), (2.0**490, 0), (2.0**-498, 0), (2.0**-1060, 0), (1.0, 2**40), (2.0**-200, -(2**45))]
)
def test_distances_by_construction(accuracy, kind, name, scale, offset):
    """Gliding, grazing, arriving, parallel: the distance itself, and the doubles beside it."""
    queries, distances = NEAR_GENERATORS[kind][name](np.random.default_rng(1), 300)
    queries, distances = (queries + offset) * scale, distances * scale
    for d in (distances, np.nextafter(distances, 0), np.nextafter(distances, np.inf)):
        truth = ORACLE[kind](queries, d)
        assert truth[0].any() or (d < distances).any()
        assert_kept(accuracy, asked(kind, queries, d, accuracy), truth)


@pytest.mark.parametrize(("kind", "name"), EXACT_DISTANCES)
def test_missing_by_a_hair_is_no_contact(kind, name):
    """Turned by any angle the distances hold up to rounding: flat triangles and parallel edges that pass a few ulps
    beyond the separation, where a witness of nearness must not be too lenient."""
    rng = np.random.default_rng(9)
    queries, distances = NEAR_GENERATORS[kind][name](rng, 1500)
    queries = rotate(rng, queries)
    truth = ORACLE[kind](queries, distances)
    assert truth[0].any() and not truth[0].all()
    assert_kept("exact", asked(kind, queries, distances), truth)


@KINDS
def test_small_numbers(kind):
    """Degenerate features of all sorts at a few distances, many queries in a call."""
    for name in GENERATORS[kind]:
        every, _ = NEAR_GENERATORS[kind][f"{name}, small numbers"](np.random.default_rng(2), 100)
        for d, n in ((2.0**-1074, 4), (1e-30, 20), (0.5, 100), (1.0, 100), (3.0, 100), (1e100, 50)):
            queries = every[:n]
            truth = ORACLE[kind](queries, d)
            for accuracy, simd in itertools.product(("exact", "conservative"), ("scalar", "auto")):
                found = TEST[kind](queries, accuracy, simd=simd, minimum_separation=d)
                assert_kept(accuracy, found, truth)


@KINDS
def test_instruction_sets_agree_to_the_bit(kind):
    from fuzz.differential import usable_simd

    for accuracy in ("exact", "conservative", "balanced", "fast"):
        for name, generate in list(NEAR_GENERATORS[kind].items())[::3]:
            queries, _ = generate(np.random.default_rng(3), 100)
            results = [TEST[kind](queries, accuracy, simd=s, minimum_separation=0.75) for s in usable_simd()]
            for hit, toc in results[1:]:
                assert np.array_equal(hit, results[0][0]) and np.array_equal(toc, results[0][1]), (accuracy, name)


@KINDS
@pytest.mark.parametrize("accuracy", ["fast", "balanced", "conservative", "exact"])
def test_no_separation_is_contact_in_every_bit(kind, accuracy):
    for generate in GENERATORS[kind].values():
        queries = generate(np.random.default_rng(4), 300)
        for plain, separated in zip(
            TEST[kind](queries, accuracy), TEST[kind](queries, accuracy, minimum_separation=0.0), strict=True
        ):
            assert plain.tobytes() == separated.tobytes()


@KINDS
def test_conservative_gives_the_same_pairs_as_exact(kind):
    for name, generate in NEAR_GENERATORS[kind].items():
        queries, distances = generate(np.random.default_rng(5), 150)
        found, _ = asked(kind, queries, distances, "conservative")
        near, _ = ORACLE[kind](queries, distances)
        assert np.array_equal(found, near), name


@KINDS
def test_names_and_powers_of_two_change_nothing(kind):
    for name in list(NEAR_GENERATORS[kind])[::4]:
        queries, distances = NEAR_GENERATORS[kind][name](np.random.default_rng(6), 60)
        result = asked(kind, queries, distances)
        for order, _ in names(kind):
            found = asked(kind, np.array([query_renamed(q, order) for q in queries]), distances)
            assert np.array_equal(found[0], result[0])
            assert (np.abs(found[1][result[0]] - result[1][result[0]]) <= 2e-12).all()
        for factor in (2.0**300, 2.0**-300):
            found = asked(kind, queries * factor, distances * factor)
            exact = (queries * factor / factor == queries).all(axis=(1, 2)) & (distances * factor / factor == distances)
            assert np.array_equal(found[0][exact], result[0][exact])
            hit = exact & result[0]
            assert (np.abs(found[1][hit] - result[1][hit]) <= 2e-12).all()


@KINDS
@ACCURACIES
def test_a_larger_separation_is_reached_no_later(kind, accuracy):
    for generate in NEAR_GENERATORS[kind].values():
        queries, _ = generate(np.random.default_rng(7), 100)
        last_hit, last_toc = TEST[kind](queries, accuracy)
        for d in (1e-12, 0.1, 1.0, np.nextafter(1.0, 2), 4.0):
            hit, toc = TEST[kind](queries, accuracy, minimum_separation=d)
            assert not (last_hit & ~hit).any()
            if accuracy == "exact":  # each within 1e-12 of the truth
                assert (toc[last_hit] <= last_toc[last_hit] + 2e-12).all()
            last_hit, last_toc = hit, toc


@SCENES
@ACCURACIES
def test_scenes(generate, accuracy):
    meshes = generate(np.random.default_rng(31))
    v0, v1 = meshes.vertices_t0, meshes.vertices_t1
    truth = meshes.truth(minimum_separation=SEPARATION)
    assert len(truth.vf) > len(meshes.truth().vf)
    hashes = set()
    for threads, simd in ((1, "auto"), (3, "auto"), (2, "scalar")):
        detector = hc.Detector(
            meshes.scene(), accuracy=accuracy, minimum_separation=SEPARATION, threads=threads, simd=simd, backend="cpu"
        )
        for _ in range(2):  # on a hierarchy that is built, and on the same one refitted
            found = detector.detect(v0, v1)
            assert_pairs(found, truth, "toc", accuracy)
            hashes.add(found.hash)
    assert len(hashes) == 1


@pytest.mark.parametrize("method", ["published", "naive", "front"])
def test_other_methods_find_the_same(method):
    meshes = random_scenes.many_meshes(np.random.default_rng(32))
    found = [
        hc.Detector(meshes.scene(), minimum_separation=SEPARATION, method=m, backend="cpu").detect(
            meshes.vertices_t0, meshes.vertices_t1
        )
        for m in ("default", method)
    ]
    assert found[0].hash == found[1].hash and len(found[0]) == len(found[1]) > 0


@SCENES
@pytest.mark.parametrize("accuracy", ["fast", "balanced", "conservative", "exact"])
def test_scenes_without_separation_give_contact_in_every_bit(generate, accuracy):
    meshes = generate(np.random.default_rng(33))
    plain, zero, pair = meshes.scene(), meshes.scene(), meshes.scene()
    n = len(meshes.faces)
    for a in range(n):
        for b in range(a, n):
            pair.set_separation(f"mesh{a}", f"mesh{b}", 0.0)
    found = [
        hc.Detector(scene, accuracy=accuracy, minimum_separation=d, backend="cpu").detect(
            meshes.vertices_t0, meshes.vertices_t1
        )
        for scene, d in ((plain, 0.0), (zero, 0), (pair, 0.5))
    ]
    for other in found[1:]:
        assert other.hash == found[0].hash
        for name in ("vf", "vf_toc", "ee", "ee_toc"):
            assert getattr(other, name).tobytes() == getattr(found[0], name).tobytes()


@ACCURACIES
def test_separations_of_pairs_of_meshes(accuracy):
    meshes = five_small_meshes(np.random.default_rng(34))
    v0, v1 = meshes.vertices_t0, meshes.vertices_t1
    pairs = {(0, 0): 0.0625, (0, 2): 0.0, (1, 4): 0.75, (3, 3): 2.0}
    scene = meshes.scene()
    for (a, b), d in pairs.items():
        scene.set_separation(f"mesh{b}", a, d)  # by name or number, in any order
    detector = hc.Detector(scene, accuracy=accuracy, minimum_separation=0.125, backend="cpu")
    assert_pairs(
        detector.detect(v0, v1), meshes.truth(minimum_separation=0.125, pair_separation=pairs), "toc", accuracy
    )
    for (a, b), d in {(1, 4): 0.0, (0, 2): 0.5, (2, 3): 3.0}.items():
        pairs[a, b] = d
        detector.set_separation(f"mesh{a}", f"mesh{b}", d)
        truth = meshes.truth(minimum_separation=0.125, pair_separation=pairs)
        assert_pairs(detector.detect(v0, v1), truth, "toc", accuracy)
    built_with_them = meshes.scene()
    for (a, b), d in pairs.items():
        built_with_them.set_separation(a, b, d)
    other = hc.Detector(built_with_them, accuracy=accuracy, minimum_separation=0.125, backend="cpu").detect(v0, v1)
    assert other.hash == detector.detect(v0, v1).hash
    table = np.full((5, 5), 0.125)
    for (a, b), d in pairs.items():
        table[a, b] = table[b, a] = d
    at_once = hc.Detector(meshes.scene(), accuracy=accuracy, backend="cpu")
    at_once.set_separations(table)
    assert at_once.detect(v0, v1).hash == other.hash


def test_a_pair_has_a_separation_where_the_detector_has_none():
    meshes = random_scenes.many_meshes(np.random.default_rng(35))
    v0, v1 = meshes.vertices_t0, meshes.vertices_t1
    detector = hc.Detector(meshes.scene(), backend="cpu")
    plain = detector.detect(v0, v1)
    detector.set_separation("mesh0", "mesh4", 0.5)
    assert_pairs(detector.detect(v0, v1), meshes.truth(pair_separation={(0, 4): 0.5}), "toc")
    detector.set_separation("mesh0", "mesh4", 0.0)
    assert detector.detect(v0, v1).hash == plain.hash


@SCENES
def test_other_names_for_vertices_and_faces(generate):
    rng = np.random.default_rng(36)
    meshes = generate(rng)
    other = renamed(rng, meshes)
    found, same = (
        hc.Detector(m.scene(), minimum_separation=SEPARATION, backend="cpu").detect(m.vertices_t0, m.vertices_t1)
        for m in (meshes, other.meshes)
    )
    for kind in ("vf", "ee"):
        mapped = getattr(other, kind)(getattr(same, kind), getattr(same, f"{kind}_toc"))
        assert [pair for pair, _ in mapped] == rows(getattr(found, kind))
        np.testing.assert_allclose([t for _, t in mapped], getattr(found, f"{kind}_toc"), rtol=0, atol=2e-12)


@pytest.mark.parametrize("scale", [2.0**-40, 2.0**200, 2.0**-300])
def test_powers_of_two_of_scenes(scale):
    meshes = random_scenes.many_meshes(np.random.default_rng(37))
    found, same = (
        hc.Detector(meshes.scene(), minimum_separation=SEPARATION * s, backend="cpu").detect(
            meshes.vertices_t0 * s, meshes.vertices_t1 * s
        )
        for s in (1.0, scale)
    )
    for kind in ("vf", "ee"):
        assert rows(getattr(found, kind)) == rows(getattr(same, kind))
        np.testing.assert_allclose(getattr(found, f"{kind}_toc"), getattr(same, f"{kind}_toc"), rtol=0, atol=2e-12)


@ACCURACIES
def test_report_first_and_any(accuracy):
    for seed in range(38, 44):
        meshes = random_scenes.many_meshes(np.random.default_rng(seed))
        meshes.vertices_t0[meshes.n_vertices[0] :] += 9  # so that not everything begins at 0
        options = {"accuracy": accuracy, "minimum_separation": SEPARATION, "backend": "cpu"}
        scene = meshes.scene(no_self_collision=range(5))
        every, first, one = (
            hc.Detector(scene, report=report, **options).detect(meshes.vertices_t0, meshes.vertices_t1)
            for report in ("all", "first", "any")
        )
        assert len(every) > 0 and first.first_toc == every.first_toc
        for kind in ("vf", "ee"):
            earliest = getattr(every, f"{kind}_toc") == every.first_toc
            assert rows(getattr(first, kind)) == rows(getattr(every, kind)[earliest])
            assert set(rows(getattr(one, kind))) <= set(rows(getattr(every, kind)))
        assert len(one) == 1


def test_points_and_normals_stand_between_the_nearest_points():
    meshes = random_scenes.many_meshes(np.random.default_rng(45))
    v0, v1 = meshes.vertices_t0, meshes.vertices_t1
    found = hc.Detector(
        meshes.scene(), minimum_separation=SEPARATION, outputs=("points", "normals", "closest"), backend="cpu"
    ).detect(v0, v1)
    toc = np.concatenate([found.vf_toc, found.ee_toc])
    apart = found.closest[:, 1] - found.closest[:, 0]
    distance = np.linalg.norm(apart, axis=1)
    np.testing.assert_allclose(found.points, found.closest.mean(axis=1), atol=1e-12)
    near = toc > 0
    assert near.any() and (~near).any()
    np.testing.assert_allclose(distance[near], SEPARATION, atol=1e-9)
    assert (distance[~near] <= SEPARATION + 1e-12).all()
    # From face to vertex, and from edge a to edge b; `closest` has the sides in the order of the pair.
    towards = np.where(np.arange(len(toc)) < len(found.vf), -1, 1)[:, None] * apart
    apart_at_all = distance > 1e-6
    towards = towards[apart_at_all] / distance[apart_at_all, None]
    np.testing.assert_allclose(found.normals[apart_at_all], towards, atol=1e-6)


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (-1.0, ValueError, "minimum_separation"),
        (np.nan, ValueError, "minimum_separation"),
        (np.inf, ValueError, "minimum_separation"),
        ("1", TypeError, "minimum_separation"),
        (True, TypeError, "minimum_separation"),
    ],
)
def test_bad_separations_are_rejected(value, error, text):
    with pytest.raises(error, match=text):
        hc.Detector(hc.Scene(), minimum_separation=value)
    with pytest.raises(error, match=text):
        hc.test_vertex_face(np.zeros((1, 8, 3)), minimum_separation=value)


def test_bad_separations_of_pairs_are_rejected():
    scene = random_scenes.many_meshes(np.random.default_rng(46)).scene()
    detector = hc.Detector(scene, backend="cpu")
    for owner in (scene, detector):
        for bad, error in ((-1.0, ValueError), (np.nan, ValueError), ("1", TypeError)):
            with pytest.raises(error, match="separation|distance"):
                owner.set_separation("mesh0", "mesh1", bad)
        with pytest.raises(ValueError, match="no mesh is named 'nobody'"):
            owner.set_separation("mesh0", "nobody", 1.0)
        with pytest.raises(ValueError, match="mesh_b"):
            owner.set_separation(0, 99, 1.0)


def test_bad_tables_of_separations_are_rejected():
    meshes = five_small_meshes(np.random.default_rng(47))
    detector = hc.Detector(meshes.scene(), backend="cpu")
    one_sided, not_finite, negative = np.zeros((3, 5, 5))
    one_sided[1, 2], not_finite[3, 3], negative[0, 4] = 1.0, np.nan, -1.0
    negative[4, 0] = -1.0
    for bad, error, text in (
        (one_sided, ValueError, "meshes 1 and 2 have two separations"),
        (not_finite, ValueError, "of_pairs: must be finite"),
        (negative, ValueError, "of_pairs: must be finite and not negative, got -1"),
        (np.zeros((4, 4)), ValueError, r"of_pairs: expected shape \(5, 5\)"),
        (np.zeros(25), ValueError, "of_pairs: expected shape"),
        ("0.1", TypeError, "of_pairs: expected"),
        ([["a"] * 5] * 5, TypeError, "of_pairs: expected"),
        ([[0.0] * 5, [0.0]], ValueError, "of_pairs: not a rectangular array"),
        (None, TypeError, "of_pairs: expected"),
    ):
        with pytest.raises(error, match=text):
            detector.set_separations(bad)
    v0, v1 = meshes.vertices_t0, meshes.vertices_t1
    plain = hc.Detector(meshes.scene(), backend="cpu").detect(v0, v1)
    assert detector.detect(v0, v1).hash == plain.hash
    detector.set_separations([[0] * 5] * 5)  # whole numbers, as lists
    assert detector.detect(v0, v1).hash == plain.hash
