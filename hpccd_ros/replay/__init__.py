# SPDX-License-Identifier: Apache-2.0
"""Computes the contacts of a recording again, or publishes its topics."""
