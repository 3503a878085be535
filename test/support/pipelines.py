# SPDX-License-Identifier: Apache-2.0
"""Joined outcomes of a pipeline."""

from hpccd_ros.frames.types import Outcome


def retried(pipeline):
    """All that comes of it, in one."""
    outcome = Outcome()
    for part in pipeline.retry():
        outcome += part
    return outcome


def reasons(outcome):
    return [(rejection.mesh, str(rejection.reason)) for rejection in outcome.rejections]
