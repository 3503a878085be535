# SPDX-License-Identifier: Apache-2.0
"""Errors about robots."""


class RobotError(ValueError):
    """An invalid URDF, SRDF or joint state; the text names the element and the remedy."""


class SemanticsError(RobotError):
    """The SRDF is invalid."""
