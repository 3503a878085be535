# SPDX-License-Identifier: Apache-2.0
"""Errors that a command reports to its user as one line, without a traceback."""


class UserError(Exception):
    """What went wrong and what to do about it, in words for the person who typed the command."""
