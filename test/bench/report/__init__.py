# SPDX-License-Identifier: Apache-2.0
"""What comes of a measurement: result files, tables, pictures and the page docs/performance.md."""
