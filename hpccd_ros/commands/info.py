# SPDX-License-Identifier: Apache-2.0
"""Show what is installed: versions, usable backends and accuracy tiers, processor, DDS settings.

hpccd info           as text, for bug reports
hpccd info --json    as JSON, for programs
"""

import json
import os
import platform
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np

import hpccd_ros
from hpccd_ros.base.version import package_version
from hpccd_ros.params.table import ACCURACIES

PACKAGES = (
    "numpy",
    "ros-jazzy-rclpy",
    "mcap",
    "rich",
    "matplotlib",
    "trimesh",
    "mapbox_earcut",
    "pycollada",
    "rosbags",
)
SETTINGS = (
    "ROS_DOMAIN_ID",
    "ROS_AUTOMATIC_DISCOVERY_RANGE",
    "ROS_STATIC_PEERS",
    "RMW_IMPLEMENTATION",
    "FASTRTPS_DEFAULT_PROFILES_FILE",
    "FASTDDS_BUILTIN_TRANSPORTS",
    "AMENT_PREFIX_PATH",
)


def configure(parser):
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def gather() -> dict:
    """Everything that `hpccd info` shows, as plain JSON-able values."""
    import hpccd_core as hc

    probe = hc.Scene()
    probe.add_mesh("probe", np.array([[0, 1, 2]], np.uint32))
    detector = hc.Detector(probe)
    return {
        "hpccd": package_version(),
        "code": str(Path(hpccd_ros.__file__).parent),
        "python": f"{platform.python_version()} ({sys.executable})",
        "system": f"{platform.platform()}",
        "processor": _processor(),
        "cores": len(os.sched_getaffinity(0)),
        "simd": detector.simd,
        "threads": detector.threads,
        "backends": hc.backends(),
        "gpu": _gpu(hc.gpu_status()),
        "accuracies": list(ACCURACIES),
        "packages": {name: _version(name) for name in PACKAGES},
        "environment": {name: os.environ[name] for name in SETTINGS if name in os.environ},
    }


def run(args) -> int:
    found = gather()
    if args.json:
        print(json.dumps(found, indent=2))
        return 0
    for name, value in found.items():
        if isinstance(value, dict):
            print(f"{name}:" + ("" if value else " nothing set"))
            for key, entry in value.items():
                print(f"  {key:32} {entry or 'not installed'}")
        else:
            print(f"{name:12} {', '.join(value) if isinstance(value, list) else value}")
    return 0


def _gpu(status) -> dict[str, str]:
    """The GPUs found, and why others are not usable."""
    found = {"CUDA code in this build": status["toolkit"] if status["compiled"] else "none"}
    for d in status["devices"]:
        found[f"device {d['number']}"] = (
            f"{d['name']}, sm_{d['major']}{d['minor']}, {d['multiprocessors']} multiprocessors, "
            f"{d['memory'] / 2**30:.0f} GiB"
        )
    if status["reason"]:
        found["why none is used"] = status["reason"]
    return found


def _processor() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass  # not Linux, or not readable: the next line is less detailed
    return platform.processor() or platform.machine()


def _version(name) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None
