# SPDX-License-Identifier: Apache-2.0
"""Messages of meshes as CDR bytes, against an independent writer."""

import numpy as np
import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from hpccd_ros.bag import message_definitions
from hpccd_ros.middleware import mesh_cdr, message_types


@pytest.fixture(scope="module")
def typestore():
    """An independent implementation of CDR that knows our two messages."""
    store = get_typestore(Stores.ROS2_JAZZY)
    for name in (message_types.TOPOLOGY, message_types.VERTICES):
        text = message_definitions.definition_text(name).split(message_definitions.SEPARATOR)[0]
        store.register(get_types_from_msg(text, name))
    return store


@pytest.mark.parametrize("frame_id", ["", "a", "abc", "abcd", "world", "côté"])
@pytest.mark.parametrize("count", [0, 1, 2, 5])
def test_cdr_is_that_of_an_independent_writer(typestore, frame_id, count):
    faces = np.arange(3 * count, dtype=np.uint32).reshape(-1, 3)
    edges = np.arange(2 * (count % 3), dtype=np.uint32).reshape(-1, 2)
    xyz = np.linspace(-1, 1, 3 * count, dtype=np.float32).reshape(-1, 3)
    for data, name in (
        (mesh_cdr.topology(5_000_000_007, frame_id, 3, faces, 3 * count, edges), message_types.TOPOLOGY),
        (mesh_cdr.vertices(5_000_000_007, frame_id, 3, 2**40, xyz), message_types.VERTICES),
    ):
        message = typestore.deserialize_cdr(data, name)
        assert bytes(typestore.serialize_cdr(message, name)) == data
        assert (message.header.stamp.sec, message.header.stamp.nanosec) == (5, 7)
        assert message.header.frame_id == frame_id
        if name == message_types.TOPOLOGY:
            assert (message.version, message.n_vertices) == (3, 3 * count)
            np.testing.assert_array_equal(message.faces, faces.ravel())
            np.testing.assert_array_equal(message.edges, edges.ravel())
        else:
            assert (message.topology_version, message.step) == (3, 2**40)
            np.testing.assert_array_equal(message.vertices_f32, xyz.ravel())
            assert len(message.vertices_f64) == 0


def test_cdr_takes_float32_only():
    with pytest.raises(TypeError, match="xyz has dtype float64"):
        mesh_cdr.vertices(0, "", 0, 0, np.zeros((1, 3)))
