# SPDX-License-Identifier: Apache-2.0
"""Tables in Markdown, and where their numbers come from."""

from __future__ import annotations

from collections.abc import Sequence

from bench.report.results import Kept, whole_scene
from hpccd_ros.bench.report import text

RESULTS = "../test/bench/results"  # from docs/


def table(columns: Sequence[str], rows: Sequence[Sequence]) -> list[str]:
    """The lines of a table; a column with a number in its first row stands to the right. None: an empty cell."""
    numbers = [bool(rows) and not isinstance(cell, str) for cell in rows[0]]
    lines = [columns, ["---:" if number else "---" for number in numbers]]
    lines += [["" if cell is None else shown(cell) for cell in row] for row in rows]
    return [f"| {' | '.join(line)} |" for line in lines]


def source(name: str, result: Kept) -> str:
    """Command, machine and commit of the result with this file name."""
    machine = result.machine
    gpus = ", ".join(f"{machine['gpus'].count(gpu)} x {gpu}" for gpu in dict.fromkeys(machine["gpus"]))
    where = f"{machine['processor']}, {machine['cores']} cores{', ' if gpus else ''}{gpus}"
    others = result.other_processes_share
    busy = f" of which other processes took {100 * others:.0f} %" if others > 0.05 else ""
    commit = f"commit {machine['commit'][:7]}, {machine['date'].split()[0]}"
    return f"`{command(result)}`; {where}{busy}; {commit}; [JSON]({RESULTS}/{name}.json)"


def command(result: Kept) -> str:
    """The command line that measures the result again: it was kept when all subjects were part of `hpccd bench`."""
    whole_scenes = any(whole_scene(row) for row in result.rows if result.benchmark == "accuracy")
    words = result.command.replace(" --parts scenes", "")
    return words if whole_scenes else words.replace("hpccd bench", "python -m bench", 1)


def shown(cell) -> str:
    """As tables show it."""
    small = isinstance(cell, float) and 1e-4 <= abs(cell) < 0.01
    return f"{cell:.2g}" if small else text(cell)
