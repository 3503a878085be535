# SPDX-License-Identifier: Apache-2.0
"""The Python reference: examples run, sections are there, and help() is short."""

import doctest
import importlib
import inspect
import pkgutil
import pydoc
import re

import pytest

import hpccd_core as hc
from hpccd_core import rigid

MODULES = ["hpccd_core", *(m.name for m in pkgutil.walk_packages(hc.__path__, "hpccd_core.") if "._core" not in m.name)]
PUBLIC = {name: getattr(hc, name) for name in hc.__all__ if not name.startswith("_")}
PUBLIC |= {name: getattr(rigid, name) for name in rigid.__all__ if inspect.isfunction(getattr(rigid, name))}


EXTRAS = {
    "hpccd_core.torch": "torch",
    "hpccd_core.jax": "jax",
    "hpccd_core.mujoco": "mujoco",
    "hpccd_core.warp": "newton",
    "hpccd_core.usd": "pxr",
    "hpccd_core.plotting": "pyvista",
}  # modules, and the package that each needs


@pytest.mark.parametrize("name", MODULES)
def test_examples_run(name):
    if name in EXTRAS:
        pytest.importorskip(EXTRAS[name], reason=f"{name} needs the extra {EXTRAS[name]}")
    found = doctest.testmod(importlib.import_module(name), optionflags=doctest.ELLIPSIS)
    assert found.failed == 0


@pytest.mark.parametrize("name", ["Cancelled", "DeviceArray", "InvalidArgument"])
def test_what_is_compiled_is_documented_too(name):
    doc = inspect.getdoc(PUBLIC[name])
    assert "Examples\n--------\n" in doc
    if name != "DeviceArray":  # whose examples need a GPU
        example = doctest.DocTestParser().get_doctest(doc, {}, name, None, 0)
        assert example.examples and doctest.DocTestRunner().run(example).failed == 0
    else:
        methods = {k: v.__doc__ for k, v in vars(PUBLIC[name]).items() if not k.startswith("_")}
        assert all(methods.values()) and "Raises\n------\nIndexError" in methods["rows"]


def test_the_examples_are_found():
    modules = set(MODULES) - set(EXTRAS)
    tests = [t for name in modules for t in doctest.DocTestFinder().find(importlib.import_module(name)) if t.examples]
    assert {"Detector", "Scene", "Contacts", "icosphere"} <= {t.name.rpartition(".")[2] for t in tests}


def callables():
    for name, found in PUBLIC.items():
        if inspect.isfunction(found):
            yield name, found
        elif inspect.isclass(found) and found.__module__.startswith("hpccd_core."):
            for member, value in inspect.getmembers(found, inspect.isfunction):
                if not member.startswith("_"):
                    yield f"{name}.{member}", value


@pytest.mark.parametrize("name, function", list(callables()))
def test_arguments_are_documented_one_by_one(name, function):
    doc = inspect.getdoc(function) or ""
    arguments = [a for a in inspect.signature(function).parameters if a not in ("self", "cls", "unnamed", "unknown")]
    if len(arguments) > 1:
        section = re.search(r"^Parameters\n-+\n(.*?)(\n\n[A-Z][a-z]+\n-+\n|\Z)", doc, re.S | re.M)
        assert section, f"{name}: no section Parameters"
        listed = {word for line in re.findall(r"^(\w[\w, ]*) : ", section[1], re.M) for word in line.split(", ")}
        assert listed == set(arguments), name
    assert doc, f"{name}: no docstring"


QUERIES = ("detect", "step", "collision_free_step", "collision_free_motion", "proximity", "intersections", "distances")
QUERIES += ("winding_numbers", "signed_distances", "separating_translation", "penetration")


def test_help_of_the_detector_is_short():
    summary = inspect.getdoc(hc.Detector)
    assert len(summary.splitlines()) <= 100 and max(map(len, summary.splitlines())) <= 120
    text = pydoc.render_doc(hc.Detector, renderer=pydoc.plaintext)
    assert "Union[" not in text and "_NestedSequence" not in text
    assert len(text.splitlines()) <= 600 and max(map(len, text.splitlines())) < 300
    assert "Detector(scene, *, accuracy='exact', backend='auto'" in text
    assert "detect(self, vertices_t0, vertices_t1, *, stream=None)" in text
    assert all(f":meth:`{query}`" in summary for query in QUERIES)
    options = list(inspect.signature(hc.Detector).parameters)
    listed = {word for line in re.findall(r"^(\w[\w, ]*) : ", summary, re.M) for word in line.split(", ")}
    assert listed == set(options)
