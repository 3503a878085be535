# SPDX-License-Identifier: Apache-2.0
"""Options that all benchmarks share, and how each begins and ends."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from hpccd_ros.base.errors import UserError
from hpccd_ros.bench import sources
from hpccd_ros.bench.report import machine
from hpccd_ros.bench.report.results import Report
from hpccd_ros.bench.steps import Source

FEWEST_ROUNDS = 5  # below that a median means little, and the result says so


def configure(parser: argparse.ArgumentParser, *, default: Sequence[str], steps: int, rounds: int = 5) -> None:
    """Sources (by default `default`), steps, rounds, and where the results go."""
    what = parser.add_argument_group("what is measured")
    what.add_argument(
        "sources", nargs="*", metavar="SCENE",
        help="a generated scene (`hpccd scene --list`), the name of a file in HPCCD_DATA, `data` for all of these, or "
        f"the path of an .npz or .mcap file (default: {' '.join(default)})",
    )  # fmt: skip
    what.add_argument("--data", metavar="DIR", help="folder of scene files (default: the variable HPCCD_DATA)")
    what.add_argument("--size", type=float, default=1.0, metavar="X",
                      help="factor on the triangles of generated scenes (default: %(default)s)")
    what.add_argument("--steps", type=int, default=steps, metavar="N",
                      help="steps measured of each scene, evenly spread; 0: all (default: %(default)s)")
    what.add_argument("--repeat", type=int, default=rounds, metavar="N",
                      help="timed rounds after one of warm-up (default: %(default)s)")
    output_options(parser)
    parser.set_defaults(default_sources=tuple(default))


def output_options(parser: argparse.ArgumentParser) -> None:
    """Where the results go, and under which name."""
    out = parser.add_argument_group("what is written")
    out.add_argument("--out", default="hpccd-bench", metavar="DIR", help="JSON and CSV (default: %(default)s)")
    out.add_argument("--figures", metavar="DIR", help="pictures (default: the folder of --out)")
    out.add_argument("--label", default=f"{machine.cores()}-cores", metavar="NAME",
                     help="end of the files' names, one for each machine (default: %(default)s)")


def threads_option(parser) -> None:
    parser.add_argument("--threads", type=int, default=0, metavar="N", help="0: all cores (default)")


def tier_option(parser, default="balanced") -> None:
    parser.add_argument("--accuracy", default=default, choices=("fast", "balanced", "conservative", "exact"),
                        help="tier (default: %(default)s)")  # fmt: skip


def listed(option: str, text: str, choices: Sequence[str]) -> list[str]:
    """Words with commas between, each one of `choices`."""
    words = [word.strip() for word in text.split(",") if word.strip()]
    for word in words:
        if word not in choices:
            raise UserError(f"{option} {text}: {word!r} is not known; choose from {', '.join(choices)}")
    if not words:
        raise UserError(f"{option}: name at least one of {', '.join(choices)}")
    return words


def begin(args, benchmark: str) -> tuple[Report, list[Source]]:
    """The report to fill and the sources that were asked for."""
    if args.repeat < 1:
        raise UserError(f"--repeat {args.repeat}: at least one round must be timed")
    if args.steps < 0:
        raise UserError(f"--steps {args.steps}: must not be negative")
    if getattr(args, "threads", 0) < 0:
        raise UserError(f"--threads {args.threads}: must not be negative")
    found = sources.resolve(args.sources, sources.data_folder(args.data), args.default_sources, args.size)
    # Paths of this machine do not belong into a result that is kept.
    kept = {k: v for k, v in vars(args).items() if k not in ("command", "benchmark", "out", "figures", "data", "label")
            and isinstance(v, (int, float, str, type(None)))}
    report = Report(benchmark, {**kept, "sources": [source.name for source in found]})
    if args.repeat < FEWEST_ROUNDS:
        report.note(f"only {args.repeat} timed rounds: take --repeat {FEWEST_ROUNDS} or more for numbers to rely on")
    return report, found


def end(args, report: Report, figures: dict | None = None) -> int:
    """Write and name the files; figures: {name: function (report, path)}. Exit status 1 where a check failed."""
    report.finish()
    written = report.write(Path(args.out), args.label)
    folder = Path(args.figures or args.out)
    folder.mkdir(parents=True, exist_ok=True)
    for name, draw in (figures or {}).items():
        path = folder / f"{name}.png"
        draw(report, path)
        written.append(path)
    for note in report.notes:
        print(f"note: {note}")
    for failure in report.failures:
        print(f"FAILED: {failure}")
    print(f"measured on {machine.short(report.machine)}")
    print("wrote " + ", ".join(map(str, written)))
    return 1 if report.failures else 0


def skipped(report: Report, what: str, refused: dict[str, str]) -> None:
    """Say what could not be measured, and why."""
    for value, why in refused.items():
        report.note(f"{what} {value} skipped: {why}")
