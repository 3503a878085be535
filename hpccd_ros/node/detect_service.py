# SPDX-License-Identifier: Apache-2.0
"""Service ``~/detect``: snapshots in, contacts, a step or distances out; computed outside of the executor."""

import math
import threading
import time
from collections.abc import Callable
from concurrent.futures import CancelledError, ThreadPoolExecutor
from concurrent.futures import Future as JobFuture
from typing import Any

from hpccd.srv import Detect
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.service_introspection import ServiceIntrospectionState
from rclpy.task import Future

from hpccd_core import Cancelled
from hpccd_ros.base.quoting import LONGEST_MESSAGE, shortened
from hpccd_ros.detect.cancellation import Cancellation
from hpccd_ros.detect.core import CORE_ERRORS
from hpccd_ros.detect.kept_detectors import KeptDetectors
from hpccd_ros.middleware import qos, topic_names
from hpccd_ros.node.accounts import Accounts
from hpccd_ros.node.configuration import Configuration
from hpccd_ros.node.detect_query import RequestError
from hpccd_ros.node.detect_request import NodeScene, compute
from hpccd_ros.node.life_cycle import GuardedLifecycleNode

# Requests that may lie in the queue of the service beside those that find a place: a burst of them is answered "busy"
# rather than lost. Bounds what strangers can make the node hold.
ROOM_TO_REFUSE = 1000
# s, the longest time limit: rclpy's timers count nanoseconds in 64 bits, 292 years.
LONGEST = 86_400.0
# s for telling those whose requests nobody has looked at yet that the service ends.
FAREWELL = 0.5
# s that the service outlives its last answer: DDS tells a client of the end by another way, which on a busy machine
# overtook 4 of 610 answers, and a reader takes nothing of a writer that is gone.
DELIVERY = 0.2
# How to ask for less: of queries that can.
_LESS = {"contacts": "ask for less (report first), or ", "proximity": "ask for a smaller distance, or "}
STOPPED = "stopped: the node was shut down or cleaned up before the answer was ready; ask again when it is active"


