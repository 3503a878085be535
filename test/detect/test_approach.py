# SPDX-License-Identifier: Apache-2.0
"""Direction and speed of approach of the nearest parts of two meshes, and how far to slow down. No ROS."""

import math

import numpy as np
import pytest

import hpccd_core as hc
from hpccd_ros.detect.approach import (
    approach_speeds,
    closing_speeds,
    directions,
    nearest,
    slowdown,
    times_to_contact,
)
from hpccd_ros.detect.core import Options
from hpccd_ros.detect.nearness import Nearness
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.detect.step_detector import StepDetector
from hpccd_ros.frames.types import MeshSettings, SceneFrame, Topology

FACES = np.array([[0, 1, 2]], np.uint32)
FLOOR = np.array([[-9.0, -9, 0], [9, -9, 0], [0, 9, 0]])
HAND = np.array([[0.0, 0, 0], [1, 0, 1], [0, 1, 1]])
TOPOLOGIES = (Topology(0, 3, FACES),) * 2


def gap(distance, first=(0, 0, 0), second=(0, 0, 0), kind="vertex-face"):
    return hc.Gap("a", "b", distance, kind, (0, 0), np.array([first, second], float))


@pytest.mark.parametrize(
    "second, expected",
    [
        ((0, 3, 4), (0, 0.6, 0.8)),
        ((-5e-324, 0, 0), (0, 0, 0)),
        ((-1e-300, 0, 0), (-1, 0, 0)),
        ((1e200, 0, -1e200), (math.sqrt(0.5), 0, -math.sqrt(0.5))),
        ((0, 0, 0), (0, 0, 0)),
    ],
)
def test_directions(second, expected):
    """Of any size; where half of the way is no number any more, none is told."""
    (found,) = directions([gap(1.0, second=second)])
    assert found == pytest.approx(expected, abs=1e-15)


def test_between_the_ends_of_all_numbers():
    (found,) = directions([gap(math.inf, (1.7e308, 0, 0), (-1.7e308, 0, 0))])
    assert found.tolist() == [-1, 0, 0]


def test_no_direction_where_they_touch_or_where_there_is_no_pair():
    none = hc.Gap("a", "b", math.inf, "", (), np.empty((0, 3)))
    rounded = gap(0.0, (0, 0, 0), (0, 0, 1e-17), "edge-face")
    assert not directions([rounded, none]).any()


def test_speeds():
    inf = math.inf
    then, now = ([gap(d) for d in of] for of in ((3.0, 1.0, 1.0, inf, inf), (1.0, 3.0, inf, 1.0, inf)))
    assert approach_speeds(then, now, 0.5)[:2].tolist() == [4, -4]
    assert np.isnan(approach_speeds(then, now, 0.5)[2:]).all()
    for before, seconds in ((None, 0.5), (then[:2], 0.5), (then, 0.0), (then, -1.0)):
        assert np.isnan(approach_speeds(before, now, seconds)).all()


def test_a_step_knows_the_distances_at_its_start_where_they_were_asked_for():
    """Those of a frame that was no end of a processed step are not known, nor those of a step without distances."""
    builder = SceneBuilder(tuple(map(MeshSettings, "ab")))
    detector = StepDetector(builder, Options(backend="cpu", threads=1, distances=True))
    frames = [SceneFrame(k, k, "", TOPOLOGIES, (HAND + (0, 0, 1 - 0.25 * k), FLOOR), ("a",), 0.0) for k in range(5)]
    first, second = detector.detect(*frames[:2]), detector.detect(*frames[1:3])
    assert first.gaps_before is None and second.gaps_before is first.gaps
    assert approach_speeds(second.gaps_before, second.gaps, 0.5)[1] == 0.5
    assert detector.detect(frames[1], frames[3]).gaps_before is None
    detector.options = Options(backend="cpu", threads=1)
    assert detector.detect(*frames[2:4]).gaps_before is None
    detector.options = Options(backend="cpu", threads=1, distances=True)
    assert detector.detect(frames[3], frames[4]).gaps_before is not None, "of frame 3 they were asked above"


def above_the_floor(random, count):
    """Frames of a hand above a wide floor, whose smallest distance is the lowest corner's height: (hands, floor
    heights, stamps in ns)."""
    steps = np.cumsum(random.normal(0, 0.3, (count, 3, 3)), axis=0)
    hands = HAND + (0, 0, 8) + steps - (0, 0, 0.4) * np.arange(count)[:, None, None]
    return hands, random.uniform(-0.2, 0.2, count), np.cumsum(random.integers(1, 10**9, count))


def heights(hand, floor):
    return hand[:, 2] - floor


