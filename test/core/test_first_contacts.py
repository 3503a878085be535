# SPDX-License-Identifier: Apache-2.0
"""report="first" holds exactly the contacts of "all" that begin at its earliest time, and collision_free_step is that
time, whatever the detector is made with."""

import itertools

import numpy as np
import pytest
import random_scenes
from fuzz.differential import usable_simd
from fuzz.steps import EARLY, is_first

import hpccd_core as hc

ACCURACIES = pytest.mark.parametrize("accuracy", ["fast", "balanced", "conservative", "exact"])


def apart_at_first(generate, seed):
    """Other scenes than those free at first are flattened and lifted, which leaves fewer contacts at the start."""
    meshes = generate(np.random.default_rng([70, seed]))
    if generate is not random_scenes.free_at_first:
        mesh = np.repeat(np.arange(len(meshes.faces)), meshes.n_vertices)
        meshes.vertices_t0[:, 2] = 0.125 * meshes.vertices_t0[:, 2] + 4 * mesh
    return meshes


SCENES = [random_scenes.free_at_first, *random_scenes.ALL[:-1]]


def detector(scene, report, **options):
    return hc.Detector(scene, report=report, **({"backend": "cpu", "threads": 2} | options))


def assert_first(scene, meshes, **options):
    """Of one step; returns how many contacts there are, and how many of them are first."""
    v0, v1 = meshes.vertices_t0, meshes.vertices_t1
    every, first = detector(scene, "all", **options), detector(scene, "first", **options)
    contacts = every.detect(v0, v1)
    steps = set()
    for _ in range(2):  # with a tree that is built, and with the same one fitted again
        earliest = first.detect(v0, v1)
        assert is_first(earliest, contacts)
        steps |= {d.collision_free_step(v0, v1) for d in (every, first)}
    (step,) = steps
    time = min(contacts.first_toc, np.nextafter(1.0, 0)) if len(contacts) else 1.0
    if options.get("accuracy", "exact") in ("exact", "conservative"):
        assert time - EARLY <= step <= time
    else:
        assert step == time
    return len(contacts), len(earliest), earliest.hash, step


@ACCURACIES
@pytest.mark.parametrize("generate", SCENES)
def test_any_threads_and_instruction_set(generate, accuracy):
    for seed in range(3):
        meshes = apart_at_first(generate, seed)
        scene = meshes.scene()
        results = {
            assert_first(scene, meshes, accuracy=accuracy, threads=threads, simd=simd)
            for threads, simd in [*((t, "auto") for t in (1, 2, 3, 7)), *((2, simd) for simd in usable_simd())]
        }
        assert len(results) == 1
        ((n, n_first, _, _),) = results
        assert n > 0 and n_first >= 1


@pytest.mark.parametrize("method", ["published", "naive", "front"])
@pytest.mark.parametrize("accuracy", ["balanced", "exact"])
def test_any_method(method, accuracy):
    for generate, seed in itertools.product(SCENES, range(2)):
        meshes = apart_at_first(generate, seed)
        results = {
            assert_first(meshes.scene(), meshes, accuracy=accuracy, method=m, threads=t)
            for m, t in (("default", 2), (method, 1), (method, 3))
        }
        assert len(results) == 1


@ACCURACIES
def test_separations(accuracy):
    """One for all, one for pairs of meshes, none for some; a large one reaches before a small one's contacts."""
    for seed in range(4):
        meshes = apart_at_first((random_scenes.many_meshes, random_scenes.free_at_first)[seed % 2], seed)
        scene = meshes.scene()
        scene.set_separation("mesh0", "mesh1", 0.0)
        scene.set_separation("mesh2", "mesh2", 0.0)
        scene.set_separation("mesh1", "mesh4", 0.75)
        plain = assert_first(meshes.scene(), meshes, accuracy=accuracy)[3]
        wide = assert_first(meshes.scene(), meshes, accuracy=accuracy, minimum_separation=0.25)[3]
        mixed = assert_first(scene, meshes, accuracy=accuracy, minimum_separation=0.25)[3]
        assert wide <= plain + 1e-6 and mixed <= plain + 1e-6


def test_accuracies_of_pairs_of_meshes():
    """Fast beside exact: a time of one tier may not rule out what the other would report earlier."""
    tiers = ("fast", "exact", "conservative", "balanced")
    for seed in range(6):
        rng = np.random.default_rng([71, seed])
        meshes = apart_at_first((random_scenes.many_meshes, random_scenes.free_at_first)[seed % 2], seed)
        scene = meshes.scene()
        for a in range(5):
            for b in range(a, 5):
                scene.set_accuracy(f"mesh{a}", f"mesh{b}", tiers[rng.integers(4)])
        v0, v1 = meshes.vertices_t0, meshes.vertices_t1
        results = set()
        for threads in (1, 3):
            every, first = (detector(scene, report, threads=threads) for report in ("all", "first"))
            contacts, earliest = every.detect(v0, v1), first.detect(v0, v1)
            assert is_first(earliest, contacts)
            step = every.collision_free_step(v0, v1)
            assert contacts.first_toc - EARLY <= step <= contacts.first_toc
            results.add((earliest.hash, step))
        assert len(results) == 1


