# SPDX-License-Identifier: Apache-2.0
"""MCAP files as other programs write them: our reader finds everything that an independent reader finds, and
`hpccd doctor` and `hpccd replay` agree with it."""

import dataclasses
import os
import shutil
import subprocess
import sys

import pytest
import zstandard
from bag_tools import typestore
from in_process import hpccd
from mcap.reader import NonSeekingReader
from mcap.records import Channel, Schema, Statistics
from mcap.writer import CompressionType, IndexType, Writer
from mcap_model import Bag, raw_record
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as RosbagsWriter

from hpccd_ros.bag.reader import Recording

PARAMETERS = "/**: {ros__parameters: {meshes: [cloth, ball]}}\n"


@pytest.fixture(scope="module")
def bag(sound_bags):
    return Bag.read(sound_bags / "streams.mcap")


def _library(**options):
    """Write with the library that most Python programs use."""
    options = {"chunk_size": 20_000, **options}

    def write(bag, path):
        with open(path, "wb") as stream:
            writer = Writer(stream, **options)
            writer.start(profile=bag.profile, library="test")
            schemas = {s.id: writer.register_schema(s.name, s.encoding, s.data) for s in bag.schemas}
            channels = {
                c.id: writer.register_channel(c.topic, c.message_encoding, schemas.get(c.schema_id, 0), c.metadata)
                for c in bag.channels
            }
            for m in bag.metadata:
                writer.add_metadata(m.name, m.metadata)
            for m in bag.messages:
                writer.add_message(channels[m.channel_id], m.log_time, m.data, m.publish_time, m.sequence)
            writer.finish()

    return write


def _records(**changes):
    """Write what the format allows but the library above has no option for."""
    return lambda bag, path: dataclasses.replace(bag, **changes).write(path)


def _without(*kinds):
    return lambda records: [record for record in records if not isinstance(record, kinds)]


def _without_counts(records):
    return [dataclasses.replace(r, channel_message_counts={}) if isinstance(r, Statistics) else r for r in records]


NOTHING = {
    "index_types": IndexType.NONE,
    "repeat_channels": False,
    "repeat_schemas": False,
    "use_statistics": False,
    "use_summary_offsets": False,
}
PRIVATE = raw_record(0x90, b"for one program only")
WRITERS = {
    "usual": _library(),
    "lz4": _library(compression=CompressionType.LZ4),
    "zstd": _library(compression=CompressionType.ZSTD),
    "all sums": _library(enable_crcs=True, enable_data_crcs=True),
    "no sums": _library(enable_crcs=False),
    "one chunk": _library(chunk_size=1 << 30),
    "no chunks": _library(use_chunking=False),
    "no channels repeated": _library(repeat_channels=False),
    "no schemas repeated": _library(repeat_schemas=False),
    "nothing repeated": _library(repeat_channels=False, repeat_schemas=False),
    "no statistics": _library(use_statistics=False),
    "no indexes": _library(index_types=IndexType.NONE),
    "no message index": _library(index_types=IndexType.CHUNK),
    "no offsets": _library(use_summary_offsets=False),
    "empty summary": _library(**NOTHING),
    "empty summary, no chunks": _library(**NOTHING, use_chunking=False),
    "channels without statistics": _library(**NOTHING | {"repeat_channels": True}),
    "no summary": _records(summary=False),
    "no summary, no chunks": _records(summary=False, chunk_bytes=0),
    "no channels, no chunks": _records(index=_without(Channel, Schema), chunk_bytes=0),
    "statistics without counts": _records(index=_without_counts),
    "statistics without counts, no channels": _records(index=lambda r: _without(Channel)(_without_counts(r))),
    "private records": _records(
        inside=lambda records: [*records, PRIVATE],
        data=lambda records: [*records, PRIVATE],
        index=lambda records: [PRIVATE, *records],
    ),
}


def _foreign(bag):
    """Beside ours: channels of other encodings, of no schema, and one of the same topic as ours."""
    schema = Schema(id=90, name="Log", encoding="jsonschema", data=b"{}")
    channels = [
        Channel(id=90, topic="/log", message_encoding="json", metadata={}, schema_id=90),
        Channel(id=91, topic="/raw", message_encoding="", metadata={}, schema_id=0),
        Channel(id=92, topic="/bare", message_encoding="cdr", metadata={}, schema_id=0),
        Channel(id=93, topic="/contacts", message_encoding="protobuf", metadata={}, schema_id=90),
        Channel(id=94, topic="/unused", message_encoding="json", metadata={}, schema_id=90),
    ]
    messages = []
    for number, message in enumerate(bag.messages):
        more = dataclasses.replace(message, channel_id=90 + number % 4, data=zstandard.compress(b"{}"))
        messages += [message, more]
    return dataclasses.replace(
        bag, schemas=[*bag.schemas, schema], channels=[*bag.channels, *channels], messages=messages
    )


