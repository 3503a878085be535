# SPDX-License-Identifier: Apache-2.0
"""The GPU and hybrid backends beside the CPU: ms a frame with all transfers (host arrays in, host arrays out), device
time by stage, and the two floors, bytes over bandwidth and operations over rate; then Fig. 6 of Kim et al. 2009
(threads by GPUs) and the segment sizes of their section 6.2. Needs a machine with a usable GPU.

Further parts, by name, with positions in PyTorch's or CuPy's arrays on the device and results that stay there:
  device   each scene, beside the ways from and to the host; device time by stage beside the floor of each (bytes and
           operations of one table, test/bench/core/gpu_work.py); which arithmetic decided how many pairs
  large    the same of two nets that meet nearly edge on edge (--sizes)
  worlds   contacts of a folded garment, and what is near in a folded sheet, many times in one call (--worlds)

  python -m bench gpu data                      the scene files of HPCCD_DATA, balanced and exact
  python -m bench gpu cloth-ball --repeat 100 --parts frames
  python -m bench gpu data --parts device,large,worlds --label device-h100
  python -m bench gpu --parts worlds --worlds 64,1024 --repeat 20

Answers are compared with the CPU's, those of many worlds one by one; a difference, or a frame that a device left to
the CPU, fails the command.
"""

from __future__ import annotations

import hpccd_core as hc
from bench import command
from bench.core import gpu_device, gpu_hybrid, gpu_worlds
from bench.core.device_arrays import library
from bench.core.gpu_times import StagesDetector, check, detector_times, device_stages
from hpccd_core._core import MOST_WORLDS
from hpccd_ros.base.errors import UserError
from hpccd_ros.bench import report as tables

OF_SCENES = ("frames", "threads", "segments", "device")
GENERATED = ("large", "worlds")  # whatever scenes are named
PARTS = (*OF_SCENES, *GENERATED)
IN_PYTORCH_OR_CUPY = ("device", *GENERATED)
TIERS = ("balanced", "exact")
# Double-precision operations of a pair in each stage, counted in the source: differences, cross products, bounds.
OPERATIONS = {"candidates": 170, "survivors": 400, "roots": 1500}


def configure(parser):
    command.configure(parser, default=("data",), steps=None, rounds=50)
    command.threads_option(parser)
    parser.add_argument(
        "--parts",
        default="frames,threads,segments",
        metavar="NAME,...",
        help="of frames, threads (Fig. 6), segments, device (results that stay there), large (two nets "
        "of millions of triangles) and worlds; the last three need PyTorch or CuPy "
        "(default: %(default)s)",
    )
    parser.add_argument(
        "--sizes",
        default="224,708,1415",
        metavar="N,...",
        help="large: vertices along a side of each net (default: %(default)s: 0.2, 2 and 8 million triangles)",
    )
    parser.add_argument(
        "--worlds",
        default="64,1024,4096,8192",
        metavar="W,...",
        help="worlds: how many in a call (default: %(default)s)",
    )
    parser.add_argument("--pcie", type=float, default=53.0, metavar="GB/s", help="host link (default: %(default)s)")
    parser.add_argument(
        "--memory", type=float, default=2800.0, metavar="GB/s", help="device memory (default: %(default)s, H100)"
    )
    parser.add_argument(
        "--rate",
        type=float,
        default=16.0,
        metavar="T/s",
        help="10^12 double-precision operations a second, not fused (default: %(default)s, H100)",
    )
    parser.add_argument(
        "--single-rate",
        type=float,
        default=29.0,
        metavar="T/s",
        help="10^12 single-precision operations a second, not fused (default: %(default)s, H100)",
    )


def run(args) -> int:
    parts = command.listed("--parts", args.parts, PARTS)
    sizes, worlds = (command.numbers(f"--{name}", getattr(args, name), int) for name in ("sizes", "worlds"))
    if sizes[0] < 2:
        raise UserError(f"--sizes {args.sizes}: a net has at least 2 vertices along a side")
    if worlds[-1] > MOST_WORLDS:
        raise UserError(f"--worlds {args.worlds}: a detector takes at most {MOST_WORLDS:,}; name fewer")
    if "gpu" not in hc.backends():
        raise UserError(f"no usable GPU: {hc.gpu_status()['reason']}")
    if needing := [part for part in parts if part in IN_PYTORCH_OR_CUPY]:
        library(f"--parts {needing[0]}")
    if any(part in OF_SCENES for part in parts):
        report, sources = command.begin(args)
    else:
        report, sources = command.begin_report(args), []
    report.note(
        "floors: PCIe bytes of positions and contacts; device bytes of the lists that stages hand on; "
        "operations counted from the source for each pair of each stage; rates are options"
    )
    for source in sources:
        step = source.step(0)
        if "frames" in parts:
            for accuracy in TIERS:
                _measure(report, args, source.name, step, accuracy)
        if "device" in parts:
            for accuracy in TIERS:
                gpu_device.measure(report, args, "device", source.name, step, accuracy)
        if "threads" in parts:
            gpu_hybrid.figure_6(report, args, source.name, step)
        if "segments" in parts:
            gpu_hybrid.segment_sizes(report, args, source.name, step)
    if "large" in parts:
        gpu_device.measure_large(report, args, sizes)
    if "worlds" in parts:
        for count in worlds:
            gpu_worlds.measure(report, args, count)
    show(report.rows)
    gpu_hybrid.show(report)
    return command.end(args, report)


