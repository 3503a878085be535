# SPDX-License-Identifier: Apache-2.0
"""Check the parts of a sequence side by side: in threads, or on a Dask cluster."""

from __future__ import annotations

import contextlib
import os
import pickle
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from ..sequences import FrameSequence
from .analysis import Options, check_part
from .report import FrameResult, Report, StepResult

# Frames of a part. The frame after a part is read twice, once by the next part.
PART = 16

Row = tuple[FrameResult, StepResult | None]


class ClusterError(Exception):
    """There is no usable Dask cluster. The message names the remedy."""


class Stopped(Exception):
    """A part was given up, because another one failed or the user interrupted."""


def report_of(sequence: FrameSequence, options: Options, rows: list[Row], notes: tuple[str, ...] = ()) -> Report:
    """The report of the rows of all frames."""
    steps = [step for _, step in rows if step is not None]
    return Report(sequence.source, [frame for frame, _ in rows], steps, sequence.notes + notes, options.separation)


def in_threads(
    sequence: FrameSequence, options: Options, jobs: int = 0, progress: Callable[[], None] = lambda: None
) -> list[Row]:
    """The rows of all frames, by `jobs` threads that each read and check parts; 0: one for each core.

    progress is called after each frame. Raises SequenceError, that of the first part that failed.
    """
    cores = len(os.sched_getaffinity(0))
    parts = _parts(len(sequence))
    jobs = min(jobs or cores, len(parts))
    stop = threading.Event()
    own = threading.local()  # readers keep files open, each thread its own

    def rows_of(begin: int, end: int) -> list[Row]:
        if not hasattr(own, "sequence"):
            own.sequence = pickle.loads(pickle.dumps(sequence))
        rows = []
        for row in check_part(own.sequence, options, begin, end, max(1, cores // jobs)):
            if stop.is_set():
                raise Stopped
            rows.append(row)
            progress()
        return rows

    with ThreadPoolExecutor(jobs) as pool:
        futures = [pool.submit(rows_of, *part) for part in parts]
        try:
            return [row for future in futures for row in future.result()]
        finally:
            stop.set()
            pool.shutdown(cancel_futures=True)


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
    if scheduler:
        try:
            client = distributed.Client(scheduler, timeout="60s")
        except (OSError, ValueError, TimeoutError) as error:
            raise ClusterError(f"--scheduler {scheduler}: no Dask scheduler responds there: {error}") from error
        with client:
            if not client.scheduler_info(n_workers=-1)["workers"]:
                raise ClusterError(f"--scheduler {scheduler}: a cluster without workers: start some (dask worker)")
            yield client, 0
        return
    cores = len(os.sched_getaffinity(0))
    processes = min(jobs or cores, most)
    # On this machine only, and without the web page of Dask.
    with (
        distributed.LocalCluster(
            n_workers=processes, threads_per_worker=1, host="127.0.0.1", dashboard_address=None
        ) as local,
        distributed.Client(local) as client,
    ):
        yield client, max(1, cores // processes)


def _rows(sequence: FrameSequence, options: Options, begin: int, end: int, threads: int) -> list[Row]:
    return list(check_part(sequence, options, begin, end, threads))


def n_parts(sequence: FrameSequence) -> int:
    """How many parts can be checked side by side."""
    return len(_parts(len(sequence)))


def _parts(n_frames: int) -> list[tuple[int, int]]:
    return [(begin, min(begin + PART, n_frames)) for begin in range(0, n_frames, PART)]
