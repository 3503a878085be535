# SPDX-License-Identifier: Apache-2.0
"""Pictures of meshes with their contacts, rendered on the CPU into a file: no display, no graphics driver."""
