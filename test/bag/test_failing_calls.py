# SPDX-License-Identifier: Apache-2.0
"""Each system call of what writes files fails, with each error: a clear error, counted losses, no false "complete",
nothing left behind, no file left open."""

import failing_calls
import pytest


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    built = failing_calls.build(tmp_path_factory.mktemp("library"))
    return built or pytest.skip("there is no C compiler for the library that makes system calls fail")


@pytest.mark.timeout(3600)
@pytest.mark.parametrize(
    ("scenario", "options"),
    [
        ("record a folder, sync", ("--points", 4)),
        ("doctor", ("--points", 1)),
        ("scene --npz", ("--points", 1)),
        *(
            pytest.param(name, options, marks=pytest.mark.long)
            for name, options in (
                ("record a file", ("--all-errors",)),
                ("record a folder", ("--all-errors",)),
                ("doctor", ()),
                ("cut", ()),
                ("replay", ()),
                ("view, picture", ("--points", 4)),
                ("view --every", ("--points", 4)),
                ("view --html", ("--points", 4)),
                ("scene", ("--points", 8)),
            )
        ),
    ],
)
def test_a_call_that_fails(library, scenario, options):
    rows = failing_calls.run(library, "--only", scenario, *options)
    assert not [row for row in rows if row["problems"]]
    assert len({row["call"] for row in rows}) > 5
