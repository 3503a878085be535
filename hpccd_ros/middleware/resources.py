# SPDX-License-Identifier: Apache-2.0
"""Paths of resources: a plain path, or a URI with package:// or file:// as in ROS."""

import re
from pathlib import Path, PurePosixPath
from urllib.parse import unquote

from ament_index_python.packages import PackageNotFoundError, get_package_share_directory

from hpccd_core import MeshFileError
from hpccd_ros.base.quoting import quoted, shortened
from hpccd_ros.middleware import environment

_SCHEME = re.compile(r"([A-Za-z][A-Za-z0-9+.-]*)://(.*)", re.DOTALL)
_PACKAGE = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")


def local_path(resource: str) -> str:
    """The path of a file on this machine. package://PACKAGE/PATH: in the share folder of that package, and only there.

    Percent-encoding in a URI is decoded. Raises MeshFileError naming the resource and the remedy.
    """
    if (parts := _SCHEME.fullmatch(resource)) is None:
        return resource
    scheme, rest = parts[1].lower(), unquote(parts[2])
    if scheme == "file":
        host, slash, path = rest.partition("/")
        if host not in ("", "localhost") or not slash:
            raise MeshFileError(f"{shortened(resource)}: names another machine or none at all; write file:///PATH")
        return f"/{path}"
    if scheme == "package":
        return _in_package(resource, *rest.partition("/")[::2])
    raise MeshFileError(f"{shortened(resource)}: scheme {quoted(scheme)}; use package://, file:// or a path")


def _in_package(resource: str, package: str, path: str) -> str:
    shown = shortened(resource)
    if not _PACKAGE.fullmatch(package) or not path:
        raise MeshFileError(f"{shown}: write package://PACKAGE/PATH, with the path in the package's share folder")
    if ".." in PurePosixPath(path).parts or path.startswith("/"):
        raise MeshFileError(f"{shown}: leads out of the share folder of {package}; give a path within it, without ..")
    environment.find_shares_of_wheels()
    try:
        return str(Path(get_package_share_directory(package)) / path)
    except PackageNotFoundError as error:
        raise MeshFileError(
            f"{shown}: no package {quoted(package)} is installed (AMENT_PREFIX_PATH lists the searched folders); "
            "install it and source its workspace, or give a path"
        ) from error
