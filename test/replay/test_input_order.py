# SPDX-License-Identifier: Apache-2.0
"""A replay takes recorded messages in the order that the node's results list, and reports no false differences."""

import copy

import crane
import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped, TransformStamped
from simulated_node import RESTART, Recorded, run, write
from std_msgs.msg import String
from waving_sheet import sheet_faces, sheet_positions

from hpccd_ros.bag.cut import Time, cut
from hpccd_ros.bag.reader import Recording
from hpccd_ros.frames import taken_inputs
from hpccd_ros.frames.taken_inputs import robots_known
from hpccd_ros.middleware import fields
from hpccd_ros.middleware.mesh_messages import topology_message, vertices_message
from hpccd_ros.replay import recorded_setup
from hpccd_ros.replay.recomputed import Replay

N = 4
TABLE = ("meshes/table/topology", "meshes/table/vertices")
QUAD = np.array([[0, 1, 2], [1, 3, 2]])
SQUARE = np.array([[-0.4, -0.4, 0.0], [0.4, -0.4, 0.0], [-0.4, 0.4, 0.0], [0.4, 0.4, 0.0]])
MESHES = {
    "meshes": ["cloth", "tool", "table"],
    "mesh.tool.input": "pose",
    "mesh.table.static": True,
    "minimum_separation": 0.05,
    "frame_id": "world",
    "restart_after": 2,
}
ROBOT = {
    "meshes": ["table"],
    "mesh.table.static": True,
    "robots": ["crane"],
    "frame_id": "world",
    "robot.crane.description": "robot_description",
    "robot.crane.joint_states": "joint_states",
    "minimum_separation": 0.05,
}


def _cloth(stamp, n):
    return "meshes/cloth/vertices", vertices_message(sheet_positions(N, n), stamp, frame_id="world")


def _square(mesh, n):
    vertices = SQUARE * (1 + 0.1 * np.cos(n)) + (0.2, 0.3, 0.02 * np.sin(n))
    return f"meshes/{mesh}/vertices", vertices_message(vertices, 1, frame_id="world")


def _placed(message, place, turn, stamp, n):
    message.header.stamp, message.header.frame_id = fields.ns_to_stamp(stamp), "world"
    place.x, place.y, turn.z, turn.w = 0.1 * np.sin(n), 0.1 * np.cos(n), np.sin(0.1 * n), np.cos(0.1 * n)
    return message


def _pose(stamp, n):
    message = PoseStamped()
    return "meshes/tool/pose", _placed(message, message.pose.position, message.pose.orientation, stamp, n)


def _base(stamp, n):
    message = TransformStamped(child_frame_id=crane.ROOT)
    return "transforms", _placed(message, message.transform.translation, message.transform.rotation, stamp, n)


def _joints(stamp, n):
    return "joint_states", crane.joint_state(n, stamp)


def _topologies():
    return [
        ("meshes/cloth/topology", topology_message(sheet_faces(N), N * N)),
        ("meshes/tool/topology", topology_message(QUAD, 4)),
        ("meshes/table/topology", topology_message(QUAD, 4)),
        _square("tool", 0),
        _square("table", 0),
    ]


def _swapped(taken, heard, topic, by):
    """The order of the node, which takes messages of one topic a number of places later than the recorder."""
    later = {place: place + by + 0.5 for place in taken if isinstance(place, int) and heard[place][0] == topic}
    first = next(iter(later), None)
    later.pop(first, None)
    return sorted(taken, key=lambda place: later.get(place, place))


def _sent_again():
    heard = _topologies()
    for k in range(1, 13):
        heard += [_square("tool", k), _square("table", 2 * k), _pose(k, k), _cloth(k, k)]
    return MESHES, heard, range(len(heard))


def _shape():
    parameters, heard, taken = _sent_again()
    return parameters, heard, _swapped(taken, heard, "meshes/tool/vertices", 3)


def _static():
    parameters, heard, taken = _sent_again()
    return parameters, heard, _swapped(taken, heard, "meshes/table/vertices", 3)


def _equal_stamps():
    """A recording of three runs; the results of each are in the file before their last frame."""
    heard = _topologies()
    for n in range(1, 28):
        heard += [_pose(1 + n % 9, n), _cloth(1 + n % 9, n)]
    return MESHES, heard, range(len(heard))


