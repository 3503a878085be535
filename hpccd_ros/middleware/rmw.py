# SPDX-License-Identifier: Apache-2.0
"""The RMW implementation that the environment asks for. rcl ends the process, status 102, where it is another one."""

import os

from hpccd_ros.base import quoting
from hpccd_ros.base.errors import UserError
from hpccd_ros.middleware import environment

VARIABLE = "RMW_IMPLEMENTATION"


def check() -> None:
    """Call before rclpy is imported. Raises UserError for an implementation that is not installed."""
    asked = os.environ.get(VARIABLE)
    if not asked:
        return
    from ament_index_python.packages import PackageNotFoundError, get_package_prefix

    environment.find_shares_of_wheels()
    if not os.environ.get("AMENT_PREFIX_PATH"):
        return  # nobody says what is installed
    try:
        get_package_prefix(asked)
    except (PackageNotFoundError, ValueError) as error:  # ValueError: no name of a package
        raise UserError(
            f"{VARIABLE}: {quoting.quoted(asked)} is not installed here; unset it, or set it to rmw_fastrtps_cpp"
        ) from error
