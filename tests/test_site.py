"""The site of the documents is built without a warning, has everything, and loads nothing from a network.

The build runs notebooks and makes players, so it has a marker of its own: ``pytest -m site``.
"""

import importlib
import io
import re
import subprocess
import sys
import tomllib
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace

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
"""Folders of the site whose pages are tested elsewhere, or are all made alike."""

LONG = 150
"""Lines of a page that should have a picture."""

WITHOUT_PICTURE = {"command-line.md", "plugins.md"}
"""Long pages that are lists of packages and commands: nothing in them is to be seen."""

THEMES = [(system, theme) for system in ("light", "dark") for theme in ("auto", "light", "dark")]

ITEM = re.compile(r"^- \[[^\]]+\]\(([\w./-]+)\)", re.MULTILINE)
"""An item of the index: where it leads."""


def sentence() -> str:
    return (DOCS / "index.md").read_text(encoding="utf-8").split("\n\n")[1]


def test_readme_the_first_page_and_the_package_say_the_same():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert readme.split("\n\n")[1] == f"**{sentence()}**"
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["description"] == sentence()


@pytest.mark.parametrize("module", [kt, toolbox, records, kinetile_accuracy, kinetile_conformance, errors])
def test_every_public_name_has_its_place_in_the_interface(module):
    if module.__name__ in NAMED:
        return
    last = {name.rpartition(".")[2] for name in NAMED}
    missing = [name for name in module.__all__ if name not in last | ELSEWHERE]
    assert not missing, f"docs/api says nothing of {module.__name__}: {missing}"


def test_every_page_is_in_the_index():
    listed = set(ITEM.findall((DOCS / "index.md").read_text(encoding="utf-8")))
    assert {each for each in listed if each.endswith(".md") and "/" not in each} == {
        page.name for page in DOCS.glob("*.md") if page.name != "index.md"
    }


def test_every_long_page_has_a_picture():
    texts = {page.name: page.read_text(encoding="utf-8") for page in DOCS.glob("*.md")}
    bare = {name for name, text in texts.items() if not re.search(r"!\[|^```\{live\}", text, re.MULTILINE)}
    assert {name for name in bare if texts[name].count("\n") > LONG} == WITHOUT_PICTURE


def test_the_preview_has_an_absolute_address_where_that_of_the_site_is_known(monkeypatch):
    pytest.importorskip("sphinx", reason="needs Sphinx: pip install 'kinetile[docs]'")
    nodes = importlib.import_module("docutils.nodes")
    monkeypatch.syspath_prepend(DOCS / "_ext")
    head = importlib.import_module("head")
    page = nodes.section("", nodes.title("", "A page"), nodes.paragraph("", "Its 'first' paragraph."))
    config = SimpleNamespace(
        html_title="kinetile", html_baseurl="https://example.org/docs/", root_doc="index"
    )
    app = SimpleNamespace(config=config, env=SimpleNamespace(get_doctree=lambda name: page))
    context = {"title": "<em>A</em> page", "pageurl": "https://example.org/docs/page.html"}
    head.describe(app, "page", "page.html", context, page)
    assert (
        '<meta property="og:image" content="https://example.org/docs/_static/preview.png">'
        in context["metatags"]
    )
    assert '<meta property="og:title" content="A page">' in context["metatags"]
    assert '<meta name="description" content="Its &#x27;first&#x27; paragraph.">' in context["metatags"]


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The site's folder: built once, with warnings as errors, from nothing but the players that are kept."""
    pytest.importorskip("sphinx", reason="needs Sphinx: pip install 'kinetile[docs]'")
    folder = tmp_path_factory.mktemp("site")
    options = ("-W", "--keep-going", "-q", "-n", "-b", "html", "-d", str(tmp_path_factory.mktemp("doctrees")))
    command = [sys.executable, "-m", "sphinx", *options, str(DOCS), str(folder)]
    ended = subprocess.run(command, capture_output=True, text=True, check=False, timeout=1200)
    assert ended.returncode == 0, ended.stderr
    return folder


