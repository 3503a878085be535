# SPDX-License-Identifier: Apache-2.0
"""What every other package may use: errors, optional extras, version, how to quote what others sent. No ROS."""
