# SPDX-License-Identifier: Apache-2.0
"""Configures this process for DDS messages of several megabytes; call `prepare()` before `rclpy.init()`.

Settings of the user have priority, and steps that do not apply do nothing.
"""

import ctypes
import os
import sys
from pathlib import Path
from xml.etree import ElementTree

from hpccd_ros.base import quoting
from hpccd_ros.base.errors import UserError

# glibc's mallopt parameters (malloc.h), the environment variable of each, and our value.
# Keeping freed megabytes instead of returning them to the kernel saves the page faults of the next message:
# measured 17 -> 6 ms one way for 5 MB between two rclpy processes. With an arena for each thread it would add up:
# 290 publishers one after the other took 3 MB.
_MALLOC = (
    ("MALLOC_ARENA_MAX", -8, 2),
    ("MALLOC_MMAP_THRESHOLD_", -3, 1 << 30),
    ("MALLOC_TRIM_THRESHOLD_", -1, 1 << 30),
    ("MALLOC_TOP_PAD_", -2, 64 << 20),
)

# With any of these the user has chosen a transport or a profile, which ours would override.
_DDS_CHOICES = ("FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE", "FASTDDS_BUILTIN_TRANSPORTS")
# Makes ROS leave the memory policy of queues to the profile, and with it how messages are sent: the user's setting of
# either has priority.
_QUEUES_OF_PROFILE = "RMW_FASTRTPS_USE_QOS_FROM_XML"
_SENDING = "RMW_FASTRTPS_PUBLICATION_MODE"
_DDS_FILES = ("DEFAULT_FASTRTPS_PROFILES.xml", "DEFAULT_FASTDDS_PROFILES.xml")

# In the package's folder config. A user's profile may have the same name: only the folder distinguishes them.
_PROFILES = ("fastdds_localhost.xml", "fastdds.xml")
_FOLDER = ("share", "hpccd", "config")  # of any installation

_NAMESPACE = "http://www.eprosima.com"
_OFTEN = (
    f'<times xmlns="{_NAMESPACE}"><heartbeatPeriod><sec>0</sec><nanosec>100000000</nanosec></heartbeatPeriod></times>'
)

# The variable that opens discovery to the network (SUBNET), and others that select peers.
DISCOVERY = "ROS_AUTOMATIC_DISCOVERY_RANGE"
_BEYOND_THIS_HOST = ("SUBNET", "SYSTEM_DEFAULT", "", None)
_DISCOVERY_CHOICES = (DISCOVERY, "ROS_STATIC_PEERS", "ROS_LOCALHOST_ONLY")

# The RMW implementation that the user requests.
RMW = "RMW_IMPLEMENTATION"


def prepare() -> None:
    """Make package shares findable, choose discovery range and DDS profile, keep freed memory. Safe to call again."""
    find_shares_of_wheels()
    _choose_dds_profile()
    _keep_freed_memory()


def shorten_heartbeats(folder: Path) -> None:
    """Send heartbeats of reliable publishers ten times a second, not every 3 s, for programs that wait for
    acknowledgements (listeners.py). Call it after `prepare` and before `rclpy.init()`.

    folder: holds the DDS profile; needed until the first node exists.
    """
    profile = Path(os.environ.get(_DDS_CHOICES[0], ""))
    if not _ours(profile):
        return  # the user's own
    ElementTree.register_namespace("", _NAMESPACE)
    tree = ElementTree.parse(profile)
    for writer in tree.iter(f"{{{_NAMESPACE}}}data_writer"):
        writer.insert(0, ElementTree.fromstring(_OFTEN))
    own = folder.joinpath(*_FOLDER, profile.name)  # so that `prepare` replaces it, like all of ours
    own.parent.mkdir(parents=True)
    tree.write(own, encoding="utf-8", xml_declaration=True)
    os.environ[_DDS_CHOICES[0]] = str(own)


def give_back_freed_memory() -> None:
    """Return free memory, which is kept since `prepare`, to the kernel.

    glibc keeps the end of each arena but the first: as much as the largest message that a thread of DDS received.
    """
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)  # glibc only
    if trim is not None and "MALLOC_TRIM_THRESHOLD_" not in os.environ:
        trim(ctypes.c_size_t(0))


def this_host_only() -> bool:
    """Whether the environment limits discovery to this machine, after ``prepare``."""
    localhost_only = os.environ.get("ROS_LOCALHOST_ONLY")  # older, with priority if both are set
    # ROS takes an unknown value as localhost.
    return localhost_only == "1" if localhost_only else os.environ.get(DISCOVERY) not in _BEYOND_THIS_HOST


def find_shares_of_wheels() -> None:
    """Let the ament index find the packages of the ROS wheels."""
    # The ROS wheels never set AMENT_PREFIX_PATH; a sourced ROS installation or colcon workspace does.
    if not os.environ.get("AMENT_PREFIX_PATH") and (Path(sys.prefix) / "share" / "ament_index").is_dir():
        os.environ["AMENT_PREFIX_PATH"] = sys.prefix


def check_rmw() -> None:
    """Raises UserError if the requested RMW implementation is not installed. Call it before importing rclpy, which
    would end the process with status 102."""
    asked = os.environ.get(RMW)
    if not asked:
        return
    from ament_index_python.packages import PackageNotFoundError, get_package_prefix

    find_shares_of_wheels()
    if not os.environ.get("AMENT_PREFIX_PATH"):
        return  # it is unknown what is installed
    try:
        get_package_prefix(asked)
    except (PackageNotFoundError, ValueError) as error:  # ValueError: no package name
        raise UserError(
            f"{RMW}: {quoting.quoted(asked)} is not installed here; unset it, or set it to rmw_fastrtps_cpp"
        ) from error


def _choose_dds_profile() -> None:
    from ament_index_python.packages import PackageNotFoundError, get_package_share_directory

    # One of ours was inherited from a parent process, whose discovery range may differ.
    chosen = [os.environ[name] for name in _DDS_CHOICES if os.environ.get(name)]
    if not all(_ours(Path(value)) for value in chosen) or any(Path(name).is_file() for name in _DDS_FILES):
        return
    # No peers on the network by default: without DDS security any peer may send anything.
    if not any(os.environ.get(name) for name in _DISCOVERY_CHOICES):
        os.environ[DISCOVERY] = "LOCALHOST"
    try:
        share = get_package_share_directory("hpccd")
    except PackageNotFoundError:
        return  # not installed: Fast DDS works with its defaults, but slower
    profile = _PROFILES[0 if this_host_only() else 1]
    os.environ["FASTRTPS_DEFAULT_PROFILES_FILE"] = str(Path(share) / "config" / profile)
    if not os.environ.get(_SENDING):
        os.environ.setdefault(_QUEUES_OF_PROFILE, "1")


def _ours(profile: Path) -> bool:
    return profile.name in _PROFILES and profile.parts[-4:-1] == _FOLDER


def _keep_freed_memory() -> None:
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)  # glibc only: musl has none
    if mallopt is None:
        return
    for variable, parameter, value in _MALLOC:
        if variable not in os.environ:
            mallopt(parameter, value)
