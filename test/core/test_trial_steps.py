# SPDX-License-Identifier: Apache-2.0
"""Steps asked for again and again of one detector, as line searches do: what it keeps of a start, which it knows by its
contents, never shows in a result."""

import threading
import time

import numpy as np
import pytest
import random_scenes
from folded_patches import SHAPES

import hpccd_core as hc

ACCURACIES = pytest.mark.parametrize("accuracy", ["fast", "balanced", "conservative", "exact"])


# Other queries that a detector may be asked between trial steps.
BETWEEN = (
    lambda detector, start, end: detector.detect(start, end),
    lambda detector, start, end: detector.detect(end, start),
    lambda detector, start, end: detector.step(end),
    lambda detector, start, end: detector.proximity(start, 0.125),
    lambda detector, start, end: detector.distances(end),
    lambda detector, start, end: detector.intersections(end),
    lambda detector, start, end: detector.collision_free_step(end, start),
    lambda detector, start, end: None,
)


def lifted(seed):
    return random_scenes.free_at_first(np.random.default_rng([80, seed]))


def is_half(step):
    return 0.5 - 1e-9 <= step <= 0.5


def fresh_step(scene, v0, v1, separation=0.0, **options):
    detector = hc.Detector(scene, minimum_separation=separation, backend="cpu", threads=1, **options)
    return detector.collision_free_step(v0, v1)


@ACCURACIES
@pytest.mark.parametrize("threads", [1, 3])
def test_shorter_longer_and_turned_steps(accuracy, threads):
    """Each as a new detector computes it, in any order, between other queries."""
    rng = np.random.default_rng(81)
    for seed in range(4):
        meshes = lifted(seed)
        scene, v0, v1 = meshes.scene(), meshes.vertices_t0, meshes.vertices_t1
        ends = [v0 + part * (v1 - v0) for part in (1.0, 0.5, 0.25, 2.0, 0.0, 1e-9)]
        ends += [v1 + rng.normal(0, size, v1.shape) for size in (1e-6, 0.1, 2.0)]
        expected = [fresh_step(scene, v0, end, accuracy=accuracy) for end in ends]
        assert len(set(expected)) > 3
        detector = hc.Detector(scene, accuracy=accuracy, backend="cpu", threads=threads)
        for number in rng.permutation(np.tile(np.arange(len(ends)), 4)):
            assert detector.collision_free_step(v0, ends[number]) == expected[number]
            BETWEEN[rng.integers(len(BETWEEN))](detector, v0, ends[rng.integers(len(ends))])


@ACCURACIES
def test_a_start_that_is_all_but_the_same(accuracy):
    """One coordinate differs, by an ulp or by half the scene; in place, in an array that was seen before."""
    rng = np.random.default_rng(82)
    for seed in range(3):
        meshes = lifted(seed)
        scene, v0, v1 = meshes.scene(), meshes.vertices_t0.copy(), meshes.vertices_t1
        detector = hc.Detector(scene, accuracy=accuracy, backend="cpu", threads=2)
        for _ in range(30):
            detector.collision_free_step(v0, v1)
            kept = v0.copy()
            at = rng.integers(len(v0)), rng.integers(3)
            v0[at] = np.nextafter(v0[at], 99) if rng.random() < 0.5 else v0[at] + rng.normal(0, 4)
            expected = fresh_step(scene, v0, v1, accuracy=accuracy)
            assert detector.collision_free_step(v0, v1) == expected
            assert detector.collision_free_step(v0, v0 + 0.5 * (v1 - v0)) == fresh_step(
                scene, v0, v0 + 0.5 * (v1 - v0), accuracy=accuracy
            )
            if rng.random() < 0.5:
                v0[:] = kept


def flat_fall(height):
    """A triangle that falls onto another, parallel to it: contact where the height is gone."""
    corners = np.array([[0, 0, 0], [4, 0, 0], [0, 4, 0]], float)
    faces = np.array([[0, 1, 2]])
    return random_scenes.combine((faces, corners + [1, 1, height], corners + [1, 1, -1]), (faces, corners, corners))


