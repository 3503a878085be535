# SPDX-License-Identifier: Apache-2.0
"""Extensions of rclpy's executor.

GuardedExecutor: an exception in a callback ends the callback, not the node. It is logged, counted and reported on
/diagnostics.

LeanExecutor: fewer and shorter turns, because rclpy's Python code around each message is part of the latency. A node
with a robot has 35 QoS event handlers, most of them for warnings, and rclpy rebuilds its wait set in each turn: with
them a turn takes twice as long. Each callback also ends with a wake-up, which costs an empty turn.

UnreadableExecutor: notices messages that cannot be deserialised, which the middleware drops silently. A subscription is
ready only if a message is waiting; if none can be taken then, the waiting ones were unreadable. With Fast DDS 2.14 this
never happened otherwise, neither for publishers that end or are killed nor for a history that overflows. Their number
is only known from the gap in the publisher's sequence numbers, and so are unreadable ones before a readable one.
"""

import threading
import time
import traceback
import weakref
from collections.abc import Callable
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.context import Context
from rclpy.event_handler import EventHandler, QoSPublisherEventType, QoSSubscriptionEventType
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor, await_or_execute
from rclpy.guard_condition import GuardCondition
from rclpy.service import Service
from rclpy.subscription import Subscription
from rclpy.task import Task

# Waits of the executor that may fail in a row, without a callback in between, before the node ends: a node that
# receives nothing and cannot be stopped should be restarted.
MOST_IN_A_ROW = 100
# Characters of an error's text, which may quote received data.
LONGEST = 500


class Errors:
    """Unexpected exceptions. Thread-safe.

    log: called with the traceback, once for each kind of exception and place where it was raised, because a faulty
    publisher repeats it at its full rate.
    """

    def __init__(self, log: Callable[[str], None]) -> None:
        self._log = log
        self._lock = threading.Lock()
        self._seen: set[tuple[type, str, int | None]] = set()
        self.count = 0
        self.last = ""

    def caught(self, where: str, error: Exception) -> str:
        """Count it; returns a line that names it. where: what was not done, for the log."""
        places = traceback.extract_tb(error.__traceback__)
        kind = (type(error), places[-1].filename, places[-1].lineno) if places else (type(error), where, 0)
        text = f"{where}: {type(error).__name__}: {error}"[:LONGEST]
        with self._lock:
            self.count += 1
            self.last = text
            new = kind not in self._seen
            self._seen.add(kind)
        if new:
            trace = "".join(traceback.format_exception(error)).rstrip()
            self._log(f"{text}; the node goes on, more of these are only counted\n{trace}")
        return text


class GuardedExecutor(SingleThreadedExecutor):
    """Continues after an exception in a callback, which is in `errors`. The caller of a service receives a failure.

    rclpy's executor raises it from spin_once; and if taking the message raised, neither that subscription nor others of
    its callback group are served again.
    """

    def __init__(self, errors: Errors, *, context: Context | None = None) -> None:
        super().__init__(context=context)
        self._errors = errors
        self._in_a_row = 0
        self._responding: weakref.WeakSet[Service] = weakref.WeakSet()

    def spin_once(self, timeout_sec: float | None = None) -> None:
        try:
            super().spin_once(timeout_sec)
            self._in_a_row = 0
        except ExternalShutdownException:
            raise
        except Exception as error:
            self._in_a_row += 1
            if self._in_a_row > MOST_IN_A_ROW:
                raise
            self._caught("executor", error)

    def _make_handler(self, entity: Any, node: Any, take: Callable[[Any], Any]) -> Any:
        # rclpy calls this for each entity. take: returns the coroutine function to run, or None.
        def guarded(entity: Any) -> Any:
            try:
                work = take(entity)
            except Exception as error:
                self._caught(_name(entity), error)
                return None

            async def run() -> None:
                try:
                    await work()
                except Exception as error:
                    self._caught(_name(entity), error)

            return None if work is None else run

        return super()._make_handler(entity, node, guarded)

    def _take_service(self, service: Service) -> Any:
        if service not in self._responding:
            self._responding.add(service)
            service.callback = self._respond_always(service.callback, _name(service))
        return super()._take_service(service)

    def _respond_always(self, callback: Callable, where: str) -> Callable:
        async def respond(request: Any, response: Any) -> Any:
            try:
                return await await_or_execute(callback, request, response)
            except Exception as error:
                return _failed(type(response)(), request, self._caught(where, error))

        return respond

    def _caught(self, where: str, error: Exception) -> str:
        if not self.context.ok():  # then all calls of rclpy fail
            raise ExternalShutdownException() from error
        return self._errors.caught(where, error)


