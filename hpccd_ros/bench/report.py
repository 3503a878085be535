# SPDX-License-Identifier: Apache-2.0
"""The result of a benchmark: rows, command and machine, as a JSON file and as tables on standard output."""

from __future__ import annotations

import json
import math
import os
import platform
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

import hpccd_core as hc
from hpccd_core.whole_file import whole_file
from hpccd_ros.base.errors import UserError
from hpccd_ros.base.version import package_version

# Head of a column -> key of a row, or a function of the row.
Columns = dict[str, str | Callable[[dict], object]]


class Report:
    """Rows of one benchmark with its command, machine, commit and notes. Single times are not kept."""

    def __init__(self, benchmark: str, command: str, arguments: dict):
        self.benchmark, self.command, self.arguments = benchmark, command, arguments
        self.machine = describe()
        self.notes: list[str] = []
        self.failures: list[str] = []
        self.rows: list[dict] = []
        self._ticks = _ticks()

    def add(self, **row) -> dict:
        self.rows.append(row)
        return row

    def note(self, text: str) -> None:
        """Something that a reader of the numbers must know; each once."""
        if text not in self.notes:
            self.notes.append(text)

    def failure(self, text: str) -> None:
        """A check that did not hold: the command ends with exit status 1."""
        self.failures.append(text)

    def end(self, folder: Path, label: str) -> int:
        """Write FOLDER/BENCHMARK-LABEL.json and print notes and failures; the exit status."""
        whole, busy, own = (now - begin for now, begin in zip(_ticks(), self._ticks, strict=True))
        others = round(max(0.0, (busy - own) / whole), 3) if whole else 0.0
        if others > 0.05:
            self.note(f"other processes used {100 * others:.0f} % of the cores meanwhile: times are too long")
        path = folder / f"{self.benchmark}-{label}.json"
        shown = {key: getattr(self, key) for key in ("benchmark", "command", "machine", "arguments")}
        lists = {key: getattr(self, key) for key in ("notes", "failures", "rows")}
        try:
            with whole_file(path, overwrite=True) as draft:
                draft.write_text(as_text({**shown, "other_processes_share": others, **lists}), encoding="utf-8")
        except OSError as error:
            raise UserError(f"--out {path}: cannot be written ({error.strerror})") from error
        for kind, texts in (("note: ", self.notes), ("FAILED: ", self.failures)):
            for text in texts:
                print(kind + text)
        print(f"measured on {short(self.machine)}\nwrote {path}")
        return 1 if self.failures else 0


def as_text(whole: dict) -> str:
    """JSON with a line for each entry and for each row, so that a difference of two results shows row by row."""
    entries = []
    for key, value in _plain(whole).items():
        if isinstance(value, list) and value:
            lines = ",\n".join(f"  {json.dumps(item, allow_nan=False)}" for item in value)
            entries.append(f" {json.dumps(key)}: [\n{lines}\n ]")
        else:
            entries.append(f" {json.dumps(key)}: {json.dumps(value, allow_nan=False)}")
    return "{\n" + ",\n".join(entries) + "\n}\n"


def _plain(value):
    """Only what JSON knows: numpy's numbers as Python's, infinities and NaN as text."""
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if hasattr(value, "item"):
        value = value.item()
    if isinstance(value, float):
        return (round(value, 6) if abs(value) > 1e-3 else value) if math.isfinite(value) else repr(value)
    return value


def cells(columns: Columns, rows: Iterable[dict]) -> list[list]:
    return [[of(row) if callable(of) else row.get(of) for of in columns.values()] for row in rows]


def show(title: str, columns: Columns | Sequence[str], rows: Iterable, caption: str = "") -> None:
    """Print a table; text to the left, numbers to the right; None as a dash."""
    rows = cells(columns, rows) if isinstance(columns, dict) else rows
    table = Table(title=title, caption=caption or None, title_justify="left", caption_justify="left")
    for place, name in enumerate(columns):
        numbers = all(not isinstance(row[place], str) for row in rows)
        table.add_column(name, justify="right" if numbers else "left", overflow="fold")
    for row in rows:
        table.add_row(*map(text, row))
    # In a file or a pipe a table must not be cut at the width of no terminal.
    Console(width=None if sys.stdout.isatty() else 160, markup=False, highlight=False).print(table)


def text(value) -> str:
    """A number with three or more significant digits, counts in full."""
    if value is None:
        return "-"
    if isinstance(value, (str, bool)) or not math.isfinite(value):
        return str(value)
    size = abs(value)
    if float(value).is_integer() and size < 1e15 or size >= 1000:
        return f"{value + 0.0:,.0f}"
    return f"{value:.1f}" if size >= 100 else f"{value:.3g}" if size >= 0.01 else f"{value:.1e}"


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0))


def describe() -> dict:
    """Processor, memory, GPUs, versions and commit; nothing that names a person or a computer."""
    return {
        "processor": _field("/proc/cpuinfo", "model name"),
        "cores": cores(),
        "memory_gib": round(int(_field("/proc/meminfo", "MemTotal").split()[0]) / 2**20, 1),
        "gpus": _output("nvidia-smi", "--query-gpu=name", "--format=csv,noheader").splitlines(),
        "system": f"{platform.system()} {platform.release()}",
        "python": platform.python_version(),
        "numpy": np.__version__,
        "hpccd": package_version(),
        "commit": commit(Path(__file__).resolve().parent),
        "backends": hc.backends(),
        "simd": hc._core.simd_levels(),
        "date": time.strftime("%Y-%m-%d %H:%M UTC", time.gmtime()),
    }


def commit(folder: Path) -> str:
    """Commit of hpccd's checkout around `folder`, "+changes" where its sources differ from it, or "unknown"."""
    top = _output("git", "-C", str(folder), "rev-parse", "--show-toplevel")
    # An environment inside somebody else's repository would name a commit of that.
    if not top or not (Path(top) / "hpccd_core" / "include" / "hpccd").is_dir():
        return "unknown"
    sources = ("--untracked-files=no", "--", "hpccd_core", "hpccd_ros")
    # Without a lock, which an interrupt would leave in the checkout.
    status = _output("git", "-C", top, "--no-optional-locks", "status", "--porcelain", *sources)
    changes = "+changes" if status else ""
    return (_output("git", "-C", top, "rev-parse", "--short=10", "HEAD") or "unknown") + changes


def short(machine: dict) -> str:
    gpus = "".join(f", {gpu}" for gpu in machine["gpus"])
    return f"{machine['processor']}, {machine['cores']} cores{gpus}; commit {machine['commit']}; {machine['date']}"


def _ticks() -> tuple[float, float, float]:
    """Times summed over all cores: all time, busy time, time of this process and its children."""
    ticks = [int(word) for word in Path("/proc/stat").read_text().splitlines()[0].split()[1:9]]
    clock = os.times()
    own = clock.user + clock.system + clock.children_user + clock.children_system
    return sum(ticks), sum(ticks) - ticks[3] - ticks[4], own * os.sysconf("SC_CLK_TCK")


def _field(path, name):
    for line in Path(path).read_text().splitlines():
        key, _, value = line.partition(":")
        if key.strip() == name:
            return value.strip()
    return "unknown"


def _output(*command) -> str:
    try:
        found = subprocess.run(command, capture_output=True, text=True, timeout=60)
    except FileNotFoundError:
        return ""
    return found.stdout.strip() if found.returncode == 0 else ""
