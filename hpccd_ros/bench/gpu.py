# SPDX-License-Identifier: Apache-2.0
"""ms per step on the CPU, on the hybrid backend and on the GPU, with host arrays and, if PyTorch or CuPy is installed,
with positions and contacts that stay on the device. Needs an NVIDIA GPU.

  hpccd bench gpu run.mcap --steps 8        a recording
  hpccd bench gpu data                      the scene files of HPCCD_DATA, balanced and exact

Fails if contacts differ from the CPU's, or if a device left a step to the CPU.
"""

from __future__ import annotations

import dataclasses
import importlib

import numpy as np

import hpccd_core as hc
from hpccd_core.options import ACCURACIES
from hpccd_ros.base.errors import UserError
from hpccd_ros.bench import command, measure
from hpccd_ros.bench.report import Report, cores, show

COLUMNS = {key: key for key in ("scene", "accuracy", "way", "triangles", "contacts")}
COLUMNS |= {key: f"{key}_ms" for key in ("median", "p95", "best", "first")}
LIBRARIES = {
    "torch": lambda torch, xyz: torch.from_numpy(np.ascontiguousarray(xyz)).cuda(),
    "cupy": lambda cupy, xyz: cupy.asarray(xyz),
}


def configure(parser):
    command.configure(parser, default=("data",), steps=4, repeat=20)
    parser.add_argument("--tiers", default="balanced,exact", metavar="NAME,...", help="default: %(default)s")


def to_device():
    """A function that copies a step to the device; None if neither PyTorch nor CuPy is installed."""
    for name, copy in LIBRARIES.items():
        try:
            library = importlib.import_module(name)
        except ImportError:
            continue
        ends = ("vertices_t0", "vertices_t1")
        return lambda step: dataclasses.replace(step, **{end: copy(library, getattr(step, end)) for end in ends})
    return None


def run(args) -> Report:
    tiers = command.listed("--tiers", args.tiers, ACCURACIES)
    if "gpu" not in hc.backends():
        raise UserError(f"no usable GPU: {hc.gpu_status()['reason']}")
    report, found = command.begin(args)
    report.note(measure.NOTE)
    moved = to_device()
    if moved is None:
        report.note("positions on the device are not measured: neither torch nor cupy is installed")
    for source in found:
        for tier in tiers:
            options = {"accuracy": tier, "threads": args.threads}
            runners = [measure.Runner(name, {**options, "backend": name}) for name in measure.BACKENDS]
            if moved is not None:
                on_device = {**options, "backend": "gpu", "results": "device"}
                runners.append(measure.Runner("device", on_device, change=moved))
            series = measure.measure(source, runners, args.repeat, args.steps)
            if tier != "fast":
                for text in measure.disagreements(series):
                    report.failure(f"{source.name}, {tier}: contacts differ between backends: {text}")
            triangles = source.first().triangles
            for name, one in series.items():
                if one.stats().get("gpu_fallbacks"):
                    report.failure(f"{source.name}, {tier}, {name}: steps were left to the CPU")
                threads = args.threads or cores()
                asked = {"way": name, "accuracy": tier, "threads": threads, "triangles": triangles}
                report.add(scene=source.name, **asked, **one.row())
    caption = "device: positions and contacts stay on the GPU; the others: arrays of the host in and out"
    show("ms a step, transfers included", COLUMNS, report.rows, caption)
    return report
