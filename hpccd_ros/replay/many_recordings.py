# SPDX-License-Identifier: Apache-2.0
"""Verify many recordings at once on a Dask cluster, or in processes of this machine; the results as one table."""

import contextlib
import csv
import os
import socket
import sys
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from hpccd_core.check import workers
from hpccd_ros.bag.reader import Recording
from hpccd_ros.base import extras
from hpccd_ros.base.errors import UserError
from hpccd_ros.params.parameter_file import read_parameters
from hpccd_ros.replay import recorded_setup
from hpccd_ros.replay.recomputed import Replay
from hpccd_ros.replay.report import Summary, new_file, write_json

SHOWN = ("file", "result", "steps", "contacts", "core_ms", "host", "why")
GOOD = ("VERIFIED", "COMPUTED")


def replay_one(path: str, *, params=None, **options) -> dict:
    """Verify the recording `path`, and say in a row what came of it. Runs on a worker. options: of `Replay`."""
    host = {"host": f"{socket.gethostname()}:{os.getpid()}"}
    try:
        with Recording(path) as recording:
            replay = Replay(recording, recorded_setup.of_recording(recording, params), **options)
            summary = Summary()
            for step in replay.steps():
                summary.add(step)
            return summary.row(path, replay) | host
    except UserError as error:
        return {"file": path, "result": "UNUSABLE", "why": str(error)} | host


def main(args) -> int:
    """Verify as the options of `hpccd replay` say. 0: all equal, 1: not."""
    distributed = extras.require("distributed", "cluster", "replaying many recordings at once")
    if args.params:
        read_parameters(args.params)  # one sentence now rather than one for each recording
    with new_file("--csv", args.csv) as csv_file, new_file("--json", args.json) as json_file:
        rows = _rows(distributed, args)
        if json_file:
            write_json(json_file, rows)
        if csv_file:
            _write_csv(csv_file, rows)
    _print(rows)
    return 0 if all(row["result"] in GOOD for row in rows) else 1


def _rows(distributed, args) -> list[dict]:
    """The outcome of each recording, in the given order."""
    paths = [str(Path(path).absolute()) for path in args.files]
    with _cluster(distributed, args.scheduler, args.jobs, len(paths)) as (client, threads):
        options = {
            "params": args.params and str(Path(args.params).absolute()),
            "backend": args.backend,
            "threads": args.threads or threads,
            "accuracy": args.accuracy,
            "features": args.features,
            "begin": args.begin,
            "end": args.end,
        }
        futures = [client.submit(replay_one, path, pure=False, **options) for path in paths]
        return _gather(distributed, futures, paths)


@contextlib.contextmanager
def _cluster(*arguments):
    """As `workers.cluster`, whose error becomes a UserError."""
    try:
        with workers.cluster(*arguments) as connected:
            yield connected
    except workers.ClusterError as error:
        raise UserError(str(error)) from error


def _gather(distributed, futures, paths) -> list[dict]:
    """The rows in the order of the paths. A job that failed on its worker becomes a row that says so."""
    number = {future.key: k for k, future in enumerate(futures)}
    rows = [{}] * len(futures)
    progress = Progress(
        TextColumn("replay"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("recordings"),
        TimeRemainingColumn(),
        TextColumn("{task.fields[line]}"),
        console=Console(stderr=True),
        transient=True,
        disable=not sys.stderr.isatty(),
    )
    with progress:
        bar = progress.add_task("replay", total=len(futures), line="")
        for future in distributed.as_completed(futures):
            k = number[future.key]
            error = future.exception()
            rows[k] = (
                future.result()
                if error is None
                else {"file": paths[k], "result": "FAILED", "why": f"{type(error).__name__}: {error}", "host": ""}
            )
            progress.update(bar, advance=1, line=f"{Path(paths[k]).name}: {rows[k]['result']}")
    return rows


def _print(rows) -> None:
    console = Console(highlight=False)
    table = Table("recording", "result", "steps", "contacts", "core ms", "where", "first problem")
    folder = os.path.commonpath([os.path.dirname(row["file"]) for row in rows])
    for row in rows:
        texts = {name: str(row.get(name, "")) for name in SHOWN} | {"file": os.path.relpath(row["file"], folder)}
        table.add_row(*(texts[name] for name in SHOWN), style=None if row["result"] in GOOD else "red")
    if console.is_terminal:
        console.print(table)
    else:  # whole lines, for grep
        for row in rows:
            print(f"{row['file']}: {row['result']}" + (f": {row['why']}" if row["why"] else ""))
    good = sum(row["result"] in GOOD for row in rows)
    print(
        f"{good} of {len(rows)} recordings without a difference, {sum(r.get('verified', 0) for r in rows):,} results "
        f"verified, {sum(r.get('diverged', 0) for r in rows):,} diverged",
        flush=True,
    )


def _write_csv(path, rows) -> None:
    columns = list(dict.fromkeys(name for row in rows for name in row))
    with open(path, "w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, columns)
        writer.writeheader()
        lists = ("accuracy", "separation", "features")
        writer.writerows(row | {name: " ".join(row.get(name, [])) for name in lists} for row in rows)
