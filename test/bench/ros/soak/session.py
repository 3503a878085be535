# SPDX-License-Identifier: Apache-2.0
"""One soak: starts the node and a publisher that is restarted, streams to both, and looks at the node's memory."""

from __future__ import annotations

import math
import random
import signal
import struct
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions

from bench.lab import bar
from bench.ros import node_process
from bench.ros.soak import load
from hpccd_ros import scenes
from hpccd_ros.base.errors import UserError
from hpccd_ros.bench.report import Report
from hpccd_ros.demo.children import Children
from hpccd_ros.middleware import environment

NAMESPACE = "/soak"
HELD_UP_FRAMES = load.INPUT_DEPTH + 10  # more than may wait
PATIENCE = 300.0  # s, for what takes less than one on a machine that is not busy
ROWS = 10  # of the result, evenly over the time


class Session:
    """Streams for --minutes. What came of it: `load`, `status` (the node's counters), `exit_status` of the node,
    `ends` of the restarted publisher by kind, and how many frames it sent.
    """

    def __init__(self, args, report: Report, folder: Path):
        self.args, self.report, self._folder = args, report, folder
        self._random = random.Random(args.seed)
        self._counter = folder / "strip-sent"
        self._counter.write_bytes(bytes(8))
        self.ends = {"ended": 0, "killed": 0}
        self._samples: list[tuple[float, float]] = []  # s, MB

    def run(self) -> None:
        environment.prepare()
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
        node = rclpy.create_node("load", namespace=NAMESPACE, start_parameter_services=False)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(node)
        scene = scenes.make(load.SCENE, load.SIZE)
        try:
            with Children(self._folder) as self._children:
                self.load = load.SoakLoad(node, scene, self.args.rate, self.args.check_every)
                self.status = node_process.NodeStatus(node, NAMESPACE)
                parameters = load.node_parameters(scene)
                self._node = node_process.start(self._children, self._folder, NAMESPACE, parameters)
                self._spin_until(self.load.heard, "the node was not heard")
                self.load.begin()
                self._spin_until(self.load.acknowledged, "the first frame was not acknowledged")
                self._start_publisher()
                last = self._stream()
                self._end_publisher(kill=False)
                self.load.end(last)
                self._spin_until(self._settled, "not every message was accounted for", fail=False)
                self.exit_status = self._children.end(self._node)
        finally:
            self._executor.shutdown()
            node.destroy_node()
            rclpy.try_shutdown()
            self._clean_shared_memory()

    @property
    def last_words(self) -> str:
        """The end of the node's log."""
        return self._node.last_words()

    @property
    def sent_by_restarted(self) -> int:
        """Frames that all runs of the restarted publisher have sent."""
        (sent,) = struct.unpack("<Q", self._counter.read_bytes())
        return sent

    def missing(self) -> dict[str, int]:
        """Messages sent, by mesh, that the node has neither received nor counted as lost."""
        return {
            mesh: sent - self.status.count(f"received.{mesh}") - self.status.count(f"dropped.{mesh}.middleware")
            for mesh, sent in self.load.sent.items()
        }

    def memory_mb(self) -> dict[str, float]:
        """Resident memory of the node after the warm-up: medians of the first and the last tenth, least, most."""
        seconds, mb = np.array(self._samples).T
        after = mb[seconds >= self.args.warm_up * 60 * self.args.minutes]
        tenth = max(1, len(after) // 10)
        first, last = np.median(after[:tenth]), np.median(after[-tenth:])
        return {"first": float(first), "last": float(last), "least": float(after.min()), "most": float(after.max())}

    def _spin_until(self, ready, what: str, fail: bool = True) -> None:
        deadline = time.monotonic() + PATIENCE
        while not ready():
            self._alive()
            if time.monotonic() > deadline:
                if fail:
                    raise UserError(f"{what} within {PATIENCE:.0f} s\n{self.last_words}")
                self.report.failure(f"{what} within {PATIENCE:.0f} s")
                return
            self._executor.spin_once(timeout_sec=0.05)

    def _alive(self) -> None:
        if not self._node.running:
            code = self._node.process.returncode
            raise UserError(f"the node ended by itself, status {code}; its last words:\n{self._node.last_words(40)}")

    def _stream(self) -> int:
        """Returns the tick behind the last."""
        rate, seconds = self.args.rate, 60 * self.args.minutes
        begin = time.monotonic()
        tick = int(time.time() * rate) + 1
        restart_at = begin + self._life()
        sample_at = row_at = begin
        hold_at = begin + seconds * self.args.warm_up / 2
        release_at = hold_at + HELD_UP_FRAMES / rate
        with bar("soak", round(seconds)) as done:
            while (now := time.monotonic()) - begin < seconds:
                self._alive()
                left = tick / rate - time.time()
                if left > 0:
                    self._executor.spin_once(timeout_sec=left)
                else:
                    self.load.tick(tick)
                    tick = max(tick + 1, int(time.time() * rate))
                self.load.look_at_replies()
                if now >= hold_at:
                    self._node.process.send_signal(signal.SIGSTOP)
                    hold_at = math.inf
                if now >= release_at:
                    self.load.fill_segment()
                    self._node.process.send_signal(signal.SIGCONT)
                    release_at = math.inf
                if now >= restart_at:
                    self._end_publisher(kill=self._random.random() < 1 / 3)
                    self._start_publisher()
                    restart_at = time.monotonic() + self._life()
                if now >= sample_at:
                    sample_at += 1.0
                    self._samples.append((now - begin, node_process.resident_mb(self._node.process.pid)))
                    done()
                if now >= row_at:
                    row_at += max(1.0, seconds / ROWS)
                    self._row(now - begin)
        self._node.process.send_signal(signal.SIGCONT)
        return tick

    def _life(self) -> float:
        return self.args.restart_every * self._random.uniform(0.5, 1.5)

    def _start_publisher(self) -> None:
        self._sent_before_start = self.sent_by_restarted
        module = "bench.ros.soak.restarted_publisher"
        self._publisher = self._children.start("strip", module, NAMESPACE, str(self.args.rate), str(self._counter))

    def _end_publisher(self, kill: bool) -> None:
        self._children.check()
        self.ends["killed" if kill else "ended"] += 1
        signalled = signal.SIGKILL if kill else signal.SIGTERM
        expected = {-signal.SIGKILL if kill else 0}
        if self.sent_by_restarted == self._sent_before_start:  # Python may be loading yet, which knows no orderly end
            expected.add(-signalled)
        self._publisher.process.send_signal(signalled)
        status = self._publisher.process.wait(PATIENCE)
        if status not in expected:
            words = self._publisher.last_words()
            self.report.failure(f"the restarted publisher ended with status {status}: {words}")
        self._children.forget(self._publisher)

    def _row(self, second: float) -> None:
        of_process = Path(f"/proc/{self._node.process.pid}")
        self.report.add(
            second=round(second),
            memory_mb=self._samples[-1][1] if self._samples else None,
            threads=len(list((of_process / "task").iterdir())),
            files=len(list((of_process / "fd").iterdir())),
            answers=self.load.answers,
            **self.status.counts(),
        )

    def _settled(self) -> bool:
        """Every message that was sent came, or is known to be lost; nothing waits; no request is open."""
        self.load.look_at_replies()
        accounted = not self.status.unaccounted() and not self.load.open_requests
        return accounted and not any(self.missing().values())

    def _clean_shared_memory(self) -> None:
        # Killed publishers leave their segments behind; the tool of Fast DDS removes those without an owner.
        tool = Path(sys.prefix) / "bin" / "fastdds"
        if self.ends["killed"] and tool.is_file():
            subprocess.run([str(tool), "shm", "clean"], stdout=subprocess.DEVNULL, check=False)
