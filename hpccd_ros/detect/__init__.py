# SPDX-License-Identifier: Apache-2.0
"""From frames of the scene to contacts: the core's scene, its detector, the thread that runs it. No ROS."""
