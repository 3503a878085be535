# SPDX-License-Identifier: Apache-2.0
"""DistanceArray in recordings from before it told directions and speeds."""

import math

import numpy as np
import pytest
from hpccd.msg import DistanceArray
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from hpccd_ros import client
from hpccd_ros.bag import message_definitions
from hpccd_ros.bag.decode import make_decoder
from hpccd_ros.bag.reader import RecordedMessage, RecordedTopic

NAME = "hpccd/msg/DistanceArray"
ADDED = ("float64[] direction", "float64[] approach_speed")


@pytest.mark.parametrize("backend", ["", "cpu", "hybrid"])  # after each length, the bytes to align differ
def test_recordings_from_before_are_read(backend):
    now = message_definitions.definition_text(NAME)
    then = "\n".join(line for line in now.splitlines() if line not in ADDED)
    store = get_typestore(Stores.ROS2_JAZZY)
    own = then.split(message_definitions.SEPARATOR)[0]
    store.register(get_types_from_msg(own, NAME))
    header = store.types["std_msgs/msg/Header"](store.types["builtin_interfaces/msg/Time"](3, 4), "world")
    old = store.types[NAME](
        header=header,
        step=7,
        mesh_names=["a"],
        topology_versions=np.zeros(1, np.uint32),
        kind=np.ones(1, np.uint8),
        mesh_a=np.zeros(1, np.uint32),
        mesh_b=np.zeros(1, np.uint32),
        distance=np.array([0.25]),
        features_a=np.arange(2, dtype=np.uint32),
        features_b=np.arange(2, 4, dtype=np.uint32),
        points=np.arange(6.0),
        accuracy="exact",
        backend=backend,
    )
    data = bytes(store.serialize_cdr(old, NAME))
    topic = RecordedTopic("/distances", NAME, then, type_hash="", offered_qos="", count=1)
    message = make_decoder(topic)(RecordedMessage("/distances", 0, 0, 0, data))
    assert isinstance(message, DistanceArray) and (message.step, message.backend) == (7, backend)
    arrays = client.distances_from_message(message)
    assert arrays.between("a", "a") == 0.25 and arrays.points.tolist() == [[[0, 1, 2], [3, 4, 5]]]
    assert not arrays.direction.any() and math.isnan(arrays.approach_speed[0])