@pytest.mark.site
def test_it_is_built_without_a_warning_and_has_every_page(site):
    patterns = ("*.md", "api/*.md", "notebooks/*.ipynb")
    pages = {page.relative_to(DOCS).with_suffix("") for each in patterns for page in DOCS.glob(each)}
    built = {page.relative_to(site).with_suffix("") for page in site.rglob("*.html")}
    assert pages <= built
    assert (site / "searchindex.js").is_file()


@pytest.mark.site
def test_no_page_loads_from_the_network(site):
    loaded = [
        f"{page.relative_to(site)}: {place}"
        for page in site.rglob("*.html")
        for place in places(page).loaded
        if "://" in place or place.startswith("/")
    ]
    sheets = [*site.rglob("*.css")]
    loaded += [
        f"{sheet.name}: {place}"
        for sheet in sheets
        for place in re.findall(r"(?:url\(|@import )[\"']?([^\"')]+)", sheet.read_text(encoding="utf-8"))
        if place.startswith(("http", "//"))
    ]
    assert not loaded


@pytest.mark.site
def test_every_link_within_the_site_leads_to_a_file_and_a_place_in_it(site):
    pages = {page: places(page) for page in site.rglob("*.html")}
    lost = [
        f"{page.relative_to(site)}: {target}, which is not relative"
        for page, found in pages.items()
        for target in found.links
        if target.startswith(("/", "file:"))
    ]
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
def test_each_tile_of_the_gallery_is_a_picture_that_leads_to_its_page(site):
    wanted = len(
        re.findall("^kinetile view", (DOCS / "gallery.md").read_text(encoding="utf-8"), re.MULTILINE)
    )
    text = (site / "gallery.html").read_text(encoding="utf-8")
    tiles = re.findall(r'class="tile"><a [^>]*href="([^"]+\.html)"><img src="([^"]+\.svg)" alt="Play: ', text)
    assert len({page for page, _ in tiles}) == len({picture for _, picture in tiles}) == wanted > 12


@pytest.mark.site
def test_words_of_the_glossary_have_their_places(site):
    anchors = places(site / "promises.html").anchors
    assert {"term-certificate", "term-candidate-pair", "term-broad-phase", "term-tick"} <= anchors


@pytest.mark.site
@needs_chromium
@pytest.mark.parametrize("width", [390, 1280])
def test_a_checker_of_accessibility_finds_nothing(width, site, tmp_path):
    axe = install_axe(tmp_path)
    pages = [page for page in site.rglob("*.html") if page.relative_to(site).parts[0] not in UNREAD]
    assert len(pages) > 30
    found = {}
    with Browser(width) as browser:
        for page in (*pages, site / "source" / "tests" / "foreign" / "kinetile-stripes.html"):
            browser.visit(page)
            found[str(page.relative_to(site))] = violations(browser, axe)
        search(browser, site, "skin")
        found["search.html?q=skin"] = violations(browser, axe)
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


@pytest.mark.site
def test_the_sidebar_has_the_pages_in_the_order_of_the_index(site):
    listed = ITEM.findall((DOCS / "index.md").read_text(encoding="utf-8"))
    expected = [re.sub(r"\.(md|ipynb)$", ".html", target) for target in listed]
    bar = (site / "index.html").read_text(encoding="utf-8").partition('class="sidebar-tree"')[2]
    assert re.findall(r'<li class="toctree-l1[^"]*"><a class="[^"]*" href="([^"]+)"', bar) == expected


@pytest.mark.site
def test_every_page_has_an_icon_a_description_and_a_preview(site):
    first = sentence()
    assert places(site / "index.html").said["description"] == first
    lacking = []
    for page in site.rglob("*.html"):
        if page.relative_to(site).parts[0] != "_live":
            found = places(page)
            whole = 20 < len(found.said.get("description", "")) <= 200
            picture = page.parent / found.said.get("og:image", "nowhere")
            icon = any(place.endswith("favicon.svg") for place in found.loaded)
            if not (whole and picture.is_file() and icon and found.said["og:title"]):
                lacking.append(str(page.relative_to(site)))
    assert not lacking


