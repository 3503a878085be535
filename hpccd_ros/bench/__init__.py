# SPDX-License-Identifier: Apache-2.0
"""Time and accuracy of the core on a recording, a mesh or a generated scene."""
