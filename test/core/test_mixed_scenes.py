# SPDX-License-Identifier: Apache-2.0
"""Scenes with planes, points, ropes, thickness and filters, by the exact oracle; `make fuzz` runs more."""

import dataclasses

import numpy as np
import pytest
from fuzz import differential, mixed
from fuzz.mixed_scenes import MIXED_MOTIONS, MIXED_SCENES, TOPOLOGIES

import hpccd_core as hc

ACCURACIES = ("exact", "conservative", "balanced", "fast")


def scenes(kind, names, seed, n=1):
    for number, name in enumerate(names):
        yield from zip(*MIXED_SCENES[kind][name](np.random.default_rng([seed, number]), n), strict=True)


@pytest.mark.parametrize("kind", TOPOLOGIES)
@pytest.mark.parametrize("accuracy", ACCURACIES)
def test_all_results_of_mixed_scenes(kind, accuracy):
    for query, distance in scenes(kind, ("noise", "pressed", "integers"), 45):
        assert not list(mixed.broken_promises(kind, query, distance, accuracy, ("auto",)))


@pytest.mark.long
@pytest.mark.parametrize("kind", TOPOLOGIES)
def test_all_results_of_more_mixed_scenes(kind):
    for query, distance in scenes(kind, MIXED_MOTIONS, 46, 4):
        for accuracy in ACCURACIES:
            assert not list(mixed.broken_promises(kind, query, distance, accuracy, differential.usable_simd()))


def thinner(detector, name, thickness):
    detector._core.set_thickness(detector._mesh_numbers[name], np.atleast_1d(thickness) * (1 - 1e-9))


def higher(detector, name, normal, offset):
    detector._core.set_plane(detector._mesh_numbers[name], normal, offset + 1e-9 * np.linalg.norm(normal))


def no_ring(scene, mesh, rings=None, **rest):
    if rings is None:
        super(hc.Scene, scene).ignore_within(mesh, **rest)


def one_less(detector, start, end, stream=None):
    found = super(hc.Detector, detector).detect(start, end)
    return dataclasses.replace(found, ee=found.ee[1:], ee_toc=found.ee_toc[1:])


def half_way(detector, start, end):
    motion = super(hc.Detector, detector).collision_free_motion(start, end)
    return dataclasses.replace(motion, vertices=(0.5 * (start + end)).astype(start.dtype))


@pytest.mark.parametrize(
    ("kind", "owner", "method", "mistake"),
    [
        ("thick-sheet-body", hc.Detector, "set_thickness", thinner),
        ("planes", hc.Detector, "set_plane", higher),
        ("rings", hc.Scene, "ignore_within", no_ring),
        ("rest", hc.Scene, "ignore_within", lambda *_, **__: None),
        ("face-groups", hc.Scene, "ignore_faces", lambda *_: None),
        ("single-pairs", hc.Scene, "ignore_features", lambda *_, **__: None),
        ("thick-layers", hc.Detector, "detect", one_less),
        ("planes", hc.Detector, "collision_free_motion", half_way),
    ],
)
def test_mistakes_are_seen(kind, owner, method, mistake, monkeypatch):
    monkeypatch.setattr(owner, method, mistake)
    mixed._detector.cache_clear()
    queries = scenes(kind, ("pressed", "integers", "noise"), 47, 4)
    assert any(list(mixed.broken_promises(kind, *query, "exact", ("auto",))) for query in queries)
    mixed._detector.cache_clear()
