# SPDX-License-Identifier: Apache-2.0
"""Many fast starts of the node: one process has loaded all modules, and each start is a fork of it.

Reads {name: [arguments]} as JSON from stdin, writes {name: [exit status, output]} as JSON. A node that becomes active
is stopped.
"""

import json
import os
import signal
import sys
import tempfile
import time
import traceback

from hpccd_ros.node import run

AT_ONCE = 4


def start(arguments, output):
    os.dup2(output.fileno(), 1)
    os.dup2(output.fileno(), 2)
    try:
        sys.argv = ["hpccd_node", *arguments]
        status = run.main()
    except BaseException:
        traceback.print_exc()
        status = 1
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)


def main():
    waiting = json.load(sys.stdin)
    results, running = {}, {}
    while waiting or running:
        while waiting and len(running) < AT_ONCE:
            name, arguments = waiting.popitem()
            output = tempfile.TemporaryFile("w+b")
            pid = os.fork()
            if pid == 0:
                start(arguments, output)
            running[pid] = (name, output)
        time.sleep(0.01)
        for pid, (name, output) in tuple(running.items()):
            ended, status = os.waitpid(pid, os.WNOHANG)
            text = os.pread(output.fileno(), 1 << 20, 0)
            if ended:
                results[name] = [os.waitstatus_to_exitcode(status), text.decode(errors="replace")]
                del running[pid]
            elif b"active: meshes" in text:
                os.kill(pid, signal.SIGINT)
    json.dump(results, sys.stdout)


if __name__ == "__main__":
    main()