def test_one_vertex_that_makes_the_contact_earlier():
    """All that is known of a start is worthless when a single corner of it moves towards the other mesh."""
    meshes = flat_fall(1.0)
    detector = hc.Detector(meshes.scene(), backend="cpu")
    v0, v1 = meshes.vertices_t0, meshes.vertices_t1
    assert is_half(detector.collision_free_step(v0, v1))
    v0[0, 2] = 0.25
    assert detector.collision_free_step(v0, v1) == pytest.approx(0.2, abs=1e-9)
    v0[0, 2] = 0.0
    assert detector.collision_free_step(v0, v1) == 0.0
    v0[0, 2] = np.nextafter(0.0, 1.0)
    assert 0 < detector.collision_free_step(v0, v0) == 1.0
    v0[0, 2] = 1.0
    assert is_half(detector.collision_free_step(v0, v1))


@pytest.mark.parametrize("accuracy", ["conservative", "exact"])
def test_a_start_that_comes_again_is_not_searched_again(accuracy):
    """As the docstring says: listed in the second call, used in the later ones, wherever the arrays lie; and the next
    start is listed at once."""
    number = np.arange(81).reshape(9, 9)  # vertices of a sheet, a quarter apart
    sheet = np.stack([*np.divmod(number.ravel(), 9), np.zeros(81)], axis=1) / 4
    a, b, c, d = (number[i : i + 8, j : j + 8].ravel() for i, j in ((0, 0), (1, 0), (1, 1), (0, 1)))
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    start = np.concatenate([sheet, sheet + [0.01, 0.02, 0.0125]])
    ways = [np.where(np.arange(len(start)) < len(sheet), 0.0, way)[:, None] * [0.1, 0, -1] for way in (0.025, 0.02)]
    scene = hc.Scene()
    for name in ("below", "above"):
        scene.add_mesh(name, faces, self_collision=False)
    detector = hc.Detector(scene, accuracy=accuracy, backend="cpu", threads=1)

    def stages(way, start=start):
        free = detector.collision_free_step(start.copy(), start + way)
        assert free == fresh_step(scene, start, start + way, accuracy=accuracy)
        return {"build", "refit", "near_pairs"} & set(detector.profile)

    assert stages(ways[0]) == {"build"}
    assert "near_pairs" in stages(ways[0])
    assert stages(ways[0]) == stages(ways[1]) == stages(0.5 * ways[0]) == set()
    detector.detect(start, start + ways[0])
    assert stages(ways[1]) == set()
    moved = start + [0, 0, 0.125]  # as a whole: nothing is nearer than it was
    assert stages(ways[1], moved) == {"near_pairs"} and detector.stats["leaf_pairs"] == 0
    elsewhere = start + np.random.default_rng(88).normal(0, 0.05, start.shape) * [1, 1, 0]
    assert "near_pairs" in stages(ways[1], elsewhere)
    assert stages(ways[0], elsewhere) == set()


def waving_sheets(rng, n=24):
    """Two bent sheets above each other, and motions that turn, drop and bend them by several edges."""
    flat = np.stack([*np.meshgrid(np.arange(n), np.arange(n)), np.zeros((n, n))], axis=2).reshape(-1, 3).astype(float)
    bent = flat + np.sin(0.3 * flat[:, :1] + 0.2 * flat[:, 1:2]) * [0, 0, 1.0]
    start = np.concatenate([bent, bent + [0.3, 0.2, 0.3]])
    scene = hc.Scene()
    for name in ("below", "above"):
        scene.add_mesh(name, random_scenes.sheet(n), n_vertices=len(flat))

    def way(size):
        turn = np.cross(rng.normal(0, 0.02, 3), start - start.mean(axis=0))
        wave = np.sin(start @ rng.normal(0, 0.1, 3))[:, None] * rng.normal(0, 0.2, 3)
        fall = np.where(np.arange(len(start)) < len(flat), 0.0, -1.0)[:, None] * [0.1, 0, 1]
        return size * (rng.normal(0, 3, 3) + turn + wave + fall)

    return scene, start, way


