# SPDX-License-Identifier: Apache-2.0
"""The node: its life cycle, and the wiring of what the other packages hold."""
