# SPDX-License-Identifier: Apache-2.0
"""Benchmarks: what is measured of the core and of the node, and how it is written down and drawn."""
