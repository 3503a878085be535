# SPDX-License-Identifier: Apache-2.0
"""release_check.py [FOLDER]: list what a checkout lacks for a release, each with its place and remedy.

Exit status 0: nothing is missing; 1: something is. Reads files only; needs Python 3.11 and PyYAML.
"""

import argparse
import re
import sys
import tomllib
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from pathlib import Path

import yaml

# Addresses in domains that RFC 2606 reserves, and words that mark something as missing.
NOBODY = re.compile(
    r"(?:[\w.+-]+@|https?://)(?:[\w-]+\.)*(?:example\.(?:com|net|org)|(?:invalid|test|example|localhost)\b)",
    re.IGNORECASE,
)
PLACEHOLDER = re.compile(r"\b(?:placeholder|not settled|are settled)\b", re.IGNORECASE)
URL_KINDS = ("website", "repository", "bugtracker")
PACKAGES = ("package.xml", "examples/cpp/package.xml")
# Files with addresses for users.
FOR_PEOPLE = (
    *PACKAGES,
    "CITATION.cff",
    "SECURITY.md",
    "pyproject.toml",
    "hpccd_core/pyproject.toml",
    ".github/ISSUE_TEMPLATE/config.yml",
    "CONTRIBUTING.md",
    "QUALITY_DECLARATION.md",
    "README.md",
    "docs/releasing.md",
)


def findings(root: Path) -> Iterator[str]:
    """PLACE: problem; remedy."""
    yield from placeholders(root)
    yield from missing_addresses(root)
    yield from open_dates(root)
    yield from versions(root)


def placeholders(root: Path) -> Iterator[str]:
    for name in FOR_PEOPLE:
        for number, line in enumerate((root / name).read_text().splitlines(), start=1):
            if found := NOBODY.search(line):
                yield f"{name}:{number}: {found[0]} belongs to nobody; write an address that is read"
            if found := PLACEHOLDER.search(line):
                yield f"{name}:{number}: says {found[0]!r}; write what is meant to stand there, and drop the remark"


def missing_addresses(root: Path) -> Iterator[str]:
    there = {url.get("type", "website") for url in ElementTree.parse(root / "package.xml").iterfind("url")}
    for kind in URL_KINDS:
        if kind not in there:
            yield f'package.xml: no <url type="{kind}">; add it'
    for name in ("pyproject.toml", "hpccd_core/pyproject.toml"):
        urls = tomllib.loads((root / name).read_text())["project"].get("urls", {})
        if not {"repository", "source", "homepage"} & {key.lower() for key in urls}:
            yield f"{name}: no Repository in [project.urls]; add it"
    if "repository-code" not in yaml.safe_load((root / "CITATION.cff").read_text()):
        yield "CITATION.cff: no repository-code; add it"


def open_dates(root: Path) -> Iterator[str]:
    heading = topmost_heading(root)
    if not re.fullmatch(r"\d{4}-\d{2}-\d{2}", heading[2]):
        yield f"CHANGELOG.rst:{heading[0]}: the topmost version is {heading[2]!r}; write the date, as 2030-01-31"
    released = yaml.safe_load((root / "CITATION.cff").read_text()).get("date-released")
    if released is None:
        yield "CITATION.cff: no date-released; write the date of the topmost heading of CHANGELOG.rst"
    elif str(released) != heading[2]:
        yield (
            f"CITATION.cff: date-released is {released}, the topmost heading of CHANGELOG.rst has {heading[2]}; "
            "write the same date"
        )


def versions(root: Path) -> Iterator[str]:
    header = (root / "hpccd_core/include/hpccd/version.h").read_text()
    found = {
        "package.xml": ElementTree.parse(root / "package.xml").findtext("version"),
        "pyproject.toml": tomllib.loads((root / "pyproject.toml").read_text())["project"]["version"],
        "CMakeLists.txt": only(r"project\(hpccd VERSION (\S+)", (root / "CMakeLists.txt").read_text()),
        "CITATION.cff": str(yaml.safe_load((root / "CITATION.cff").read_text()).get("version")),
        f"CHANGELOG.rst:{topmost_heading(root)[0]}": topmost_heading(root)[1],
        "hpccd_core/include/hpccd/version.h": only(r'#define HPCCD_VERSION "(.+)"', header),
    }
    if len(set(found.values())) > 1:
        told = ", ".join(f"{place} has {version}" for place, version in found.items())
        yield f"versions differ: {told}; write the same everywhere"


def topmost_heading(root: Path) -> tuple[int, str, str]:
    """(line, version, date or the text in its place)"""
    for number, line in enumerate((root / "CHANGELOG.rst").read_text().splitlines(), start=1):
        if found := re.fullmatch(r"(\d+\.\d+\.\d+) \((.+)\)", line):
            return number, found[1], found[2]
    raise SystemExit("release_check: CHANGELOG.rst has no heading as 0.1.0 (2030-01-31)")


def only(pattern: str, text: str) -> str:
    found = re.search(pattern, text)
    return found[1] if found else "none"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", nargs="?", type=Path, default=Path(__file__).resolve().parents[1])
    root = parser.parse_args().folder
    try:
        lines = list(findings(root))
    except (OSError, ElementTree.ParseError, tomllib.TOMLDecodeError, yaml.YAMLError, KeyError) as error:
        reason = f"{type(error).__name__}: {error}"
        print(f"release_check: {root} cannot be read as a checkout of hpccd ({reason})", file=sys.stderr)
        return 1
    for line in lines:
        print(line)
    print(f"release_check: {len(lines)} places to settle" if lines else "release_check: nothing stands in the way")
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main())
