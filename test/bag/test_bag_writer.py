# SPDX-License-Identifier: Apache-2.0
"""Files are what rosbag2 and independent readers expect."""

import sys
import time

import pytest
import yaml
from bag_tools import STRING, read_by_mcap_ros2, read_by_rosbags, text_message, typestore, write_texts
from mcap.reader import make_reader
from rosbags.rosbag2 import Reader

from hpccd_ros.bag import message_definitions, qos_yaml
from hpccd_ros.bag.examine import examine
from hpccd_ros.bag.reader import Recording
from hpccd_ros.bag.writer import BagWriter, Topic

TEXTS = [f"{k:05}" + "x" * 400 for k in range(500)]


@pytest.mark.parametrize("compression", ["none", "lz4", "zstd"])
@pytest.mark.parametrize("chunk_size", [1000, 1 << 20])
def test_independent_readers_find_every_message(tmp_path, compression, chunk_size):
    path = tmp_path / "bag.mcap"
    write_texts(path, TEXTS, compression=compression, chunk_size=chunk_size)
    assert [m.data for *_, m in read_by_rosbags(path)] == TEXTS
    assert [m.data for *_, m in read_by_mcap_ros2(path)] == TEXTS


@pytest.mark.parametrize("limits", [{"max_bytes": 40_000}, {"max_seconds": 0.1}])
def test_split_recordings(tmp_path, limits):
    path = tmp_path / "bag"
    writer = BagWriter(path, chunk_size=5000, **limits)
    writer.add_topic(Topic("/latched", STRING, [], latched=1))
    writer.add_topic(Topic("/text", STRING, []))
    writer.write("/latched", text_message("in force"), 10**18, 10**18)
    for number, text in enumerate(TEXTS):
        writer.write("/text", text_message(text), 10**18 + number * 10**6, 10**18 + number * 10**6)
    writer.close()

    assert len(writer.file_paths) > 3
    for file in writer.file_paths:
        first = read_by_rosbags(file)[0]
        assert (first[0], first[3].data) == ("/latched", "in force"), "each file is complete alone"
    if "max_bytes" in limits:
        assert max(file.stat().st_size for file in writer.file_paths) < 2 * limits["max_bytes"]
    with Reader(path) as reader:  # needs metadata.yaml
        assert reader.message_count == len(TEXTS) + len(writer.file_paths)
    assert [m.data for topic, *_, m in read_by_rosbags(path) if topic == "/text"] == TEXTS
    with Recording(path) as recording:
        assert recording.files == writer.file_paths
        assert recording.topics["/text"].count == len(TEXTS)
        times = [m.log_time for m in recording.messages()]
    assert times == sorted(times)


