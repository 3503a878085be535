# SPDX-License-Identifier: Apache-2.0
"""HPCCD_ONLY_INTERFACES: the definitions alone, built where nothing that the core needs is to be found."""

import json
import os
import re
import sys
from pathlib import Path

import pytest
from build_tools import ENVIRONMENT, run
from sources import ROOT

WHEELS = Path(sys.prefix)
# Packages that only the core needs: CMake stops where one of these is looked for, and remembers that it did.
PACKAGES_OF_THE_CORE = ("pybind11", "GTest", "Threads")
REMEMBERED = ("BOOST_INCLUDE", "HPCCD_CUDA", "HPCCD_BUILD_TESTS")

# Without hpccd_ros: all that such a machine has is rclpy and the messages.
ASKING = """
import sys
import rclpy
from hpccd.msg import MeshTopology, MeshVertices
from hpccd.srv import Detect

rclpy.init()
node = rclpy.create_node("elsewhere", namespace=sys.argv[1])
service = node.create_client(Detect, "hpccd/detect")
assert service.wait_for_service(60.0)
request = Detect.Request(mesh_names=["hand", "table"], query="distances")
for z in (0.5, 0.0):
    request.topologies.append(MeshTopology(n_vertices=3, faces=[0, 1, 2]))
    request.end.append(MeshVertices(vertices_f64=[0.0, 0, z, 1, 0, z, 0, 1, z]))
future = service.call_async(request)
rclpy.spin_until_future_complete(node, future, timeout_sec=60.0)
print(future.result().message, list(future.result().distances.distance))
"""


@pytest.fixture(scope="module")
def configured(tmp_path_factory):
    """Folders of the build and of what it installs, and its environment."""
    build, prefix = tmp_path_factory.mktemp("build"), tmp_path_factory.mktemp("prefix")
    ros = os.environ.get("AMENT_PREFIX_PATH") or str(WHEELS)
    paths = {"AMENT_PREFIX_PATH": ros, "CMAKE_PREFIX_PATH": os.environ.get("CMAKE_PREFIX_PATH") or ros}
    environment = {**ENVIRONMENT, **paths}
    options = [
        "-DHPCCD_ONLY_INTERFACES=ON",
        f"-DCMAKE_INSTALL_PREFIX={prefix}",
        "-DCMAKE_EXPORT_COMPILE_COMMANDS=ON",
        f"-DPython3_EXECUTABLE={sys.executable}",
        f"-DPython_EXECUTABLE={sys.executable}",
        *(f"-DCMAKE_DISABLE_FIND_PACKAGE_{name}=ON" for name in PACKAGES_OF_THE_CORE),
    ]
    if (WHEELS / "share" / "ament_cmake_core").is_dir():
        options.append(f"-DCMAKE_PROJECT_INCLUDE={ROOT / 'cmake' / 'pypi_ros.cmake'}")
    run("cmake", "-S", ROOT, "-B", build, *options, environment=environment)
    return build, prefix, environment


@pytest.fixture(scope="module")
def prefix(configured):
    build, prefix, environment = configured
    run("cmake", "--build", build, "--parallel", len(os.sched_getaffinity(0)), environment=environment)
    run("cmake", "--install", build, environment=environment)
    return prefix


def test_nothing_of_the_core_is_looked_for_or_built(configured):
    folder, _, _ = configured
    commands = [entry["command"] for entry in json.loads((folder / "compile_commands.json").read_text())]
    assert len(commands) > 50 and not any("hpccd_core" in command.partition(" -c ")[2] for command in commands)
    assert not any(re.search(r"-std=\S*\+\+(2[0-9a-z])", command) for command in commands), "C++17 is enough"
    cache = (folder / "CMakeCache.txt").read_text()
    assert "HPCCD_ONLY_INTERFACES" in cache and not any(f"\n{name}:" in cache for name in REMEMBERED)


@pytest.mark.long
def test_the_definitions_alone_are_installed(prefix):
    files = {str(file.relative_to(prefix)) for file in prefix.rglob("*") if file.is_file()}
    assert not any("hpccd_core" in file or "hpccd_ros" in file for file in files)
    definitions = {f"{kind}/{file.name}" for kind in ("msg", "srv", "action") for file in (ROOT / kind).iterdir()}
    for name in (*definitions, "cmake/hpccdConfig.cmake", "package.xml"):
        assert f"share/hpccd/{name}" in files


@pytest.mark.long
def test_the_messages_serve_to_ask_a_node(prefix, start_node):
    node = start_node({"meshes": ["cloth"]})
    (packages,) = prefix.glob("lib/python3*/site-packages")
    libraries = os.pathsep.join(filter(None, (str(prefix / "lib"), os.environ.get("LD_LIBRARY_PATH"))))
    environment = {**os.environ, "PYTHONPATH": str(packages), "LD_LIBRARY_PATH": libraries}
    program = ASKING + (
        "import hpccd\nprint(hpccd.__file__)\n"
        "print({l.split()[-1] for l in open('/proc/self/maps') if 'libhpccd' in l})\n"
        "print([name for name in sys.modules if name.startswith(('hpccd_ros', 'hpccd_core'))])\n"
    )
    result, module, loaded, ours = run(
        sys.executable, "-c", program, node.namespace, environment=environment
    ).splitlines()
    assert result == "3 pairs of meshes [inf, 0.5, inf]"
    assert module.startswith(str(prefix))
    assert len(loaded) > 5 and loaded.count("libhpccd") == loaded.count(f"{prefix}/lib/libhpccd")
    assert ours == "[]"
