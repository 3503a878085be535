# SPDX-License-Identifier: Apache-2.0
"""`hpccd demo`: everything once, as separate processes over DDS."""
