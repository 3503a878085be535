# SPDX-License-Identifier: Apache-2.0
"""What is measured of the node over DDS: latency, rates, and how it lasts under load."""
