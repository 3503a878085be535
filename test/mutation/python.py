# SPDX-License-Identifier: Apache-2.0
"""Mutants of the Python packages: `python -m mutation python FOLDER` writes a copy with many small faults."""

import ast
from pathlib import Path

from .mutants import ROOT, Area, Mutant, choose, write


def area(count: int, files: str, *stages: str) -> Area:
    """`files`: paths in hpccd_ros, where a folder stands for its modules."""
    found: list[str] = []
    for file in files.split():
        path = ROOT / "hpccd_ros" / file
        modules = sorted(path.glob("*.py")) if path.is_dir() else [path]
        found += [str(module.relative_to(ROOT)) for module in modules if module.name != "__init__.py"]
    return Area(count, found, list(stages))


AREAS = {
    "stop": area(
        50,
        """node/stop_doubts.py node/stop_state.py node/stop_watch.py node/silence.py node/unknown_meshes.py
        node/joint_state_watch.py middleware/stop_signals.py client/stop.py detect/nearness.py detect/approach.py
        detect/interpenetration.py""",
        "test/node/test_stop_state.py test/detect",
        "test/client/test_stop_listener.py test/client/test_client_live.py test/middleware/test_stop_signals.py",
        "test/node/test_stop_model.py test/node/test_stop_inside.py test/node/test_stop_fails_safe.py",
        "test/node/test_node_stop.py test/node/test_node_robots.py test/node/test_node_speed_scale.py",
    ),
    "frames": area(
        40,
        "frames",
        "test/frames",
        "test/node/test_node_stream.py test/node/test_stop_model.py test/node/test_node_transforms.py",
        "test/replay test/node/test_node_overload.py test/node/test_node_whole_meshes.py",
    ),
    "replay": area(
        40,
        "replay bag/examine.py bag/recover.py bag/reader.py bag/mcap_file.py bag/mcap_index.py bag/mcap_records.py",
        "test/bag test/replay",
        "test/record test/commands",
    ),
}

COMPARISONS = {
    ast.Lt: ("<", "<=", ">"),
    ast.LtE: ("<=", "<", ">"),
    ast.Gt: (">", ">=", "<"),
    ast.GtE: (">=", ">", "<"),
    ast.Eq: ("==", "!="),
    ast.NotEq: ("!=", "=="),
    ast.Is: ("is", "is not"),
    ast.IsNot: ("is not", "is"),
    ast.In: ("in", "not in"),
    ast.NotIn: ("not in", "in"),
}
ARITHMETIC = {ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "+"), ast.FloorDiv: ("//", "*")}
LOGIC = {ast.And: ("and", "or"), ast.Or: ("or", "and")}
ON = '__import__("hpccd_mutant").on({n})'

SWITCH = '''"""Which mutant is on."""
import os
NUMBER = int(os.environ.get("HPCCD_MUTANT", "0"))
def on(number):
    return number == NUMBER
'''


class Finder(ast.NodeVisitor):
    """Finds the mutants of the functions of one module."""

    def __init__(self, area: str, name: str) -> None:
        self.area, self.name, self.found = area, name, []
        self.text = (ROOT / name).read_bytes()
        self.starts = [0]
        for line in self.text.splitlines(keepends=True):
            self.starts.append(self.starts[-1] + len(line))
        for node in ast.walk(ast.parse(self.text)):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                for statement in node.body:
                    self.visit(statement)

    def _bounds(self, node: ast.AST) -> tuple[int, int]:
        return self.starts[node.lineno - 1] + node.col_offset, self.starts[node.end_lineno - 1] + node.end_col_offset

    def _source(self, node: ast.AST) -> str:
        start, end = self._bounds(node)
        return self.text[start:end].decode()

    def _add(self, node: ast.AST, text: str, change: str) -> None:
        start, end = self._bounds(node)
        self.found.append(Mutant(self.area, self.name, node.lineno, start, end, text.replace("{N}", ON), change))

    def _swap(self, node: ast.AST, left: ast.AST, right: ast.AST, operators: tuple[str, ...]) -> None:
        a, b = self._source(left), self._source(right)
        for other in operators[1:]:
            # Braces of the source are not numbers of mutants, which `write` puts for {n} only.
            text = f"((({a}) {other} ({b})) if {{N}} else (({a}) {operators[0]} ({b})))"
            self._add(node, text, f"{operators[0]} to {other}: {self._source(node)}")

    def visit_Compare(self, node: ast.Compare) -> None:
        if len(node.ops) == 1:
            self._swap(node, node.left, node.comparators[0], COMPARISONS[type(node.ops[0])])
        self.generic_visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> None:
        if type(node.op) in ARITHMETIC and not isinstance(node.left, ast.Constant | ast.JoinedStr):
            self._swap(node, node.left, node.right, ARITHMETIC[type(node.op)])
        self.generic_visit(node)

    def visit_BoolOp(self, node: ast.BoolOp) -> None:
        operators, values = LOGIC[type(node.op)], [f"({self._source(value)})" for value in node.values]
        same, other = (f" {operator} ".join(values) for operator in operators)
        change = f"{operators[0]} to {operators[1]}: {self._source(node)}"
        self._add(node, f"(({other}) if {{N}} else ({same}))", change)
        self.generic_visit(node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:
        if isinstance(node.op, ast.Not):
            operand = self._source(node.operand)
            self._add(node, f"(bool({operand}) if {{N}} else not ({operand}))", f"not left out: {self._source(node)}")
        self.generic_visit(node)

    def visit_If(self, node: ast.If) -> None:
        test = self._source(node.test)
        self._add(node.test, f"(not ({test}) if {{N}} else ({test}))", f"negated: if {test}")
        self.generic_visit(node)

    def _leave_out(self, node: ast.stmt) -> None:
        source = self._source(node)
        self._add(node, f"if not {{N}}: {source}", f"left out: {source}")
        self.generic_visit(node)

    def visit_Expr(self, node: ast.Expr) -> None:
        if isinstance(node.value, ast.Call):
            self._leave_out(node)

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        self._leave_out(node)

    def visit_Assign(self, node: ast.Assign) -> None:
        if isinstance(node.targets[0], ast.Attribute | ast.Subscript):  # a name left out would be an error at once
            self._leave_out(node)
        else:
            self.generic_visit(node)

    def visit_JoinedStr(self, node: ast.JoinedStr) -> None:
        """Python 3.11 does not know where expressions in it begin."""


def mutants_of(area: str, name: str) -> list[Mutant]:
    """Return all mutants of one module."""
    return Finder(area, name).found


def prepare(folder: Path, seed: int) -> None:
    """Write a package with the mutants of AREAS."""
    write(folder, "hpccd_ros", dict(enumerate(choose(AREAS, mutants_of, seed), 1)))
    (folder / "hpccd_mutant.py").write_text(SWITCH)
