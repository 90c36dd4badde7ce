"""Settings of the documentation: pages in Markdown, the Furo theme, nothing fetched from a network.

    pip install -e '.[docs]'
    sphinx-build -W --keep-going docs build/docs
"""

from __future__ import annotations

import sys
from pathlib import Path

from fbvm import __version__

sys.path.append(str(Path(__file__).parent / "_ext"))

project = "fbvm"
release = version = __version__
extensions = [
    "myst_parser", "sphinx.ext.autodoc", "sphinx_click", "sphinx_copybutton", "repository_files", "structured_text",
    "product_pages", "sidebar",
]  # fmt: skip
exclude_patterns = ["_ext"]
nitpicky = True

myst_enable_extensions = ["colon_fence", "deflist"]
myst_heading_anchors = 4

copybutton_prompt_text = "$ "
copybutton_line_continuation_character = "\\"

html_theme = "furo"
html_title = f"fbvm {release}"
html_static_path = ["_static"]
html_css_files = ["pages.css"]
html_show_copyright = False
html_show_sourcelink = False
html_copy_source = False
pygments_style = "tango"
pygments_dark_style = "github-dark"
