# SPDX-License-Identifier: Apache-2.0
"""Read recordings with independent readers, and write changed copies of them."""

from pathlib import Path

from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from hpccd_ros.bag import message_definitions
from hpccd_ros.bag.reader import Recording
from hpccd_ros.bag.writer import BagWriter, Topic
from hpccd_ros.replay import recorded_setup
from hpccd_ros.replay.recomputed import Replay

STRING = "std_msgs/msg/String"


def typestore():
    """A typestore of rosbags with the messages of this package, from the text of the .msg files."""
    store = get_typestore(Stores.ROS2_JAZZY)
    for name in ("MeshTopology", "MeshVertices", "ContactArray", "DistanceArray"):
        text = message_definitions.definition_text(f"hpccd/msg/{name}").split(message_definitions.SEPARATOR)[0]
        store.register(get_types_from_msg(text, f"hpccd/msg/{name}"))
    return store


def read_by_rosbags(path):
    """[(topic, type, log time, decoded message)] as rosbags reads a file or folder, with the types that it embeds."""
    with AnyReader([Path(path)]) as reader:
        return [(c.topic, c.msgtype, time, reader.deserialize(raw, c.msgtype)) for c, time, raw in reader.messages()]


def read_by_mcap_ros2(path):
    """[(topic, type, log time, decoded message)] as mcap-ros2-support reads one file."""
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    with open(path, "rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        return [
            (channel.topic, schema.name, message.log_time, decoded)
            for schema, channel, message, decoded in reader.iter_decoded_messages()
        ]


def raw_messages(path):
    with Recording(path) as recording:
        return list(recording.messages())


def replayed(path):
    """The replay of a whole recording, and its steps."""
    with Recording(path) as recording:
        replay = Replay(recording, recorded_setup.of_recording(recording))
        return replay, list(replay.steps())


def rewrite(source, target, change=lambda index, message, decoded: decoded, info=...):
    """Copy a recording; `change(index, message, decoded)` gives the decoded message to write, or None to leave it out.

    index counts the messages of the topic. info: instead of that of the source.
    """
    store = typestore()
    counts = {}
    with Recording(source) as recording:
        writer = BagWriter(target, info=recording.info if info is ... else info)
        for topic in recording.topics.values():
            writer.add_topic(Topic(topic.name, topic.type_name, []))
        for message in recording.messages():
            type_name = recording.topics[message.topic].type_name
            index = counts[message.topic] = counts.get(message.topic, -1) + 1
            decoded = store.deserialize_cdr(message.data, type_name)
            # Bytes differ: Fast CDR does not initialise the padding between aligned fields.
            assert len(store.serialize_cdr(decoded, type_name)) == len(message.data)
            changed = change(index, message, decoded)
            if changed is not None:
                data = bytes(store.serialize_cdr(changed, type_name))
                writer.write(message.topic, data, message.log_time, message.publish_time, message.sequence)
        writer.close()


def text_message(text: str) -> bytes:
    """CDR bytes of a std_msgs/String."""
    body = text.encode() + b"\0"
    return b"\0\1\0\0" + len(body).to_bytes(4, "little") + body


def write_texts(path, texts, step_ns=1_000_000, **options):
    """A recording of std_msgs/String messages on /text, `step_ns` apart; returns the writer, closed."""
    writer = BagWriter(path, **options)
    writer.add_topic(Topic("/text", STRING, []))
    for number, text in enumerate(texts):
        time = 10**18 + number * step_ns
        writer.write("/text", text_message(text), time, time, number)
    writer.close()
    return writer
