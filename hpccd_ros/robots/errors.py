# SPDX-License-Identifier: Apache-2.0
"""What is wrong with a robot."""


class RobotError(ValueError):
    """A description, a semantic description or joint positions that cannot be used; the text names element and
    remedy."""


class SemanticsError(RobotError):
    """It is the semantic description, the SRDF, that cannot be used."""
