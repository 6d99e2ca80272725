"""Sphinx configuration of the manual; ``docs/site/build.py`` prepares the sources and calls Sphinx."""

from __future__ import annotations

import sys
from pathlib import Path

SITE = Path(__file__).resolve().parent
sys.path[:0] = [str(SITE), str(SITE.parents[1])]

from monitor import __version__  # noqa: E402

project = "machine-health-monitor"
copyright = "the authors of machine-health-monitor, Apache-2.0"
release = version = __version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "mathml", "answers"]
source_suffix = {".md": "markdown"}
exclude_patterns: list[str] = []

# Strict: every reference has to lead somewhere. What stands here are types of other libraries, whose manuals are not
# part of this one, and names that only annotations have.
nitpicky = True
nitpick_ignore_regex = [
    ("py:.*", r"(pd|pandas|np|numpy|npt|Path|pathlib|collections|typing|datetime|types)(\..*)?"),
    ("py:.*", r"monitor\.(records|api\.(answer|asking))\.\w+"),
]

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
suppress_warnings: list[str] = []
# What is typed is shown: two hyphens of an option would become a dash.
smartquotes = False

autodoc_class_signature = "separated"
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
python_use_unqualified_type_names = True

# Nothing is fetched: the theme brings its script and style and takes the fonts of the reader's computer; formulas are
# MathML (mathml.py).
html_theme = "furo"
html_title = f"Manual of machine-health-monitor {version}"
html_static_path = [str(SITE / "static")]
html_css_files = ["manual.css"]
html_copy_source = False
html_show_sphinx = False
html_math_renderer = "mathml"
html_theme_options = {"navigation_with_keys": True}
pygments_style = "default"
pygments_dark_style = "github-dark"
