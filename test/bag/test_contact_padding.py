# SPDX-License-Identifier: Apache-2.0
"""Answers recorded before they told what was tested: the byte where they tell it now held anything."""

import dataclasses
from array import array

import numpy as np
import pytest
from bag_tools import typestore
from hpccd.msg import ContactArray
from rclpy.serialization import deserialize_message, serialize_message

from hpccd_ros.bag import message_definitions
from hpccd_ros.bag.contact_padding import without_features
from hpccd_ros.bag.decode import completion, make_decoder
from hpccd_ros.bag.reader import RecordedMessage, RecordedTopic
from hpccd_ros.middleware.answer_fields import fill_features, read_features

BOTH = ("vertex_face", "edge_edge")
NAME = "hpccd/msg/ContactArray"


def answer(contacts, names, frame):
    message = ContactArray(mesh_names=[f"mesh{k}" * k for k in range(names)], total=contacts, hash=2**64 - 1)
    message.header.frame_id, message.accuracy, message.truncated = frame, "exact", True
    message.kind = bytes(contacts)
    message.mesh_a = message.mesh_b = [7] * contacts
    message.features_a = message.features_b = [9] * (2 * contacts)
    message.toc = [0.5] * contacts
    message.points = message.normals = [1.5] * (3 * contacts)
    message.topology_versions, message.separations = [1] * names, [0.25] * names
    message.minimum_separation, message.first_toc = 0.125, 0.5
    return message


def of_rosbags(store, message):
    """The same message as rosbags has it."""
    values = {name: getattr(message, name) for name in message.get_fields_and_field_types()}
    header, time = store.types["std_msgs/msg/Header"], store.types["builtin_interfaces/msg/Time"]
    values = {name: np.array(v) if isinstance(v, array) else v for name, v in values.items()}
    return store.types[NAME](**values | {"header": header(time(0, 0), message.header.frame_id), "start": time(0, 0)})


@pytest.mark.parametrize("contacts", [0, 1, 2, 5])
@pytest.mark.parametrize("names", [0, 1, 2, 3])
@pytest.mark.parametrize("frame", ["", "w", "world", "a frame"])
def test_just_that_byte_is_cleared(contacts, names, frame):
    """Whatever stands before it and how that is aligned, by the writers of ROS and of rosbags, in either byte order."""
    message = answer(contacts, names, frame)
    message.tested_features = 170
    told = serialize_message(message)
    assert sum(a != b for a, b in zip(told, without_features(told), strict=True)) == 1
    store = typestore()
    for little in (True, False):
        data = bytes(store.serialize_cdr(of_rosbags(store, message), NAME, little_endian=little))
        cleared = without_features(data)
        assert sum(a != b for a, b in zip(data, cleared, strict=True)) == 1
        again = store.deserialize_cdr(cleared, NAME)
        assert again.tested_features == 0 and again.hash == message.hash and again.total == contacts
    message.tested_features = 0
    assert deserialize_message(without_features(told), ContactArray) == message


def test_no_other_field_has_moved():
    """A program built with the definition of before reads and writes every field where it was."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    now = message_definitions.definition_text(NAME).split(message_definitions.SEPARATOR)[0]
    then = "\n".join(line for line in now.splitlines() if not line.endswith(" tested_features"))
    before = get_typestore(Stores.ROS2_JAZZY)
    before.register(get_types_from_msg(then, NAME))
    for contacts in (0, 1, 3):
        message = answer(contacts, contacts, "world")
        message.tested_features = 3
        data = bytes(typestore().serialize_cdr(of_rosbags(typestore(), message), NAME))
        old = before.deserialize_cdr(data, NAME)
        assert (old.hash, old.total, old.truncated, old.accuracy) == (2**64 - 1, contacts, True, "exact")
        back = bytes(before.serialize_cdr(old, NAME))
        message.tested_features = 0
        assert deserialize_message(back, ContactArray) == message


def test_recordings_from_before_tell_nothing():
    now = message_definitions.definition_text(NAME)
    later = (
        " tested_features",
        " parts",
        " motion_bounds",
        " inputs_before",
        " start_inputs",
        " input_topics",
        " input_topic",
        " input_sent",
        " input_flags",
        " report",
    )
    then = "\n".join(line for line in now.splitlines() if not line.endswith(later))
    topic = RecordedTopic("/contacts", NAME, then, type_hash="", offered_qos="", count=1)
    message = answer(2, 2, "world")
    message.tested_features = 1  # what lay there by chance
    full = bytes(typestore().serialize_cdr(of_rosbags(typestore(), message), NAME))
    later = 8 + 2 * 8 + 4 * 4 + 4  # the number of parts and the length of no bounds; no inputs
    data = full[:-later]
    assert completion(topic)(data) == without_features(data) + bytes(later) != full
    recorded = RecordedMessage("/contacts", 0, 0, 0, data)
    assert read_features(make_decoder(topic)(recorded)) == BOTH
    today, recorded = dataclasses.replace(topic, definition=now), dataclasses.replace(recorded, data=full)
    assert read_features(make_decoder(today)(recorded)) == ("vertex_face",)


@pytest.mark.parametrize("cut", range(0, 120, 7))
def test_damaged_bytes_come_back(cut):
    data = serialize_message(answer(2, 2, "world"))
    assert without_features(data[:cut]) == data[:cut] or len(without_features(data[:cut])) == cut
    damaged = data[:cut] + b"\xff" * 8 + data[cut + 8 :]
    assert len(without_features(damaged)) == len(damaged)
    assert without_features(b"") == b""


def test_what_an_answer_tells():
    message = ContactArray()
    assert read_features(message) == BOTH
    for features in (("vertex_face",), ("edge_edge",), BOTH):
        fill_features(message, features)
        assert read_features(message) == features
    for other in (4, 77, 255):
        message.tested_features = other
        assert read_features(message) == BOTH
