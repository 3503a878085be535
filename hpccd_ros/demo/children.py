# SPDX-License-Identifier: Apache-2.0
"""Child processes that end with their parent, in reverse order: by SIGINT, then by SIGKILL."""

import ctypes
import dataclasses
import signal
import subprocess
import sys
import time
from pathlib import Path

from hpccd_ros.base.errors import UserError

PR_SET_PDEATHSIG = 1  # linux/prctl.h


@dataclasses.dataclass
class Child:
    name: str
    process: subprocess.Popen
    log: Path

    @property
    def running(self) -> bool:
        return self.process.poll() is None

    def has_printed(self, text: str) -> bool:
        """Whether its output contains `text` by now."""
        return text in self.log.read_text(encoding="utf-8", errors="replace")

    def last_words(self, lines: int = 15) -> str:
        return "\n".join(self.log.read_text(encoding="utf-8", errors="replace").splitlines()[-lines:])


class Children:
    """Starts Python modules with their output in `folder`/NAME.log. Leaving the context ends all of them."""

    GRACE = 60.0  # s for a child to end by itself, before it is killed

    def __init__(self, folder: Path):
        self._folder = folder
        self._all: list[Child] = []

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for child in reversed(self._all):
            self.end(child)

    def start(self, name: str, *arguments: str) -> Child:
        """Run `python -m ARGUMENTS`."""
        log = self._folder / f"{name}.log"
        with open(log, "w", encoding="utf-8") as output:
            process = subprocess.Popen(
                [sys.executable, "-m", *arguments],
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                # A session of its own: Ctrl-C reaches the parent alone, which ends the children in order.
                start_new_session=True,
                preexec_fn=_die_with_parent,
            )
        child = Child(name, process, log)
        self._all.append(child)
        return child

    def check(self) -> None:
        """Raise UserError with the last output of a child that has failed."""
        for child in self._all:
            if not child.running and child.process.returncode != 0:
                raise UserError(
                    f"the {child.name} ended with status {child.process.returncode}; its last output ({child.log}):\n"
                    f"{child.last_words()}"
                )

    def wait(self, ready, what: str, timeout: float) -> None:
        """Wait until `ready()`; raise UserError if a child fails or `timeout` seconds pass."""
        deadline = time.monotonic() + timeout
        while not ready():
            self.check()
            if time.monotonic() > deadline:
                logs = ", ".join(str(child.log) for child in self._all)
                raise UserError(f"{what} not within {timeout:.0f} s; see {logs}")
            time.sleep(0.05)

    def end(self, child: Child) -> int:
        """Send SIGINT, then SIGKILL if the child does not end; returns the exit status."""
        if child.running:
            child.process.send_signal(signal.SIGINT)
            try:
                child.process.wait(self.GRACE)
            except subprocess.TimeoutExpired:
                child.process.kill()
        return child.process.wait()

    def forget(self, child: Child) -> None:
        """Ignore a child that has ended in `check`."""
        self._all.remove(child)


def _die_with_parent():
    # Runs in the child before exec: even if the parent is killed, nothing is left behind. Linux only.
    prctl = getattr(ctypes.CDLL(None), "prctl", None)
    if prctl is not None:
        prctl(PR_SET_PDEATHSIG, signal.SIGTERM)
