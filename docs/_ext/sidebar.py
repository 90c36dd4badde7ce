"""The sidebar, made once for all pages: Sphinx and the theme make it anew for each, which takes most of the time of a build.

Pages of diagnostics show that of the list of diagnostics, which leaves the hundred codes out."""

from __future__ import annotations

import re
from functools import cache
from typing import Any

from docutils import nodes
from furo.navigation import get_navigation_tree
from product_pages.diagnostics import FOLDER
from sphinx.application import Sphinx
from sphinx.environment.adapters.toctree import global_toctree_for_doc

SHOWN = {"collapse": False, "titles_only": True, "maxdepth": -1, "includehidden": True}
"""What the theme asks of the tree of pages."""
_LINK = re.compile(r'href="([^"#:]+\.html)"')
_ITEM = re.compile(r'<li class="|</li>')


def marked(tree: str, page: str) -> str:
    """The tree with the entry of a page, and those that it lies in, marked as current and open."""
    link = tree.find(f'href="{page}.html"')
    if link < 0:
        return tree
    around: list[int] = []
    for found in _ITEM.finditer(tree, 0, link):
        if found[0] == "</li>":
            around.pop()
        else:
            around.append(found.end())
    anchor = tree.rindex('class="', 0, link) + len('class="')
    tree = tree[:anchor] + "current " + tree[anchor:]
    for at in reversed(around):
        word = " current current-page" if at == around[-1] else " current"
        end = tree.index('"', at)
        if "has-children" in tree[at:end]:
            box = tree.index("<input ", end) + len("<input ")
            tree = f'{tree[:box]}checked="" {tree[box:]}'
        tree = tree[:end] + word + tree[end:]
    return tree


def setup(app: Sphinx) -> dict[str, bool]:
    """Be asked before the theme, which then finds nothing to make, and behind it."""

    @cache
    def whole() -> str:
        """The sidebar with links from the root of the site."""
        found = global_toctree_for_doc(app.env, "index", app.builder, tags=app.tags, **SHOWN)  # type: ignore[arg-type]
        return "" if found is None else get_navigation_tree(str(app.builder.render_partial(found)["fragment"]))

    def leave_out(app: Sphinx, page: str, template: str, context: dict[str, Any], doctree: nodes.document | None) -> None:
        context["toctree"] = lambda **options: ""

    def show(app: Sphinx, page: str, template: str, context: dict[str, Any], doctree: nodes.document | None) -> None:
        shown = f"{FOLDER}/index" if page.startswith(f"{FOLDER}/") else page

        def relative(link: re.Match[str]) -> str:
            return f'href="{app.builder.get_relative_uri(page, link[1].removesuffix(".html")) or "#"}"'

        context["furo_navigation_tree"] = _LINK.sub(relative, marked(whole(), shown))

    app.connect("html-page-context", leave_out, priority=400)
    app.connect("html-page-context", show, priority=600)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