def test_a_split_takes_no_longer_for_the_files_before_it(tmp_path):
    """Messages that come meanwhile wait in a short queue; counted are Python's calls, which no other load changes."""
    writer = BagWriter(tmp_path / "bag", max_bytes=1)
    writer.add_topic(Topic("/text", STRING, []))
    calls = []

    def count(frame, event, argument):
        if event == "call":
            calls[-1] += 1

    for number in range(200):
        calls.append(0)
        sys.setprofile(count)
        try:
            writer.write("/text", text_message("x"), 10**18 + number, 10**18 + number)
        finally:
            sys.setprofile(None)
    writer.close()
    assert calls[199] < 3 * calls[20], "counts of all files are added up, nothing more"
    bag = yaml.safe_load((tmp_path / "bag" / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert bag["relative_file_paths"] == [f"bag_{number}.mcap" for number in range(200)]
    assert bag["message_count"] == 200 and len(bag["files"]) == 200
    begins = [file["starting_time"]["nanoseconds_since_epoch"] for file in bag["files"]]
    assert begins == [10**18 + number for number in range(200)]


def test_metadata_for_rosbag2(tmp_path):
    path = tmp_path / "bag.mcap"
    writer = BagWriter(path)
    qos = [
        {
            "history": "keep_last",
            "depth": 3,
            "reliability": "reliable",
            "durability": "transient_local",
            "deadline": qos_yaml.INFINITE,
            "lifespan": qos_yaml.INFINITE,
            "liveliness": "automatic",
            "liveliness_lease_duration": qos_yaml.INFINITE,
            "avoid_ros_namespace_conventions": False,
        }
    ]
    writer.add_topic(Topic("/contacts", "hpccd/msg/ContactArray", qos))
    writer.close()
    with open(path, "rb") as stream:
        reader = make_reader(stream)
        assert reader.get_header().profile == "ros2"
        summary = reader.get_summary()
        (channel,) = summary.channels.values()
        assert summary.schemas[channel.schema_id].encoding == "ros2msg"
        assert channel.message_encoding == "cdr"
        assert yaml.safe_load(channel.metadata["offered_qos_profiles"]) == qos
        assert channel.metadata["topic_type_hash"] == typestore().hash_rihs01("hpccd/msg/ContactArray")
        records = {record.name: record.metadata for record in reader.iter_metadata()}
    bag = yaml.safe_load(records["rosbag2"]["serialized_metadata"])
    assert bag["version"] == 9
    assert bag["topics_with_message_count"][0]["topic_metadata"]["type"] == "hpccd/msg/ContactArray"


def test_definitions_hold_every_nested_type():
    text = message_definitions.definition_text("hpccd/msg/ContactArray")
    assert text.count(message_definitions.SEPARATOR) == 2
    assert "MSG: std_msgs/Header\n" in text and "MSG: builtin_interfaces/Time\n" in text


def test_unknown_type_is_rejected_before_anything_is_written(tmp_path):
    writer = BagWriter(tmp_path / "bag.mcap")
    with pytest.raises(LookupError, match="nowhere_msgs/msg/Nothing not found"):
        writer.add_topic(Topic("/x", "nowhere_msgs/msg/Nothing", []))
    writer.close()
    with Recording(tmp_path / "bag.mcap") as recording:
        assert not recording.topics


def test_recordings_are_not_overwritten(tmp_path):
    path = tmp_path / "bag.mcap"
    write_texts(path, TEXTS[:3])
    before = path.read_bytes()
    with pytest.raises(FileExistsError, match="not overwritten"):
        BagWriter(path)
    assert path.read_bytes() == before


def test_a_single_file_cannot_be_split(tmp_path):
    with pytest.raises(ValueError, match="give a folder"):
        BagWriter(tmp_path / "bag.mcap", max_bytes=1000)


def test_unknown_compression(tmp_path):
    with pytest.raises(ValueError, match="'bzip2' is none of none, lz4, zstd"):
        BagWriter(tmp_path / "bag.mcap", compression="bzip2")


def test_files_that_came_to_be_needed_later_are_found_and_none_is_overwritten(tmp_path):
    path = tmp_path / "bag"
    writer = BagWriter(path, max_bytes=1, attachments=[("robot/arm/semantics.srdf", b"first")])
    writer.add_topic(Topic("/text", STRING, []))
    for number in range(3):
        writer.write("/text", text_message("text"), 10**18 + number, 10**18 + number)
        assert writer.attach("late", b"late") and writer.attach(f"{number}", b"any")
        assert not writer.attach("late", b"another")
    writer.close()
    assert len(writer.file_paths) == 3
    with Recording(path) as recording:
        assert recording.attachments == {
            "robot/arm/semantics.srdf": b"first",
            "late": b"late",
            "0": b"any",
            "1": b"any",
            "2": b"any",
        }


@pytest.mark.parametrize("compression", ["none", "zstd"])
def test_an_open_chunk_is_closed_in_time(tmp_path, monkeypatch, compression):
    """A killed process loses at most the messages of the last flush_interval."""
    now = 100.0
    monkeypatch.setattr(time, "monotonic", lambda: now)
    path = tmp_path / "bag.mcap"
    writer = BagWriter(path, compression=compression, flush_interval=0.2)
    writer.add_topic(Topic("/text", STRING, []))
    writer.write("/text", text_message("one"), 1, 1)
    now += 0.19
    writer.poll()
    assert examine(path).message_count == 0
    now += 0.02
    writer.poll()
    assert examine(path).message_count == 1
    now += 0.21
    writer.write("/text", text_message("two"), 2, 2)  # without poll
    assert examine(path).message_count == 2
    writer.close()
