# SPDX-License-Identifier: Apache-2.0
"""What rclpy and DDS need of any program here: environment, signals, QoS, names, messages. Nothing of our node."""
