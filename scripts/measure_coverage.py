# SPDX-License-Identifier: Apache-2.0
"""Run all tests and write which lines they ran: build/coverage/index.txt (a table), cpp/index.html, python/index.html.

`make coverage` calls this in an environment whose core counts lines for gcov. CUDA sources are not measured. Failed
tests do not end the measurement: those of full disks fail, because the counts cannot be written there either.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
OUTPUT = ROOT / "build" / "coverage"
BIN = Path(sys.executable).parent

# Files that run on some machines only: listed, and not part of the total.
ELSEWHERE = {
    "hpccd_core/src/backends/gpu_backend.": "with a GPU (make test-gpu)",
    "hpccd_core/src/backends/gpu_contacts.": "with a GPU (make test-gpu)",
    "hpccd_core/src/backends/gpu_distances.": "with a GPU (make test-gpu)",
    "hpccd_core/src/backends/hybrid_backend.": "with a GPU (make test-gpu)",
    "hpccd_core/src/bindings_device.": "with a GPU (make test-gpu), except for arguments that are rejected",
    "hpccd_core/src/base/simd/avx512.h": "with AVX-512",
    "hpccd_core/src/base/simd/neon.h": "on aarch64 (make test-aarch64)",
}


def run_tests(tree: Path, jobs: int, pytest_arguments: list[str]) -> None:
    """Run the C++ and Python tests; their counts are added up beside the object files and in OUTPUT/data."""
    for counts in tree.rglob("*.gcda"):
        counts.unlink()
    shutil.rmtree(OUTPUT, ignore_errors=True)
    (OUTPUT / "data").mkdir(parents=True)
    core = tree / "hpccd_core"
    subprocess.run(["ctest", "--test-dir", core, "--output-on-failure", "--parallel", str(jobs)], cwd=ROOT)
    command = [BIN / "coverage", "run", "-m", "pytest", *pytest_arguments]
    subprocess.run(command, cwd=ROOT, env={**os.environ, "COVERAGE_FILE": str(OUTPUT / "data" / "lines")})


def lines_of_python() -> dict[str, tuple[set[int], set[int]]]:
    """Return for each file the lines that count, and those of them that no test ran."""
    environment = {**os.environ, "COVERAGE_FILE": str(OUTPUT / "data" / "lines")}
    for arguments in (
        ["combine", "--quiet"],
        ["html", "--quiet", "--directory", OUTPUT / "python"],
        ["json", "--quiet", "-o", OUTPUT / "python.json"],
    ):
        subprocess.run([BIN / "coverage", *arguments], cwd=ROOT, env=environment, check=True)
    files = json.loads((OUTPUT / "python.json").read_text())["files"]
    return {
        name: (set(file["executed_lines"]) | set(file["missing_lines"]), set(file["missing_lines"]))
        for name, file in files.items()
    }


def lines_of_cpp(tree: Path) -> dict[str, tuple[set[int], set[int]]]:
    """Return for each file the lines that count, and those of them that no test ran."""
    (OUTPUT / "cpp").mkdir(exist_ok=True)
    command = [BIN / "gcovr", "--root", ROOT, "--object-directory", tree]
    command += ["--filter", "hpccd_core/(src|include)/", "--exclude", "hpccd_core/src/gpu/.*"]
    command += ["--gcov-ignore-parse-errors=all", "--merge-mode-functions=separate"]
    command += ["--html-details", OUTPUT / "cpp" / "index.html", "--json", OUTPUT / "cpp.json", tree]
    subprocess.run(command, cwd=ROOT, check=True)
    found: dict[str, tuple[set[int], set[int]]] = {}
    for file in json.loads((OUTPUT / "cpp.json").read_text())["files"]:
        counts: dict[int, int] = defaultdict(int)  # a line of a template has an entry for each instance
        for line in file["lines"]:
            if not line.get("gcovr/excluded") and not line.get("gcovr/noncode"):
                counts[line["line_number"]] += line["count"]
        found[file["file"]] = (set(counts), {line for line, count in counts.items() if count == 0})
    return found


def ranges(lines: set[int]) -> str:
    """Return {1, 2, 3, 7} as "1-3, 7"."""
    parts: list[list[int]] = []
    for line in sorted(lines):
        if parts and line == parts[-1][1] + 1:
            parts[-1][1] = line
        else:
            parts.append([line, line])
    return ", ".join(str(a) if a == b else f"{a}-{b}" for a, b in parts)


def table(files: dict[str, tuple[set[int], set[int]]]) -> list[str]:
    """Return one row for each folder and their total."""
    folders: dict[str, list[int]] = defaultdict(lambda: [0, 0])
    for name, (lines, missed) in files.items():
        for folder in (str(Path(name).parent), "total"):
            folders[folder][0] += len(lines)
            folders[folder][1] += len(missed)
    return [
        f"{folder:44} {lines:7} {lines - missed:7} {100 * (lines - missed) / max(lines, 1):6.1f} %"
        for folder, (lines, missed) in sorted(folders.items(), key=lambda item: (item[0] == "total", item[0]))
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tree", type=Path, required=True, help="build tree with HPCCD_COVERAGE")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--only-report", action="store_true", help="do not run the tests again")
    parser.add_argument("pytest", nargs="*", help="arguments for pytest")
    options = parser.parse_args()
    tree = options.tree.resolve()
    if not options.only_report:
        run_tests(tree, options.jobs, options.pytest)
    text = []
    for language, files in (("C++", lines_of_cpp(tree)), ("Python", lines_of_python())):
        elsewhere = {name: reason for name in files for part, reason in ELSEWHERE.items() if name.startswith(part)}
        counted = {name: lines for name, lines in files.items() if name not in elsewhere}
        text += [f"{language:44} {'lines':>7} {'run':>7}", *table(counted), ""]
        text += ["lines that no test ran:"]
        text += [f"  {name}: {ranges(missed)}" for name, (_, missed) in sorted(counted.items()) if missed]
        text += [f"  {name}: not counted, runs {reason}" for name, reason in sorted(elsewhere.items())] + [""]
    (OUTPUT / "index.txt").write_text("\n".join(text))
    print("\n".join(text))


if __name__ == "__main__":
    main()
