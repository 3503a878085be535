# SPDX-License-Identifier: Apache-2.0
"""Shared by all packages: errors, optional extras, version, quoting of untrusted text. No ROS."""
