# SPDX-License-Identifier: Apache-2.0
"""The core as a distribution of its own, hpccd-core, beside the one with the ROS node."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from sources import ROOT

import hpccd_core as hc
from hpccd_core import _installations

CORE = tomllib.loads((ROOT / "hpccd_core" / "pyproject.toml").read_text())


def test_numpy_is_all_that_it_needs():
    assert [requirement.split(">")[0] for requirement in CORE["project"]["dependencies"]] == ["numpy"]


def test_the_licence_is_the_same():
    assert (ROOT / "hpccd_core" / "LICENSE").read_text() == (ROOT / "LICENSE").read_text()


def test_nothing_but_numpy_is_imported():
    """Nor what later Pythons only have: the core is for Python 3.10 too."""
    code = (
        "import sys; before = set(sys.modules); import numpy, hpccd_core\n"
        "tops = {name.split('.')[0] for name in set(sys.modules) - before}\n"
        "print(*sorted(tops - sys.stdlib_module_names - {'numpy', 'hpccd_core'}))"
    )
    done = subprocess.run([sys.executable, "-c", code], text=True, capture_output=True, timeout=100, cwd="/")
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == ""


def laboratory(names):
    """The names among them of files of tests, oracles, fuzzers or benchmarks (hpccd_ros/bench is shipped)."""
    return [name for name in names if re.search(r"(^|/)_?(oracle|reference|fuzz|tests?)([/.]|$)|^bench/", name)]


def test_no_oracle_fuzzer_or_test_is_installed():
    site_packages = Path(hc._core.__file__).parents[1]
    packages = [site_packages / name for name in ("hpccd_core", "hpccd_ros") if (site_packages / name).is_dir()]
    names = [str(path.relative_to(site_packages)) for package in packages for path in package.rglob("*")]
    assert "hpccd_core/detector.py" in names
    assert not laboratory(names)


@pytest.mark.parametrize(
    "name",
    [
        "hpccd_core/fuzz/__init__.py",
        "hpccd_core/_reference.cpython-311-x86_64-linux-gnu.so",
        "hpccd_ros/oracle/scenes.py",
        "_oracle.cpython-311-x86_64-linux-gnu.so",
        "hpccd_core/tests/paper/front_test.cpp",
        "bench/scaling.py",
    ],
)
def test_an_installed_oracle_is_seen(name):
    assert laboratory([name, "hpccd_core/detector.py"]) == [name]


@pytest.fixture
def environment(tmp_path, monkeypatch):
    """A folder on Python's path that looks as if the core were installed there."""

    def install(*distributions, folder=tmp_path / "site-packages"):
        (folder / "hpccd_core").mkdir(parents=True, exist_ok=True)
        (folder / "hpccd_core" / "_core.cpython-311-x86_64-linux-gnu.so").touch()
        (folder / "hpccd_core" / "__init__.py").touch()
        for name in distributions:
            (folder / f"{name}.dist-info").mkdir()
        sys.path.append(str(folder))

    monkeypatch.setattr(sys, "path", [])
    return install


def test_one_installation_is_silent(environment, recwarn):
    environment("hpccd_core-0.1.0")
    _installations.warn_of_several()
    assert not recwarn.list


def test_both_distributions_in_one_environment_are_noticed(environment):
    environment("hpccd_core-0.1.0", "hpccd-0.1.0")
    with pytest.warns(RuntimeWarning, match="more than once: hpccd_core-0.1.0 in .*, hpccd-0.1.0 in .*Remedy"):
        _installations.warn_of_several()


def test_two_folders_are_noticed(environment, tmp_path):
    environment("hpccd_core-0.1.0")
    environment(folder=tmp_path / "workspace")  # of colcon, which leaves no record
    with pytest.warns(RuntimeWarning, match="more than once: .*site-packages.*workspace.*the first is used"):
        _installations.warn_of_several()


def test_what_a_build_has_left_is_no_installation(environment, tmp_path, recwarn):
    environment("hpccd_core-0.1.0")
    environment(folder=tmp_path / "build")
    (tmp_path / "build" / "hpccd_core" / "__init__.py").unlink()
    _installations.warn_of_several()
    assert not recwarn.list


def test_this_environment_holds_one():
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", "import hpccd_core"], text=True, capture_output=True, timeout=100
    )
    assert done.returncode == 0, done.stderr
    assert len(_installations.folders()) == 1


def test_the_version_is_that_of_the_headers():
    assert (
        f'#define HPCCD_VERSION "{hc.__version__}"'
        in (ROOT / "hpccd_core" / "include" / "hpccd" / "version.h").read_text()
    )


def test_readme_of_the_core(tmp_path):
    """Its program prints the output that it shows."""
    text = (ROOT / "hpccd_core" / "README.md").read_text()
    program, output = re.search(r"```python\n(.*?)```\n\n```text\n(.*?)```", text, re.DOTALL).groups()
    done = subprocess.run([sys.executable, "-c", program], text=True, capture_output=True, timeout=100, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout == output
