# SPDX-License-Identifier: Apache-2.0
"""What a benchmark leaves behind: its rows, the machine and the command, as JSON.

A row holds what tables and pictures are made from: medians and percentiles, stages, counts. Single times are not kept.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Iterable
from pathlib import Path

from bench.report import machine
from hpccd_ros.base.errors import UserError


@dataclasses.dataclass(frozen=True)
class Kept:
    """A result that was written earlier, for pictures and tables."""

    benchmark: str
    command: str
    machine: dict
    other_processes_share: float  # of all cores, while it was measured
    rows: list[dict]

    @classmethod
    def read(cls, path: Path, benchmark: str) -> Kept:
        """Raises UserError where the file is not a result of this benchmark."""
        try:
            whole = json.loads(path.read_text(encoding="utf-8"))
            if whole["benchmark"] != benchmark:
                raise UserError(f"{path}: results of `hpccd bench {whole['benchmark']}`, not of {benchmark}")
            return cls(**{field.name: whole[field.name] for field in dataclasses.fields(cls)})
        except (OSError, ValueError, KeyError, TypeError) as e:
            raise UserError(f"{path}: not a JSON file that `hpccd bench {benchmark}` wrote ({e})") from e


def by(rows: Iterable[dict], *keys: str) -> list[list[dict]]:
    """Rows in groups of equal values of `keys`, in the order in which these first appear."""
    groups: dict[tuple, list[dict]] = {}
    for row in rows:
        groups.setdefault(tuple(row[key] for key in keys), []).append(row)
    return list(groups.values())


def whole_scene(row: dict) -> bool:
    """Of `hpccd bench accuracy`: about a whole scene that was asked for all contacts."""
    return row["part"] == "scene" and row.get("asked", "all") == "all"


class Report:
    """Rows of one benchmark with the command, the machine, the commit and the notes that belong to them."""

    def __init__(self, benchmark: str, command: str, arguments: dict):
        self.benchmark = benchmark
        self.command = command
        self.arguments = arguments
        self.machine = machine.describe()
        self.notes: list[str] = []
        self.failures: list[str] = []
        self.rows: list[dict] = []
        self._load = machine.Load()
        self.others = 0.0

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

    def finish(self) -> None:
        self.others = round(self._load.of_others(), 3)
        if self.others > 0.05:
            self.note(f"other processes used {100 * self.others:.0f} % of the cores meanwhile: times are too long")

    def write(self, folder: Path, label: str) -> list[Path]:
        """FOLDER/BENCHMARK-LABEL.json; that of an earlier run is replaced."""
        folder.mkdir(parents=True, exist_ok=True)
        stem = folder / f"{self.benchmark}-{label}"
        whole = {
            "benchmark": self.benchmark,
            "command": self.command,
            "machine": self.machine,
            "arguments": self.arguments,
            "other_processes_share": self.others,
            "notes": self.notes,
            "failures": self.failures,
            "rows": self.rows,
        }
        path = stem.with_name(stem.name + ".json")
        path.write_text(as_text(whole), encoding="utf-8")
        return [path]


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
