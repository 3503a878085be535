#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Check that the includes of the C++ core run one way: each folder includes only itself and folders before it.

usage: check_includes.py [FOLDER]    (default: hpccd_core/src)

Prints each violation as file:line, with the order, and exits 1 if there is one.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

# The direction of the data. Files outside the folders (detector.cpp, bindings.cpp) come last.
FOLDERS = ["base", "rigid", "scene", "bvh", "detail", "elementary", "traverse", "contacts", "solid", "paper"]
FOLDERS += ["gpu", "hybrid", "backends"]
TOP = "the files beside the folders"
ORDER = [*FOLDERS, TOP]
PUBLIC = "hpccd"  # include/hpccd: the public interface, for all

SUFFIXES = {".h", ".cpp", ".inl", ".cu", ".cuh"}
INCLUDE = re.compile(r'\s*#\s*include\s*"([^"]+)"')


def folder_of(path: Path) -> str:
    return path.parts[0] if len(path.parts) > 1 else TOP


def problems(source: Path) -> list[str]:
    """Every include below `source` against the order, and every folder that the order lacks."""
    found = []
    for file in sorted(f for f in source.rglob("*") if f.suffix in SUFFIXES):
        folder = folder_of(file.relative_to(source))
        if folder not in ORDER:
            found.append(f"{file}: the folder {folder}/ has no place in the order: add it to FOLDERS of {__file__}")
            continue
        for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), start=1):
            match = INCLUDE.match(line)
            if not match:
                continue
            target = folder_of(Path(match[1]))
            if target == PUBLIC:
                continue
            if target not in ORDER:
                found.append(f'{file}:{number}: includes "{match[1]}", which is in none of the folders')
            elif ORDER.index(target) > ORDER.index(folder):
                found.append(
                    f'{file}:{number}: {folder} -> {target}: includes "{match[1]}", but {target} comes after {folder}; '
                    f"move what is needed into {folder} or before it"
                )
    return found


def main(arguments: list[str]) -> int:
    source = Path(arguments[0] if arguments else Path(__file__).parent.parent / "hpccd_core" / "src")
    if not source.is_dir():
        print(f"check_includes: there is no folder {source}", file=sys.stderr)
        return 2
    found = problems(source)
    for problem in found:
        print(problem)
    if found:
        print(f"{len(found)} wrong; includes go from right to left in: {' '.join(FOLDERS)}, then {TOP}")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
