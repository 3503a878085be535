# SPDX-License-Identifier: Apache-2.0
"""Turns checked messages of single meshes into frames of the scene: transforms, order, matching, queue. No ROS."""
