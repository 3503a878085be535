# SPDX-License-Identifier: Apache-2.0
import pytest

from hpccd_ros.frames import standstill


@pytest.fixture
def warned_at_once(monkeypatch):
    """Frames that wait are told of without a delay."""
    monkeypatch.setattr(standstill, "LONG", 0.0)
