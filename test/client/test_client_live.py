# SPDX-License-Identifier: Apache-2.0
"""The programs that the documentation shows, as processes beside a real node."""

import doctest
import itertools
import os
import re
import subprocess
import sys
from pathlib import Path

import hand_and_table
import numpy as np
import pytest
from node_process import PATIENCE
from sources import ROOT, SOURCES

import hpccd_core as hc
from hpccd_ros import client

FOLDER = Path(__file__).resolve().parent
PUBLISHER = FOLDER / "ten_line_publisher.py"
SUBSCRIBER = FOLDER / "ten_line_subscriber.py"
MARKER = FOLDER / "ten_line_marker.py"
REQUEST = FOLDER / "ten_line_request.py"
GOAL = FOLDER / "ten_line_goal.py"
LINE_SEARCH = FOLDER / "ten_line_line_search.py"
STOP = FOLDER / "ten_line_stop.py"
SPEED_SCALE = FOLDER / "ten_line_speed_scale.py"
PAGES = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]
FACES = np.array([[0, 1, 2], [3, 4, 5]])


def positions(step: int) -> np.ndarray:
    """What the publisher sends in its step."""
    x = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.2, 0.2, 0.5], [1.2, 0.2, 0.5], [0.2, 1.2, 0.5]], np.float32)
    x[3:, 2] = 0.5 * np.cos(0.3 * step)
    return x


@pytest.fixture
def start(tmp_path):
    """Start a program in a namespace; its output goes to a file."""
    processes = []

    def start(program, namespace):
        output = tmp_path / f"{program.stem}.txt"
        command = [sys.executable, "-u", program, "--ros-args", "-r", f"__ns:={namespace}"]
        with open(output, "w") as stream:
            environment = {**os.environ, "PYTHONPATH": SOURCES}
            processes.append(subprocess.Popen(command, stdout=stream, stderr=subprocess.STDOUT, env=environment))
        return processes[-1], output

    yield start
    for process in processes:
        process.kill()
        process.wait()


def test_the_programs_of_the_documentation(start, start_node):
    node = start_node({"meshes": ["cloth"], "outputs": ["points", "normals"]})
    _, heard = start(SUBSCRIBER, node.namespace)
    node.wait_until(lambda: node.peer.node.count_subscribers("contacts") > 1, "subscriber")
    publisher, said = start(PUBLISHER, node.namespace)

    def neighbours():
        """Two steps that follow each other, the second with contacts, which the subscriber heard as well."""
        pairs = zip(node.peer.received, node.peer.received[1:], strict=False)
        lines = heard.read_text()
        return [
            (a, b)
            for a, b in pairs
            if b.total
            and b.start == a.header.stamp
            and b.step == a.step + 1
            and f"step {b.step}: {b.total} contacts, the first at {b.first_toc}" in lines
        ]

    before, message = node.wait_until(neighbours, "contacts of two steps in a row")[0]
    scene = hc.Scene()
    scene.add_mesh("cloth", FACES)
    detector = hc.Detector(scene, outputs=("points", "normals"))
    expected = detector.detect(positions(before.step), positions(message.step))
    topology = client.topology_from_message(client.topology_message(FACES, 6))
    found = client.scene_contacts(message, client.Layout.of(("cloth",), (topology,)))
    for name in ("vf", "vf_toc", "ee", "ee_toc", "points", "normals"):
        assert np.array_equal(getattr(found, name), getattr(expected, name)), name

    of_meshes = client.contacts_from_message(message)
    assert len(of_meshes) == message.total == len(expected) and of_meshes.n_vertex_face == len(expected.vf)
    assert of_meshes.mesh_names == ("cloth",) and not of_meshes.mesh_a.any() and not of_meshes.mesh_b.any()
    n = of_meshes.n_vertex_face
    assert np.array_equal(np.stack([of_meshes.features_a[:n, 0], of_meshes.features_b[:n, 0]], 1), expected.vf)
    assert np.array_equal(np.hstack([of_meshes.features_a[n:], of_meshes.features_b[n:]]), expected.ee)
    assert np.array_equal(of_meshes.toc, np.concatenate([expected.vf_toc, expected.ee_toc]))
    assert np.array_equal(of_meshes.points, expected.points) and np.array_equal(of_meshes.normals, expected.normals)

    assert publisher.wait(PATIENCE) == 0, said.read_text()


def test_the_page_shows_what_a_subscriber_prints():
    """Of steps between frames that are both received: which, depends on discovery and load."""
    scene = hc.Scene()
    scene.add_mesh("cloth", FACES)
    detector = hc.Detector(scene)
    shown = [line for line in shown_after(PUBLISHER).splitlines() if line != "..."]
    assert shown
    for line in shown:
        step = int(re.match(r"step (\d+): ", line)[1])
        found = detector.detect(positions(step - 1), positions(step))
        times = np.concatenate([found.vf_toc, found.ee_toc])
        assert line == f"step {step}: {len(found)} contacts, the first at {found.first_toc} {times[:3]}"


