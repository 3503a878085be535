# SPDX-License-Identifier: Apache-2.0
"""MCAP files with right check sums that lie about themselves, and what is no file at all."""

import dataclasses
import os
import resource
import shutil
import signal
import socket
import struct
import tracemalloc

import pytest
from hostile_container import BOMB, zeros
from in_process import hpccd
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, ChunkIndex, Statistics
from mcap_model import Bag, as_bytes, raw_record

from hpccd_ros.bag.examine import examine
from hpccd_ros.bag.mcap_records import MOST_RECORDS, inside
from hpccd_ros.bag.reader import Recording, RecordingError
from hpccd_ros.bag.recover import recover


@pytest.fixture
def bag(sound_bags):
    return Bag.read(sound_bags / "streams.mcap")


def _called_damaged(path, *says):
    """By doctor (status 1) and replay (2), neither with a traceback, and recovered to a file that is sound."""
    examined, replayed = hpccd("doctor", path), hpccd("replay", path)
    assert examined.status == 1 and "DAMAGED" in examined.out, examined
    assert replayed.status == 2 and " is damaged (" in replayed.err and replayed.err.count("\n") == 1, replayed
    for word in says:
        assert word in examined.out and word in replayed.err, (examined.out, replayed.err)
    saved = path.with_name("saved.mcap")
    assert hpccd("doctor", path, "--recover", saved).status == 0 and examine(saved).sound


def _special_files(folder):
    """A pipe, a device and a socket."""
    fifo, link, listening = folder / "fifo.mcap", folder / "device.mcap", folder / "socket.mcap"
    os.mkfifo(fifo)
    link.symlink_to("/dev/zero")
    server = socket.socket(socket.AF_UNIX)
    server.bind(str(listening))
    server.close()
    return fifo, link, listening


@pytest.mark.timeout(60)  # it was a hang
def test_what_is_no_file_is_rejected_at_once(tmp_path):
    (tmp_path / "in").mkdir()
    for path in (*_special_files(tmp_path / "in"), tmp_path / "in"):
        for command in (
            ("doctor", path),
            ("doctor", path, "--recover", tmp_path / "out.mcap"),
            ("replay", path),
            ("replay", path, "--publish"),
            ("view", path),
        ):
            if path.is_dir() and "--recover" in command:
                continue
            done = hpccd(*command)
            assert done.status == 2 and "is not a regular file" in done.err and not done.traceback, done


def test_a_folder_in_place_of_a_file(tmp_path, small_bag):
    (tmp_path / "run" / "run_0.mcap").mkdir(parents=True)
    assert "is not a regular file" in hpccd("replay", tmp_path / "run").err
    # Digits, but no number.
    shutil.copy(small_bag, tmp_path / "run_².mcap")
    shutil.rmtree(tmp_path / "run")
    assert hpccd("doctor", tmp_path).status == 0


def test_a_file_that_cannot_be_read(tmp_path):
    (tmp_path / "x.mcap").symlink_to("/proc/self/mem")  # a plain file by its status; every read fails
    for command in ("doctor", "replay", "view"):
        done = hpccd(command, tmp_path / "x.mcap")
        assert done.status in (1, 2) and not done.traceback, done


def test_names_that_are_no_text(tmp_path, small_bag, hpccd):
    name = os.fsdecode(b"\xff\x1b.mcap")
    shutil.copy(small_bag, tmp_path / name)
    for command in ("doctor", "replay"):
        done = hpccd(command, name)  # a process: its own output is the one that counts
        assert done.returncode == 0 and "Traceback" not in done.stderr, done.stderr


def test_topics_cannot_write_to_the_terminal(bag, tmp_path):
    bag.channels[0].topic, bag.library = "/x\x1b[2J\n", "y\x1b[31m"
    done = hpccd("doctor", bag.write(tmp_path / "x.mcap"))
    assert "\x1b" not in done.out and r"/x\x1b[2J\n" in done.out


def test_a_topic_without_a_name_is_not_that_of_the_results(bag, tmp_path):
    bag.channel("/contacts").topic = ""
    replayed = hpccd("replay", bag.write(tmp_path / "x.mcap"))
    assert replayed.status == 0 and "VERIFIED:" not in replayed.out
    assert "the recording has no contacts" in replayed.out


@pytest.mark.parametrize("body", [b"", struct.pack("<HI", 1, 16), struct.pack("<HI", 1, 15) + bytes(15)])
def test_an_index_of_messages_that_is_not_whole(bag, tmp_path, body):
    """It is not needed to replay, but other readers fall over it."""
    bag.data = lambda records: [*records[:-1], raw_record(Opcode.MESSAGE_INDEX, body), records[-1]]
    path = bag.write(tmp_path / "x.mcap")
    assert hpccd("doctor", path).status == 1
    _called_damaged(path)


