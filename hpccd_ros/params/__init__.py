# SPDX-License-Identifier: Apache-2.0
"""The table of the node's parameters, and its uses: descriptors, scene, documentation."""
