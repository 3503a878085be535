# SPDX-License-Identifier: Apache-2.0
"""Benchmarks of hpccd, run from a checkout: `PYTHONPATH=test python -m bench`."""
