"""Pictures and players that are made while the site is built.

A block of the language ``{live}`` holds commands of kinetile, one a line, and stands for what they make. On
the site it is a page that plays, or a picture; wherever else the document is read it is the command by which
a reader makes it::

    ```{live} The tile between 3 and 7 collapses at 0.41, and three new ones take its place.
    kinetile view scenes/figure-14.toml --broad-phase sweep-tiling --beside sap-1d --until 2
    ```

* What stands behind ``{live}`` is the caption, in MyST: links and ``code`` may be in it. It may be left out.
* ``kinetile view SCENE ...`` becomes a frame in which the page plays, with a link that opens it by itself.
  ``kinetile draw SCENE ... --out NAME.svg`` (or ``.png``) becomes a picture. All that the two commands take
  may be said, ``--set``, ``--roles``, ``--from``, a phase's options; a command may go on in the next line
  behind a backslash, and ``$`` may stand before it.
* ``--out`` names the file on the site; ``view`` may go without it. ``--open`` and ``--overwrite`` are not
  for here. Files that a command names are looked for from the folder in which the document stands.
* ``:height: 30rem`` in the first line of the block is how high the frames are, 54rem without it; ``:link:
  try`` opens the page at its link ``#try``.
* ``:class: tiles`` puts pictures beside each other, each of which leads to the page of its command: two
  thirds of the way to ``--until``, else at the start, and with the structure unless ``--no-steps`` is given.
  Captions of tiles are parts of the caption of the block, between semicolons.

A command that fails is a warning of the type ``live.failed``, with what it has said; where warnings are
errors, there is no site.

Commands run in this process, in the document's folder, and what they make is kept in ``live_cache`` under a
digest of the command, the files that it names, and the sources of kinetile and of all plugins: only what has
changed is made again. ``live_plugins`` in ``conf.py`` maps modules that are plugins, but not installed, to
the folders in which they are imported, so that an example of these documents can be shown::

    live_plugins = {"wrong_meetings": "examples"}
"""

from __future__ import annotations

import contextlib
import hashlib
import html
import posixpath
import shlex
import shutil
import sys
from functools import cache
from importlib import import_module, metadata
from importlib.util import find_spec
from itertools import pairwise
from pathlib import Path
from typing import Any, ClassVar

from docutils import nodes
from docutils.parsers.rst import directives
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment
from sphinx.util import logging
from sphinx.util.docutils import SphinxDirective

SOURCES = {".py", ".mjs", ".css", ".html"}
"""Files of a package on which a picture depends."""

MAKES = {"view": (".html",), "draw": (".svg", ".png")}
"""What each command may write, the first of it where nothing is said."""

FOLDER = "_live"
"""Where all of it lies on the site."""

NOTHING = "nothing"
"""What is kept of a command that has failed: its document is read again the next time."""

said = logging.getLogger(__name__)


class Refused(Exception):
    """A command that is not one of those that a block may hold, or has failed."""


class shown(nodes.General, nodes.Element):
    """What a command has made, at ``uri`` on the site; inside is the command, for other readers."""


class Live(SphinxDirective):
    """The directive ``live``."""

    has_content = True
    optional_arguments = 1
    final_argument_whitespace = True
    option_spec: ClassVar[dict[str, Any]] = {
        "height": directives.unchanged,
        "link": directives.unchanged,
        "class": directives.class_option,
    }

    def run(self) -> list[nodes.Node]:
        """Make what the commands make, or find it among what is kept."""
        inline, messages = self.parse_inline(self.arguments[0] if self.arguments else "")
        caption = nodes.caption("", "", *inline)
        made: list[nodes.Node] = []
        tiled, lines = "tiles" in self.options.get("class", ()), commands("\n".join(self.content))
        parts = self.arguments[0].rstrip(".").split("; ") if tiled else [caption.astext()] * len(lines)
        for command, part in zip(lines, parts, strict=True):
            try:
                made.append(self._tile(command, part) if tiled else self._made(command, part))
            except Refused as error:
                remembered(self.env).setdefault(self.env.docname, {})[command] = NOTHING
                said.warning(
                    "%s: %s", command, error, type="live", subtype="failed", location=self.get_location()
                )
        figure = nodes.container("", *made, classes=["live", *self.options.get("class", ())])
        if self.arguments and not tiled:
            figure += [caption, *messages]
        return [figure]

    def _tile(self, command: str, part: str) -> nodes.Node:
        inline, messages = self.parse_inline(part[:1].upper() + part[1:])
        caption = nodes.caption("", "", *inline)
        page, picture = (
            self._made(command, caption.astext()),
            self._made(drawn_for(command), caption.astext()),
        )
        page["picture"] = picture["uri"]
        return nodes.container("", page, caption, *messages)

    def _made(self, command: str, title: str) -> nodes.Node:
        here = Path(self.env.doc2path(self.env.docname)).parent
        words, name = read(command)
        for file in files_named(words, here):
            self.env.note_dependency(str(file))
        kept = Path(self.config.live_cache) / f"{digest(words, here)}{Path(name).suffix}"
        if not kept.exists():
            said.info("live: %s", command)
            make(words, here, kept)
        uri = f"{FOLDER}/{self.env.docname}/{name}"
        remembered(self.env).setdefault(self.env.docname, {})[uri] = str(kept)
        plain = nodes.literal_block(command, command, language="console")
        height = self.options.get("height", "54rem")
        link = f"#{self.options['link']}" if "link" in self.options else ""
        return shown("", plain, uri=uri, title=title or command, height=height, command=command, link=link)


