"""Sphinx: the pages of this folder (Markdown), a gallery, and a reference of the public names.

python -m sphinx -W docs build/docs
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

project = "mstmm"
author = "mstmm contributors"
copyright = "2026, mstmm contributors"
extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "tooling.formulas",
    "tooling.drawings",
    "tooling.tables",
    "tooling.gallery",
    "tooling.docstrings",
    "tooling.members",
]
html_theme = "furo"
html_title = "mstmm"
html_static_path = ["tooling/static"]
html_css_files = ["pages.css"]
html_math_renderer = "mathml"
html_copy_source = False
myst_enable_extensions = ["dollarmath", "amsmath", "deflist"]
myst_heading_anchors = 3
nb_execution_mode = "force"  # notebooks are kept without what they give
nb_execution_raise_on_error = True
nb_execution_timeout = 300
nb_merge_streams = True
autodoc_default_options = {"members": True, "inherited-members": True}
autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
suppress_warnings = ["ref.python"]  # short names that several classes share
toc_object_entries_show_parents = "hide"
