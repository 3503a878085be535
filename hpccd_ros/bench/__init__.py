# SPDX-License-Identifier: Apache-2.0
"""Benchmarks: what is measured (one module each), and how it is timed, written down and drawn."""
