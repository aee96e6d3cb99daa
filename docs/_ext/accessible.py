"""What the theme and Sphinx leave out for those who read by keyboard or by ear.

``axe-core`` finds nothing to complain of in a page of the site (``tests/test_site.py``); each of ``MENDS`` is
something of which it did. They are made in the finished pages, for they stand in templates of the theme, or
are written by Sphinx itself; a page that is mended already stays as it is.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from live import FOLDER
from sphinx.application import Sphinx

MENDS = {
    # The captions of the sidebar are headings of no level.
    '<p class="caption" role="heading">': '<p class="caption" role="heading" aria-level="2">',
    # Two landmarks of one kind, to be told apart by their names.
    '<aside class="sidebar-drawer"': '<aside aria-label="The site" class="sidebar-drawer"',
    '<aside class="toc-drawer': '<aside aria-label="This page" class="toc-drawer',
    # Parameters in lines of their own: descriptions of nothing.
    "<dl>\n<dd>": '<dl role="none">\n<dd>',
    # The corner of a table that has heads above and to the left.
    '<th class="head"><p></p></th>': "<td></td>",
    # The page of the search has no heading.
    '</noscript>\n\n<div id="search-results">': '</noscript>\n<h1>Search</h1>\n<div id="search-results">',
}
"""What stands in a page, and what is to stand there."""

SCROLLING = """
addEventListener("DOMContentLoaded", () => {
  const sizes = new ResizeObserver((seen) => seen.forEach(({ target }) => {
    if (target.scrollWidth > target.clientWidth) target.tabIndex = 0;
    else target.removeAttribute("tabindex");
  }));
  document.querySelectorAll("pre, .table-wrapper").forEach((block) => sizes.observe(block));
});
"""
"""A table or a block of code that is wider than its page can be reached by the keyboard, to be scrolled."""


def mend(app: Sphinx, error: Exception | None) -> None:
    """Mend the pages of the site; the players are pages of their own."""
    if error is not None or app.builder.format != "html":
        return
    for page in Path(app.outdir).rglob("*.html"):
        if page.relative_to(app.outdir).parts[0] == FOLDER:
            continue
        text = mended = page.read_text(encoding="utf-8")
        for found, right in MENDS.items():
            mended = mended.replace(found, right)
        if mended != text:
            page.write_text(mended, encoding="utf-8")


def setup(app: Sphinx) -> dict[str, Any]:
    """Make this known to Sphinx."""
    app.connect("build-finished", mend)
    app.add_js_file(None, body=SCROLLING)
    return {"version": "1", "parallel_read_safe": True}
