# SPDX-License-Identifier: Apache-2.0
"""What others sent, quoted: readable, bounded, and with nothing in it that a terminal obeys."""

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
