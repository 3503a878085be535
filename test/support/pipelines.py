# SPDX-License-Identifier: Apache-2.0
"""What comes of a pipeline, put together."""

from hpccd_ros.frames.types import Outcome


def retried(pipeline):
    """All that comes of it, in one."""
    outcome = Outcome()
    for part in pipeline.retry():
        outcome += part
    return outcome


def reasons(outcome):
    return [(refusal.mesh, str(refusal.reason)) for refusal in outcome.refusals]
