# SPDX-License-Identifier: Apache-2.0
"""Mistakes that users make with the commands: each is answered in one line, with the problem and its remedy."""

import itertools

import pytest

from hpccd_ros import cli
from hpccd_ros.commands import bench

# Arguments -> a part of the line; BAG stands for a sound recording, PARAMS for a file with a misspelt parameter.
MISTAKES = {
    ("record", "--node", "hpccd"): "--node hpccd: give the full name with its namespace, for example /hpccd",
    ("record", "--node", "/my arm/hpccd"): "--node /my arm/hpccd: not the name of a node; write it as /hpccd or ",
    ("record", "-o", "no/drop.mcap"): "-o no/drop.mcap: there is no folder no; create it\n",
    ("record", "-o", "no/drop"): "-o no/drop: there is no folder no; create it\n",
    ("record", "--topic", "/\udcff=std_msgs/msg/String"): "'/\\udcff=std_msgs/msg/String': not UTF-8, as ROS requires",
    ("record", "--duration", "-1"): "--duration -1.0: must not be negative",
    ("record", "--split-size", "1e-6"): "--split-size 1e-06: must be 0 or at least 0.01",
    ("record", "--wait", "0", "--node", "/nobody/hpccd"): "no node /nobody/hpccd found on ROS_DOMAIN_ID ",
    ("record", "--wait", "0", "--topic", "/joints"): "no node /hpccd found on ROS_DOMAIN_ID ",
    ("replay", "nothing.mcap"): "nothing.mcap does not exist",
    ("replay", "BAG", "--accuracy", "exakt"): "exakt",
    ("replay", "BAG", "--params", "PARAMS"): "stop_distanse: no such parameter; ",
    ("replay", "BAG", "--from", "5", "--to", "2"): "--to not before --from",
    ("view", "BAG", "--every", "0"): "--every 0: must be at least 1",
    ("view", "BAG", "--elevation", "100"): "--elevation 100.0: must lie between -89.9 and 89.9 degrees",
    ("view", "BAG", "--depth", "-o", "run.rrd"): "--depth: only pictures and pages have arrows; leave out --depth for",
    ("cut", "BAG", "-o", "part.mcap"): "nothing to cut: give --from TIME, --to TIME or both",
    ("cut", "BAG", "--to", "1", "-o", "part"): "-o part: must end in .mcap",
    ("cut", "BAG", "--from", "0", "-o", "no/part.mcap"): "-o no/part.mcap: there is no folder no; create it\n",
    ("doctor", "BAG", "--recover", "no/a.mcap"): "--recover no/a.mcap: there is no folder no; create it\n",
    ("replay", "BAG", "--csv", "no/a.csv"): "--csv no/a.csv: there is no folder no; create it\n",
    ("view", "BAG", "-o", "no/a.png"): "no/a.png: there is no folder no; create it\n",
    ("scene", "two-triangles", "--mcap", "no/a.mcap"): "no/a.mcap: there is no folder no; create it\n",
    ("cut", "BAG", "--from", "9 s", "-o", "part.mcap"): "--from: '9 s' is not a time; give seconds from the beginning",
    ("doctor", "nothing.mcap"): "nothing.mcap does not exist",
    ("scene", "cloth-dorp"): "; did you mean cloth-drop?",
    ("scene", "two-triangles", "--mcap", "run.bag"): "--mcap run.bag: name a file that ends in .mcap",
    ("scene", "two-triangles", "--loop"): "--loop belongs to --publish",
    ("scene", "two-triangles", "--npz", "x.npz", "--step", "99"): "--step 99: the scene has steps 1 to ",
    ("status", "--wait", "-1"): "--wait -1.0: must be a number of seconds, not negative",
    ("status", "/nobody/hpccd", "--wait", "0"): "no node /nobody/hpccd found on ROS_DOMAIN_ID ",
    ("echo", "/contact", "--wait", "0.1"): "/contact: no such topic on ROS_DOMAIN_ID ",
    ("echo", "meshes/my cloth/vertices"): "'meshes/my cloth/vertices': not a topic name; write it as /contacts or ",
    ("echo", "/\udcff"): "'/\\udcff': not UTF-8, as ROS requires; write it in UTF-8",
    ("echo", "/contacts", "-n", "0"): "-n 0: must be at least 1",
    ("lifecycle", "get", "--node", "/nobody/hpccd", "--wait", "0"): "no node /nobody/hpccd found on ROS_DOMAIN_ID ",
    ("param", "get"): "get: got no NAME; write hpccd param get NAME",
    ("param", "set", "accuracy"): "set: got accuracy; write hpccd param set NAME VALUE",
    ("param", "set", "accuracy", "\udcff"): "'\\udcff': not UTF-8, as ROS requires; write it in UTF-8",
    ("param", "list", "accuracy", "fast"): "list: got accuracy fast; write hpccd param list [NAME]",
    ("param", "get", "/hpccd", "accuracy"): "get: /hpccd is no parameter; name the node with --node /hpccd\n",
    ("param", "set", "/arm/hpccd", "accuracy"): "name the node with --node /arm/hpccd\n",
    ("param", "list", "/hpccd"): "list: /hpccd is no parameter; name the node with --node /hpccd\n",
    ("param", "list", "--node", "/nobody/hpccd", "--wait", "0"): "no node /nobody/hpccd found on ROS_DOMAIN_ID ",
}
# Arguments -> a part of the line below the usage; a word may be unknown to `hpccd`, or to the command.
OF_OPTIONS = {
    ("rekord",): "argument <command>: invalid choice: 'rekord'; use one of ",
    ("rekord", "-o", "a.mcap"): "; did you mean record?\n",
    ("topic", "echo", "/contacts"): "; did you mean echo?\n",
    ("--verison",): "; did you mean --version?\n",
    ("replay",): "the following arguments are required: FILE\n",
    ("replay", "a.mcap", "--rte", "2"): "unrecognized arguments: --rte 2; did you mean --rate?\n",
    ("replay", "a.mcap", "--acc", "exact"): "unrecognized arguments: --acc exact; did you mean --accuracy?\n",
    ("view", "a.mcap", "--stp=1"): "unrecognized arguments: --stp=1; did you mean --step?\n",
    ("view", "a.mcap", "--frame", "9"): "unrecognized arguments: --frame 9\n",
    ("view", "a.mcap", "a.png"): "unrecognized arguments: a.png; did you mean -o a.png?\n",
    ("cut", "a.mcap", "--otput", "b.mcap"): "are required: -o/--output; did you mean --output?\n",
    ("scene", "--size", "big"): "argument --size: invalid float value: 'big'",
    ("record", "drop.mcap"): "unrecognized arguments: drop.mcap; did you mean -o drop.mcap?\n",
    ("record", "/arm/hpccd"): "unrecognized arguments: /arm/hpccd; name the node with --node /arm/hpccd\n",
    ("record", ""): "unrecognized arguments: ",
    ("record", "--compression", "gzip"): "invalid choice: 'gzip'; use one of none, lz4, zstd\n",
    ("record", "--compression", "zst"): "; did you mean zstd?\n",
    ("view", "a.mcap", "--step", "1", "--every", "2"): "not allowed with argument",
    ("status", "--nod", "/hpccd"): "unrecognized arguments: --nod; did you mean --node?\n",
    ("status", "/hpccd", "--node", "/hpccd"): "not allowed with argument",
    ("lifecycle", "start"): "invalid choice: 'start'",
    ("lifecycle", "set", "activate"): "invalid choice: 'set'; use one of get, configure, ",
    ("lifecycle", "set", "/hpccd", "activate"): "; did you mean activate?; name the node with --node /hpccd\n",
    ("lifecycle", "/hpccd", "activate"): "; name the node with --node /hpccd\n",
    ("param", "put", "accuracy", "fast"): "invalid choice: 'put'",
    ("param", "set", "/hpccd", "minimum_separation", "0.1"): "arguments: 0.1; name the node with --node /hpccd\n",
    ("bench", "cpu", "--repet", "3"): "; did you mean --repeat?\n",
    ("bench", "cup"): "invalid choice: 'cup'; use one of cpu, gpu, accuracy",
}


@pytest.mark.parametrize("arguments", MISTAKES, ids=" ".join)
def test_mistake(arguments, hpccd, small_bag, tmp_path):
    params = tmp_path / "node.yaml"
    params.write_text("/**:\n  ros__parameters:\n    meshes: [cloth, ball]\n    stop_distanse: 0.1\n")
    places = {"BAG": str(small_bag), "PARAMS": str(params)}
    done = hpccd(*(places.get(word, word) for word in arguments))
    assert done.returncode == 2 and MISTAKES[arguments] in done.stderr, done
    assert done.stderr.startswith(f"hpccd {arguments[0]}: ") and done.stderr.count("\n") == 1
    assert done.stdout == "" or arguments[0] == "scene"


@pytest.mark.parametrize("arguments", OF_OPTIONS, ids=" ".join)
def test_mistake_of_options(arguments, capsys):
    with pytest.raises(SystemExit) as ended:
        cli.main(list(arguments))
    shown = capsys.readouterr().err
    assert ended.value.code == 2 and OF_OPTIONS[arguments] in shown
    of = itertools.takewhile(lambda word: word in cli.COMMANDS or word in bench.BENCHMARKS, arguments)
    assert shown.startswith(f"usage: {' '.join(['hpccd', *of])} [-h]")
