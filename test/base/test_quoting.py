# SPDX-License-Identifier: Apache-2.0
"""Untrusted text, quoted: readable, bounded, and without terminal control sequences."""

import pytest

from hpccd_ros.base import quoting


def test_short_texts_stay():
    assert quoting.shortened("/a/path") == "/a/path"
    assert quoting.quoted("it's") == repr("it's")
    assert quoting.listed(["a", "b"]) == "a, b"
    assert quoting.printable("café") == "café"


@pytest.mark.parametrize("shown", [quoting.shortened, quoting.quoted, quoting.printable])
def test_long_texts_keep_their_ends(shown):
    text = shown("begin" + 100_000 * "x" + "end")
    assert len(text) < 1100 and "begin" in text and "end" in text


def test_the_length_of_what_is_left_out_is_told():
    assert "(100000 characters)" in quoting.shortened(100_000 * "x")


def test_of_many_names_the_first_are_listed():
    text = quoting.listed(f"mesh{i}" for i in range(1000))
    assert text.startswith("mesh0, mesh1, ") and text.endswith(" and 990 more") and "mesh10" not in text
    assert len(quoting.listed([1000 * "n"] * 1000)) < 2000


def test_the_name_that_is_there_twice():
    assert quoting.repeated(["a", "b", "c", "b"]) == "'b'"


def test_nothing_reaches_the_terminal_that_it_obeys():
    assert quoting.printable("\x1b[2J\r\n\u202e") == r"\x1b[2J\r\n\u202e"


def test_counts_agree_with_their_nouns():
    assert [quoting.counted(n, "frame") for n in (0, 1, 2, 1234)] == ["0 frames", "1 frame", "2 frames", "1,234 frames"]
    assert quoting.counted(2, "vertex", "vertices") == "2 vertices" and quoting.counted(1, "vertex", "x") == "1 vertex"


def test_the_nearest_name():
    assert quoting.suggestion("acuracy", ["accuracy", "backend"]) == "; did you mean accuracy?"
    assert quoting.suggestion("gravity", ["accuracy", "backend"]) == quoting.suggestion("a", []) == ""
    assert quoting.nearest("update_rate", ["max_rate"], 0.8) == "" and quoting.nearest("update_rate", ["max_rate"])
    assert quoting.nearest(10**6 * "x", ["x"]) == "", "nobody types so much"


def test_what_is_not_one_of_the_allowed_names_them():
    text = quoting.not_one_of("exakt", ("fast", "exact"))
    assert text == "'exakt' is not valid; use one of fast, exact; did you mean exact?"
    assert quoting.not_one_of(5, ("fast", "exact")) == "5 is not valid; use one of fast, exact"
