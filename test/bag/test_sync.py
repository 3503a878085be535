# SPDX-License-Identifier: Apache-2.0
"""Recordings that outlast power: all that was synced is recovered, no sync delays a message, and a failed one is
counted and its file not trusted."""

import errno
import os
import threading

import pytest
import yaml
from bag_tools import STRING, read_by_rosbags, text_message

from hpccd_ros.bag.examine import examine
from hpccd_ros.bag.recover import recover
from hpccd_ros.bag.writer import BagWriter, Topic

PATIENCE = 60.0


@pytest.fixture
def disk(monkeypatch):
    return _Disk(monkeypatch)


class _Disk:
    """Replaces fsync and fdatasync. durable: path -> content, as a power failure leaves it. names: folder -> durable
    names in it. errors: how many of the next syncs of files fail. blocked: when set, syncs of files wait for `go_on`.
    """

    def __init__(self, monkeypatch):
        self.durable: dict[str, bytes] = {}
        self.names: dict[str, set[str]] = {}
        self.errors = 0
        self.blocked, self.go_on = threading.Event(), threading.Event()
        monkeypatch.setattr(os, "fdatasync", self._sync)
        monkeypatch.setattr(os, "fsync", self._sync)

    def _sync(self, descriptor):
        path = os.readlink(f"/proc/self/fd/{descriptor}")
        if os.path.isdir(path):
            self.names[path] = set(os.listdir(path))
            return
        if self.blocked.is_set():
            assert self.go_on.wait(PATIENCE)
        if self.errors:
            self.errors -= 1
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        with open(path, "rb") as stream:
            self.durable[path] = stream.read()


def _bag(path, **options):
    bag = BagWriter(path, sync=True, **options)
    bag.add_topic(Topic("/text", STRING, []))
    return bag


def _write(bag, numbers):
    for number in numbers:
        bag.write("/text", text_message(f"{number:04}"), 10**18 + number, 10**18 + number, number)


def _synced(bag, count):
    """Wait until the thread has made `count` messages durable."""
    deadline = threading.Event()
    for _ in range(int(PATIENCE / 0.01)):
        if bag.synced_count >= count:
            return
        deadline.wait(0.01)
    pytest.fail(f"{bag.synced_count} of {count} messages are durable")


@pytest.mark.parametrize("tail", [b"", bytes(5000), os.urandom(5000)], ids=["cut", "zeros", "garbage"])
@pytest.mark.parametrize("compression", ["none", "zstd"])
def test_what_was_synced_outlasts_power(disk, tmp_path, tail, compression):
    path = tmp_path / "run.mcap"
    bag = _bag(path, flush_interval=1e9, compression=compression)
    _write(bag, range(50))
    bag.flush()
    _synced(bag, 50)
    _write(bag, range(50, 80))
    after_the_failure = tmp_path / "left.mcap"
    after_the_failure.write_bytes(disk.durable[str(path)] + tail)
    assert "run.mcap" in disk.names[str(tmp_path)], "its name is durable too"
    recover(after_the_failure, tmp_path / "saved.mcap")
    assert [int(m.data) for *_, m in read_by_rosbags(tmp_path / "saved.mcap")] == list(range(50))
    bag.close()
    assert disk.durable[str(path)] == path.read_bytes() and bag.synced_count == bag.message_count == 80
    assert (bag.write_errors, bag.not_synced) == (0, 0) and examine(path).sound


def test_a_folder_outlasts_power_with_its_list(disk, tmp_path):
    path = tmp_path / "new" / "run"
    bag = _bag(path, max_bytes=200)
    _write(bag, range(60))
    bag.close()
    assert len(bag.file_paths) > 3 and bag.synced_count == bag.message_count
    for file in (*bag.file_paths, path / "metadata.yaml"):
        durable = disk.durable.get(str(file), disk.durable.get(f"{file}.part"))
        assert durable == file.read_bytes()
        assert file.name in disk.names[str(path)]
    assert "new" in disk.names[str(tmp_path)] and "run" in disk.names[str(tmp_path / "new")]


