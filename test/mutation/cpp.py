# SPDX-License-Identifier: Apache-2.0
"""Mutants of the C++ core: `python -m mutation cpp FOLDER` writes its sources with many small faults, and builds them.

libclang finds expressions and statements; it belongs to the extra `docs`. The compiler has the last word: mutants on
lines that it rejects (in a constant expression, for example) are left out, and the rest is built again.
"""

import re
import shutil
import subprocess
import sys
from pathlib import Path

from clang import cindex

from .mutants import ROOT, Area, Mutant, choose, write

CORE = ROOT / "hpccd_core"
Kind = cindex.CursorKind


def area(count: int, files: str) -> Area:
    return Area(count, [f"hpccd_core/src/{file}" for file in files.split()], ["C++", "test/core"])


AREAS = {
    "filters": area(
        80,
        """bvh/kdop.h bvh/box.h bvh/motion_box.h bvh/motion_bounds.h bvh/motion_bounds.cpp elementary/kdop_filter.inl
        elementary/kdop_filter.h elementary/kdop_lanes.inl elementary/batch.inl elementary/intersection_batch.inl
        elementary/distance/distance_batch.inl elementary/distance/margins.h elementary/distance/separation_test.h
        elementary/tolerance_test.h elementary/coplanarity.h elementary/coincidence.h elementary/roots.h
        elementary/half_space.cpp scene/feature_filter.cpp scene/pair_rules.cpp""",
    ),
    "traversal": area(
        80,
        """bvh/build.cpp bvh/refit.cpp bvh/split.cpp bvh/tree.h traverse/contact_search.cpp traverse/far_pairs.inl
        traverse/fine_boxes.cpp traverse/leaf_edge_faces.inl traverse/leaf_features.inl traverse/leaf_pairs.inl
        traverse/corners_against.inl traverse/less_excess.cpp traverse/nearest_pairs.cpp traverse/pair_pool.cpp
        traverse/search.h traverse/snapshot_search.cpp traverse/tasks.h traverse/walk.inl traverse/worker.cpp
        traverse/worker.h paper/front_based.cpp paper/scheduling.cpp""",
    ),
    "sorting": area(
        30,
        """contacts/order.cpp contacts/order.h contacts/canonical.cpp contacts/worlds.cpp contacts/parts.cpp
        contacts/places.cpp contacts/gaps.cpp""",
    ),
}

OPERATORS = {
    "<": ("<=", ">"),
    "<=": ("<", ">"),
    ">": (">=", "<"),
    ">=": (">", "<"),
    "==": ("!=",),
    "!=": ("==",),
    "&&": ("||",),
    "||": ("&&",),
    "&": ("|",),
    "|": ("&",),
    "+": ("-",),
    "-": ("+",),
    "*": ("+",),
    "<<": (">>",),
    ">>": ("<<",),
}
FLAGS = f"-x c++ -std=c++20 -mavx2 -mbmi -DHPCCD_X86 -I{CORE}/include -I{CORE}/src".split()

SWITCH = """// Included before every source: which mutant is on.
#pragma once
#include <cstdlib>
inline const int hpccd_mutant = std::getenv("HPCCD_MUTANT") ? std::atoi(std::getenv("HPCCD_MUTANT")) : 0;
#define HPCCD_MUTANT(n) (hpccd_mutant == (n))
"""

NOT_AT_RUN_TIME = {Kind.CASE_STMT, Kind.TEMPLATE_TYPE_PARAMETER, Kind.TEMPLATE_NON_TYPE_PARAMETER, Kind.PARM_DECL}


def including(path: Path) -> str:
    """Return a program that includes the file: an .inl through a source that is compiled for AVX2, if there is one."""
    if path.suffix != ".inl":
        return f'#include "{path}"\n'
    sources = sorted(path.parent.glob("*.cpp"), key=lambda source: not source.stem.endswith("_avx2"))
    users = [source for source in sources if f"{path.stem}.inl" in source.read_text()]
    chosen = users[:1] or [source for source in sources if source.stem.endswith("_avx2")]
    return "".join(f'#include "{source}"\n' for source in chosen)


