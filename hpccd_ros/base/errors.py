# SPDX-License-Identifier: Apache-2.0
"""Errors that a command reports to its user as one line, without a traceback."""


class UserError(Exception):
    """A problem and its remedy, as a sentence for the user of a command."""
