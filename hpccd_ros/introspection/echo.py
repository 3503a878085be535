# SPDX-License-Identifier: Apache-2.0
"""`hpccd echo`: print the messages of a topic."""

import contextlib
import sys
import time
from collections.abc import Sequence
from typing import Any

import rclpy
from rcl_interfaces.msg import ParameterType
from rcl_interfaces.srv import GetParameters
from rclpy.exceptions import InvalidTopicNameException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from rclpy.subscription import Subscription

from hpccd_ros.base.errors import UserError
from hpccd_ros.base.quoting import counted, listed, quoted, suggestion
from hpccd_ros.introspection import message_text, peer
from hpccd_ros.middleware import graph, qos, topic_names
from hpccd_ros.middleware.message_types import message_class
from hpccd_ros.params import node_parameters

# Messages that may wait to be printed.
_DEPTH = 100
# s between two looks at what the publishers offer.
_LOOK_EVERY = 0.2
# s in which nodes are discovered before topics are listed.
_SETTLE = 1.0
_OF_EVERY_NODE = ("/rosout", "/parameter_events")
# s without a message, after which it is said that none has come.
_QUIET = 3.0
# s for the publisher's node to answer why.
_PATIENCE = 1.0
# Last part of a topic -> the parameter of the node that switches it on.
_SWITCHES = {
    topic_names.DISTANCES: "distances",
    topic_names.PAIRS: "pair_summaries",
    topic_names.MARKERS: "markers",
    topic_names.SURFACE: "markers",
}


def main(args) -> int:
    """Print messages until as many as ``args`` asks for have come, or until SIGINT or SIGTERM."""
    with peer.peer("echo") as (node, stop):
        if args.topic is None:
            return _list(node, args.wait, stop)
        topic = _resolved(node, args.topic)
        type_name = _type(node, topic, args.wait, stop)
        try:
            message_type = message_class(type_name)
        except LookupError as error:
            raise UserError(f"{topic}: {error}; install the package of this message type") from error
        _Printer(node, topic, type_name, message_type, args).run(stop)
    return 0


def _list(node: Node, wait: float, stop: Sequence) -> int:
    """Print the topics with their types."""
    found: dict[str, str] = {}
    deadline, settled = time.monotonic() + wait, 0.0
    while not found or time.monotonic() < settled:
        if not found and time.monotonic() > deadline:
            raise UserError(f"no topics on {graph.domain()}; start a node, or {graph.elsewhere()}")
        _wait(node, stop)
        topics = node.get_topic_names_and_types()
        found = {name: listed(types) for name, types in topics if name not in _OF_EVERY_NODE}
        settled = settled or (time.monotonic() + _SETTLE if found else 0.0)
    width = max(map(len, found))
    for name, types in sorted(found.items()):
        print(f"{name:{width}}  {types}")
    return 0


def _resolved(node: Node, topic: str) -> str:
    try:
        return node.resolve_topic_name(topic)
    except (InvalidTopicNameException, RuntimeError) as error:  # RuntimeError: rclpy's, of a name that is too long
        raise UserError(
            f"{quoted(topic)}: not a topic name; write it as /contacts or /meshes/cloth/vertices"
        ) from error


def _type(node: Node, topic: str, wait: float, stop: Sequence) -> str:
    deadline = time.monotonic() + wait
    while topic not in (found := dict(node.get_topic_names_and_types())):
        if time.monotonic() > deadline:
            names = [name for name in found if name not in _OF_EVERY_NODE]
            there = f" (there are: {listed(names)})" if names else ""
            raise UserError(
                f"{topic}: no such topic on {graph.domain()}{there}; start its publisher, or {graph.elsewhere()}"
                f"{suggestion(topic, names)}"
            )
        _wait(node, stop)
    offered = {publisher.topic_type for publisher in node.get_publishers_info_by_topic(topic)}
    types = sorted(offered) or found[topic]
    if len(types) > 1:
        raise UserError(
            f"{topic}: it has publishers of several types ({listed(types)}); stop the publishers of the wrong type"
        )
    return types[0]


class _Printer:
    """Asks for what the publishers offer, now and later: DDS does not connect a publisher that offers less."""

    def __init__(self, node: Node, topic: str, type_name: str, message_type: type, args) -> None:
        self._node = node
        self._topic = topic
        self._type_name = type_name
        self._message_type = message_type
        self._args = args
        self._waiting: list[Any] = []
        self._asked: tuple[bool, bool] | None = None
        self._subscription: Subscription | None = None

    def run(self, stop: Sequence) -> None:
        printed, quiet_at, look = 0, time.monotonic() + _QUIET, 0.0
        while not stop:
            if time.monotonic() >= look:
                look = time.monotonic() + _LOOK_EVERY
                self._subscribe()
            rclpy.spin_once(self._node, timeout_sec=0.1)
            for message in self._waiting:
                print("\n".join(message_text.lines(message, self._args.full)), "---", sep="\n", flush=True)
                printed += 1
                if printed == self._args.count:
                    return
            self._waiting.clear()
            if not printed and time.monotonic() > quiet_at:
                quiet_at = float("inf")
                count = self._node.count_publishers(self._topic)
                near = "" if count else graph.near_published(self._node, self._topic, self._type_name)
                publishers = f"{counted(count, 'publisher')}{self._switched_off()}"
                text = f"{self._topic}: no message yet; it has {publishers}; Ctrl-C ends"
                print(f"{text}; did you mean {near}?" if near else text, file=sys.stderr, flush=True)

    def _switched_off(self) -> str:
        """The end of a message: the publisher's parameter that is false, with the remedy."""
        switch = _SWITCHES.get(self._topic.rpartition("/")[2])
        for publisher in self._node.get_publishers_info_by_topic(self._topic) if switch else ():
            name = graph.full_name(publisher.node_name, publisher.node_namespace)
            request = GetParameters.Request(names=[switch])
            deadline = time.monotonic() + _PATIENCE
            with contextlib.suppress(UserError):  # of another program
                (response,) = node_parameters.call(
                    self._node, GetParameters, f"{name}/get_parameters", [request], deadline=deadline, remote=name
                )
                if any(v.type == ParameterType.PARAMETER_BOOL and not v.bool_value for v in response.values):
                    return f"; parameter {switch} is false: hpccd param set {switch} true --node {name}"
        return ""

    def _subscribe(self) -> None:
        offers = [publisher.qos_profile for publisher in self._node.get_publishers_info_by_topic(self._topic)]
        reliable = all(offer.reliability == ReliabilityPolicy.RELIABLE for offer in offers)
        latched = all(offer.durability == DurabilityPolicy.TRANSIENT_LOCAL for offer in offers)
        if not offers or (reliable, latched) == self._asked:
            return
        if self._subscription is not None:
            self._node.destroy_subscription(self._subscription)
        profile = qos.keep_last(_DEPTH, reliable=reliable, latched=latched)
        self._subscription = self._node.create_subscription(
            self._message_type, self._topic, self._waiting.append, profile
        )
        self._asked = reliable, latched


def _wait(node: Node, stop: Sequence) -> None:
    if stop:
        raise KeyboardInterrupt
    rclpy.spin_once(node, timeout_sec=0.02)
