# SPDX-License-Identifier: Apache-2.0
"""Tables about data that stays on the GPU, from a result as `hpccd bench gpu --parts device,large,worlds` writes it."""

import pytest

from bench.report import performance_device
from bench.report.results import Kept

DECIDED = {"first_filter": 600, "sieve": 300, "doubles": 90, "tolerance": 0, "extended": 8, "integers": 2, "cpu": 0}
TIMES = {"calls": 9, "average_ms": 0.9, "median_ms": 0.8, "p95_ms": 1.1, "best_ms": 0.7}
STAGES = {"stages_ms": {"gpu/refit": 0.5, "gpu/upload": 0.25}, "floors": {"refit": {"moved": 1e6, "ms": 0.125}}}


def call(part, **more):
    return {
        "part": part,
        "accuracy": "exact",
        "triangles": 1000,
        "contacts": 50,
        "candidates": 1000,
        "bytes": 700000,
        "cpu_median_ms": 9.0,
        "decided": DECIDED,
        **TIMES,
        **STAGES,
    } | more


@pytest.fixture
def kept():
    ways = {"host_median_ms": 2.0, "to_host_median_ms": 1.5}
    rows = [
        call("device", scene="cloth", **ways | {"accuracy": "balanced"}),
        call("device", scene="cloth", **ways),
        call("large", scene="nets 224", **ways),
        *(call("worlds", query="detect", worlds=n, pairs=300 * n, us_a_world=n / 4) for n in (64, 1024)),
        {
            "part": "worlds",
            "query": "proximity",
            "worlds": 64,
            "triangles": 2592,
            "pairs": 640,
            "cpu_median_ms": 5.0,
            "us_a_world": 2.5,
            "bytes": 64 * 2592 * 50,
            "stages_ms": {"gpu/refit": 0.5},
            **TIMES,
        },
    ]
    return Kept("gpu", "hpccd bench gpu", {}, 0.0, rows)


def test_by_where_data_lies(kept):
    lines = performance_device.ways(kept)[2:]
    assert lines == [f"| cloth | `{accuracy}` | 50 | 2 | 1.5 | 0.8 | 1.1 |" for accuracy in ("balanced", "exact")]


def test_stages_beside_their_floors(kept):
    head, _, *lines = performance_device.stages(kept)
    assert head.endswith("| cloth | nets 224 | 1,024 worlds |")
    assert lines[0] == "| `gpu/refit` | 0.5 (0.125) | 0.5 (0.125) | 0.5 (0.125) |"
    assert lines[1] == "| `gpu/upload` | 0.25 | 0.25 | 0.25 |"
    assert lines[2].startswith("| all | 0.75 (0.125) |")


def test_who_decided(kept):
    head, _, *lines = performance_device.decided(kept)
    assert "a tolerance" not in head and head.endswith("| twice the precision | integers | left to the CPU |")
    assert len(lines) == 5 and lines[2] == "| nets 224, `exact` | 1,000 | 600 | 300 | 90 | 8 | 2 | 0 |"
    assert lines[3].startswith("| 64 worlds, `exact` | 1,000 |")


def test_large_scenes_and_worlds(kept):
    assert performance_device.large(kept)[2:] == ["| 1,000 | 50 | 9 | 2 | 0.8 | 1.1 | 700 |"]
    small, many, near = performance_device.worlds(kept)[2:]
    assert small == "| detect, 1,000 triangles | 64 | 300 | 9 | 0.8 | 1.1 | 16 | 10.9 |"
    assert many.startswith("| detect, 1,000 triangles | 1,024 | 300 |")
    assert near == "| proximity, 2,592 triangles | 64 | 10 | 5 | 0.8 | 1.1 | 2.5 | 50 |"
