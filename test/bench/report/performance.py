# SPDX-License-Identifier: Apache-2.0
"""docs/performance.md: its text is written by hand, its tables are made from the kept results.

A table stands between `<!-- NAME -->` and `<!-- end -->`; what is there is replaced, with command, machine and commit
of each result above it; or the words that it is not measured, where no result is kept.
"""

from __future__ import annotations

import re
from pathlib import Path

from bench.report import (
    markdown,
    performance_core,
    performance_device,
    performance_distance,
    performance_gpu,
    performance_limit,
    performance_node,
    performance_rigid,
    performance_step,
    performance_stop,
)
from bench.report.results import Kept
from hpccd_ros.base.errors import UserError
from hpccd_ros.bench import accuracy

# Name of each table: how it is made, and of which results.
TABLES = {
    "peer": (performance_core.peer, "cpu-4-cores"),
    "sequences": (performance_core.sequences, "cpu-table-1-4-cores"),
    "scaling": (performance_core.scaling, "scaling-4-cores", "scaling-generated-4-cores"),
    "many-cores": (performance_core.many_cores, "scaling-h100-16-cores", "scaling-generated-h100-16-cores"),
    "where-time-goes": (performance_limit.stages, "limit-2-cores"),
    "machine-rates": (performance_limit.rates, "limit-2-cores"),
    "methods": (performance_core.methods, "methods-4-cores"),
    "decided": (performance_core.decided, "accuracy-4-cores"),
    "size": (performance_core.size, "size-4-cores"),
    "memory": (performance_core.memory, "memory-2-cores"),
    "ropes": (performance_core.ropes, "ropes-2-cores"),
    "worlds-on-cpus": (performance_core.worlds, "worlds-2-cores", "worlds-16-cores", "worlds-small-2-cores"),
    "options": (performance_core.options, "options-2-cores"),
    "tiers": (performance_core.tiers, "accuracy-4-cores"),
    "wrong-answers": (performance_core.wrong_answers, "accuracy-4-cores"),
    "separations": (performance_distance.by_distance, "distance-2-cores"),
    "snapshots": (performance_distance.of_a_snapshot, "distance-2-cores"),
    "steps": (performance_step.steps, "step-2-cores"),
    "device-steps": (performance_step.steps, "step-h100-16-cores"),
    "rigid-truth": (performance_rigid.truth, "rigid-2-cores"),
    "rigid-bounds": (performance_rigid.bounds, "rigid-2-cores"),
    "rigid-cost": (performance_rigid.cost, "rigid-cost-2-cores"),
    "robot": (performance_rigid.stream, "robot-2-cores", "robot-4-of-16-cores", "robot-h100-4-of-16-cores"),
    "distance-truth": (performance_distance.on_scenes, "accuracy-distance-2-cores"),
    "distance-wrong-answers": (performance_distance.hard_queries, "accuracy-distance-2-cores"),
    "backends": (performance_gpu.backends, "gpu-h100-16-cores"),
    "device-stages": (performance_gpu.device_stages, "gpu-h100-16-cores"),
    "device-results": (performance_device.ways, "gpu-device-h100"),
    "device-floors": (performance_device.stages, "gpu-device-h100"),
    "device-decided": (performance_device.decided, "gpu-device-h100"),
    "large-scenes": (performance_device.large, "gpu-device-h100"),
    "worlds-on-device": (performance_device.worlds, "gpu-device-h100"),
    "hybrid": (performance_gpu.hybrid, "gpu-h100-16-cores"),
    "second-gpu": (performance_gpu.second_gpu, "gpu-2-h200-32-cores"),
    "segments": (performance_gpu.segments, "gpu-h100-16-cores"),
    "gpu-tiers": (performance_gpu.tiers, "accuracy-trade-h200-16-cores"),
    "latency": (performance_node.latency, "ros-4-cores"),
    "step-loop": (performance_node.step_loop, "ros-2-cores"),
    "rates": (performance_node.rates, "ros-4-cores"),
    "stop": (performance_stop.approaches, "stop-2-cores"),
    "stop-silence": (performance_stop.silences, "stop-2-cores"),
    "stop-cost": (performance_stop.costs, "stop-2-cores"),
    "soak": (performance_node.soak, "soak-4-cores"),
}
TRADE = "accuracy-trade-h200-16-cores"
TABLE = re.compile(r"(<!-- (?P<name>[a-z-]+) -->\n).*?(<!-- end -->)", re.DOTALL)


def read(results: Path, name: str) -> Kept:
    return Kept.read(results / f"{name}.json", re.match("[a-z]+", name)[0])


def page(text: str, results: Path) -> str:
    """`text` with its tables made anew from the results of this folder. UserError for a table that is not known."""

    def made(found: re.Match) -> str:
        if found["name"] not in TABLES:
            raise UserError(f"<!-- {found['name']} -->: there is no such table; there are {', '.join(TABLES)}")
        make, *names = TABLES[found["name"]]
        if missing := [name for name in names if not (results / f"{name}.json").exists()]:
            return f"{found[1]}\nNot measured yet: no result {', '.join(missing)} is kept.\n\n{found[3]}"
        of = {name: read(results, name) for name in names}
        sources = "  \n".join(markdown.source(*item) for item in of.items())
        table = "\n".join(make(*of.values()))
        return f"{found[1]}\n{sources}\n\n{table}\n\n{found[3]}"

    return TABLE.sub(made, text)


def write(results: Path, docs: Path) -> list[Path]:
    """Make the tables of docs/performance.md and the picture of tiers anew; the files."""
    path = docs / "performance.md"
    path.write_text(page(path.read_text(encoding="utf-8"), results), encoding="utf-8")
    accuracy.draw(read(results, TRADE).rows, docs / "figures" / "trade.png")
    return [path, docs / "figures" / "trade.png"]
