# SPDX-License-Identifier: Apache-2.0
"""Show what is installed: versions, usable backends and accuracy tiers, processor, DDS settings. Examine a mesh file.

hpccd info              as text, for bug reports
hpccd info --json       as JSON, for programs
hpccd info shirt.obj    counts of a mesh, lengths of its edges, and what disturbs collision detection:
                        doubled vertices, T-junctions, self-intersections and others, with a remedy for each
"""

import json
import os
import platform
import sys
from dataclasses import asdict
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np

import hpccd_ros
from hpccd_ros.base.errors import UserError
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


# Places of a defect that the text shows.
SHOWN = 3


def configure(parser):
    parser.add_argument("mesh", metavar="MESH", nargs="?", help="an .obj, .ply, .stl or .dae file to examine")
    parser.add_argument(
        "--distance",
        metavar="D",
        type=float,
        help="of MESH: count vertices as doubled, and as lying on an edge, up to this distance (default: 0.001 of the "
        "median edge)",
    )
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
    if args.mesh is not None:
        return _examine(args)
    if args.distance is not None:
        raise UserError("--distance belongs to a mesh file: hpccd info MESH --distance D")
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


def _examine(args) -> int:
    import hpccd_core as hc
    from hpccd_ros.detect import mesh_defects

    if Path(args.mesh).suffix.lower() == ".mcap":
        raise UserError(f"{args.mesh} is a recording: use hpccd doctor")
    if args.distance is not None and not 0 <= args.distance < np.inf:
        raise UserError(f"--distance: must be finite and not negative, got {args.distance}")
    try:
        report = mesh_defects.examine(*hc.load_mesh(args.mesh), args.distance)
    except hc.MeshFileError as error:
        raise UserError(str(error)) from error
    if args.json:
        found = asdict(report)
        for defect in found["defects"]:
            defect["indices"] = defect["indices"].tolist()
        if found["smallest_gap"] == np.inf:
            found["smallest_gap"] = None  # JSON has no infinity
        print(json.dumps(found, indent=2))
        return 0
    print("\n".join(_lines(report)))
    return 0


def _lines(report):
    """The report of a mesh as text."""

    def if_welded(now, then):
        return f"; {then} if welded" if now != then else ""

    yes = {True: "yes", False: "no"}
    closed, welded = yes[report.closed], yes[report.closed_if_welded]
    of_welded = ", if welded" if report.defects and "doubled" in report.defects[0].name else ""
    boundary = f", {report.boundary_edges} edges are in one face only" if report.boundary_edges else ""
    yield f"{'vertices':14} {report.vertices}"
    yield f"{'faces':14} {report.faces}"
    components = report.components, report.components_if_welded
    yield f"{'components':14} {report.components}{if_welded(*components)}"
    yield f"{'closed':14} {closed}{boundary}{if_welded(closed, welded)}"
    yield f"{'shortest edge':14} {report.shortest_edge:.6g}"
    yield f"{'median edge':14} {report.median_edge:.6g}"
    yield f"{'smallest gap':14} {report.smallest_gap:.6g}, between features that share no vertex{of_welded}"
    yield f"{'distance':14} {report.distance:.3g}, up to which vertices count as doubled"
    for defect in report.defects:
        places = [", ".join(map(str, row)) for row in defect.indices[:SHOWN].tolist()]
        more = "; ..." if len(defect.indices) > SHOWN else ""
        yield f"\n{defect.name}: {len(defect.indices)}"
        yield f"  where ({defect.of}): {'; '.join(places)}{more}"
        yield f"  effect: {defect.effect}"
        yield f"  remedy: {defect.remedy}"
    if not report.defects:
        yield "\nno defects"
    if 0 < report.smallest_gap < np.inf:
        yield (
            "\nKeep the separation plus twice the thickness below the smallest gap, or parts of the mesh are in "
            "contact at rest.\nFor a thicker mesh, ignore neighbours: scene.ignore_within(mesh, rings=2)."
        )


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
