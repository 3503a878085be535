# SPDX-License-Identifier: Apache-2.0
"""Names and quality of service of the topics that a publisher of meshes and a reader of contacts use."""

from rclpy.qos import QoSProfile

from hpccd_ros.base.quoting import quoted
from hpccd_ros.middleware import qos, topic_names

#: Publisher of topologies: reliable, transient local: a node that starts later receives the last one.
TOPOLOGY_QOS: QoSProfile = qos.TOPOLOGY
#: Publisher of vertices or point clouds: reliable, keeps the last 10; fits any ``input_reliability`` of the node.
VERTICES_QOS: QoSProfile = qos.vertices("reliable", 10)
#: Subscription to contacts: reliable, keeps the last 10.
CONTACTS_QOS: QoSProfile = qos.CONTACTS
#: Subscription to contacts that also receives the last 10 sent before it; needs a node with
#: ``contacts_durability: transient_local``.
LATCHED_CONTACTS_QOS: QoSProfile = qos.LATCHED_CONTACTS
#: Subscription to distances: reliable, keeps the last 10.
DISTANCES_QOS: QoSProfile = qos.DISTANCES

#: Subscription to pair summaries: reliable, keeps the last 10.
PAIRS_QOS: QoSProfile = qos.PAIRS
#: Default of the node's parameter ``stop_timeout``, in seconds.
STOP_TIMEOUT: float = 0.5

#: Topic of contacts, relative to the namespace of the node, like the names below.
CONTACTS_TOPIC: str = topic_names.CONTACTS
#: Published while the node's parameter ``distances`` is true.
DISTANCES_TOPIC: str = topic_names.DISTANCES
#: Published while the node's parameter ``pair_summaries`` is true.
PAIRS_TOPIC: str = topic_names.PAIRS
#: Published where the node's parameter ``stop_distance`` is not negative; see StopListener.
STOP_TOPIC: str = topic_names.STOP
#: Published where the node's parameter ``approach_time`` is above 0; see SpeedScaleListener.
SPEED_SCALE_TOPIC: str = topic_names.SPEED_SCALE


def stop_qos(stop_timeout: float = STOP_TIMEOUT) -> QoSProfile:
    """Quality of service of a subscription to stop or speed_scale that also reports missed deadlines.

    Parameters
    ----------
    stop_timeout : float
        Seconds, at least those of the node's parameter ``stop_timeout``; with less, no message arrives.

    Returns
    -------
    rclpy.qos.QoSProfile

    Raises
    ------
    TypeError, ValueError
        If it is not a number of seconds, more than 0 and at most 3600.
    """
    if isinstance(stop_timeout, bool) or not isinstance(stop_timeout, (int, float)):
        raise TypeError(f"stop_timeout: expected seconds, got {type(stop_timeout).__name__}")
    if not 0 < stop_timeout <= 3600:
        raise ValueError(f"stop_timeout: {stop_timeout} s; give more than 0 s and at most 3600 s")
    return qos.stop(stop_timeout, depth=10)


def topology_topic(mesh: str) -> str:
    """The topic of MeshTopology messages of a mesh.

    Parameters
    ----------
    mesh : str
        Name of the mesh, as in the node's parameter ``meshes``.

    Returns
    -------
    str
        ``meshes/MESH/topology``, relative to the namespace of the node.

    Raises
    ------
    TypeError, ValueError
        If no mesh can have this name.
    """
    return topic_names.topology(_mesh_name(mesh))


def vertices_topic(mesh: str) -> str:
    """The topic of MeshVertices messages of a mesh.

    Parameters
    ----------
    mesh : str
        Name of the mesh, as in the node's parameter ``meshes``.

    Returns
    -------
    str
        ``meshes/MESH/vertices``, relative to the namespace of the node.

    Raises
    ------
    TypeError, ValueError
        If no mesh can have this name.
    """
    return topic_names.vertices(_mesh_name(mesh))


def shape_topic(mesh: str) -> str:
    """The topic of shape_msgs/Mesh messages of a mesh, for meshes with ``mesh.MESH.input: shape``.

    Parameters
    ----------
    mesh : str
        Name of the mesh, as in the node's parameter ``meshes``.

    Returns
    -------
    str
        ``meshes/MESH/shape``, relative to the namespace of the node.

    Raises
    ------
    TypeError, ValueError
        If no mesh can have this name.
    """
    return topic_names.of_mesh(_mesh_name(mesh), topic_names.SHAPE)


def marker_topic(mesh: str) -> str:
    """The topic of visualization_msgs/Marker messages of a mesh, for meshes with ``mesh.MESH.input: marker``.

    Parameters
    ----------
    mesh : str
        Name of the mesh, as in the node's parameter ``meshes``.

    Returns
    -------
    str
        ``meshes/MESH/marker``, relative to the namespace of the node.

    Raises
    ------
    TypeError, ValueError
        If no mesh can have this name.
    """
    return topic_names.of_mesh(_mesh_name(mesh), topic_names.MARKER)


def pose_topic(mesh: str) -> str:
    """The topic of geometry_msgs/PoseStamped messages of a mesh, for meshes with ``mesh.MESH.input: pose``.

    Parameters
    ----------
    mesh : str
        Name of the mesh, as in the node's parameter ``meshes``.

    Returns
    -------
    str
        ``meshes/MESH/pose``, relative to the namespace of the node.

    Raises
    ------
    TypeError, ValueError
        If no mesh can have this name.
    """
    return topic_names.of_mesh(_mesh_name(mesh), topic_names.POSE)


def _mesh_name(mesh: str) -> str:
    if not isinstance(mesh, str):
        raise TypeError(f"mesh: expected its name, got {type(mesh).__name__}")
    if not topic_names.MESH_NAME.fullmatch(mesh):
        raise ValueError(f"mesh: {quoted(mesh)} is not a valid mesh name; use letters, digits and _, a letter first")
    return mesh
