# SPDX-License-Identifier: Apache-2.0
"""What Kim et al. 2009 report, to stand beside what is measured here."""

# Table 1: ms a step on their scenes, with four cores (Intel i7, 3.2 GHz) and two GPUs (GTX 285); by the name of the
# generated scene of that size and character.
TABLE_1_MS = {"cloth-ball-like": 23.2, "breaking-like": 53.6, "n-body-like-lr": 6.8, "n-body-like-hr": 53.8}
