# SPDX-License-Identifier: Apache-2.0
"""Names and quality of service of the topics that a publisher of meshes and a reader of contacts use."""

from rclpy.qos import QoSProfile

from hpccd_ros.base.quoting import quoted
from hpccd_ros.middleware import qos, topic_names

#: Publisher of topologies: reliable, transient local, so that a node that starts later gets the last one.
TOPOLOGY_QOS: QoSProfile = qos.TOPOLOGY
#: Publisher of vertices or point clouds: reliable, the last 10 kept; fits a node of any ``input_reliability``.
VERTICES_QOS: QoSProfile = qos.vertices("reliable", 10)
#: Subscription to contacts: reliable, the last 10 kept for a reader that is late now and then.
CONTACTS_QOS: QoSProfile = qos.CONTACTS
#: The same, with the last 10 that came before it first: of a node with ``contacts_durability: transient_local``, and
#: of no other.
LATCHED_CONTACTS_QOS: QoSProfile = qos.LATCHED_CONTACTS
#: Subscription to distances, in the same way.
DISTANCES_QOS: QoSProfile = qos.DISTANCES

#: Subscription to pairs, in the same way.
PAIRS_QOS: QoSProfile = qos.PAIRS
#: Of the parameter ``stop_timeout``.
STOP_TIMEOUT: float = 0.5

#: Relative to the namespace of the node, as the names below.
CONTACTS_TOPIC: str = topic_names.CONTACTS
#: Published while the node's parameter ``distances`` is true.
DISTANCES_TOPIC: str = topic_names.DISTANCES
#: Published while the node's parameter ``pair_summaries`` is true.
PAIRS_TOPIC: str = topic_names.PAIRS
#: Published where the node's parameter ``stop_distance`` is not negative; see StopListener.
STOP_TOPIC: str = topic_names.STOP


def stop_qos(stop_timeout: float = STOP_TIMEOUT) -> QoSProfile:
    """Subscription to stop that is notified when nothing came for this many seconds: at least those of the node's
    parameter ``stop_timeout``, else nothing ever comes.

    Raises TypeError or ValueError for what can be no such time.
    """
    if isinstance(stop_timeout, bool) or not isinstance(stop_timeout, (int, float)):
        raise TypeError(f"stop_timeout: expected seconds, got {type(stop_timeout).__name__}")
    if not 0 < stop_timeout <= 3600:
        raise ValueError(f"stop_timeout: {stop_timeout} s; give more than 0 s and at most 3600 s")
    return qos.stop(stop_timeout, depth=10)


def topology_topic(mesh: str) -> str:
    """Where MeshTopology of this mesh goes: ``meshes/MESH/topology``. mesh: as in the node's parameter ``meshes``.

    Raises TypeError or ValueError for what can be no name of a mesh.
    """
    return topic_names.topology(_mesh_name(mesh))


def vertices_topic(mesh: str) -> str:
    """Where MeshVertices of this mesh go: ``meshes/MESH/vertices``. mesh: as in the node's parameter ``meshes``.

    Raises TypeError or ValueError for what can be no name of a mesh.
    """
    return topic_names.vertices(_mesh_name(mesh))


def shape_topic(mesh: str) -> str:
    """Where shape_msgs/Mesh of this mesh go, with ``mesh.MESH.input: shape``: ``meshes/MESH/shape``.

    Raises TypeError or ValueError for what can be no name of a mesh.
    """
    return topic_names.of_mesh(_mesh_name(mesh), topic_names.SHAPE)


def marker_topic(mesh: str) -> str:
    """Where visualization_msgs/Marker of this mesh go, with ``mesh.MESH.input: marker``: ``meshes/MESH/marker``.

    Raises TypeError or ValueError for what can be no name of a mesh.
    """
    return topic_names.of_mesh(_mesh_name(mesh), topic_names.MARKER)


def pose_topic(mesh: str) -> str:
    """Where geometry_msgs/PoseStamped of this mesh go, with ``mesh.MESH.input: pose``: ``meshes/MESH/pose``.

    Raises TypeError or ValueError for what can be no name of a mesh.
    """
    return topic_names.of_mesh(_mesh_name(mesh), topic_names.POSE)


def _mesh_name(mesh: str) -> str:
    if not isinstance(mesh, str):
        raise TypeError(f"mesh: expected its name, got {type(mesh).__name__}")
    if not topic_names.MESH_NAME.fullmatch(mesh):
        raise ValueError(f"mesh: {quoted(mesh)} can be no name of a mesh; use letters, digits and _, a letter first")
    return mesh