@pytest.mark.parametrize("accuracy", ["conservative", "exact"])
@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("separation", [0.0, 0.125])
def test_steps_that_go_far_where_neighbours_stay_together(accuracy, threads, separation):
    """Several edges until the first contact, from one start and from others nearby: as a new detector computes them, by
    few pairs of leaves."""
    rng = np.random.default_rng(86)
    scene, start, way = waving_sheets(rng)
    options = {"accuracy": accuracy, "minimum_separation": separation, "backend": "cpu"}
    step, first = (hc.Detector(scene, threads=threads, report=report, **options) for report in ("all", "first"))
    searched, steps, leaf_pairs = None, set(), []
    for call in range(30):
        begin = start + (rng.normal(0, 1.0, 3) if call > 4 else 0)
        end = begin + way(rng.choice([1.0, 0.8, 0.2]))
        new = hc.Detector(scene, threads=1, **options)
        found = new.detect(begin, end)
        searched = new.stats["leaf_pairs"] if searched is None else searched
        expected = new.collision_free_step(begin, end)
        assert step.collision_free_step(begin, end) == expected
        steps.add(expected)
        leaf_pairs.append(step.stats["leaf_pairs"])
        earliest = first.detect(begin, end)
        assert earliest.first_toc == found.first_toc
        if found.first_toc <= 1:
            at_first = found.vf_toc == found.first_toc, found.ee_toc == found.first_toc
            np.testing.assert_array_equal(earliest.vf, found.vf[at_first[0]])
            np.testing.assert_array_equal(earliest.ee, found.ee[at_first[1]])
    assert len(steps) > 8 and min(steps) < 0.5
    assert np.median(leaf_pairs) < searched / 4


def test_a_vertex_that_leaves_its_neighbours():
    """One corner of a sheet that falls as a whole goes its own way, through what was far from it."""
    scene, start, _ = waving_sheets(np.random.default_rng(87))
    detector = hc.Detector(scene, backend="cpu", threads=1)
    together = start + [0, 0, 20]
    for _ in range(3):
        assert detector.collision_free_step(start, together) == 1.0
    for vertex in (0, 300, len(start) - 1):
        apart = together.copy()
        apart[vertex, 2] += 8 if vertex < 576 else -8
        step = fresh_step(scene, start, apart)
        assert detector.collision_free_step(start, apart) == step < 1


@pytest.mark.parametrize("far", [2.0**10, 2.0**15])
def test_a_start_that_comes_again_after_one_far_away(far):
    """The list's snapshot is as sharp as before, not as floats around the far one have it: a gap just above their grid
    is closed by a way that is longer by less than a grid step."""
    grid = far / 2**23
    gap = (np.floor(0.7 / grid) + 0.6) * grid
    scene, start, _ = waving_sheets(np.random.default_rng(89), 12)
    above = np.arange(len(start)) >= len(start) // 2
    start[:, 2] = np.where(above, gap, 0)
    detector = hc.Detector(scene, backend="cpu", threads=1)
    for _ in range(2):
        assert detector.collision_free_step(start, start + [0.06, 0, 0]) == 1.0
    away = start + [0, 0, 1.25 * far]
    assert detector.collision_free_step(away, away + [1, 0, 0]) == 1.0
    assert "near_pairs" in detector.profile and "build" not in detector.profile
    end = start - np.where(above, gap + 0.1 * grid, 0)[:, None] * [0, 0, 1]
    step = fresh_step(scene, start, end)
    assert detector.collision_free_step(start, end) == step < 1


def test_no_list_where_no_edge_has_a_length():
    """One that reaches nowhere would be made again in each call."""
    rng = np.random.default_rng(89)
    scene = hc.Scene()
    scene.add_mesh("points", np.array([[0, 1, 2]]), n_vertices=500)
    start = np.concatenate([np.zeros((3, 3)), rng.normal(0, 10, (497, 3))])
    detector = hc.Detector(scene, backend="cpu", threads=1)
    for _ in range(5):
        end = start + rng.normal(0, 3, 3)
        assert detector.collision_free_step(start, end) == fresh_step(scene, start, end)
        assert "near_pairs" not in detector.profile


