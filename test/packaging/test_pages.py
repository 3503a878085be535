# SPDX-License-Identifier: Apache-2.0
"""Everything that the pages name exists: links, files, modules, commands and their options, layers."""

import argparse
import importlib
import importlib.util
import re

import pytest
from sources import PAGES, ROOT

import hpccd_core as hc
from hpccd_ros import cli
from hpccd_ros.commands.bench import BENCHMARKS

CORE = ROOT / "hpccd_core" / "src"
FOLDERS = {path.name for path in ROOT.iterdir() if path.is_dir() and not path.name.startswith(".")} - {"build"}

each_page = pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))


def code(page):
    """All that stands in backticks, and the lines of blocks."""
    text = page.read_text()
    blocks = re.findall(r"^ *```\w*\n(.*?)^ *```", text, re.DOTALL | re.MULTILINE)
    spans = re.findall(r"`([^`]+)`", re.sub(r"^ *```.*?^ *```", "", text, flags=re.DOTALL | re.MULTILINE))
    return [" ".join(span.split()) for span in spans] + [line for block in blocks for line in block.splitlines()]


def anchors(page):
    """Of its headings, as GitHub makes them."""
    text = re.sub(r"^```.*?^```", "", page.read_text(), flags=re.DOTALL | re.MULTILINE)
    headings = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


@each_page
def test_links(page):
    for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text()):
        if "://" in target:
            continue
        path, _, anchor = target.partition("#")
        file = (page.parent / path).resolve() if path else page
        assert file.exists(), target
        assert not anchor or anchor in anchors(file), target


@each_page
def test_files(page):
    for word in code(page):
        for path in re.findall(r"(?<![\w./~-])(?:\./)?([\w-][\w.-]*(?:/[\w.-]+)+/?)", word):
            first = path.partition("/")[0]
            if first in FOLDERS:
                assert (ROOT / path).exists(), path
            for sources in (CORE, ROOT / "hpccd_ros"):
                if first not in FOLDERS and (sources / first).is_dir() and "." in path:
                    assert (sources / path).exists(), path


@each_page
def test_modules(page):
    for word in code(page):
        for name in re.findall(r"python -m (hpccd_[\w.]+)", word):
            assert importlib.util.find_spec(name), name
        if re.fullmatch(r"hpccd_(ros|core)(\.\w+)+", word):
            module, _, last = word.rpartition(".")
            assert importlib.util.find_spec(module), word
            assert hasattr(importlib.import_module(module), last) or importlib.util.find_spec(word), word


@each_page
def test_commands(page):
    targets = set(re.findall(r"^([a-z0-9-]+):.*## ", (ROOT / "Makefile").read_text(), re.MULTILINE))
    for word in code(page):
        for target in re.findall(r"(?:^|\s)make ([a-z][a-z0-9-]*)", word):
            assert target in targets, word
        for command, rest in re.findall(r"(?:^|/bin/)hpccd ([a-z]+)([^|;&#]*)", word):
            assert command in cli.COMMANDS, word
            if command == "bench":
                assert set(rest.split()[:1]) <= set(BENCHMARKS), word
            for option in re.findall(r"(?<=\s)--[a-z-]+", rest):
                assert option in options(command) | {"--help"}, word


def test_texts_name_pages_that_are_there():
    """Messages, help and comments: never a part of the README, which has moved to a page."""
    suffixes = {".py", ".yaml", ".xml", ".msg", ".srv", ".rviz"}
    for folder in ("hpccd_ros", "hpccd_core", "config", "msg", "srv"):
        for file in (file for file in (ROOT / folder).rglob("*") if file.suffix in suffixes):
            text = file.read_text()
            assert "README" not in text, file
            assert all((ROOT / page).exists() for page in re.findall(r"docs/\w+\.md", text)), file


