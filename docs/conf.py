"""Sphinx: `make docs` builds the site in outputs/docs, and stops at the first warning."""

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE / "extensions"), str(HERE.parent)]

import jaxphys  # noqa: E402

project = "jaxphys"
author = copyright = "the jaxphys maintainers"
release = jaxphys.__version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx_design",
    "api_pages",
    "scene_fields",
    "links_outside",
]
exclude_patterns = ["conf.py", "extensions", "roadmap.md"]
default_role = "code"

nb_custom_formats = {".py": ["jupytext.reads", {"fmt": "py:percent"}]}
nb_execution_mode = "cache"
nb_execution_cache_path = str(HERE.parent / "outputs" / "docs-cache")
nb_execution_timeout = 600
nb_execution_raise_on_error = True
nb_merge_streams = True

myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 3
suppress_warnings = ["myst.header", "misc.highlighting_failure", "ref.python", "myst-nb.lexer"]

autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
autodoc_member_order = "bysource"
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True

html_theme = "furo"
html_title = "jaxphys"
html_static_path: list[str] = []
html_show_sphinx = False
