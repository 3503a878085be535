# SPDX-License-Identifier: Apache-2.0
"""Minutes or hours of mixed load on a node in a process of its own: streams of four meshes, one of them with sixteen
changes of topology in every run, one from a publisher that is ended or killed and started again; wrong messages of
ten kinds; a misspelt mesh; right and wrong requests to ~/detect. Every 25th answer (--check-every) is computed again.

  hpccd bench soak                          forty minutes, about a tenth of the machine
  hpccd bench soak --minutes 1 --rate 30

In the warm-up the node is held up (SIGSTOP) until what waits for it is as much as it can be, in its queues and in the
shared memory of the publisher: what it takes for that counts as its own from then on, whenever it comes.

Fails where the node ends, an answer is wrong, a counter does not add up, or its resident memory changes by more than
--memory-limit between the beginning (after --warm-up) and the end.
"""

from __future__ import annotations

import math
import os
import random
import signal
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from hpccd_ros.base.errors import UserError
from hpccd_ros.bench import command
from hpccd_ros.bench.report import table
from hpccd_ros.bench.report.results import Report
from hpccd_ros.frames.drops import Reason

NAMESPACE = "/soak"
HELD_UP_FRAMES = 60  # more than may wait for the node (input_depth, load.py)
PATIENCE = 300.0  # s, for what takes less than one on a machine that is not busy


def configure(parser):
    what = parser.add_argument_group("what is done")
    what.add_argument("--minutes", type=float, default=40.0, metavar="M", help="(default: %(default)s)")
    what.add_argument("--rate", type=float, default=10.0, metavar="HZ", help="frames a second (default: %(default)s)")
    what.add_argument("--restart-every", type=float, default=12.0, metavar="S",
                      help="life of the publisher that is restarted, s, on average (default: %(default)s)")
    what.add_argument("--warm-up", type=float, default=0.25, metavar="X",
                      help="share of the time before memory counts (default: %(default)s, ten of forty minutes)")
    what.add_argument("--memory-limit", type=float, default=1.0, metavar="PERCENT",
                      help="largest change of resident memory (default: %(default)s)")
    what.add_argument("--check-every", type=int, default=25, metavar="N",
                      help="compute every Nth answer again (default: %(default)s)")
    what.add_argument("--seed", type=int, default=0, metavar="N", help="of what is random (default: %(default)s)")
    command.output_options(parser)


def run(args) -> int:
    for name in ("minutes", "rate", "restart_every", "memory_limit", "check_every"):
        if not getattr(args, name) > 0:
            raise UserError(f"--{name.replace('_', '-')} {getattr(args, name)}: must be above 0")
    if not 0 <= args.warm_up < 0.8:
        raise UserError(f"--warm-up {args.warm_up}: a share of the time, from 0 to below 0.8")
    # A domain of its own, unless the user names one: strangers' meshes would be counted too.
    os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))
    report = Report("soak", {name: getattr(args, name) for name in
                             ("minutes", "rate", "restart_every", "warm_up", "memory_limit", "check_every", "seed")})
    with tempfile.TemporaryDirectory(prefix="hpccd-soak-") as folder:
        soak = _Soak(args, report, Path(folder))
        soak.run()
    return command.end(args, report)


