# SPDX-License-Identifier: Apache-2.0
"""A cache folder of their own for the tests: they neither use nor fill the user's."""

import os

import pytest


@pytest.fixture(scope="session", autouse=True)
def scene_cache(tmp_path_factory):
    """The cache folder of this session, of all workers of pytest-xdist: each motion is simulated once."""
    folder = tmp_path_factory.getbasetemp()
    folder = (folder.parent if "PYTEST_XDIST_WORKER" in os.environ else folder) / "scene-cache"
    before = os.environ.get("XDG_CACHE_HOME")
    os.environ["XDG_CACHE_HOME"] = str(folder)
    yield folder / "hpccd" / "scenes"
    if before is None:
        del os.environ["XDG_CACHE_HOME"]
    else:
        os.environ["XDG_CACHE_HOME"] = before
