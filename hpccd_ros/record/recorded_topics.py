# SPDX-License-Identifier: Apache-2.0
"""Topics in the recording of a node, the QoS to request for each, and the data about the node that a replay needs. A
shape that was sent before the recording began is missing."""

import dataclasses
from collections.abc import Callable, Mapping

from rclpy.qos import QoSProfile, ReliabilityPolicy

from hpccd_ros.base.version import package_version
from hpccd_ros.frames.types import TF
from hpccd_ros.middleware import qos, qos_overrides, topic_names, transform_topics
from hpccd_ros.middleware.message_types import (
    CONTACTS,
    DESCRIPTION,
    DISTANCES,
    JOINT_STATES,
    MARKER,
    PAIRS,
    POINTS,
    POSE,
    SHAPE,
    SPEED_SCALE,
    STOP,
    TOPOLOGY,
    VERTICES,
)
from hpccd_ros.params import robot_parameters
from hpccd_ros.params.robot_parameters import RobotValues

# Last part of a mesh's topic -> type of its positions.
POSITIONS = {
    topic_names.VERTICES: VERTICES,
    topic_names.POINTS: POINTS,
    topic_names.SHAPE: SHAPE,
    topic_names.MARKER: MARKER,
    topic_names.POSE: POSE,
}
# Relative name -> type of results of the node.
RESULTS = {
    topic_names.CONTACTS: CONTACTS,
    topic_names.DISTANCES: DISTANCES,
    topic_names.PAIRS: PAIRS,
    topic_names.STOP: STOP,
    topic_names.SPEED_SCALE: SPEED_SCALE,
}


@dataclasses.dataclass(frozen=True)
class Wanted:
    """A topic to record: `name` relative or absolute, `type_name` "pkg/msg/Name".

    `latched`: for a transient local topic, the number of its last messages that are in force; else 0. `kept`: the same
    for a topic that is not transient local, but whose messages are in force until the next one.
    """

    name: str
    type_name: str
    latched: int = 0
    kept: int = 0


def of_node(parameters: dict) -> list[Wanted]:
    """The topics of a node with these parameters, inputs before outputs."""
    wanted = []
    meshes = parameters["meshes"] or []  # None: never set
    robots = robot_parameters.of(parameters)
    if robot_parameters.need_transforms(robots) or any(
        "tf" in (parameters.get(f"mesh.{mesh}.{name}") for name in ("transform", "input")) for mesh in meshes
    ):
        static = qos.TRANSFORMS_STATIC.depth
        wanted += [Wanted(t.name, t.type_name, static * t.static) for t in transform_topics.understood()]
    for mesh in meshes:
        wanted.append(Wanted(topic_names.topology(mesh), TOPOLOGY, latched=1))
        given_as = parameters.get(f"mesh.{mesh}.input") or topic_names.VERTICES
        kinds = topic_names.positions(given_as)
        once = parameters.get(f"mesh.{mesh}.static") or given_as in (topic_names.POSE, topic_names.BY_TRANSFORMS)
        wanted += [
            Wanted(topic_names.of_mesh(mesh, kind), POSITIONS[kind], kept=int(once and kind != topic_names.POSE))
            for kind in kinds
        ]
    described = dict.fromkeys(robot_parameters.topics(robots).values())
    wanted += [Wanted(topic, DESCRIPTION, latched=1) for topic in described]
    wanted += [Wanted(topic, JOINT_STATES) for topic in robot_parameters.joint_topics(robots)]
    # Distances and summaries too: they may be switched on at any time. Without stop_distance, stop is of another node.
    without = set()
    if parameters.get("stop_distance", -1.0) < 0:
        without.add(topic_names.STOP)
    if parameters.get("approach_time", 0.0) <= 0:
        without.add(topic_names.SPEED_SCALE)
    return [*wanted, *(Wanted(name, type_name) for name, type_name in RESULTS.items() if name not in without)]