def _indexed(change):
    """A function for `Bag.index` that changes copies of its records."""
    return lambda records: change([dataclasses.replace(record) for record in records])


def _first(records, kind):
    return next(record for record in records if isinstance(record, kind))


def test_an_index_that_leaves_a_chunk_out(bag, tmp_path):
    """The results in that chunk would not be verified, in silence."""

    def change(records):
        left_out = _first(records, ChunkIndex)
        return [record for record in records if record is not left_out]

    bag.index = _indexed(change)
    _called_damaged(bag.write(tmp_path / "x.mcap"), "the index is wrong about the chunk at byte")


def test_an_index_that_names_a_chunk_twice(bag, tmp_path):
    bag.index = lambda records: [*records, _first(records, ChunkIndex)]
    _called_damaged(bag.write(tmp_path / "x.mcap"), "the index is wrong about the chunk at byte")


def test_an_index_with_other_topics_than_the_data(bag, tmp_path):
    def change(records):
        one, two = [r for r in records if isinstance(r, Channel) and r.topic.endswith("vertices")]
        one.topic, two.topic = two.topic, one.topic
        return records

    bag.index = _indexed(change)
    _called_damaged(bag.write(tmp_path / "x.mcap"), "is described twice, differently")


def test_an_index_that_leaves_a_topic_out(bag, tmp_path):
    bag.index = _indexed(lambda records: [r for r in records if not isinstance(r, Channel) or r.topic != "/contacts"])
    _called_damaged(bag.write(tmp_path / "x.mcap"), "the index does not describe channel 5")


def test_an_index_that_tells_of_fewer_messages(bag, tmp_path):
    """Without its results a recording is only computed."""
    contacts = bag.channel("/contacts").id

    def change(records):
        statistics = _first(records, Statistics)
        counts = statistics.channel_message_counts
        statistics.channel_message_counts = {n: count for n, count in counts.items() if n != contacts}
        return records

    bag.index = _indexed(change)
    _called_damaged(bag.write(tmp_path / "x.mcap"), "the index lists 0 messages of channel 5, the file has 7")


def test_a_footer_that_points_elsewhere(bag, tmp_path):
    for start in (1, 8, 100, 2**63):
        bag.footer = lambda footer, start=start: dataclasses.replace(footer, summary_start=start)
        examined = hpccd("doctor", bag.write(tmp_path / "x.mcap"))
        replayed = hpccd("replay", tmp_path / "x.mcap")
        assert examined.status == 1 and replayed.status == 2 and " is damaged (" in replayed.err
    bag.footer = lambda footer: dataclasses.replace(footer, summary_start=0)
    examined, replayed = hpccd("doctor", bag.write(tmp_path / "x.mcap")), hpccd("replay", tmp_path / "x.mcap")
    assert examined.status == 1 and "the data ends at byte" in examined.out and replayed.status == 2


def test_the_check_sums_of_index_and_attachments_are_looked_at(sound_bags, tmp_path):
    data = bytearray((sound_bags / "everything.mcap").read_bytes())
    end = data.rindex(b"/meshes/net/points")  # in the index
    for at, says in ((end, "crc"), (data.index(b"v 2 2 0.01"), "crc")):
        changed = bytearray(data)
        changed[at] ^= 1
        (tmp_path / "x.mcap").write_bytes(changed)
        _called_damaged(tmp_path / "x.mcap", says)
        (tmp_path / "saved.mcap").unlink()


def test_a_channel_described_twice(bag, tmp_path):
    """Its messages go on under the second description; `--recover` keeps both."""
    one, two = (c for c in bag.channels if c.topic.endswith("vertices"))
    other = dataclasses.replace(one, topic="/other", metadata=dict(two.metadata))
    done = []
    bag.inside = lambda records: records if not done and not done.append(1) else [other, *records]
    _called_damaged(bag.write(tmp_path / "x.mcap"), f"channel {one.id} is described twice, differently")
    with Recording(tmp_path / "saved.mcap") as saved:
        assert saved.message_count == len(bag.messages) and saved.topics["/other"].count > 0


def test_messages_of_no_channel(bag, tmp_path):
    bag.messages[-1].channel_id = 99
    examined, replayed = hpccd("doctor", bag.write(tmp_path / "x.mcap")), hpccd("replay", tmp_path / "x.mcap")
    assert examined.status == 1 and "1 messages of channels that nothing describes" in examined.out
    assert replayed.status == 2 and "the index does not describe channel 99" in replayed.err


def test_times_of_a_chunk_that_are_not_those_of_its_messages(bag, tmp_path):
    """By them chunks are put into order."""
    bag.chunk = lambda chunk: dataclasses.replace(chunk, message_start_time=chunk.message_end_time)
    _called_damaged(bag.write(tmp_path / "x.mcap"), "outside of its times")


