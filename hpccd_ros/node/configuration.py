# SPDX-License-Identifier: Apache-2.0
"""The parameters of a node: declared and checked when it starts, followed as they change."""

from collections.abc import Callable
from typing import Any

from rclpy.node import Node

from hpccd_ros.base.quoting import listed, shortened
from hpccd_ros.detect.core import unusable_options
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.middleware import environment, qos_overrides, topic_names
from hpccd_ros.node import topic_types
from hpccd_ros.node.node_recording import unrecordable
from hpccd_ros.params import parameters, robot_parameters, scene_parameters
from hpccd_ros.params.robot_parameters import NO_ROBOTS, Robots
from hpccd_ros.params.table import ROBOT
from hpccd_ros.params.values import ParameterError

Meshes = dict[str, dict[str, Any]]


class Configuration:
    """``settings``, ``meshes`` (name -> parameters mesh.NAME.*) and the detector's ``options`` as they are now;
    ``robots``: those whose description is known.

    Raises ParameterError for parameters that the node cannot start with.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self.settings, self.meshes = parameters.declare(node)
        scene_parameters.check(self.settings, self.meshes)
        topics = topic_names.subscribed(self.meshes, robot_parameters.subscribed(self.settings[ROBOT]))
        if why := self._unusable_topics(self.settings, self.meshes) or qos_overrides.unusable_override(node):
            raise ParameterError(why)
        for name in parameters.unknown_overrides(node, qos_overrides.known(node, topics)):
            text = f"parameter {shortened(name)} is unknown and has no effect; see docs/parameters.md"
            node.get_logger().warning(text)
        self.robots: Robots = NO_ROBOTS
        self.options = scene_parameters.detector_options(self.settings)
        if why := unusable_options(self.options) or unrecordable(self.settings):
            raise ParameterError(why)

    def follow(self, configured: Callable[[], bool], on_change: Callable[[], None]) -> None:
        """From now on parameters may be set. configured: whether the life cycle is past `unconfigured`."""

        def check(wanted: dict[str, Any], meshes: Meshes) -> str | None:
            if configured() and (wanted["stop_distance"] < 0) != (self.settings["stop_distance"] < 0):
                return (
                    f"stop_distance: {wanted['stop_distance']} would switch the topic stop on or off, which it may not "
                    "be while the node is configured; deactivate and clean up first"
                )
            return self._check(wanted, meshes)

        def changed() -> None:
            self.options = scene_parameters.detector_options(self.settings, self.robots)
            on_change()

        parameters.watch(self._node, self.settings, self.meshes, configured=configured, check=check, on_change=changed)

    def know(self, robots: Robots) -> SceneBuilder:
        """From now on these are known; the scene with them. Raises ParameterError, and then those before stay: a pair
        names a link that there is not, nothing could ever be near for stop_distance."""
        robots = dict(robots)
        options = scene_parameters.detector_options(self.settings, robots)
        builder = scene_parameters.scene_builder(self.settings, self.meshes, robots)
        if len(robots) == len(self.settings["robots"]):
            scene_parameters.check_stop(self.settings, builder)
        self.options, self.robots = options, robots
        return builder

    def forget_robots(self) -> None:
        """None is known."""
        self.robots = NO_ROBOTS
        self.options = scene_parameters.detector_options(self.settings)

    def summary(self, contacts: str) -> str:
        """For the log, in one line. contacts: name of the topic."""
        options, robots = self.options, self.settings["robots"]
        where = f"on this host only ({environment.DISCOVERY}=SUBNET opens it)"
        meshes = listed(self.meshes) or ("none" if robots else "none (service only)")
        return (
            f"meshes {meshes}; {f'robots {listed(robots)}; ' if robots else ''}"
            f"tests {listed(options.features)}; accuracy {options.accuracy}, backend {options.backend}, "
            f"contacts on {contacts}; "
            f"discovery {where if environment.this_host_only() else 'beyond this host'}"
        )

    def _unusable_topics(self, settings: dict[str, Any], meshes: Meshes) -> str | None:
        robots = settings[ROBOT]
        topics = topic_names.subscribed(meshes, robot_parameters.subscribed(robots))
        return (
            robot_parameters.unusable_home(robots)
            or topic_names.unusable_name(self._node, topics)
            or topic_types.contradiction(self._node, settings, meshes)
        )

    def _check(self, wanted: dict[str, Any], meshes: Meshes) -> str | None:
        try:
            scene_parameters.check(wanted, meshes, self.robots)
            options = scene_parameters.detector_options(wanted, self.robots)
        except ParameterError as error:
            return str(error)
        if why := self._unusable_topics(wanted, meshes) or unrecordable(wanted):
            return why
        return None if options == self.options else unusable_options(options)