def _robot():
    return [("robot_description", String(data=crane.URDF)), *_topologies()[2:3], _square("table", 0)]


def _moving_base():
    heard = _robot()
    for k in range(1, 25):
        heard += [_joints(10 * k, k)] + [_base(10 * k + 3, k)] * (k % 2)
    taken = [robots_known(["crane"]), *range(1, len(heard))]
    return ROBOT, heard, [taken[0], *_swapped(taken[1:], heard, "joint_states", 1)]


def _described_late():
    heard = _robot()
    for k in range(1, 25):
        heard += [_joints(10 * k, k), _base(10 * k, k)]
    return ROBOT, heard, [*range(1, 20), robots_known(["crane"]), *range(20, len(heard))]


def _events():
    """The node is deactivated and activated, a parameter is set; later it is configured again."""
    heard = _topologies()
    for n in range(1, 31):
        heard += [_pose(1 + n % 10, n), _cloth(1 + n % 10, n)]
    taken = list(range(len(heard)))
    taken[48:48] = [RESTART, *range(5)]  # what is latched, and sent again
    taken[30:30] = [taken_inputs.STOPPED]
    taken[15:15] = [(taken_inputs.RESTART_AFTER, 1)]
    return MESHES, heard, taken


KINDS = {
    "shape": _shape,
    "static": _static,
    "equal stamps": _equal_stamps,
    "base": _moving_base,
    "described late": _described_late,
    "events": _events,
}


def _replay(path, parameters, messages):
    with Recording(write(path, parameters, messages)) as recording:
        replay = Replay(recording, recorded_setup.of_recording(recording), backend="cpu")
        return replay, list(replay.steps())


def _counts(replay):
    return replay.verified, replay.diverged, replay.unverified


def _results(messages):
    return [one for one in messages if one.topic == "contacts"]


