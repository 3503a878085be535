# SPDX-License-Identifier: Apache-2.0
"""What mutants of both languages share: each is a change of some bytes of one file, on where its number is chosen."""

import json
import random
import shutil
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]


class Mutant(NamedTuple):
    """`text`, with {n} for its number, replaces the bytes start..end of the file."""

    area: str
    file: str  # relative to the checkout
    line: int
    start: int
    end: int
    text: str
    change: str


class Area(NamedTuple):
    """A part of the product: this many mutants of these files, and the tests of them, fast ones first."""

    count: int
    files: list[str]
    stages: list[str]  # arguments for pytest; "C++": the C++ tests


def choose(areas: dict[str, Area], mutants_of: Callable[[str, str], Iterable[Mutant]], seed: int) -> list[Mutant]:
    """Return mutants at random, no two of which overlap."""
    rng = random.Random(seed)
    chosen: list[Mutant] = []
    for name, area in areas.items():
        candidates = sorted({m for file in area.files for m in mutants_of(name, file)})
        rng.shuffle(candidates)
        taken: list[Mutant] = []
        for m in candidates:
            if len(taken) < area.count and all(m.file != t.file or m.end <= t.start or t.end <= m.start for t in taken):
                taken.append(m)
        print(f"{name}: {len(taken)} of {len(candidates)} mutants")
        chosen += taken
    return chosen


def write(folder: Path, package: str, mutants: dict[int, Mutant]) -> None:
    """Write a copy of the package with all mutants, and their list."""
    built = shutil.ignore_patterns("*.pyc", "_core*.so")
    shutil.copytree(ROOT / package, folder / package, dirs_exist_ok=True, ignore=built)
    for file in {m.file for m in mutants.values()}:
        text = (ROOT / file).read_bytes()
        of_file = [(n, m) for n, m in mutants.items() if m.file == file]
        for n, m in sorted(of_file, key=lambda item: -item[1].start):
            text = text[: m.start] + m.text.replace("{n}", str(n)).encode() + text[m.end :]
        (folder / file).write_bytes(text)
    records = [{"number": n, **m._asdict()} for n, m in mutants.items()]
    (folder / "mutants.json").write_text(json.dumps(records, indent=1))