def commands(text: str) -> list[str]:
    """Return the commands of a block, each in one line."""
    lines = text.replace("\\\n", " ").splitlines()
    return [" ".join(line.removeprefix("$ ").split()) for line in lines if line.strip()]


def drawn_for(command: str) -> str:
    """Return the command that draws the picture of a tile, for one that makes its page."""
    words = shlex.split(command)
    kept = ["kinetile", "draw", words[2], "--bare", "--no-pairs"]
    for word, value in pairwise(words):
        if word in ("-s", "--set", "--broad-phase"):
            kept += [word, value]
        if word == "--until":
            kept += ["--at", f"{2 * float(value) / 3:g}"]
    return shlex.join([*kept, *(["--roles", "certificate"] if "--no-steps" in words else [])])


def read(command: str) -> tuple[list[str], str]:
    """Return a command's words without the target, and the name of what it makes."""
    words = shlex.split(command)
    if words[:1] != ["kinetile"] or len(words) < 2 or words[1] not in MAKES:
        raise Refused("expected `kinetile view ...` or `kinetile draw ...`")
    name = ""
    if "--out" in words:
        place = words.index("--out")
        name = words[place + 1] if place + 1 < len(words) else ""
        del words[place : place + 2]
    for barred in ("--open", "--overwrite"):
        if barred in words:
            raise Refused(f"{barred} is not for a page that is built")
    endings = MAKES[words[1]]
    name = name or f"{hashlib.sha256(command.encode()).hexdigest()[:12]}{endings[0]}"
    if Path(name).name != name or Path(name).suffix not in endings:
        raise Refused(f"--out is {name!r}; expected a name that ends in {' or '.join(endings)}")
    return words[1:], name


def files_named(words: list[str], here: Path) -> list[Path]:
    """Return the files that a command names: words, or what stands behind a word's ``=``."""
    named = [here / word.rpartition("=")[2] for word in words]
    return [path for path in named if path.is_file()]


def digest(words: list[str], here: Path) -> str:
    """Return what a command's result depends on, as a short name."""
    found = hashlib.sha256(shlex.join(words).encode())
    for path in files_named(words, here):
        found.update(path.read_bytes())
    found.update(sources().encode())
    return found.hexdigest()[:24]


@cache
def sources() -> str:
    """Return a digest of the sources of kinetile, of every plugin that is installed, and of the examples."""
    points = metadata.entry_points(group="kinetile")
    packages = {"kinetile", *(point.module.partition(".")[0] for point in points), *_examples}
    found = hashlib.sha256()
    for package in sorted(packages):
        spec = find_spec(package)
        places = [Path(each) for each in (spec.submodule_search_locations or ())] if spec else []
        files = [path for place in places for path in sorted(place.rglob("*")) if path.suffix in SOURCES]
        files += [Path(spec.origin)] if spec and spec.origin and not places else []
        for path in files:
            found.update(path.read_bytes())
    return found.hexdigest()


def make(words: list[str], here: Path, target: Path) -> None:
    """Run a command of kinetile in a folder; what it makes stands at the target when it is whole."""
    from typer.testing import CliRunner

    from kinetile.cli import app

    target.parent.mkdir(parents=True, exist_ok=True)
    new = target.with_name(f"new-{target.name}")
    with contextlib.chdir(here):
        ended = CliRunner().invoke(app, [*words, "--out", str(new), "--overwrite"])
    if ended.exit_code:
        new.unlink(missing_ok=True)
        raise Refused(f"ended with {ended.exit_code}: {ended.stderr.strip() or ended.exception!r}")
    new.replace(target)