class DetectService:
    """Answers ``detect_jobs`` requests at a time; ``detect_waiting`` more may wait, the rest is refused.

    A request that is not answered when its time limit has passed, or when the service is closed, is told so and its
    computation given up; the place that it holds is free once that ends.
    scene: what the node knows, asked in the executor at each request; a text instead: why it cannot answer
    now.
    """

    def __init__(
        self,
        node: GuardedLifecycleNode,
        configuration: Configuration,
        scene: Callable[[], NodeScene | str],
        accounts: Accounts,
    ) -> None:
        self._node = node
        self._configuration = configuration
        self._settings = settings = configuration.settings
        self._scene = scene
        self._ended = accounts.requests
        self._capacity = settings["detect_jobs"] + settings["detect_waiting"]
        self._kept = KeptDetectors(settings["detect_jobs"])
        self._pool = ThreadPoolExecutor(settings["detect_jobs"], thread_name_prefix="detect")
        self._lock = threading.Lock()
        self._open = 0
        self._closed = False
        self._last_answer = -math.inf
        self._ongoing: set[Cancellation] = set()
        self._awaited: set[Callable[[], None]] = set()
        # A callback that awaits occupies its group until it ends: in the node's own group it would stop everything.
        self._group = ReentrantCallbackGroup()
        self._service = node.create_service(
            Detect,
            topic_names.DETECT,
            self._answer,
            qos_profile=qos.requests(self._capacity + ROOM_TO_REFUSE),
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

    @property
    def counts(self) -> dict[str, int]:
        """How requests ended, and how many hold a place now."""
        return {**self._ended, "open": self._open}

    def forget_scenes(self, unused_for: float) -> None:
        """Give back what is held for further requests about scenes that nobody asked about for so many seconds."""
        self._kept.forget(unused_for)

    def close(self) -> None:
        """Answer whoever still waits, then end. In the thread of the executor; its next turn comes too late."""
        self._closed = True
        for cancellation in tuple(self._ongoing):
            cancellation.cancel()
        self._pool.shutdown(wait=False, cancel_futures=True)
        for settle in tuple(self._awaited):
            settle()
        executor = self._node.executor
        # rclpy has no way to have answers sent now but to go on with the callbacks that await.
        for task, entity, _ in tuple(executor._tasks) if executor is not None else ():
            if entity is self._service:
                task()
        self._turn_away()
        time.sleep(max(0.0, self._last_answer + DELIVERY - time.monotonic()))
        self._node.destroy_service(self._service)

    def _turn_away(self) -> None:
        """Answer the requests that came and were not looked at yet."""
        deadline = time.monotonic() + FAREWELL  # an answer to a client that is gone takes 0.1 s
        with self._service.handle:
            while time.monotonic() < deadline:
                request, header = self._service.handle.service_take_request(Detect.Request)
                if header is None:
                    return
                self._service.send_response(self._refuse(Detect.Response(), "stopped", STOPPED), header)
                self._last_answer = time.monotonic()

    async def _answer(self, request: Detect.Request, response: Detect.Response) -> Detect.Response:
        try:
            return await self._computed(request, response)
        except RequestError as error:
            return self._refuse(response, "refused", str(error))
        except Exception as error:  # here and not only by the executor's guard, so that it is counted as failed
            return self._refuse(Detect.Response(), "failed", self._node.errors.caught(topic_names.DETECT, error))
        finally:
            self._last_answer = time.monotonic()

    async def _computed(self, request: Detect.Request, response: Detect.Response) -> Detect.Response:
        limit = self._time_limit(request)
        scene = self._scene()
        if isinstance(scene, str):
            raise RequestError(scene)
        if not self._enter():
            return self._refuse(
                response,
                "busy",
                f"busy: {self._capacity} requests are being computed or wait "
                "(parameters detect_jobs, detect_waiting); try again later",
            )
        cancellation = Cancellation()
        self._ongoing.add(cancellation)
        try:
            job = self._pool.submit(
                compute, request, scene, self._configuration.options, self._settings, self._kept, cancellation
            )
        except RuntimeError:  # the system gives no further thread
            self._ongoing.discard(cancellation)
            self._leave()
            raise
        job.add_done_callback(lambda _: self._ongoing.discard(cancellation))
        job.add_done_callback(lambda _: self._leave())
        await self._settled(job, limit)
        if not job.done():
            job.cancel()
            cancellation.cancel()
            if self._closed:
                return self._refuse(response, "stopped", STOPPED)
            return self._refuse(
                response,
                "timed_out",
                f"time limit of {limit:g} s passed before the answer was ready; "
                f"{_LESS.get(request.query or 'contacts', '')}set a longer time_limit",
            )
        try:
            answer = job.result()
        except RequestError:
            raise
        except (Cancelled, CancelledError):  # only `close` ends a job that is awaited
            return self._refuse(response, "stopped", STOPPED)
        except CORE_ERRORS as error:
            return self._refuse(response, "failed", f"{type(error).__name__}: {error}")
        if answer.contacts is not None:
            response.contacts = answer.contacts
        if answer.distances is not None:
            response.distances = answer.distances
        response.collision_free_step = answer.collision_free_step
        response.success, response.message = True, answer.text
        self._ended["answered"] += 1
        return response

    async def _settled(self, job: JobFuture, limit: float) -> None:
        """Wait until the job is done, `limit` seconds have passed or the service is closed."""
        settled = Future(executor=self._node.executor)

        def settle(_: Any = None) -> None:
            if not settled.done():
                settled.set_result(None)
            if (executor := self._node.executor) is not None:
                executor.wake()  # a task that awaits is only looked at when the executor wakes up

        steady = Clock(clock_type=ClockType.STEADY_TIME)
        # Of a group of its own, which ends with it: a group remembers every timer that it ever had.
        timer = self._node.create_timer(limit, settle, callback_group=ReentrantCallbackGroup(), clock=steady)
        self._awaited.add(settle)
        job.add_done_callback(settle)
        try:
            await settled
        finally:
            self._awaited.discard(settle)
            self._node.destroy_timer(timer)

    def _refuse(self, response: Detect.Response, kind: str, text: str) -> Detect.Response:
        self._ended[kind] += 1
        response.success, response.message = False, shortened(text, LONGEST_MESSAGE)
        response.collision_free_step = math.nan
        return response

    def _enter(self) -> bool:
        with self._lock:
            if self._open >= self._capacity:
                return False
            self._open += 1
            return True

    def _leave(self) -> None:
        with self._lock:
            self._open -= 1

    def _time_limit(self, request: Detect.Request) -> float:
        limit = request.time_limit or self._settings["detect_time_limit"]
        if not (math.isfinite(limit) and limit > 0):
            raise RequestError(
                f"time_limit: {request.time_limit} must be positive and finite, or 0 for the node's default"
            )
        return min(limit, LONGEST)
