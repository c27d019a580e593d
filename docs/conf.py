"""Sphinx configuration: ``python -m sphinx -W --keep-going docs build/site`` makes the documentation site.

Nothing in a page is fetched from elsewhere: equations are drawn by matplotlib, pictures by cfmkit.
"""

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))  # the extensions that stand beside this file

from cfmkit._version import __version__  # noqa: E402

project = "cfmkit"
author = "the authors of cfmkit"
copyright = author
version = release = __version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "equations", "made_pages"]
exclude_patterns = ["build"]
source_suffix = {".md": "markdown"}
html_theme = "furo"
html_title = f"cfmkit {version}"
html_show_copyright = False
html_show_sourcelink = False
html_math_renderer = "mathtext"
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
myst_links_external_new_tab = False
napoleon_google_docstring = False
napoleon_use_rtype = False
autodoc_typehints = "none"
autodoc_member_order = "bysource"
add_module_names = False
highlight_language = "text"
pygments_style = "default"
