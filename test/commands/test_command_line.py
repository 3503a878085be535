# SPDX-License-Identifier: Apache-2.0
"""`hpccd` teaches: every command has its help, wrong use is answered in one line, and help is quick."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from sources import ROOT

from hpccd_ros import cli
from hpccd_ros.base.version import package_version

ASKING = ("status", "echo", "param", "lifecycle")  # a running node


@pytest.mark.parametrize("command", cli.COMMANDS)
def test_every_command_has_help_with_examples(command, capsys):
    with pytest.raises(SystemExit) as ended:
        cli.main([command, "--help"])
    assert ended.value.code == 0
    shown = capsys.readouterr().out
    assert f"hpccd {command}" in shown.split("options:")[0], "an example before the options"


def test_the_list_of_commands(capsys):
    with pytest.raises(SystemExit):
        cli.main(["--help"])
    shown = capsys.readouterr().out
    for command in ("demo", "record", "replay", "view", "cut", "doctor", "scene", "bench", "info", *ASKING):
        assert f"    {command} " in shown


def test_the_version(capsys):
    with pytest.raises(SystemExit) as ended:
        cli.main(["--version"])
    assert ended.value.code == 0 and capsys.readouterr().out == f"hpccd {package_version()}\n"


def test_help_imports_neither_ros_nor_the_core():
    code = (
        "import sys; from hpccd_ros import cli\n"
        "try: cli.main(['--help'])\n"
        "except SystemExit: pass\n"
        "heavy = [m for m in ('rclpy', 'hpccd_core', 'numpy', 'matplotlib', 'mcap') if m in sys.modules]\n"
        "sys.exit(str(heavy) if heavy else 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["record", "--depth", "0"], "--depth 0: must be at least 1"),
        (["record", "--split-size", "-1"], "--split-size -1.0: must not be negative"),
        (["record", "-o", "run", "--split-size", "1e-6"], "--split-size 1e-06: must be 0 or at least 0.01"),
        (["record", "-o", "run", "--split-time", "1e-6"], "--split-time 1e-06: must be 0 or at least 0.1"),
        (["record", "-o", "run", "--split-size", "inf"], "--split-size inf: must be at most 1e+09"),
        (["record", "-o", "run", "--split-time", "nan"], "--split-time nan: must be a number"),
        (["record", "--duration", "nan"], "--duration nan: must be a number"),
        (["record", "--flush", "nan"], "--flush nan: must be a number"),
        (["record", "--node", "hpccd"], "full name"),
        (["replay", "x.mcap", "--threads", "-1"], "--threads -1: must not be negative"),
        (["replay", "x.mcap", "--publish", "--from", "5", "--to", "2"], "--to not before --from"),
        (["replay", "x.mcap", "--from", "nan"], "--rate, --from, --to and --wait must be numbers"),
        (["replay", "x.mcap", "--rate", "nan"], "--rate, --from, --to and --wait must be numbers"),
        (["view", "x.mcap", "--azimuth", "nan"], "--azimuth nan: must be a number of degrees"),
        (["view", "x.mcap", "--every", "0"], "--every 0: must be at least 1"),
        (["view", "x.mcap"], "x.mcap does not exist"),
        (["doctor", "x.mcap"], "x.mcap does not exist"),
        (["doctor", "x.mcap", "--compression", "lz4"], "--compression belongs to --recover"),
        (["cut", "x.mcap", "-o", "y.mcap"], "nothing to cut: give --from TIME, --to TIME or both"),
        (["cut", "x.mcap", "--to", "1", "-o", "y"], "-o y: must end in .mcap"),
        (["cut", "x.mcap", "--to", "-1", "-o", "y.mcap"], "--to: '-1' is not a time; give seconds from the beginning"),
        (["cut", "x.mcap", "--from", "1", "-o", "y.mcap"], "x.mcap does not exist"),
        (["status", "--wait", "-1"], "--wait -1.0: must be a number of seconds, not negative"),
        (["echo", "/contacts", "--wait", "nan"], "--wait nan: must be a number of seconds"),
        (["echo", "/contacts", "-n", "0"], "-n 0: must be at least 1"),
        (["param", "get"], "get: got no NAME; write hpccd param get NAME"),
        (["demo", "--rate", "0"], "--rate 0.0: must be above 0"),
        (["demo", "--out", "/dev/null/out"], "--out /dev/null/out: Not a directory"),
        (["demo", "--scene", "nothing"], "unknown scene 'nothing'"),
    ],
)
def test_wrong_use_is_answered_in_one_line(hpccd, arguments, says):
    done = hpccd(*arguments)
    assert done.returncode == 2
    assert says in done.stderr and done.stderr.startswith(f"hpccd {arguments[0]}: ")
    assert done.stderr.count("\n") == 1


def test_unknown_command(hpccd):
    done = hpccd("rekord")
    assert done.returncode == 2 and "invalid choice: 'rekord'" in done.stderr


@pytest.mark.parametrize(
    "arguments",
    [
        ["replay", "x.mcap"],
        ["view", "x.mcap"],
        ["cut", "x.mcap", "-o", "y.mcap"],
        ["record"],
        ["status"],
        ["echo", "/contacts"],
        ["param", "list"],
        ["scene", "two-triangles", "--publish"],
    ],
)
def test_another_rmw_implementation_is_rejected_before_rcl_ends_the_process(hpccd, monkeypatch, arguments):
    monkeypatch.setenv("RMW_IMPLEMENTATION", "rmw_nobody_cpp")
    done = hpccd(*arguments)
    assert done.returncode == 2 and "RMW_IMPLEMENTATION: 'rmw_nobody_cpp' is not installed here" in done.stderr
    assert done.stderr.count("\n") == 1


def test_info(hpccd):
    done = hpccd("info", "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert "cpu" in found["backends"] and "exact" in found["accuracies"]
    assert found["packages"]["mcap"] and found["cores"] >= 1
    assert Path(found["code"]).name == "hpccd_ros"


def test_info_of_a_mesh(hpccd, tmp_path):
    seam = tmp_path / "seam.obj"
    seam.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 4 5 6\n")
    done = hpccd("info", seam)
    assert done.returncode == 0, done.stderr
    assert "components     2; 1 if welded" in done.stdout and "doubled vertices: 2" in done.stdout
    done = hpccd("info", seam, "--json", "--distance", "2")
    found = json.loads(done.stdout)
    assert found["distance"] == 2 and found["components_if_welded"] == 0 and found["smallest_gap"] is None
    assert [d["indices"] for d in found["defects"]] == [[[3, 1], [5, 2]], [[1, 0], [2, 0], [3, 0], [4, 0], [5, 0]]]
    for arguments, message in {
        (seam, "--distance", "-1"): "--distance: must be finite and not negative, got -1.0",
        ("run.mcap",): "run.mcap is a recording: use hpccd doctor",
        (tmp_path / "no.obj",): "no such file",
        ("--distance", "1"): "--distance belongs to a mesh file",
    }.items():
        done = hpccd("info", *arguments)
        assert done.returncode == 2 and message in done.stderr and done.stderr.count("\n") == 1


def test_interrupted_within_an_import():
    """numpy's C parts make an ImportError of the exception that a SIGINT raises while they load."""
    code = (
        "import builtins, signal, sys\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"  # a shell's background job ignores it
        "load = builtins.__import__\n"
        "def told_to_end(name, *rest, **named):\n"
        "    from_c = sys._getframe(1).f_code.co_name == '_call_with_frames_removed'\n"
        "    if from_c and name == 'numpy._core._multiarray_umath': signal.raise_signal(signal.SIGINT)\n"
        "    return load(name, *rest, **named)\n"
        "builtins.__import__ = told_to_end\n"
        "from hpccd_ros import cli\n"
        "sys.exit(cli.main(['replay', sys.argv[1]]))"
    )
    # A sound one: of what cannot be read is told before numpy is needed.
    command = [sys.executable, "-c", code, str(ROOT / "bags/cloth-drop-small.mcap")]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert done.returncode == 130, done.stderr
    assert done.stderr.splitlines()[-1] == "hpccd replay: interrupted"