def _name(entity: Any) -> str:
    for kind in ("srv_name", "topic"):
        if name := getattr(entity, kind, ""):
            return name
    callback = getattr(entity, "callback", None)
    return getattr(callback, "__qualname__", type(entity).__name__)


def _failed(response: Any, request: Any, text: str) -> Any:
    """A new `response`, thus without success if it has that field, with the reason if it has a field for it."""
    if hasattr(response, "message"):
        response.message = text
    if hasattr(response, "results"):  # set_parameters: one for each
        response.results = [SetParametersResult(successful=False, reason=text) for _ in request.parameters]
    elif isinstance(getattr(response, "result", None), SetParametersResult):
        response.result.reason = text
    return response


#: Seconds between checks of events that only warn; they do not end a wait.
LOOK_EVERY = 0.5
WARNINGS = frozenset(
    {
        QoSPublisherEventType.RCL_PUBLISHER_OFFERED_INCOMPATIBLE_QOS,
        QoSPublisherEventType.RCL_PUBLISHER_INCOMPATIBLE_TYPE,
        QoSSubscriptionEventType.RCL_SUBSCRIPTION_REQUESTED_INCOMPATIBLE_QOS,
        QoSSubscriptionEventType.RCL_SUBSCRIPTION_INCOMPATIBLE_TYPE,
    }
)


class LeanExecutor(SingleThreadedExecutor):
    """For nodes with a timer; otherwise warnings may be as late as the next message."""

    def __init__(self, *, context: Context | None = None) -> None:
        super().__init__(context=context)
        self._guard.destroy()
        self._guard = self._wake = _WakeOfOthers(None, None, context=self._context)
        self._made: Task | None = None
        self._look_at = 0.0
        self._looked = False

    def spin_once(self, timeout_sec: float | None = None) -> None:
        if self._looked:
            self._looked, self._look_at = False, time.monotonic() + LOOK_EVERY
        super().spin_once(timeout_sec)

    def wait_for_ready_callbacks(self, *args: Any, **options: Any) -> Any:
        self._made = self._wake.unheard_of = None
        found = super().wait_for_ready_callbacks(*args, **options)
        if found[0] is self._made:
            self._wake.unheard_of = threading.get_ident()
        return found

    def _make_handler(self, *args: Any) -> Task:
        self._made = super()._make_handler(*args)
        return self._made

    def can_execute(self, entity: Any) -> bool:
        if type(entity) is EventHandler and entity.event_type in WARNINGS:
            if time.monotonic() < self._look_at:
                return False
            self._looked = True
        return super().can_execute(entity)


class _WakeOfOthers(GuardCondition):
    """``unheard_of``: a thread that runs the results of the last wait, and looks for work before it waits again. It
    does not know of new tasks created by tasks: it runs those and then waits."""

    unheard_of: int | None = None

    def trigger(self) -> None:
        if threading.get_ident() != self.unheard_of:
            super().trigger()


_watched: weakref.WeakKeyDictionary[Subscription, Callable[[], None]] = weakref.WeakKeyDictionary()


def watch_unreadable(subscription: Subscription, on_unreadable: Callable[[], None]) -> None:
    """Call ``on_unreadable`` at each sign of unreadable messages, if an UnreadableExecutor runs the node."""
    _watched[subscription] = on_unreadable


class UnreadableExecutor(SingleThreadedExecutor):
    """Calls the functions given to `watch_unreadable`."""

    def _take_subscription(self, subscription: Subscription) -> Any:
        work = super()._take_subscription(subscription)
        if work is None and (tell := _watched.get(subscription)) is not None:
            tell()
        return work
