# SPDX-License-Identifier: Apache-2.0
"""What the node reports about itself on /diagnostics: its accounts as messages."""

import resource
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from hpccd_ros.base.quoting import counted, listed
from hpccd_ros.frames.drops import Reason
from hpccd_ros.middleware import topic_names
from hpccd_ros.node.accounts import REJECTED_BESIDE_MESHES, Accounts
from hpccd_ros.node.metrics import percentiles


class Reporter:
    """Makes a DiagnosticArray of the state of the node; rates are those since the report before."""

    def __init__(self, node_name: str, accounts: Accounts) -> None:
        self._node_name = node_name
        self._accounts = accounts
        self._time = time.monotonic()
        self._received: dict[str, int] = {}
        self._detections = 0
        self._coarse = 0
        self._dropped: dict[Reason, int] = {}
        self._topologies_rejected = 0
        self._rejected_beside = dict.fromkeys(REJECTED_BESIDE_MESHES, 0)

    def report(
        self,
        stamp: Time,
        *,
        state: str,
        waiting: int,
        warnings: list[str],
        silent: Sequence[str] = (),
        service: Mapping[str, int],
        errors: tuple[int, str] = (0, ""),
        recording: tuple[bytes, str, Mapping[str, object]] | None = None,
        stop: tuple[bytes, str, Mapping[str, object]] | None = None,
        coordinate_frame: tuple[str, str] = ("", ""),
    ) -> DiagnosticArray:
        """silent: inputs on which nothing comes, in words.
        coordinate_frame: that of the scene, and what determined it.
        errors: how many exceptions nothing expected, and the last one.
        recording: level, message and values of the node's own recording, where there is one.
        stop: those of its topic stop, where there is one.

        Message of the statuses frames, detection, service, process, errors; stop, recording where there is one."""
        now = time.monotonic()
        period, self._time = max(now - self._time, 1e-9), now
        data = self._accounts.metrics.snapshot()
        data["processed"] += self._accounts.static_taken
        out = DiagnosticArray()
        out.header.stamp = stamp
        out.status = [
            self._frames(data, period, waiting, warnings, silent, coordinate_frame),
            self._detection(data, period, state),
            self._status("service", DiagnosticStatus.OK, topic_names.DETECT, service),
            self._status("process", DiagnosticStatus.OK, state, {"state": state, **_memory()}),
            self._errors(*errors),
            *([self._status("stop", *stop)] if stop is not None else []),
            *([self._status("recording", *recording)] if recording is not None else []),
        ]
        return out

    def _frames(
        self,
        data: dict,
        period: float,
        waiting: int,
        warnings: list[str],
        silent: Sequence[str],
        coordinate_frame: tuple[str, str],
    ) -> DiagnosticStatus:
        accounts = self._accounts
        dropped, topologies_rejected = accounts.dropped.by_reason(), accounts.topologies_rejected.total
        new = {reason: more for reason, count in dropped.items() if (more := count - self._dropped.get(reason, 0))}
        new_topologies = topologies_rejected - self._topologies_rejected
        values: dict[str, object] = {}
        for mesh, count in sorted(data["received"].items()):
            values[f"received.{mesh}"] = count
            values[f"rate_hz.{mesh}"] = f"{(count - self._received.get(mesh, 0)) / period:.2f}"
        values |= {f"last_stamp.{name}": stamp for name, stamp in sorted(data["last_stamps"].items())}
        came = sum(data["received"].values()) - sum(self._received.values())
        values |= {
            "received": sum(data["received"].values()),
            "processed": data["processed"],
            "waiting": waiting,
            "dropped": sum(dropped.values()),
            "restarts": accounts.restarts,
            "topologies_rejected": topologies_rejected,
            "frame_id": coordinate_frame[0],
            "frame_id_by": coordinate_frame[1],
        }
        for reason, count in sorted(dropped.items()):
            values[f"dropped.{reason}"] = count
        for (mesh, reason), count in sorted(accounts.dropped.by_mesh_and_reason().items()):
            values[f"dropped.{mesh}.{reason}"] = count
        for (mesh, reason), count in sorted(accounts.topologies_rejected.by_mesh_and_reason().items()):
            values[f"topologies_rejected.{mesh}.{reason}"] = count
        values |= accounts.connections
        for stage, text in percentiles(data["transport_ms"]).items():
            values[f"transport_ms.{stage}"] = text
        values["last_rejection"] = accounts.log.last
        values |= {f"warning.{number}": text for number, text in enumerate([*warnings, *silent], start=1)}
        self._received, self._dropped, self._topologies_rejected = (data["received"], dropped, topologies_rejected)
        notes = list(warnings)
        if new:
            reasons = listed(f"{reason} {count:,}" for reason, count in sorted(new.items()))
            notes.insert(0, f"{counted(sum(new.values()), 'frame')} dropped ({reasons})")
        if new_topologies:
            notes.insert(0, f"{counted(new_topologies, 'topology', 'topologies')} rejected")
        for what, name in REJECTED_BESIDE_MESHES.items():
            before, self._rejected_beside[what] = self._rejected_beside[what], accounts.connections[name]
            if new_of_kind := self._rejected_beside[what] - before:
                notes.insert(0, f"{counted(new_of_kind, what.removesuffix('s'))} rejected")
        if notes or (silent and came):
            return self._status("frames", DiagnosticStatus.WARN, "; ".join([*notes, *silent]), values)
        if not came:
            text = "; ".join([f"no frames in the last {period:.1f} s", *silent])
            return self._status("frames", DiagnosticStatus.STALE, text, values)
        return self._status("frames", DiagnosticStatus.OK, f"{came / period:.1f} frames a second", values)

    def _detection(self, data: dict, period: float, state: str) -> DiagnosticStatus:
        rate = (data["detections"] - self._detections) / period
        self._detections = data["detections"]
        values: dict[str, object] = {
            "rate_hz": f"{rate:.2f}",
            "detections": data["detections"],
            "first_frames": data["first_frames"],
            "failures": data["failures"],
            "near_total": data["near"],
            "coarse": data["coarse"],
        }
        for kind in ("latency_ms", "detect_ms"):
            for name, text in percentiles(data[kind]).items():
                values[f"{kind}.{name}"] = text
        for stage, mean in data["stages"].items():
            values[f"stage_ms.{stage}"] = f"{mean:.3f}"
        values |= data["last"]
        values["last_failure"] = data["last_failure"]
        coarse, self._coarse = data["coarse"] - self._coarse, data["coarse"]
        if data["failing"]:
            return self._status("detection", DiagnosticStatus.ERROR, f"failed: {data['last_failure']}", values)
        if coarse:
            text = (
                f"{counted(coarse, 'step')} with a motion beyond rigid_tolerance: {data['last_coarse']}, so there may "
                "be more false positives; send poses or joint states more often, or raise rigid_parts or "
                "rigid_tolerance"
            )
            return self._status("detection", DiagnosticStatus.WARN, text, values)
        return self._status("detection", DiagnosticStatus.OK, f"{rate:.1f} detections a second ({state})", values)

    def _errors(self, count: int, last: str) -> DiagnosticStatus:
        # Permanent: what else it broke is unknown.
        level = DiagnosticStatus.ERROR if count else DiagnosticStatus.OK
        text = f"{counted(count, 'unexpected error')}, the last: {last}" if count else "none"
        return self._status("errors", level, text, {"errors": count, "last_error": last})

    def _status(self, part: str, level: bytes, message: str, values: Mapping[str, object]) -> DiagnosticStatus:
        return DiagnosticStatus(
            level=level,
            name=f"{self._node_name}: {part}",
            message=message,
            hardware_id="hpccd",
            values=[KeyValue(key=key, value=str(value)) for key, value in values.items()],
        )


def _memory() -> dict[str, str]:
    peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024  # KiB on Linux
    pages = Path("/proc/self/statm")
    values = {"memory_peak_mb": f"{peak_mb:.1f}"}
    if pages.exists():
        resident = int(pages.read_text().split()[1]) * resource.getpagesize()
        values["memory_mb"] = f"{resident / 2**20:.1f}"
    return values
