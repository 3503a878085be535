# SPDX-License-Identifier: Apache-2.0
"""Mutation testing: faults in the product that a test should find, one at a time.

    PYTHONPATH=test .venv/bin/python -m mutation cpp build/mutants-cpp          write and build the mutants of the core
    PYTHONPATH=test .venv/bin/python -m mutation python build/mutants-python    write those of hpccd_ros
    PYTHONPATH=test .venv/bin/python -m mutation run build/mutants-cpp --jobs 2

`run` gives each mutant to the tests of its area, stage by stage, until one fails. It writes results.json into the
folder, goes on where it was interrupted, and lists the survivors: each needs a test, or a reason why no result can
change.
"""

import argparse
import concurrent.futures
import importlib
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from .mutants import ROOT

LIMITS = {"C++": 600, "Python": 1500}  # s: a mutant that runs longer hangs, which counts as found


def tests(folder: Path, stage: str, number: int, jobs: int) -> str | None:
    """Return what found the mutant, or None."""
    environment = {**os.environ, "HPCCD_MUTANT": str(number), "PYTHONPATH": str(folder)}
    if stage == "C++":
        command = [str(folder / "build" / "hpccd_core_tests"), "--gtest_fail_fast", "--gtest_brief=1"]
    else:
        command = [str(Path(sys.executable).parent / "pytest"), "-q", "-x", "-p", "no:cacheprovider", *stage.split()]
        if jobs == 1:
            command += ["--numprocesses", str(len(os.sched_getaffinity(0)) + 1)]
    limit = LIMITS["C++" if stage == "C++" else "Python"]
    with tempfile.TemporaryFile("w+") as output:
        try:
            done = subprocess.run(command, cwd=ROOT, env=environment, stdout=output, stderr=output, timeout=limit)
        except subprocess.TimeoutExpired:
            return f"{stage}: longer than {limit} s"
        if done.returncode == 0:
            return None
        output.seek(0)
        failed = [line for line in output if "FAILED" in line]
        return failed[0].strip() if failed else f"{stage}: exit status {done.returncode}"


def run(folder: Path, jobs: int) -> None:
    """Try all mutants, several at a time."""
    mutants = json.loads((folder / "mutants.json").read_text())
    kept = folder / "results.json"
    results = json.loads(kept.read_text()) if kept.exists() else {}
    areas = importlib.import_module(".cpp" if (folder / "build").exists() else ".python", __package__).AREAS
    for stage in dict.fromkeys(stage for area in areas.values() for stage in area.stages):
        if found := tests(folder, stage, 0, jobs):
            raise SystemExit(f"without a mutant: {found}; the tests must pass first")

    def of(mutant: dict) -> tuple[dict, str | None, float]:
        start = time.monotonic()
        for stage in areas[mutant["area"]].stages:
            if found := tests(folder, stage, mutant["number"], jobs):
                return mutant, found, time.monotonic() - start
        return mutant, None, time.monotonic() - start

    left = [m for m in mutants if str(m["number"]) not in results]
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        for mutant, found, seconds in pool.map(of, left):
            results[str(mutant["number"])] = found
            kept.write_text(json.dumps(results, indent=1))
            print(f"{mutant['number']}: {found or 'SURVIVED'} ({seconds:.0f} s)", flush=True)
    survivors = [m for m in mutants if not results[str(m["number"])]]
    print(f"{len(mutants)} mutants, {len(survivors)} survived:")
    for m in survivors:
        print(f"  {m['number']} {m['file']}:{m['line']}: {m['change']}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["cpp", "python", "run"])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1, help="mutants at a time")
    options = parser.parse_args()
    folder = options.folder.resolve()
    if options.what == "run":
        run(folder, options.jobs)
    else:
        importlib.import_module(f".{options.what}", __package__).prepare(folder, options.seed)


if __name__ == "__main__":
    main()
