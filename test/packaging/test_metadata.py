# SPDX-License-Identifier: Apache-2.0
"""The files that describe the package agree with each other."""

import re
import tomllib
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
import yaml
from catkin_pkg.changelog import BulletList, Changelog, populate_changelog_from_rst
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parents[2]
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
SPDX = "SPDX-License-Identifier: Apache-2.0"
INSTALLED_EXTRAS = ("test", "lint", "interop")


def test_one_version():
    cmake = re.search(r"project\(hpccd VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text()).group(1)
    xml = ElementTree.parse(ROOT / "package.xml").findtext("version")
    changelog = re.search(r"^(\d+\.\d+\.\d+) \(", (ROOT / "CHANGELOG.rst").read_text(), re.MULTILINE).group(1)
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())["version"]
    versions = {cmake, xml, changelog, citation}
    headers = ROOT / "hpccd_core" / "include" / "hpccd"
    header = (headers / "version.h").read_text()
    numbers = re.findall(r"#define HPCCD_VERSION_(?:MAJOR|MINOR|PATCH) (\d+)", header)
    versions |= {".".join(numbers), re.search(r'#define HPCCD_VERSION "(.+)"', header).group(1)}
    assert versions == {PYPROJECT["project"]["version"]}
    public = "".join(file.read_text() for file in headers.glob("*.h"))
    namespace, short = f"v{numbers[0]}_{numbers[1]}", ".".join(numbers[:2])
    assert set(re.findall(r"inline namespace (\w+)", public)) == {namespace}
    for file, pattern in [
        ("hpccd_core/include/hpccd/hpccd.h", r"libhpccd_core\.so\.([\d.]+\d)"),
        ("docs/cpp.md", r"libhpccd_core\.so\.([\d.]+\d)|find_package\(hpccd_core ([\d.]+) |hpccd::v([\d_]+)"),
        ("examples/cpp/CMakeLists.txt", r"find_package\(hpccd_core ([\d.]+) "),
        ("examples/cpp/package.xml", r"<version>(\d+\.\d+)"),
        ("SECURITY.md", r"\| (\d+\.\d+)\.x"),
    ]:
        found = {next(filter(None, m.groups())) for m in re.finditer(pattern, (ROOT / file).read_text())}
        assert {text.replace("_", ".") for text in found} == {short}, file


@pytest.mark.parametrize("python", ["3.11", "3.12"])
def test_each_requirement_is_pinned_to_a_version_that_it_allows(python):
    lines = (ROOT / "requirements" / f"constraints-{python}.txt").read_text().splitlines()
    pins = {}
    for line in lines:
        if not line.startswith("#"):
            name, version = line.split("==")
            pins[canonicalize_name(name)] = version
    extras = PYPROJECT["project"]["optional-dependencies"]
    required = PYPROJECT["build-system"]["requires"] + PYPROJECT["project"]["dependencies"]
    for text in required + [line for extra in INSTALLED_EXTRAS for line in extras[extra]]:
        requirement = Requirement(text)
        name = canonicalize_name(requirement.name)
        assert name in pins, f"{text} is not pinned for Python {python}: make pin"
        assert requirement.specifier.contains(pins[name]), f"{text} excludes the pin {pins[name]}: make pin"


def test_run_time_requirements_are_there_at_build_time_with_the_same_version():
    """The interfaces are generated against the message packages that are used at run time."""
    build = {Requirement(text).name: text for text in PYPROJECT["build-system"]["requires"]}
    for text in PYPROJECT["project"]["dependencies"]:
        if text.startswith("ros-jazzy-"):
            assert build[Requirement(text).name] == text


def test_each_source_file_names_its_licence():
    suffixes = {
        ".py",
        ".h",
        ".cpp",
        ".cu",
        ".sh",
        ".cmake",
        ".msg",
        ".srv",
        ".action",
        ".yaml",
        ".xml",
        ".js",
        ".css",
        ".html",
    }
    folders = ("hpccd_core", "hpccd_ros", "launch", "msg", "srv", "action", "cmake", "scripts", "config", "test")
    missing = []
    for folder in folders:
        for file in (ROOT / folder).rglob("*"):
            if file.suffix in suffixes and SPDX not in file.read_text()[:300]:
                missing.append(str(file.relative_to(ROOT)))
    assert missing == []


def test_packaging_tools_of_ros_read_the_changelog():
    """REP-132: they skip sections within a version, so its groups are paragraphs."""
    text = (ROOT / "CHANGELOG.rst").read_text()
    changelog = Changelog("hpccd")
    populate_changelog_from_rst(changelog, text.replace("(forthcoming)", "(2030-01-31)"))
    versions = list(changelog.foreach_version())
    assert versions[0][0] == PYPROJECT["project"]["version"]
    for version, _, contents in versions:
        groups = [str(part) for part in contents if str(part).startswith("**")]
        assert groups == [f"**{name}**" for name in ("Added", "Changed", "Fixed") if f"**{name}**" in groups], version
        entries = sum(len(list(part)) for part in contents if isinstance(part, BulletList))
        section = re.search(rf"^{re.escape(version)} \(.*?(?=^\d+\.\d+\.\d+ \(|\Z)", text, re.DOTALL | re.MULTILINE)[0]
        assert entries == len(re.findall(r"^ *\* ", section, re.MULTILINE)) > 0, version
