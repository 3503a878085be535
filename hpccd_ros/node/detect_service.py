# SPDX-License-Identifier: Apache-2.0
"""Service ``~/detect``: positions in, contacts, a step size or distances out."""

import math
import time
from typing import Any

from hpccd.srv import Detect
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.service_introspection import ServiceIntrospectionState

from hpccd_ros.middleware import qos, topic_names
from hpccd_ros.node.detect_jobs import STOPPED, DetectJobs, Ticket
from hpccd_ros.node.detect_query import WAITING
from hpccd_ros.node.life_cycle import GuardedLifecycleNode

# Queue of the service for requests beyond the accepted ones: a burst gets "busy" and is not lost. Bounds the
# memory that untrusted clients can use.
ROOM_TO_REJECT = 1000
# s for responses to requests that were not processed before the service ends.
FAREWELL = 0.5
# s that the service exists after its last response: DDS announces its end on another channel, which overtook 4 of 610
# responses on a busy machine, and a reader takes nothing from a writer that is gone.
DELIVERY = 0.2


class DetectService:
    """Responds to each request with the result of ``jobs``."""

    def __init__(self, node: GuardedLifecycleNode, jobs: DetectJobs, settings: dict[str, Any]) -> None:
        self._node = node
        self._jobs = jobs
        self._settings = settings
        self._last_response = -math.inf
        # A callback that awaits occupies its group until it ends: in the node's own group it would stop everything.
        self._group = ReentrantCallbackGroup()
        self._service = node.create_service(
            Detect,
            topic_names.DETECT,
            self._fill,
            qos_profile=qos.requests(jobs.capacity + ROOM_TO_REJECT),
            callback_group=self._group,
        )
        self._introspection = "off"
        self.apply_change()

    def apply_change(self) -> None:
        """Follow the parameter that may change at any time."""
        wanted = self._settings["service_introspection"]
        if wanted != self._introspection:
            # In the node's time, as the stamps of its other reports.
            self._service.configure_introspection(
                self._node.get_clock(), qos.SERVICE_EVENTS, getattr(ServiceIntrospectionState, wanted.upper())
            )
            self._introspection = wanted

    def close(self) -> None:
        """Respond to waiting requests, then end. In the thread of the executor, whose next turn comes too late; after
        ``jobs.close()``.
        """
        executor = self._node.executor
        # rclpy has no way to have responses sent now but to go on with the callbacks that await.
        for task, entity, _ in tuple(executor._tasks) if executor is not None else ():
            if entity is self._service:
                task()
        self._turn_away()
        time.sleep(max(0.0, self._last_response + DELIVERY - time.monotonic()))
        self._node.destroy_service(self._service)

    def _turn_away(self) -> None:
        """Respond to requests that were received but not processed."""
        deadline = time.monotonic() + FAREWELL  # a response to a client that is gone takes 0.1 s
        with self._service.handle:
            while time.monotonic() < deadline:
                request, header = self._service.handle.service_take_request(Detect.Request)
                if header is None:
                    return
                rejected = self._jobs.reject(Detect.Response(), Ticket(WAITING), "stopped", STOPPED)
                self._service.send_response(rejected, header)
                self._last_response = time.monotonic()

    async def _fill(self, request: Detect.Request, response: Detect.Response) -> Detect.Response:
        try:
            return await self._jobs.fill(request, response, Ticket(WAITING))
        finally:
            self._last_response = time.monotonic()
