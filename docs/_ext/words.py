"""The lists of words in ``promises.md`` are the site's glossary: ``{term}`` leads to a word from any page.

An item ``- **word**, **other word**: what it means`` explains one or more words. It reads as it stands where
the page is shown as plain Markdown.
"""

from __future__ import annotations

import re
from typing import Any

from sphinx.application import Sphinx

PAGE = "promises"

ITEM = re.compile(r"^- ((?:\*\*[^*]+\*\*(?:, )?)+): (.*)\n", re.MULTILINE)
ITEMS = re.compile(rf"(?:{ITEM.pattern})+", re.MULTILINE)


def turn(app: Sphinx, docname: str, source: list[str]) -> None:
    """Make a glossary of each list."""
    if docname == PAGE:
        source[0] = ITEMS.sub(lambda found: glossary(found[0]), source[0])


def glossary(listed: str) -> str:
    """Return a list of words as Sphinx wants it."""
    entries = []
    for words, meaning in ITEM.findall(listed):
        terms = words.strip("*").split("**, **")
        entries.append("\n".join([*terms, f"  {meaning}"]))
    body = "\n\n".join(entries)
    return f"```{{glossary}}\n{body}\n```\n"


def setup(app: Sphinx) -> dict[str, Any]:
    """Make this known to Sphinx."""
    app.connect("source-read", turn)
    return {"version": "1", "parallel_read_safe": True}
