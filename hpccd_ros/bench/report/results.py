# SPDX-License-Identifier: Apache-2.0
"""What a benchmark leaves behind: its rows, the machine and the command, as JSON and (flat, for a spreadsheet) as CSV.

A row holds what tables and pictures are made from: medians and percentiles, stages, counts. Single times are not kept.
"""

from __future__ import annotations

import csv
import dataclasses
import json
import math
from pathlib import Path

from hpccd_ros.base.errors import UserError
from hpccd_ros.bench.report import machine


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
        """FOLDER/BENCHMARK-LABEL.json and .csv; those of an earlier run are replaced."""
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
        as_json, as_csv = stem.with_name(stem.name + ".json"), stem.with_name(stem.name + ".csv")
        as_json.write_text(as_text(whole), encoding="utf-8")
        flat = [
            _flat({"commit": self.machine["commit"], "processor": self.machine["processor"], **r}) for r in self.rows
        ]
        columns = list(dict.fromkeys(key for row in flat for key in row))
        with open(as_csv, "w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, columns)
            writer.writeheader()
            writer.writerows(flat)
        return [as_json, as_csv]


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


def _flat(row, prefix=""):
    flat = {}
    for key, value in row.items():
        if isinstance(value, dict):
            flat |= _flat(value, f"{prefix}{key}.")
        else:
            flat[prefix + key] = value
    return flat


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
