# SPDX-License-Identifier: Apache-2.0
"""SIGINT and SIGTERM as an event that ends the main loop between two turns, instead of an interruption anywhere.

rclpy's handlers shut the context down while callbacks run: in one of ten shutdowns the executor then failed on the
invalid context, or waited forever. Blocking the signals for a thread that waits for them does not work either, because
threads that libraries created at import would receive them.
"""

import contextlib
import os
import signal
import threading
from collections.abc import Callable, Iterator

from rclpy.executors import Executor
from rclpy.task import Future


def watch(on_stop: Callable[[], None]) -> None:
    """Call ``on_stop`` once, from a separate thread, at the first SIGINT or SIGTERM; later ones do nothing.

    Call from the main thread, with rclpy's handlers off.
    """
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    # Python's handlers run only after the main thread returns from the executor's wait; the byte is written at once.
    signal.set_wakeup_fd(writer, warn_on_full_buffer=False)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda number, frame: None)

    def wait() -> None:
        stops = {int(signal.SIGINT), int(signal.SIGTERM)}
        while os.read(reader, 1)[0] not in stops:
            pass
        on_stop()

    threading.Thread(target=wait, name="signals", daemon=True).start()


def ignore() -> None:
    """From now on SIGINT and SIGTERM do nothing. Call it last: the exit status is then that of the program.

    Python removes its handlers early in its finalization; a second signal would then kill the process.
    """
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)


@contextlib.contextmanager
def collected() -> Iterator[list[int]]:
    """Yields an empty list, to which each SIGINT and SIGTERM within this block adds an entry, for a loop that checks
    it.

    Call from the main thread, with rclpy's handlers off.
    """
    came: list[int] = []
    before = {}
    try:
        for number in (signal.SIGINT, signal.SIGTERM):
            before[number] = signal.signal(number, lambda number, frame: came.append(number))
        yield came
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextlib.contextmanager
def later() -> Iterator[None]:
    """A SIGINT or SIGTERM within this block becomes a KeyboardInterrupt after it.

    Inside of rclpy's calls, which call Python back from C++, the exception would come out as another one.
    """
    with collected() as came:
        yield
    if came:
        raise KeyboardInterrupt


def spin(executor: Executor, stop: Future) -> None:
    """Run the callbacks of ``executor`` until ``stop`` is done, possibly by another thread.

    Not spin_until_future_complete: rclpy 7.1 hangs a callback on the future at each turn, 0.4 KB for every message
    that a node receives, and never takes one off (20 MB in half an hour at 40 messages a second).
    """
    woken = threading.Event()

    def wake(_: Future) -> None:
        try:
            executor.create_task(lambda: None)  # a task without effect ends the wait of spin_once
        finally:
            woken.set()

    stop.add_done_callback(wake)
    try:
        while executor.context.ok() and not stop.done():
            executor.spin_once()
    finally:
        # The future is done before its callbacks run: wait for the other thread, which still uses the executor.
        if not stop.remove_done_callback(wake):
            woken.wait()