class _Soak:
    def __init__(self, args, report: Report, folder: Path):
        self._args, self._report, self._folder = args, report, folder
        self._random = random.Random(args.seed)
        self._counter = folder / "strip-sent"
        self._counter.write_bytes(bytes(8))
        self._ends = {"ended": 0, "killed": 0}
        self._samples: list[tuple[float, float]] = []

    def run(self) -> None:
        import rclpy
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.signals import SignalHandlerOptions

        from hpccd_ros import scenes
        from hpccd_ros.bench.ros import node_process
        from hpccd_ros.bench.ros.soak import load
        from hpccd_ros.demo.children import Children
        from hpccd_ros.middleware import environment

        environment.prepare()
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
        node = rclpy.create_node("load", namespace=NAMESPACE, start_parameter_services=False)
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        scene = scenes.make(load.SCENE, load.SIZE)
        try:
            with Children(self._folder) as children:
                self._children = children
                self._load = load.SoakLoad(node, scene, self._args.rate, self._args.check_every)
                self._status = node_process.NodeStatus(node, NAMESPACE)
                self._executor = executor
                parameters = load.node_parameters(scene)
                self._node = node_process.start(children, self._folder, NAMESPACE, parameters)
                self._spin_until(self._load.heard, "the node was not heard")
                self._load.begin()
                self._spin_until(self._load.acknowledged, "the first frame was not acknowledged")
                self._strip = self._start_strip()
                last = self._stream()
                self._end_strip(kill=False)
                self._load.end(last)
                self._spin_until(self._settled, "not every message was accounted for", fail=False)
                self._check(children.end(self._node))
        finally:
            executor.shutdown()
            node.destroy_node()
            rclpy.try_shutdown()
            self._clean_shared_memory()

    def _spin_until(self, ready, what: str, fail: bool = True) -> None:
        deadline = time.monotonic() + PATIENCE
        while not ready():
            self._alive()
            if time.monotonic() > deadline:
                if fail:
                    raise UserError(f"{what} within {PATIENCE:.0f} s\n{self._node.last_words()}")
                self._report.failure(f"{what} within {PATIENCE:.0f} s")
                return
            self._executor.spin_once(timeout_sec=0.05)

    def _alive(self) -> None:
        if not self._node.running:
            code = self._node.process.returncode
            raise UserError(f"the node ended by itself, status {code}; its last words:\n{self._node.last_words(40)}")

    def _stream(self) -> int:
        """Returns the tick behind the last."""
        from hpccd_ros.bench.report.progress import bar

        rate, seconds = self._args.rate, 60 * self._args.minutes
        begin = time.monotonic()
        tick = int(time.time() * rate) + 1
        restart_at = begin + self._life()
        sample_at = row_at = begin
        hold_at = begin + seconds * self._args.warm_up / 2
        release_at = hold_at + HELD_UP_FRAMES / rate
        with bar("soak", round(seconds)) as progress:
            while (now := time.monotonic()) - begin < seconds:
                self._alive()
                left = tick / rate - time.time()
                if left > 0:
                    self._executor.spin_once(timeout_sec=left)
                else:
                    self._load.tick(tick)
                    tick = max(tick + 1, int(time.time() * rate))
                self._load.look_at_replies()
                if now >= hold_at:
                    self._node.process.send_signal(signal.SIGSTOP)
                    hold_at = math.inf
                if now >= release_at:
                    self._load.fill_segment()
                    self._node.process.send_signal(signal.SIGCONT)
                    release_at = math.inf
                if now >= restart_at:
                    self._end_strip(kill=self._random.random() < 1 / 3)
                    self._strip = self._start_strip()
                    restart_at = time.monotonic() + self._life()
                if now >= sample_at:
                    sample_at += 1.0
                    self._sample(now - begin)
                    progress.step(f"{self._samples[-1][1]:.1f} MB, {self._load.answers:,} answers")
                if now >= row_at:
                    row_at += max(1.0, seconds / 60)
                    self._row(now - begin)
        self._node.process.send_signal(signal.SIGCONT)
        return tick

    def _life(self) -> float:
        return self._args.restart_every * self._random.uniform(0.5, 1.5)

    def _strip_sent(self) -> int:
        (sent,) = struct.unpack("<Q", self._counter.read_bytes())
        return sent

    def _start_strip(self):
        self._sent_before_start = self._strip_sent()
        module = "hpccd_ros.bench.ros.soak.restarted_publisher"
        return self._children.start("strip", module, NAMESPACE, str(self._args.rate), str(self._counter))

    def _end_strip(self, kill: bool) -> None:
        self._children.check()
        self._ends["killed" if kill else "ended"] += 1
        signalled = signal.SIGKILL if kill else signal.SIGTERM
        expected = {-signal.SIGKILL if kill else 0}
        if self._strip_sent() == self._sent_before_start:  # Python may be loading yet, which knows no orderly end
            expected.add(-signalled)
        self._strip.process.send_signal(signalled)
        status = self._strip.process.wait(PATIENCE)
        if status not in expected:
            self._report.failure(f"the restarted publisher ended with status {status}: {self._strip.last_words()}")
        self._children.forget(self._strip)

    def _sample(self, second: float) -> None:
        from hpccd_ros.bench.ros.node_process import resident_mb

        self._samples.append((second, resident_mb(self._node.process.pid)))

    def _row(self, second: float) -> None:
        of_process = Path(f"/proc/{self._node.process.pid}")
        self._report.add(
            second=round(second),
            memory_mb=self._samples[-1][1] if self._samples else None,
            threads=len(list((of_process / "task").iterdir())),
            files=len(list((of_process / "fd").iterdir())),
            answers=self._load.answers,
            **self._status.counts(),
        )

    def _settled(self) -> bool:
        """Every message that was sent came, or is known to be lost; nothing waits; no request is open."""
        self._load.look_at_replies()
        accounted = not self._status.unaccounted() and not self._load.open_requests
        return accounted and not any(self._missing().values())

    def _missing(self) -> dict[str, int]:
        return {
            mesh: sent - self._status.count(f"received.{mesh}") - self._status.count(f"dropped.{mesh}.middleware")
            for mesh, sent in self._load.sent.items()
        }

    def _check(self, exit_status: int) -> None:
        load, status, failure = self._load, self._status, self._report.failure
        if exit_status != 0:
            failure(f"the node ended with status {exit_status} at SIGINT: {self._node.last_words()}")
        for text in load.wrong[:10]:
            failure(text)
        if not load.checked:
            failure("no answer was computed again: the time was too short to say anything of them")
        for mesh, missing in self._missing().items():
            if missing:
                failure(f"{mesh}: {missing} messages were sent, but neither received nor counted as lost")
        if status.unaccounted():
            failure(f"{status.unaccounted()} messages are not accounted for: {status.counts()}")
        # Topics are not ordered among one another: a wrong message that the next topology overtakes is old as well. Of
        # one cut off, in a burst with right ones, only the gap in the numbers tells.
        known_otherwise = sum(
            status.count(f"dropped.{load.victim}.{reason}") for reason in (Reason.OLD_TOPOLOGY, Reason.MIDDLEWARE)
        )
        for reason, sent in load.mischief.sent.items():
            counted = status.count(f"dropped.{load.victim}.{reason}")
            if counted > sent:
                failure(f"{sent} messages for {reason} were sent, the node counted {counted}")
            known_otherwise -= max(0, sent - counted)
        if known_otherwise < 0:
            failure(f"{-known_otherwise} wrong messages were not refused: {dict(load.mischief.sent)}")
        for reason, sent in load.mischief.refused.items():
            counted = status.count(f"topologies_refused.{load.victim}.{reason}")
            if counted > sent:
                failure(f"{sent} topologies for {reason} were sent, the node refused {counted}")
        strip_sent = self._strip_sent()
        strip_received = status.count("received.strip") + status.count("dropped.strip.middleware")
        if strip_received > strip_sent:
            failure(f"strip: {strip_received} messages counted, {strip_sent} sent")
        if status.count("failures", "detection"):
            failure(f"{status.count('failures', 'detection')} detections failed: {status.values['detection']}")
        change = self._memory(failure)
        sent = sum(load.sent.values()) + strip_sent
        table.show(
            f"soak: {self._args.minutes:g} minutes at {self._args.rate:g} frames a second",
            ["what", "count"],
            [
                ["vertex messages sent", sent],
                *([f"  {name}", number] for name, number in status.counts().items()),
                ["  of the restarted publisher, not received around its ends", strip_sent - strip_received],
                ["answers heard", load.answers],
                ["  cut to the earliest 5000", load.truncated],
                ["  computed again, equal", load.checked],
                ["changes of topology", load.topologies],
                ["wrong vertex messages, by kind as sent", sum(load.mischief.sent.values())],
                ["wrong topologies", sum(load.mischief.refused.values())],
                ["frames of a mesh unknown to the node", load.misspelt_sent],
                ["requests to ~/detect, all answered", load.requests],
                *([f"publisher {how} and started again", number] for how, number in self._ends.items()),
            ],
            caption=f"resident memory of the node: {change}",
        )
        self._report.add(
            second=round(60 * self._args.minutes), sent=sent, **status.counts(), answers=load.answers,
            checked=load.checked, topologies=load.topologies, requests=load.requests, replies=load.replies,
            **{f"publisher_{how}": number for how, number in self._ends.items()},
            wrong_sent={str(reason): n for reason, n in load.mischief.sent.items()},
            topologies_wrong={str(reason): n for reason, n in load.mischief.refused.items()},
        )  # fmt: skip

    def _memory(self, failure) -> str:
        """Medians of the first and the last tenth after the warm-up."""
        seconds, mb = np.array(self._samples).T
        after = mb[seconds >= self._args.warm_up * 60 * self._args.minutes]
        tenth = max(1, len(after) // 10)
        first, last = float(np.median(after[:tenth])), float(np.median(after[-tenth:]))
        change = 100 * (last / first - 1)
        text = f"{first:.1f} -> {last:.1f} MB ({change:+.2f} %), least {after.min():.1f}, most {after.max():.1f}"
        self._report.note(f"resident memory of the node: {text}")
        if abs(change) > self._args.memory_limit:
            failure(f"resident memory changed by more than {self._args.memory_limit:g} %: {text}")
        return text

    def _clean_shared_memory(self) -> None:
        # Killed publishers leave their segments behind; the tool of Fast DDS removes those without an owner.
        tool = Path(sys.prefix) / "bin" / "fastdds"
        if self._ends["killed"] and tool.is_file():
            subprocess.run([str(tool), "shm", "clean"], stdout=subprocess.DEVNULL, check=False)