CONTENTS = {
    "ours": lambda bag: bag,
    "no profile": lambda bag: dataclasses.replace(bag, profile=""),
    "profile of another": lambda bag: dataclasses.replace(bag, profile="x-fleet"),
    "foreign channels": _foreign,
    "each message compressed": lambda bag: dataclasses.replace(
        bag, messages=[dataclasses.replace(m, data=zstandard.compress(m.data)) for m in bag.messages]
    ),
}
CASES = [(writer, "ours") for writer in WRITERS] + [
    (writer, content) for content in list(CONTENTS)[1:] for writer in ("usual", "empty summary")
]


@pytest.mark.parametrize("writer, content", CASES, ids=lambda word: word.replace(" ", "-"))
def test_what_an_independent_reader_finds_ours_finds(bag, tmp_path, writer, content):
    path = tmp_path / "x.mcap"
    WRITERS[writer](CONTENTS[content](bag.copy()), path)
    expected = _by_the_library(path)
    assert len(expected) == len(bag.messages)
    _check(path, expected, skipped=("/log", "/raw", "/bare", "/contacts") if content == "foreign channels" else ())
    saved = tmp_path / "saved.mcap"
    assert hpccd("doctor", path, "--recover", saved).status == 0
    with Recording(saved) as recording:
        assert [_row(message) for message in recording.messages()] == expected


@pytest.mark.parametrize("mode", [None, CompressionMode.MESSAGE, CompressionMode.STORAGE], ids=str)
def test_folders_of_rosbags(sound_bags, tmp_path, mode):
    """A writer of its own, without hashes of types."""
    folder = _by_rosbags(sound_bags, tmp_path / "run", StoragePlugin.MCAP, mode)
    (tmp_path / "parameters.yaml").write_text(PARAMETERS)
    with AnyReader([folder]) as reader:
        expected = [(c.topic, time, bytes(data)) for c, time, data in reader.messages()]
    _check(folder, expected, options=("--params", tmp_path / "parameters.yaml"))


@pytest.mark.parametrize("whole", [True, False], ids=["folder", "file"])
def test_what_has_to_be_unpacked_first(sound_bags, tmp_path, whole):
    folder = _by_rosbags(sound_bags, tmp_path / "run", StoragePlugin.MCAP, CompressionMode.FILE)
    (tmp_path / "parameters.yaml").write_text(PARAMETERS)
    (packed,) = folder.glob("*.mcap.zstd")
    said = _rejected(folder if whole else packed)
    command = said.partition("unpack it: `")[2].removesuffix("`")
    assert command == f"zstd -d {folder}/*.mcap.zstd" if whole else f"zstd -d {packed}"
    if shutil.which("zstd") is None:
        packed.with_suffix("").write_bytes(zstandard.ZstdDecompressor().stream_reader(packed.read_bytes()).read())
    else:
        subprocess.run(command, shell=True, check=True)
    done = hpccd("replay", folder, "--params", tmp_path / "parameters.yaml")
    assert done.status == 0 and "VERIFIED: 7 results" in done.out, done


@pytest.mark.parametrize("mode", [None, CompressionMode.FILE], ids=str)
def test_sqlite3_is_named_with_the_command_that_converts(sound_bags, tmp_path, mode):
    folder = _by_rosbags(sound_bags, tmp_path / "run", StoragePlugin.SQLITE3, mode)
    command = (
        f"`echo 'output_bags: [{{uri: {folder}-mcap, storage_id: mcap, all: true}}]' > convert.yaml && "
        f"ros2 bag convert -i {folder} -o convert.yaml`"
    )
    for path in [folder, *([] if mode else folder.glob("*.db3"))]:
        said = _rejected(path)
        assert "an sqlite3 recording" in said and said.endswith(command), said
    if mode:
        return
    # `ros2 bag` is not here. Another program that converts shows that MCAP is all that is needed.
    convert = [os.path.join(os.path.dirname(sys.executable), "rosbags-convert"), "--dst-storage", "mcap"]
    subprocess.run([*convert, "--src", folder, "--dst", f"{folder}-mcap"], check=True)
    (tmp_path / "parameters.yaml").write_text(PARAMETERS)
    done = hpccd("replay", f"{folder}-mcap", "--params", tmp_path / "parameters.yaml")
    assert done.status == 0 and "VERIFIED: 7 results" in done.out, done


