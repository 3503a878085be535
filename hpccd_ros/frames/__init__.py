# SPDX-License-Identifier: Apache-2.0
"""From checked messages of single meshes to frames of the scene: transforms, order, matching, queue. No ROS."""
