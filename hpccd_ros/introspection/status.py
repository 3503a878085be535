# SPDX-License-Identifier: Apache-2.0
"""`hpccd status`: what a node receives, computes and lacks, from its life-cycle service, parameters and diagnostics."""

import json
import time
from collections.abc import Sequence
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from lifecycle_msgs.srv import GetState
from rclpy.node import Node, NodeNameNonExistentError

from hpccd_ros.base.errors import UserError
from hpccd_ros.base.quoting import counted, printable, quoted
from hpccd_ros.base.version import package_version
from hpccd_ros.introspection import peer
from hpccd_ros.middleware import qos
from hpccd_ros.params import node_parameters

_DIAGNOSTICS = "diagnostic_msgs/msg/DiagnosticArray"
_REMEDIES = {
    "unconfigured": "run hpccd lifecycle configure, then activate, or start it with autostart: true",
    "inactive": "run hpccd lifecycle activate, or start it with autostart: true",
}
# For frames that were dropped without another cause.
_REASONS = "; docs/troubleshooting.md has the meaning of each reason"
_OTHER_MESH = "unknown_mesh"
# Why stop is true although all is well with the node.
_WORKING = ("", "near", "inside")

Status = tuple[bytes, str, dict[str, str]]


def main(args) -> int:
    """Print the status of the node that ``args`` names, or of all; 0 if nothing is wrong, 1 if something is."""
    with peer.peer("status") as (node, stop):
        if args.node:
            names = [peer.chosen(node, args.node, args.wait, stop)]
        else:
            names = peer.hpccd_nodes(node, args.wait, stop)
        gather = _gather if len(names) == 1 else _gathered
        found = [gather(node, name, args.wait, stop) for name in names]
    if args.json:
        print(json.dumps(found, indent=2))
    else:
        # Texts come from any process that publishes diagnostics.
        print("\n\n".join("\n".join(map(printable, _lines(one))) for one in found))
    return 1 if any(one["wrong"] for one in found) else 0


def _gathered(node: Node, name: str, wait: float, stop: Sequence) -> dict[str, Any]:
    """The same as `_gather` for one of several nodes: if it does not respond, the others are shown."""
    try:
        return _gather(node, name, wait, stop)
    except UserError as error:
        return {"node": name, "state": "unknown", "wrong": [str(error)]}


def _gather(node: Node, name: str, wait: float, stop: Sequence) -> dict[str, Any]:
    """All that is shown of a node, as plain values."""
    deadline = time.monotonic() + wait
    (response,) = node_parameters.call(
        node, GetState, f"{name}/get_state", [GetState.Request()], deadline=deadline, remote=name, stop=stop
    )
    state = response.current_state.label
    parameters = node_parameters.fetch(node, name, wait, stop)
    statuses = _diagnostics(node, name, wait, stop)
    try:
        return {"node": name, "state": state, **_summary(statuses, parameters), "wrong": _wrong(state, statuses, wait)}
    except (KeyError, ValueError) as error:
        raise UserError(
            f"{name}: its /diagnostics are not those of hpccd {package_version()} ({quoted(str(error))}); use the "
            "hpccd of the node's version, and let no other node publish diagnostics under its name"
        ) from error


def _diagnostics(node: Node, name: str, wait: float, stop: Sequence) -> dict[str, Status]:
    """Part of the node -> its status, as the next report says; empty: none within ``wait`` s."""
    namespace, _, short = name.rpartition("/")
    found: dict[str, Status] = {}

    def receive(message: DiagnosticArray) -> None:
        for status in message.status:
            owner, _, part = status.name.rpartition(": ")
            if owner == name:
                found[part] = status.level, status.message, {value.key: value.value for value in status.values}

    try:
        published = node.get_publisher_names_and_types_by_node(short, namespace or "/")
    except NodeNameNonExistentError as error:
        raise UserError(f"{name}: the node has ended meanwhile; start it again") from error
    topics = [topic for topic, types in published if _DIAGNOSTICS in types]
    subscriptions = [node.create_subscription(DiagnosticArray, topic, receive, qos.DIAGNOSTICS) for topic in topics]
    deadline = time.monotonic() + wait
    while topics and not found and time.monotonic() < deadline:
        if stop:
            raise KeyboardInterrupt
        rclpy.spin_once(node, timeout_sec=0.05)
    for subscription in subscriptions:
        node.destroy_subscription(subscription)
    return found


def _summary(statuses: dict[str, Status], parameters: dict[str, Any]) -> dict[str, Any]:
    frames = _values(statuses, "frames")
    detection = _values(statuses, "detection")
    robots = parameters.get("robots") or []
    received = [key.removeprefix("received.") for key in frames if key.startswith("received.")]
    links = [mesh for mesh in received if mesh.partition("/")[0] in robots and "/" in mesh]
    static = {mesh for mesh in parameters.get("meshes") or [] if parameters.get(f"mesh.{mesh}.static")}
    meshes = {
        mesh: {**_of_mesh(frames, mesh), "static": mesh in static}
        for mesh in dict.fromkeys([*(parameters.get("meshes") or []), *received])
        if mesh not in links
    }
    stop = _values(statuses, "stop")
    return {
        "meshes": meshes,
        "robots": {
            robot: {
                "links": len(mine := [link for link in links if link.startswith(f"{robot}/")]),
                **_of_mesh(frames, mine[0] if mine else ""),
                "last_stamp_ns": _stamp(frames, topic := parameters.get(f"robot.{robot}.joint_states") or ""),
                "joint_states": topic,
            }
            for robot in robots
        },
        "results_hz": float(detection.get("rate_hz", 0)),
        "results": int(detection.get("detections", 0)),
        "latency_ms": {
            name: float(detection[key]) for name in ("p50", "p99") if (key := f"latency_ms.{name}") in detection
        },
        "dropped": int(frames.get("dropped", 0)),
        "dropped_by_reason": _by_reason(frames),
        "last_rejection": frames.get("last_rejection", ""),
        "stop": _stop(stop, statuses["stop"][1]) if stop else None,
    }


