# SPDX-License-Identifier: Apache-2.0
"""Each of many worlds has results that are bit-identical to those of a detector of its own, whatever the others are."""

import itertools

import many_worlds
import numpy as np
import pytest
import random_scenes
from many_worlds import assert_contacts, assert_gaps, assert_intersections, assert_proximity

import hpccd_core as hc

BACKENDS = pytest.mark.parametrize("backend", [*hc.backends(), "auto"])
ALL_OUTPUTS = ("points", "normals", "closest", "weights")


def assert_steps(worlds, backend="cpu", threads=2, steps=3, **options):
    """Some steps there and back; returns how many contacts there were."""
    together, alone = worlds.detector(backend, threads, **options), worlds.alone(backend, **options)
    n = 0
    for step in range(steps):
        start, end = (worlds.start, worlds.end) if step % 2 == 0 else (worlds.end, worlds.start)
        found = together.detect(start, end)
        assert_contacts(found, [d.detect(a, b) for d, a, b in zip(alone, start, end, strict=True)])
        n += len(found)
    return n


@BACKENDS
@pytest.mark.parametrize("report", ["all", "first"])
@pytest.mark.parametrize("accuracy", ["fast", "balanced", "conservative", "exact"])
def test_at_every_accuracy(accuracy, report, backend):
    if accuracy == "fast" and backend == "auto":
        backend = "cpu"  # "auto" may take another one for one world than for many, and "fast" is not the same on each
    worlds = many_worlds.of(random_scenes.many_meshes, 9)
    assert assert_steps(worlds, backend, accuracy=accuracy, report=report, outputs=ALL_OUTPUTS) > 20


@pytest.mark.parametrize("backend", hc.backends())
@pytest.mark.parametrize("accuracy", ["balanced", "exact"])
def test_any_contact_is_the_same_one(accuracy, backend):
    assert assert_steps(many_worlds.crumpled(12), backend, accuracy=accuracy, report="any", steps=5) > 20


@pytest.mark.parametrize("n", [1, 2, 3, 7, 64])
@pytest.mark.parametrize("threads", [1, 2, 3, 5, 16])
def test_on_any_number_of_threads(threads, n):
    worlds = many_worlds.crumpled(n)
    assert assert_steps(worlds, threads=threads) > 0
    together = worlds.detector(threads=threads)
    found = together.collision_free_step(worlds.start, worlds.end)
    assert_proximity(
        together.proximity(worlds.start, 0.1),
        [d.proximity(v, 0.1) for d, v in zip(worlds.alone(), worlds.start, strict=True)],
    )
    alone = [d.collision_free_step(a, b) for d, a, b in zip(worlds.alone(), worlds.start, worlds.end, strict=True)]
    np.testing.assert_array_equal(found, alone)


@BACKENDS
@pytest.mark.parametrize("generate", random_scenes.ALL)
def test_of_every_kind_of_scene(generate, backend):
    worlds = many_worlds.of(generate, 5)
    assert_steps(worlds, backend, outputs=ALL_OUTPUTS)
    together, alone = worlds.detector(backend, outputs=ALL_OUTPUTS), worlds.alone(backend, outputs=ALL_OUTPUTS)
    for at in (worlds.start, worlds.end):
        own = list(zip(alone, at, strict=True))
        assert_proximity(together.proximity(at, 0.3), [d.proximity(v, 0.3) for d, v in own])
        assert_intersections(together.intersections(at), [d.intersections(v) for d, v in own])
        assert_gaps(together.distances(at), [d.distances(v) for d, v in own])


@BACKENDS
@pytest.mark.parametrize(
    "options",
    [
        {"features": "vertex_face"},
        {"features": "edge_edge"},
        {"method": "published"},
        {"method": "naive"},
        {"method": "front"},
        {"simd": "scalar"},
        {"minimum_separation": 0.05},
    ],
)
def test_with_every_option(options, backend):
    if "method" in options and backend == "gpu":
        pytest.skip("the published methods run on CPUs")
    assert assert_steps(many_worlds.of(random_scenes.many_meshes, 6), backend, outputs="points", **options) > 50


@BACKENDS
def test_with_static_meshes(backend):
    worlds = many_worlds.of(random_scenes.many_meshes, 8, static=(0,))
    assert assert_steps(worlds, backend) > 50
    worlds.start[3, 0, 1] += 0.125
    moved = hc.Detector(worlds.scene, backend=backend, worlds=8)
    with pytest.raises(ValueError, match=r"vertices_t1\[3, 0\]: moves, but it belongs to mesh 'mesh0'"):
        moved.detect(worlds.start, worlds.end)


