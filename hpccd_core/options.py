# SPDX-License-Identifier: Apache-2.0
"""The words that options take, as types and as the values that arguments are checked against."""

from typing import Literal, get_args

Accuracy = Literal["fast", "balanced", "conservative", "exact"]
Backend = Literal["auto", "cpu", "hybrid", "gpu"]
Feature = Literal["vertex_face", "edge_edge"]
Method = Literal["default", "published", "naive", "front"]
Output = Literal["points", "normals", "closest", "weights", "directions"]
Refine = Literal["none", "neighbours"]
Report = Literal["all", "first", "any"]
Results = Literal["host", "device"]
Simd = Literal["auto", "scalar", "avx2", "avx512", "neon"]

ACCURACIES: tuple[str, ...] = get_args(Accuracy)
BACKENDS: tuple[str, ...] = get_args(Backend)
FEATURES: tuple[str, ...] = get_args(Feature)
METHODS: tuple[str, ...] = get_args(Method)
ALL_OUTPUTS: tuple[str, ...] = get_args(Output)
#: Those of contacts. Intersections have points and directions.
OUTPUTS: tuple[str, ...] = ALL_OUTPUTS[:4]
REFINE: tuple[str, ...] = get_args(Refine)
REPORTS: tuple[str, ...] = get_args(Report)
RESULTS: tuple[str, ...] = get_args(Results)
SIMD: tuple[str, ...] = get_args(Simd)
