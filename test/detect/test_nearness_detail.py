# SPDX-License-Identifier: Apache-2.0
"""Stop on coarse faces is never later than on all faces, whatever the motion, the thickness and the start. No ROS."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import hpccd_core as hc
from hpccd_ros.detect.core import Options
from hpccd_ros.detect.nearness import Nearness
from hpccd_ros.detect.scene import PlaneSettings, SceneBuilder
from hpccd_ros.frames.types import MeshSettings, SceneFrame, Topology

pytest.importorskip("fast_simplification", reason="coarse faces need the extra detail")
NAMES = ("ball", "sheet")
BALL, BALL_FACES = hc.shapes.icosphere(5)
SHEET, SHEET_FACES = hc.shapes.grid(12, 12)
TOPOLOGIES = (Topology(0, len(BALL), BALL_FACES), Topology(0, len(SHEET), SHEET_FACES))
BUILDER = SceneBuilder(tuple(MeshSettings(name) for name in NAMES))
OPTIONS = Options(backend="cpu", threads=1)
DETAIL = (("ball", 0.1), ("sheet", 0.2))


def frame(stamp, ball, sheet):
    return SceneFrame(stamp, stamp, "", TOPOLOGIES, (ball, sheet), NAMES, 0.0)


def frames(random):
    """A bumpy ball wanders about a waving sheet, now near, now far, and sometimes through it."""
    bumps = 1 + 0.1 * np.sin(7 * BALL[:, :1] + random.normal())
    for stamp in range(8):
        shift = random.normal(scale=(0.5, 0.5, 1.2))
        waves = 0.1 * np.sin(4 * SHEET[:, 0] + stamp)
        yield frame(stamp, 0.4 * bumps * BALL + shift, SHEET + np.column_stack([np.zeros((len(SHEET), 2)), waves]))


@pytest.mark.parametrize("seed", range(6))
def test_never_later_than_without(seed):
    random = np.random.default_rng(seed)
    thickness = (("sheet", 0.05),) if seed % 2 else ()
    options, distance = replace(OPTIONS, thickness=thickness), float(random.choice([0.0, 0.05, 0.2]))
    coarse, full = Nearness(BUILDER, options, distance, DETAIL), Nearness(BUILDER, options, distance)
    steps = list(frames(random))
    for start, end in zip(steps, steps[1:], strict=False):
        near, of_coarse = full.within(start, end), coarse.within(start, end)
        assert near[1] == of_coarse[1] == distance
        assert near[0] is None or of_coarse[0] == NAMES
        if near[0] is None and of_coarse[0] is None:
            assert coarse.inside(start, end) == full.inside(start, end)
            assert coarse.slowdown(start, end, distance, 1.0) == full.slowdown(start, end, distance, 1.0)


def test_never_later_than_without_beside_a_plane():
    builder = replace(BUILDER, planes=(PlaneSettings("floor", (0.0, 0.1, 1.0), -0.6),))
    thick = replace(OPTIONS, thickness=(("ball", 0.05),))
    coarse, full = Nearness(builder, thick, 0.1, DETAIL), Nearness(builder, thick, 0.1)
    of_planes = of_none = 0
    for seed in range(8):
        for start, end in pairwise(frames(np.random.default_rng(seed))):
            near, of_coarse = full.within(start, end)[0], coarse.within(start, end)[0]
            assert near is None or of_coarse is not None
            of_planes += of_coarse is not None and "floor" in of_coarse
            if near is None and of_coarse is None:
                of_none += 1
                assert coarse.slowdown(start, end, 0.1, 1.0) == full.slowdown(start, end, 0.1, 1.0)
    assert of_planes and of_none


def test_far_meshes_are_not_near_and_the_distance_may_change():
    apart = frame(0, 0.4 * BALL + (0, 0, 3), SHEET), frame(1, 0.4 * BALL + (0, 0, 2), SHEET)
    nearness = Nearness(BUILDER, OPTIONS, 0.1, DETAIL)
    assert nearness.within(*apart) == (None, 0.1)
    nearness.set(OPTIONS, 1.7)
    assert nearness.within(*apart) == (NAMES, 1.7)
    nearness.cancel()
    with pytest.raises(hc.Cancelled):
        nearness.within(*apart)
