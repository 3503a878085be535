# SPDX-License-Identifier: Apache-2.0
"""The table of the node's parameters, and what is made of it: descriptors, scene, documentation."""
