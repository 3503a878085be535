# SPDX-License-Identifier: Apache-2.0
"""Recordings: MCAP files in rosbag2's layout."""
