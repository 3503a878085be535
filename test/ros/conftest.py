# SPDX-License-Identifier: Apache-2.0
"""A DDS domain of its own for the test run, shared with the processes that it starts."""

import os

# Domains 0..101 are safe on Linux whatever the ephemeral port range is.
os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))
