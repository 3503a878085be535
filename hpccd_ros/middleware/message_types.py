# SPDX-License-Identifier: Apache-2.0
"""Names of message types, and their Python classes."""

import importlib
import re

TOPOLOGY = "hpccd/msg/MeshTopology"
VERTICES = "hpccd/msg/MeshVertices"
POINTS = "sensor_msgs/msg/PointCloud2"
POSE = "geometry_msgs/msg/PoseStamped"
SHAPE = "shape_msgs/msg/Mesh"
MARKER = "visualization_msgs/msg/Marker"
DESCRIPTION = "std_msgs/msg/String"
JOINT_STATES = "sensor_msgs/msg/JointState"
CONTACTS = "hpccd/msg/ContactArray"
DISTANCES = "hpccd/msg/DistanceArray"
PAIRS = "hpccd/msg/PairSummaryArray"
STOP = "std_msgs/msg/Bool"
SPEED_SCALE = "std_msgs/msg/Float64"

# A name may come from a recording: it must not leave the folders of messages, nor import another module.
_TYPE_NAME = re.compile(r"([A-Za-z][A-Za-z0-9_]*)/([a-z]+)/([A-Za-z][A-Za-z0-9_]*)")


def split_type_name(type_name: str) -> tuple[str, str, str]:
    """("pkg", "msg", "Name") of "pkg/msg/Name". Raises LookupError if the name has another form."""
    if (match := _TYPE_NAME.fullmatch(type_name)) is None:
        raise LookupError(f"{type_name!r} is not the name of a message type; write package/msg/Name")
    return match[1], match[2], match[3]


def message_class(type_name: str):
    """The Python class of "pkg/msg/Name". Raises LookupError if the name has another form, or the type is not
    installed."""
    package, folder, short = split_type_name(type_name)
    try:
        found = getattr(importlib.import_module(f"{package}.{folder}"), short)
    except (ImportError, AttributeError) as error:
        raise LookupError(f"message type {type_name} is not installed here: {error}") from error
    if not hasattr(found, "get_fields_and_field_types"):
        raise LookupError(f"{type_name} is not a message type; use one of package/msg")
    return found
