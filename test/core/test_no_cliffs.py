# SPDX-License-Identifier: Apache-2.0
"""The cost of a scene depends on what is tested in it: counted in pairs, tests and bytes, never in time."""

import resource
from pathlib import Path

import numpy as np
import oracle
import pytest
import random_scenes

import hpccd_core as hc


def grid(n, spacing):
    """A square of n * n vertices in the plane z = 0."""
    corner = np.arange(n * n).reshape(n, n)[:-1, :-1].ravel()
    faces = np.concatenate(
        [np.stack([corner, corner + 1, corner + n], 1), np.stack([corner + 1, corner + n + 1, corner + n], 1)]
    )
    at = np.stack(np.meshgrid(np.arange(n), np.arange(n), [0], indexing="ij"), -1).reshape(-1, 3)
    return at * float(spacing), faces


def candidates(detector):
    stats = detector.stats
    return stats["vf_candidates"] + stats["ee_candidates"]


def rough_sheets(gaps):
    """Sheets of 2 * 19 * 19 triangles above each other, so far apart, of which the first sinks a little."""
    x, faces = grid(20, 0.03)
    x[:, 2] += 0.003 * np.random.default_rng(0).normal(size=len(x))
    start = np.vstack([x + [0, 0, z] for z in np.cumsum([0, *gaps])])
    end = start.copy()
    end[: len(x), 2] -= 0.002
    return faces, start, end


@pytest.mark.parametrize(
    "again",
    [
        lambda d: d.set_separation("a", "b", 1e-3),
        lambda d: d.set_separations(np.full((3, 3), 1e-3)),
        lambda d: d.set_separation("b", "c", 7.0),
    ],
    ids=["pair", "table", "pair-never-tested"],
)
def test_a_separation_that_changes_nothing_forgets_nothing(again):
    faces, start, end = rough_sheets([0.3, 0.3])
    scene = hc.Scene()
    for name in "abc":
        scene.add_mesh(name, faces, static=name != "a")
    detector = hc.Detector(scene, minimum_separation=1e-3, backend="cpu", threads=1)
    steps = [detector.collision_free_step(start, end) for _ in range(5)]
    assert detector.stats["leaf_pairs"] == 0  # what is known to be near results, without the tree
    again(detector)
    assert detector.collision_free_step(start, end) == steps[-1]
    assert detector.stats["leaf_pairs"] == 0
    detector.set_separation("a", "b", 2e-3)
    detector.collision_free_step(start, end)
    assert detector.stats["leaf_pairs"] > 0


@pytest.mark.parametrize("never", ["static", "ignored", "within"])
def test_a_separation_of_a_pair_that_is_never_tested_costs_nothing(never):
    faces, start, end = rough_sheets([0.3, 0.3])

    def counts(separation):
        scene = hc.Scene()
        scene.add_mesh("cloth", faces)
        for name in ("table", "wall"):
            scene.add_mesh(name, faces, static=never == "static", self_collision=never != "within")
        if never == "ignored":
            scene.ignore_pair("table", "wall")
        pair = ("table", "table") if never == "within" else ("table", "wall")
        detector = hc.Detector(scene, backend="cpu", threads=1)
        if separation:
            detector.set_separation(*pair, separation)
        found = detector.detect(start, end)
        return found.hash, detector.stats["node_pairs"], detector.stats["leaf_pairs"], candidates(detector)

    assert counts(1.0) == counts(None)


@pytest.mark.parametrize("report", ["all", "first", "any"])
def test_a_large_separation_of_one_pair_leaves_other_pairs_alone(report):
    faces, start, end = rough_sheets([0.3, 2.0])

    def search(separation):
        scene = hc.Scene()
        for name in "abc":
            scene.add_mesh(name, faces)
        detector = hc.Detector(scene, minimum_separation=1e-4, backend="cpu", threads=1, report=report)
        detector.set_separation("a", "c", separation)
        found = detector.detect(start, end)
        assert len(found) == 0
        return detector.stats["leaf_pairs"], candidates(detector)

    leaves, pairs = search(1e-4)
    with_far, pairs_with_far = search(1.5)
    assert with_far <= 1.5 * leaves and pairs_with_far <= 1.5 * pairs


