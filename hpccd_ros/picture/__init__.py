# SPDX-License-Identifier: Apache-2.0
"""Pictures, pages and Rerun files of recordings and scenes."""
