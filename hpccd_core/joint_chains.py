# SPDX-License-Identifier: Apache-2.0
"""The arithmetic of joint chains, for hpccd_ros.rigid.joints: where links are, and how far from straight lines they go.

All arrays are float64 and C-contiguous. What these hold never changes: threads may share them.
"""

from ._core import JointBounds, JointChain, JointKind, placed

__all__ = ["JointBounds", "JointChain", "JointKind", "placed"]
