"""The head of each page: what search engines show of it, and programs that show a link as a card.

The description is the page's first paragraph, the picture one for all pages. The address of the picture is
absolute, as such programs require, if that of the site is known (``sphinx-build -D html_baseurl=https://...``);
otherwise it is relative, for a folder has no address.
"""

from __future__ import annotations

import html
import re
import textwrap
from collections.abc import Iterator
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx

PREVIEW = "_static/preview.png"
"""The picture of 1200 by 630 pixels; ``docs/figures/photograph.py`` takes it."""

ALT = "24 discs, the free space between them in tiles, and the first sentence of the documentation"

LONGEST = 200
"""Characters of a description; search engines cut it there or before."""


def describe(app: Sphinx, page: str, template: str, context: dict[str, Any], doctree: Any) -> None:
    """Add description and preview to the page's head. A page without a paragraph has those of the site."""
    texts = (*first_paragraphs(doctree), *first_paragraphs(app.env.get_doctree(app.config.root_doc)))
    title = html.unescape(re.sub(r"<[^>]+>", "", context.get("title") or app.config.html_title))
    base = app.config.html_baseurl
    picture = f"{base.rstrip('/')}/{PREVIEW}" if base else context["pathto"](PREVIEW, resource=True)
    description = textwrap.shorten(texts[0], LONGEST, placeholder=" ...")
    properties = {"title": title, "description": description, "type": "website", "image": picture}
    properties |= {"image:width": "1200", "image:height": "630", "image:alt": ALT}
    properties |= {"site_name": app.config.html_title} | ({"url": context["pageurl"]} if base else {})
    tags = [("name", "description", description), ("name", "twitter:card", "summary_large_image")]
    tags += [("property", f"og:{name}", value) for name, value in properties.items()]
    written = [f'<meta {kind}="{name}" content="{html.escape(value)}">' for kind, name, value in tags]
    context["metatags"] = context.get("metatags", "") + "\n".join(written)


def first_paragraphs(doctree: nodes.document | None) -> Iterator[str]:
    """Yield the text of the first paragraph that stands in a section itself, if there is one."""
    for each in doctree.findall(nodes.paragraph) if doctree else ():
        if isinstance(each.parent, nodes.section) and each.astext().strip():
            yield " ".join(each.astext().split())
            return


def setup(app: Sphinx) -> dict[str, Any]:
    """Make this known to Sphinx."""
    app.connect("html-page-context", describe)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