def options(command):
    """All that the command takes, those of each benchmark together."""
    parser = argparse.ArgumentParser()
    importlib.import_module(f"hpccd_ros.commands.{command}").configure(parser)
    found, parsers = set(), [parser]
    while parsers:
        for action in parsers.pop()._actions:
            found |= set(action.option_strings)
            if isinstance(action, argparse._SubParsersAction):
                parsers += action.choices.values()
    return found


def test_reference_has_every_public_name():
    page = (ROOT / "docs" / "api" / "python.md").read_text()
    assert [name for name in hc.__all__ if f"hpccd_core.{name}\n" not in page] == ["__version__"]


@each_page
def test_words(page):
    """Plain English: none of the words that read as translated."""
    found = re.findall(
        r"\b(?:anew|mend|mended|as ever|so many|will not do|nobody knows|is told of|tells of|stands alone)\b",
        " ".join(page.read_text().split()),
        re.IGNORECASE,
    )
    assert not found


def test_readme_is_two_screens():
    assert len((ROOT / "README.md").read_text().splitlines()) <= 200


def test_results_in_readme_are_those_of_the_page_of_figures():
    results = (ROOT / "README.md").read_text().partition("## Results")[2].partition("\n#")[0]
    figures = set(re.findall(r"[\d,.]+\d", (ROOT / "docs" / "performance.md").read_text()))
    rows = re.findall(r"^\| [a-z-]+ \|(.*)\|$", results, re.MULTILINE)[1:]
    assert rows and {cell.strip() for row in rows for cell in row.split("|")} <= figures


@pytest.mark.parametrize(
    "heading, folder",
    [("### Call path of `detect()`", ROOT / "hpccd_core"), ("## Call path of a vertex message", ROOT / "hpccd_ros")],
)
def test_call_path_has_at_most_ten_stops_that_exist(heading, folder):
    text = (ROOT / "docs" / "architecture.md").read_text()
    path = text.partition(f"{heading}\n")[2].partition("\n#")[0]
    stops = re.findall(r"^\d+\. `([\w/]+\.(?:py|cpp)):(\w+)`", path, re.MULTILINE)
    assert 0 < len(stops) <= 10 and len(set(stops)) == len(stops) == len(re.findall(r"^\d+\. ", path, re.MULTILINE))
    for file, function in stops:
        definition = rf"def {function}\(" if file.endswith(".py") else rf"\b{function}\("
        assert re.search(definition, (folder / file).read_text()), (file, function)


@pytest.mark.parametrize(
    "heading, folder",
    [("The layers of hpccd_core", CORE), ("The layers of hpccd_ros", ROOT / "hpccd_ros")],
)
def test_architecture_names_every_module_once(heading, folder):
    text = (ROOT / "docs" / "architecture.md").read_text()
    section = text.partition(f"## {heading}\n")[2].partition("\n#")[0]
    modules = [path.name for path in folder.iterdir() if path.is_dir() and path.name != "__pycache__"]
    assert sorted(re.findall(r"^\| `(\w+)` \|", section, re.MULTILINE)) == sorted(modules)


@pytest.mark.parametrize("header", sorted((ROOT / "hpccd_core" / "include").rglob("*.h")), ids=lambda path: path.name)
def test_each_member_has_a_declaration_of_its_own(header):
    """The C++ reference has only the first name of a declaration."""
    member = r"^ +(?!using )(?:const )?[\w:]+(?:<.*>)?[ *]+\w+(?: = [^,;()]+)?, ?\*?\w+(?: = [^,;()]+)?[,;].*$"
    assert re.findall(member, header.read_text(), re.MULTILINE) == []


def test_fields_of_interfaces_are_terms_of_definitions():
    """A definition has one line of terms; with more, its text runs on behind them."""
    spec = importlib.util.spec_from_file_location("generate", ROOT / "docs" / "generate.py")
    generate = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(generate)
    lines = generate.interfaces().splitlines()
    starts = [k for k, line in enumerate(lines) if line.startswith(": ")]
    assert len(starts) > 50
    assert all(lines[k - 1].startswith("**") and not lines[k - 2] for k in starts)