@pytest.mark.parametrize("simd", ["scalar", "auto"])
def test_separations_of_all_sizes_lose_no_contact(simd):
    """Boxes of meshes with a large separation shrink for other pairs: never by too much. Where all pairs have one
    separation, none shrinks."""
    for seed in range(4):
        rng = np.random.default_rng(700 + seed)
        meshes = random_scenes.many_meshes(rng)
        v0, v1 = meshes.vertices_t0, meshes.vertices_t1
        scene = meshes.scene()
        n = len(scene.mesh_names)
        table = rng.choice([0, 0.03, 0.1, 0.5], (n, n), p=[0.4, 0.2, 0.3, 0.1])
        table = np.maximum(table, table.T)
        offsets = [scene.vertex_offset(i) for i in range(n)]
        expected = {}
        for d in np.unique(table):
            found = hc.Detector(scene, minimum_separation=d, backend="cpu").detect(v0, v1)
            expected.update((pair, toc) for pair, toc in contacts_of(found, scene, offsets) if table[pair[:2]] == d)
        for report in ("all", "first", "any"):
            detector = hc.Detector(scene, backend="cpu", simd=simd, report=report)
            detector.set_separations(table)
            found = dict(contacts_of(detector.detect(v0, v1), scene, offsets))
            first = min(expected.values())
            if report == "all":
                assert found == expected
            elif report == "first":
                assert found == {pair: toc for pair, toc in expected.items() if toc == first}
            else:
                assert len(found) == 1 and found.items() <= expected.items()
            assert first - 1e-9 <= detector.collision_free_step(v0, v1) <= first


def contacts_of(found, scene, offsets):
    """((mesh, mesh, kind, features), time) of each contact."""
    face_offsets = [scene.face_offset(i) for i in range(len(offsets))]
    for (vertex, face), toc in zip(found.vf.tolist(), found.vf_toc.tolist(), strict=True):
        a, b = np.searchsorted(offsets, vertex, "right") - 1, np.searchsorted(face_offsets, face, "right") - 1
        yield (int(a), int(b), "vf", vertex, face), toc
    for row, toc in zip(found.ee.tolist(), found.ee_toc.tolist(), strict=True):
        a, b = (np.searchsorted(offsets, row[i], "right") - 1 for i in (0, 2))
        yield (int(a), int(b), "ee", *row), toc


@pytest.mark.parametrize("slides", [False, True])
def test_at_rest_exactly_at_the_separation(slides):
    """Decided by one test at the start, in place of a search over time with 106 bits and then with integers."""
    x, faces = grid(12, 0.5)
    scene = hc.Scene()
    for name in ("a", "b"):
        scene.add_mesh(name, faces, self_collision=False)
    start = np.vstack([x, x + [0, 0, 0.5]])
    end = start.copy()
    if slides:
        end[: len(x)] += [0.125, 0.0625, 0]
    detector = hc.Detector(scene, minimum_separation=0.5, backend="cpu")
    found = detector.detect(start, end)
    near = detector.proximity(start, 0.5)
    of_start = {tuple(p) for p in near.vf.tolist()}, {tuple(p) for p in near.ee.tolist()}
    at_start = [
        {tuple(p) for p, t in zip(pairs.tolist(), toc, strict=True) if t == 0}
        for pairs, toc in ((found.vf, found.vf_toc), (found.ee, found.ee_toc))
    ]
    assert at_start == list(of_start) and len(near.vf) > 0 and len(near.ee) > 0
    detector.detect(start, end)
    if not slides:  # a sliding mesh approaches other features later, too
        assert detector.stats["vf_by_extended"] == detector.stats["ee_by_extended"] == 0