def mutants_of(area: str, name: str) -> list[Mutant]:
    """Return all mutants of one file."""
    path = ROOT / name
    unit = cindex.Index.create().parse("all.cpp", FLAGS, unsaved_files=[("all.cpp", including(path))])
    text = path.read_bytes()
    found: list[Mutant] = []

    def source(start: int, end: int) -> str:
        return text[start:end].decode()

    def add(start: int, end: int, replacement: str, change: str) -> None:
        if "#" not in source(start, end) and "//" not in source(start, end):
            line = text.count(b"\n", 0, start) + 1
            found.append(Mutant(area, name, line, start, end, replacement, change))

    def operands(cursor: cindex.Cursor) -> None:
        children = list(cursor.get_children())
        if len(children) != 2:
            return
        (a0, a1), (b0, b1) = ((c.extent.start.offset, c.extent.end.offset) for c in children)
        operator = source(a1, b0).strip()
        for other in OPERATORS.get(operator, ()):
            a, b = source(a0, a1), source(b0, b1)
            replacement = f"(HPCCD_MUTANT({{n}}) ? ({a} {other} {b}) : ({a} {operator} {b}))"
            add(a0, b1, replacement, f"{operator} to {other}: {a} {operator} {b}")

    def statement(cursor: cindex.Cursor) -> None:
        start, end = cursor.extent.start.offset, cursor.extent.end.offset
        if text[end : end + 1] == b";":
            add(start, end, f"if (!HPCCD_MUTANT({{n}})) {source(start, end)}", f"left out: {source(start, end)}")

    def condition(cursor: cindex.Cursor) -> None:
        first = next(cursor.get_children())
        start, end = first.extent.start.offset, first.extent.end.offset
        header = source(cursor.extent.start.offset, start)
        if first.kind.is_expression() and re.fullmatch(r"if\s*\(", header):
            expression = source(start, end)
            if text[end : end + 1] == b")":
                replacement = f"(HPCCD_MUTANT({{n}}) ? !({expression}) : bool({expression}))"
                add(start, end, replacement, f"negated: if ({expression})")

    def visit(cursor: cindex.Cursor, in_body: bool) -> None:
        place = cursor.extent.start
        if cursor.kind != Kind.TRANSLATION_UNIT and (place.file is None or Path(place.file.name) != path):
            if cursor.kind not in (Kind.NAMESPACE, Kind.LINKAGE_SPEC):
                return
        if cursor.kind in NOT_AT_RUN_TIME or "static_assert" in str(cursor.kind).lower():
            return
        if cursor.kind == Kind.DECL_STMT and "constexpr" in source(place.offset, place.offset + 20):
            return
        if in_body:
            if cursor.kind == Kind.BINARY_OPERATOR:
                operands(cursor)
            elif cursor.kind == Kind.IF_STMT:
                condition(cursor)
        is_block = cursor.kind == Kind.COMPOUND_STMT
        for child in cursor.get_children():
            if is_block and child.kind in (
                Kind.CALL_EXPR,
                Kind.COMPOUND_ASSIGNMENT_OPERATOR,
                Kind.UNARY_OPERATOR,
                Kind.BINARY_OPERATOR,
            ):
                statement(child)
            visit(child, in_body or is_block)

    visit(unit.cursor, False)
    return sorted(set(found))


def build(folder: Path) -> str:
    """Compile the C++ tests and the Python module; return the errors of the compiler."""
    tree, python = folder / "build", sys.executable
    subprocess.run(
        ["cmake", "-S", folder / "hpccd_core", "-B", tree, "-G", "Ninja", "-DHPCCD_CUDA=OFF", "-DHPCCD_PYTHON=ON"]
        + ["-DHPCCD_BUILD_TESTS=ON", f"-DGTest_DIR={ROOT}/cmake/gtest", f"-DCMAKE_CXX_FLAGS=-include {folder}/mutant.h"]
        + [f"-DHPCCD_GTEST_SOURCE={sys.prefix}/src/gtest_vendor"]
        + [f"-DPython_EXECUTABLE={python}", f"-DPython3_EXECUTABLE={python}"],
        check=True,
        stdout=subprocess.DEVNULL,
    )
    command = ["cmake", "--build", tree, "--target", "hpccd_core_tests", "_core", "--", "-k", "0"]
    built = subprocess.run(command, capture_output=True, text=True)
    return "" if built.returncode == 0 else built.stdout + built.stderr


def prepare(folder: Path, seed: int) -> None:
    """Write and build a core with the mutants of AREAS."""
    mutants = dict(enumerate(choose(AREAS, mutants_of, seed), 1))
    while True:
        write(folder, "hpccd_core", mutants)
        (folder / "mutant.h").write_text(SWITCH)
        output = build(folder)
        if not output:
            break
        errors = set(re.findall(r"(hpccd_core/src/\S+?):(\d+):\d+: error", output))
        # The compiler names the place of a constant expression in a note.
        errors = errors or set(re.findall(r"(hpccd_core/src/\S+?):(\d+):\d+: ", output))
        rejected = [
            n
            for n, m in mutants.items()
            if any(m.file == file and 0 <= int(line) - m.line <= m.text.count("\n") for file, line in errors)
        ]
        if not rejected:
            raise SystemExit(output)
        print(f"left out, rejected by the compiler: {rejected}")
        for n in rejected:
            del mutants[n]
    for module in (folder / "build").glob("_core*.so"):
        shutil.copy(module, folder / "hpccd_core")
