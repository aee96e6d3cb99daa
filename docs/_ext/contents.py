"""The contents of the site are the lists of ``index.md``: one place, read by people as it stands.

Each heading of ``index.md`` below the title becomes a caption in the sidebar, and the links at the beginnings
of the items below it the entries, in their order, under the words of the link. A link to a folder
(``notebooks/``) stands for all documents in it, in alphabetical order. Links to a place within a page are
left to the page.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

from sphinx.application import Sphinx

HEADING = re.compile(r"## (.+)")
ITEM = re.compile(r"^[-*] \[([^\]]+)\]\(([^)#]+)\)", re.MULTILINE)
FOLDER = re.compile(r"\[([^\]]+)\]\([\w./-]*/\)")


def trees(text: str) -> Iterator[str]:
    """Yield a table of contents for each heading that has links below it."""
    for section in re.split(r"^(?=## )", text, flags=re.MULTILINE):
        heading = HEADING.match(section)
        entries = [entry(*found) for found in ITEM.findall(section)]
        if heading and entries:
            listed = "\n".join(entries)
            yield f"```{{toctree}}\n:hidden:\n:glob:\n:caption: {heading[1]}\n\n{listed}\n```\n"


def entry(title: str, target: str) -> str:
    """Return a line of a table of contents."""
    return f"{target}*" if target.endswith("/") else f"{title} <{target.removesuffix('.md')}>"


def add(app: Sphinx, docname: str, source: list[str]) -> None:
    """Add the tables of contents to the first page, where they are not shown; of links to folders, which are
    no pages, leave the words."""
    if docname == app.config.root_doc:
        source[0] = "\n".join([FOLDER.sub(r"\1", source[0]), *trees(source[0])])


def setup(app: Sphinx) -> dict[str, Any]:
    """Make this known to Sphinx."""
    app.connect("source-read", add, priority=600)  # after links that lead outside have been turned
    return {"version": "1", "parallel_read_safe": True}
