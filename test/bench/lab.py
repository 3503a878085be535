# SPDX-License-Identifier: Apache-2.0
"""Shared by all subjects: options, comparison of variants on the same steps, and tables whose columns are data."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from hpccd_ros.base.errors import UserError
from hpccd_ros.bench import command, measure, sources
from hpccd_ros.bench.command import listed, skipped, tier_option
from hpccd_ros.bench.measure import BACKENDS, bar, times, usable
from hpccd_ros.bench.report import Columns, Report, cells, cores, show

__all__ = ["BACKENDS", "Report", "UserError", "bar", "begin", "cores", "listed", "skipped", "tier_option", "times"]
__all__ += ["usable", "Columns", "cells", "show"]


def configure(
    parser: argparse.ArgumentParser,
    default: Sequence[str] = (),
    steps: int | None = None,
    rounds: int = 5,
    leave_out=(),
) -> None:
    """steps: None where the subject does not use --steps. leave_out: further options that it does not use."""
    unused = {*leave_out, *(["steps"] if steps is None else [])}
    command.configure(parser, default, steps or 0, rounds, unused)


def begin(args) -> tuple[Report, list[sources.Source]]:
    """The report to fill and the selected sources; UserError for wrong options, before anything is timed."""
    for name, value in vars(args).items():
        if isinstance(value, (int, float)) and not 0 <= value < float("inf"):
            raise UserError(f"--{name.replace('_', '-')} {value}: must be a finite number, not below 0")
    result, found = command.begin(args, _resolve)
    result.command = result.command.replace("hpccd bench", "python -m bench", 1)
    return result, found


def _resolve(words, data, default, size) -> list[sources.Source]:
    """Also the scenes that the solver of examples/cloth_on_ball makes. None where the subject makes its own."""
    import solved_cloth

    if not default and words:
        raise UserError(f"{words[0]}: this subject makes its own scenes; leave the name out")
    if not default or not set(words) & solved_cloth.FRAMES.keys():
        return sources.resolve(words, data, default, size) if default else []
    solved = [sources.of_scene(word, size, solved_cloth.make) for word in words if word in solved_cloth.FRAMES]
    others = [word for word in words if word not in solved_cloth.FRAMES]
    return solved + (sources.resolve(others, data, (), size) if others else [])


def backend_options(parser) -> None:
    add = parser.add_argument
    add("--backend", default="cpu", choices=BACKENDS, help="default: %(default)s")
    add("--arrays", choices=("host", "device"), default="host", help="where the positions lie (default: %(default)s)")
    add("--peer", choices=("ipctk",), help="ask this peer the same of the same steps, in turn")


def numbers(option: str, text: str, kind: type) -> list:
    """Numbers above 0 with commas between, by rising size, each once."""
    try:
        found = sorted({kind(word) for word in text.split(",")})
    except ValueError as error:
        raise UserError(f"{option} {text}: numbers with commas between, for example 1,4") from error
    if not all(0 < value < float("inf") for value in found):
        raise UserError(f"{option} {text}: each number must be above 0 and finite")
    return found


def thread_counts(text: str | None, default: Iterable[int]) -> list[int]:
    """The numbers of threads of --threads-list."""
    found = numbers("--threads-list", text, int) if text else sorted(set(default))
    if found[-1] > command.MOST_THREADS:
        raise UserError(f"--threads-list {text}: a detector takes at most {command.MOST_THREADS}; name fewer")
    return found


def require_backend(args, **others) -> None:
    """UserError if --backend does not work here, or does not support --arrays device."""
    if getattr(args, "arrays", "host") == "device" and (args.backend != "gpu" or getattr(args, "peer", None)):
        raise UserError("--arrays device: needs --backend gpu, and no --peer: only a device reads them there")
    _, rejected = usable("backend", [args.backend], **others)
    if rejected:
        raise UserError(f"--backend {args.backend}: {rejected[args.backend]}")


def compare(
    result: Report, args, source, runners: Sequence, base: str, asked: dict[str, dict], check: bool = True
) -> list[dict]:
    """Rows of all runners on the same steps, in turn, with their time over that of the runner `base`.

    asked: by the runner's name, what its row says beside the times. check: all must find the same contacts, where they
    list them.
    """
    result.note(measure.NOTE)
    series = measure.measure(source, runners, args.repeat, args.steps)
    if check:
        listing = {name: one for name, one in series.items() if one.contacts() is not None}
        for text in measure.disagreements(listing):
            result.failure(f"{source.name}: contacts differ: {text}")
    first, step = series[base].times(), source.step(next(iter(series[base].by_step)))
    rows = []
    for name, one in series.items():
        row = {"scene": source.name, "triangles": step.triangles, **one.row(), **asked.get(name, {})}
        row |= {"over_base": row["step_ms"] / first["step_ms"], "least_over_base": row["least_ms"] / first["least_ms"]}
        rows.append(result.add(**row))
    return rows


def whole(key: str) -> Callable[[dict], int | None]:
    """A column of counts that are averages over steps."""
    return lambda row: None if row.get(key) is None else round(row[key])


def slope(x: Sequence[float], y: Sequence[float]) -> float:
    """Exponent p of the power law y ~ x^p that fits best: the least-squares slope of log y over log x."""
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])


def in_turn(
    what: str, ways: dict[str, Callable], rounds: int, clock: Callable[[], float] = time.perf_counter
) -> tuple[dict[str, list[float]], dict]:
    """ms of each call by way, all ways in turn in each round after one of warm-up; and their last results."""
    ms, found = {way: [] for way in ways}, {}
    with bar(what, (rounds + 1) * len(ways)) as done:
        for turn in range(rounds + 1):
            for way, ask in ways.items():
                began = clock()
                found[way] = ask()
                if turn:
                    ms[way].append(1e3 * (clock() - began))
                done()
    return ms, found
