# SPDX-License-Identifier: Apache-2.0
"""Environment, signals, QoS, names and messages for every program that uses rclpy and DDS. Independent of the node."""
