# SPDX-License-Identifier: Apache-2.0
"""Differential fuzzing of the elementary tests against the exact oracle: `python -m hpccd_core.fuzz --help`."""
