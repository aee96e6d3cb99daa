"""Links from a document to files that are no documents: the site has a page of each of them.

``[its code](../plugins/kinetile_plugins/cells)`` is right wherever the files lie beside each other. For the
site, such a link leads to a page that shows the file, or lists the files of a folder, each with its own page,
under ``source/``. The first page of the site is README, with the lists of ``index.md`` behind it and the
players of ``index.md`` in it: the one in which a disc is thrown below the program, the other before the
second section.
"""

from __future__ import annotations

import html
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment

PAGES = "source"
"""Where pages of files are: the folder of the site and the scheme of the links."""

README = "index"
"""The document that stands for README."""

PLAYER = re.compile(r"## .*\n\n(```\{live\}(?:.|\n)*?\n```\n)\n")
"""A section of the index with a player."""

PICTURED = "\n\nThe bullet "
"""The beginning of the paragraph before which the first player stands: below the program."""

LINK = re.compile(r"(\]\(|src=\")(?!\w+:|#)([^)\s#\"]+)")
"""Where a link or a picture of the repository begins, and its path."""

KINDS = {".py": "python", ".md": "md", ".toml": "toml", ".sh": "sh", ".mjs": "js", ".json": "json"}
"""What each kind of file is coloured as."""

UNSHOWN = {"__pycache__", "build"}
"""Folders that tools make; so are those whose names begin with a dot."""


def turn(app: Sphinx, docname: str, source: list[str]) -> None:
    """Turn links that lead outside; put README where its document is."""
    page = Path(app.env.doc2path(docname))
    if page.suffix != ".md":
        return
    if docname == README:
        app.env.note_dependency(str(root(app) / "README.md"))
        source[0] = first_page(app, (root(app) / "README.md").read_text(encoding="utf-8"), source[0])
    elif "../" in source[0]:
        source[0] = turned_links(app, source[0], page.parent, docname)


def first_page(app: Sphinx, readme: str, index: str) -> str:
    """Return README and the lists of the index as one page."""
    lists = index[index.index("\n## ") :]
    for player, before in zip(PLAYER.finditer(index), (PICTURED, "\n## "), strict=True):
        lists = lists.replace(player[0], "")
        readme = readme.replace(before, f"\n\n{player[1]}{before}", 1)
    return turned_links(app, readme, root(app), README) + turned_links(app, lists, Path(app.srcdir), README)


def turned_links(app: Sphinx, text: str, here: Path, docname: str) -> str:
    """Return a text written for a folder as that of a document: links to other files lead to their pages."""
    home, page = root(app), Path(app.env.doc2path(docname))
    seen = outside(app.env).setdefault(docname, [])

    def turned(found: re.Match[str]) -> str:
        path = Path(os.path.normpath(here / found[2]))
        if path == home / "README.md":
            return f"{found[1]}{os.path.relpath(Path(app.srcdir, README), page.parent)}.md"
        if path.is_relative_to(app.srcdir):
            return f"{found[1]}{os.path.relpath(path, page.parent)}"
        if not path.is_relative_to(home) or not path.exists():
            return found[0]  # which is told as a link that leads nowhere
        seen.append(path.relative_to(home).as_posix())
        return f"{found[1]}{PAGES}:{seen[-1]}"

    return LINK.sub(turned, text)


def root(app: Sphinx) -> Path:
    """Return the folder of the repository."""
    return Path(app.srcdir).parent


def outside(env: BuildEnvironment) -> dict[str, list[str]]:
    """Return, for each document, the paths outside that it leads to."""
    if not hasattr(env, "led_outside"):
        env.led_outside = {}  # type: ignore[attr-defined]
    return env.led_outside  # type: ignore[attr-defined, no-any-return]


def forget(app: Sphinx, env: BuildEnvironment, docname: str) -> None:
    """Forget what a document that is read again had."""
    outside(env).pop(docname, None)


def merge(app: Sphinx, env: BuildEnvironment, docnames: set[str], other: BuildEnvironment) -> None:
    """Take over what was seen in another process."""
    outside(env).update({name: seen for name, seen in outside(other).items() if name in docnames})


def pages(app: Sphinx) -> Iterator[tuple[str, dict[str, Any], str]]:
    """Yield a page of each file that a document leads to, and of each file of such a folder."""
    home = root(app)
    named = {path for seen in outside(app.env).values() for path in seen}
    files = {each for path in named for each in inside(home / path)}
    for path in sorted({home / path for path in named} | files):
        name = path.relative_to(home).as_posix()
        body = listed(path) if path.is_dir() else coloured(app, path)
        title, own = html.escape(name), html.escape(path.name)
        yield f"{PAGES}/{name}", {"title": title, "body": f"<h1>{own}</h1><p>{title}</p>{body}"}, "page.html"


def inside(path: Path) -> Iterator[Path]:
    """Yield the files of a folder that can be read, of all its folders."""
    if path.is_dir():
        for each in path.rglob("*"):
            names = each.relative_to(path).parts
            shown = not any(name in UNSHOWN or name.startswith(".") for name in names)
            if shown and each.is_file() and (each.suffix in KINDS or not each.suffix):
                yield each


def listed(folder: Path) -> str:
    """Return a folder as a list of links to its files."""
    links = []
    for path in sorted(inside(folder)):
        name = html.escape(path.relative_to(folder).as_posix())
        links.append(f'<li><a href="{html.escape(folder.name)}/{name}.html">{name}</a></li>')
    return f"<ul>{''.join(links)}</ul>"


def coloured(app: Sphinx, path: Path) -> str:
    """Return a file's text, coloured."""
    text = path.read_text(encoding="utf-8", errors="replace")
    shown = app.builder.highlighter.highlight_block(text, KINDS.get(path.suffix, "text"), linenos=False)  # type: ignore[attr-defined]
    return f'<div class="literal-block-wrapper">{shown}</div>'


def setup(app: Sphinx) -> dict[str, Any]:
    """Make this known to Sphinx."""
    app.connect("source-read", turn, priority=400)
    app.connect("env-purge-doc", forget)
    app.connect("env-merge-info", merge)
    app.connect("html-collect-pages", pages)
    return {"version": "1", "env_version": 1, "parallel_read_safe": True, "parallel_write_safe": True}
