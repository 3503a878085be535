# SPDX-License-Identifier: Apache-2.0
"""Publishes messages for viewers. Intersection curves and depths may take longer than a step, so they are computed
beside the detection thread, which `stop` depends on."""

import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header
from visualization_msgs.msg import MarkerArray

import hpccd_core as hc
from hpccd_core.picture.lines import polylines
from hpccd_ros.detect.core import Cancellation
from hpccd_ros.detect.interpenetration import InterpenetrationDetector
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.detect.step_detector import Detection
from hpccd_ros.middleware import qos, topic_names
from hpccd_ros.node.life_cycle import GuardedLifecycleNode
from hpccd_ros.node.markers import (
    contact_markers,
    depth_markers,
    intersection_marker,
    plane_markers,
    surface_cloud,
)

Shown = tuple[Detection, Header, SceneBuilder]


class ViewerPublisher:
    """Publishers of a configured ``node``, until it is unconfigured. Without subscribers nothing is computed."""

    def __init__(self, node: GuardedLifecycleNode, settings: dict[str, Any]) -> None:
        self._node, self._settings = node, settings
        self._markers = node.configured_publisher(MarkerArray, topic_names.MARKERS, qos.MARKERS)
        self._surface = node.configured_publisher(PointCloud2, topic_names.SURFACE, qos.MARKERS)
        node.when_unconfigured(self.end)
        self._thread: _Thread | None = None
        self._show_after = 0.0
        self._most_depths = 1  # arrows published at a time so far: each message deletes those it does not have

    def show(self, found: Detection, header: Header, builder: SceneBuilder) -> None:
        """Publish for viewers, if parameter markers is set, at the requested rate at most. Called by the detection
        thread. If the previous step is not published yet, the newest one is next."""
        now = time.monotonic()
        # A step that was under way when markers were asked for has none of what they show.
        shown = self._settings["markers"] and {"points", "normals"} <= set(found.options.outputs)
        if not shown or now < self._show_after:
            return
        if not (self._markers.get_subscription_count() or self._surface.get_subscription_count()):
            return
        self._show_after = now + 1.0 / self._settings["markers_rate"]
        if self._thread is None:
            self._thread = _Thread(self._publish, lambda error: self._node.errors.caught("markers", error))
            self._thread.start()
        self._thread.give((found, header, builder))

    def end(self) -> None:
        """Cancel what is computed, and publish no more until the next `show`."""
        if self._thread is not None:
            self._thread.end()
            self._thread = None

    def _publish(self, shown: Shown, search: InterpenetrationDetector) -> None:
        found, header, builder = shown
        if self._surface.get_subscription_count():
            self._surface.publish(surface_cloud(found.end.vertices, header))
        if not self._markers.get_subscription_count():
            return
        settings, of_all = self._settings, {"stamp": header.stamp, "frame_id": header.frame_id}
        size, limit = settings["markers_size"], settings["markers_max"]
        message = contact_markers(
            np.asarray(found.contacts.points),
            np.asarray(found.contacts.normals),
            getattr(found.contacts, "closest", np.empty((0, 2, 3))),  # computed only with a separation
            len(found.contacts.vf),
            size=size,
            limit=limit,
            **of_all,
        )
        message.markers += plane_markers(builder.planes, found.end.vertices, **of_all)
        lines, depths = [], []
        if settings["markers_intersections"] or settings["markers_depth"]:
            scene = found.end.topologies, found.end.vertices
            hits = search.intersections(*scene, found.rest)
            if settings["markers_intersections"]:
                lines = polylines(hits.contours(), limit)
            if settings["markers_depth"]:
                depths = search.depths(*scene, hits)[:limit]
        self._most_depths = max(self._most_depths, len(depths))
        message.markers.append(intersection_marker(lines, size=size, **of_all))
        message.markers += depth_markers(depths, size=size, count=self._most_depths, **of_all)
        self._markers.publish(message)


class _Thread(threading.Thread):
    """Calls ``publish`` with the newest step it was given, and with a search in that scene. failed: gets its errors."""

    def __init__(
        self, publish: Callable[[Shown, InterpenetrationDetector], None], failed: Callable[[Exception], object]
    ) -> None:
        super().__init__(name="viewers", daemon=True)
        self._publish_step, self._failed = publish, failed
        self._changed = threading.Condition()
        self._next: Shown | None = None
        self._ended = False
        self._cancellation = Cancellation()

    def give(self, shown: Shown) -> None:
        with self._changed:
            self._next = shown
            self._changed.notify()

    def end(self) -> None:
        with self._changed:
            self._ended = True
            self._changed.notify()
        self._cancellation.cancel()
        self.join()

    def run(self) -> None:
        search, builder = None, None
        while (shown := self._take()) is not None:
            try:
                # One thread of the core: the others are for detection.
                if search is None or shown[2] != builder:
                    builder = shown[2]
                    search = InterpenetrationDetector(builder, threads=1, cancellation=self._cancellation)
                self._publish_step(shown, search)
            except hc.Cancelled:
                return
            except Exception as error:  # any: it would end this thread and all later messages
                self._failed(error)
            shown = None  # waiting must not hold a step

    def _take(self) -> Shown | None:
        with self._changed:
            self._changed.wait_for(lambda: self._ended or self._next is not None)
            shown, self._next = self._next, None
            return None if self._ended else shown
