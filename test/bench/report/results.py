# SPDX-License-Identifier: Apache-2.0
"""Results of benchmarks that were written earlier: rows, machine and command."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterable
from pathlib import Path

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
