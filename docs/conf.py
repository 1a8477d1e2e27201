"""Sphinx: the pages of this folder, and the reference from the docstrings; `make site` builds both."""

import importlib
import os
import re
import sys
from pathlib import Path

from docutils import nodes
from numpy.typing import ArrayLike
from sphinx import addnodes
from sphinx.util.typing import stringify_annotation

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))
os.environ["RIGID_BODY_SIM_NO_NUMBA"] = "1"  # so that kernels are functions with a signature

arrays = importlib.import_module("rigid_body_sim.kernels.arrays")  # from there, and with that environment

project = "rigid_body_sim"
author = "rigid_body_sim maintainers"
copyright = f"{author}, Apache-2.0"
version = release = re.search(r'^__version__ = "(.*)"', (ROOT / project / "__init__.py").read_text("utf-8"), re.M)[1]

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["requirements.txt"]
html_theme = "furo"
html_title = f"{project} {release}"
html_copy_source = False
html_static_path = ["_static"]
html_css_files = ["site.css"]

myst_heading_anchors = 3  # links to headings, as GitHub makes them
smartquotes_action = "D"  # dashes alone: the quote of ω' is a derivative
autodoc_default_options = {"members": True}
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_preserve_defaults = True
napoleon_google_docstring = False


def hide_signs(app, what, name, obj, options, lines):
    """From napoleon, which takes what stands before a colon in the first line of a property for its type."""
    if what == "property":
        lines[:] = [line.replace(":", HIDDEN) for line in lines]


def show_signs(app, what, name, obj, options, lines):
    """What was hidden; and a bar is that of a magnitude, ``|ω|``, and begins no substitution."""
    lines[:] = [re.sub(r"(``.*?``)|\|", lambda match: match[1] or r"\|", line) for line in lines]
    lines[:] = [line.replace(HIDDEN, ":") for line in lines]


def name_types(app, doctree):
    """Write our names for the types of arrays in place of what they stand for."""
    for node in [*doctree.findall(lambda node: isinstance(node, TYPES))]:
        text = whole = node.astext().removeprefix(" -> ")
        for name, meant in ALIASES.items():
            text = text.replace(meant, name)
        if text != whole:
            node.children = []
            node += nodes.Text(text)


def shown(annotation):
    """An annotation as Sphinx shows it."""
    return re.sub(r"~?\b[\w.]+\.(?=\w)|~", "", stringify_annotation(annotation, "smart"))


HIDDEN = "\0"
TYPES = (addnodes.desc_annotation, addnodes.desc_sig_name, addnodes.desc_returns)
ALIASES = {  # the longest first
    "ArrayLike": shown(ArrayLike),
    "Vector": shown(arrays.Vector),
    "Floats": shown(arrays.Floats),
    "Integers": shown(arrays.Integers),
}


def setup(app):
    """Called by Sphinx."""
    app.connect("autodoc-process-docstring", hide_signs, priority=400)  # napoleon comes at 500
    app.connect("autodoc-process-docstring", show_signs, priority=600)
    app.connect("doctree-read", name_types)