@pytest.mark.parametrize("early", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_the_order_of_the_node_is_followed(tmp_path, kind, early):
    parameters, heard, taken = KINDS[kind]()
    messages = run(tmp_path / "x.mcap", parameters, heard, list(taken), early)
    results = _results(messages)
    replay, _ = _replay(tmp_path / "x.mcap", parameters, messages)
    assert _counts(replay) == (len(results), 0, 0) and len(results) >= 10
    assert sum(one.message.total > 0 for one in results) >= 5
    if kind in ("shape", "static", "base"):  # that the order matters: without the lists these are not verified
        for one in results:
            one.message.inputs_before = one.message.start_inputs = 0
            one.message.input_topic, one.message.input_sent, one.message.input_flags = [], [], []
        replay, _ = _replay(tmp_path / "x.mcap", parameters, messages)
        assert replay.diverged + replay.unverified > 0


@pytest.mark.parametrize("kind", KINDS)
def test_parts_are_verified(tmp_path, kind):
    """Cut anywhere: between the contacts and the distances of one step too."""
    parameters, heard, taken = KINDS[kind]()
    parameters = {**parameters, "distances": True}
    messages = run(tmp_path / "x.mcap", parameters, heard, list(taken))
    write(tmp_path / "x.mcap", parameters, messages)
    times = sorted({one.log_time for one in messages})
    distances = [one.log_time for one in messages if one.topic == "distances"]
    verified = 0
    for number, begin in enumerate([*times[7::13], distances[len(distances) // 2]]):
        part = tmp_path / f"{number}.mcap"
        with Recording(tmp_path / "x.mcap") as recording:
            cut(recording, part, Time(begin - times[0]), None)
        with Recording(part) as recording:
            replay = Replay(recording, recorded_setup.of_recording(recording), backend="cpu")
            steps = list(replay.steps())
        of_distances = replay.distances.diverged, replay.distances.unverified, replay.distances.first
        assert (replay.diverged, replay.unverified, *of_distances) == (0, 0, 0, 0, ""), (begin - times[0], steps)
        verified += replay.verified
    assert verified > 2 * len(distances)


def test_distances_belong_to_the_frame_of_their_result(tmp_path):
    parameters, heard, taken = _equal_stamps()
    parameters = {**parameters, "distances": True}
    messages = run(tmp_path / "x.mcap", parameters, heard, list(taken), early=True)
    replay, _ = _replay(tmp_path / "x.mcap", parameters, messages)
    told = replay.distances
    assert (told.verified, told.diverged, told.unverified) == (replay.verified, 0, 0)
    one = next(one for one in messages if one.topic == "distances")
    one.message.distance[0] += 1e-9
    replay, _ = _replay(tmp_path / "x.mcap", parameters, messages)
    assert replay.distances.diverged == 1


@pytest.fixture
def recorded(tmp_path):
    """replay(change) of a recording after change(results, messages), which may change the list."""
    parameters, heard, taken = _shape()
    messages = run(tmp_path / "x.mcap", parameters, heard, list(taken))

    def replay(change=lambda results, messages: None):
        copies = [Recorded(one.topic, copy.deepcopy(one.message), one.log_time, one.sent) for one in messages]
        change(_results(copies), copies)
        return _replay(tmp_path / "x.mcap", parameters, copies)

    return replay


AT = 5  # one of the eleven results


def test_a_wrong_result_diverges(recorded):
    assert _counts(recorded()[0]) == (11, 0, 0)

    def change(results, messages):
        results[AT].message.toc[0] = np.nextafter(results[AT].message.toc[0], 2)

    replay, steps = recorded(change)
    assert _counts(replay) == (10, 1, 0) and steps[AT].difference


@pytest.mark.parametrize("topic", ["meshes/cloth/vertices", "meshes/tool/vertices", "meshes/table/vertices"])
def test_a_changed_message_diverges(recorded, topic):
    def change(results, messages):
        vertices = [one for one in messages if one.topic == topic][6].message
        of_type = vertices.vertices_f32 if len(vertices.vertices_f32) else vertices.vertices_f64
        for place in range(2, len(of_type), 3):
            of_type[place] += 0.015625

    replay, _ = recorded(change)
    assert replay.diverged >= 1 and not replay.unverified


def test_a_list_in_another_order_is_not_verified(recorded):
    def change(results, messages):
        listed = results[AT].message
        for name in ("input_topic", "input_sent"):
            setattr(listed, name, getattr(listed, name)[::-1])

    replay, _ = recorded(change)
    assert replay.diverged + replay.unverified >= 1


def test_an_input_that_the_recording_lacks(recorded):
    def change(results, messages):
        results[AT].message.input_sent[0] += 1

    replay, steps = recorded(change)
    assert replay.diverged == 0 and replay.unverified >= 1 and steps[AT].missing
    assert "sent at 1000000000" in steps[AT].missing and "which the recording lacks" in steps[AT].missing

    def remove(results, messages):
        messages.remove([one for one in messages if one.topic == "meshes/tool/vertices"][6])

    replay, _ = recorded(remove)
    assert replay.diverged == 0 and replay.unverified >= 1


@pytest.mark.parametrize(
    ("field", "value", "says"),
    [
        ("start_inputs", 0, "make no frame at its start"),
        ("start_inputs", 10**6, "malformed: its step began after 1000000 inputs"),
        ("input_topic", [9, 0, 1, 2], "malformed: an input is of topic 9"),
        ("input_flags", [], "malformed: it lists 4 topics, 4 times and 0 flags"),
        ("input_topics", ["!danced", "meshes/cloth/vertices", "meshes/tool/pose", "x"], "event '!danced'"),
    ],
)
def test_lists_that_cannot_be(recorded, field, value, says):
    replay, steps = recorded(lambda results, messages: setattr(results[AT].message, field, value))
    assert replay.diverged == 0 and replay.unverified >= 1 and says in steps[AT].missing, steps[AT].missing


def test_a_result_without_its_list(recorded):
    def change(results, messages):
        results[AT].message.inputs_before = results[AT].message.start_inputs = 0
        for name in ("input_topic", "input_sent", "input_flags"):
            setattr(results[AT].message, name, [])

    replay, steps = recorded(change)
    assert replay.diverged == 0 and "does not list the inputs taken" in steps[AT].missing


def test_a_result_that_was_lost(recorded):
    """The next one lists less than was taken: a difference after it does not show that the node was wrong."""

    def lose(results, messages):
        messages.remove(results[AT])

    def change(results, messages):
        lose(results, messages)
        results[AT + 2].message.hash += 1

    assert recorded(lose)[0].diverged == 0
    replay, steps = recorded(change)
    assert replay.diverged == 0 and "an earlier result is missing" in steps[AT + 1].missing


def _change_list(change):
    def changed(message):
        for name in ("input_topic", "input_sent", "input_flags"):
            entries = list(getattr(message, name))
            change(entries)
            setattr(message, name, entries)

    return changed


def _before(value):
    def changed(message):
        message.inputs_before = value(message.inputs_before)

    return changed


def _begins_early(message):
    """As if the node was configured just then, and heard what was sent before the recording."""
    message.inputs_before, message.start_inputs, message.input_sent[0] = 0, 1, 1


FORGED = {
    "an entry twice": _change_list(lambda entries: entries.insert(0, entries[0])),
    "an entry less": _change_list(lambda entries: entries.pop(0)),
    "swapped": _change_list(lambda entries: entries.reverse()),
    "one less before": _before(lambda before: before - 1),
    "one more before": _before(lambda before: before + 1),
    "nothing before": _before(lambda before: 0),
    "begins early": _begins_early,
}


@pytest.mark.parametrize("forged", FORGED)
@pytest.mark.parametrize("kind", ["shape", "base", "events"])
def test_forged_lists_excuse_no_result(tmp_path, kind, forged):
    """Only results at the beginning of a recording can have begun before it."""
    parameters, heard, taken = KINDS[kind]()
    messages = run(tmp_path / "x.mcap", parameters, heard, list(taken))
    results = _results(messages)
    FORGED[forged](results[AT].message)
    for one in results[AT:]:
        one.message.hash ^= 12345
        one.message.total += 7
    replay, steps = _replay(tmp_path / "x.mcap", parameters, messages)
    assert not any(step.before_recording for step in steps), [step.missing for step in steps]
    assert replay.verified == AT and replay.diverged + replay.unverified == len(results) - AT
    if forged.startswith("one less"):
        assert steps[AT].missing == "its list does not continue that of the previous result"


def test_begun_in_the_middle(recorded):
    def change(results, messages):
        first = results[4].log_time - 5
        messages[:] = [one for one in messages if one.log_time > first or one.topic.endswith("topology")]
        tool = next(one for one in messages if one.topic == "meshes/tool/vertices")
        assert tool.log_time > first

    replay, _ = recorded(change)
    assert replay.diverged == replay.unverified == 0 and replay.verified >= 4


def test_split_files_begin_with_what_is_in_force(recorded):
    def change(results, messages):
        again = [one for one in messages if one.topic.endswith("topology")]
        messages += [Recorded(one.topic, one.message, results[AT].log_time, one.sent) for one in again]

    replay, _ = recorded(change)
    assert _counts(replay) == (11, 0, 0) and not replay.not_taken.total()


def test_messages_that_the_node_did_not_take(tmp_path):
    parameters, heard, taken = _shape()
    taken = [place for place in taken if place not in (13, 14)]
    messages = run(tmp_path / "x.mcap", parameters, heard, taken)
    replay, _ = _replay(tmp_path / "x.mcap", parameters, messages)
    assert replay.diverged == replay.unverified == 0 and replay.not_taken.total() == 2


def test_what_transforms_and_joints_were_before_the_recording_is_not_held_against_the_node(tmp_path):
    """It begins in the middle of a stream: for ten seconds frames may depend on what the node knew before."""
    heard = _robot()
    for k in range(1, 60):
        heard += [_joints(10**9 * k // 2, k), _base(10**9 * k // 2, k)]
    taken = [0, robots_known(["crane"]), *range(1, len(heard))][1:]
    messages = run(tmp_path / "x.mcap", ROBOT, heard, taken)
    results = _results(messages)
    begin = results[9].log_time
    kept = [one for one in messages if one.log_time > begin or one.topic in ("robot_description", *TABLE)]

    def counts(wrong):
        changed = [copy.deepcopy(one) if one is results[wrong] else one for one in kept]
        changed[kept.index(results[wrong])].message.hash += 1
        replay, steps = _replay(tmp_path / "x.mcap", ROBOT, changed)
        return _counts(replay), sum(step.before_recording for step in steps)

    late = len(results) - 10
    (verified, diverged, unverified), before = counts(15)
    assert (diverged, unverified) == (0, 0) and verified + before == late and verified >= late - 4
    (verified, diverged, unverified), before = counts(45)
    assert (diverged, unverified) == (1, 0) and verified + before == late - 1
