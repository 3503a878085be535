# SPDX-License-Identifier: Apache-2.0
"""Choose the inputs that the repository stores: few and small ones that cover most, and those of faults."""

import hashlib
import sys
from collections.abc import Iterable
from pathlib import Path

from . import targets
from .target import Target

MOST_INPUTS = 30
MOST_BYTES = 40_000
_COVERED = ("/hpccd_core/", "/hpccd_ros/")


def store(name: str, target: Target, inputs: Iterable[Path], faults: Path) -> list[bytes]:
    """Replace the stored inputs of a target by the best of ``inputs`` and all of ``faults``; returns them."""
    kept = [path.read_bytes() for path in sorted(faults.iterdir()) if path.suffix != ".txt"]
    kept += [path.read_bytes() for path in targets.stored(name) if path.name.startswith("fault-")]
    kept = list(dict.fromkeys(kept))
    n_faults = len(kept)
    covered: set[tuple[str, int, int]] = set()
    for data in [*target.seeds(), *kept]:
        covered |= lines_of(target, data)
    found = {data: lines_of(target, data) for data in {path.read_bytes() for path in inputs}}
    while found and len(kept) < n_faults + MOST_INPUTS:
        best = max(found, key=lambda data: (len(found[data] - covered), -len(data), data))
        new = found.pop(best)
        if not new - covered:
            break
        if sum(map(len, kept)) + len(best) <= MOST_BYTES:
            covered |= new
            kept.append(best)
    folder = targets.CORPUS / name
    folder.mkdir(parents=True, exist_ok=True)
    for old in targets.stored(name):
        old.unlink()
    for number, data in enumerate(kept):
        kind = "fault" if number < n_faults else "input"
        (folder / f"{kind}-{hashlib.sha256(data).hexdigest()[:10]}").write_bytes(data)
    return kept


def lines_of(target: Target, data: bytes) -> set[tuple[str, int, int]]:
    """(file, line, line after it) of all that an input executes in what ships."""
    found: set[tuple[str, int, int]] = set()

    def enter(frame, event, _):
        name = frame.f_code.co_filename
        if not any(part in name for part in _COVERED):
            return None
        before = -frame.f_code.co_firstlineno

        def line(frame, event, _):
            nonlocal before
            if event == "line":
                found.add((name, before, frame.f_lineno))
                before = frame.f_lineno
            return line

        return line

    stdout, sys.stdout = sys.stdout, open("/dev/null", "w")
    sys.settrace(enter)
    try:
        target(data)
    except Exception:
        pass  # a fault: the fuzzer reports it
    finally:
        sys.settrace(None)
        sys.stdout.close()
        sys.stdout = stdout
    return found
