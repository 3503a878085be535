# SPDX-License-Identifier: Apache-2.0
"""hpccd_core/_core.pyi names what the compiled module has, with the same arguments.

What pybind11 says of the module, to rewrite the stub from: .venv/bin/stubgen -m hpccd_core._core -o build/stubs
"""

import ast
import subprocess
import sys

import pytest
from sources import ROOT

STUB = (ROOT / "hpccd_core" / "_core.pyi").read_text()

pytest.importorskip("mypy", reason="mypy comes with the extra lint")


@pytest.fixture(scope="module")
def compiled(tmp_path_factory):
    """Stub text made of the compiled module."""
    folder = tmp_path_factory.mktemp("stub")
    command = [sys.executable, "-c", "from mypy.stubgen import main; main()", "-m", "hpccd_core._core", "-o", folder]
    done = subprocess.run(command, cwd=ROOT, text=True, capture_output=True, timeout=100)
    assert done.returncode == 0, done.stdout + done.stderr
    return (folder / "hpccd_core" / "_core.pyi").read_text()


def described(text: str) -> dict[str, str]:
    """{name: what it is} of all public functions, classes and members in the text of a stub."""
    classes = {node.name: node for node in ast.parse(text).body if isinstance(node, ast.ClassDef)}
    found = {}
    for node in ast.parse(text).body:
        if isinstance(node, ast.FunctionDef):
            found[node.name] = kind_of(node)
        elif isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            bases = [base.id for base in node.bases]
            shared = [member for base in bases if base in classes for member in classes[base].body]
            found[node.name] = f"class of {[base for base in bases if base not in classes]}"
            for member in node.body + shared:
                if (name := name_of(member)) and (not name.startswith("_") or name == "__init__"):
                    found[f"{node.name}.{name}"] = kind_of(member)
    return found


def name_of(member: ast.stmt) -> str:
    target = member.target if isinstance(member, ast.AnnAssign) else member
    return getattr(target, "name", getattr(target, "id", ""))


def kind_of(node: ast.stmt) -> str:
    if isinstance(node, ast.AnnAssign):
        return "value"
    if any(isinstance(name, ast.Name) and name.id == "property" for name in node.decorator_list):
        return "property"
    given = ast.unparse(node.args) if node.args.defaults else ""
    return f"function of {[argument.arg for argument in node.args.args]}{' with defaults' if given else ''}"


def test_the_stub_is_of_the_compiled_module(compiled):
    assert described(STUB) == described(compiled)


@pytest.mark.parametrize(
    "ours, other",
    [
        ("def gpu_status() -> GpuStatus: ...", ""),
        ("def cancel(self)", "def end(self)"),
        ("def gpu_fail_after(calls: int)", "def gpu_fail_after(after: int)"),
        ("def assign(self, pointer: int, bytes: int)", "def assign(self, pointer: int)"),
        ("avx2: ClassVar[Simd]", ""),
        ("class Cancelled(RuntimeError)", "class Cancelled(ValueError)"),
    ],
)
def test_a_difference_is_seen(compiled, ours, other):
    assert STUB.count(ours) == 1
    assert described(STUB.replace(ours, other)) != described(compiled)
