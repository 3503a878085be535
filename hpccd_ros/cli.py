# SPDX-License-Identifier: Apache-2.0
"""The `hpccd` command: `hpccd <command> --help`.

Each command is a module `hpccd_ros.commands.<command>` with `configure(parser)` and `run(args) -> exit status`. Only
the module of the command that was asked for is imported: `hpccd --help` needs neither ROS nor the core.
"""

import argparse
import importlib
import signal
import sys

from hpccd_ros.base.errors import UserError
from hpccd_ros.base.quoting import begun, listed, nearest, quoted
from hpccd_ros.base.version import package_version
from hpccd_ros.commands.asking import node_named

COMMANDS = {
    "demo": "see it work: node, moving scene and recorder as separate processes, then a picture",
    "status": "show the state of a running node: rates, what was rejected, what is wrong",
    "echo": "print the messages of a topic",
    "param": "read and set the parameters of a running node",
    "lifecycle": "read and change the life-cycle state of a running node",
    "record": "record the meshes and contacts of a running node into an MCAP file",
    "replay": "compute a recording again and verify its contacts, or play it over DDS",
    "view": "draw recorded frames: shaded meshes with their contacts",
    "cut": "cut a part out of a recording that replays by itself",
    "check": "check a sequence of frames: what intersects, and what passes through",
    "doctor": "check a recording; save what is readable of one that was cut off",
    "scene": "generate, play or draw a deforming scene",
    "bench": "measure speed and latency on this machine",
    "info": "what is installed here: versions, backends, processor; what is wrong with a mesh file",
}

# Commands that always load rcl.
NEED_ROS = ("cut", "demo", "echo", "lifecycle", "param", "record", "replay", "status", "view")

EPILOG = """\
a first tour:
  hpccd demo                        records a cloth on a spinning ball and draws its worst frame
  hpccd replay hpccd-demo/demo.mcap computes it again and compares every contact
  hpccd info                        backends that can be used on this machine
  hpccd <command> --help            options and examples of one command

exit status: 0 done, 1 a check failed, 2 wrong use or unusable input, 130 interrupted
"""


def main(argv=None) -> int:
    """Run the command line `argv` (default: that of the process) and return the exit status."""
    argv = sys.argv[1:] if argv is None else list(argv)
    asked = next((word for word in argv if not word.startswith("-")), None)
    name = f"hpccd {asked}" if asked in COMMANDS else "hpccd"
    interrupts = _Interrupts()
    try:
        return _run(argv, asked)
    except UserError as error:
        print(f"{name}: {error}", file=sys.stderr)
        return 2
    except BrokenPipeError:
        # The reader of our output (`| head`) has gone: nothing left to say, and nothing to say it to.
        sys.stderr.close()
        return 0
    except (Exception, KeyboardInterrupt) as error:
        # An interrupted import of a library may come out as its own error.
        if interrupts.came or isinstance(error, KeyboardInterrupt):
            print(f"{name}: interrupted", file=sys.stderr)
            return 130
        if not isinstance(error, RuntimeError) or (why := _ros_start_failure(error)) is None:
            raise
        print(f"{name}: {why}", file=sys.stderr)
        return 2
    finally:
        interrupts.close()


class _Interrupted(KeyboardInterrupt):
    """A class of its own: once KeyboardInterrupt itself has left exec(), by which dataclasses are made, `python -m`
    ends by SIGINT instead of with the exit status."""


class _Interrupts:
    """Raises KeyboardInterrupt, as Python's handler of SIGINT does, and records the signal, for SIGTERM and SIGHUP too:
    by default these would end the process before it removes incomplete files. A signal that is ignored or has another
    handler keeps that."""

    DEFAULTS = {
        signal.SIGINT: signal.default_int_handler,
        signal.SIGTERM: signal.SIG_DFL,
        signal.SIGHUP: signal.SIG_DFL,
    }

    def __init__(self):
        self.came = False
        self._ours = {number: before for number, before in self.DEFAULTS.items() if signal.getsignal(number) is before}
        for number in self._ours:
            signal.signal(number, self._response)

    def close(self):
        for number, before in self._ours.items():
            signal.signal(number, before)

    def _response(self, number, frame):
        self.came = True
        raise _Interrupted


class _Parser(argparse.ArgumentParser):
    """Rejects unknown words with its own usage and the likely remedy. By default a subcommand's parser leaves them to
    that of `hpccd`, which knows neither the usage nor the options of the subcommand."""

    # From this similarity on (difflib, 0 .. 1) a word is taken for a misspelt one: 0.67 for `set` and `get`.
    NEAR = 0.7

    def __init__(self, **options):
        # No abbreviations: a script that says --acc would change its meaning when an option is added.
        super().__init__(**options, formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False)
        self._given = []

    def parse_known_args(self, args=None, namespace=None):
        self._given = args
        namespace, unknown = super().parse_known_args(args, namespace)
        if unknown:
            file = "-o" in self._option_string_actions and not unknown[0].startswith("-") and not node_named(unknown)
            meant = f"; did you mean -o {unknown[0]}?" if file else ""
            self.error(f"unrecognized arguments: {' '.join(unknown)}{meant}")
        return namespace, unknown

    def _check_value(self, action, value):
        if action.choices is not None and value not in action.choices:
            choices = list(action.choices)
            near = nearest(value, choices, self.NEAR) or next((word for word in self._given if word in choices), "")
            meant = f"; did you mean {near}?" if near else ""
            raise argparse.ArgumentError(
                action, f"invalid choice: {quoted(value)}; use one of {', '.join(choices)}{meant}"
            )

    def error(self, message):
        options = self._option_string_actions
        unknown = [word.partition("=")[0] for word in self._given if word.startswith("--")]
        near = listed(
            near
            for word in unknown
            if word not in options and (near := begun(word, options) or nearest(word, options, self.NEAR))
        )
        meant = f"; did you mean {near}?" if near else ""
        if "--node" in options and (node := node_named(self._given)):
            meant += f"; name the node with --node {node}"
        super().error(message + meant)


def _run(argv, asked) -> int:
    parser = _Parser(
        prog="hpccd",
        description="Continuous collision detection of deforming triangle meshes, with a ROS 2 node.",
        epilog=EPILOG,
    )
    parser.add_argument("-V", "--version", action="version", version=f"hpccd {package_version()}")
    subparsers = parser.add_subparsers(dest="command", metavar="<command>", required=True)
    run = None
    for name, summary in COMMANDS.items():
        subparser = subparsers.add_parser(name, help=summary)
        if name == asked:
            module = importlib.import_module(f"hpccd_ros.commands.{name}")
            subparser.description = module.__doc__
            module.configure(subparser)
            run = module.run
    args = parser.parse_args(argv)
    if hasattr(sys.stdout, "reconfigure"):
        sys.stdout.reconfigure(errors="backslashreplace")  # names of files and topics may be no text of the terminal's
    if asked in NEED_ROS or getattr(args, "publish", False):
        from hpccd_ros.middleware import environment

        environment.check_rmw()  # before ROS is loaded
    return run(args) or 0


def _ros_start_failure(error) -> str | None:
    if "rclpy" not in sys.modules:
        return None  # not of ROS; most commands need none
    from hpccd_ros.middleware import ros_start

    rejected = ros_start.start_failure(error)
    return rejected and rejected[1]


if __name__ == "__main__":
    sys.exit(main())