def test_recordings_without_a_message_of_ros_2(bag, tmp_path):
    bag = dataclasses.replace(_foreign(bag), profile="ros1")
    bag.channels = bag.channels[-5:]
    bag.messages = [message for message in bag.messages if message.channel_id >= 90]
    said = _rejected(bag.write(tmp_path / "x.mcap"), doctor=2)
    assert "has no ROS 2 messages (MCAP profile 'ros1'; topics: /log (encoding 'json')" in said, said


def test_messages_before_their_channel_is_described(bag, tmp_path):
    """Without an index these messages are not described."""
    bag = dataclasses.replace(bag, chunk_bytes=0, summary=False)
    bag.data = lambda records: [records[0], records[-1], *records[1:-1]]
    path = bag.write(tmp_path / "x.mcap")
    assert hpccd("doctor", path).status == 1 and "is damaged" in hpccd("replay", path).err


@pytest.mark.parametrize(
    "data",
    [
        b"\x28\xb5\x2f\xfd",
        zstandard.compress(b"x" * 1000)[:-4],
        zstandard.ZstdCompressor(write_content_size=False).compress(b"x" * 1000),
    ],
)
def test_a_compressed_message_that_is_not_whole(bag, tmp_path, data):
    bag = bag.copy()
    bag.messages[5].data = data
    path = bag.write(tmp_path / "x.mcap")
    assert hpccd("doctor", path).status == 1 and "is damaged" in hpccd("replay", path).err
    assert hpccd("doctor", path, "--recover", tmp_path / "saved.mcap").status == 0
    with Recording(tmp_path / "saved.mcap") as recording:
        assert recording.message_count == len(bag.messages) - 1


def _check(path, expected, skipped=(), options=()):
    """expected: [(topic, log time, data)] of the messages of ROS 2."""
    with Recording(path) as recording:
        assert [_row(message) for message in recording.messages()] == expected
        counts = {topic.name: topic.count for topic in recording.topics.values() if topic.count}
        assert counts == {topic: [row[0] for row in expected].count(topic) for topic in {row[0] for row in expected}}
    examined, replayed = hpccd("doctor", path), hpccd("replay", path, *options)
    assert examined.status == 0 and ": sound" in examined.out, examined
    assert replayed.status == 0 and "VERIFIED: 7 results" in replayed.out, replayed
    for words in (examined.out, replayed.err):
        assert ("skipped, because these are not ROS 2 messages" in words) == bool(skipped), words
        assert all(f"{topic} (" in words for topic in skipped), words


def _rejected(path, doctor=2):
    """The sentence with which all commands reject it."""
    examined, replayed = hpccd("doctor", path), hpccd("replay", path)
    assert (examined.status, replayed.status) == (doctor, 2), (examined, replayed)
    said = replayed.err.removeprefix("hpccd replay: ")
    assert examined.err == f"hpccd doctor: {said}" and said.count("\n") == 1
    return said.rstrip("\n")


def _row(message):
    return message.topic, message.log_time, message.data


def _by_the_library(path):
    """The ROS 2 messages that the library finds, record by record, in the order of time."""
    with open(path, "rb") as stream:
        found = [
            (channel.topic, message.log_time, message.data)
            for schema, channel, message in NonSeekingReader(stream, validate_crcs=True).iter_messages(
                log_time_order=False
            )
            if channel.message_encoding == "cdr" and schema is not None
        ]
    plain = [(topic, time, zstandard.decompress(data) if data[:1] == b"\x28" else data) for topic, time, data in found]
    return sorted(plain, key=lambda row: row[1])


def _by_rosbags(sound_bags, folder, storage, mode):
    store = typestore()
    writer = RosbagsWriter(folder, version=9, storage_plugin=storage)
    if mode is not None:
        writer.set_compression(mode, CompressionFormat.ZSTD)
    with Recording(sound_bags / "streams.mcap") as recording, writer:
        connections = {
            topic.name: writer.add_connection(topic.name, topic.type_name, typestore=store)
            for topic in recording.topics.values()
        }
        for message in recording.messages():
            writer.write(connections[message.topic], message.log_time, message.data)
    return folder
