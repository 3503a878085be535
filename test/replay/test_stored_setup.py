# SPDX-License-Identifier: Apache-2.0
"""The parameters in a recording are checked as the node checks its parameters, before anything is computed."""

import json
import math

import pytest
from in_process import hpccd
from mcap_model import Bag


@pytest.fixture
def changed(sound_bags, tmp_path):
    """Writes a copy of a sound recording whose stored set-up was changed by `change(info)`, or replaced."""

    def write(change=None, base="streams", text=None, edit=lambda bag: None):
        bag = Bag.read(sound_bags / f"{base}.mcap")
        info = json.loads(bag.metadata[0].metadata["json"])
        if change is not None:
            info = change(info) or info
        bag.metadata[0].metadata["json"] = json.dumps(info) if text is None else text
        edit(bag)
        return bag.write(tmp_path / "changed.mcap")

    return write


def _rejected(path, *says):
    """By replay and view, in one line that holds all of `says`."""
    for command in (("replay", path), ("view", path, "-o", path.with_suffix(".png"))):
        done = hpccd(*command)
        assert not done.traceback, done.traceback
        assert done.status == 2 and done.err.startswith(f"hpccd {command[0]}: ") and done.err.count("\n") == 1, done
        assert len(done.err) < 1200
        for word in says:
            assert word in done.err, done.err


@pytest.mark.parametrize(
    ("name", "value", "says"),
    [
        ("meshes", "cloth", "meshes: 'cloth' is of the wrong type; expected string[]"),
        ("meshes", ["cloth", 7], "meshes: ['cloth', 7] is of the wrong type"),
        ("meshes", {"cloth": 1}, "meshes: "),
        ("meshes", [], "names no mesh"),
        ("meshes", ["cloth", "cloth"], "names must differ"),
        ("meshes", ["cloth/../ball"], "cannot be part of a topic name"),
        ("frame_queue", "x", "frame_queue: 'x' is of the wrong type; expected int"),
        ("frame_queue", 10**30, "frame_queue"),
        ("frame_queue", True, "frame_queue: True is of the wrong type"),
        ("pending_frames", 2.5, "pending_frames: 2.5 is of the wrong type"),
        ("stamp_match", "sometimes", "stamp_match: 'sometimes' is not valid; use one of exact, nearest"),
        ("stamp_tolerance", math.nan, "stamp_tolerance: nan is outside"),
        ("restart_after", [], "restart_after: [] is of the wrong type"),
        ("max_vertices", -1, "max_vertices: -1 is outside"),
        ("report", "none", "report: 'none' is not valid; use one of"),
        ("accuracy", None, None),
        ("frame_id", "a" * 100_000, None),
        ("ignored_pairs", ["cloth:cloth"], "ignored_pairs: 'cloth:cloth' must be"),
        ("ignored_pairs", [["cloth", "ball"]], "ignored_pairs: "),
        ("pair_accuracy", ["cloth:ball:best"], "pair_accuracy: 'cloth:ball:best' must be"),
        ("mesh.cloth.static", "no", "mesh.cloth.static: 'no' is of the wrong type; expected bool"),
        ("mesh.cloth.file", 5, "mesh.cloth.file: 5 is of the wrong type"),
        ("mesh.cloth.transform", "turn", "mesh.cloth.transform: 'turn' is not valid; use one of"),
        ("mesh.cloth.pose", [0.0] * 7, "mesh.cloth.pose: "),
        ("mesh.cloth.pose", [0.0, 1.0], "mesh.cloth.pose: "),
        ("mesh.cloth.pose", "here", "mesh.cloth.pose: 'here' is of the wrong type; expected float[]"),
    ],
)
def test_a_stored_parameter_that_no_node_could_have(changed, name, value, says):
    path = changed(lambda info: info["parameters"].update({name: value}))
    if says is None:  # not set, or of no consequence
        assert hpccd("replay", path).status in (0, 1)
    else:
        _rejected(path, "the stored parameters: ", says)


def test_a_scene_that_cannot_move(changed):
    def change(info):
        info["parameters"] |= {"mesh.cloth.static": True, "mesh.ball.static": True}

    _rejected(changed(change), "at least one mesh must not be static")


def test_a_parameter_of_another_version_is_told_of(changed):
    path = changed(
        lambda info: info["parameters"].update({"gravity": 9.81, "use_sim_time": False, "qos_overrides./x.depth": 1})
    )
    done = hpccd("replay", path)
    assert done.status == 0 and done.err.startswith("parameter gravity is unknown and has no effect; ")


@pytest.mark.parametrize("text", ["", "{", "[" * 100_000, '{"a":' * 5_000, "9" * 5000, "nan ", "\0"])
def test_a_setup_that_is_no_json(changed, text):
    _rejected(changed(text=text), "stored about the node")


@pytest.mark.parametrize("setup", [[], [1], "x", 7, None, True])
def test_a_setup_that_is_no_object(changed, setup):
    _rejected(changed(text=json.dumps(setup)), "stored about the node is not an object but a")


