# SPDX-License-Identifier: Apache-2.0
"""Meshes that are to stay apart: as the core does it, from the next step on when it changes. No ROS."""

import math
from dataclasses import replace

import numpy as np
import pytest
from waving_sheet import scene_of, sheet_faces, sheet_positions

import hpccd_core as hc
from hpccd_ros.detect.core import Options, unusable_options
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.detect.separation import NONE, Separation
from hpccd_ros.detect.step_detector import StepDetector
from hpccd_ros.frames.types import MeshSettings, SceneFrame, Topology

N = 8
FACES = sheet_faces(N)
NAMES = ("cloth", "net")
TOPOLOGIES = (Topology(0, N * N, FACES),) * 2


def parts(k):
    return sheet_positions(N, k), sheet_positions(N, k + 2, offset=0.02)


def frame(k):
    return SceneFrame(k, k, "", TOPOLOGIES, parts(k), NAMES, 0.0)


def of_core(k, separation=NONE):
    scene = scene_of(cloth=FACES, net=FACES)
    for a, b, distance in separation.pairs:
        scene.set_separation(a, b, distance)
    detector = hc.Detector(scene, minimum_separation=separation.minimum)
    return detector.detect(np.concatenate(parts(k - 1)), np.concatenate(parts(k)))


@pytest.fixture
def detector():
    return StepDetector(SceneBuilder(tuple(map(MeshSettings, NAMES))), Options(backend="cpu", threads=1))


SEPARATIONS = [
    Separation(1e-3),
    Separation(1e-3, (("net", "cloth", 5e-3),)),
    Separation(2e-3, (("net", "cloth", 0.0), ("cloth", "cloth", 1e-3))),
    Separation(0.0, (("cloth", "net", 1e-2),)),
    NONE,
]


def test_each_step_has_the_separation_of_its_time(detector):
    """The detector goes on: what a step costs does not depend on whether the separation was changed before it."""
    detector.detect(frame(0), frame(1))
    first, hashes = detector._detector, set()
    for k, separation in enumerate(SEPARATIONS, start=2):
        detector.options = replace(detector.options, separation=separation)
        found = detector.detect(frame(k - 1), frame(k))
        assert found.contacts.hash == of_core(k, separation).hash and found.options.separation == separation
        assert detector._detector is first
        hashes.add((len(found.contacts), len(of_core(k))))
    assert any(apart > touching for apart, touching in hashes)


@pytest.mark.parametrize("separation", SEPARATIONS)
def test_a_new_detector_has_it_too(detector, separation):
    detector.options = replace(detector.options, separation=separation)
    assert detector.detect(frame(0), frame(1)).contacts.hash == of_core(1, separation).hash


def test_a_change_that_fails_is_made_by_the_next_step(detector):
    detector.detect(frame(0), frame(1))
    detector.options = replace(detector.options, separation=Separation(1e-3, (("cloth", "net", math.nan),)))
    with pytest.raises(ValueError, match="separation"):
        detector.detect(frame(1), frame(2))
    detector.options = replace(detector.options, separation=Separation(1e-3))
    assert detector.detect(frame(1), frame(2)).contacts.hash == of_core(2, Separation(1e-3)).hash


def test_distances_at_the_end_of_the_step(detector):
    expected = hc.Detector(scene_of(cloth=FACES, net=FACES)).distances(np.concatenate(parts(1)))
    assert detector.detect(frame(0), frame(1)).gaps is None
    detector.options = replace(detector.options, distances=True)
    found = detector.detect(frame(0), frame(1))
    assert [(gap.mesh_a, gap.mesh_b) for gap in found.gaps] == [("cloth", "cloth"), ("cloth", "net"), ("net", "net")]
    assert [(g.distance, g.kind, g.features) for g in found.gaps] == [
        (g.distance, g.kind, g.features) for g in expected
    ]
    assert found.stats["vf_candidates"] > 0, "stats are those of the detection"
    assert (found.backend, found.gaps_backend) == ("cpu", "cpu")


def test_one_step_has_the_same_options_throughout(detector, monkeypatch):
    """Set while its contacts were looked for, others hold from the next step on: distances are of the same detector."""
    detector.options = replace(detector.options, distances=True)
    detector.detect(frame(0), frame(1))
    detect, first = hc.Detector.detect, detector._detector

    def changed_meanwhile(core, *ends):
        detector.options = replace(detector.options, accuracy="balanced", distances=False)
        return detect(core, *ends)

    monkeypatch.setattr(hc.Detector, "detect", changed_meanwhile)
    found = detector.detect(frame(1), frame(2))
    assert detector._detector is first and found.options.accuracy == "exact"
    assert len(found.gaps) == 3
    assert detector.detect(frame(2), frame(3)).gaps is None and detector._detector is not first


def test_near_pairs_are_counted_by_the_meshes_that_have_a_separation(detector):
    def near(separation):
        detector.options = replace(detector.options, separation=separation)
        return detector.detect(frame(0), frame(1))

    assert near(NONE).near == 0
    everywhere = near(Separation(1e-2))
    assert everywhere.near == len(everywhere.contacts) > 0
    some = near(Separation(1e-2, (("cloth", "cloth", 0.0), ("net", "net", 0.0))))
    vertex, ends = some.contacts.vf[:, 0] >= N * N, some.contacts.ee[:, [0, 2]] >= N * N
    between = np.count_nonzero(vertex != (some.contacts.vf[:, 1] >= len(FACES)))
    assert some.near == between + np.count_nonzero(ends[:, 0] != ends[:, 1]) and 0 < some.near < len(some.contacts)


def test_of_some_meshes():
    whole = Separation(1.0, (("a", "b", 2.0), ("b", "c", 3.0), ("c", "c", 4.0)))
    assert whole.among(["c", "b"]) == Separation(1.0, (("b", "c", 3.0), ("c", "c", 4.0)))
    assert whole.table(("c", "a", "b")).tolist() == [[4, 1, 3], [1, 1, 2], [3, 2, 1]]
    assert (NONE.text, whole.text) == ("", "1, a:b:2, b:c:3, c:c:4")
    assert Separation(0.001234567, (("a", "b", 1e-9 + 1),)).text == "0.001234567, a:b:1.000000001"


@pytest.mark.parametrize("distance", [-1e-9, math.nan, math.inf])
def test_what_no_scene_can_have(distance):
    for separation in (Separation(distance), Separation(0.0, (("a", "b", distance),))):
        assert "must be finite and not negative" in separation.unusable()
        assert "separation" in unusable_options(Options(separation=separation))
    assert Separation(0.0, (("a", "b", 0.0),)).unusable() is None


def test_a_whole_number_for_the_scene_leaves_those_of_pairs_as_they_are():
    assert Separation(0, (("a", "b", 0.02),)).table(("a", "b")).tolist() == [[0.0, 0.02], [0.02, 0.0]]
