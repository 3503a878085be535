# SPDX-License-Identifier: Apache-2.0
"""Start, life cycle, run-time parameters, signals: how the node begins and ends."""

import functools
import signal
import threading

import numpy as np
import pytest
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from node_calls import N, call, change_state, set_parameter, state, stream
from node_process import MODULE, PATIENCE, assert_same_contacts
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.parameter import Parameter
from waving_sheet import scene_of, sheet_faces, sheet_positions

import hpccd_core as hc
from hpccd_ros.middleware import fields


@pytest.fixture
def start_node(start_node):
    """A Python of its own for each node: how it begins and ends is what is tested."""
    return functools.partial(start_node, program=MODULE)


FACES = sheet_faces(N)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["SIGINT", "SIGTERM"])
@pytest.mark.parametrize("busy", [False, True], ids=["idle", "streaming"])
def test_signals_end_the_node_cleanly(start_node, number, busy):
    node = start_node({"meshes": ["cloth"]})
    end = threading.Event()
    if busy:
        n = 60
        node.peer.topology("cloth", sheet_faces(n), n * n)
        frames = [sheet_positions(n, k) for k in range(4)]

        def publish():
            k = 0
            while not end.is_set():
                node.peer.vertices("cloth", frames[k % 4], k)
                k += 1
                end.wait(0.005)

        publisher = threading.Thread(target=publish)
        node.peer.vertices("cloth", frames[3], 0)
        publisher.start()
        node.contacts(3)
    status = node.stop(number)
    if busy:
        end.set()
        publisher.join(PATIENCE)
    output = node.output()
    assert status == 0, output
    # Where shared memory is short, as in containers, the middleware says so and goes on over UDP.
    own = [line for line in output.splitlines() if "RTPS_TRANSPORT_SHM" not in line]
    assert not any("Traceback" in line or "rror" in line for line in own), output


def test_second_signal_changes_nothing(start_node):
    node = start_node({"meshes": ["cloth"]})
    node.process.send_signal(signal.SIGTERM)
    assert node.stop(signal.SIGINT) == 0, node.output()
    assert "Traceback" not in node.output()


# Python's finalization deletes the object, as soon as what the node froze is collected again.
SIGNAL_AT_THE_END = """
import gc, os, pathlib, signal, sys
from hpccd_ros.node import start
class AtTheEnd:
    def __del__(self, kill=os.kill, process=os.getpid(), number=signal.SIGTERM, write=os.write):
        kill(process, number)
        write(1, b"signal sent")
at_the_end = AtTheEnd()
status = start.main()
gc.unfreeze()
print("threads", *(file.read_text().strip() for file in pathlib.Path("/proc/self/task").glob("*/comm")), flush=True)
sys.exit(status)
"""


def test_nothing_of_dds_outlives_the_node(start_node, tmp_path):
    """A participant that is left to static destructors crashes some ends; a signal in finalization changes nothing."""
    parameters = {"meshes": ["cloth", "net"], "stop_distance": 0.1, "record": str(tmp_path / "run.mcap")}
    node = start_node(parameters, program=("-c", SIGNAL_AT_THE_END))
    assert node.stop() == 0, node.output()
    assert "signal sent" in node.output()
    threads = next(line for line in node.output().splitlines() if line.startswith("threads ")).split()[1:]
    # The watchdog of shared memory belongs to the process, not to a participant.
    assert [name for name in threads if name.startswith("dds.") and name != "dds.shm.wdog"] == []


@pytest.mark.parametrize(
    "parameters, status, text",
    [
        ({"meshes": ["cloth"], "accuracy": "sloppy"}, 2, "accuracy: 'sloppy' is not valid; use one of"),
        ({"meshes": ["cloth"], "threads": -1}, 2, "threads"),
        ({"meshes": ["cloth"], "threads": "all"}, 2, "threads"),
        ({"meshes": ["a/b"]}, 2, "'a/b' cannot be part of a topic name"),
        ({"meshes": ["cloth"], "backend": "gpu"}, 2, "gpu"),
        (
            {"meshes": ["cloth"], "mesh": {"cloth": {"file": "/nowhere/cloth.obj"}}},
            1,
            "/nowhere/cloth.obj: no such file",
        ),
        ({"meshes": ["cloth"], "mesh": {"cloth": {"static": True}}}, 1, "at least one mesh must not be static"),
    ],
    ids=["choice", "range", "type", "name", "backend", "file", "static"],
)
def test_start_that_cannot_work_says_why(start_node, parameters, status, text):
    if parameters.get("backend") == "gpu":
        import hpccd_core

        if "gpu" in hpccd_core.backends():
            pytest.skip("this machine has a GPU")
    node = start_node(parameters, wait=False)
    assert node.process.wait(timeout=PATIENCE) == status
    assert text in node.output() and "Traceback" not in node.output()


def test_a_parameter_of_another_node_is_warned_of(start_node):
    node = start_node({"meshes": ["cloth"], "other_node_gain": 0.5})
    assert "parameter other_node_gain is unknown and has no effect" in node.output()


