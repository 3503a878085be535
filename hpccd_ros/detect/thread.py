# SPDX-License-Identifier: Apache-2.0
"""The detection thread, outside of the executor. No ROS."""

import threading
from collections.abc import Callable

from hpccd_ros.detect.step_detector import Detection, StepDetector
from hpccd_ros.frames.frame_queue import FrameQueue
from hpccd_ros.frames.types import SceneFrame


class DetectionThread(threading.Thread):
    """Takes scene frames from ``queue`` and passes detections to ``on_detection``, until the queue is closed.

    A step goes from the end of the last successful step to the new frame, so dropped frames and failed detections
    leave no gap in time. The first frame, and the first after a change of topology, is only a start: ``on_first``.
    ``on_step`` receives both frames of each step before its detection, ``on_failure`` the frames without a result, and
    the error: hc.Cancelled after `cancel`.
    """

    def __init__(
        self,
        detector: StepDetector,
        queue: FrameQueue,
        *,
        on_step: Callable[[SceneFrame, SceneFrame], None] = lambda start, end: None,
        on_detection: Callable[[Detection], None],
        on_first: Callable[[SceneFrame], None],
        on_failure: Callable[[SceneFrame, Exception], None],
    ) -> None:
        super().__init__(name="detection", daemon=True)
        self.detector = detector
        self._queue = queue
        self._on_step = on_step
        self._on_detection = on_detection
        self._on_first = on_first
        self._on_failure = on_failure
        self._start: SceneFrame | None = None
        self.working_on: SceneFrame | None = None

    def cancel(self) -> None:
        """Cancel the current detection. Call it at the end, after the queue was closed."""
        self.detector.cancel()

    def run(self) -> None:
        while (item := self._queue.pop()) is not None:
            frame = self.working_on = item.frame
            try:
                if item.first:
                    self._start = frame
                    self._on_first(frame)
                else:
                    self._on_step(self._start, frame)
                    self._on_detection(self.detector.detect(self._start, frame))
                    self._start = frame  # only now, because a failed step is part of the next one
            except Exception as error:  # any: it would end this thread and all later results
                self._on_failure(frame, error)
            self.working_on = None
