"""Excerpts of the pages that a search has found, also where the site is a folder.

Sphinx fetches each result to quote from it. A browser refuses that to a page opened from a folder
(``file://``): results would have titles alone, and the console an error for each. Therefore the text of all
pages is one more file, ``_static/excerpts.js``, loaded only by the page of the search and used in place of a
fetch.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx.addnodes import pending_xref_condition
from sphinx.application import Sphinx

FILE = "excerpts.js"

UNREAD = (nodes.raw, nodes.comment, nodes.substitution_definition, nodes.pending)
"""Nodes without text of the page."""

SCRIPT = """
// Of each page: the places that a result may lead to, each with the text up to the next.
const PAGES = %s;
// What is "fetched" is the address itself, by which the text is found. Nothing else on this page fetches.
window.fetch = async (address) => new Response(address);
Search.htmlToText = (address, anchor) => {
  const root = document.documentElement.dataset.content_root;
  const name = address.slice(root.length, -DOCUMENTATION_OPTIONS.FILE_SUFFIX.length);
  const pieces = PAGES[name] ?? [];
  const first = pieces.findIndex(([place]) => `#${place}` === anchor);
  return pieces.slice(Math.max(first, 0)).map(([, text]) => text).join(" ");
};
"""


def add(app: Sphinx, page: str, template: str, context: dict[str, Any], doctree: Any) -> None:
    """Write the file and load it for the page of the search, which is written after all documents are read.

    Deferred, it runs after Sphinx's own script and before the search.
    """
    if page != "search":
        return
    pages = {name: pieces(app.env.get_doctree(name)) for name in sorted(app.env.found_docs)}
    target = Path(app.outdir, "_static", FILE)
    target.parent.mkdir(exist_ok=True)
    text = SCRIPT % json.dumps(pages, ensure_ascii=False, separators=(",", ":"))
    target.write_text(text, encoding="utf-8")
    app.add_js_file(FILE, loading_method="defer")


def pieces(doctree: nodes.document) -> list[tuple[str, str]]:
    """Return the places of a page in their order, each with the text from it to the next."""
    found: list[tuple[str, list[str]]] = [("", [])]
    for place, text in parts(doctree):
        if place:
            found.append((place, []))
        found[-1][1].append(text)
    joined = [(place, " ".join("".join(texts).split())) for place, texts in found]
    return [(place, text) for place, text in joined if place or text]


def parts(node: nodes.Node) -> Iterator[tuple[str, str]]:
    """Yield (a place, "") and ("", its text) in the order of the page; a space stands between blocks."""
    if isinstance(node, nodes.Text):
        yield "", node.astext()
    elif isinstance(node, nodes.Element) and not is_unread(node):
        yield from ((place, "") for place in node["ids"])
        for child in node.children:
            yield from parts(child)
        if not isinstance(node, nodes.Inline):
            yield "", " "


def is_unread(node: nodes.Element) -> bool:
    """Whether a node has no text for an excerpt: the second name of a type, or what a notebook prints, which
    is kept in several forms."""
    second = isinstance(node, pending_xref_condition) and node.get("condition") == "*"
    return second or isinstance(node, UNREAD) or "cell_output" in node["classes"]


def setup(app: Sphinx) -> dict[str, Any]:
    """Make this known to Sphinx."""
    app.connect("html-page-context", add)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
