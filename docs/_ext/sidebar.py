"""The page of a diagnostic shows the sidebar of the list of diagnostics, which leaves the hundred codes out."""

from __future__ import annotations

from functools import cache
from typing import Any

from docutils import nodes
from product_pages.diagnostics import FOLDER
from sphinx.application import Sphinx
from sphinx.environment.adapters.toctree import global_toctree_for_doc


def setup(app: Sphinx) -> dict[str, bool]:
    """Be asked before the theme, which makes its sidebar by calling `toctree` of a page's context."""

    @cache
    def tree(**options: Any) -> str:
        """The navigation as the list shows it.  All pages of its folder have the same relative links."""
        found = global_toctree_for_doc(app.env, f"{FOLDER}/index", app.builder, tags=app.tags, **options)
        if found is None:
            return ""
        for link in found.findall(nodes.reference):
            if link["refuri"] in ("", "#"):
                link["refuri"] = "index.html"
        return str(app.builder.render_partial(found)["fragment"])

    def show(app: Sphinx, page: str, template: str, context: dict[str, Any], doctree: nodes.document | None) -> None:
        if page.startswith(f"{FOLDER}/") and page != f"{FOLDER}/index":
            context["toctree"] = tree

    app.connect("html-page-context", show, priority=400)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
