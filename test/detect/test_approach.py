# SPDX-License-Identifier: Apache-2.0
"""Direction and speed of approach of the nearest parts of two meshes. No ROS."""

import math

import numpy as np
import pytest

import hpccd_core as hc
from hpccd_ros.detect.core import Options
from hpccd_ros.detect.pair_summary import approach_speeds, directions
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
