# SPDX-License-Identifier: Apache-2.0
"""hpccd_ros.middleware.environment: the tuned DDS profile takes effect, and gives way to what the user has set."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

CHOSEN = "FASTRTPS_DEFAULT_PROFILES_FILE"
USER_CHOICES = (CHOSEN, "FASTDDS_DEFAULT_PROFILES_FILE", "FASTDDS_BUILTIN_TRANSPORTS")
LOCAL = "fastdds_localhost.xml"
RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
QUEUES, SENDING = "RMW_FASTRTPS_USE_QOS_FROM_XML", "RMW_FASTRTPS_PUBLICATION_MODE"
DISCOVERY_CHOICES = (RANGE, "ROS_STATIC_PEERS", "ROS_LOCALHOST_ONLY")

PRINT_CHOICE = f"""
import os
from hpccd_ros.middleware.environment import prepare
prepare()
prepare()
print(os.environ.get("{CHOSEN}", "none"), os.environ.get("{RANGE}", "none"))
"""

# Fast DDS maps its shared-memory segment into the process; its size tells which profile is in force.
PRINT_LARGEST_SEGMENT = """
from hpccd_ros.middleware.environment import prepare
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
    theirs = (*USER_CHOICES, *DISCOVERY_CHOICES, QUEUES, SENDING)
    env = {name: value for name, value in os.environ.items() if name not in theirs} | variables
    command = [sys.executable, "-c", script]
    ended = subprocess.run(command, cwd=folder, env=env, text=True, capture_output=True, timeout=300)
    assert ended.returncode == 0, ended.stderr
    return ended.stdout.strip()


def choice(folder: Path, **variables: str) -> tuple[Path, str]:
    """(profile, discovery range) that `prepare` leaves in the environment."""
    profile, discovery = run(PRINT_CHOICE, folder, **variables).split()
    return Path(profile), discovery


def test_discovery_is_limited_to_this_host(tmp_path):
    profile, discovery = choice(tmp_path)
    assert profile.name == LOCAL and profile.is_file() and discovery == "LOCALHOST"


@pytest.mark.parametrize(
    "variables, profile, discovery",
    [
        ({RANGE: "SUBNET"}, "fastdds.xml", "SUBNET"),
        ({RANGE: "LOCALHOST"}, LOCAL, "LOCALHOST"),
        ({RANGE: "localhost"}, LOCAL, "localhost"),
        ({RANGE: "OFF"}, LOCAL, "OFF"),
        ({RANGE: "SYSTEM_DEFAULT"}, "fastdds.xml", "SYSTEM_DEFAULT"),
        ({"ROS_STATIC_PEERS": "192.0.2.7"}, "fastdds.xml", "none"),
        ({"ROS_LOCALHOST_ONLY": "1"}, LOCAL, "none"),
        ({"ROS_LOCALHOST_ONLY": "0"}, "fastdds.xml", "none"),
    ],
    ids=lambda value: "" if isinstance(value, dict) else value,
)
def test_whom_to_meet_is_the_choice_of_the_user(tmp_path, variables, profile, discovery):
    chosen, left = choice(tmp_path, **variables)
    assert (chosen.name, left) == (profile, discovery) and chosen.is_file()


def test_a_child_may_open_what_its_parent_had_closed(tmp_path):
    closed, _ = choice(tmp_path)
    assert choice(tmp_path, **{CHOSEN: str(closed), RANGE: "SUBNET"})[0].name == "fastdds.xml"


def test_the_two_profiles_differ_in_the_interface_only():
    folder = Path(__file__).resolve().parents[2] / "config"
    lines = [(folder / name).read_text().split("<dds ")[1].splitlines() for name in ("fastdds.xml", LOCAL)]
    both, local = lines
    rest = [line for line in local if line not in both]
    assert [line for line in both if line not in local] == []
    assert len(local) - len(both) == len(rest) == 2 and "<address>127.0.0.1</address>" in rest[1]


@pytest.mark.parametrize("profile", ["profile.xml", "fastdds.xml"])
@pytest.mark.parametrize("name", USER_CHOICES)
def test_a_choice_of_the_user_in_the_environment_wins(tmp_path, name, profile):
    value = "UDPv4" if name == "FASTDDS_BUILTIN_TRANSPORTS" else f"/some/{profile}"
    expected = value if name == CHOSEN else "none"
    assert run(PRINT_CHOICE, tmp_path, **{name: value}) == f"{expected} none"


@pytest.mark.parametrize(
    "variables, left",
    [({}, "1"), ({QUEUES: "0"}, "0"), ({SENDING: "ASYNCHRONOUS"}, "none"), ({CHOSEN: "/some/profile.xml"}, "none")],
    ids=["ours", "the middleware's", "ours would undo how to send", "a profile of the user"],
)
def test_how_queues_keep_their_memory_is_the_choice_of_the_user(tmp_path, variables, left):
    script = PRINT_CHOICE.replace(CHOSEN, QUEUES)
    assert run(script, tmp_path, **variables).split()[0] == left


def test_a_profile_in_the_working_folder_wins(tmp_path):
    (tmp_path / "DEFAULT_FASTRTPS_PROFILES.xml").write_text("<profiles/>")
    assert run(PRINT_CHOICE, tmp_path) == "none none"


def test_the_profile_takes_effect(tmp_path):
    """A frame of megabytes needs a segment larger than the default of 512 KiB (config/fastdds.xml)."""
    shared_memory = os.statvfs("/dev/shm")
    if shared_memory.f_bavail * shared_memory.f_frsize < 64 << 20:
        pytest.skip("/dev/shm has less than 64 MiB free: Fast DDS falls back to UDP there")
    with_udp_only = int(run(PRINT_LARGEST_SEGMENT, tmp_path, FASTDDS_BUILTIN_TRANSPORTS="UDPv4"))
    assert with_udp_only < 1 << 20
    assert int(run(PRINT_LARGEST_SEGMENT, tmp_path)) >= 16 << 20
