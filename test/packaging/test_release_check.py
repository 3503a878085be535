# SPDX-License-Identifier: Apache-2.0
"""The check before a release: rejects what is not settled, on copies of the files that it reads, and nothing else."""

import re
import runpy
import shutil
import subprocess
import sys

import pytest
from sources import ROOT

SCRIPT = ROOT / "scripts" / "release_check.py"
READ = (
    *runpy.run_path(str(SCRIPT))["FOR_PEOPLE"],
    "CHANGELOG.rst",
    "CMakeLists.txt",
    "hpccd_core/include/hpccd/version.h",
)
URLS = "".join(f'<url type="{kind}">https://hpccd.dev/{kind}</url>' for kind in ("website", "repository", "bugtracker"))
URL_TABLE = '[project.urls]\nRepository = "https://hpccd.dev/repository"\n\n'


@pytest.fixture
def checkout(tmp_path):
    for name in READ:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)
    return tmp_path


def check(folder):
    """(exit status, lines)"""
    done = subprocess.run([sys.executable, SCRIPT, folder], text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    return done.returncode, done.stdout.splitlines()


def change(folder, name, pattern, text):
    before = (folder / name).read_text()
    after = re.sub(pattern, text, before, count=1, flags=re.MULTILINE)
    assert after != before, f"{name} has no {pattern}"
    (folder / name).write_text(after)


def settle(folder):
    """As a maintainer would do it."""
    for name in READ:
        text = (folder / name).read_text().replace("hpccd@example.com", "maintainers@hpccd.dev")
        text = re.sub("placeholder|(not|are) settled", "agreed", text)
        (folder / name).write_text(text)
    change(folder, "package.xml", "<maintainer", f"{URLS}\n  <maintainer")
    for name in ("pyproject.toml", "hpccd_core/pyproject.toml"):
        change(folder, name, r"^\[project\.optional", f"{URL_TABLE}[project.optional")
    change(folder, "CHANGELOG.rst", r"\((?:forthcoming|[\d-]+)\)$", "(2030-01-31)")
    citation = (folder / "CITATION.cff").read_text()
    lines = [line for line in citation.splitlines() if not line.startswith(("date-released", "repository-code"))]
    lines += ["date-released: 2030-01-31", "repository-code: https://hpccd.dev/repository"]
    (folder / "CITATION.cff").write_text("\n".join(lines) + "\n")


def test_what_is_settled_passes(checkout):
    settle(checkout)
    assert check(checkout) == (0, ["release_check: nothing stands in the way"])


@pytest.mark.parametrize(
    "name, pattern, text, told",
    [
        ("package.xml", "maintainers@hpccd.dev", "hpccd@example.com", r"package\.xml:\d+: hpccd@example\.com belongs"),
        ("package.xml", "https://hpccd.dev/w", "https://www.example.org/w", r"package\.xml:\d+: https://www\.exam"),
        ("package.xml", "(<url type=.)bugtracker", r"\1website", r'package\.xml: no <url type="bugtracker">; add it'),
        ("package.xml", "<version>[^<]+", "<version>9.9.9", r"versions differ: package\.xml has 9\.9\.9"),
        ("examples/cpp/package.xml", "maintainers@hpccd.dev", "a@b.invalid", r"examples/cpp/package\.xml:\d+: a@b\.i"),
        ("SECURITY.md", "maintainers@hpccd.dev", "hpccd@example.com", r"SECURITY\.md:\d+: hpccd@example\.com belongs"),
        ("SECURITY.md", "^Write to", "This is a placeholder. Write to", r"SECURITY\.md:\d+: says 'placeholder'; write"),
        ("pyproject.toml", r"^Repository", "Changelog", r"pyproject\.toml: no Repository in \[project\.urls\]; add it"),
        ("pyproject.toml", '^version = ".+"', 'version = "9.9.9"', r"versions differ: .*pyproject\.toml has 9\.9\.9"),
        ("hpccd_core/pyproject.toml", r"^Repository", "Changelog", r"hpccd_core/pyproject\.toml: no Repository in"),
        ("CITATION.cff", "^repository-code.*$", "", r"CITATION\.cff: no repository-code; add it"),
        ("CITATION.cff", "^date-released.*$", "", r"CITATION\.cff: no date-released; write the date"),
        ("CITATION.cff", "^date-released.*$", "date-released: 2030-02-01", r"CITATION\.cff: date-released is 2030"),
        ("CHANGELOG.rst", r"\(2030-01-31\)", "(forthcoming)", r"CHANGELOG\.rst:\d+: the topmost version is"),
        ("CHANGELOG.rst", r"^\d+\.\d+\.\d+ \(", "9.9.9 (", r"versions differ: .*CHANGELOG\.rst:\d+ has 9\.9\.9"),
        ("CMakeLists.txt", r"VERSION \d+\.\d+\.\d+", "VERSION 9.9.9", r"versions differ: .*CMakeLists\.txt has 9"),
        ("hpccd_core/include/hpccd/version.h", 'VERSION ".+"', 'VERSION "9.9.9"', r"versions differ: .*version\.h has"),
    ],
)
def test_what_is_not_settled_is_rejected(checkout, name, pattern, text, told):
    settle(checkout)
    change(checkout, name, pattern, text)
    status, lines = check(checkout)
    assert status == 1 and any(re.match(told, line) for line in lines), lines


def test_another_folder_is_rejected(tmp_path):
    status, lines = check(tmp_path)
    assert status == 1 and len(lines) == 1 and "cannot be read as a checkout of hpccd (FileNotFoundError" in lines[0]


def test_the_page_on_releases_names_it():
    assert "make release-check" in (ROOT / "docs" / "releasing.md").read_text()
    recipe = r"^release-check: .*\n\t@\$\(BIN\)/python scripts/release_check\.py$"
    assert re.search(recipe, (ROOT / "Makefile").read_text(), re.MULTILINE)