def show(rows):
    """Tables of all parts but those of the hybrid."""
    for print_, parts in (
        (_show_frames, ("frame",)),
        (gpu_device.show, ("device", "large")),
        (gpu_worlds.show, ("worlds",)),
    ):
        if chosen := [r for r in rows if r["part"] in parts]:
            print_(chosen)


def _show_frames(rows):
    tables.show(
        "ms a frame, host arrays in and out",
        [
            "scene",
            "accuracy",
            "triangles",
            "contacts",
            "CPU",
            "hybrid",
            "GPU median",
            "p95",
            "best",
            "PCIe floor",
            "memory floor",
            "arithmetic floor",
        ],
        [
            [
                r["scene"],
                r["accuracy"],
                r["triangles"],
                r["contacts"],
                r["cpu_median_ms"],
                r["hybrid_median_ms"],
                r["median_ms"],
                r["p95_ms"],
                r["best_ms"],
                r["floor_pcie_ms"],
                r["floor_memory_ms"],
                r["floor_arithmetic_ms"],
            ]
            for r in rows
        ],
    )
    stages = list(dict.fromkeys(s for r in rows for s in r["stages_ms"]))
    tables.show(
        "where the time goes, ms (gpu/...: device time, measured in calls of their own)",
        ["stage", *(f"{r['scene']} {r['accuracy']}" for r in rows)],
        [[stage, *(r["stages_ms"].get(stage) for r in rows)] for stage in stages],
    )


def _measure(report, args, name, step, accuracy):
    options = {"accuracy": accuracy, "threads": args.threads}
    scene = step.scene()
    on_cpu, expected = detector_times(hc.Detector(scene, backend="cpu", **options), step, args.repeat)
    detector = hc.Detector(scene, backend="hybrid", **options)
    hybrid, contacts = detector_times(detector, step, args.repeat)
    hybrid_stages = {f"hybrid/{stage}": ms for stage, ms in detector.profile.items()}
    check(report, f"{name}, {accuracy}, hybrid", detector, contacts.hash == expected.hash)
    detector = hc.Detector(scene, backend="gpu", **options)
    on_gpu, contacts = detector_times(detector, step, args.repeat)
    stats, profile = detector.stats, detector.profile
    check(report, f"{name}, {accuracy}", detector, contacts.hash == expected.hash)
    staged = StagesDetector(scene, backend="gpu", **options)
    stages = device_stages(staged, lambda: staged.detect(step.vertices_t0, step.vertices_t1))
    report.add(
        part="frame",
        scene=name,
        accuracy=accuracy,
        triangles=step.triangles,
        contacts=len(contacts),
        cpu_median_ms=on_cpu.median,
        hybrid_median_ms=hybrid.median,
        **on_gpu.as_row(),
        **_floors(args, step, stats, contacts),
        stages_ms={**profile, **stages, **hybrid_stages},
    )


def _floors(args, step, stats, contacts):
    total = {
        key: sum(stats[f"{kind}_{key}"] for kind in ("vf", "ee"))
        for key in ("candidates", "rejected_coplanarity", "rejected_projection")
    }
    survivors = total["candidates"] - total["rejected_coplanarity"]
    roots = survivors - total["rejected_projection"]
    pcie = step.vertices_t0.nbytes + step.vertices_t1.nbytes + 16 * len(contacts.vf) + 24 * len(contacts.ee)
    # Each list is written once and read once; 8 bytes a pair.
    memory = 16 * (stats["leaf_pairs"] + survivors + roots) + 32 * len(contacts)
    work = {"candidates": total["candidates"], "survivors": survivors, "roots": roots}
    operations = sum(OPERATIONS[stage] * n for stage, n in work.items())
    return {
        "floor_pcie_ms": pcie / args.pcie / 1e6,
        "floor_memory_ms": memory / args.memory / 1e6,
        "floor_arithmetic_ms": operations / args.rate / 1e9,
    }