def remembered(env: BuildEnvironment) -> dict[str, dict[str, str]]:
    """Return, for each document, which file that is kept belongs to which place on the site."""
    if not hasattr(env, "live_made"):
        env.live_made = {}  # type: ignore[attr-defined]
    return env.live_made  # type: ignore[attr-defined, no-any-return]


def show(self: Any, node: shown) -> None:
    """Write a frame or a picture into a page of the site."""
    up = posixpath.relpath(node["uri"], posixpath.dirname(self.builder.current_docname) or ".")
    title, uri = html.escape(node["title"]), html.escape(up)
    if "picture" in node:
        picture = html.escape(posixpath.join(posixpath.dirname(up), posixpath.basename(node["picture"])))
        link = (
            f'<a class="reference internal plays" href="{uri}"><img src="{picture}" alt="Play: {title}"></a>'
        )
        self.body.append(f'<div class="tile">{link}<details class="live-link"><summary>command</summary>')
        self.body.append(f"<code>{html.escape(node['command'])}</code></details></div>")
        raise nodes.SkipNode
    if uri.endswith(".html"):
        height = html.escape(node["height"])
        place = uri + html.escape(node["link"])
        self.body.append(
            f'<div><iframe src="{place}" title="{title}" loading="lazy" style="height: {height}"></iframe>'
            f'<p class="live-link"><a class="reference internal" href="{uri}">Open it by itself</a>'
        )
    else:
        self.body.append(f'<div><img src="{uri}" alt="{title}" loading="lazy"><p class="live-link">')
    self.body.append(f"<code>{html.escape(node['command'])}</code></p></div>")
    raise nodes.SkipNode


def show_plainly(self: Any, node: shown) -> None:
    """Leave the command, which is inside, to builders that have no frames."""


def forget(app: Sphinx, env: BuildEnvironment, docname: str) -> None:
    """Forget what a document that is read again had."""
    remembered(env).pop(docname, None)


def merge(app: Sphinx, env: BuildEnvironment, docnames: set[str], other: BuildEnvironment) -> None:
    """Take over what was made in another process."""
    remembered(env).update({name: made for name, made in remembered(other).items() if name in docnames})


def restore_lost(app: Sphinx, env: BuildEnvironment, *_: Any) -> list[str]:
    """Return the documents whose pictures are no longer kept: they are read again."""
    return [
        name
        for name, made in remembered(env).items()
        if not all(Path(kept).exists() for kept in made.values())
    ]


def place(app: Sphinx, error: Exception | None) -> None:
    """Put what is kept where the pages of the site ask for it."""
    if error is not None or app.builder.format != "html":
        return
    for made in remembered(app.env).values():
        for uri, kept in made.items():
            if kept == NOTHING:
                continue
            target = Path(app.outdir, uri)
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(kept, target)


_examples: list[str] = []
"""Modules of ``live_plugins``."""


def take_in(app: Sphinx, config: Any) -> None:
    """Make the paths absolute, and the plugins of ``live_plugins`` known."""
    import kinetile as kt

    config.live_cache = str(Path(app.confdir, config.live_cache).resolve())
    _examples[:] = config.live_plugins
    for module, folder in config.live_plugins.items():
        sys.path.insert(0, str(Path(app.confdir, folder).resolve()))
        plugin = import_module(module)
        if not any(each.plugin == module for each in kt.registry()):
            kt.registry().add(plugin)
    sources.cache_clear()


def setup(app: Sphinx) -> dict[str, Any]:
    """Make the directive known to Sphinx."""
    app.add_config_value("live_cache", "../build/live", "")
    app.add_config_value("live_plugins", {}, "")
    plain = dict.fromkeys(("latex", "text", "man"), (show_plainly, show_plainly))
    app.add_node(shown, html=(show, None), **plain)
    app.add_directive("live", Live)
    app.connect("config-inited", take_in)
    app.connect("env-purge-doc", forget)
    app.connect("env-merge-info", merge)
    app.connect("env-get-outdated", restore_lost)
    app.connect("build-finished", place)
    app.add_css_file("live.css")
    return {"version": "1", "env_version": 1, "parallel_read_safe": True, "parallel_write_safe": True}
