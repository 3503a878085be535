# SPDX-License-Identifier: Apache-2.0
"""The node: its life cycle, and the connections between the other packages."""
