# SPDX-License-Identifier: Apache-2.0
"""docs/performance.md is what the kept results say, and shows all of them."""

import shutil

import pytest
from sources import ROOT

from bench.report import performance
from hpccd_ros.base.errors import UserError

RESULTS = ROOT / "test" / "bench" / "results"
PAGE = ROOT / "docs" / "performance.md"


def test_tables_are_those_of_the_kept_results():
    text = PAGE.read_text(encoding="utf-8")
    assert text == performance.page(text, RESULTS), "python -m bench.report"


def test_every_table_is_on_the_page_and_every_result_in_a_table():
    text = PAGE.read_text(encoding="utf-8")
    assert sorted(found["name"] for found in performance.TABLE.finditer(text)) == sorted(performance.TABLES)
    used = {name for _, *names in performance.TABLES.values() for name in names} | {performance.TRADE}
    assert used == {path.stem for path in RESULTS.glob("*")}


def test_a_result_that_is_not_kept_is_named(tmp_path):
    made = performance.page("<!-- steps -->\nold\n<!-- end -->", tmp_path)
    assert made == "<!-- steps -->\n\nNot measured yet: no result step-2-cores is kept.\n\n<!-- end -->"


def test_another_number_makes_another_page(tmp_path):
    shutil.copytree(RESULTS, tmp_path / "results")
    path = tmp_path / "results" / "memory-2-cores.json"
    key = '"detector_bytes_per_triangle": '
    path.write_text(path.read_text().replace(f"{key}376.147891", f"{key}7"))
    before = PAGE.read_text(encoding="utf-8").splitlines()
    after = performance.page(PAGE.read_text(encoding="utf-8"), tmp_path / "results").splitlines()
    (changed,) = (pair for pair in zip(before, after, strict=True) if pair[0] != pair[1])
    assert changed[0].startswith("| cloth-ball |") and changed[1] == changed[0].replace("| 376 |", "| 7 |")


def test_where_the_numbers_come_from():
    made = performance.page("<!-- soak -->\nold\n<!-- end -->", RESULTS)
    assert "old" not in made and "`python -m bench soak --minutes 30" in made
    assert "4 cores of which other processes took 56 %; commit 134dcf2, 2026-11-21" in made


def test_an_unknown_table_is_refused():
    with pytest.raises(UserError, match="<!-- speed -->: there is no such table; there are peer, "):
        performance.page("<!-- speed -->\n<!-- end -->", RESULTS)
