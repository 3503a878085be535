# SPDX-License-Identifier: Apache-2.0
"""The public Python API is typed: mypy --strict finds nothing in it, and a program that uses it gets its types."""

import subprocess
import sys
from pathlib import Path

import pytest
from sources import ROOT

import hpccd_core._core

pytest.importorskip("mypy", reason="mypy comes with the extra lint")

# Where the package is installed, by pip or by CMake: the compiled module lies nowhere else.
INSTALLED = Path(hpccd_core._core.__file__).resolve().parents[1]

PROGRAM = """
import numpy as np
import hpccd_core as hc
from hpccd_ros import client
from numpy.typing import NDArray

scene = hc.Scene()
scene.add_mesh("cloth", np.array([[0, 1, 2]]))
contacts = hc.Detector(scene, accuracy="exact").detect(np.zeros((3, 3)), np.ones((3, 3)))
vf: NDArray[np.uint32] = contacts.vf
topic: str = client.topology_topic("cloth")
wrong: NDArray[np.float64] = contacts.vf  # line 12
topic.encode(client.vertices_topic(3))
hc.Detector(scene, accuracy="exakt")
on_device = hc.Detector(scene, results="device").detect(np.zeros((3, 3)), np.ones((3, 3)))
copied: hc.Contacts = on_device.to_host()
place: hc.DeviceArray = on_device.vf
also_wrong: hc.Contacts = on_device  # line 18
one, many = hc.Detector(scene), hc.Detector(scene, worlds=3, accuracy="fast")
gap: float = one.distances(np.zeros((3, 3)))[0].distance
step: float = one.collision_free_step(np.zeros((3, 3)), np.ones((3, 3)))
gaps: list[list[hc.Gap]] = many.distances(np.zeros((3, 3, 3)))
steps: NDArray[np.float64] = many.collision_free_step(np.zeros((3, 3, 3)), np.ones((3, 3, 3)))
neither: list[hc.Gap] = many.distances(np.zeros((3, 3, 3)))  # line 24
device_step: float = hc.Detector(scene, results="device").collision_free_step(np.zeros((3, 3)), np.ones((3, 3)))
device_gaps: hc.DeviceDistances = hc.Detector(scene, results="device").distances(np.zeros((3, 3)))


def as_asked(worlds: int | None) -> None:
    hc.Detector(scene, worlds=worlds).detect(np.zeros((3, 3)), np.ones((3, 3)))
"""


def mypy(*arguments, folder):
    command = [sys.executable, "-m", "mypy", *arguments]
    return subprocess.run(command, cwd=folder, text=True, capture_output=True, timeout=300)


def test_the_public_api_passes_strictly():
    done = mypy(folder=ROOT)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize("file", ["hpccd_core/py.typed", "hpccd_core/_core.pyi", "hpccd_ros/client/py.typed"])
def test_what_tells_of_types_is_installed(file):
    assert (INSTALLED / file).is_file()


def test_a_program_of_a_user_gets_types(tmp_path):
    (tmp_path / "program.py").write_text(PROGRAM)
    said = mypy("--strict", "--ignore-missing-imports", "program.py", folder=tmp_path).stdout
    found = [line.split(": error: ")[0] for line in said.splitlines() if ": error: " in line]
    assert found == ["program.py:12", "program.py:13", "program.py:14", "program.py:18", "program.py:24"], said