def test_the_marker_of_the_documentation(start, start_node):
    node = start_node({"meshes": ["cloth"], "mesh": {"cloth": {"input": "marker"}}})
    publisher, said = start(MARKER, node.namespace)
    assert publisher.wait(PATIENCE) == 0, said.read_text()
    assert_shown(MARKER, said.read_text())
    touching = node.wait_until(lambda: [m for m in node.peer.received if m.total], "contacts")
    assert list(touching[0].mesh_names) == ["cloth"] and touching[0].header.frame_id == "world"


def test_the_request_of_the_documentation(start, start_node):
    node = start_node({"meshes": ["cloth"]})
    request, said = start(REQUEST, node.namespace)
    assert request.wait(PATIENCE) == 0, said.read_text()
    assert_shown(REQUEST, said.read_text())


def test_the_goal_of_the_documentation(start, start_node):
    node = start_node({"meshes": ["cloth"]})
    goal, said = start(GOAL, node.namespace)
    assert goal.wait(PATIENCE) == 0, said.read_text()
    assert_shown(GOAL, said.read_text())
    *feedback, last = said.read_text().splitlines()
    found = re.fullmatch(r"True (\d+) contacts", last)
    assert found and int(found[1]) > 0, last
    assert feedback and all(re.fullmatch(r"\w+, 0 ahead, \d+\.\d of 600 s", line) for line in feedback), feedback


def test_the_line_search_of_the_documentation(start, start_node):
    """With the profile for it, as the page says."""
    node = start_node({"meshes": ["cloth"]}, profiles=(ROOT / "config" / "profiles" / "step_size_control.yaml",))
    search, said = start(LINE_SEARCH, node.namespace)
    assert search.wait(PATIENCE) == 0, said.read_text()
    assert_shown(LINE_SEARCH, said.read_text())


def test_the_stop_listener_of_the_documentation(start, start_node):
    node = start_node({"meshes": list(hand_and_table.MESHES), "stop_distance": 0.1, "stop_timeout": 0.5})
    _, said = start(STOP, node.namespace)
    for name in hand_and_table.MESHES:
        node.peer.topology(name, hand_and_table.FACES, 3)
    stamps = itertools.count()

    def heard_no():
        for name, xyz in zip(hand_and_table.MESHES, (hand_and_table.hand(1.0), hand_and_table.TABLE), strict=True):
            node.peer.vertices(name, xyz, stamp=next(stamps) // 2)
        return said.read_text().endswith("stop: no\n")

    node.wait_until(heard_no, "false")
    node.wait_until(lambda: said.read_text().endswith(f"stop: {node.namespace}/stop is true\n"), "silence")


def test_the_speed_scale_listener_of_the_documentation(start, start_node):
    node = start_node({"meshes": list(hand_and_table.MESHES), "stop_distance": 0.1, "approach_time": 1.0})
    program, said = start(SPEED_SCALE, node.namespace)
    node.wait_until(lambda: said.read_text().startswith("speed scale: 0.0 "), "0 before the first result")
    assert program.poll() is None


def test_the_documentation_shows_programs_that_are_run_here():
    """Each whole program in README and docs that uses the client is one of those above, to the letter, or has a file
    name: those run in test/packaging."""
    blocks = [block for page in PAGES for block in re.findall(r"```python\n(.*?)```", page.read_text(), re.DOTALL)]
    programs = (PUBLISHER, SUBSCRIBER, MARKER, REQUEST, GOAL, LINE_SEARCH, STOP, SPEED_SCALE)
    run = [statements(program.read_text()) for program in programs]
    for block in blocks:
        if "client.prepare_environment()" in block and not re.match(r"# \w+\.py\n", block):
            assert statements(block) in run, f"the tests run no such program:\n{block}"


def statements(program: str) -> list[str]:
    """Its lines but for imports, which a page may write shorter, comments of their own line and empty lines."""
    return [line for line in program.splitlines() if line and not line.startswith(("#", "import ", "from "))]


def assert_shown(program: Path, output: str) -> None:
    """The page shows this output; ... stands for any text."""
    assert doctest.OutputChecker().check_output(shown_after(program), output, doctest.ELLIPSIS), output


def shown_after(program: Path) -> str:
    """The first block of text that a page shows after the program."""
    for page in PAGES:
        blocks = re.findall(r"^```(\w+)\n(.*?)^```$", page.read_text(), re.DOTALL | re.MULTILINE)
        for number, (_, block) in enumerate(blocks):
            if statements(block) == statements(program.read_text()):
                for language, text in itertools.takewhile(lambda block: block[0] != "python", blocks[number + 1 :]):
                    if language == "text":
                        return text
    raise AssertionError(f"no page shows what {program.name} prints")
