# SPDX-License-Identifier: Apache-2.0
"""Run `hpccd` commands in this process: starting Python takes longer than most of the commands in tests."""

import contextlib
import io
import traceback
from typing import NamedTuple

from hpccd_ros import cli


class Done(NamedTuple):
    """traceback: of an unexpected exception, or ""."""

    status: int | None
    out: str
    err: str
    traceback: str


def hpccd(*words) -> Done:
    """`hpccd WORDS`."""
    # As a terminal takes it: text that cannot be encoded is an error.
    out, err = (io.TextIOWrapper(io.BytesIO(), "utf-8", errors=errors) for errors in ("strict", "backslashreplace"))
    status, trace = None, ""
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            status = cli.main([str(word) for word in words])
        except SystemExit as ended:
            status = ended.code
        except BaseException:
            trace = traceback.format_exc()
    for stream in (out, err):
        stream.flush()
    texts = (stream.buffer.getvalue().decode("utf-8", "replace") for stream in (out, err))
    return Done(status, *texts, trace)
