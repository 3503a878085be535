# SPDX-License-Identifier: Apache-2.0
"""Where and with what something was measured; nothing that names a person or a computer."""

from __future__ import annotations

import os
import platform
import subprocess
import time
from pathlib import Path

import numpy as np

from hpccd_ros.base.version import package_version


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0))


def describe() -> dict:
    """Processor, memory, GPUs, versions and commit, as plain JSON values."""
    import hpccd_core

    return {
        "processor": _field("/proc/cpuinfo", "model name"),
        "cores": cores(),
        "memory_gib": round(int(_field("/proc/meminfo", "MemTotal").split()[0]) / 2**20, 1),
        "gpus": _gpus(),
        "system": f"{platform.system()} {platform.release()}",
        "python": platform.python_version(),
        "numpy": np.__version__,
        "hpccd": package_version(),
        "commit": commit(),
        "backends": hpccd_core.backends(),
        "simd": hpccd_core._core.simd_levels(),
        "date": time.strftime("%Y-%m-%d %H:%M UTC", time.gmtime()),
    }


def commit() -> str:
    """Commit of the checkout that this code lies in, "+changes" where its sources differ from it, or "unknown"."""
    here = Path(__file__).resolve().parent
    top = _git(here, "rev-parse", "--show-toplevel")
    # An environment inside somebody else's repository would name a commit of that.
    if not top or not (Path(top) / "hpccd_core" / "include" / "hpccd").is_dir():
        return "unknown"
    sources = ("hpccd_core", "hpccd_ros", ":(exclude)test/bench/results")
    changed = _git(here, "-C", top, "status", "--porcelain", "--untracked-files=no", "--", *sources)
    return (_git(here, "rev-parse", "--short=10", "HEAD") or "unknown") + ("+changes" if changed else "")


def short(machine: dict) -> str:
    """One line for the foot of a figure."""
    gpus = "".join(f", {gpu}" for gpu in machine["gpus"])
    return f"{machine['processor']}, {machine['cores']} cores{gpus}; commit {machine['commit']}; {machine['date']}"


class Load:
    """How busy others kept the machine while we measured: times from a busy machine mean little."""

    def __init__(self):
        self._begin = self._now()

    def of_others(self) -> float:
        """Share of all cores used by other processes since the beginning, 0 to 1."""
        all_, busy, own = (now - begin for now, begin in zip(self._now(), self._begin, strict=True))
        return max(0.0, (busy - own) / all_) if all_ else 0.0

    @staticmethod
    def _now():
        ticks = [int(word) for word in Path("/proc/stat").read_text().splitlines()[0].split()[1:9]]
        idle = ticks[3] + ticks[4]
        clock = os.times()
        own = (clock.user + clock.system + clock.children_user + clock.children_system) * os.sysconf("SC_CLK_TCK")
        return sum(ticks), sum(ticks) - idle, own


def _field(path, name):
    for line in Path(path).read_text().splitlines():
        key, _, value = line.partition(":")
        if key.strip() == name:
            return value.strip()
    return "unknown"


def _gpus():
    try:
        found = subprocess.run(
            ["nvidia-smi", "--query-gpu=name", "--format=csv,noheader"], capture_output=True, text=True, timeout=60
        )
    except FileNotFoundError:
        return []
    return [line.strip() for line in found.stdout.splitlines()] if found.returncode == 0 else []


def _git(folder, *words):
    try:
        found = subprocess.run(["git", "-C", str(folder), *words], capture_output=True, text=True, timeout=60)
    except FileNotFoundError:
        return ""
    return found.stdout.strip() if found.returncode == 0 else ""
