"""The kernel's records: the name of a field matters where the loop is interpreted."""

import ast
import inspect
import mmap
import re
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages
from typing import Any

import numpy as np
import pytest

import kinetile.kernel
import kinetile.run
from kinetile.kernel import loop as reasons
from kinetile.kernel.features import FEATURES
from kinetile.kernel.loop import loop
from kinetile.kernel.tables import (
    BODY,
    CARRIED,
    CLOCK,
    DUE,
    ENTRY,
    ON_LARGE_PAGES,
    PAGE,
    TICK,
    allocate,
    declared,
    fields_in,
    record,
    record_table,
)

TABLES = [name for name, table in allocate(2, 2, 2)._asdict().items() if table.dtype.names]


@pytest.mark.parametrize("name", TABLES)
def test_no_field_is_hidden_by_an_attribute_of_numpy_s_records(name: str) -> None:
    """A field called ``base`` was: interpreted, no contact could be logged."""
    table = getattr(allocate(2, 2, 2), name)
    names = {part for field in fields_in(table.dtype) for part in field.split(".")}
    assert not names & (set(dir(np.record)) | set(dir(np.recarray)))


def test_each_field_of_a_table_is_declared() -> None:
    missing = {name for name in TABLES if not declared(getattr(allocate(2, 2, 2), name).dtype)}
    assert missing - {"met"} == set(), "a table is no record() of fields that say what they are"


def test_a_field_that_is_not_declared_is_refused_in_a_sentence() -> None:
    with pytest.raises(TypeError, match="field 'pulse' does not say what it is and what becomes of it"):
        record(*declared(BODY), ("pulse", "i8"))


AWAITED = r"\w+ = (\S+)\n +if \w+ < at"
"""In ``next_event``: another tick than the head of the queue has, compared with it."""


def test_what_the_loop_awaits_besides_the_queue_is_a_saved_tick_that_no_contact_runs_ahead_of() -> None:
    """A contact that is not filed must not be before it; it must move with the clock's base; and a run that
    goes on from a file must have it."""
    first, unfiled = (inspect.getsource(each) for each in (loop.next_event, loop.comes_next))
    awaited = re.findall(AWAITED, first.replace("k.clock[0]", "clock"))
    assert "clock.torus.beat" in awaited
    assert [each for each in awaited if each not in unfiled] == []
    ticks = {f"clock.{each.name}" for each in declared(CLOCK, TICK, DUE) if each.role == CARRIED}
    assert {each for each in awaited if each.startswith("clock.")} <= ticks


def test_each_reason_of_the_loop_is_known_to_what_runs_it_and_a_feature_has_one_meaning() -> None:
    texts = [path.read_text() for path in Path(kinetile.run.__path__[0]).rglob("*.py")]
    nodes = [node for text in texts for node in ast.walk(ast.parse(text))]
    named = {name for name, value in vars(reasons).items() if type(value) is int}
    assert "WATCHED" in named
    assert named - {node.id for node in nodes if isinstance(node, ast.Name)} == {"NO_REASON"}
    for package in (kinetile.kernel, kinetile.run):
        for found in walk_packages(package.__path__, f"{package.__name__}."):
            module = vars(import_module(found.name))
            assert [each for each in {*FEATURES} & {*module} if module[each] is not FEATURES[each]] == []
    page = (Path(__file__).parents[3] / "CONTRIBUTING.md").read_text(encoding="utf-8")
    rows = [f"| `{each.name}` | {each.does} | {each.set_by} |" for each in FEATURES.values()]
    assert "\n".join(rows) in page


def _refuse(*arguments: Any) -> None:
    raise OSError(22, "Invalid argument")


@pytest.mark.parametrize("system", ["as it is", "has no large pages", "does not map"])
@pytest.mark.parametrize("dtype", [BODY, np.dtype(np.int32)])
def test_a_table_is_zeroed_and_begins_on_a_cache_line_with_large_pages_or_without(dtype, system, monkeypatch):
    if system == "has no large pages":
        monkeypatch.delattr(mmap, "MADV_HUGEPAGE", raising=False)
    if system == "does not map":
        monkeypatch.setattr(mmap, "mmap", _refuse)
    for length in (1, 3, ON_LARGE_PAGES // dtype.itemsize + 1, PAGE // dtype.itemsize + 1):
        table = record_table(dtype, length)
        assert len(table) == length
        assert table.ctypes.data % 64 == 0
        assert not table.view(np.ndarray).view(np.uint8).any()
        table[length // 2 : length // 2 + 1] = np.ones(1, dtype)
        assert table.view(np.ndarray).view(np.uint8).any()


def test_tables_that_share_large_pages_are_apart():
    tables = [
        record_table(np.dtype(np.int32), length) for length in (1 << 16, 1 << 17, 1 << 18, 1 << 19, 1 << 20)
    ]
    for number, table in enumerate(tables, 1):
        assert not table.any()
        table[:] = number
    assert all((table == number).all() for number, table in enumerate(tables, 1))


def test_a_table_that_no_memory_holds_is_out_of_memory():
    with pytest.raises(MemoryError):
        record_table(BODY, 1 << 50)


def test_a_body_and_its_entry_are_a_cache_line_each():
    assert (BODY.itemsize, ENTRY.itemsize) == (64, 64), "take their spare field for a new one"