@pytest.mark.parametrize("value", [[1], "x", 7, True])
@pytest.mark.parametrize("name", ["parameters", "topics"])
def test_parameters_and_topics_that_are_no_names_with_values(changed, name, value):
    _rejected(changed(lambda info: info.update({name: value})), "no names")


def test_roles_are_checked_against_types(changed):
    def swap(info):
        topics = info["topics"]
        topics["/contacts"], topics["/meshes/ball/vertices"] = topics["/meshes/ball/vertices"], topics["/contacts"]

    _rejected(changed(swap), "is stored as the node's", "hpccd/msg/")


@pytest.mark.parametrize(
    "role", ["", "/", "meshes//vertices", "meshes/cloth", "meshes/nobody/vertices", "meshes/ball/contacts", 5]
)
def test_topics_of_no_role_are_left_alone(changed, role):
    path = changed(lambda info: info["topics"].update({"/meshes/ball/vertices": role}))
    done = hpccd("replay", path)
    assert done.status == 1 and "VERIFIED: 7" not in done.out and not done.traceback  # no frames of the ball


def test_a_role_of_two_topics(changed):
    def change(info):
        info["topics"]["/meshes/ball/vertices"] = "meshes/cloth/vertices"

    _rejected(changed(change), "are both stored as meshes/cloth/vertices")


@pytest.mark.parametrize(
    "name",
    [
        "",
        "a/b",
        "a/b/c/d",
        "../../etc/passwd",
        "os/path/join",
        "os.path/msg/join",
        ".x/msg/Y",
        "\0/\0/\0",
        "a\nb/msg/C",
        "nowhere_msgs/msg/Nothing",
        "hpccd/msg/__doc__",
    ],
)
def test_names_of_types_are_looked_at_before_they_are_used(changed, name):
    def edit(bag):
        for schema in bag.schemas:
            schema.name = name if schema.name == "hpccd/msg/ContactArray" else schema.name

    _rejected(changed(edit=edit), "/contacts")
    played = hpccd("replay", changed(edit=edit), "--publish", "--all", "--subscribers", "0", "--wait", "0")
    assert played.status == 2 and "/contacts cannot be played" in played.err, played


@pytest.mark.parametrize("fewer", [True, False], ids=["a field less", "a field of another name"])
def test_recordings_with_another_definition_are_not_played(changed, fewer):
    """Their bytes would be read as other values, or as none."""

    def edit(bag):
        for schema in bag.schemas:
            if schema.name == "hpccd/msg/MeshTopology":
                text = schema.data.decode()
                other = text.replace("uint32[] edges", "") if fewer else text.replace("uint32 version", "uint32 other")
                assert other != text
                schema.data = other.encode()
                channels = [channel for channel in bag.channels if channel.schema_id == schema.id]
                for channel in channels:
                    channel.metadata.pop("topic_type_hash", None)

    played = hpccd("replay", changed(edit=edit), "--publish", "--subscribers", "0", "--wait", "0", "--rate", "0")
    assert played.status == 2 and "another definition of hpccd/msg/MeshTopology" in played.err, played


@pytest.mark.parametrize("qos", ["[", "x", "- 1", "{a: 1}", "2020-13-45", "[" * 10_000, "- null", "- !!bool x"])
def test_quality_of_service_that_is_none(changed, qos):
    def edit(bag):
        bag.channels[0].metadata["offered_qos_profiles"] = qos

    played = hpccd("replay", changed(edit=edit), "--publish", "--subscribers", "0", "--wait", "0", "--rate", "0")
    assert played.status == 2 and "quality of service is not stored as rosbag2 does" in played.err, played


@pytest.mark.parametrize("topic", ["", "/a b", "contacts", "//", "/ü", "/{a}"])
def test_topics_that_cannot_be_played(changed, topic):
    def edit(bag):
        bag.channels[0].topic = topic

    played = hpccd(
        "replay", changed(edit=edit), "--publish", "--all", "--subscribers", "0", "--wait", "0", "--rate", "0"
    )
    assert played.status == 2 and "cannot be played" in played.err, played


@pytest.mark.parametrize(
    ("file", "says"),
    [
        ("..", "format"),
        ("/", "format"),
        ("floor", "format"),
        ("/etc/passwd", "format"),
        ("floor\0.obj", "no such file"),
        ("~nobody9/x.obj", "mesh floor of the recording: "),
        ("a" * 300 + ".obj", "mesh floor of the recording: "),
    ],
)
def test_names_of_mesh_files(changed, file, says):
    path = changed(lambda info: info["parameters"].update({"mesh.floor.file": file}), base="everything")
    _rejected(path, says)


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"v 0 0 0\n",
        b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 99\n",
        b"\xff" * 100,
        b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    ],
)
def test_contents_of_mesh_files(changed, data):
    def edit(bag):
        bag.attachments[0].data = data

    _rejected(changed(base="everything", edit=edit))
