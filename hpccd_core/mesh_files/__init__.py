# SPDX-License-Identifier: Apache-2.0
"""Vertices and triangles of mesh files, numbered as in the file."""
