# SPDX-License-Identifier: Apache-2.0
"""Differential fuzzing of the core's queries against the exact oracle: `python -m fuzz --help`."""
