# SPDX-License-Identifier: Apache-2.0
"""Computes contacts from frames of the scene: the core's scene, its detector, the thread that runs it. No ROS."""
