# SPDX-License-Identifier: Apache-2.0
"""The published method, its naive baseline and the front-based one give what the default traversal gives."""

import functools

import numpy as np
import pytest

import hpccd_core as hc

METHODS = ("published", "naive", "front")
THREADS = (1, 2, 5, 16)


def sheet(side):
    """Vertices (side**2, 2) and faces of a square sheet."""
    at = np.arange(side * side).reshape(side, side)
    a, b, c, d = at[:-1, :-1].ravel(), at[:-1, 1:].ravel(), at[1:, :-1].ravel(), at[1:, 1:].ravel()
    return np.stack(np.divmod(np.arange(side * side), side), 1) / side, np.concatenate([np.c_[a, b, c], np.c_[b, d, c]])


def crumpling(rules, side=22, frames=7):
    """A sheet that rolls up through itself and others that spin through it: scene and vertices of each frame."""
    flat, faces = sheet(side)
    scene = hc.Scene()
    scene.add_mesh("cloth", faces)
    scene.add_mesh("blade", faces, n_vertices=side**2 + 3, self_collision=not rules)
    scene.add_mesh("ghost", faces)
    scene.add_mesh("floor", faces, static=True)
    scene.add_mesh("wall", faces, static=True)
    if rules:
        scene.ignore_pair("ghost", "cloth")
        scene.ignore_pair("ghost", "ghost")
        scene.set_accuracy("cloth", "floor", "exact")
        scene.set_accuracy("cloth", "blade", "conservative")
    x, y = flat.T
    still = [np.c_[x, y, 0 * x], np.c_[x, 0.5 + 0 * x, y - 0.3]]
    steps = []
    for t in np.linspace(0, 1, frames):
        turns = 9 * t * x
        waves = 0.05 * np.sin(17 * x + 13 * y + 20 * t)
        cloth = np.c_[(0.5 - 0.3 * t) * np.cos(turns) + 0.3, y, 0.3 * np.sin(turns) + waves]
        c, s = np.cos(5 * t), np.sin(5 * t)
        blade = np.c_[0.5 + c * (x - 0.5), y + 0.1 * t, s * (x - 0.5)]
        lone = np.c_[[0.3, 0.5, 0.7], [0.4, 0.5, 0.6], [0.4 - t] * 3]
        ghost = np.c_[x, y, 0.3 - 0.5 * t + 0.1 * np.sin(9 * y)]
        steps.append(np.concatenate([cloth, blade, lone, ghost, *still]))
    return scene, steps


def assert_same(found, expected):
    for name in ("vf", "vf_toc", "ee", "ee_toc"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))
    assert found.hash == expected.hash


@functools.cache
def expected_of_crumpling(rules):
    """Scene, vertices of each frame and the contacts of the step that ends there."""
    scene, steps = crumpling(rules)
    detector = hc.Detector(scene, accuracy="balanced", threads=1)
    return scene, steps, [detector.step(vertices) for vertices in steps]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("rules", [False, True])
def test_same_contacts_on_any_number_of_threads(method, rules):
    scene, steps, expected = expected_of_crumpling(rules)
    assert min(len(c) for c in expected[1:]) > 100
    for threads in THREADS:
        detector = hc.Detector(scene, accuracy="balanced", threads=threads, method=method)
        for vertices, contacts in zip(steps, expected, strict=True):
            assert_same(detector.step(vertices), contacts)


def test_same_contacts_when_frames_repeat_and_jump():
    scene, steps = crumpling(rules=True)
    default = hc.Detector(scene, accuracy="balanced")
    others = [hc.Detector(scene, accuracy="balanced", threads=3, method=method) for method in METHODS]
    for start, end in [(0, 1), (0, 1), (5, 6), (6, 0), (3, 3), (0, 6), (1, 2)]:
        expected = default.detect(steps[start], steps[end])
        for detector in others:
            assert_same(detector.detect(steps[start], steps[end]), expected)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    "options", [{"report": "first"}, {"accuracy": "fast"}, {"accuracy": "exact"}, {"simd": "scalar"}]
)
@pytest.mark.parametrize("restructure", [True, False])
def test_with_other_options(method, options, restructure):
    scene, steps = crumpling(rules=False, side=8)
    options = {"accuracy": "balanced"} | options
    default = hc.Detector(scene, **options)
    detector = hc.Detector(scene, **options, threads=4, method=method, restructure=restructure)
    for vertices in steps:
        assert_same(detector.step(vertices), default.step(vertices))


@pytest.mark.parametrize("method", METHODS)
def test_points_and_minimum_separation(method):
    scene, steps = crumpling(rules=False, side=8)
    options = {"minimum_separation": 1e-3, "outputs": ("points", "normals", "closest", "weights")}
    expected = hc.Detector(scene, **options).detect(steps[0], steps[1])
    found = hc.Detector(scene, **options, method=method, threads=2).detect(steps[0], steps[1])
    assert_same(found, expected)
    assert found.outputs.keys() == expected.outputs.keys() and len(expected.outputs) == 6
    for name, array in expected.outputs.items():
        np.testing.assert_array_equal(found.outputs[name], array, err_msg=name)


@pytest.mark.parametrize("name", ["cloth-funnel", pytest.param("cloth-ball", marks=pytest.mark.long)])
def test_published_scenes(data_folder, name):
    with np.load(data_folder / f"{name}.npz") as truth:
        scene = hc.Scene()
        scene.add_mesh("scene", truth["faces"], n_vertices=len(truth["vertices_t0"]))
        step = truth["vertices_t0"], truth["vertices_t1"]
    default = hc.Detector(scene, accuracy="balanced")
    expected = default.detect(*step)
    assert len(expected) > 0
    for method in METHODS:
        for threads in THREADS:
            detector = hc.Detector(scene, accuracy="balanced", threads=threads, method=method)
            detector.detect(step[0], step[0])  # a step without motion leaves a hierarchy, and a front, to be updated
            assert_same(detector.detect(*step), expected)
            for count in ("vf_candidates", "ee_candidates"):
                # Theirs are boxes of the whole sweep.
                assert detector.stats[count] > default.stats[count]


def test_profile_and_stats_tell_of_the_method():
    scene, steps = crumpling(rules=False)
    counts = {
        "published": {"task_units", "tasks_reassigned", "task_requests", "nodes_restructured", "nodes_split_lazily"},
        "naive": {"redistributions", "lock_waits", "nodes_restructured", "nodes_split_lazily"},
        "front": {"front_pairs", "front_ascended", "front_descended", "front_rebuilt"},
    }
    for method in METHODS:
        detector = hc.Detector(scene, accuracy="balanced", threads=2, method=method)
        total = dict.fromkeys(counts[method], 0)
        for frame, vertices in enumerate(steps):
            detector.step(vertices)
            if frame:
                for name in total:
                    total[name] += detector.stats[name]
            if frame > 1:
                assert {"refit", "traverse", "elementary", "contacts", "other", "total"} <= detector.profile.keys()
        for name in counts[method] - {"lock_waits", "tasks_reassigned", "redistributions"}:
            assert total[name] > 0, name


def test_errors_name_the_remedy():
    scene = hc.Scene()
    with pytest.raises(ValueError, match="method: 'modern' is not known; use one of default, published, naive, front"):
        hc.Detector(scene, method="modern")
    with pytest.raises(TypeError, match="method: expected a string"):
        hc.Detector(scene, method=3)
    for method in METHODS:
        with pytest.raises(ValueError, match="report: 'any' is not offered by method .*; use method='default'"):
            hc.Detector(scene, method=method, report="any")