@BACKENDS
def test_worlds_without_contacts_between_others(backend):
    worlds = many_worlds.crumpled(6)
    worlds.end[[0, 3, 5]] = worlds.start[[0, 3, 5]] = np.arange(worlds.start[0].size).reshape(-1, 3) * [[1.0, 0, 0]]
    worlds.start[1] = worlds.end[1] = 0  # all in one point: everything touches
    assert assert_steps(worlds, backend) > 100
    calm = many_worlds.of(random_scenes.free_at_first, 4)
    together = calm.detector(backend)
    found = together.detect(calm.start, calm.start)
    assert_contacts(found, [d.detect(v, v) for d, v in zip(calm.alone(backend), calm.start, strict=True)])


@BACKENDS
def test_the_order_of_worlds_is_only_their_order(backend):
    worlds = many_worlds.crumpled(11)
    order = np.random.default_rng(3).permutation(11)
    found = worlds.detector(backend).detect(worlds.start, worlds.end)
    shuffled = worlds.detector(backend).detect(worlds.start[order], worlds.end[order])
    assert_contacts(shuffled, [found.world(k) for k in order])
    assert shuffled.hash != found.hash


@BACKENDS
def test_streaming(backend):
    worlds = many_worlds.of(random_scenes.many_meshes, 5)
    together, alone = worlds.detector(backend), worlds.alone(backend)
    for positions in (worlds.start, worlds.end, worlds.end, worlds.start):
        assert_contacts(together.step(positions), [d.step(v) for d, v in zip(alone, positions, strict=True)])
    together.reset()
    first = together.step(worlds.start)
    assert len(first) == 0 and first.hash == 0 and first.first_toc == np.inf
    assert len(first.vf_offsets) == len(first.ee_offsets) == 6 and len(first.first_tocs) == 5
    assert len(first.world(4)) == 0


@BACKENDS
def test_everything_in_any_order(backend):
    """One detector, long-lived: each world's history is that of a detector of its own, too."""
    rng = np.random.default_rng(5)
    worlds = many_worlds.of(random_scenes.many_meshes, 6)
    asked = {
        report: (worlds.detector(backend, report=report), worlds.alone(backend, report=report))
        for report in ("all", "first")
    }
    start = worlds.start
    for call in range(60):
        together, alone = asked[("all", "first")[rng.integers(2)]]
        if call % 4 == 0:
            start = worlds.start[rng.permutation(6)]
        part = 10.0 ** rng.uniform(-4, 0, size=(6, 1, 1))
        end = start + part * (worlds.end - start)
        own = list(zip(alone, start, end, strict=True))
        question = rng.integers(7)
        if question == 0:
            separation = float(rng.choice([0.0, 0.01, 0.3]))
            for detector in itertools.chain(*([t, *a] for t, a in asked.values())):
                detector.set_separation(0, 1, separation)
        elif question == 1:
            assert_proximity(together.proximity(start, 0.2), [d.proximity(a, 0.2) for d, a, _ in own])
        elif question == 2:
            assert_intersections(together.intersections(start), [d.intersections(a) for d, a, _ in own])
        elif question == 3:
            assert_gaps(together.distances(start), [d.distances(a) for d, a, _ in own])
        elif question <= 5:
            free = together.collision_free_step(start, end)
            np.testing.assert_array_equal(free, [d.collision_free_step(a, b) for d, a, b in own])
        else:
            assert_contacts(together.detect(start, end), [d.detect(a, b) for d, a, b in own])


@BACKENDS
@pytest.mark.parametrize("separation", [0.0, 0.02])
def test_trial_steps_of_each_world_from_its_own_start(separation, backend):
    """What is listed near a start is each world's own, and does not depend on the thread that takes the world."""
    worlds = many_worlds.of(random_scenes.free_at_first, 13)
    together = worlds.detector(backend, threads=3, minimum_separation=separation)
    alone = worlds.alone(backend, minimum_separation=separation)
    rng = np.random.default_rng(1)
    free = 0
    for _ in range(12):
        end = worlds.start + rng.uniform(0.01, 1, size=(13, 1, 1)) * (worlds.end - worlds.start)
        found = together.collision_free_step(worlds.start, end)
        own = [d.collision_free_step(a, b) for d, a, b in zip(alone, worlds.start, end, strict=True)]
        assert found.shape == (13,) and found.dtype == np.float64
        np.testing.assert_array_equal(found, own)
        free += np.count_nonzero(found == 1)
    assert 0 < free < 12 * 13


