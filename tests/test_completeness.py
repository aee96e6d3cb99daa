"""What belongs to a change is there: a name is in a page, an option and a reading in a docstring, and
CONTRIBUTING.md names files and tests that exist."""

import ast
import inspect
import json
import re
from dataclasses import fields
from pathlib import Path
from pkgutil import resolve_name
from textwrap import dedent
from typing import get_args

import pytest

import kinetile as kt
from agreement import ALL
from kinetile.errors import BadOption
from kinetile.kernel.compiled import python_of
from kinetile.kernel.loop.commands import brings, takes
from kinetile.kernel.tables import allocate, fields_in
from kinetile.plugin.registry import registry
from kinetile.run.advance import EventKind
from kinetile.run.readings import Readings
from kinetile.scene.commands import COME_OR_GO, COMMAND_KINDS, CommandKind, Does
from kinetile.show.player.recording import PLAYED_KINDS
from kinetile_accuracy.specification.course import EVENTS

ROOT = Path(__file__).parents[1]
PAGES = "\n".join(page.read_text(encoding="utf-8") for page in sorted((ROOT / "docs").rglob("*.md")))
PAGE_OF = {
    "response": "docs/living-scenes.md",
    "observable": "docs/observables.md",
    "scene": "docs/scenes.md",
}
BUILT_IN = [
    (said["kind"], said["name"])
    for said in registry().as_dicts()["provided"]
    if said["distribution"] == "kinetile" and not said["name"].startswith("_")
]
OF_ALL = {"scene", "self", "rng", "seed"}
"""Arguments that are no options, and the one that every recipe has which draws."""


def demand(condition: object, missing: str) -> None:
    """Fails with a sentence alone, not with the texts that were searched."""
    if not condition:
        pytest.fail(f"{missing} (CONTRIBUTING.md, Where a change goes)", pytrace=False)


@pytest.mark.parametrize(("kind", "name"), BUILT_IN)
def test_a_name_is_in_its_page_and_its_options_are_said(kind: str, name: str) -> None:
    page = PAGE_OF.get(kind, "docs")
    text = PAGES if page == "docs" else (ROOT / page).read_text(encoding="utf-8")
    demand(f"`{name}`" in text, f"the {kind} {name!r} is not in {page}")
    target = registry().spec(kind, name).target
    target = resolve_name(target) if isinstance(target, str) else target
    told = "\n".join(inspect.getdoc(each) or "" for each in (target, getattr(target, "__init__", target)))
    for option in set(inspect.signature(target).parameters) - OF_ALL:
        if kind == "observable":
            said = re.search(rf"\b{option}\b", told) or f"`{option}`" in text
            demand(
                said,
                f"the option {option!r} of the {kind} {name!r} is neither in its docstring nor in {page}",
            )
            continue
        line = re.search(rf"^\s*{option}: \S", told, re.MULTILINE)
        demand(line, f"the option {option!r} of the {kind} {name!r} has no line '{option}: ...' under Args:")


ELSEWHERE = {
    ("cells", "side"): "tests/plugins/cells/test_audit.py",
    ("power", "cells"): "tests/plugins/test_drawing.py",
}
"""Options that change no contact's way to the log, or have scenes of their own, and what tries them."""

OPTIONS = [
    (name, option)
    for kind, name in BUILT_IN
    if kind == "broad phase"
    for option in inspect.signature(registry().target(kind, name)).parameters
]


@pytest.mark.parametrize(("phase", "option"), OPTIONS)
def test_an_option_of_a_broad_phase_is_tried_and_refuses_what_is_no_value(phase: str, option: str) -> None:
    rows = {(name, each) for name, options in ALL for each in options}
    demand((phase, option) in rows | {*ELSEWHERE}, f"the option {option!r} of {phase} has no row in ALL")
    text = (ROOT / ELSEWHERE.get((phase, option), "tests/agreement.py")).read_text(encoding="utf-8")
    assert f'"{option}"' in text
    with pytest.raises(BadOption, match=option):
        registry().target("broad phase", phase)(**{option: object()})


