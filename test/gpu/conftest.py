# SPDX-License-Identifier: Apache-2.0
import pytest

import hpccd_core as hc


@pytest.fixture(autouse=True)
def _needs_gpu():
    status = hc.gpu_status()
    if not status["devices"]:
        pytest.skip(f"no usable GPU: {status['reason']}")