@pytest.mark.parametrize("compression", ["zstd", "lz4"])
@pytest.mark.parametrize("says", [0, 1000, 2**33, 2**64 - 1])
def test_a_chunk_is_unpacked_no_farther_than_it_says(compression, says):
    chunk = Chunk(compression, zeros(compression, BOMB), 0, 0, 0, says)
    tracemalloc.start()
    try:
        with pytest.raises(McapError, match="a chunk of .* bytes"):
            list(inside(chunk))
        assert tracemalloc.get_traced_memory()[1] < BOMB / 10
    finally:
        tracemalloc.stop()


def test_a_chunk_of_too_many_records():
    data = raw_record(0x7F, b"") * (MOST_RECORDS + 1)
    with pytest.raises(McapError, match="a chunk of more than"):
        list(inside(Chunk("", data, 0, 0, 0, len(data))))


@pytest.mark.parametrize("length", [0, 10, 21, 2**31, 2**63, 2**64 - 1])
def test_lengths_of_records_inside_a_chunk(bag, tmp_path, length):
    done = []
    strange = raw_record(Opcode.MESSAGE, b"\1" * 10, length)
    bag.inside = lambda records: records if done else [*records, done.append(1) or strange]
    _called_damaged(bag.write(tmp_path / "x.mcap"))


@pytest.mark.parametrize("size", [1, 2**31, 2**63, 2**64 - 1])
def test_sizes_of_attachments(bag, tmp_path, size):
    raw = bytearray(as_bytes(Attachment(0, 0, "mesh/x/x.obj", "", b"v 0 0 0\n")))
    struct.pack_into("<Q", raw, 9 + 16 + 4 + 12 + 4, size)
    bag.data = lambda records: [records[0], bytes(raw), *records[1:]]
    path = bag.write(tmp_path / "x.mcap")
    examined, replayed = hpccd("doctor", path), hpccd("replay", path)
    assert examined.status == 1 and replayed.status == 2 and not (examined.traceback or replayed.traceback)


def test_a_file_without_its_header(bag, tmp_path):
    bag.data = lambda records: records[1:]
    _called_damaged(bag.write(tmp_path / "x.mcap"), "no header at the beginning")


def test_a_full_disk_is_no_damage(sound_bags, tmp_path):
    """What the new file cannot take must not be said of the old one."""
    old = resource.getrlimit(resource.RLIMIT_FSIZE)
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, old[1]))
        done = hpccd("doctor", sound_bags / "streams.mcap", "--recover", tmp_path / "saved.mcap")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, old)
    assert done.status == 2 and "--recover" in done.err and "File too large" in done.err, done
    assert not (tmp_path / "saved.mcap").exists()


def test_a_recovery_that_fails_leaves_no_file(bag, tmp_path):
    bag.schemas[0].name = "x"
    path = bag.write(tmp_path / "x.mcap")
    with pytest.raises(ValueError, match="compression"):
        recover(path, tmp_path / "saved.mcap", "gzip")
    assert not (tmp_path / "saved.mcap").exists()


def test_messages_far_out_of_order_do_not_fill_the_memory(bag, tmp_path, monkeypatch):
    monkeypatch.setattr("hpccd_ros.bag.mcap_file.MOST_WAITING", 50_000)
    times = [message.log_time for message in bag.messages]
    for number, message in enumerate(bag.messages):
        message.log_time = min(times) if number % 4 == 0 else max(times)
    bag.chunk_bytes = 10_000
    with (
        Recording(bag.write(tmp_path / "x.mcap")) as recording,
        pytest.raises(RecordingError, match="not in the order"),
    ):
        list(recording.messages())


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"compression": "gzip"}, "gzip"),
        ({"uncompressed_size": 2**33, "uncompressed_crc": 0}, "a chunk of 8,589,934,592 bytes, more than"),
        ({"uncompressed_size": 2**64 - 1, "uncompressed_crc": 0}, "bytes, more than"),
    ],
)
def test_a_chunk_that_cannot_be_unpacked(sound_bags, tmp_path, change, says):
    bag, which = Bag.read(sound_bags / "streams.mcap"), iter(range(1000))
    bag.compression = "zstd"
    bag.chunk = lambda chunk: dataclasses.replace(chunk, **change) if next(which) == 1 else chunk
    path = bag.write(tmp_path / "x.mcap")
    examined, replayed = hpccd("doctor", path), hpccd("replay", path)
    assert not examined.traceback and not replayed.traceback
    assert examined.status == 1 and "DAMAGED" in examined.out and says in examined.out, examined
    assert replayed.status == 2 and says in replayed.err, replayed