@BACKENDS
def test_single_precision_and_layouts(backend):
    worlds = many_worlds.crumpled(4)
    start, end = worlds.start.astype(np.float32), worlds.end.astype(np.float32)
    expected = [d.detect(a, b) for d, a, b in zip(worlds.alone(backend), start, end, strict=True)]
    together = worlds.detector(backend)
    assert_contacts(together.detect(start, end), expected)
    assert_contacts(together.detect(np.asfortranarray(start), end.astype(np.float64)), expected)
    assert_contacts(together.detect(start.tolist(), end), expected)


@BACKENDS
def test_stats_and_profile_are_of_all_worlds(backend):
    worlds = many_worlds.crumpled(10)
    together, alone = worlds.detector(backend, threads=3), worlds.alone(backend)
    found = together.detect(worlds.start, worlds.end)
    for d, a, b in zip(alone, worlds.start, worlds.end, strict=True):
        d.detect(a, b)
    stats = together.stats
    assert stats["worlds"] == 10
    assert (stats["vf_contacts"], stats["ee_contacts"]) == (len(found.vf), len(found.ee))
    if together.backend == "cpu":
        for name in ("vf_proven_contacts", "ee_proven_contacts", "vf_by_integers"):
            assert stats[name] == sum(d.stats[name] for d in alone), name
    profile = together.profile
    assert profile["total"] > 0 and all(ms >= 0 for ms in profile.values())
    assert sum(ms for name, ms in profile.items() if name != "total" and "/" not in name) == pytest.approx(
        profile["total"]
    )
    together.intersections(worlds.start)
    assert "ef_intersections" in together.stats and "vf_contacts" not in together.stats


def test_many_small_worlds():
    scene = hc.Scene()
    for name in ("falling", "resting"):
        scene.add_mesh(name, [[0, 1, 2]])
    triangle = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    start = np.tile(np.concatenate([triangle + [0.1, 0.1, 1], triangle]), (8192, 1, 1))
    end = start.copy()
    end[:, :3, 2] -= np.linspace(0, 2, 8192)[:, None]
    detector = hc.Detector(scene, backend="cpu", worlds=8192)
    found, alone = detector.detect(start, end), hc.Detector(scene, backend="cpu", threads=1)
    assert np.count_nonzero(np.isfinite(found.first_tocs)) == 4096
    for k in range(0, 8192, 97):
        assert found.world(k).hash == alone.detect(start[k], end[k]).hash
    assert detector.stats["bytes"] < 8192 * 5000  # with a tree each


@pytest.mark.parametrize("report", ("all", "first"))
def test_what_is_near_is_known_but_no_tree_is_there_yet(report):
    """A world takes what it remembers along to any thread, and has a tree of its own only after its first search. Which
    world meets which thread is chance: many detectors."""
    side = np.arange(25).reshape(5, 5)
    a, b, c, d = side[:-1, :-1].ravel(), side[1:, :-1].ravel(), side[:-1, 1:].ravel(), side[1:, 1:].ravel()
    faces = np.concatenate([np.stack([a, b, d], axis=1), np.stack([a, d, c], axis=1)])
    x, y = np.meshgrid(np.linspace(0, 1, 5), np.linspace(0, 1, 5))
    sheet = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1)
    scene = hc.Scene()
    scene.add_mesh("falls", faces, self_collision=False)
    scene.add_mesh("ground", faces, static=True)
    start = np.tile(np.concatenate([sheet + [0.01, 0.013, 0.2], sheet]), (16, 1, 1))

    def fallen(by):
        end = start.copy()
        end[:, :25, 2] -= by
        return end

    for _ in range(60):
        detector = hc.Detector(scene, backend="cpu", worlds=16, threads=7, report=report)

        def first(end, detector=detector):
            if report == "first":
                return detector.detect(start, end).first_tocs
            return detector.collision_free_step(start, end)

        first(fallen(1e-4)), first(fallen(1e-4))
        assert first(fallen(0.4)).max() <= 0.5


def test_without_worlds_a_result_is_of_one():
    worlds = many_worlds.crumpled(1)
    one, single = worlds.detector(), hc.Detector(worlds.scene, backend="cpu")
    found, expected = one.detect(worlds.start, worlds.end), single.detect(worlds.start[0], worlds.end[0])
    for contacts in (found, expected):
        assert_contacts(contacts, [expected])
    assert single.worlds is None and one.worlds == 1
    assert expected.world(0) is expected
    assert_proximity(single.proximity(worlds.start[0], 0.1), [single.proximity(worlds.start[0], 0.1)])
    assert_intersections(single.intersections(worlds.start[0]), [single.intersections(worlds.start[0])])
    assert isinstance(single.collision_free_step(worlds.start[0], worlds.end[0]), float)
    assert one.collision_free_step(worlds.start, worlds.end).shape == (1,)
    assert_gaps(one.distances(worlds.start), [single.distances(worlds.start[0])])
