# SPDX-License-Identifier: Apache-2.0
"""The GPU and hybrid backends beside the CPU: ms a frame with all transfers (host arrays in, host arrays out), device
time by stage, and the two floors, bytes over bandwidth and operations over rate; then Fig. 6 of Kim et al. 2009
(threads by GPUs) and the segment sizes of their section 6.2. Needs a machine with a usable GPU.

  hpccd bench gpu data                      the scene files of HPCCD_DATA, balanced and exact
  hpccd bench gpu cloth-ball --repeat 100 --parts frames
  hpccd bench gpu --redraw gpu-16-cores.json --figures docs/figures

Contacts of all backends are compared; a difference, or a frame that a device left to the CPU, fails the command.
"""

from __future__ import annotations

from pathlib import Path

import hpccd_core as hc
from hpccd_ros.base.errors import UserError
from hpccd_ros.bench import command
from hpccd_ros.bench.core import gpu_hybrid
from hpccd_ros.bench.core.gpu_hybrid import detector_times
from hpccd_ros.bench.report import figures, table
from hpccd_ros.bench.report.results import Kept

PARTS = ("frames", "threads", "segments")
TIERS = ("balanced", "exact")
# Double-precision operations of a pair in each stage, counted in the source: differences, cross products, bounds.
OPERATIONS = {"candidates": 170, "survivors": 400, "roots": 1500}


def configure(parser):
    command.configure(parser, default=("data",), steps=None, rounds=50)
    command.threads_option(parser)
    parser.add_argument("--parts", default=",".join(PARTS), metavar="NAME,...",
                        help="of frames, threads (Fig. 6) and segments (default: %(default)s)")  # fmt: skip
    parser.add_argument("--pcie", type=float, default=53.0, metavar="GB/s", help="host link (default: %(default)s)")
    parser.add_argument("--memory", type=float, default=2800.0, metavar="GB/s",
                        help="device memory (default: %(default)s, H100)")  # fmt: skip
    parser.add_argument("--rate", type=float, default=16.0, metavar="T/s",
                        help="10^12 double-precision operations a second, not fused (default: %(default)s, H100)")
    parser.add_argument("--redraw", metavar="JSON", help="draw Fig. 6 from this kept result; measure nothing")


def run(args) -> int:
    if args.redraw:
        drawn = figures.draw(Kept.read(Path(args.redraw), "gpu"), Path(args.figures or args.out))
        if not drawn:
            raise UserError(f"{args.redraw}: no times by threads and GPUs in it: measure with --parts threads")
        print(f"wrote {drawn[0]}")
        return 0
    if "gpu" not in hc.backends():
        raise UserError(f"no usable GPU: {hc.gpu_status()['reason']}")
    parts = command.listed("--parts", args.parts, PARTS)
    report, sources = command.begin(args)
    report.note("floors: PCIe bytes of positions and contacts; device bytes of the lists that stages hand on; "
                "operations counted from the source for each pair of each stage; rates are options")
    for source in sources:
        step = source.step(0)
        if "frames" in parts:
            for accuracy in TIERS:
                _measure(report, args, source.name, step, accuracy)
        if "threads" in parts:
            gpu_hybrid.figure_6(report, args, source.name, step)
        if "segments" in parts:
            gpu_hybrid.segment_sizes(report, args, source.name, step)
    if "frames" in parts:
        _show_frames([r for r in report.rows if r["part"] == "frame"])
    if len(parts) > 1 or "frames" not in parts:
        gpu_hybrid.show(report)
    return command.end(args, report)


def _show_frames(rows):
    table.show(
        "ms a frame, host arrays in and out",
        ["scene", "accuracy", "triangles", "contacts", "CPU", "hybrid", "GPU median", "p95", "best", "PCIe floor",
         "memory floor", "arithmetic floor"],
        [[r["scene"], r["accuracy"], r["triangles"], r["contacts"], r["cpu_median_ms"], r["hybrid_median_ms"],
          r["median_ms"], r["p95_ms"], r["best_ms"], r["floor_pcie_ms"], r["floor_memory_ms"],
          r["floor_arithmetic_ms"]] for r in rows],
    )  # fmt: skip
    stages = list(dict.fromkeys(s for r in rows for s in r["stages_ms"]))
    table.show(
        "where the time goes, ms (gpu/...: device time, measured in calls of their own)",
        ["stage", *(f"{r['scene']} {r['accuracy']}" for r in rows)],
        [[stage, *(r["stages_ms"].get(stage) for r in rows)] for stage in stages],
    )


class _StagesDetector(hc.Detector):
    _gpu_stages = True


def _stages(scene, options, step):
    """Device time by stage: events cost time themselves, so these frames are not the ones that count."""
    detector = _StagesDetector(scene, backend="gpu", **options)
    for _ in range(20):
        detector.detect(step.vertices_t0, step.vertices_t1)
    return {name: ms for name, ms in detector.profile.items() if name.startswith("gpu/")}


def _measure(report, args, name, step, accuracy):
    options = {"accuracy": accuracy, "threads": args.threads}
    scene = step.scene()
    on_cpu, expected = detector_times(hc.Detector(scene, backend="cpu", **options), step, args.repeat)
    detector = hc.Detector(scene, backend="hybrid", **options)
    hybrid, contacts = detector_times(detector, step, args.repeat)
    hybrid_stages = {f"hybrid/{stage}": ms for stage, ms in detector.profile.items()}
    if contacts.hash != expected.hash:
        report.failure(f"{name}, {accuracy}: contacts of hybrid and CPU differ")
    if detector.stats["gpu_fallbacks"]:
        report.failure(f"{name}, {accuracy}: hybrid frames left to the CPU: {detector.last_gpu_error}")
    detector = hc.Detector(scene, backend="gpu", **options)
    on_gpu, contacts = detector_times(detector, step, args.repeat)
    stats, profile = detector.stats, detector.profile
    if contacts.hash != expected.hash:
        report.failure(f"{name}, {accuracy}: contacts of GPU and CPU differ")
    if stats["gpu_fallbacks"]:
        report.failure(f"{name}, {accuracy}: frames left to the CPU: {detector.last_gpu_error}")
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
        stages_ms={**profile, **_stages(scene, options, step), **hybrid_stages},
    )


def _floors(args, step, stats, contacts):
    total = {key: sum(stats[f"{kind}_{key}"] for kind in ("vf", "ee"))
             for key in ("candidates", "rejected_coplanarity", "rejected_projection")}  # fmt: skip
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
