# SPDX-License-Identifier: Apache-2.0
"""hpccd_ros._env: the tuned DDS profile is chosen, takes effect, and gives way to what the user has set."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

CHOSEN = "FASTRTPS_DEFAULT_PROFILES_FILE"
USER_CHOICES = (CHOSEN, "FASTDDS_DEFAULT_PROFILES_FILE", "FASTDDS_BUILTIN_TRANSPORTS")

PRINT_CHOICE = f"""
import os
from hpccd_ros._env import prepare
prepare()
prepare()
print(os.environ.get("{CHOSEN}", "none"))
"""

# Fast DDS maps its shared-memory segment into the process; its size tells which profile is in force.
PRINT_LARGEST_SEGMENT = """
from hpccd_ros._env import prepare
prepare()
import rclpy
rclpy.init()
node = rclpy.create_node("segment_probe")
sizes = [0]
for line in open("/proc/self/maps"):
    if "/dev/shm/fastrtps_" in line:
        low, high = (int(x, 16) for x in line.split()[0].split("-"))
        sizes.append(high - low)
print(max(sizes))
rclpy.shutdown()
"""


def run(script: str, folder: Path, **variables: str) -> str:
    """Run `script` in a process of its own in `folder`; return what it prints."""
    env = {name: value for name, value in os.environ.items() if name not in USER_CHOICES} | variables
    command = [sys.executable, "-c", script]
    ended = subprocess.run(command, cwd=folder, env=env, text=True, capture_output=True, timeout=60)
    assert ended.returncode == 0, ended.stderr
    return ended.stdout.strip()


def test_the_installed_profile_is_chosen(tmp_path):
    chosen = Path(run(PRINT_CHOICE, tmp_path))
    assert chosen.name == "fastdds.xml" and chosen.is_file()


@pytest.mark.parametrize("name", USER_CHOICES)
def test_a_choice_of_the_user_in_the_environment_wins(tmp_path, name):
    value = "UDPv4" if name == "FASTDDS_BUILTIN_TRANSPORTS" else "/some/profile.xml"
    expected = value if name == CHOSEN else "none"
    assert run(PRINT_CHOICE, tmp_path, **{name: value}) == expected


def test_a_profile_in_the_working_folder_wins(tmp_path):
    (tmp_path / "DEFAULT_FASTRTPS_PROFILES.xml").write_text("<profiles/>")
    assert run(PRINT_CHOICE, tmp_path) == "none"


def test_the_profile_takes_effect(tmp_path):
    """A frame of megabytes needs a segment larger than the default of 512 KiB (config/fastdds.xml)."""
    shared_memory = os.statvfs("/dev/shm")
    if shared_memory.f_bavail * shared_memory.f_frsize < 64 << 20:
        pytest.skip("/dev/shm has less than 64 MiB free: Fast DDS falls back to UDP there")
    with_udp_only = int(run(PRINT_LARGEST_SEGMENT, tmp_path, FASTDDS_BUILTIN_TRANSPORTS="UDPv4"))
    assert with_udp_only < 1 << 20
    assert int(run(PRINT_LARGEST_SEGMENT, tmp_path)) >= 16 << 20
