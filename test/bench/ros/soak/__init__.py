# SPDX-License-Identifier: Apache-2.0
"""`python -m bench soak`: a node under mixed load for minutes or hours."""
