# SPDX-License-Identifier: Apache-2.0
"""A moving point and a point, or a segment, with a thickness: against integers, random pairs and degenerate ones."""

import functools

import numpy as np
import pytest
from oracle.points import first_within

import hpccd_core as hc

FRAMES = np.array([np.eye(3) * 3, [[1, 2, 2], [2, 1, -2], [2, -2, 1]]])  # rows of length 3
EXTREMES = (1.0, 2.0**490, 2.0**-498, 2.0**-1060)


def random(rng, k):
    start = rng.uniform(-0.5, 0.5, (k, 3))
    return start, start + rng.normal(0, 0.7, (k, 3)), rng.choice([0.01, 0.3])


def small_numbers(rng, k):
    """Coincident vertices, segments without length, equal motions and distances reached exactly."""
    start, end = rng.integers(-2, 3, (2, k, 3)).astype(float)
    return start, end, float(rng.integers(0, 3))


def touching(rng, k):
    """A point that arrives at the distance, passes at it, or leaves it, over a vertex or the inside of a segment."""
    frame, distance = FRAMES[rng.integers(2)], rng.integers(1, 4)
    points = np.zeros((2, k, 3))
    if k == 3:
        points[:, 1, 0], points[:, 2, 0] = -rng.integers(0, 3), rng.integers(1, 4)
        points[:, 0, 0] = rng.integers(-2, 4)
    else:
        points[:, 0, 1] = rng.integers(-3, 4, 2)
    points[:, 0, 2] = distance + np.array([(4, 0), (0, 0), (0, 3), (2, -2)])[rng.integers(4)]
    start, end = points @ frame + rng.integers(-5, 6, (2, 1, 3))
    return start, end, 3.0 * distance


def parallel(rng, k):
    """All vertices move alike, or a point along the line of the others or beside it."""
    start, end = rng.integers(-2, 3, (k, 3)).astype(float), rng.integers(-2, 3, 3)
    end = start + end
    if rng.random() < 0.7:
        direction = start[-1] - start[k - 2]
        way = rng.integers(-6, 7) * direction
        beside = rng.integers(-1, 2, 3) * (rng.random() < 0.5)
        start[0] = (start[0] if k == 2 else start[1] + rng.integers(-4, 5) * direction) + beside
        end[0] = start[0] + (end[1] - start[1]) + way
    return start, end, float(rng.integers(0, 2))


def still(rng, k):
    start = rng.integers(-3, 4, (k, 3)).astype(float)
    return start, start, float(rng.integers(0, 5))


def at_an_end(rng, k):
    """A point that meets an end exactly, or misses it: at the start, in the middle or at the end of the step."""
    start, end = rng.integers(-4, 5, (2, k, 3)).astype(float)
    when, to = rng.choice([0.0, 0.5, 1.0]), rng.integers(1, k)
    meeting = (1 - when) * start[to] + when * end[to]
    start[0] = 2 * meeting - end[0] if when == 0.5 else meeting if when == 0 else start[0]
    end[0] = meeting if when == 1 else end[0]
    if rng.random() < 0.5:
        end[0, rng.integers(3)] += rng.choice([-1, 1]) * 2.0**-40
    return start, end, 0.0


FAMILIES = (random, small_numbers, touching, parallel, still, at_an_end)


@functools.cache
def detector_of(n_points, thickness_a, thickness_b, separation, accuracy):
    scene = hc.Scene()
    scene.add_points("point", 1, thickness=thickness_a)
    if n_points == 1:
        scene.add_points("other", 1, thickness=thickness_b)
    else:
        scene.add_mesh("segment", edges=[[0, 1]], thickness=thickness_b)
    scene.set_separation("point", 1, separation)
    return hc.Detector(scene, backend="cpu", threads=1, accuracy=accuracy)


@pytest.mark.parametrize("n", [100, pytest.param(2000, marks=pytest.mark.long)])
@pytest.mark.parametrize("n_points", [1, 2], ids=["vv", "ve"])
@pytest.mark.parametrize("family", FAMILIES)
def test_first_times_are_exact(family, n_points, n):
    rng = np.random.default_rng(7)
    counts = np.zeros(3, int)
    for k in range(n):
        start, end, distance = family(rng, n_points + 1)
        scale = EXTREMES[k // 2 % len(EXTREMES)] if k % 2 and family is not random else 1.0
        start, end, distance = start * scale, end * scale, distance * scale
        if family is touching and k % 3:
            distance = np.nextafter(distance, (0, np.inf)[k % 2])
        parts = (distance / 4, distance / 2) if k % 5 == 0 else (0.0, distance)
        separation = distance - sum(parts)
        limit = separation + sum(parts)
        expected = first_within(start, end, limit)
        for accuracy in ("exact", "conservative"):
            contacts = detector_of(n_points, *parts, separation, accuracy).detect(start, end)
            found, toc = (contacts.vv, contacts.vv_toc) if n_points == 1 else (contacts.ve, contacts.ve_toc)
            assert len(found) == len(contacts) == (expected is not None), (k, start, end, limit)
            if expected is None:
                counts[0] += 1
            elif accuracy == "exact":
                counts[1 if expected == 0 else 2] += 1
                assert abs(toc[0] - float(expected)) <= 1e-12, (k, start, end, limit)
            else:
                assert toc[0] <= float(expected), (k, start, end, limit)
    assert family is still or counts.min() > 0, counts
