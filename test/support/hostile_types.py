# SPDX-License-Identifier: Apache-2.0
"""Hostile types, topics and channels."""

import dataclasses

from hostile_kinds import info_of, kind, set_info

TYPE_NAMES = (
    "",
    "/",
    "//",
    "a",
    "a/b",
    "a/b/c/d",
    "hpccd/msg/",
    "hpccd//ContactArray",
    "hpccd/srv/Detect",
    "/msg/X",
    "../../etc/passwd",
    "os/path/join",
    "os.path/msg/join",
    ".hpccd/msg/X",
    "hpccd/msg/contactArray",
    "hpccd/msg/ContactArray ",
    "hpccd/msg/__class__",
    "std_msgs/msg/String",
    "std_msgs/msg/Header",
    "hpccd/msg/MeshVertices",
    "hpccd/msg/ContactArray",
    "hpccd/msg/MeshTopology",
    "sensor_msgs/msg/PointCloud2",
    "nowhere_msgs/msg/Nothing",
    "\0/\0/\0",
    "a\nb/msg/C",
    "hpccd/msg/" + "A" * 10_000,
    "hpccd/ContactArray",
    "ü/msg/Ö",
    "hpccd/msg/../msg/ContactArray",
    "hpccd::msg::ContactArray",
    "importlib/import_module/x",
)


@kind
def type_name(rng, bag):
    rng.choice(bag.schemas).name = rng.choice(TYPE_NAMES)


@kind
def type_of_another_topic(rng, bag):
    one, two = rng.sample(bag.channels, 2)
    one.schema_id = two.schema_id
    if rng.random() < 0.7:
        one.metadata = dict(two.metadata)


@kind
def type_text(rng, bag):
    schema = rng.choice(bag.schemas)
    text = schema.data
    schema.data = rng.choice(
        (
            b"",
            rng.randbytes(100),
            b"hpccd/ContactArray me\n",
            b"string<=4294967295 x\nfloat64[4294967295] y\n",
            b"nonsense[[[ x\n",
            text * 50,
            text[:100],
            b"=" * 100_000,
            b"int32 x\n" * 100_000,
            b"\xff\xfe",
        )
    )
    schema.encoding = rng.choice(("ros2msg", "ros2msg", "ros2idl", "", "protobuf"))
    for channel in bag.channels:
        channel.metadata["topic_type_hash"] = rng.choice(
            ("", "RIHS01_", "x" * 100, channel.metadata["topic_type_hash"])
        )


@kind
def schema_of_no_topic(rng, bag):
    change = rng.randrange(4)
    if change == 0:
        rng.choice(bag.channels).schema_id = rng.choice((0, 99, 65535))
    elif change == 1:
        del bag.schemas[rng.randrange(len(bag.schemas))]
    elif change == 2:
        bag.schemas[0].id = rng.choice((0, bag.schemas[-1].id))
    else:
        bag.schemas.append(dataclasses.replace(bag.schemas[0], name=rng.choice(TYPE_NAMES)))


@kind
def topic_name(rng, bag):
    channel = rng.choice(bag.channels)
    old = channel.topic
    channel.topic = rng.choice(
        (
            "",
            "/",
            "contacts",
            "/a b",
            "//",
            "/x\0y",
            "/\x1b[31m",
            "/\n",
            "/ü",
            "/" + "a" * 70_000,
            old + "/",
            rng.choice(bag.channels).topic,
            "/a/contacts",
            "/meshes/cloth/vertices",
            "~/x",
            "/{a}",
        )
    )
    if rng.random() < 0.3:
        info = info_of(bag)
        info["topics"][channel.topic] = info["topics"].pop(old)
        set_info(bag, info)


@kind
def channel_twice(rng, bag):
    """The same number for two topics, or the same topic with two numbers."""
    one, two = rng.sample(bag.channels, 2)
    change = rng.randrange(4)
    if change == 0:
        one.id = two.id
    elif change == 1:
        bag.channels.append(dataclasses.replace(one, id=rng.choice((77, 0, 65535))))
        for message in rng.sample(bag.messages, 5):
            if message.channel_id == one.id:
                message.channel_id = bag.channels[-1].id
    elif change == 2:  # a second description in the middle of the data, the index keeps the first
        other = dataclasses.replace(one, topic=two.topic, schema_id=two.schema_id)
        bag.inside = lambda records: [*records[: len(records) // 2], other, *records[len(records) // 2 :]]
    else:
        bag.channels.append(dataclasses.replace(two, id=one.id))


@kind
def encoding_of_messages(rng, bag):
    rng.choice(bag.channels).message_encoding = rng.choice(("", "json", "protobuf", "CDR", "cdr\0", "ros1", "x" * 9999))


@kind
def metadata_of_a_topic(rng, bag):
    channel = rng.choice(bag.channels)
    channel.metadata[rng.choice(("offered_qos_profiles", "offered_qos_profiles", "topic_type_hash"))] = rng.choice(
        (
            "",
            "x",
            "[",
            "- 1",
            "- {}",
            "{a: 1}",
            "- {reliability: 1, durability: 1}",
            "- {reliability: [], durability: {}}",
            "&a [*a]",
            "!!python/object/apply:os.system ['true']",
            "- reliability: reliable",
            "\0",
            "[" * 10_000,
            "1",
            "2020-13-45",
            "- null",
            "RIHS01_" + "0" * 64,
            "- {reliability: best_effort, durability: transient_local}",
            "a: &a [x,x]\nb: &b [*a,*a]\n",
        )
    )


@kind
def header_of_the_file(rng, bag):
    bag.profile = rng.choice(("", "ros1", "ROS2", "ros2\0", "x" * 100_000, "ros2"))
    bag.library = rng.choice(("", "\0", "\x1b[2J", "x" * 1_000_000, "a\nb", "ü"))
