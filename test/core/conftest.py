# SPDX-License-Identifier: Apache-2.0
import os
from pathlib import Path

import hypothesis
import pytest

# No deadline: the machine may be busy. The examples are the same each time, so that a failure is not luck.
hypothesis.settings.register_profile("hpccd", deadline=None, derandomize=True)
hypothesis.settings.load_profile("hpccd")


@pytest.fixture(scope="session")
def data_folder():
    """Folder of scenes and queries with ground truth."""
    folder = os.environ.get("HPCCD_DATA")
    if not folder:
        pytest.skip("HPCCD_DATA is not set: no folder of scenes with ground truth to compare with")
    if not Path(folder).is_dir():
        pytest.fail(f"HPCCD_DATA is {folder!r}, which is not a folder")
    return Path(folder)
