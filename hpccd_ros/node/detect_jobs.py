# SPDX-License-Identifier: Apache-2.0
"""Requests to ``~/detect``, from service and action: queued, computed outside the executor."""

import math
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future as JobFuture
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.task import Future

from hpccd_ros.base.quoting import LONGEST_MESSAGE, printable, shortened
from hpccd_ros.detect.core import CORE_ERRORS, Cancellation
from hpccd_ros.detect.kept_detectors import KeptDetectors
from hpccd_ros.middleware import topic_names
from hpccd_ros.node.accounts import Accounts
from hpccd_ros.node.configuration import Configuration
from hpccd_ros.node.detect_query import QueryResult, Request, RequestError, Response
from hpccd_ros.node.detect_request import NodeScene, compute
from hpccd_ros.node.life_cycle import GuardedLifecycleNode

# s, the longest time limit: rclpy's timers count nanoseconds in 64 bits, 292 years.
LONGEST = 86_400.0
# The remedy for large requests, by query.
_LESS = {"contacts": "ask for less (report first), or ", "proximity": "ask for a smaller distance, or "}
STOPPED = "stopped: the node was shut down or cleaned up before the result was ready; ask again when it is active"

R = TypeVar("R", bound=Response)


class Ticket:
    """``stage``: the current stage of its work. ``ended``: how it ended, a name in Accounts.requests; "" before.

    on_place: called when it is accepted: computed or queued.
    """

    def __init__(self, stage: str, on_place: Callable[[], None] = lambda: None) -> None:
        self.stage = stage
        self.on_place = on_place
        self.ended = ""
        self.time_limit = math.nan
        self.given_up: tuple[str, str] | None = None  # how it is to end, and the reason in words
        self.settle: Callable[[], None] = lambda: None  # whoever waits for its result waits no longer
        self.cancellation = Cancellation()
        self._since = time.monotonic()

    @property
    def seconds(self) -> float:
        """Seconds since its arrival."""
        return time.monotonic() - self._since

    def enter(self, stage: str) -> None:
        """Called by the computing thread."""
        self.stage = stage

    def give_up(self, ended: str, why: str) -> None:
        """End it with ``why`` now, unless it was given up before. Called by the executor's thread."""
        if self.given_up is None:
            self.given_up = ended, why
            self.cancellation.cancel()
            self.settle()


