# SPDX-License-Identifier: Apache-2.0
"""One module for each `hpccd` command: its docstring is the help text, `configure` adds options, `run` does it."""
