# SPDX-License-Identifier: Apache-2.0
"""The promise of --flush: a SIGKILL loses no message that was received longer before it than the given seconds."""

import math
import os
import random
import subprocess
import sys
import threading
import time
from types import SimpleNamespace

import pytest
from bag_tools import STRING, text_message
from sources import SOURCES, SUPPORT

from hpccd_ros.bag.examine import examine
from hpccd_ros.bag.reader import Recording
from hpccd_ros.bag.recover import recover
from hpccd_ros.bag.writer import BagWriter, Topic
from hpccd_ros.record import recorder

FLUSH = 0.15  # s
# Writes a message about every 7 ms, looks as often as a recorder, and prints what is promised to be in the file: the
# last message older than FLUSH when `poll` was called. So the test does not depend on the speed of the machine.
WRITER = f"""
import random, sys, time
from bag_tools import STRING, text_message
from hpccd_ros.bag.writer import BagWriter, Topic
bag = BagWriter(sys.argv[1], flush_interval={FLUSH}, compression=sys.argv[2], sync=sys.argv[3] == "sync")
bag.add_topic(Topic("/text", STRING, []))
generator, times = random.Random(1), []
while True:
    time.sleep(min(generator.choice((0, 0.01, 0.01, 0.1)), bag.until_flush))
    if generator.random() < 0.6:
        times.append(time.monotonic())
        bag.write("/text", text_message(str(len(times))), len(times), len(times))
    promised = time.monotonic() - {FLUSH}
    bag.poll()
    print(sum(at < promised for at in times), len(times), flush=True)
"""


@pytest.mark.parametrize(("compression", "sync"), [("none", "sync"), ("none", "no"), ("zstd", "no")])
def test_killed_at_a_random_moment(tmp_path, compression, sync):
    path = tmp_path / "run.mcap"
    paths = os.pathsep.join([str(SUPPORT), SOURCES])
    writer = subprocess.Popen(
        [sys.executable, "-W", "ignore", "-c", WRITER, str(path), compression, sync],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": paths},
    )
    killed = threading.Event()
    lines = []
    for line in writer.stdout:
        lines.append(line)
        promised, written = map(int, line.split())
        if promised > 20 and not killed.is_set():
            killed.set()
            time.sleep(random.random() / 2)
            writer.kill()
    writer.wait()
    promised, written = map(int, lines[-1].split())
    recover(path, tmp_path / "saved.mcap")
    with Recording(tmp_path / "saved.mcap") as saved:
        there = [message.log_time for message in saved.messages()]
    assert there == list(range(1, len(there) + 1)) and promised <= len(there) <= written + 1


def test_the_recorder_looks_in_time(tmp_path, monkeypatch):
    """While no message comes, it waits no longer than until a flush is due."""
    bag = BagWriter(tmp_path / "run.mcap", flush_interval=FLUSH)
    bag.add_topic(Topic("/text", STRING, []))
    assert bag.until_flush == math.inf
    waits = []

    class Executor:
        def add_node(self, node):
            pass

        def spin_once(self, timeout_sec):
            waits.append((timeout_sec, bag.until_flush))
            if len(waits) == 1:
                bag.write("/text", text_message("x"), 1, 1)
            time.sleep(min(timeout_sec, 0.01))

        def shutdown(self):
            pass

    monkeypatch.setattr(recorder, "SingleThreadedExecutor", Executor)
    spun = SimpleNamespace(
        publishers=lambda topic: 1, topics=[], received={"/c": 0}, lost={}, finish=lambda executor, depth: None
    )
    args = SimpleNamespace(node="/n", duration=0.5, frames=0, depth=1)
    recorder._spin(None, spun, bag, "/c", args, [], list)
    assert waits[0] == (0.1, math.inf) and all(wait <= min(0.1, due + 0.05) for wait, due in waits[1:])
    assert bag.flushed_count == 1 and examine(tmp_path / "run.mcap").message_count == 1
    bag.close()