def test_a_field_of_an_insertion_is_an_argument_of_insert_and_of_insert_many() -> None:
    all_fields = {*kt.Insert._fields} - {"time", "body", "at"}
    plural = {"positions": "position", "velocities": "velocity"}
    for call, demanded in (
        (kt.Simulation.insert, all_fields),
        (kt.Simulation.insert_many, all_fields - {"name"}),  # which is that of one body
    ):
        nodes = ast.walk(ast.parse(dedent(inspect.getsource(call))))
        used = {node.id for node in nodes if isinstance(node, ast.Name)}
        given = {plural.get(each, each) for each in inspect.signature(call).parameters if each in used}
        demand(given - {"self"} == demanded, f"{call.__name__} hands on {given}; an insertion has {demanded}")


@pytest.mark.parametrize("kind", COMMAND_KINDS, ids=lambda each: each.word)
def test_a_command_of_scenes_is_known_to_events_pages_and_the_certifier(kind: CommandKind) -> None:
    name = kind.made.__name__
    demand(kind.event in get_args(EventKind), f"EventKind has no {kind.event!r}")
    demand(python_of(brings)(kind.code) == (Does.BRINGS in kind.does), "kernel/loop/commands.py: brings")
    demand(python_of(takes)(kind.code) == (Does.TAKES in kind.does), "kernel/loop/commands.py: takes")
    rows = (ROOT / "core/kinetile/show/player/script/run/rows.mjs").read_text(encoding="utf-8")
    played = json.loads(re.search(r"KINDS = (\[.*\]);", rows)[1])
    demand(played == [*PLAYED_KINDS] and kind.event in played, f"rows.mjs has {played}")
    demand(kind.made in EVENTS or kind in COME_OR_GO, f"course.EVENTS has no {name}")
    demand(name in kt.__all__, f"kinetile has no {name}")


INTERNAL = {"alike", "composition", "counted", "declares_kinds", "ruled"}
"""What packages of this project use is a function of a module, not an attribute that completion offers."""
CLASSES = [each for each in (getattr(kt, name) for name in kt.__all__) if isinstance(each, type)]


@pytest.mark.parametrize("public", CLASSES, ids=lambda each: each.__name__)
def test_dir_showed_names_that_no_page_has(public: type) -> None:
    """A page has the members with a docstring, inherited ones if it says so, and what the class's says."""
    pages = "\n".join(page.read_text(encoding="utf-8") for page in (ROOT / "docs" / "api").glob("*.md"))
    said = re.search(rf"autoclass:: kinetile\.{public.__name__}\n((?:   :.*\n)*)", pages)
    assert said, f"docs/api has no {public.__name__}"
    own = {*vars(public), *getattr(public, "__annotations__", ())}
    shown = {name for name in {*dir(public), *own} if not name.startswith("_")} - {"count", "index"}
    has = shown if ":inherited-members:" in said[1] else own if ":members:" in said[1] else set()
    told = {name for name in has if hasattr(public, name) and inspect.getdoc(getattr(public, name))}
    told.update(re.findall(r"\w+", f"{public.__doc__}{inspect.signature(public)}"))
    assert shown <= told
    assert not shown & INTERNAL


def test_a_reading_is_said_with_its_unit() -> None:
    told = inspect.getdoc(Readings) or ""
    for field in fields(Readings):
        line = re.search(rf"^\s*{field.name}: \S", told, re.MULTILINE)
        demand(line, f"the reading {field.name!r} has no line, with its unit, under Attributes: of Readings")


def test_the_table_of_laws_names_tests_that_exist() -> None:
    page = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    named = re.findall(r"`((?:tests|core|plugins|docs)/[\w./-]+)(?:::(\w+))?`", page)
    assert len(named) > 60
    for path, test in named:
        found = ROOT / path
        assert found.exists(), f"CONTRIBUTING.md names {path}"
        assert not test or f"def {test}(" in found.read_text(encoding="utf-8"), (
            f"CONTRIBUTING.md names {test}"
        )