def test_life_cycle(start_node):
    node = start_node({"meshes": ["cloth"], "autostart": False}, wait=False)
    assert state(node) == "unconfigured"
    assert change_state(node, Transition.TRANSITION_CONFIGURE)
    node.wait_until(lambda: node.peer.statuses, "diagnostics")
    assert state(node) == "inactive"
    assert change_state(node, Transition.TRANSITION_ACTIVATE)
    node.peer.topology("cloth", FACES, N * N)
    stream(node, range(3))
    node.frames_status(processed=3)
    assert change_state(node, Transition.TRANSITION_DEACTIVATE)
    node.peer.vertices("cloth", sheet_positions(N, 3), 3)  # nobody listens
    assert change_state(node, Transition.TRANSITION_ACTIVATE)
    # The topology is still known; the last positions are not, as what happened since was not seen.
    node.peer.forget_publisher("meshes/cloth/vertices")
    for k in (4, 5):
        node.peer.vertices("cloth", sheet_positions(N, k), k)
        node.frames_status(processed=k)
    message = node.contacts(3)[2]
    assert fields.stamp_to_ns(message.start) == 4
    assert_same_contacts(message, sheet_positions(N, 4), sheet_positions(N, 5), scene_of(cloth=FACES))
    assert change_state(node, Transition.TRANSITION_DEACTIVATE)
    assert change_state(node, Transition.TRANSITION_CLEANUP)
    assert state(node) == "unconfigured"
    assert change_state(node, Transition.TRANSITION_CONFIGURE)
    assert change_state(node, Transition.TRANSITION_ACTIVATE)
    assert change_state(node, Transition.TRANSITION_ACTIVE_SHUTDOWN)
    assert state(node) == "finalized"
    assert node.stop() == 0


def label_of(node, label):
    request = ChangeState.Request(transition=Transition(label=label))
    return call(node, ChangeState, "change_state", request).success


def test_transitions_that_the_state_does_not_have_are_rejected(start_node):
    """What is asked for in the wrong state or does not exist at all gets a response, and changes nothing."""
    node = start_node({"meshes": ["cloth"]})
    node.peer.topology("cloth", FACES, N * N)
    stream(node, range(2))
    # The first thing that a life-cycle manager sends to any node, this one started by itself or not.
    assert not change_state(node, Transition.TRANSITION_CONFIGURE)
    assert not change_state(node, Transition.TRANSITION_ACTIVATE)
    for unknown in (Transition.TRANSITION_CREATE, Transition.TRANSITION_ON_CONFIGURE_SUCCESS, 77, 255):
        assert not change_state(node, unknown), unknown
    assert not label_of(node, "configure") and not label_of(node, "no such transition")
    assert state(node) == "active"
    stream(node, [2])
    assert label_of(node, "deactivate") and not label_of(node, "deactivate")
    assert not change_state(node, Transition.TRANSITION_ACTIVE_SHUTDOWN)
    assert state(node) == "inactive"
    assert change_state(node, Transition.TRANSITION_INACTIVE_SHUTDOWN)
    for transition in (Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_UNCONFIGURED_SHUTDOWN):
        assert not change_state(node, transition)
    assert state(node) == "finalized"
    assert node.stop() == 0 and "Traceback" not in node.output()


def test_scene_is_changed_while_unconfigured(start_node):
    """Scene and streams are read when configured: told so while they are in use, taken after a clean-up."""
    node = start_node({"meshes": ["cloth", "net"], "max_vertices": 10_000})
    for name in ("cloth", "net"):
        node.peer.topology(name, FACES, N * N)
    frames = [sheet_positions(N, k) for k in range(4)]
    for k in range(2):
        for name in ("cloth", "net"):
            node.peer.vertices(name, frames[k], k)
        node.contacts(k)
    scene = scene_of(cloth=FACES, net=FACES)
    assert_same_contacts(node.contacts(1)[0], *(np.concatenate([f, f]) for f in frames[:2]), scene)
    changes = [
        ("mesh.net.static", True),
        ("ignored_pairs", ["net:cloth"]),
        ("pair_accuracy", ["cloth:cloth:fast"]),
        ("stamp_match", "nearest"),
        ("max_vertices", 5_000),
    ]
    for name, value in changes:
        result = set_parameter(node, name, value)
        assert not result.successful and f"{name}: read-only while the node is configured" in result.reason
    assert change_state(node, Transition.TRANSITION_DEACTIVATE)
    assert "run hpccd lifecycle deactivate, then cleanup" in set_parameter(node, "stamp_match", "nearest").reason
    assert change_state(node, Transition.TRANSITION_CLEANUP)
    for name, value in changes:
        assert set_parameter(node, name, value).successful, name
    for name, value, reason in [
        ("mesh.cloth.file", "/nowhere/cloth.obj", ""),  # found out when it is read
        ("ignored_pairs", ["net:towel"], "two different meshes out of cloth, net"),
        ("mesh.net.pose", [0.0] * 7, "mesh.net.pose: "),
        ("meshes", ["cloth"], "read-only"),
    ]:
        result = set_parameter(node, name, value)
        assert result.successful == (not reason) and reason in result.reason
    assert not change_state(node, Transition.TRANSITION_CONFIGURE)
    assert state(node) == "unconfigured" and "/nowhere/cloth.obj: no such file" in node.output()
    assert set_parameter(node, "mesh.cloth.file", "").successful
    assert change_state(node, Transition.TRANSITION_CONFIGURE)
    assert change_state(node, Transition.TRANSITION_ACTIVATE)
    for name in ("cloth", "net"):  # latched, but these publishers were matched by the subscriptions that are gone
        for kind in ("topology", "vertices"):
            node.peer.forget_publisher(f"meshes/{name}/{kind}")
        node.peer.topology(name, FACES, N * N)
    node.peer.vertices("net", frames[3], 0)
    node.frames_status(processed=5)
    before = len(node.peer.received)
    for k in (2, 3):
        node.peer.vertices("cloth", frames[k], 10 + k)
        node.frames_status(processed=4 + k)
    scene = hc.Scene()
    scene.add_mesh("cloth", FACES)
    scene.add_mesh("net", FACES, static=True)
    scene.ignore_pair("cloth", "net")
    scene.set_accuracy("cloth", "cloth", "fast")
    message = node.contacts(before + 1)[before]
    assert assert_same_contacts(message, *(np.concatenate([f, frames[3]]) for f in frames[2:]), scene) > 0


