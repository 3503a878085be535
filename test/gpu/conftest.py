# SPDX-License-Identifier: Apache-2.0
import os
from pathlib import Path

import pytest

import hpccd_core as hc


@pytest.fixture(autouse=True)
def _needs_gpu():
    status = hc.gpu_status()
    if not status["devices"]:
        pytest.skip(f"no usable GPU: {status['reason']}")


@pytest.fixture(scope="session")
def data_folder():
    """Folder of scenes with ground truth."""
    folder = os.environ.get("HPCCD_DATA")
    if not folder:
        pytest.skip("HPCCD_DATA is not set: no folder of scenes with ground truth to compare with")
    return Path(folder)