def _stop(values: dict[str, str], text: str) -> dict[str, Any]:
    """speed_scale: None: the node publishes none."""
    scale = values.get("speed_scale")
    return {
        "true": values["stop"] == "True",
        "text": text,
        "speed_scale": None if scale is None else float(scale),
        "not_closed": values["not_closed"],
    }


def _of_mesh(frames: dict[str, str], mesh: str) -> dict[str, Any]:
    return {
        "rate_hz": float(frames.get(f"rate_hz.{mesh}", 0)),
        "received": int(frames.get(f"received.{mesh}", 0)),
        "last_stamp_ns": _stamp(frames, mesh),
    }


def _stamp(frames: dict[str, str], mesh: str) -> int | None:
    stamp = frames.get(f"last_stamp.{mesh}")
    return None if stamp is None else int(stamp)


def _by_reason(frames: dict[str, str]) -> dict[str, int]:
    """Keys dropped.REASON, not dropped.MESH.REASON."""
    keys = (key.split(".") for key in frames if key.startswith("dropped."))
    return {parts[1]: int(frames[".".join(parts)]) for parts in keys if len(parts) == 2}


def _wrong(state: str, statuses: dict[str, Status], wait: float) -> list[str]:
    """One sentence for each thing that is wrong."""
    if state != "active":
        return [f"the node is {state}, so it detects nothing; {_REMEDIES.get(state, 'start it again')}"]
    if not statuses:
        return [
            f"no diagnostics within {wait:g} s; wait longer (--wait) where the parameter diagnostics_period is longer, "
            "or start the node again if it does not respond"
        ]
    wrong, stop = [], ""
    for part, (level, message, values) in statuses.items():
        warnings = [value for key, value in values.items() if key.startswith("warning.")]
        if part == "frames" and warnings:
            wrong += warnings
        elif part == "stop":
            stop = "" if values["cause"] in _WORKING else f"stop is {message}"
        elif level in (DiagnosticStatus.WARN, DiagnosticStatus.ERROR):
            wrong.append(f"{part}: {message}{_REASONS if part == 'frames' else ''}")
    dropped = _by_reason(_values(statuses, "frames"))
    dropped.pop(_OTHER_MESH, None)  # has a warning of its own
    if dropped and not int(_values(statuses, "detection").get("detections", 0)):
        # Diagnostics are about the last period, in which nothing may have come.
        many = counted(sum(dropped.values()), "message")
        wrong.append(f"no result so far: {many} dropped{_counts(dropped)}{_REASONS}")
    # Stop has a line already, which needs no repetition beside its cause.
    return wrong or ([stop] if stop else [])


def _counts(reasons: dict[str, int]) -> str:
    """In brackets, if there are any."""
    return f" ({', '.join(f'{reason} {count:,}' for reason, count in reasons.items())})" if reasons else ""


def _lines(found: dict[str, Any]) -> list[str]:
    lines = [f"{found['node']}: {found['state']}"]
    if "meshes" not in found:
        return lines + [f"  wrong: {text}" for text in found["wrong"]]
    inputs = [(name, _input_line(mesh)) for name, mesh in found["meshes"].items()]
    inputs += [(name, _robot_line(robot)) for name, robot in found["robots"].items()]
    width = max((len(name) for name, _ in inputs), default=0)
    lines += [f"  {name:{width}}  {text}" for name, text in inputs]
    if not inputs:
        lines.append("  no meshes: the node serves requests to ~/detect only")
    latency = found["latency_ms"]
    of_latency = f"; latency {latency['p50']:g} ms (median), {latency['p99']:g} ms (99 %)" if latency else ""
    lines.append(f"  results: {found['results_hz']:g} a second, {found['results']:,} in all{of_latency}")
    lines.append(f"  dropped: {counted(found['dropped'], 'message')}{_counts(found['dropped_by_reason'])}")
    if found["last_rejection"]:
        lines.append(f"  last rejection: {found['last_rejection']}")
    if found["stop"] is not None:
        lines.append(f"  stop: {found['stop']['text']}")
        if found["stop"]["not_closed"]:
            lines.append(f"  not closed, so whether a mesh is inside is unknown: {found['stop']['not_closed']}")
    return lines + ([f"  wrong: {text}" for text in found["wrong"]] or ["  nothing is wrong"])


def _robot_line(of: dict[str, Any]) -> str:
    if of["links"]:
        return f"robot of {counted(of['links'], 'link')}, {_input_line(of)}"
    stamp = of["last_stamp_ns"]
    if not of["joint_states"]:
        return "robot moved by TF, no frame yet"
    return (
        f"robot, no frame yet, {'no joint state received' if stamp is None else f'last joint state {_seconds(stamp)}'}"
    )


def _seconds(stamp: int) -> str:
    return f"{stamp // 10**9}.{stamp % 10**9:09d} s"


def _input_line(of: dict[str, Any]) -> str:
    if not of["received"]:
        return "static, no message received" if of.get("static") else "no message received"
    stamp = of["last_stamp_ns"]
    last = "" if stamp is None else f", last stamp {_seconds(stamp)}"
    rate = "static" if of.get("static") else f"{of['rate_hz']:g} Hz"
    return f"{rate}{last}, {counted(of['received'], 'message')} received"


def _values(statuses: dict[str, Status], part: str) -> dict[str, str]:
    return statuses[part][2] if part in statuses else {}