def test_no_message_waits_for_a_sync(disk, tmp_path):
    bag = _bag(tmp_path / "run", flush_interval=0.0, max_bytes=200)
    disk.blocked.set()
    _write(bag, range(100))  # would not end
    assert bag.flushed_count == 100 and bag.synced_count == 0 and len(bag.file_paths) > 3
    disk.go_on.set()
    bag.close()
    assert bag.synced_count == 100 and bag.write_errors == 0


def test_a_file_that_could_not_be_synced_is_not_trusted(disk, tmp_path):
    path = tmp_path / "run.mcap"
    bag = _bag(path, flush_interval=1e9, retry_interval=3600.0)
    _write(bag, range(10))
    bag.flush()
    _synced(bag, 10)
    disk.errors = 1
    _write(bag, range(10, 15))
    bag.flush()
    while not bag.write_errors:
        bag.poll()
    assert bag.last_error == f"Input/output error: {path}" and bag.not_synced == 5
    assert bag.torn_files == [path]
    _write(bag, range(15, 20))  # at once into a new file
    assert bag.not_written.total() == 0 and len(bag.file_paths) == 2
    disk.errors = 1
    bag.flush()
    while bag.write_errors < 2:
        bag.poll()
    _write(bag, range(20, 25))  # not at once again: there would be a file for each sync
    assert bag.failing and bag.not_written["/text"] == 5 and bag.not_synced == 10
    bag.close()
    assert bag.synced_count == 10 and bag.message_count == 20


def test_the_last_sync_of_a_file_that_fails(disk, tmp_path):
    bag = _bag(tmp_path / "run", flush_interval=1e9, max_bytes=200)
    disk.errors = 1
    _write(bag, range(60))
    bag.close()
    (torn,) = bag.torn_files
    assert bag.write_errors == 1 and bag.not_synced > 0
    listed = yaml.safe_load((tmp_path / "run" / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert listed["relative_file_paths"] == [path.name for path in bag.file_paths if path != torn]


def test_a_list_of_files_that_cannot_be_written(tmp_path):
    """The recording goes on, and the list is written at the end."""
    bag = BagWriter(tmp_path / "run", max_bytes=200)
    bag.add_topic(Topic("/text", STRING, []))
    (tmp_path / "run" / "metadata.yaml.part").mkdir()
    _write(bag, range(30))
    assert bag.write_errors > 0 and bag.last_error.endswith("run/metadata.yaml") and not bag.failing
    (tmp_path / "run" / "metadata.yaml.part").rmdir()
    bag.close()
    assert bag.not_written.total() == 0 and not bag.torn_files
    listed = yaml.safe_load((tmp_path / "run" / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert len(listed["relative_file_paths"]) == len(bag.file_paths) and listed["message_count"] == 30


def test_a_recording_that_cannot_begin_leaves_nothing(tmp_path, monkeypatch):
    def fails(descriptor):
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    monkeypatch.setattr(os, "fsync", fails)
    with pytest.raises(OSError, match="Input/output error: .*" + str(tmp_path)):
        BagWriter(tmp_path / "run", sync=True)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("call", ["stat", "close"])
def test_reading_a_recording_on_a_failing_disk(small_bag, tmp_path, monkeypatch, call):
    """A stat that fails is an error with a sentence; a close that fails after reading means nothing."""
    from in_process import hpccd

    if call == "stat":
        real = os.stat

        def fails(path, *args, **kwargs):
            if str(path) == str(small_bag):
                raise OSError(errno.EIO, os.strerror(errno.EIO), path)
            return real(path, *args, **kwargs)

        monkeypatch.setattr(os, "stat", fails)
        done = hpccd("doctor", small_bag)
        assert done.status == 2 and f"{small_bag} cannot be read: Input/output error" in done.err, done
        return

    class Stream:
        def __init__(self, path, mode):
            self._stream = open(path, mode)

        def __getattr__(self, name):
            return getattr(self._stream, name)

        def close(self):
            self._stream.close()
            raise OSError(errno.EIO, os.strerror(errno.EIO))

    monkeypatch.setattr("hpccd_ros.bag.mcap_records.open", Stream, raising=False)
    assert hpccd("doctor", small_bag).status == 0
