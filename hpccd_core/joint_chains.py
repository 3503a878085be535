# SPDX-License-Identifier: Apache-2.0
"""The arithmetic of joint chains, for hpccd_core.rigid.joints: poses of links, and how far they are off straight lines.

All arrays are float64 and C-contiguous. These objects never change, so threads may share them.
"""

from ._core import JointBounds, JointChain, JointKind, placed

__all__ = ["JointBounds", "JointChain", "JointKind", "placed"]
