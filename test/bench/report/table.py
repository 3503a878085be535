# SPDX-License-Identifier: Apache-2.0
"""Tables on standard output."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence

from rich.console import Console
from rich.table import Table

# In a file or a pipe a table must not be cut at the width of no terminal.
WIDTH = None if sys.stdout.isatty() else 160


def show(title: str, columns: Sequence[str], rows: Sequence[Sequence], caption: str = "") -> None:
    """Print rows; text to the left, numbers to the right; None as a dash."""
    table = Table(title=title, caption=caption or None, title_justify="left", caption_justify="left")
    for place, name in enumerate(columns):
        numbers = all(not isinstance(row[place], str) for row in rows)
        table.add_column(name, justify="right" if numbers else "left", overflow="fold")
    for row in rows:
        table.add_row(*map(text, row))
    Console(width=WIDTH, markup=False, highlight=False).print(table)


def text(value) -> str:
    """A number with three or more significant digits, counts in full."""
    if value is None:
        return "-"
    if isinstance(value, (str, bool)):
        return str(value)
    if float(value).is_integer() and abs(value) < 1e15:
        return f"{int(value):,}"
    if not math.isfinite(value):
        return str(value)
    if abs(value) >= 1000:
        return f"{value:,.0f}"
    if abs(value) >= 0.01:
        return f"{value:.3g}" if abs(value) < 100 else f"{value:.1f}"
    return f"{value:.1e}"
