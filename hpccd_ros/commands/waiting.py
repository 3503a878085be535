# SPDX-License-Identifier: Apache-2.0
"""The option --wait of commands that ask running nodes."""

import math

from hpccd_ros.base.errors import UserError


def add_wait(parser, what: str) -> None:
    """what: is waited for, in words."""
    parser.add_argument(
        "--wait", type=float, default=5.0, metavar="S", help=f"how long to wait for {what} (default: %(default)s)"
    )


def check_wait(args) -> None:
    """Raises UserError."""
    if not 0 <= args.wait < math.inf:
        raise UserError(f"--wait {args.wait}: must be a number of seconds, not negative")