@ACCURACIES
@pytest.mark.parametrize(
    "rules",
    [
        {"static": [0, 3]},
        {"no_self_collision": [0, 1, 2, 3, 4]},
        {"ignored_pairs": [(0, 1), (1, 1), (2, 3)]},
        {"static": [1], "no_self_collision": [0], "ignored_pairs": [(0, 4)]},
    ],
)
def test_what_the_scene_rules_out(rules, accuracy):
    for seed in range(2):
        meshes = apart_at_first((random_scenes.many_meshes, random_scenes.free_at_first)[seed], seed)
        mesh = np.repeat(np.arange(5), meshes.n_vertices)
        for still in rules.get("static", ()):
            meshes.vertices_t1[mesh == still] = meshes.vertices_t0[mesh == still]
        assert assert_first(meshes.scene(**rules), meshes, accuracy=accuracy)[0] > 0


@ACCURACIES
def test_single_precision_positions(accuracy):
    for generate in SCENES:
        meshes = apart_at_first(generate, 6)
        meshes.vertices_t0, meshes.vertices_t1 = (
            v.astype(np.float32) for v in (meshes.vertices_t0, meshes.vertices_t1)
        )
        narrow = assert_first(meshes.scene(), meshes, accuracy=accuracy)
        meshes.vertices_t0, meshes.vertices_t1 = (
            v.astype(np.float64) for v in (meshes.vertices_t0, meshes.vertices_t1)
        )
        assert narrow == assert_first(meshes.scene(), meshes, accuracy=accuracy)


def test_motions_of_a_few_of_the_least_numbers():
    """From starts that come again, so that what was near is known: products of such numbers are rounded to none."""
    least, between = np.finfo(float).smallest_subnormal, 0
    for seed in range(12):
        rng = np.random.default_rng([71, seed])
        scene = hc.Scene()
        scene.add_mesh("soup", np.array([rng.choice(14, 3, replace=False) for _ in range(9)]), n_vertices=14)
        every, first = detector(scene, "all"), detector(scene, "first")
        start = rng.integers(-20, 21, (14, 3))
        for step in range(12):
            start = start if step % 4 else start + rng.integers(-1, 2, (14, 3))
            motion = [at * least for at in (start, start + rng.integers(-27, 28, (14, 3)))]
            contacts = every.detect(*motion)
            assert is_first(first.detect(*motion), contacts), (seed, step)
            time = min(contacts.first_toc, 1.0)
            assert time - EARLY <= first.collision_free_step(*motion) <= time, (seed, step)
            between += 0 < time < 1
    assert between > 50


def test_outputs_belong_to_the_first_contacts():
    meshes = apart_at_first(random_scenes.many_meshes, 7)
    v0, v1 = meshes.vertices_t0, meshes.vertices_t1
    outputs = ("points", "normals", "closest")
    every, first = (detector(meshes.scene(), report, outputs=outputs).detect(v0, v1) for report in ("all", "first"))
    kept = np.concatenate([every.vf_toc, every.ee_toc]) == every.first_toc
    assert kept.any() and not kept.all()
    for name in outputs:
        assert getattr(first, name).tobytes() == getattr(every, name)[kept].tobytes()


@ACCURACIES
def test_many_contacts_at_one_time(accuracy):
    """A sheet that falls flat onto another: all of the first hundreds of contacts, on any number of threads."""
    faces = random_scenes.sheet(20)
    flat = np.stack([*np.meshgrid(np.arange(20.0), np.arange(20.0)), np.zeros((20, 20))], 2).reshape(-1, 3)
    meshes = random_scenes.combine(
        (faces, flat + [0.25, 0.5, 1], flat + [0.25, 0.5, -1]),
        (faces, flat, flat),
        (np.array([[0, 1, 2]]), [[0, 0, 9.0], [9, 0, 9], [0, 9, 9]], [[0, 0, -1.0], [9, 0, -1], [0, 9, -1]]),
    )
    results = {assert_first(meshes.scene(), meshes, accuracy=accuracy, threads=t) for t in (1, 2, 3, 7)}
    ((n, n_first, _, step),) = results
    assert n > n_first > 1000 and step == pytest.approx(0.5, abs=1e-6)


def test_published_scenes(data_folder):
    for name in ("cloth-ball", "n-body", "cloth-funnel"):
        with np.load(data_folder / f"{name}.npz") as truth:
            meshes = random_scenes.combine((truth["faces"], truth["vertices_t0"], truth["vertices_t1"]))
            true = min(truth["vf_toc"].min(), truth["ee_toc"].min())
            for accuracy in ("exact", "conservative"):
                for threads in (1, 2):
                    step = assert_first(meshes.scene(), meshes, accuracy=accuracy, threads=threads)[3]
                    assert true - EARLY <= step <= true, name


def test_published_scenes_with_separations(data_folder):
    for name in ("cloth-ball", "cloth-funnel"):
        with np.load(data_folder / f"{name}.npz") as motion:
            meshes = random_scenes.combine((motion["faces"], motion["vertices_t0"], motion["vertices_t1"]))
        with np.load(data_folder / "distance" / f"{name}-distance.npz") as truth:
            distances = [key for key in ("s", "s2", "s3") if f"{key}_d" in truth.files]
            assert distances
            for key in distances:
                d = float(truth[f"{key}_d"])
                true = min(truth[f"{key}_vf_toc"].min(), truth[f"{key}_ee_toc"].min())
                step = assert_first(meshes.scene(), meshes, minimum_separation=d)[3]
                assert true - EARLY <= step <= true, (name, d)
