# SPDX-License-Identifier: Apache-2.0
"""A request to the service ``~/detect`` as a goal of the action of that name."""

from hpccd.action import Detect as DetectAction
from hpccd.srv import Detect


def goal_from_request(request: Detect.Request) -> DetectAction.Goal:
    """The goal that asks for the same; what it refers to is the request's own.

    Its result has the fields of the service's response: functions of this package that read one read the other.
    Raises TypeError for what is no request.
    """
    if not isinstance(request, Detect.Request):
        raise TypeError(f"request: expected hpccd.srv.Detect.Request, got {type(request).__name__}")
    return DetectAction.Goal(**{name: getattr(request, name) for name in request.get_fields_and_field_types()})
