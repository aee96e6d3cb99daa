"""Documentation is true: its Python runs, its commands run, and quotations are in the files that it names.

In docs/*.md and README.md:

* blocks marked ``python`` run in order, in one namespace a file, in a folder of their own;
* in blocks marked ``console``, lines ``$ kinetile ...`` run in such a folder, and must end with exit code 0
  or the one named behind ``# exit code``; the lines that follow one are its output, ``...`` stands for
  anything, and a line of nothing else for any lines;
* there, ``$ pip install -e FOLDER`` makes the package in a folder known to the commands that follow, and
  ``NAME=value`` before a command goes into its environment;
* a comment before a block says otherwise: ``<!-- not run: the reason -->``; ``<!-- slow: the reason -->`` for
  a block that runs only with ``pytest -m slow``, with all others of its page; ``<!-- part of some/file -->``
  for a quotation, which must be in that file, word for word; ``<!-- file: some/file -->`` for what is to
  be written into a file, the first block of a page in place of what is there, the next ones after it;
  outside a folder that a command has made it may be a new one.

The folder in which the blocks of a page in docs run has a copy of ``docs/scenes``.

Blocks whose language is in braces are for the site (``tests/test_site.py``).
"""

import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import pytest
from typer.testing import CliRunner

import kinetile as kt
from installing import install
from kinetile.cli import app
from kinetile.scene.schema import _FILE, FileTable
from registering import remove

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = [*sorted(DOCS.glob("*.md")), ROOT / "README.md"]
LINKED = [*sorted(DOCS.rglob("*.md")), *sorted(ROOT.glob("*.md"))]
FENCE = re.compile(r"```(\w*|\{[\w:-]+\}.*)")
COMMENT = re.compile(r"<!--\s*(not run|slow|part of|file):?\s+(\S.*?)\s*-->")
SETTING = re.compile(r"[A-Z_]+=\S*")
CODE = re.compile(r"\s+# exit code (\d+)$")


class Block(NamedTuple):
    """A block of code: its language, where its text begins, its text, and what a comment says about it."""

    language: str
    line: int
    text: str
    mark: str = ""
    detail: str = ""


def read_blocks(page: Path) -> Iterator[Block]:
    """Yields the blocks of a page in their order."""
    lines = page.read_text(encoding="utf-8").splitlines()
    before = ""
    place = 0
    while place < len(lines):
        fence = FENCE.fullmatch(lines[place])
        if fence:
            end = lines.index("```", place + 1)
            said = COMMENT.fullmatch(before)
            mark, detail = (said[1], said[2]) if said else ("", "")
            yield Block(fence[1], place + 2, "\n".join(lines[place + 1 : end]) + "\n", mark, detail)
            place = end
        before = lines[place].strip() or before
        place += 1


FIRST = {"README.md", "tutorial.md"}
"""Pages that run by default; `.ci/run` runs all."""


def pages_with(language: str) -> list[Any]:
    """Returns (page, marks) to run: each page that has blocks to run, and again, marked slow, with those that
    are slow as well."""
    found = []
    for page in PAGES:
        marks = {block.mark for block in read_blocks(page) if block.language == language}
        if "" in marks:
            lane = [pytest.mark.compiled, *([] if page.name in FIRST else [pytest.mark.slow])]
            lane += [pytest.mark.own_loop] if page.name == "README.md" else []
            found.append(pytest.param(page, ("",), id=page.name, marks=lane))
        if "slow" in marks:
            found.append(
                pytest.param(
                    page, ("", "slow"), id=f"all-{page.name}", marks=[pytest.mark.slow, pytest.mark.compiled]
                )
            )
    return found


def stand_in(page: Path, folder: Path) -> None:
    """Copies the scenes beside a page into the folder in which its blocks run."""
    if page.parent == DOCS:
        shutil.copytree(DOCS / "scenes", folder / "scenes")


@pytest.fixture
def plugin_folder(monkeypatch):
    """The foreign package may be imported; what a page adds to the registry is taken out again."""
    if "stripes" not in kt.registry().names("broad phase"):
        monkeypatch.syspath_prepend(ROOT / "tests" / "foreign" / "kinetile-stripes")
    with remove():
        yield