class DetectJobs:
    """Computes ``detect_jobs`` requests at a time; ``detect_waiting`` more may wait, others are rejected.

    If the time limit of a request has passed, if it is given up, or if this is closed, the request ends with the
    reason and its computation is cancelled; its place is free when that ends.
    scene: the state of the node, requested in the executor for each request; or a text: why it cannot compute now.
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
        self.capacity = settings["detect_jobs"] + settings["detect_waiting"]
        self._kept = KeptDetectors(settings["detect_jobs"])
        self._pool = ThreadPoolExecutor(settings["detect_jobs"], thread_name_prefix="detect")
        self._lock = threading.Lock()
        self._open = 0
        self._waiting: dict[Ticket, None] = {}  # in the order in which they came
        self._awaited: set[Ticket] = set()

    @property
    def counts(self) -> dict[str, int]:
        """How requests ended, and how many are computed or queued now."""
        return {**self._ended, "open": self._open}

    def count(self, ended: str) -> None:
        """Count a request that ended this way before it reached `fill`."""
        self._ended[ended] += 1

    def forget_scenes(self, unused_for: float) -> None:
        """Release scenes kept for further requests that were not used for this number of seconds."""
        self._kept.forget(unused_for)

    def places(self) -> dict[Ticket, int]:
        """Queue position of each waiting request."""
        with self._lock:
            return {ticket: place for place, ticket in enumerate(self._waiting)}

    def close(self) -> None:
        """Give up all requests; `fill` continues, with a rejection, when its task runs next."""
        for ticket in tuple(self._awaited):
            ticket.give_up("stopped", STOPPED)
        self._pool.shutdown(wait=False, cancel_futures=True)

    async def fill(self, request: Request, response: R, ticket: Ticket) -> R:
        """Fill `response` with the result or with the reason why there is none; see ``ticket.ended``."""
        try:
            return await self._computed(request, response, ticket)
        except RequestError as error:
            return self.reject(response, ticket, "rejected", str(error))
        except Exception as error:  # here and not only by the executor's guard, so that it is counted as failed
            text = self._node.errors.caught(topic_names.DETECT, error)
            return self.reject(type(response)(), ticket, "failed", text)

    def reject(self, response: R, ticket: Ticket, ended: str, text: str) -> R:
        self._end(ticket, ended)
        response.success, response.message = False, shortened(text, LONGEST_MESSAGE)
        response.collision_free_step = math.nan
        return response

    async def _computed(self, request: Request, response: R, ticket: Ticket) -> R:
        if ticket.given_up is not None:
            return self.reject(response, ticket, *ticket.given_up)
        ticket.time_limit = limit = self._time_limit(request)
        scene = self._scene()
        if isinstance(scene, str):
            raise RequestError(scene)
        if not self._enter(ticket):
            return self.reject(
                response,
                ticket,
                "busy",
                f"busy: {self.capacity} requests are being computed or wait "
                "(parameters detect_jobs, detect_waiting); try again later",
            )
        try:
            job = self._pool.submit(self._compute, request, scene, self._configuration.options, ticket)
        except RuntimeError:  # the system gives no further thread
            self._leave(ticket)
            raise
        job.add_done_callback(lambda _: self._leave(ticket))
        ticket.on_place()
        await self._settled(job, ticket)
        if ticket.given_up is not None:
            job.cancel()
            return self.reject(response, ticket, *ticket.given_up)
        if not job.done():
            job.cancel()
            ticket.cancellation.cancel()
            return self.reject(
                response,
                ticket,
                "timed_out",
                f"time limit of {limit:g} s passed before the result was ready; "
                f"{_LESS.get(request.query or 'contacts', '')}set a longer time_limit",
            )
        try:
            result = job.result()
        except RequestError:
            raise
        except CORE_ERRORS as error:
            return self.reject(response, ticket, "failed", printable(f"{type(error).__name__}: {error}"))
        if result.contacts is not None:
            response.contacts = result.contacts
        if result.distances is not None:
            response.distances = result.distances
        response.collision_free_step = result.collision_free_step
        response.success, response.message = True, result.text
        self._end(ticket, "succeeded")
        return response

    def _compute(self, request: Request, scene: NodeScene, options: Any, ticket: Ticket) -> QueryResult:
        with self._lock:
            self._waiting.pop(ticket, None)
        return compute(request, scene, options, self._settings, self._kept, ticket.cancellation, ticket.enter)

    async def _settled(self, job: JobFuture, ticket: Ticket) -> None:
        """Wait until the job is done, its time limit has passed or it is given up."""
        settled = Future(executor=self._node.executor)

        def settle(_: Any = None) -> None:
            if not settled.done():
                settled.set_result(None)
            if (executor := self._node.executor) is not None:
                executor.wake()  # a task that awaits is only looked at when the executor wakes up

        steady = Clock(clock_type=ClockType.STEADY_TIME)
        # In a group of its own, which ends with it: a group keeps every timer that was ever added.
        timer = self._node.create_timer(
            ticket.time_limit, settle, callback_group=ReentrantCallbackGroup(), clock=steady
        )
        ticket.settle = settle
        self._awaited.add(ticket)
        job.add_done_callback(settle)
        try:
            await settled
        finally:
            self._awaited.discard(ticket)
            self._node.destroy_timer(timer)

    def _end(self, ticket: Ticket, ended: str) -> None:
        ticket.ended = ended
        self.count(ended)

    def _enter(self, ticket: Ticket) -> bool:
        with self._lock:
            if self._open >= self.capacity:
                return False
            self._open += 1
            self._waiting[ticket] = None
            return True

    def _leave(self, ticket: Ticket) -> None:
        with self._lock:
            self._open -= 1
            self._waiting.pop(ticket, None)

    def _time_limit(self, request: Request) -> float:
        limit = request.time_limit or self._settings["detect_time_limit"]
        if not (math.isfinite(limit) and limit > 0):
            raise RequestError(
                f"time_limit: {request.time_limit} must be positive and finite, or 0 for the node's default"
            )
        return min(limit, LONGEST)
