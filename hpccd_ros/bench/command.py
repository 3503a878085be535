# SPDX-License-Identifier: Apache-2.0
"""Shared options and set-up of the benchmarks."""

from __future__ import annotations

import argparse
import os
import shlex
from collections.abc import Callable, Collection, Sequence
from pathlib import Path

from hpccd_core.options import ACCURACIES
from hpccd_ros.base.errors import UserError
from hpccd_ros.base.quoting import counted
from hpccd_ros.bench import measure, sources
from hpccd_ros.bench import report as output
from hpccd_ros.bench.report import Report

MOST_THREADS = 1024  # of a detector
MOST_ROUNDS = 100_000
FEWEST_ROUNDS = 5  # below that a median means little, and the result says so
PLACES = ("command", "benchmark", "out", "data", "label", "picture")  # paths of this machine are not kept


def configure(
    parser: argparse.ArgumentParser,
    default: Sequence[str],
    steps: int,
    repeat: int = 5,
    leave_out: Collection[str] = (),
) -> None:
    """leave_out: options that the benchmark does not use; they have their defaults."""
    parser.set_defaults(data=None, size=1.0, steps=steps, repeat=repeat, threads=0, default_sources=tuple(default))

    def add(name, **options):
        if name.removeprefix("--") not in leave_out:
            parser.add_argument(name, **options)

    add(
        "sources",
        nargs="*",
        metavar="SCENE",
        help="a generated scene (`hpccd scene --list`), the name of a file in HPCCD_DATA, `data` for all of these, or "
        f"the path of a recording (.mcap), of a mesh file or of an .npz file (default: {' '.join(default)})",
    )
    add("--data", metavar="DIR", help="folder of scene files (default: the variable HPCCD_DATA)")
    add("--size", type=float, default=1.0, metavar="X", help="factor on the triangles of generated scenes (default: 1)")
    spread = "steps measured of each scene, evenly spread; 0: all (default: %(default)s)"
    add("--steps", type=int, default=steps, metavar="N", help=spread)
    add("--repeat", type=int, default=repeat, metavar="N", help="timed rounds after a warm-up (default: %(default)s)")
    add("--threads", type=int, default=0, metavar="N", help="0: all cores (default)")
    add("--out", default="hpccd-bench", metavar="DIR", help="folder of the JSON file (default: %(default)s)")
    add("--label", default=f"{output.cores()}-cores", metavar="NAME", help="end of its name (default: %(default)s)")


def tier_option(parser, default: str = "balanced") -> None:
    parser.add_argument("--accuracy", default=default, choices=ACCURACIES, help="tier (default: %(default)s)")


def listed(option: str, text: str, choices: Sequence[str]) -> list[str]:
    """Words with commas between, each one of `choices`."""
    words = [word.strip() for word in text.split(",") if word.strip()]
    for word in words:
        if word not in choices:
            raise UserError(f"{option} {text}: {word!r} is not known; choose from {', '.join(choices)}")
    if not words:
        raise UserError(f"{option}: name at least one of {', '.join(choices)}")
    return words


def usable(name: str, text: str, choices: Sequence[str], **others) -> tuple[list[str], dict[str, str]]:
    """The values of --NAME that work here, and why the others do not; UserError if none does."""
    found, rejected = measure.usable(name, listed(f"--{name}", text, choices), **others)
    if not found:
        raise UserError(f"--{name} {text}: none of these works here; see `hpccd info`")
    return found, rejected


def begin(args, resolve: Callable = sources.resolve) -> tuple[Report, list[sources.Source]]:
    """The report to fill and the selected sources; UserError for wrong options, before anything is timed."""
    if not 1 <= args.repeat <= MOST_ROUNDS:
        raise UserError(f"--repeat {args.repeat}: time from 1 to {MOST_ROUNDS:,} rounds")
    for name in ("steps", "threads"):
        if getattr(args, name) < 0:
            raise UserError(f"--{name} {getattr(args, name)}: must not be negative")
    if args.threads > MOST_THREADS:
        raise UserError(f"--threads {args.threads}: a detector takes at most {MOST_THREADS}; name fewer")
    if not args.label or not args.label.isprintable():
        raise UserError(f"--label {args.label!r}: ends the name of a file; write it with printable characters")
    if Path(args.label).name != args.label:
        raise UserError(f"--label {args.label}: ends the name of a file; write it without folders")
    try:
        Path(args.out).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"--out {args.out}: no folder can be made there ({error.strerror}); name another") from error
    require_writable("--out", Path(args.out) / f"{args.benchmark}-{args.label}.json")
    found = resolve(args.sources, sources.data_folder(args.data), args.default_sources, args.size)
    for source in found:
        if all(source.step(k) is None for k in source.spread(args.steps)):
            raise UserError(f"{source.name}: none of its measured steps keeps its topology; take more with --steps")
    options = {k: v for k, v in vars(args).items() if k not in PLACES and isinstance(v, (int, float, str, type(None)))}
    words = ["hpccd bench", args.benchmark, *(Path(source).name for source in args.sources)]
    for name, value in options.items():
        if value != args.parser.get_default(name):
            words += [f"--{name.replace('_', '-')}", shlex.quote(str(value))]
    report = Report(args.benchmark, " ".join(words), {**options, "sources": [source.name for source in found]})
    if args.repeat < FEWEST_ROUNDS:
        rounds = counted(args.repeat, "timed round")
        report.note(f"only {rounds}: take --repeat {FEWEST_ROUNDS} or more for numbers to rely on")
    return report, found


def measured(args) -> int:
    """Run the benchmark, and write its result; the exit status."""
    try:
        return args.run_benchmark(args).end(Path(args.out), args.label)
    except MemoryError as error:
        why = f"does not fit into memory{f' ({error})' if str(error) else ''}"
        raise UserError(f"{args.benchmark}: {why}; measure something smaller") from error


def require_writable(option: str, path: Path) -> None:
    """Called before anything is measured, so that no result is lost."""
    target = Path(os.path.realpath(path))  # a link that leads nowhere yet stays
    try:
        new = not target.exists()
        with target.open("a"):
            pass
        if new:
            target.unlink()
    except OSError as error:
        raise UserError(f"{option}: {path} cannot be written ({error.strerror}); name another") from error


def skipped(report: Report, what: str, rejected: dict[str, str]) -> None:
    for value, why in rejected.items():
        report.note(f"{what} {value} skipped: {why}")
