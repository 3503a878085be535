# SPDX-License-Identifier: Apache-2.0
"""The page of the parameters: made from the table, complete, and as it lies in docs/."""

from pathlib import Path

from hpccd_ros.params import documentation
from hpccd_ros.params.table import MESH_ROWS, NODE_ROWS, PAIR_ROWS, PLANE_ROWS

PAGE = Path(__file__).resolve().parents[2] / "docs" / "parameters.md"


def test_page_names_every_parameter_once():
    page = documentation.page()
    of_parts = [f"mesh.NAME.{row.name}" for row in MESH_ROWS] + [f"pairs.NAME.{row.name}" for row in PAIR_ROWS]
    of_parts += [f"plane.NAME.{row.name}" for row in PLANE_ROWS]
    for name in [row.name for row in NODE_ROWS] + of_parts:
        assert page.count(f"\n| `{name}` |") == 1, name


def test_page_in_docs_is_up_to_date():
    assert PAGE.read_text() == documentation.page(), "python -m hpccd_ros.params.documentation > docs/parameters.md"