def test_signs_of_zero_and_types_of_numbers():
    meshes = flat_fall(1.0)
    detector = hc.Detector(meshes.scene(), backend="cpu")
    v0, v1 = meshes.vertices_t0, meshes.vertices_t1
    negative = np.where(v0 == 0, -0.0, v0)
    for start, end in (
        (v0, v1),
        (negative, v1),
        (v0.astype(np.float32), v1.astype(np.float32)),
        (v0.astype(np.float32), v1),
        (v0[:, ::-1][:, ::-1], v1),
        (v0.tolist(), v1),
    ):
        assert is_half(detector.collision_free_step(start, end))
    rounded = np.nextafter(v0, 9).astype(np.float32).astype(float)
    assert is_half(detector.collision_free_step(v0, v1)) and is_half(detector.collision_free_step(rounded, v1))


def test_separations_that_change_between_trials():
    """What is free of contacts may lie within a separation that was smaller, or 0, when the start was seen first."""
    meshes = flat_fall(1.0)
    scene, v0, v1 = meshes.scene(), meshes.vertices_t0, meshes.vertices_t1
    detector = hc.Detector(scene, backend="cpu")
    for separation, step in ((0.0, 0.5), (0.5, 0.25), (0.75, 0.125), (1.0, 0.0), (0.0, 0.5), (2.0, 0.0), (0.5, 0.25)):
        detector.set_separation("mesh0", "mesh1", separation)
        for _ in range(2):
            assert step - 1e-9 <= detector.collision_free_step(v0, v1) <= step
    for seed in range(3):
        meshes = lifted(seed)
        v0, v1 = meshes.vertices_t0, meshes.vertices_t1
        detector = hc.Detector(meshes.scene(), backend="cpu", threads=2)
        now = {}
        rng = np.random.default_rng(83)
        for _ in range(25):
            pair, separation = tuple(sorted(rng.integers(0, 5, 2).tolist())), float(rng.choice([0, 0.01, 0.5, 3]))
            now[pair] = separation
            detector.set_separation(*pair, separation)
            scene = meshes.scene()
            for (a, b), d in now.items():
                scene.set_separation(a, b, d)
            end = v0 + rng.choice([0.25, 1.0]) * (v1 - v0)
            assert detector.collision_free_step(v0, end) == fresh_step(scene, v0, end)


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e200])
def test_a_rejected_call_leaves_nothing_behind(bad):
    meshes = flat_fall(1.0)
    detector = hc.Detector(meshes.scene(), backend="cpu")
    v0, v1 = meshes.vertices_t0.copy(), meshes.vertices_t1.copy()
    for name, broken in (("vertices_t0", v0), ("vertices_t1", v1)):
        assert is_half(detector.collision_free_step(v0, v1))
        kept = broken[5, 2]
        broken[5, 2] = bad
        with pytest.raises(ValueError, match=name):
            detector.collision_free_step(v0, v1)
        broken[5, 2] = kept
        assert is_half(detector.collision_free_step(v0, v1))
    v0[5, 2] = bad
    with pytest.raises(ValueError, match="vertices_t0"):
        detector.collision_free_step(v0, v1)
    v0[5, 2] = 0.25  # the other triangle's corner: at the same height when the first has fallen by 0.75
    assert detector.collision_free_step(v0, v1) == fresh_step(meshes.scene(), v0, v1)


@pytest.mark.parametrize(
    ("change", "error", "text"),
    [
        (lambda v: v[:-1], ValueError, "vertices_t1"),
        (lambda v: v.astype(int), TypeError, "vertices_t1"),
        (lambda v: v[:, :2], ValueError, "vertices_t1"),
        (lambda v: np.ma.masked_array(v, mask=v > 2), TypeError, "vertices_t1"),
    ],
)
def test_wrong_arguments_are_named(change, error, text):
    meshes = flat_fall(1.0)
    detector = hc.Detector(meshes.scene(), backend="cpu")
    with pytest.raises(error, match=text):
        detector.collision_free_step(meshes.vertices_t0, change(meshes.vertices_t1))


