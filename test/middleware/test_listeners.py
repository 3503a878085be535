# SPDX-License-Identifier: Apache-2.0
"""A stream begins when its readers have its first message, not when its publisher knows of them."""

import os
import select
import signal
import subprocess
import sys
import time

import pytest
import rclpy
from node_process import PATIENCE
from rclpy.qos import QoSProfile
from std_msgs.msg import UInt32

from hpccd_ros.middleware import environment
from hpccd_ros.middleware.listeners import await_acknowledged, await_subscribers

READER = """
from hpccd_ros.middleware import environment
environment.prepare()
import rclpy
from rclpy.qos import QoSProfile
from std_msgs.msg import UInt32
rclpy.init()
node = rclpy.create_node("reader")
hear = lambda message: print(message.data, flush=True)
node.create_subscription(UInt32, "listeners/numbers", hear, QoSProfile(depth=10))
while rclpy.ok():
    # Not rclpy.spin: on a busy machine it sometimes misses that a message arrived, and sleeps until the next event.
    rclpy.spin_once(node, timeout_sec=0.1)
"""


# Prints how long the first messages of several topics took to be acknowledged, one after the other.
WRITER = """
import pathlib, sys
from hpccd_ros.middleware import environment
environment.prepare()
environment.shorten_heartbeats(pathlib.Path(sys.argv[1]))
import rclpy
from hpccd_ros.middleware.listeners import await_acknowledged, await_subscribers
from rclpy.qos import QoSProfile
from std_msgs.msg import UInt32
rclpy.init()
node = rclpy.create_node("writer")
publishers = [node.create_publisher(UInt32, "listeners/numbers", QoSProfile(depth=10)) for k in range(4)]
assert not await_subscribers(dict(enumerate(publishers)), 1, float(sys.argv[2]))
waited = 0
for k, publisher in enumerate(publishers):
    publisher.publish(UInt32(data=k))
    waited += await_acknowledged([publisher], float(sys.argv[2]))
print(waited)
"""


@pytest.fixture
def publisher():
    environment.prepare()
    context = rclpy.Context()
    rclpy.init(context=context)
    node = rclpy.create_node("writer", context=context)
    yield node.create_publisher(UInt32, "listeners/numbers", QoSProfile(depth=10))
    node.destroy_node()
    rclpy.shutdown(context=context)


@pytest.fixture
def reader():
    process = subprocess.Popen([sys.executable, "-c", READER], stdout=subprocess.PIPE, text=True)
    yield process
    process.send_signal(signal.SIGCONT)
    process.send_signal(signal.SIGTERM)
    process.communicate()


def heard(reader):
    """The next number that the reader has heard."""
    assert select.select([reader.stdout], [], [], PATIENCE)[0], "the reader acknowledged a message that it did not take"
    return int(os.read(reader.stdout.fileno(), 2))


def test_nobody_listens(publisher):
    assert await_subscribers({"a": publisher}, 1, 0.1) == {"a": 0}
    publisher.publish(UInt32(data=0))
    assert await_acknowledged([publisher], PATIENCE) < 1.0, "nobody is waited for"


def test_a_signal_ends_the_wait(publisher):
    began = time.monotonic()
    assert await_subscribers({"a": publisher}, 1, PATIENCE, stop=[signal.SIGINT]) == {"a": 0}
    assert time.monotonic() - began < PATIENCE / 2


def test_readers_that_have_not_got_it_are_waited_for(publisher, reader):
    assert await_subscribers({"a": publisher}, 1, PATIENCE) == {}
    assert await_subscribers({"a": publisher}, 2, 0.1) == {"a": 1}
    publisher.publish(UInt32(data=1))
    assert await_acknowledged([publisher], PATIENCE) < PATIENCE
    assert heard(reader) == 1

    reader.send_signal(signal.SIGSTOP)
    publisher.publish(UInt32(data=2))
    assert await_acknowledged([publisher], 0.5) >= 0.5, "a process that stands still acknowledges nothing"
    assert await_acknowledged([publisher], PATIENCE, stop=[signal.SIGINT]) < PATIENCE / 2
    reader.send_signal(signal.SIGCONT)
    assert await_acknowledged([publisher], PATIENCE) < PATIENCE
    assert heard(reader) == 2


def test_publishers_with_short_heartbeats_wait_for_no_default_one(reader, tmp_path):
    """That comes every 3 s, for each of the four topics."""
    writer = [sys.executable, "-c", WRITER, str(tmp_path), str(PATIENCE)]
    done = subprocess.run(writer, capture_output=True, text=True, timeout=2 * PATIENCE)
    assert done.returncode == 0, done.stderr
    assert float(done.stdout) < 6.0
    assert sorted(heard(reader) for _ in range(4)) == [0, 1, 2, 3]


@pytest.mark.parametrize("name", ["mine.xml", "fastdds.xml"])
def test_a_profile_of_the_user_stays_as_it_is(tmp_path, monkeypatch, name):
    monkeypatch.setenv("FASTRTPS_DEFAULT_PROFILES_FILE", str(tmp_path / name))
    environment.shorten_heartbeats(tmp_path)
    assert os.environ["FASTRTPS_DEFAULT_PROFILES_FILE"] == str(tmp_path / name)
    assert not list(tmp_path.iterdir())
