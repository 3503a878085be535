# SPDX-License-Identifier: Apache-2.0
"""Files that cannot be used give one clear error, whatever is wrong with them."""

import dataclasses
import random

import pytest
from bag_tools import STRING, text_message, write_texts
from mcap.writer import Writer

from hpccd_ros.bag.decode import make_decoder
from hpccd_ros.bag.reader import Recording, RecordingError
from hpccd_ros.bag.writer import BagWriter, Topic


@pytest.fixture
def bag(tmp_path):
    path = tmp_path / "bag.mcap"
    write_texts(path, [f"{k:04}" * 20 for k in range(200)], chunk_size=2000, info={"a": 1})
    return path


def _read(path):
    with Recording(path) as recording:
        return [message.data for message in recording.messages()]


def test_not_there(tmp_path):
    with pytest.raises(RecordingError, match=r"nothing\.mcap does not exist"):
        Recording(tmp_path / "nothing.mcap")


def test_folder_without_recordings(tmp_path):
    with pytest.raises(RecordingError, match=r"has no \.mcap file"):
        Recording(tmp_path)


@pytest.mark.parametrize(
    ("content", "message"),
    [(b"", "is empty"), (b"SQLite format 3\0", "is not an MCAP file"), (b"\x89MCAP", "is not an MCAP file")],
)
def test_foreign_files(tmp_path, content, message):
    (tmp_path / "x.mcap").write_bytes(content)
    with pytest.raises(RecordingError, match=message):
        Recording(tmp_path / "x.mcap")


def test_foreign_profile(tmp_path):
    with open(tmp_path / "x.mcap", "wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros1")
        writer.finish()
    with pytest.raises(RecordingError, match="profile 'ros1'"):
        Recording(tmp_path / "x.mcap")


def test_cut_anywhere(bag):
    """Not one length of a cut file is taken for a whole one."""
    data = bag.read_bytes()
    cut = bag.with_name("cut.mcap")
    generator = random.Random(1)
    for length in {8, 9, 50, len(data) - 1, len(data) - 8, len(data) - 9, *generator.sample(range(8, len(data)), 60)}:
        cut.write_bytes(data[:length])
        with pytest.raises(RecordingError, match="cut off.*hpccd doctor"):
            Recording(cut)


def test_a_flipped_bit_is_an_error_or_harmless(bag):
    data, whole = bag.read_bytes(), _read(bag)
    flipped = bag.with_name("flipped.mcap")
    generator = random.Random(2)
    errors = 0
    for position in generator.sample(range(8, len(data) - 8), 300):
        copy = bytearray(data)
        copy[position] ^= 1 << generator.randrange(8)
        flipped.write_bytes(copy)
        try:
            # Names and times of the index are not under a checksum. The messages themselves are.
            assert sorted(_read(flipped)) == sorted(whole)
        except RecordingError as error:
            errors += 1
            assert str(flipped) in str(error)
    assert errors > 150


def test_other_definition_of_a_type(tmp_path):
    path = tmp_path / "bag.mcap"
    writer = BagWriter(path)
    writer.add_topic(Topic("/text", STRING, []))
    writer.write("/text", text_message("x"), 10**18, 10**18)
    writer.close()
    with Recording(path) as recording:
        (topic,) = recording.topics.values()
        assert make_decoder(topic)(next(recording.messages())).data == "x"
        other = dataclasses.replace(topic, type_hash="RIHS01_" + "0" * 64)
        with pytest.raises(RecordingError, match="another definition of std_msgs/msg/String"):
            make_decoder(other)
        by_text = dataclasses.replace(topic, type_hash="", definition="string other")
        with pytest.raises(RecordingError, match="another definition"):
            make_decoder(by_text)
        missing = dataclasses.replace(topic, type_name="nowhere_msgs/msg/Nothing")
        with pytest.raises(RecordingError, match="not installed"):
            make_decoder(missing)


def test_message_that_is_no_valid_cdr(tmp_path):
    path = tmp_path / "bag.mcap"
    writer = BagWriter(path)
    writer.add_topic(Topic("/text", STRING, []))
    writer.write("/text", b"\0\1\0\0\xff\xff\xff\x7fshort", 10**18, 10**18)
    writer.close()
    with Recording(path) as recording:
        decode = make_decoder(recording.topics["/text"])
        with pytest.raises(RecordingError, match="no valid std_msgs/msg/String"):
            decode(next(recording.messages()))
