# SPDX-License-Identifier: Apache-2.0
"""Start nodes as forks of one process that has loaded all modules: 0.3 s of CPU time each instead of 0.9.

As a program: reads one JSON object per line from stdin ({"arguments", "output", "environment"}), writes the process id
of the node, and its status to the file OUTPUT.status when it has ended. Python's finalization is skipped, because a
fork crashes in the static destructors of DDS. Tests of start and exit use a new Python process.
"""

import atexit
import contextlib
import json
import os
import select
import signal
import subprocess
import sys
import threading
import time
import traceback
from pathlib import Path

import hpccd_ros

ROOT = Path(hpccd_ros.__file__).resolve().parents[1]
ENDING = {signal.SIGINT, signal.SIGTERM}


class ForkedNode:
    """A node's process, with the methods of subprocess.Popen that tests use."""

    returncode: int | None = None

    def __init__(self, arguments: list[str], output: Path) -> None:
        self._status = Path(f"{output}.status")
        self._status.unlink(missing_ok=True)
        request = {"arguments": arguments, "output": str(output), "environment": dict(os.environ)}
        self.pid = int(_ask(json.dumps(request)))

    def poll(self) -> int | None:
        if self.returncode is None and self._status.exists():
            self.returncode = int(self._status.read_text())
        if self.returncode is None and _server is not None and _server.poll() is not None:
            raise RuntimeError(f"the process that starts nodes ended ({_server.returncode}): the status is unknown")
        return self.returncode

    def wait(self, timeout: float | None = None) -> int:
        deadline = time.monotonic() + (float("inf") if timeout is None else timeout)
        while (status := self.poll()) is None:
            if time.monotonic() > deadline:
                raise subprocess.TimeoutExpired("hpccd_node", timeout or 0.0)
            time.sleep(0.005)
        return status

    def send_signal(self, number: int) -> None:
        if self.poll() is None:
            with contextlib.suppress(ProcessLookupError):  # it has ended meanwhile
                os.kill(self.pid, number)

    def kill(self) -> None:
        self.send_signal(signal.SIGKILL)


_server: subprocess.Popen | None = None
_one_at_a_time = threading.Lock()


def _ask(request: str) -> str:
    global _server
    with _one_at_a_time:
        if _server is None or _server.poll() is not None:
            path = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
            _server = subprocess.Popen(
                [sys.executable, str(Path(__file__).resolve())],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
                cwd=ROOT,
                env={**os.environ, "PYTHONPATH": path},
                start_new_session=True,  # Ctrl-C at pytest is not for it
            )
            atexit.register(_server.stdin.close)  # it ends with its input
        _server.stdin.write(request + "\n")
        _server.stdin.flush()
        return _server.stdout.readline()


def _serve() -> dict | None:
    """The request that this process serves as the node; None at the end of the input."""
    waiting: dict[int, Path] = {}
    wake, woken = os.pipe()
    os.set_blocking(woken, False)
    signal.set_wakeup_fd(woken)
    signal.signal(signal.SIGCHLD, lambda number, frame: None)
    text = b""
    while True:
        ready, _, _ = select.select([0, wake], [], [])
        if wake in ready:
            os.read(wake, 1 << 16)
            for pid in tuple(waiting):
                ended, status = os.waitpid(pid, os.WNOHANG)
                if ended:
                    file = waiting.pop(pid)
                    with contextlib.suppress(OSError):  # the folder of a test that is over may be gone
                        part = Path(f"{file}.part")
                        part.write_text(str(os.waitstatus_to_exitcode(status)))
                        part.rename(file)
        if 0 in ready:
            if not (more := os.read(0, 1 << 16)):
                return None
            text += more
            *lines, text = text.split(b"\n")
            for line in lines:
                request = json.loads(line)
                # Until its own handlers are set a signal waits: Python's would end in a traceback.
                signal.pthread_sigmask(signal.SIG_BLOCK, ENDING)
                if (pid := os.fork()) == 0:
                    signal.set_wakeup_fd(-1)
                    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
                    for number in ENDING:  # as start.main does
                        signal.signal(number, lambda number, frame: os._exit(0))
                    signal.pthread_sigmask(signal.SIG_UNBLOCK, ENDING)
                    os.close(wake), os.close(woken)
                    return request
                signal.pthread_sigmask(signal.SIG_UNBLOCK, ENDING)
                waiting[pid] = Path(f"{request['output']}.status")
                os.write(1, f"{pid}\n".encode())


def main() -> int:
    # Loaded here, once: what a node imports before it runs.
    import hpccd_ros.middleware.environment
    import hpccd_ros.middleware.stop_signals
    import hpccd_ros.node.run  # noqa: F401
    from hpccd_ros.node import start

    if (request := _serve()) is None:
        return 0
    output = os.open(request["output"], os.O_WRONLY | os.O_APPEND)
    nothing = os.open(os.devnull, os.O_RDONLY)
    for place, file in ((0, nothing), (1, output), (2, output)):
        os.dup2(file, place)
    os.environ.clear()
    os.environ.update(request["environment"])
    sys.argv = ["hpccd_node", *request["arguments"]]
    try:
        status = start.main()
    except BaseException:
        traceback.print_exc()
        status = 1
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)


if __name__ == "__main__":
    sys.exit(main())