def test_what_all_tests_take_is_one_figure() -> None:
    """The line that pytest printed and CONTRIBUTING.md had different ones, both too large."""
    for name in ("CONTRIBUTING.md", "tests/conftest.py"):
        text = (ROOT / name).read_text(encoding="utf-8")
        demand("CPU_SECONDS" in text, f"{name} does not take the cost of all tests from tests/cost.py")
    assert not re.search(
        r"^\| `pytest` \|.*\d \|$", (ROOT / "CONTRIBUTING.md").read_text("utf-8"), re.MULTILINE
    )


def test_each_law_has_a_guard_in_the_default_lane() -> None:
    page = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    rows = page.partition("| law | held by | lane |")[2].strip().splitlines()[1:]
    assert len(rows) > 30
    for row in rows:
        law, held, lane = (each.strip() for each in row.strip("|").split(" | "))
        assert {"default", "quick"} & {*lane.split(", ")}, f"nothing holds {law!r} in the default lane"
        marked = [_is_slow(path, test) for path, test in re.findall(r"`(tests/[\w./-]+\.py)::(\w+)`", held)]
        assert not marked or not all(marked), f"all that holds {law!r} is slow"


def _is_slow(path: str, test: str) -> bool:
    above = (ROOT / path).read_text(encoding="utf-8").partition(f"\ndef {test}(")[0].rpartition("\n\n")[2]
    return re.search(r"^@pytest\.mark\.(slow|long)$", above, re.MULTILINE) is not None


OWN = ("cells/*", "n*", "power/*", "so*", "sweep_*", "sweep_*/*")
OTHERS = ("docs/examples/closest_pair", "docs/examples/*/*/sorted_list", "tests/foreign/*/*/stripes")
STRUCTURES = [*(f"plugins/kinetile_plugins/{each}" for each in OWN), *OTHERS]


def _read(node: ast.AST, names: dict[str, str]) -> str:
    """Returns what an expression reads of ``k``, such as "k.clock.now", or nothing."""
    if isinstance(node, ast.Attribute):
        before = _read(node.value, names)
        return before and f"{before}.{node.attr}"
    if isinstance(node, ast.Subscript):
        return _read(node.value, names)
    return names.get(node.id, "") if isinstance(node, ast.Name) else ""


def test_hooks_of_broad_phases_read_what_the_table_of_their_page_has() -> None:
    page = (ROOT / "docs/writing-a-broad-phase.md").read_text(encoding="utf-8").replace("[i]", "")
    rows = re.findall(r"^\| `(k[\w.\[\]]+)`(?:: `([\w ]+)`)? \| ", page.replace("[0]", ""), re.MULTILINE)
    told = {f"{table}.{field}".strip(".") for table, fields in rows for field in fields.split(" ")}
    tables = {f"k.{name}": fields_in(each.dtype) for name, each in allocate(2, 2, 2)._asdict().items()}
    there = {f"{name}.{field}" for name, fields in tables.items() for field in fields} | {"k.near"}
    assert told <= there
    read = set()
    for path in (path for each in STRUCTURES for path in ROOT.glob(f"{each}.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef) and "hook" in map(ast.unparse, node.decorator_list):
                names = {"k": "k"}
                for each in (*ast.walk(node), *ast.walk(node)):  # twice: names are given before they are read
                    read.add(_read(each, names))
                    if isinstance(each, ast.Assign) and isinstance(each.targets[0], ast.Name):
                        names[each.targets[0].id] = _read(each.value, names)
    found = read - {"", "k", *(each.rpartition(".")[0] for each in there)}
    demand(found <= told, f"no row of What hooks may read has {found - told}")
    assert len(found) > 15
