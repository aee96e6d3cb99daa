"""The contents of the site are the lists of ``index.md``: one place, read by people as it stands.

Each heading of ``index.md`` below the title becomes a caption in the sidebar, and the links at the beginnings
of the items below it the entries, in their order, under the words of the link. Links to a
place within a page are left to the page.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

from sphinx.application import Sphinx

HEADING = re.compile(r"## (.+)")
ITEM = re.compile(r"^[-*] (\[[^\]]+\]\([^)#]+\).*)", re.MULTILINE)
LINK = re.compile(r"\[([^\]]+)\]\(([^)#]+)\)")


def trees(text: str) -> Iterator[str]:
    """Yield a table of contents for each heading that has links below it."""
    for section in re.split(r"^(?=## )", text, flags=re.MULTILINE):
        heading = HEADING.match(section)
        links = [LINK.findall(item)[0] for item in ITEM.findall(section)]
        entries = [f"{title} <{document(target)}>" for title, target in links]
        if heading and entries:
            listed = "\n".join(entries)
            yield f"```{{toctree}}\n:hidden:\n:caption: {heading[1]}\n\n{listed}\n```\n"


def document(target: str) -> str:
    """Return the name of the document to which a link leads."""
    return target.removesuffix(".md").removesuffix(".ipynb")


def add(app: Sphinx, docname: str, source: list[str]) -> None:
    """Add the tables of contents to the first page, where they are not shown."""
    if docname == app.config.root_doc:
        source[0] = "\n".join([source[0], *trees(source[0])])


def setup(app: Sphinx) -> dict[str, Any]:
    """Make this known to Sphinx."""
    app.connect("source-read", add, priority=600)  # after links that lead outside have been turned
    return {"version": "1", "parallel_read_safe": True}
