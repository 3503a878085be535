# SPDX-License-Identifier: Apache-2.0
"""Every code block of the pages: programs and commands run, and print what the page shows below them."""

import doctest
import importlib.util
import os
import re
import signal
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest
from sources import PAGES, ROOT, SOURCES

import hpccd_core as hc
from hpccd_ros.params import values
from hpccd_ros.params.parameter_file import read_parameters

SHOWN = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
EXTRAS = "cupy|jax|mujoco|newton|polyscope|pxr|pyvista|torch|warp"  # libraries that not every environment has
WARNINGS = r"^(?:Warp CUDA warning: .*|.*WARN\| bad X server connection.*)\n"  # without a GPU, without a display
# Time limit for one page; the longest starts a node and plays a few seconds.
PATIENCE = 240
# rclpy.spin of a user's program sometimes sleeps on after a SIGTERM (5 of 150 tries with eight at once).
AT_THE_END = """
end_jobs() {
    kill $(jobs -p)
    for _ in {1..100}; do [ -z "$(jobs -pr)" ] && return; sleep 0.1; done
    kill -KILL $(jobs -pr)
} 2>/dev/null
trap end_jobs EXIT"""


@dataclass
class Block:
    language: str
    text: str
    before: str  # the line in front of it
    output: str | None  # the ```text block behind it


@dataclass
class Run:
    command: str
    expected: str | None
    file: str = ""  # written before
    text: str = ""


def blocks(page: Path) -> list[Block]:
    found = []
    end = 0
    for match in re.finditer(r"^( *)```(\w+)\n(.*?)^ *```$", page.read_text(), re.DOTALL | re.MULTILINE):
        indent, language, text = match.groups()
        text = re.sub(rf"^{indent}", "", text, flags=re.MULTILINE)
        between = match.string[end : match.start()]
        if language == "text" and found and not between.strip():
            found[-1].output = text
        else:
            found.append(Block(language, text, between.strip().rpartition("\n")[2].strip(), None))
        end = match.end()
    return found


def runs(page: Path) -> list[Run]:
    """The blocks that a reader of the page runs, in order."""
    found = []
    left_out = set()  # programs of the page, by the names under which others import them
    consoles = "".join(block.text for block in blocks(page) if block.language == "console")
    for number, block in enumerate(blocks(page)):
        if block.language == "console":
            for command, output in re.findall(r"^\$ (.*(?:\n> .*)*)\n((?:(?!\$ ).*\n)*)", block.text, re.MULTILINE):
                found.append(Run(command.replace("\n> ", "\n"), output or None))
            continue
        named = re.match(r"(?:#|//|<!--) (\w+\.\w+)(?: -->)?\n", block.text)
        file = named.group(1) if named else f"block_{number}.py"
        imported = set(re.findall(r"^(?:from|import) (\w+)", block.text, re.MULTILINE))
        can_run = block.language == "python" and usable(block.text) and not imported & left_out
        if block.language == "python" and not can_run:
            left_out.add(Path(file).stem)
        if can_run and f"python {file}" not in consoles:
            found.append(Run(f"python {file}", block.output, file, block.text))
        elif named:
            found.append(Run("", None, file, block.text))
    return found


def usable(program: str) -> bool:
    """Not: programs of a node's clients, which test/client runs beside one; of a GPU and libraries that are absent."""
    if 'results="device"' in program and "gpu" not in hc.backends():
        return False
    if not all(map(importlib.util.find_spec, re.findall(rf"^(?:from|import) ({EXTRAS})\b", program, re.MULTILINE))):
        return False
    return "client.prepare_environment()" not in program or program.startswith("# ")


each_page = pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))


@each_page
def test_programs_and_commands(page, tmp_path):
    wanted = runs(page)
    if not wanted:
        pytest.skip("nothing to run on this page")
    for entry in ROOT.iterdir():
        if not entry.name.startswith(".") and entry.name != "build":
            (tmp_path / entry.name).symlink_to(entry)
    for run, (status, printed) in zip(wanted, session(wanted, tmp_path), strict=True):
        printed = re.sub(WARNINGS, "", printed, flags=re.MULTILINE)
        shown = f"{run.command}\n{printed}"
        if run.expected is None:
            assert status == 0, shown
            assert printed or not (run.text and run.command), f"prints nothing:\n{run.text}"
        else:
            assert doctest.OutputChecker().check_output(run.expected, printed, SHOWN), f"{shown}\nnot:\n{run.expected}"


def session(wanted: list[Run], folder: Path) -> list[tuple[int, str]]:
    """Status and output of each, in one shell."""
    script = [AT_THE_END]
    for number, run in enumerate(wanted):
        if run.file:
            (folder / run.file).write_text(run.text)
        command = run.command or ":"
        if command.rstrip().endswith("&"):
            command = f"{command.rstrip()[:-1]} > background_{number}.txt 2>&1 &"
        script.append(f"{{\n{command}\n}} > output_{number}.txt 2>&1\necho $? > status_{number}.txt")
    (folder / "page.sh").write_text("\n".join(script) + "\n")
    environment = {
        **os.environ,
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": SOURCES,
        "MPLBACKEND": "Agg",
        "COLUMNS": "100",
    }
    shell = subprocess.Popen(
        ["bash", "--norc", "page.sh"], cwd=folder, env=environment, stdin=subprocess.DEVNULL, start_new_session=True
    )
    try:
        shell.wait(PATIENCE)
    finally:
        try:
            os.killpg(shell.pid, signal.SIGKILL)
        except ProcessLookupError:
            pass  # all have ended
        shell.wait()
    return [
        (int((folder / f"status_{number}.txt").read_text()), (folder / f"output_{number}.txt").read_text())
        for number in range(len(wanted))
    ]


@each_page
def test_parameter_files(page, tmp_path):
    for block in blocks(page):
        if block.language == "yaml" and "ros__parameters" in block.text:
            file = tmp_path / "parameters.yaml"
            file.write_text(block.text)
            given = read_parameters(file)
            settings, meshes = values.checked(given)
            assert not values.unknown(given, meshes, settings["robots"], settings["planes"])


@each_page
def test_what_is_not_run_says_why(page):
    """Shell commands that need root, a network, a GPU or minutes; all others are console blocks."""
    for block in blocks(page):
        if block.language in ("sh", "bash"):
            assert re.fullmatch(r"<!-- not run: .+ -->", block.before), block.text
