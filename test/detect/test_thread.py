# SPDX-License-Identifier: Apache-2.0
"""The detection thread on the real core: no time is left untested, whatever happens to a frame. No ROS."""

import numpy as np
import pytest
from waving_sheet import scene_of

import hpccd_core as hc
from hpccd_ros.detect.core import Options
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.detect.step_detector import StepDetector
from hpccd_ros.detect.thread import DetectionThread
from hpccd_ros.frames.frame_queue import FrameQueue
from hpccd_ros.frames.types import MeshSettings, SceneFrame, Topology

FACES = np.array([[0, 1, 2], [3, 4, 5]], np.uint32)
OLD, NEW = (Topology(version, 6, FACES) for version in (0, 1))
TRIANGLE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)


def positions(z):
    """A triangle at height ``z`` above or below another one."""
    return np.concatenate([TRIANGLE, 0.5 * TRIANGLE + [0.1, 0.1, z]])


def frame(stamp, z, topology=OLD):
    return SceneFrame(stamp, stamp, "", (topology,), (positions(z),), ("cloth",), 0.0)


class Run:
    """The results of a detection thread for ``frames``."""

    def __init__(self, *frames, reject_result_at=None):
        self.steps, self.starts, self.failed = [], [], []
        self.reject_result_at = reject_result_at
        queue = FrameQueue(100)
        thread = DetectionThread(
            StepDetector(SceneBuilder((MeshSettings("cloth"),)), Options()),
            queue,
            on_detection=self._result,
            on_first=self.starts.append,
            on_failure=lambda frame, error: self.failed.append((frame.stamp, str(error))),
        )
        for item in frames:
            assert queue.put(item) == []
        thread.start()
        while len(self.steps) + len(self.starts) + len(self.failed) < len(frames):
            assert thread.is_alive()
        queue.close()
        thread.join(timeout=300)
        assert not thread.is_alive()

    def _result(self, found):
        if found.end.stamp == self.reject_result_at:
            raise MemoryError("no room for the result")
        self.steps.append((found.start.stamp, found.end.stamp, len(found.contacts)))


def test_step_over_a_frame_that_cannot_be_tested():
    run = Run(frame(1, 0.5), frame(2, 1e200), frame(3, -0.5), frame(4, -0.7))
    assert [step[:2] for step in run.steps] == [(1, 3), (3, 4)]
    assert run.steps[0][2] == len(hc.Detector(scene_of(cloth=FACES)).detect(positions(0.5), positions(-0.5))) > 0
    assert [stamp for stamp, _ in run.failed] == [2] and "1e+150" in run.failed[0][1]


def test_step_whose_result_could_not_be_sent():
    run = Run(frame(1, 0.5), frame(2, -0.5), frame(3, -0.7), reject_result_at=2)
    assert [step[:2] for step in run.steps] == [(1, 3)] and run.steps[0][2] > 0
    assert run.failed == [(2, "no room for the result")]


@pytest.mark.parametrize("after", [frame(4, 0.5, NEW), frame(0, 0.5)], ids=["topology", "restart"])
def test_start_of_another_scene_is_not_used(after):
    last = SceneFrame(9, 9, "", after.topologies, (positions(-0.5),), ("cloth",), 0.0)
    run = Run(frame(1, 0.5), frame(2, 1e200), after, last)
    assert [step[:2] for step in run.steps] == [(after.stamp, 9)] and run.steps[0][2] > 0