def test_any_ends_with_the_first_contact():
    tested = []
    for n in (1000, 4000):
        scene = hc.Scene()
        scene.add_mesh("a", np.arange(3 * n).reshape(n, 3))
        x = np.tile(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]]), (n, 1))
        for threads in (1, 3):
            detector = hc.Detector(scene, threads=threads, report="any", backend="cpu")
            found = [detector.detect(x, x) for _ in range(2)]
            assert len(found[0]) == 1 and found[0].hash == found[1].hash
        detector = hc.Detector(scene, threads=1, report="any", backend="cpu")
        assert detector.detect(x, x).hash == found[0].hash
        tested.append(candidates(detector))
    assert max(tested) < 2000  # a few pairs of leaves


def tetrahedra(n, rng):
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    at = rng.uniform(0, n ** (1 / 3) * 1.3, (n, 1, 3))
    return faces, (at + corners).reshape(-1, 3)


def resident_bytes():
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()


def test_bytes_of_many_meshes_grow_with_their_number():
    taken = []
    for n in (600, 2400):
        faces, x = tetrahedra(n, np.random.default_rng(0))
        scene = hc.Scene()
        for i in range(n):
            scene.add_mesh(f"mesh{i}", faces, self_collision=False, static=i % 7 == 0)
        for i in range(n - 1):
            scene.ignore_pair(i, i + 1)
        before = resident_bytes()
        detector = hc.Detector(scene, threads=1, backend="cpu")
        for i in range(1, n - 2):
            detector.set_separation(i, i + 2, 0.01)
        detector.detect(x, x)
        taken.append(detector.stats["bytes"] / n)
        grown = resident_bytes() - before
    assert taken[1] <= 1.3 * taken[0]
    assert grown < 30e6  # a table of all pairs would take 90 MB


@pytest.mark.parametrize("n", [40, 260])
def test_pairs_of_few_and_of_many_meshes_mean_the_same(n):
    """Up to 256 meshes there is a table of all pairs, beyond that a list of those that were set."""
    rng = np.random.default_rng(n)
    faces, x = tetrahedra(n, rng)
    start, end = x, x + np.repeat(rng.uniform(-0.4, 0.4, (n, 1, 3)), 4, axis=1).reshape(-1, 3)
    static = [i for i in range(n) if i % 5 == 0]
    end[[4 * i + k for i in static for k in range(4)]] = start[[4 * i + k for i in static for k in range(4)]]
    ignored = [tuple(p) for p in rng.integers(0, n, (4 * n, 2)).tolist()]
    separations = {tuple(sorted(p)): float(rng.choice([0, 0.05, 0.5])) for p in rng.integers(0, n, (8 * n, 2)).tolist()}
    scene = hc.Scene()
    for i in range(n):
        scene.add_mesh(f"mesh{i}", faces, static=i in static)
    for a, b in ignored:
        scene.ignore_pair(a, b)
    first = dict(list(separations.items())[: 4 * n])
    for (a, b), d in first.items():
        scene.set_separation(b, a, d)
    detector = hc.Detector(scene, minimum_separation=0.01, backend="cpu")

    def check(pairs):
        truth = oracle.brute_force(
            start,
            end,
            [faces] * n,
            n_vertices=[4] * n,
            static=static,
            ignored_pairs=ignored,
            minimum_separation=0.01,
            pair_separation=pairs,
        )
        found = detector.detect(start, end)
        assert found.vf.tolist() == truth.vf.tolist() and found.ee.tolist() == truth.ee.tolist()
        assert len(found.vf) > 0 and len(found.ee) > 0

    if n < 100:
        check(first)
    for (a, b), d in separations.items():
        detector.set_separation(a, b, d)
    check({**first, **separations})
    for a, b in separations:
        detector.set_separation(b, a, 0.01)
    check({})
