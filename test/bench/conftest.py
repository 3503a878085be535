# SPDX-License-Identifier: Apache-2.0
"""Benchmarks on small scenes: a run takes a second. These tests check their commands, not their figures."""

import functools
import json

import pytest

from bench import __main__ as laboratory
from hpccd_ros import cli


@pytest.fixture(scope="session", autouse=True)
def scene_cache(tmp_path_factory):
    """A cache folder of this session's own: the user's is neither used nor filled. Settings of benchmarks end here."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        patch.setenv("PYTHONPATH", "")
        yield


def _run(main, folder, name, *arguments):
    status = main([name, "--out", str(folder), "--label", "test", *arguments])
    path = folder / f"{name}-test.json"
    return status, json.loads(path.read_text()) if path.exists() else None, folder


@pytest.fixture
def product(tmp_path):
    """product("cpu", ...): runs `hpccd bench cpu ...`; (exit status, the result as written, its folder)."""
    return functools.partial(_run, lambda words: cli.main(["bench", *words]), tmp_path)


@pytest.fixture
def bench(tmp_path):
    """bench("scaling", ...): runs `python -m bench scaling ...`; (exit status, the result as written, its folder)."""
    return functools.partial(_run, laboratory.main, tmp_path)