def test_counts_outlive_a_clean_up(start_node):
    node = start_node({"meshes": ["cloth", "floor"], "mesh": {"floor": {"static": True}}})
    for name in ("cloth", "floor"):
        node.peer.topology(name, FACES, N * N)
    node.peer.vertices("floor", sheet_positions(N, 5), 0)
    node.frames_status(received=1, processed=1)
    stream(node, range(3))
    node.peer.vertices("cloth", sheet_positions(N, 0), 0)  # begins before what was processed
    node.frames_status(received=5, processed=4, dropped=1)
    assert change_state(node, Transition.TRANSITION_DEACTIVATE) and change_state(node, Transition.TRANSITION_CLEANUP)
    node.peer.statuses.clear()
    assert change_state(node, Transition.TRANSITION_CONFIGURE)
    node.frames_status(received=5, processed=4, dropped=1)


MARKERS_MEANWHILE = """
import sys
from hpccd_ros.node import node, run
class MarkersMeanwhile(node.HpccdNode):
    def _publish(self, found):
        self._settings["markers"] = True
        super()._publish(found)
sys.exit(run.main(node_type=MarkersMeanwhile))
"""


def test_markers_are_asked_for_while_a_step_is_detected(start_node):
    """That step was detected without the normals that they show: it is processed once, and not shown."""
    node = start_node({"meshes": ["cloth"], "outputs": ["points"]}, program=("-c", MARKERS_MEANWHILE))
    node.peer.topology("cloth", FACES, N * N)
    for k in range(3):
        node.peer.vertices("cloth", sheet_positions(N, k), k)
        values = node.frames_status(received=k + 1, waiting=0)
        assert values["processed"] == values["received"] and values["dropped"] == "0", node.output()


def test_values_of_a_type_that_does_not_exist_are_rejected(start_node):
    node = start_node({"meshes": ["cloth"]})
    good = Parameter("report", value="first").to_parameter_msg()
    bad = Parameter("accuracy", value="fast").to_parameter_msg()
    bad.value.type = 77
    results = call(node, SetParameters, "set_parameters", SetParameters.Request(parameters=[bad, good])).results
    assert [result.successful for result in results] == [False, True]
    assert "accuracy: type 77 is not valid; use one of" in results[0].reason
    request = SetParametersAtomically.Request(parameters=[good, bad])
    result = call(node, SetParametersAtomically, "set_parameters_atomically", request).result
    assert not result.successful and "accuracy: type 77 is not valid; use one of" in result.reason
    assert node.stop() == 0 and "Traceback" not in node.output()


def test_options_change_at_run_time(start_node):
    node = start_node({"meshes": ["cloth"]})
    node.peer.topology("cloth", FACES, N * N)
    scene = scene_of(cloth=FACES)
    stream(node, range(2))
    assert set_parameter(node, "report", "first").successful
    assert set_parameter(node, "outputs", ["normals"]).successful
    stream(node, [2])
    message = node.contacts(2)[1]
    assert_same_contacts(message, sheet_positions(N, 1), sheet_positions(N, 2), scene, report="first")
    assert len(message.normals) == 3 * len(message.toc) and len(message.points) == 0
    for name, value, reason in [
        ("accuracy", "sloppy", "is not valid; use one of"),
        ("frame_queue", 7, "read-only"),
        ("max_contacts", -1, "range"),
        ("threads", "four", "expected int"),
    ]:
        result = set_parameter(node, name, value)
        assert not result.successful and reason in result.reason, (name, result.reason)
    assert set_parameter(node, "report", "all").successful
    stream(node, [3])
    assert_same_contacts(node.contacts(3)[2], sheet_positions(N, 2), sheet_positions(N, 3), scene)