def types_by_role(meshes, robots: RobotValues) -> dict[str, str]:
    """Relative name -> type of all topics from which the results of a node with these meshes and robots can be
    computed."""
    of_mesh = {topic_names.TOPOLOGY: TOPOLOGY, **POSITIONS}
    return {
        **{topic_names.of_mesh(mesh, kind): type_name for mesh in meshes for kind, type_name in of_mesh.items()},
        **{topic.name: topic.type_name for topic in transform_topics.ALL.values()},
        **dict.fromkeys(robot_parameters.topics(robots).values(), DESCRIPTION),
        **dict.fromkeys(robot_parameters.joint_topics(robots), JOINT_STATES),
        **RESULTS,
    }


def subscription_qos(node, name: str, topic: Wanted, depth: int) -> QoSProfile:
    """The QoS to request for `topic` (`name`: resolved) to receive everything that other subscribers receive.

    A reader that requests more than a writer offers receives nothing. So request the QoS that existing publishers
    offer, or else what other readers of the topic request, or else reliable delivery.
    """
    offers = [p.qos_profile.reliability for p in node.get_publishers_info_by_topic(name)]
    asked = [s.qos_profile.reliability for s in node.get_subscriptions_info_by_topic(name)]
    return _profile(ReliabilityPolicy.BEST_EFFORT not in (offers or asked), topic, depth)


def as_node_asks(node, name: str, topic: Wanted, depth: int, *, recorded, vertices: ReliabilityPolicy) -> QoSProfile:
    """The QoS for the own recording of the node `recorded`. vertices: that of vertices and joint states; other topics
    are reliable, unless parameters of the node (qos_overrides) change it.
    """
    default = vertices if topic.type_name in (*POSITIONS.values(), JOINT_STATES) else ReliabilityPolicy.RELIABLE
    entity = "publisher" if topic.type_name in RESULTS.values() else "subscription"
    asked = qos_overrides.reliability(recorded, entity, name, default)
    return _profile(asked == ReliabilityPolicy.RELIABLE, topic, depth)


def _profile(reliable: bool, topic: Wanted, depth: int) -> QoSProfile:
    return qos.keep_last(max(depth, topic.latched), reliable=reliable, latched=topic.latched > 0)


def recording_info(node: str, parameters: dict, wanted: list[Wanted], resolve: Callable[[str], str]) -> dict:
    """JSON-able. node: full name; parameters: {full name: value}; resolve: relative -> remapped absolute topic name."""
    return {
        "format": 1,
        "hpccd": package_version(),
        "node": node,
        "parameters": parameters,
        # The role of each topic, independent of remappings.
        "topics": {resolve(topic.name): topic.name for topic in wanted},
    }


def missing_shapes(parameters: dict, resolve: Callable[[str], str], received: Mapping[str, int]) -> list[str]:
    """One sentence for each mesh that has moved, or was needed for a result, and whose shape is missing.

    parameters: of the recorded node, {full name: value}. resolve: relative -> absolute name of a topic. received:
    messages so far, by absolute name.
    """

    def came(topic: str) -> bool:
        return received.get(resolve(topic), 0) > 0

    return [
        f"the shape of mesh {mesh} is not in the recording (nothing came on {' and '.join(missing)}), so no replay can "
        f"compute its steps; begin the recording before it is sent, send it again, or give the node mesh.{mesh}.file"
        for mesh in parameters["meshes"] or []  # None: never set
        if (missing := _missing(mesh, parameters, came))
    ]


def _missing(mesh: str, parameters: dict, came: Callable[[str], bool]) -> list[str]:
    """Topics of ``mesh`` on which its shape should have arrived."""
    given_as = parameters.get(f"mesh.{mesh}.input") or topic_names.VERTICES
    points = mesh in (parameters.get("points") or [])
    if parameters.get(f"mesh.{mesh}.file") or topic_names.is_whole(given_as, points):
        return []
    topology, *positions = (
        topic_names.of_mesh(mesh, kind) for kind in (topic_names.TOPOLOGY, *topic_names.positions(given_as))
    )
    once = [topology]
    if parameters.get(f"mesh.{mesh}.static"):
        once, needed_by = [topology, *positions], [topic_names.CONTACTS]
    elif given_as == TF:
        once, needed_by = [topology, *positions], list(transform_topics.ALL)
    elif given_as == topic_names.POSE:
        poses, *shape = positions
        once, needed_by = [topology, *shape], [poses]
    else:
        needed_by = positions
    return [topic for topic in once if not came(topic)] if any(map(came, needed_by)) else []
