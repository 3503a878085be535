# SPDX-License-Identifier: Apache-2.0
"""Rigid motions under the name by which the users of frames know them; they are those of hpccd_ros.rigid."""

from hpccd_ros.rigid.transform import IDENTITY, Rigid

__all__ = ["IDENTITY", "Rigid"]
