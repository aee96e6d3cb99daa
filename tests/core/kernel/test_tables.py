"""The kernel's records: what a field is called matters where the loop is interpreted."""

import mmap
from typing import Any

import numpy as np
import pytest

from kinetile.kernel.tables import BODY, PAGE, allocate, declared, fields_in, record, record_table

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


def _refuse(*arguments: Any) -> None:
    raise OSError(22, "Invalid argument")


@pytest.mark.parametrize("system", ["as it is", "has no large pages", "does not map"])
@pytest.mark.parametrize("dtype", [BODY, np.dtype(np.int32)])
def test_a_table_is_zeroed_and_begins_on_a_cache_line_with_large_pages_or_without(dtype, system, monkeypatch):
    if system == "has no large pages":
        monkeypatch.delattr(mmap, "MADV_HUGEPAGE", raising=False)
    if system == "does not map":
        monkeypatch.setattr(mmap, "mmap", _refuse)
    for length in (1, 3, PAGE // dtype.itemsize + 1):
        table = record_table(dtype, length)
        assert len(table) == length
        assert table.ctypes.data % 64 == 0
        assert not table.view(np.ndarray).view(np.uint8).any()
        table[length // 2 : length // 2 + 1] = np.ones(1, dtype)
        assert table.view(np.ndarray).view(np.uint8).any()


def test_a_table_that_no_memory_holds_is_out_of_memory():
    with pytest.raises(MemoryError):
        record_table(BODY, 1 << 50)
