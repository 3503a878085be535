# SPDX-License-Identifier: Apache-2.0
"""Progress on stderr while a benchmark runs; silent where nobody looks, so that it costs the timing nothing."""

from __future__ import annotations

import contextlib
import sys

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn


class Bar:
    """`step(text)` counts one call done."""

    def __init__(self, progress: Progress, task):
        self._progress, self._task = progress, task

    def step(self, said: str = "") -> None:
        self._progress.update(self._task, advance=1, said=said)
        self._progress.refresh()


@contextlib.contextmanager
def bar(description: str, total: int):
    """Context with a Bar of `total` calls on stderr."""
    progress = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[said]}"),
        # Redrawn by update() only: a thread that draws in between would take time from what is measured.
        console=Console(stderr=True),
        transient=True,
        disable=not sys.stderr.isatty(),
        auto_refresh=False,
    )
    with progress:
        task = progress.add_task(description, total=total, said="")
        yield Bar(progress, task)
