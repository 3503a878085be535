# SPDX-License-Identifier: Apache-2.0
"""The command `hpccd-check` of the core, as `hpccd check`."""

from hpccd_core.check import command
from hpccd_ros.base.errors import UserError

__doc__ = command.description("hpccd check")


def configure(parser):
    command.configure(parser)


def run(args) -> int:
    try:
        return command.run(args)
    except command.CheckError as error:
        raise UserError(str(error)) from error
