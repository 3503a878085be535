# SPDX-License-Identifier: Apache-2.0
"""Recordings: MCAP files as rosbag2 writes and reads them."""
