# SPDX-License-Identifier: Apache-2.0
"""Check the parts of a sequence side by side: in processes of this machine, or on a Dask cluster."""

from __future__ import annotations

import contextlib
import importlib
import logging
import multiprocessing.connection
import multiprocessing.synchronize
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import resource_tracker
from typing import Any

import numpy as np

from ..sequences import Frame, FrameSequence
from ..sequences.splitting import SplitSequence, has_closed_parts
from .analysis import Options, check_part
from .report import FrameResult, Report, StepResult

# Frames of a part. The frame after a part is read twice, once by the next part.
PART = 16
# Below this many frames, the start of processes (0.5 s) is most of the time.
SHORT = 64

Row = tuple[FrameResult, StepResult | None]


class ClusterError(Exception):
    """There is no usable Dask cluster, or a process ended. The message names the remedy."""


def report_of(sequence: FrameSequence, options: Options, rows: list[Row], notes: tuple[str, ...] = ()) -> Report:
    """The report of the rows of all frames."""
    frames, steps = [frame for frame, _ in rows], [step for _, step in rows if step is not None]
    first = sequence.frame(0)
    if frames[0].intersections and not (options.weld or options.changes):
        notes += _seams(first)
    if not isinstance(sequence, SplitSequence):
        notes += _components(first)
    separation = options.separation
    if separation and len(first.meshes) == 1 and not options.changes:
        separation = 0.0
        notes += ("the separation has no effect: it is that of different meshes, and the sequence has one mesh",)
    return Report(sequence.source, frames, steps, sequence.notes + notes, separation)


def _components(frame: Frame) -> tuple[str, ...]:
    """A note about meshes of which a component may be inside another one: this is not reported within a mesh."""
    names = [mesh.name for mesh in frame.meshes if has_closed_parts(mesh)]
    if not names:
        return ()
    what = f"mesh {names[0]} has" if len(names) == 1 else f"mesh {names[0]} and {len(names) - 1} more have"
    return (f"{what} several connected components; whether one is inside another is only reported with --split",)


def _seams(frame: Frame) -> tuple[str, ...]:
    """A note about vertices that share a position with another one of their mesh: they may be the only contacts."""
    doubled, first = 0, 0
    for mesh in frame.meshes:
        x = frame.vertices[first + np.unique(mesh.faces)]
        doubled += len(x) - len(np.unique(x, axis=0))
        first += mesh.n_vertices
    if not doubled:
        return ()
    what = "1 vertex has" if doubled == 1 else f"{doubled:,} vertices have"
    return (f"{what} the position of another one of the same mesh in the first frame; --weld joins them at seams",)