def test_cancelled():
    """Heard under way and by the next call; another detector of the same scene goes on."""
    n = 60
    faces, rng = random_scenes.sheet(n), np.random.default_rng(84)
    flat = np.stack([*np.meshgrid(np.arange(n), np.arange(n)), np.zeros((n, n))], axis=2).reshape(-1, 3)
    layers = [(faces, flat + [0, 0, k] + rng.normal(0, 0.1, flat.shape), flat - [0, 0, k]) for k in range(4)]
    meshes = random_scenes.combine(*layers)
    scene, v0, v1 = meshes.scene(), meshes.vertices_t0, meshes.vertices_t1
    detector = hc.Detector(scene, backend="cpu", threads=2)
    expected = detector.collision_free_step(v0, v1)
    thread = threading.Thread(target=lambda: (time.sleep(0.05), detector.cancel()))
    thread.start()
    with pytest.raises(hc.Cancelled):
        while True:
            detector.collision_free_step(v0, v1)
    thread.join()
    with pytest.raises(hc.Cancelled):
        detector.collision_free_step(v0, v1)
    assert fresh_step(scene, v0, v1) == expected


def test_threads_that_share_a_detector():
    meshes = lifted(5)
    scene, v0, v1 = meshes.scene(), meshes.vertices_t0, meshes.vertices_t1
    motions = [(v0, v1), (v0, 0.5 * (v0 + v1)), (v1, v0), (0.5 * (v0 + v1), v1)]
    expected = [fresh_step(scene, *motion) for motion in motions]
    detector = hc.Detector(scene, backend="cpu", threads=2)
    wrong = []

    def ask(first):
        for turn in range(40):
            number = (first + turn) % len(motions)
            if detector.collision_free_step(*motions[number]) != expected[number]:
                wrong.append(number)

    threads = [threading.Thread(target=ask, args=(first,)) for first in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong


@pytest.mark.parametrize("name", SHAPES)
def test_patches_whose_freedom_was_proven_for_another_step(name):
    """Proven free for a short step, then asked for the whole one, then for another start."""
    faces, start, end, _ = SHAPES[name]()
    scene = hc.Scene()
    scene.add_mesh("patch", faces, n_vertices=len(start))
    detector = hc.Detector(scene, backend="cpu", threads=2)
    for _ in range(2):
        for first, last in (
            (start, start + 0.125 * (end - start)),
            (start, end),
            (start, start),
            (end, start),
            (0.5 * (start + end), end),
            (start, 2 * end - start),
        ):
            assert detector.collision_free_step(first, last) == fresh_step(scene, first, last)


@pytest.mark.parametrize("plane", [False, True], ids=["separation", "long edges"])
def test_a_scene_all_of_which_counts_as_near(plane):
    """Other meshes' separation, or edges, are larger than a whole sheet: not all pairs within the sheet are listed."""
    n, rng = 40, np.random.default_rng(85)
    flat = np.stack([*np.meshgrid(np.arange(n), np.arange(n)), np.zeros((n, n))], axis=2).reshape(-1, 3) / n
    faces, corners = np.array([[0, 1, 2]]), np.eye(3) * (1e6 if plane else 1)
    far = [(faces, corners + [0, 0, height], corners + [0, 0, height]) for height in (-50.0, -100.0)]
    sheet = random_scenes.sheet(n), flat, flat + rng.normal(0, 1e-5, flat.shape)
    meshes = random_scenes.combine(*far, sheet)
    scene, v0, v1 = meshes.scene(), meshes.vertices_t0, meshes.vertices_t1
    if not plane:
        scene.set_separation("mesh0", "mesh1", 2.0)
    detector = hc.Detector(scene, backend="cpu", threads=2)
    for part in (1.0, 0.5, 1.0, 300.0, 1.0, 300.0):
        end = v0 + part * (v1 - v0)
        assert detector.collision_free_step(v0, end) == fresh_step(scene, v0, end)
        assert detector.stats["bytes"] < 64e6
