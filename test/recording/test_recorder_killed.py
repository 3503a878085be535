# SPDX-License-Identifier: Apache-2.0
"""SIGKILL at any moment: what was flushed is there, the loss is bounded, and the rest verifies."""

import random
import time

import pytest
from bag_tools import read_by_rosbags
from live import Live

from hpccd_ros import replay_setup
from hpccd_ros.mcap_reader import Recording
from hpccd_ros.mcap_recover import examine, recover
from hpccd_ros.replay import Replay

FLUSH = 0.2  # s


@pytest.mark.parametrize("compression", ["none", "zstd"])
def test_killed_at_random_moments(children, namespace, tmp_path, compression):
    live = Live(children, namespace, tmp_path, frames=90)
    live.node()
    live.publisher("--loop", subscribers=1)
    generator = random.Random(5)
    for number in range(4):
        path = tmp_path / f"killed{number}.mcap"
        recorder = live.recorder(path, "--flush", str(FLUSH), "--compression", compression)
        time.sleep(0.5 + generator.random())
        before = time.time_ns()
        live.kill(recorder)

        found = examine(path)
        assert not found.finished and found.message_count > 0
        saved = tmp_path / f"saved{number}.mcap"
        recover(path, saved)
        messages = read_by_rosbags(saved)
        assert len(messages) == found.message_count
        # Bound: the open chunk, closed every FLUSH seconds; what else the loop may take is generous here, because
        # no test should depend on the load of the machine.
        assert (before - messages[-1][2]) * 1e-9 < FLUSH + 1.0
        with Recording(saved) as recording:
            replay = Replay(recording, replay_setup.of_recording(recording))
            list(replay.steps())
        assert replay.diverged == 0 and replay.verified > 0
