# SPDX-License-Identifier: Apache-2.0
"""Send meshes to the node and read its contacts: the public part of hpccd_ros.

Call :func:`prepare_environment` before ``rclpy.init()``. The QoS profiles fit the node's defaults. Lengths are in the
unit of the scene; a time of impact is a fraction of its step, from 0 (start) to 1 (end). A stamp is a Time, or
nanoseconds since the epoch.

Examples
--------
>>> from hpccd_ros import client
>>> client.vertices_topic("cloth")
'meshes/cloth/vertices'
"""

from hpccd_ros.client.contacts import ContactArrays, contacts_from_message, pair_summary, scene_contacts
from hpccd_ros.client.distances import DistanceArrays, distances_from_message
from hpccd_ros.client.meshes import (
    mesh_from_marker,
    mesh_from_shape,
    topology_from_message,
    topology_message,
    vertices_from_message,
    vertices_message,
)
from hpccd_ros.client.steps import collision_free_step_from_response, collision_free_step_request, goal_from_request
from hpccd_ros.client.stop import SpeedScaleListener, StopListener
from hpccd_ros.client.topics import (
    CONTACTS_QOS,
    CONTACTS_TOPIC,
    DISTANCES_QOS,
    DISTANCES_TOPIC,
    LATCHED_CONTACTS_QOS,
    PAIRS_QOS,
    PAIRS_TOPIC,
    SPEED_SCALE_TOPIC,
    STOP_TIMEOUT,
    STOP_TOPIC,
    TOPOLOGY_QOS,
    VERTICES_QOS,
    marker_topic,
    pose_topic,
    shape_topic,
    stop_qos,
    topology_topic,
    vertices_topic,
)
from hpccd_ros.detect.layout import Layout
from hpccd_ros.frames.types import Topology
from hpccd_ros.frames.welding import Welding
from hpccd_ros.middleware.contact_messages import SceneContacts
from hpccd_ros.middleware.environment import prepare as prepare_environment

__all__ = [
    "CONTACTS_QOS",
    "CONTACTS_TOPIC",
    "ContactArrays",
    "DISTANCES_QOS",
    "DISTANCES_TOPIC",
    "DistanceArrays",
    "LATCHED_CONTACTS_QOS",
    "Layout",
    "PAIRS_QOS",
    "PAIRS_TOPIC",
    "SPEED_SCALE_TOPIC",
    "STOP_TIMEOUT",
    "STOP_TOPIC",
    "SceneContacts",
    "SpeedScaleListener",
    "StopListener",
    "TOPOLOGY_QOS",
    "Topology",
    "VERTICES_QOS",
    "Welding",
    "collision_free_step_from_response",
    "collision_free_step_request",
    "contacts_from_message",
    "distances_from_message",
    "goal_from_request",
    "marker_topic",
    "mesh_from_marker",
    "mesh_from_shape",
    "pair_summary",
    "pose_topic",
    "prepare_environment",
    "scene_contacts",
    "shape_topic",
    "stop_qos",
    "topology_from_message",
    "topology_message",
    "topology_topic",
    "vertices_from_message",
    "vertices_message",
    "vertices_topic",
]
