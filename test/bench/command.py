# SPDX-License-Identifier: Apache-2.0
"""Options that all benchmarks share, and how each begins and ends."""

from __future__ import annotations

import argparse
import os
import shlex
from collections.abc import Sequence
from pathlib import Path

from hpccd_core.options import ACCURACIES
from hpccd_ros.base.errors import UserError
from hpccd_ros.bench import sources
from hpccd_ros.bench.report import Report, cores
from hpccd_ros.bench.sources import Source

MOST_THREADS = 1024  # of a detector
FEWEST_ROUNDS = 5  # below that a median means little, and the result says so


# What says where files lie is not kept: paths of this machine do not belong into a result.
PLACES = ("out", "data", "label")


def configure(
    parser: argparse.ArgumentParser, *, default: Sequence[str], steps: int | None, rounds: int = 5, size: bool = True
) -> None:
    """Sources (by default `default`), their size, steps, rounds, and where the results go.

    steps: None where one step of each source is measured; size: False where the benchmark chooses the sizes.
    """
    what = parser.add_argument_group("what is measured")
    what.add_argument(
        "sources",
        nargs="*",
        metavar="SCENE",
        help="a generated scene (`hpccd scene --list`), the name of a file in HPCCD_DATA, `data` for all of these, or "
        f"the path of an .npz or .mcap file (default: {' '.join(default)})",
    )
    what.add_argument("--data", metavar="DIR", help="folder of scene files (default: the variable HPCCD_DATA)")
    if size:
        what.add_argument(
            "--size",
            type=float,
            default=1.0,
            metavar="X",
            help="factor on the triangles of generated scenes (default: %(default)s)",
        )
    if steps is not None:
        what.add_argument(
            "--steps",
            type=int,
            default=steps,
            metavar="N",
            help="steps measured of each scene, evenly spread; 0: all (default: %(default)s)",
        )
    repeat_option(what, rounds)
    output_options(parser)
    parser.set_defaults(default_sources=tuple(default))


def repeat_option(parser, rounds: int, part: str = "") -> None:
    """part: what of the benchmark is repeated, where it is not all of it."""
    text = f"{part and f'of {part}: '}timed rounds after one of warm-up (default: %(default)s)"
    parser.add_argument("--repeat", type=int, default=rounds, metavar="N", help=text)


def output_options(parser: argparse.ArgumentParser) -> None:
    """Where the results go, and under which name."""
    out = parser.add_argument_group("what is written")
    out.add_argument("--out", default="hpccd-bench", metavar="DIR", help="JSON (default: %(default)s)")
    out.add_argument(
        "--label",
        default=f"{cores()}-cores",
        metavar="NAME",
        help="end of the files' names, one for each machine (default: %(default)s)",
    )


def threads_option(parser) -> None:
    parser.add_argument("--threads", type=int, default=0, metavar="N", help="0: all cores (default)")


def tier_option(parser, default="balanced") -> None:
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


def numbers(option: str, text: str, kind: type) -> list:
    """Numbers above 0 with commas between, by rising size, each once."""
    try:
        found = sorted({kind(word) for word in text.split(",")})
    except ValueError as error:
        raise UserError(f"{option} {text}: numbers with commas between, for example 1,4") from error
    if found[0] <= 0:
        raise UserError(f"{option} {text}: each number must be above 0")
    return found


def begin(args) -> tuple[Report, list[Source]]:
    """The report to fill and the sources that were asked for."""
    found = sources.resolve(args.sources, sources.data_folder(args.data), args.default_sources, args.size)
    return begin_report(args, [source.name for source in found]), found


def begin_report(args, names: Sequence[str] = ()) -> Report:
    """The report to fill, of sources with these names."""
    if getattr(args, "repeat", 1) < 1:
        raise UserError(f"--repeat {args.repeat}: at least one round must be timed")
    for name in ("steps", "threads"):
        if getattr(args, name, 0) < 0:
            raise UserError(f"--{name} {getattr(args, name)}: must not be negative")
    for count in (getattr(args, "threads", 0), *_numbers_in(getattr(args, "threads_list", None))):
        if count > MOST_THREADS:
            raise UserError(f"{count} threads: a detector takes at most {MOST_THREADS}; name fewer")
    _require_writable(args)
    options = {
        k: v
        for k, v in vars(args).items()
        if k not in ("command", "benchmark", *PLACES) and isinstance(v, (int, float, str, type(None)))
    }
    report = Report(args.benchmark, _command(args, options), {**options, "sources": list(names)})
    if getattr(args, "repeat", FEWEST_ROUNDS) < FEWEST_ROUNDS:
        report.note(f"only {args.repeat} timed rounds: take --repeat {FEWEST_ROUNDS} or more for numbers to rely on")
    return report


def _numbers_in(text: str | None) -> list[int]:
    return [int(word) for word in text.split(",") if word.strip().isdecimal()] if text else []


def _require_writable(args) -> None:
    """Before anything is measured: what cannot be written would be lost."""
    if Path(args.label).name != args.label:
        raise UserError(f"--label {args.label}: ends the names of files; write it without folders")
    for option, folder in (("--out", args.out),):
        try:
            Path(folder).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            why = f"no folder can be made there ({error.strerror})"
            raise UserError(f"{option} {folder}: {why}; name another") from error
        if not os.access(folder, os.W_OK):
            raise UserError(f"{option} {folder}: must not be written; name another folder")


def _command(args, options: dict) -> str:
    """The command line that measures this again: sources by name, and options that are not the default."""
    words = ["python -m bench", args.benchmark, *(Path(source).name for source in getattr(args, "sources", ()))]
    for name, value in options.items():
        if value != args.parser.get_default(name):
            words += [f"--{name.replace('_', '-')}", shlex.quote(str(value))]
    return " ".join(words)


def end(args, report: Report) -> int:
    """Write and name the file. Exit status 1 where a check failed."""
    return report.end(Path(args.out), args.label)


def skipped(report: Report, what: str, refused: dict[str, str]) -> None:
    """Say what could not be measured, and why."""
    for value, why in refused.items():
        report.note(f"{what} {value} skipped: {why}")
