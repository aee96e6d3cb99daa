"""The site of the documents is built without a warning, has everything, and asks no network for anything.

The build runs notebooks and makes players, so it has a marker of its own: ``pytest -m site``.
"""

from __future__ import annotations

import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import pytest

import kinetile as kt
import kinetile_accuracy
import kinetile_conformance
from accessibility import install_axe, violations
from chromium import Browser, needs_chromium
from kinetile import errors, records, toolbox

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
API = "\n".join(page.read_text(encoding="utf-8") for page in sorted((DOCS / "api").glob("*.md")))
NAMED = set(re.findall(r"^\.\. auto\w+:: ([\w.]+)$", API, flags=re.MULTILINE))

ELSEWHERE = {"__version__", "kinetile_conformance", "errors"}
"""Names of ``kinetile`` that are no part of its interface's pages, or have a page of their own."""


UNREAD = {"_live", "source"}
"""Folders of the site whose pages are looked at elsewhere, or are all of one make."""


@pytest.mark.parametrize("module", [kt, toolbox, records, kinetile_accuracy, kinetile_conformance, errors])
def test_every_public_name_has_its_place_in_the_interface(module):
    if module.__name__ in NAMED:
        return
    last = {name.rpartition(".")[2] for name in NAMED}
    missing = [name for name in module.__all__ if name not in last | ELSEWHERE]
    assert not missing, f"docs/api says nothing of {module.__name__}: {missing}"


def test_every_page_is_in_the_index():
    index = (DOCS / "index.md").read_text(encoding="utf-8")
    listed = set(re.findall(r"^- \[[^\]]+\]\(([\w.-]+\.md)\)", index, flags=re.MULTILINE))
    assert listed == {page.name for page in DOCS.glob("*.md")} - {"index.md"}


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The site's folder: built once, with warnings as errors, from nothing but the players that are kept."""
    pytest.importorskip("sphinx", reason="needs Sphinx: pip install 'kinetile[docs]'")
    folder = tmp_path_factory.mktemp("site")
    options = ("-W", "--keep-going", "-q", "-n", "-b", "html")
    command = [sys.executable, "-m", "sphinx", *options, str(DOCS), str(folder)]
    ended = subprocess.run(command, capture_output=True, text=True, check=False, timeout=1200)
    assert ended.returncode == 0, ended.stderr
    return folder


@pytest.mark.site
def test_it_is_built_without_a_warning_and_has_every_page(site):
    patterns = ("*.md", "api/*.md", "cookbook/*.md", "notebooks/*.ipynb")
    pages = {page.relative_to(DOCS).with_suffix("") for each in patterns for page in DOCS.glob(each)}
    built = {page.relative_to(site).with_suffix("") for page in site.rglob("*.html")}
    assert pages <= built
    assert (site / "searchindex.js").is_file()


@pytest.mark.site
def test_no_page_asks_the_network_for_anything(site):
    asked = [
        f"{page.relative_to(site)}: {place}"
        for page in site.rglob("*.html")
        for place in places(page).loaded
        if "://" in place or place.startswith("//")
    ]
    sheets = [*site.rglob("*.css")]
    asked += [
        f"{sheet.name}: {place}"
        for sheet in sheets
        for place in re.findall(r"(?:url\(|@import )[\"']?([^\"')]+)", sheet.read_text(encoding="utf-8"))
        if place.startswith(("http", "//"))
    ]
    assert not asked


@pytest.mark.site
def test_every_link_within_the_site_leads_to_a_file_and_a_place_in_it(site):
    pages = {page: places(page) for page in site.rglob("*.html")}
    lost = []
    for page, found in pages.items():
        for target in (*found.links, *found.loaded):
            path, _, anchor = target.partition("#")
            if re.match(r"\w+:", target):
                continue
            there = (page.parent / path.partition("?")[0]).resolve() if path else page
            known = pages[there].anchors if there in pages else None
            if not there.exists() or (anchor and known is not None and anchor not in known):
                lost.append(f"{page.relative_to(site)}: {target}")
    assert not lost


@pytest.mark.site
def test_words_of_the_glossary_have_their_places(site):
    anchors = places(site / "glossary.html").anchors
    assert {"term-certificate", "term-candidate-pair", "term-broad-phase", "term-tick"} <= anchors


@pytest.mark.site
@needs_chromium
@pytest.mark.parametrize("width", [390, 1280])
def test_a_checker_of_accessibility_finds_nothing(width, site, tmp_path):
    axe = install_axe(tmp_path)
    pages = [page for page in site.rglob("*.html") if page.relative_to(site).parts[0] not in UNREAD]
    assert len(pages) > 40
    found = {}
    with Browser(width) as browser:
        for page in (*pages, site / "source" / "tests" / "foreign" / "kinetile-stripes.html"):
            browser.visit(page)
            found[str(page.relative_to(site))] = violations(browser, axe)
    assert {page: complaints for page, complaints in found.items() if complaints} == {}


@pytest.mark.site
@needs_chromium
@pytest.mark.parametrize("page", ["index", "thesis-figures"])
def test_the_wheel_scrolls_past_a_player_and_the_player_logs_nothing(page, site):
    with Browser(1280, 800) as browser:
        browser.visit(site / f"{page}.html")
        browser.value("document.querySelector('iframe').scrollIntoView()")
        browser.value("new Promise((done) => setTimeout(() => done(true), 3000))")  # it is loaded when seen
        at = browser.value("scrollY")
        left, width = browser.value(
            "(({ left, width }) => [left, width])(document.querySelector('iframe').getBoundingClientRect())"
        )
        for _ in range(40):
            where = {"x": left + width / 3, "y": 200, "deltaX": 0, "deltaY": 100}
            browser.ask("Input.dispatchMouseEvent", type="mouseWheel", **where)
            browser.value("new Promise((done) => setTimeout(() => done(true), 50))")
        assert browser.value("scrollY") > at + 400
        assert browser.said() == []


class Places(HTMLParser):
    """What a page links to, what it loads, and the places in it."""

    def __init__(self) -> None:
        super().__init__()
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.anchors: set[str] = set()

    def handle_starttag(self, tag, attrs):
        given = {name: value or "" for name, value in attrs}
        self.anchors |= {given[name] for name in ("id", "name") if name in given}
        if tag == "a" and "href" in given:
            self.links.append(given["href"])
        if tag == "link" and given.get("rel") in ("stylesheet", "icon", "preload", "search"):
            self.loaded.append(given.get("href", ""))
        if tag in ("script", "img", "iframe", "source") and given.get("src"):
            self.loaded.append(given["src"])


def places(page: Path) -> Places:
    """Return what stands in a page."""
    found = Places()
    found.feed(page.read_text(encoding="utf-8"))
    return found