@pytest.mark.parametrize(("page", "marks"), pages_with("python"))
def test_the_python_runs(page, marks, tmp_path, monkeypatch, plugin_folder):
    # A module of its own: Numba names a state's class by its module in the cache.
    module = ModuleType(f"page_{page.stem.replace('-', '_')}")
    monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.chdir(tmp_path)
    stand_in(page, tmp_path)
    for block in read_blocks(page):
        if block.language == "python" and block.mark in marks:
            code = compile("\n" * (block.line - 1) + block.text, str(page), "exec")
            exec(code, module.__dict__)


def test_a_hook_stops_in_the_debugger_as_printed(tmp_path):
    [printed] = [
        block.text for block in read_blocks(DOCS / "writing-a-broad-phase.md") if "(Pdb)" in block.text
    ]
    code = "".join(block.text for block in read_blocks(ROOT / "README.md") if block.language == "python")
    line = "    step = -1 if"
    code = code.replace(line, f"    breakpoint()\n{line}").replace(
        'scene, "columns")', 'scene, "columns", compiled=False)'
    )
    (tmp_path / "columns.py").write_text(code)
    typed = re.findall(r"\(Pdb\) (.*\n)", printed)
    ended = subprocess.run(
        [sys.executable, "columns.py"], input="".join(typed), cwd=tmp_path, capture_output=True, text=True
    )
    for each in typed:
        printed = printed.replace(each, "")
    assert printed.rstrip() in ended.stdout


def commands(block: Block) -> Iterator[tuple[str, int, list[str]]]:
    """Yields (command, exit code, lines of output) for each line of a console block that begins with $."""
    found: list[tuple[str, int, list[str]]] = []
    for line in block.text.splitlines():
        if line.startswith("$ "):
            code = CODE.search(line)
            found.append((CODE.sub("", line[2:]), int(code[1]) if code else 0, []))
        elif line.strip():
            found[-1][2].append(line)
    yield from found


def assert_shown(shown: list[str], output: str, where: str) -> None:
    """Asserts that the lines that a page shows are in the output, in their order."""
    pattern = r"\n".join(
        r"(?:.*\n)*?.*" if line.strip() == "..." else r".*?".join(map(re.escape, line.split("...")))
        for line in shown
    )
    said = "\n".join(line.rstrip() for line in output.splitlines() if line.strip())
    assert re.search(rf"^{pattern}$", said, re.MULTILINE), f"{where} is shown as\n{shown}\nbut says\n{said}"


def write(block: Block, folder: Path, begun: set[Path]) -> None:
    """Writes a block into its file: the first one of a page makes it, the others go to its end."""
    path = folder / block.detail
    made = path.exists() or path.parent == folder
    assert made, f"line {block.line}: no command before it has made {block.detail}"
    if path in begun:
        path.write_text(path.read_text(encoding="utf-8") + "\n\n" + block.text, encoding="utf-8")
    else:
        path.write_text(block.text, encoding="utf-8")
    begun.add(path)


def assert_runs(words: list[str], environment: dict[str, str], folder: Path, code: int, where: str) -> str:
    """Asserts that a kinetile command ends with an exit code; returns what it has printed.

    In this process, unless the command needs another environment: to start one takes a second.
    """
    settings = {}
    while SETTING.fullmatch(words[0]):
        name, _, value = words.pop(0).partition("=")
        settings[name] = value
    if environment | settings == dict(os.environ):
        result = CliRunner().invoke(app, words[1:])
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        ended, out, err = result.exit_code, result.stdout, result.stderr
    else:
        done = subprocess.run(
            [sys.executable, "-m", "kinetile", *words[1:]],
            cwd=folder,
            env=environment | settings,
            capture_output=True,
            text=True,
            timeout=1800,  # a guard against hanging, not a limit: a machine may be busy
        )
        ended, out, err = done.returncode, done.stdout, done.stderr
    assert ended == code, f"{where} ended with {ended}\n{out}{err}"
    return out if code == 0 else out + err


