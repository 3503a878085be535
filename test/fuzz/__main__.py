# SPDX-License-Identifier: Apache-2.0
"""Command line of the fuzzer."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from hpccd_core.options import ACCURACIES

from .differential import QUESTIONS, SIMD, Tallies, add_batch, batches, new_tallies, usable_simd
from .failures import load_batches, save_failing

SECONDS_BETWEEN_LINES = 30


def main(arguments: list[str] | None = None) -> int:
    a = _parser().parse_args(arguments)
    console = Console(width=None if sys.stdout.isatty() else 120)
    simd = usable_simd() if a.simd == "all" else [a.simd]
    tallies = new_tallies()
    source = load_batches(a.replay) if a.replay else batches(a.seed, a.batch, a.question)
    goal = None if a.replay else a.count or a.seconds
    done, reported, start = 0, 0.0, time.monotonic()
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True) as progress:
        bar = progress.add_task("fuzzing", total=goal)
        try:
            for batch in source:
                add_batch(tallies, batch, a.accuracy, simd=simd, threads=a.threads)
                done += len(batch.queries)
                seconds = time.monotonic() - start
                broken = sum(t.broken for t in tallies.values())
                speed = f"{done:,} queries, {done / seconds:,.0f}/s, {broken} broken promises"
                text = f"{speed}, last: {batch.question}, {batch.generator}"
                progress.update(bar, completed=done if a.count else seconds, description=text)
                if not console.is_terminal and seconds > reported + SECONDS_BETWEEN_LINES:
                    console.print(text)  # the bar shows on terminals only
                    reported = seconds
                if goal is not None and (done if a.count else seconds) >= goal:
                    break
        except KeyboardInterrupt:
            console.print("Stopped early; what was done:")
    console.print(_table(tallies))
    console.print(
        "error: largest error of a time, or of a distance in sizes of its query; true: hits, or scenes in which meshes "
        "touch; late: largest beyond the true one; uneven:\nan instruction set, or a query of the same step, differs, "
        "or a motion breaks a promise; broken: promises of exact and conservative, and what is uneven."
    )
    source_text = f"replay of {a.replay}" if a.replay else f"seed {a.seed}, batches of {a.batch}"
    seconds = time.monotonic() - start
    console.print(f"{done:,} queries in {seconds:.1f} s, {source_text}, instruction sets: {', '.join(simd)}.")
    if not save_failing(a.save, tallies):
        return 0
    console.print(f"Failing queries: {a.save}. Again: python -m fuzz --replay {a.save}")
    return 1


def _parser() -> argparse.ArgumentParser:
    p = argparse.ArgumentParser(
        prog="python -m fuzz",
        description="Compare contact, separation, proximity and intersections of single pairs, and of small scenes the "
        "smallest distances of their meshes, which lie inside which, how far they may go, their collision-free "
        "motions, winding numbers and signed distances of points, separating translations and penetration depth, with "
        "the exact oracle on degenerate queries. Exit status 1 where exact differs (time or distance: by more than "
        "1e-12), where a depth is below the true one or a translation does not separate, where "
        "conservative misses a pair, reports it late or, where distances count, differs in the same way, where either "
        "lets a scene go too far or ends it more than 1e-9 too early, where a collision-free motion touches anything "
        "or keeps less than promised, where report='first' is not the earliest contacts of 'all', or where an "
        "instruction set's result differs; fast and balanced promise no more and are only counted.",
    )
    length = p.add_mutually_exclusive_group()
    length.add_argument("--seconds", type=float, default=60.0, help="how long (default 60)")
    length.add_argument("--count", type=int, help="how many queries instead")
    p.add_argument("--seed", type=int, default=0, help="the same seed and batch give the same queries")
    p.add_argument(
        "--batch", type=int, default=10_000, help="queries in a batch (default 10000); a tenth as many scenes"
    )
    for name, choices in (("question", QUESTIONS), ("accuracy", ACCURACIES)):
        text = f"comma-separated (default: {','.join(choices)})"
        p.add_argument(f"--{name}", type=_some_of(choices), default=choices, help=text)
    p.add_argument("--simd", choices=("all", "auto", *SIMD), default="all", help="default: all that are usable")
    p.add_argument("--threads", type=int, default=0, help="threads of the oracle, 0 = all cores")
    p.add_argument("--save", type=Path, default=Path("fuzz-failures.npz"), help="file for failing queries")
    p.add_argument("--replay", type=Path, help="run the queries of such a file and no others")
    return p


def _some_of(choices: tuple[str, ...]) -> Callable[[str], tuple[str, ...]]:
    def names(text: str) -> tuple[str, ...]:
        names = tuple(text.split(","))
        unknown = set(names) - set(choices)
        if unknown:
            raise argparse.ArgumentTypeError(f"{', '.join(sorted(unknown))}: choose from {', '.join(choices)}")
        return names

    return names


def _table(tallies: Tallies) -> Table:
    table = Table(title="The core against the exact oracle", box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for column in ("question", "tier", ""):
        table.add_column(column, no_wrap=True)
    for column in ("queries", "true", "missed", "invented", "error", "late", "uneven", "broken"):
        table.add_column(column, justify="right", no_wrap=True)
    for (question, accuracy, kind), t in sorted(
        tallies.items(), key=lambda item: (QUESTIONS.index(item[0][0]), item[0])
    ):
        counts = (t.queries, t.hits, t.missed, t.invented)
        errors = (f"{t.worst_error:.0e}", f"{t.latest:.0e}" if t.latest else "0")
        abbreviated = "".join(word[0].upper() for word in kind.split("-"))
        table.add_row(
            question, accuracy, abbreviated, *(f"{n:,}" for n in counts), *errors, f"{t.uneven:,}", f"{t.broken:,}"
        )
    return table


if __name__ == "__main__":
    sys.exit(main())
