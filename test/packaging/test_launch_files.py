# SPDX-License-Identifier: Apache-2.0
"""Launch files name what is there: programs, parameters, files, arguments; launch reads them where it is installed."""

import re
import xml.etree.ElementTree as ElementTree

import pytest
from sources import ROOT

from hpccd_ros.params.table import NODE_ROWS

FILES = sorted((ROOT / "launch").glob("*.launch.xml"))
# Attributes of launch that are used here (launch_ros/actions/node.py, launch/actions of Jazzy); it rejects others.
ATTRIBUTES = {
    "launch": set(),
    "arg": {"name", "default", "description"},
    "node": {"pkg", "exec", "name", "namespace", "output", "args"},
    "param": {"name", "value", "from"},
}
# Attributes of other elements, as their sources declare them.
FOREIGN = {
    ("rviz2", "rviz2"): set(),
    ("nav2_lifecycle_manager", "lifecycle_manager"): {"node_names", "autostart", "bond_timeout"},
}


@pytest.fixture(params=FILES, ids=lambda file: file.name)
def root(request):
    return ElementTree.parse(request.param).getroot()


def test_the_three_are_there():
    assert [file.name.removesuffix(".launch.xml") for file in FILES] == ["hpccd", "hpccd_lifecycle", "hpccd_with_rviz"]
    cmake = (ROOT / "CMakeLists.txt").read_text()
    assert re.search(r"install\(DIRECTORY config launch DESTINATION share/\$\{PROJECT_NAME\}\)", cmake)


def test_elements_and_attributes_are_those_of_launch(root):
    for element in root.iter():
        assert element.tag in ATTRIBUTES, element.tag
        assert set(element.attrib) <= ATTRIBUTES[element.tag], (element.tag, element.attrib)
        if element.tag == "param":
            assert ("from" in element.attrib) != ({"name", "value"} <= set(element.attrib)), element.attrib


def test_programs_and_parameters_exist(root):
    installed = re.search(r"install\(PROGRAMS (.*?) DESTINATION lib/", (ROOT / "CMakeLists.txt").read_text())[1].split()
    own = {row.name for row in NODE_ROWS}
    ours = 0
    for node in root.iter("node"):
        given = {param.attrib["name"] for param in node.iter("param") if "name" in param.attrib}
        if node.attrib["pkg"] == "hpccd":
            ours += 1
            assert f"scripts/{node.attrib['exec']}" in installed and given <= own, given - own
        else:
            assert given <= FOREIGN[node.attrib["pkg"], node.attrib["exec"]]
    assert ours == 1


def test_substitutions_lead_somewhere(root):
    declared = set()
    for element in root.iter():
        for value in element.attrib.values():
            for kind, what in re.findall(r"\$\(([\w-]+) ([^)]+)\)", value):
                assert kind in ("var", "find-pkg-share")
                assert what in declared if kind == "var" else what == "hpccd", (kind, what)
            for file in re.findall(r"\$\(find-pkg-share hpccd\)/(\S+)", value):
                assert (ROOT / file).is_file(), file
        if element.tag == "arg":
            declared.add(element.attrib["name"])


def test_the_manager_manages_the_node_that_waits_for_it():
    root = ElementTree.parse(ROOT / "launch" / "hpccd_lifecycle.launch.xml").getroot()
    node, manager = root.iter("node")
    of_node, of_manager = (
        {param.attrib["name"]: param.attrib["value"] for param in part.iter("param") if "name" in param.attrib}
        for part in (node, manager)
    )
    assert of_node["autostart"] == "false" and of_manager["autostart"] == "true"
    assert of_manager["node_names"] == f"[{node.attrib['name']}]"


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name)
def test_launch_reads_them(file):
    pytest.importorskip("launch_ros", reason="launch_ros is not installed: there is no wheel of it")
    frontend = pytest.importorskip("launch.frontend")
    entity, parser = frontend.Parser.load(str(file))
    assert parser.parse_description(entity).entities
