# SPDX-License-Identifier: Apache-2.0
"""A step's two frames in, its contacts out: the same as the core's own, whatever was detected before. No ROS."""

from dataclasses import replace

import numpy as np
import pytest
from waving_sheet import scene_of

import hpccd_core as hc
from hpccd_ros.detect.core import Options, unusable_options, unusable_topology
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.detect.step_detector import StepDetector
from hpccd_ros.frames.types import MeshSettings, SceneFrame, Topology

TRIANGLE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)
FACES = np.array([[0, 1, 2], [3, 4, 5]], np.uint32)
OLD = Topology(0, 6, FACES)
SWAPPED = Topology(1, 6, np.ascontiguousarray(FACES[::-1]))


def positions(z):
    """A triangle at height ``z`` above or below another one."""
    return np.concatenate([TRIANGLE, 0.5 * TRIANGLE + [0.1, 0.1, z]])


def frame(stamp, z, topology=OLD):
    return SceneFrame(stamp, stamp, "", (topology,), (positions(z),), ("cloth",), 0.0)


@pytest.fixture
def detector():
    return StepDetector(SceneBuilder((MeshSettings("cloth"),)), Options(backend="cpu", threads=1))


def of_core(start, end, faces=FACES, **options):
    return hc.Detector(scene_of(cloth=faces), **options).detect(positions(start), positions(end))


def test_contacts_of_a_step(detector):
    found = detector.detect(frame(1, 0.5), frame(2, -0.5))
    assert found.contacts.hash == of_core(0.5, -0.5).hash and len(found.contacts) > 0
    assert (found.start.stamp, found.end.stamp, found.backend, found.threads) == (1, 2, "cpu", 1)
    assert found.layout.mesh_names == ("cloth",) and found.layout.topology_versions == (0,)
    assert found.detect_ms > 0 and found.options == detector.options


def test_steps_follow_each_other_and_topologies_change(detector):
    for start, end, topology in ((0.5, -0.5, OLD), (-0.5, -0.7, OLD), (0.5, -0.5, SWAPPED), (-0.5, 0.5, OLD)):
        found = detector.detect(frame(1, start, topology), frame(2, end, topology))
        assert found.contacts.hash == of_core(start, end, topology.faces).hash
        assert found.layout.topology_versions == (topology.version,)


def test_options_hold_from_the_next_step_on(detector):
    detector.detect(frame(1, 0.5), frame(2, -0.5))
    detector.options = replace(detector.options, report="first", outputs=("points",))
    found = detector.detect(frame(1, 0.5), frame(2, -0.5))
    assert found.contacts.hash == of_core(0.5, -0.5, report="first").hash
    assert len(found.contacts.points) == len(found.contacts) and found.options.report == "first"


def test_static_meshes_are_where_they_are_at_the_end():
    builder = SceneBuilder((MeshSettings("cloth"), MeshSettings("floor", static=True)))
    topologies = tuple(Topology(0, 3, FACES[:1]) for _ in range(2))
    start, end = (
        SceneFrame(stamp, stamp, "", topologies, (TRIANGLE + [0, 0, z], floor), ("cloth",), 0.0)
        for stamp, z, floor in ((1, 0.5, TRIANGLE + 100), (2, -0.5, TRIANGLE + [0.1, 0.1, 0]))
    )
    assert len(StepDetector(builder, Options()).detect(start, end).contacts) > 0


def test_errors_of_the_core_are_raised_and_the_next_step_is_processed(detector):
    with pytest.raises(ValueError, match=r"1e\+150"):
        detector.detect(frame(1, 0.5), frame(2, 1e200))
    detector.options = replace(detector.options, accuracy="sloppy")
    with pytest.raises(ValueError, match="sloppy"):
        detector.detect(frame(1, 0.5), frame(2, -0.5))
    detector.options = replace(detector.options, accuracy="exact")
    assert len(detector.detect(frame(1, 0.5), frame(2, -0.5)).contacts) > 0


@pytest.mark.parametrize("before", [False, True], ids=["a detector is there", "none is yet"])
def test_cancelled_for_good(detector, before):
    if not before:
        detector.detect(frame(1, 0.5), frame(2, -0.5))
    detector.cancel()
    for topology in (OLD, SWAPPED):
        with pytest.raises(hc.Cancelled):
            detector.detect(frame(1, 0.5, topology), frame(2, -0.5, topology))


def test_what_the_core_cannot_work_with_is_told():
    assert unusable_options(Options()) is None and "sloppy" in unusable_options(Options(accuracy="sloppy"))
    assert unusable_topology(OLD) is None
    assert unusable_topology(Topology(0, 2, FACES)) is not None
