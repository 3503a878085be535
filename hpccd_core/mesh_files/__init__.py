# SPDX-License-Identifier: Apache-2.0
"""Readers of mesh files: vertices and triangles, numbered as in the file."""
