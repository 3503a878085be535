# SPDX-License-Identifier: Apache-2.0
"""Command line: run targets one after the other, and print inputs, rate, edges and faults of each.

python -m fuzz_bytes robots.urdf --runs 1000000
python -m fuzz_bytes recordings --seconds 600        all targets of a module
python -m fuzz_bytes --minimise                      store the inputs in the repository that cover most
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from . import targets
from .minimise import store
from .target import Target

# MB of memory of the process, which needs 65 to 155 by itself. A chunk of a recording may unpack to 1,000.
MOST_MEMORY = 2500
# Restarts after inputs that end the process: by a time limit, by memory, or by a crash of native code.
MOST_RESTARTS = 20


@dataclass
class Outcome:
    """``seconds``: elapsed. ``edges``: of the instrumented Python code. ``memory``: largest, MB."""

    inputs: int = 0
    seconds: float = 0.0
    edges: int = 0
    memory: int = 0
    restarts: int = 0


def main(arguments: list[str] | None = None) -> int:
    a = _parser().parse_args(arguments)
    known = targets.everything()
    wanted = [name for name in known if not a.targets or name in a.targets or name.partition(".")[0] in a.targets]
    if unknown := [
        word for word in a.targets if not any(name == word or name.startswith(f"{word}.") for name in known)
    ]:
        sys.exit(f"fuzz_bytes: there is no target {unknown[0]}; use {', '.join(known)}")
    bad = False
    for name in wanted:
        folder = a.work / name
        faults = folder / "faults"
        faults.mkdir(parents=True, exist_ok=True)
        if a.minimise:
            kept = store(name, known[name], [*(folder / "inputs").glob("*"), *targets.stored(name)], faults)
            print(f"{name}: {len(kept)} inputs, {sum(map(len, kept)):,} bytes")
            continue
        outcome = _run(name, known[name], folder, a.runs, a.seconds)
        found = sorted(path.name for path in faults.iterdir() if path.suffix != ".txt")
        bad = bad or bool(found)
        print(
            f"{name:18} {outcome.inputs:9,} inputs in {outcome.seconds:6.0f} s, "
            f"{outcome.inputs / max(outcome.seconds, 1e-9):6,.0f}/s, {outcome.edges:5} edges, {outcome.memory:5} MB, "
            f"{outcome.restarts} restarts, {len(found)} faults{': ' if found else ''}{', '.join(found)}",
            flush=True,
        )
    return 1 if bad else 0


def _run(name: str, target: Target, folder: Path, runs: int, seconds: float) -> Outcome:
    inputs = folder / "inputs"
    inputs.mkdir(exist_ok=True)
    for number, seed in enumerate(target.seeds()):
        (inputs / f"seed-{number}").write_bytes(seed)
    stored = targets.CORPUS / name
    words = folder / "words"
    words.write_text("".join(f'"{"".join(f"{chr(92)}x{byte:02x}" for byte in word)}"\n' for word in target.words))
    outcome, begin = Outcome(), time.monotonic()
    while outcome.restarts <= MOST_RESTARTS:
        limits = [f"-runs={runs - outcome.inputs}"] if runs else []
        if seconds:
            limits.append(f"-max_total_time={max(1, round(seconds - (time.monotonic() - begin)))}")
        command = [
            *(sys.executable, "-m", "fuzz_bytes.guided", name, str(folder / "faults"), *limits),
            *(f"-max_len={target.largest}", f"-timeout={target.seconds}", f"-rss_limit_mb={MOST_MEMORY}"),
            *(
                f"-artifact_prefix={folder / 'faults'}/",
                *([f"-dict={words}"] if target.words else []),
                "-len_control=0",
                "-print_final_stats=1",
            ),
            str(inputs),
            *([str(stored)] if stored.is_dir() else []),
        ]
        log = folder / "log"
        with log.open("w") as stream:
            ended = subprocess.run(command, stdout=stream, stderr=stream, preexec_fn=lambda: os.nice(10)).returncode
        text = log.read_text(errors="replace")
        outcome.inputs += _last(r"^(?:stat::number_of_executed_units: |#)(\d+)", text)
        outcome.edges = max(outcome.edges, _last(r" cov: (\d+)", text))
        outcome.memory = max(outcome.memory, _last(r"(?:peak_rss_mb: |rss: )\s*(\d+)", text))
        if ended == 0:
            break
        outcome.restarts += 1
        print(f"{name}: ended with {ended}: {' / '.join(text.splitlines()[-3:])[:300]}", flush=True)
        if seconds and time.monotonic() - begin >= seconds or runs and outcome.inputs >= runs:
            break
    outcome.seconds = time.monotonic() - begin
    return outcome


def _last(pattern: str, text: str) -> int:
    found = re.findall(pattern, text, re.MULTILINE)
    return int(found[-1]) if found else 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="make fuzz-bytes", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("targets", nargs="*", metavar="TARGET", help="MODULE or MODULE.TARGET (default: all)")
    parser.add_argument("--runs", type=int, default=0, metavar="N", help="inputs for each target")
    parser.add_argument("--seconds", type=float, default=0.0, metavar="S", help="for each target")
    parser.add_argument(
        "--work", type=Path, default=Path("build/fuzz-bytes"), metavar="FOLDER", help="inputs and faults"
    )
    parser.add_argument("--minimise", action="store_true", help="choose the inputs that are stored, instead of running")
    return parser


if __name__ == "__main__":
    sys.exit(main())