@pytest.fixture
def kinetile_alone():
    """The pages show what kinetile brings; `choose` runs every phase that is installed, examples too."""
    with remove(*(each.spec.name for each in kt.registry() if each.distribution != "kinetile")):
        yield


@pytest.mark.parametrize(("page", "marks"), pages_with("console"))
def test_the_commands_run(page, marks, tmp_path, monkeypatch, kinetile_alone):
    monkeypatch.chdir(tmp_path)
    stand_in(page, tmp_path)
    environment = dict(os.environ)
    begun: set[Path] = set()
    for block in read_blocks(page):
        if block.mark == "file":
            write(block, tmp_path, begun)
        if block.language != "console" or block.mark not in marks:
            continue
        for command, code, shown in commands(block):
            words = shlex.split(command, comments=True)
            where = f"{page.name}, line {block.line}: {command}"
            if words[:3] == ["pip", "install", "-e"]:
                paths = install(tmp_path / words[3].partition("[")[0], tmp_path / "site")
                paths += filter(None, [environment.get("PYTHONPATH")])
                environment["PYTHONPATH"] = os.pathsep.join(paths)
            elif "kinetile" in words and all(map(SETTING.fullmatch, words[: words.index("kinetile")])):
                output = assert_runs(words, environment, tmp_path, code, where)
                if shown:
                    assert_shown(shown, output, where)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_quotations_are_in_their_files(page):
    for block in read_blocks(page):
        if block.mark == "part of":
            source = (ROOT / block.detail).read_text(encoding="utf-8")
            assert block.text in source, f"{page.name}, line {block.line}: not in {block.detail}"


@pytest.mark.parametrize("page", LINKED, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_lead_somewhere(page):
    text = page.read_text(encoding="utf-8")
    for target in re.findall(r"(?:\]\(| src=\")([^)\s\"]+)[)\"]", text):
        path, _, anchor = target.partition("#")
        if "://" in target:
            continue
        found = (page.parent / path).resolve() if path else page
        assert found.exists(), f"{page.name} links to {target}"
        if anchor:
            headings = re.findall(r"^#+ (.+)$", found.read_text(encoding="utf-8"), re.MULTILINE)
            anchors = {re.sub(r"[^\w\- ]", "", each).lower().replace(" ", "-") for each in headings}
            assert anchor in anchors, f"{page.name} links to {target}; there are {sorted(anchors)}"


def test_all_keys_of_a_scene_file_stand_on_one_page():
    def keys(table):
        for name, field in table.keys.items():
            yield name
            yield from keys(field) if isinstance(field, FileTable) else ()

    shown = (DOCS / "scenes.md").read_text(encoding="utf-8").partition("All keys:")[2].partition("`save_")[0]
    assert {*re.findall(r"`\[?\[?([\w.-]+)", shown)} >= {*keys(_FILE)}


WORDS, MOST_PAGES = 49_000, 25
"""What readers have to read at most: README and docs, of which the pages of docs/api are one, counted as
``wc -w`` does. Raising a limit is a decision, to be written here with its reason. In November 2026 these are
left of 92,800 words on 47 pages (60 with those of docs/api); 600 are the rules of rest.
"""


def test_the_pages_have_no_more_words_than_decided(capsys):
    said = {page.name: len(page.read_text(encoding="utf-8").split()) for page in PAGES}
    api = sum(len(page.read_text(encoding="utf-8").split()) for page in DOCS.glob("api/*.md"))
    words, pages = sum(said.values()) + api, len(said) + 1
    with capsys.disabled():
        print(f"\n{words:,} words on {pages} pages (at most {WORDS:,} on {MOST_PAGES})")
    longest = sorted(said, key=said.__getitem__)[-5:]
    assert words <= WORDS, f"{words:,} words; the longest pages are {longest}: shorten one, or decide here"
    assert pages <= MOST_PAGES, f"{pages} pages: {sorted(said)}"
