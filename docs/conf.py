"""Sphinx configuration of the documentation: `make docs`."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "extensions"))

import rooms

import archfem

project = "archfem"
author = "The archfem authors"
copyright = "the archfem authors, BSD 3-Clause licence"
version = release = archfem.__version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx.ext.mathjax",
    "sphinx-mathjax-offline",
    "sphinx_copybutton",
    "rooms",
    "verification",
]
exclude_patterns = ["build", "extensions", "templates", "made", "notebooks/figures"]
nitpicky = True
default_role = "py:obj"
suppress_warnings = ["mystnb.unknown_mime_type"]

# Notebooks are shipped with their outputs; the build does not execute them.
nb_execution_mode = "off"
myst_enable_extensions = ["dollarmath", "amsmath", "deflist", "attrs_block", "colon_fence"]
myst_heading_anchors = 3

autosummary_generate = True
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
autodoc_member_order = "bysource"
autodoc_default_options = {"exclude-members": "__init__, __new__"}
autodoc_class_signature = "mixed"
maximum_signature_line_length = 88
python_use_unqualified_type_names = True
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True
toc_object_entries = False
autodoc_mock_imports = rooms.MISSING

templates_path = ["templates"]
html_theme = "pydata_sphinx_theme"
html_title = "archfem"
html_static_path = ["static"]
html_css_files = ["archfem.css"]
html_js_files = ["search.js"]
html_copy_source = False
html_show_sourcelink = False
html_theme_options = {
    "show_toc_level": 2,
    "navigation_with_keys": False,
    "show_prev_next": False,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": [],
}
# Pages without subpages have no side bar.
html_sidebars = {name: [] for name in ("index", "install", "tutorial", "gallery", "limits")}
