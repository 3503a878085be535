# SPDX-License-Identifier: Apache-2.0
"""Check a sequence of frames: which frames intersect, which steps pass through, and where."""

from .analysis import Options, check_part
from .report import FrameResult, Report, StepResult

__all__ = ["FrameResult", "Options", "Report", "StepResult", "check_part"]
