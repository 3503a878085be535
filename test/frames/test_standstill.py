# SPDX-License-Identifier: Apache-2.0
"""A frame that waits is worth a warning only where none goes on for a while."""

from hpccd_ros.frames import standstill
from hpccd_ros.frames.standstill import Standstill


def test_it_is_long_where_frames_wait_and_none_goes_on(monkeypatch):
    now = 100.0
    monkeypatch.setattr(standstill.time, "monotonic", lambda: now)
    frames = Standstill()
    assert not frames.long
    for _ in range(3):  # others wait beside the first, which do not put the warning off
        frames.waits()
        now += standstill.LONG / 3
    assert frames.long
    frames.ends()
    assert not frames.long
    frames.waits()
    now += 0.9 * standstill.LONG
    assert not frames.long
