# SPDX-License-Identifier: Apache-2.0
"""Benchmarks on scenes so small that a run takes a second: their commands are tested here, not their figures."""

import json

import pytest

from hpccd_ros import cli


@pytest.fixture(scope="session", autouse=True)
def scene_cache(tmp_path_factory):
    """A cache folder of this session's own: the user's is neither used nor filled."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture
def bench(tmp_path):
    """bench("cpu", ...): runs the command and returns (exit status, the result as written, its folder)."""

    def run(name, *arguments):
        status = cli.main(["bench", name, *arguments, "--out", str(tmp_path), "--label", "test"])
        path = tmp_path / f"{name}-test.json"
        return status, json.loads(path.read_text()) if path.exists() else None, tmp_path

    return run
