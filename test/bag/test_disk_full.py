# SPDX-License-Identifier: Apache-2.0
"""A disk that rejects ends no recorder: what was whole stays, what was lost is counted, and it goes on with space."""

import contextlib
import random
import resource

import pytest
import yaml
from bag_tools import STRING, read_by_rosbags, text_message

from hpccd_ros.bag.examine import examine
from hpccd_ros.bag.recover import recover
from hpccd_ros.bag.writer import BagWriter, Topic

TEXT = random.Random(6).randbytes(500).hex()  # compresses by half at most


@contextlib.contextmanager
def _largest_file(size):
    """The system lets no file of this process grow beyond `size` bytes, as a full disk does."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def _write(bag, first, count):
    for number in range(first, first + count):
        bag.write("/text", text_message(f"{number:05}{TEXT}"), 10**18 + number, 10**18 + number, number)


def _bag(path, **options):
    bag = BagWriter(path, chunk_size=5000, **options)
    bag.add_topic(Topic("/latched", STRING, [], latched=1))
    bag.add_topic(Topic("/text", STRING, []))
    bag.write("/latched", text_message("in force"), 10**18, 10**18)
    return bag


def _texts(path):
    return [int(m.data[:5]) for topic, *_, m in read_by_rosbags(path) if topic == "/text"]


@pytest.mark.parametrize("name", ["run.mcap", "run"])
@pytest.mark.parametrize("compression", ["none", "lz4"])
def test_goes_on_in_a_new_file(tmp_path, name, compression):
    bag = _bag(tmp_path / name, compression=compression, retry_interval=0.0)
    _write(bag, 0, 20)
    assert (bag.write_errors, bag.failing) == (0, False)
    with _largest_file(bag.size + 2000):
        _write(bag, 20, 200)
        assert bag.write_errors > 0 and "File too large" in bag.last_error
    _write(bag, 30_000, 50)
    bag.close()

    assert len(bag.torn_files) >= 1 and not bag.failing
    kept = []
    for path in bag.file_paths:
        if path in bag.torn_files:
            found = examine(path)
            assert not found.finished and found.readable == found.size, "ends behind a whole record"
            saved = path.with_suffix(".saved.mcap")
            recover(path, saved)
            path = saved
        kept += _texts(path)
        assert read_by_rosbags(path)[0][3].data == "in force", "each file is complete alone"
    assert kept == sorted(set(kept)) and set(range(30_000, 30_050)) < set(kept)
    # Every message is in a file or counted; nothing else.
    assert len(kept) + bag.not_written["/text"] == 20 + 200 + 50
    if name == "run":
        finished = [path.name for path in bag.file_paths if path not in bag.torn_files]
        listed = yaml.safe_load((tmp_path / "run" / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
        assert listed["relative_file_paths"] == finished and listed["message_count"] >= 50


def test_waits_before_it_tries_again(tmp_path):
    bag = _bag(tmp_path / "run.mcap", retry_interval=3600.0)
    with _largest_file(3000):
        _write(bag, 0, 50)
    _write(bag, 50, 50)
    assert bag.failing and bag.write_errors == 1 and bag.not_written["/text"] == 100
    bag.close()
    assert bag.message_count == 0 and not bag.file_paths and not list(tmp_path.iterdir())


def test_full_when_it_is_closed(tmp_path):
    bag = _bag(tmp_path / "run.mcap")
    _write(bag, 0, 3)
    with _largest_file(bag.size + 100):
        bag.close()
    assert bag.write_errors == 1 and bag.not_written == {"/latched": 1, "/text": 3}
