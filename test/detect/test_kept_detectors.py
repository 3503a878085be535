# SPDX-License-Identifier: Apache-2.0
"""Detectors kept for later requests: never for another scene, never more than allowed, never one that was ended."""

import time
from dataclasses import replace

import numpy as np
import pytest
from waving_sheet import sheet_faces, sheet_positions

import hpccd_core as hc
from hpccd_ros.detect.core import Cancellation, Options, make_detector
from hpccd_ros.detect.kept_detectors import DetectorOf, KeptDetectors
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.detect.separation import Separation
from hpccd_ros.frames.types import MeshSettings, Topology

N = 6
FACES = sheet_faces(N)
CLOTH, OTHER = MeshSettings("cloth"), MeshSettings("other")
TOPOLOGY = Topology(1, N * N, FACES)
BUILDER, TOPOLOGIES, OPTIONS = SceneBuilder((CLOTH, OTHER)), (TOPOLOGY, TOPOLOGY), Options()


def detector_of(builder=BUILDER, topologies=TOPOLOGIES, options=OPTIONS):
    return DetectorOf(builder, topologies, options, make_detector(builder.build(topologies), options))


def test_equal_scenes_share_a_detector():
    kept, used = KeptDetectors(2), detector_of()
    assert kept.take(BUILDER, TOPOLOGIES, OPTIONS) is None
    kept.keep(used)
    same = SceneBuilder((MeshSettings("cloth"), MeshSettings("other")))
    copies = tuple(Topology(9, N * N, FACES.copy()) for _ in range(2))
    assert kept.take(same, copies, Options()) is used
    assert kept.take(BUILDER, TOPOLOGIES, OPTIONS) is None, "it is the first taker's alone"


@pytest.mark.parametrize(
    "builder, topologies, options",
    [
        (SceneBuilder((OTHER, CLOTH)), TOPOLOGIES, OPTIONS),
        (SceneBuilder((CLOTH,)), TOPOLOGIES[:1], OPTIONS),
        (SceneBuilder((CLOTH, replace(OTHER, static=True))), TOPOLOGIES, OPTIONS),
        (replace(BUILDER, ignored_pairs=(("cloth", "other"),)), TOPOLOGIES, OPTIONS),
        (replace(BUILDER, pair_accuracies=(("cloth", "other", "fast"),)), TOPOLOGIES, OPTIONS),
        (BUILDER, (TOPOLOGY, Topology(1, N * N, FACES[:-1])), OPTIONS),
        (BUILDER, (Topology(1, N * N + 1, FACES), TOPOLOGY), OPTIONS),
        (BUILDER, TOPOLOGIES, replace(OPTIONS, accuracy="fast")),
        (BUILDER, TOPOLOGIES, replace(OPTIONS, separation=Separation(0.1))),
        (BUILDER, TOPOLOGIES, replace(OPTIONS, separation=Separation(0.0, (("cloth", "other", 0.1),)))),
    ],
    ids="order fewer static ignored pair-accuracy faces vertices accuracy separation pair-separation".split(),
)
def test_another_scene_has_a_detector_of_its_own(builder, topologies, options):
    kept = KeptDetectors(2)
    kept.keep(detector_of())
    assert kept.take(builder, topologies, options) is None
    assert kept.take(BUILDER, TOPOLOGIES, OPTIONS) is not None


def test_the_one_unused_for_the_longest_time_gives_way():
    kept = KeptDetectors(2)
    tiers = ("fast", "balanced", "exact")
    for tier in tiers:
        kept.keep(detector_of(options=Options(accuracy=tier)))
    assert [kept.take(BUILDER, TOPOLOGIES, Options(accuracy=tier)) is None for tier in tiers] == [True, False, False]


def test_what_nobody_used_for_a_while_is_forgotten():
    kept = KeptDetectors(2)
    kept.keep(detector_of())
    kept.forget(unused_for=60.0)
    used = kept.take(BUILDER, TOPOLOGIES, OPTIONS)
    assert used is not None
    kept.keep(used)
    time.sleep(0.01)
    kept.forget(unused_for=0.005)
    assert kept.take(BUILDER, TOPOLOGIES, OPTIONS) is None


def positions():
    return [np.concatenate([sheet_positions(N, step), sheet_positions(N, step + 2, offset=0.003)]) for step in (0, 1)]


def test_a_cancellation_that_comes_too_late_ends_nothing():
    cancellation = Cancellation()
    detector = cancellation.guard(detector_of().detector)
    assert cancellation.release()
    cancellation.cancel()
    assert len(detector.detect(*positions())) > 0


def test_a_detector_that_was_ended_is_not_released():
    cancellation = Cancellation()
    detector = cancellation.guard(detector_of().detector)
    cancellation.cancel()
    assert not cancellation.release()
    with pytest.raises(hc.Cancelled):
        detector.detect(*positions())
