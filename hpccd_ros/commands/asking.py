# SPDX-License-Identifier: Apache-2.0
"""The options --node and --wait of commands that ask running nodes."""

import math
import re
from collections.abc import Sequence

from hpccd_ros.base.errors import UserError

_FULL_NAME = re.compile(r"(/[A-Za-z_]\w*)+")


def add_node(parser) -> None:
    parser.add_argument("--node", default="", metavar="NODE", help="full name (default: the only hpccd node)")


def node_named(words: Sequence[str]) -> str:
    """The first of ``words`` that has the form of a node's full name, and is not the value of an option; "": none."""
    pairs = zip(["", *words], words, strict=False)
    return next((word for before, word in pairs if before[:1] != "-" and _FULL_NAME.fullmatch(word)), "")


def add_wait(parser, what: str) -> None:
    """what: is waited for, in words."""
    parser.add_argument(
        "--wait", type=float, default=5.0, metavar="S", help=f"how long to wait for {what} (default: %(default)s)"
    )


def check_wait(args) -> None:
    """Raises UserError."""
    if not 0 <= args.wait < math.inf:
        raise UserError(f"--wait {args.wait}: must be a number of seconds, not negative")
