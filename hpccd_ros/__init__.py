# SPDX-License-Identifier: Apache-2.0
"""ROS 2 side of hpccd: node, recorder, replay and the `hpccd` command. The core is `hpccd_core`."""