@pytest.mark.parametrize("seed", range(20))
def test_speeds_times_and_scales_are_those_of_the_lowest_corner(seed):
    """Of a stream in which single steps are left out, as where a frame is lost."""
    random = np.random.default_rng(seed)
    hands, floors, stamps = above_the_floor(random, 12)
    frames = [
        SceneFrame(int(stamp), k, "", TOPOLOGIES, (hand, FLOOR + (0, 0, floor)), ("a",), 0.0)
        for k, (hand, floor, stamp) in enumerate(zip(hands, floors, stamps, strict=True))
    ]
    builder = SceneBuilder(tuple(map(MeshSettings, "ab")))
    nearness, steps = Nearness(builder, Options(backend="cpu", threads=1), 0.5), 0
    detector = StepDetector(builder, Options(backend="cpu", threads=1, distances=True))
    detector.detect(frames[0], frames[0])
    kept = [0, *sorted(random.choice(np.arange(1, 12), 8, replace=False))]
    for i, j in zip(kept, kept[1:], strict=False):
        seconds = 1e-9 * (stamps[j] - stamps[i])
        before, now = heights(hands[i], floors[i]), heights(hands[j], floors[j])
        found = detector.detect(frames[i], frames[j])
        lowest = now.argmin()
        if min(before.min(), now.min()) <= 0.5:
            break
        mean, own = (before.min() - now.min()) / seconds, (before[lowest] - now[lowest]) / seconds
        speed = max(mean, own)
        speeds = closing_speeds(found.gaps_before, found.gaps, found.gaps_approached, seconds)
        assert speeds[1] == pytest.approx(speed, rel=1e-9, abs=1e-9)
        contact = now.min() / speed if speed > 0 else math.inf
        assert times_to_contact(found.gaps, speeds)[1] == pytest.approx(contact, rel=1e-9)
        if nearness.within(frames[i], frames[j])[0] is None:
            scale = min(1.0, (now.min() - 0.5) / (speed * 2.0)) if speed > 0 else 1.0
            slowed = nearness.slowdown(frames[i], frames[j], 0.5, 2.0)
            assert slowed.scale == pytest.approx(scale, rel=1e-9)
            assert slowed.pair == (("a", "b") if scale < 1 else None)
            steps += 1
    assert steps


@pytest.mark.parametrize(
    "distance, speed, scale",
    [
        (1.5, 1.0, 0.5),
        (5.0, 1.0, 1.0),
        (5.0, 0.0, 1.0),
        (1.5, -1.0, 1.0),
        (1.0, 1.0, 0.0),
        (0.5, 1.0, 0.0),
        (1.5, math.nan, 0.0),
        (1.5, math.inf, 0.0),
        (math.inf, math.inf, 0.0),
        (1e300, 1e300, 0.5),
        (1.0 + 2**-52, 5e-324, 1.0),
    ],
)
def test_scale_of_one_pair(distance, speed, scale):
    """Within stop_distance 1 and where the speed is unknown it is 0; where they move apart, 1."""
    found = slowdown([gap(9.0), gap(distance)], np.array([0.0, speed]), 1.0, 2.0 if speed != 1.0 else 1.0)
    assert found.scale == pytest.approx(scale, abs=1e-15)


def test_the_least_of_all_pairs_counts_and_no_pair_counts_nothing():
    far, near = gap(9.0), hc.Gap("c", "d", 2.0, "edge-edge", (0, 0), np.zeros((2, 3)))
    none = hc.Gap("a", "c", math.inf, "", (), np.empty((0, 3)))
    found = slowdown([none, far, near], np.array([math.nan, 1.0, 1.0]), 1.0, 4.0)
    assert (found.scale, found.pair) == (0.25, ("c", "d"))
    assert slowdown([none], np.array([math.nan]), 1.0, 4.0).scale == 1
    assert (nearest([none, far, near]), nearest([none]), nearest([far, far])) == (2, None, 0)


def test_unknown_speeds():
    """Without the previous distances, and for stamps that do not advance."""
    moved, gaps = np.array([1.0]), [gap(2.0)]
    for before, seconds in ((None, 1.0), (gaps, 0.0), (gaps, -1.0)):
        speeds = closing_speeds(before, gaps, moved, seconds)
        assert np.isnan(speeds).all() and np.isnan(times_to_contact(gaps, speeds)).all()
        assert slowdown(gaps, speeds, 0.0, 1.0).scale == 0
    assert closing_speeds(gaps, gaps, np.array([math.nan]), 0.5).tolist() == [0]
    touching = [gap(0.0, kind="edge-face")]
    assert times_to_contact(touching, np.array([math.nan])).tolist() == [0]
