# SPDX-License-Identifier: Apache-2.0
"""What is measured of the core: time, scaling, memory and accuracy, on every backend, and a peer beside it."""
