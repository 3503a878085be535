# SPDX-License-Identifier: Apache-2.0
"""Sphinx: the site of the documentation, which `make docs` builds in build/site."""

import re
import sys
from pathlib import Path

from hawkmoth.util import compiler

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
sys.path.insert(0, str(HERE))

import generate  # noqa: E402

project = "hpccd"
author = "the hpccd developers"
project_copyright = "the hpccd developers, Apache-2.0"
release = version = re.search(r"<version>(.+)</version>", (ROOT / "package.xml").read_text()).group(1)

extensions = [
    "hawkmoth",
    "myst_parser",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.intersphinx",
    "sphinx_copybutton",
]
exclude_patterns = ["figures"]
html_theme = "furo"
html_title = f"hpccd {release}"
html_copy_source = False
html_static_path = ["_static"]
html_css_files = ["site.css"]
myst_enable_extensions = ["deflist"]
myst_heading_anchors = 4  # pages link to headings as GitHub names them
copybutton_prompt_text = "$ "  # a copied console block is what one types, without prompts and output
copybutton_exclude = ".linenos, .gp, .go"

# Python: numpydoc sections, and types by their short names.
autodoc_typehints = "none"
autodoc_mock_imports = ["jax", "mujoco", "torch", "warp"]  # extras
autodoc_member_order = "bysource"
maximum_signature_line_length = 100
autodoc_default_options = {"members": True}
numpydoc_show_class_members = False
# Without a network the site is built as well: nothing of other sites is fetched.
intersphinx_mapping = {}

# C++: hawkmoth reads /** */ comments, the headers have /// ones.
hawkmoth_root = str(ROOT / "build" / "docs")
hawkmoth_clang = ["-std=c++20", f"-I{hawkmoth_root}", *compiler.get_include_args("g++", "c++")]


def setup(app):
    app.connect("builder-inited", lambda app: generate.everything(HERE / "generated", Path(hawkmoth_root)))
    app.connect("source-read", _repository_links)
    app.connect("autodoc-process-docstring", _module_examples)


def _repository_links(app, page, source):
    folder = (HERE / page).parent
    if folder.name != "generated":
        source[0] = generate.site_links(source[0], folder, folder)


def _module_examples(app, what, name, obj, options, lines):
    """numpydoc leaves the sections of modules as they are, and several on a page would share an anchor."""
    if what == "module" and "Examples" in lines:
        start = lines.index("Examples")
        lines[start : start + 2] = [".. rubric:: Examples", ""]