@pytest.mark.site
@needs_chromium
@pytest.mark.parametrize(("width", "height"), [(390, 844), (1280, 800)])
def test_the_first_screen_has_the_sentence_and_a_program(width, height, site):
    with Browser(width, height) as browser:
        browser.visit(site / "index.html")
        shown = ["h1 + p", "article .highlight-sh", "article .highlight-python"]
        ends = [browser.value(f"{BOUNDS}('{each}').bottom") for each in shown]
        assert 0 < ends[0] < ends[1] < ends[2] < height
        assert browser.value("document.documentElement.scrollWidth") == width


@pytest.mark.site
@needs_chromium
@pytest.mark.parametrize(("word", "stem"), [("skin", "skin"), ("certificate", "certif")])
def test_a_search_from_a_folder_has_excerpts_and_logs_nothing(word, stem, site):
    with Browser() as browser:
        results = search(browser, site, word)
        assert len(results) > 10
        assert browser.said() == []
        assert {address.partition(":")[0] for address in browser.asked_for()} <= {"data", "file"}
    assert [text for text, excerpt in results if stem not in excerpt.lower()] == []


@pytest.mark.site
@needs_chromium
@pytest.mark.parametrize(("system", "theme"), THEMES)
def test_a_figure_follows_the_switch_of_the_theme(system, theme, site):
    image = pytest.importorskip("PIL.Image")
    with Browser(dark=system == "dark") as browser:
        browser.visit(site / "cells.html")
        browser.value(f"void (document.body.dataset.theme = '{theme}')")
        browser.value("document.querySelector('article img').scrollIntoView()")
        place = browser.value(f"{BOUNDS}('article img')")
        picture = image.open(io.BytesIO(browser.photograph())).convert("L")
    is_light = picture.getpixel((round(place["left"]) + 5, round(place["top"]) + 100)) > 128
    assert is_light == ((system if theme == "auto" else theme) == "light")


BOUNDS = "((each) => document.querySelector(each).getBoundingClientRect().toJSON())"
"""A function of JavaScript: where an element is in the window."""


def search(browser: Browser, site: Path, word: str) -> list[list[str]]:
    """Searches for a word; returns of each result that should have an excerpt its text and the excerpt."""
    browser.visit(site / "search.html", f"?q={word}")
    done = "document.querySelector('.search-summary')?.innerText"
    while not browser.value(done):
        browser.settle()
    browser.settle()
    results = """[...document.querySelectorAll('ul.search li')]
        .filter((each) => !each.querySelector(':scope > span'))
        .map((each) => [each.innerText, each.querySelector('.context')?.innerText ?? ''])"""
    return list(browser.value(results))


class Places(HTMLParser):
    """What a page links to, what it loads, the places in it, and what its head says of it."""

    def __init__(self) -> None:
        super().__init__()
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.anchors: set[str] = set()
        self.said: dict[str, str] = {}

    def handle_starttag(self, tag, attrs):
        given = {name: value or "" for name, value in attrs}
        self.anchors |= {given[name] for name in ("id", "name") if name in given}
        if tag == "a" and "href" in given:
            self.links.append(given["href"])
        if tag == "meta" and "content" in given:
            self.said[given.get("name") or given.get("property", "")] = given["content"]
        if tag == "link" and {*given.get("rel", "").split()} & {"stylesheet", "icon", "preload", "search"}:
            self.loaded.append(given.get("href", ""))
        if tag in ("script", "img", "iframe", "source") and given.get("src"):
            self.loaded.append(given["src"])


def places(page: Path) -> Places:
    found = Places()
    found.feed(page.read_text(encoding="utf-8"))
    return found
