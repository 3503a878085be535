# SPDX-License-Identifier: Apache-2.0
"""Where the process of the node begins: told to end before it has begun, it ends as told.

Loading the rest takes half a second, in which Python's own response to SIGINT would be a traceback. Only the
interpreter's own start comes before these lines.
"""

import itertools
import os
import signal
import sys


def main() -> int:
    """`run.main`, or what --help and --version ask for, from the arguments of the process."""
    for number in (signal.SIGINT, signal.SIGTERM):
        # Nothing is there yet that would have to be ended; an exception may be caught in the middle of an import.
        signal.signal(number, lambda number, frame: os._exit(0))
    if (text := asked_for()) is not None:
        print(text, end="")
        return 0
    from hpccd_ros.base.errors import UserError
    from hpccd_ros.middleware import environment

    try:
        environment.check_rmw()  # before ROS is loaded
    except UserError as error:
        print(f"hpccd: {error}", file=sys.stderr)
        return 2
    from hpccd_ros.middleware import stop_signals
    from hpccd_ros.node import run

    try:
        return run.main()
    finally:
        stop_signals.ignore()


def asked_for() -> str | None:
    """The text that --help or --version, before --ros-args, asks for."""
    own = set(itertools.takewhile(lambda word: word != "--ros-args", sys.argv[1:]))
    if own & {"-h", "--help"}:
        from hpccd_ros.node import usage

        return usage.HELP
    if "--version" in own:
        from hpccd_ros.base.version import package_version

        return f"hpccd_node {package_version()}\n"
    return None


if __name__ == "__main__":
    sys.exit(main())