def in_processes(
    sequence: FrameSequence, options: Options, jobs: int = 0, progress: Callable[[], None] = lambda: None
) -> list[Row]:
    """The rows of all frames, by `jobs` processes that each read and check parts; 0: one for each core.

    Processes, because parsers of text hold the interpreter lock. Short sequences are checked in this one. progress is
    called after each frame of a finished part. Raises SequenceError, that of the first part that failed, and
    ClusterError if a process ends early.
    """
    cores = len(os.sched_getaffinity(0))
    jobs = min(jobs or cores, n_parts(sequence)) if len(sequence) >= SHORT else 1
    rows: list[Row] = []
    if jobs == 1:
        for row in check_part(sequence, options, 0, len(sequence)):
            rows.append(row)
            progress()
        return rows
    context = multiprocessing.get_context("spawn")
    stop = context.Event()
    pool = ProcessPoolExecutor(jobs, context, initializer=_begin, initargs=(stop,))
    try:
        futures = [
            pool.submit(_rows_until_stopped, sequence, options, *part, max(1, cores // jobs))
            for part in _parts(len(sequence))
        ]
        for future in futures:
            of_part = future.result()
            rows += of_part
            for _ in of_part:
                progress()
    except BrokenProcessPool as error:
        raise ClusterError("--jobs: a process was ended, perhaps for lack of memory; try fewer jobs") from error
    finally:
        stop.set()
        pool.shutdown(cancel_futures=True)
    return rows


_stop: multiprocessing.synchronize.Event | None = None


def _begin(stop: multiprocessing.synchronize.Event) -> None:
    """Begin a process of `in_processes`: an interrupt is the parent's to handle; when that has ended, so does this."""
    global _stop
    _stop = stop
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    assert parent is not None

    def end_with(sentinel: int) -> None:
        multiprocessing.connection.wait([sentinel])
        os._exit(1)

    threading.Thread(target=end_with, args=(parent.sentinel,), daemon=True).start()


def _rows_until_stopped(sequence: FrameSequence, options: Options, begin: int, end: int, threads: int) -> list[Row]:
    """The rows of a part; fewer after an interrupt."""
    rows = []
    for row in check_part(sequence, options, begin, end, threads):
        if _stop is None or _stop.is_set():
            break
        rows.append(row)
    return rows


def on_cluster(
    client: Any, sequence: FrameSequence, options: Options, threads: int, progress: Callable[[], None] = lambda: None
) -> list[Row]:
    """The rows of all frames, by the workers of a Dask client. threads: of the core on each; 0: all cores.

    progress is called after each frame of a finished part. Raises SequenceError, that of the first part that failed.
    """
    futures = [client.submit(_rows, sequence, options, *part, threads, pure=False) for part in _parts(len(sequence))]
    rows: list[Row] = []
    try:
        for future in futures:
            of_part = future.result()
            rows += of_part
            for _ in of_part:
                progress()
    finally:
        client.cancel(futures)
    return rows


@contextlib.contextmanager
def cluster(distributed: Any, scheduler: str | None, jobs: int, most: int) -> Iterator[tuple[Any, int]]:
    """(client, threads of the core for each job; 0: all that the worker's machine has).

    scheduler: the address of a running Dask cluster; without, processes of this machine are started. jobs: how many of
    them; 0: one for each core. most: no more than this are of use. Raises ClusterError.
    """
    lost = (distributed.KilledWorker, distributed.CancelledError, distributed.comm.CommClosedError)
    if scheduler:
        try:
            client = distributed.Client(scheduler, timeout="60s")
        except (OSError, ValueError, TimeoutError) as error:
            raise ClusterError(
                f"--scheduler {scheduler}: no Dask scheduler responds there ({error}); start one (dask scheduler) or "
                "correct the address"
            ) from error
        with client:
            if not client.scheduler_info(n_workers=-1)["workers"]:
                raise ClusterError(f"--scheduler {scheduler}: the cluster has no workers; start some (dask worker)")
            try:
                yield client, 0
            except lost as error:
                raise ClusterError(
                    f"--scheduler {scheduler}: its workers were lost, perhaps for lack of memory: {error}; start more"
                ) from error
        return
    cores = len(os.sched_getaffinity(0))
    processes = min(jobs or cores, most)
    starting = True
    try:
        # On this machine only, and without the web page of Dask. Its logs, such as of processes that end after their
        # scheduler, are not for users: errors are raised here.
        with contextlib.ExitStack() as stack:
            with _interrupted_later():
                config = importlib.import_module("dask").config.set(
                    {"distributed.nanny.pre-spawn-environ.DASK_LOGGING__DISTRIBUTED": "critical"}
                )
                stack.enter_context(config)
                local = distributed.LocalCluster(
                    n_workers=processes,
                    threads_per_worker=1,
                    host="127.0.0.1",
                    dashboard_address="127.0.0.1:0",
                    silence_logs=logging.CRITICAL,
                )
                client = stack.enter_context(distributed.Client(stack.enter_context(local)))
            starting = False
            yield client, max(1, cores // processes)
    except (*lost, RuntimeError) as error:
        if isinstance(error, RuntimeError) and not starting:
            raise
        what = "could not be started" if starting else "were ended"
        raise ClusterError(f"--cluster: processes {what}, perhaps for lack of memory; try fewer jobs") from error


@contextlib.contextmanager
def _interrupted_later() -> Iterator[None]:
    """A first interrupt comes when the block ends: a half-started cluster prints errors of its own.

    Processes that are started meanwhile, and by threads that are, ignore SIGINT: a terminal sends it to all.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}

    def wait(number: int, _: object) -> None:
        came.append(number)
        signal.signal(number, before[signal.Signals(number)])

    for number, handler in before.items():
        if callable(handler):
            signal.signal(number, wait)
    resource_tracker.ensure_running()  # at its start it unblocks SIGINT
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        for number, handler in before.items():
            signal.signal(number, handler)
        if came:
            raise KeyboardInterrupt


def _rows(sequence: FrameSequence, options: Options, begin: int, end: int, threads: int) -> list[Row]:
    return list(check_part(sequence, options, begin, end, threads))


def n_parts(sequence: FrameSequence) -> int:
    """How many parts can be checked side by side."""
    return len(_parts(len(sequence)))


def _parts(n_frames: int) -> list[tuple[int, int]]:
    return [(begin, min(begin + PART, n_frames)) for begin in range(0, n_frames, PART)]
