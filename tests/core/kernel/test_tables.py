"""The kernel's records: what a field is called matters where the loop is interpreted."""

from __future__ import annotations

import numpy as np
import pytest

from kinetile.kernel.tables import allocate, fields_in

TABLES = [name for name, table in allocate(2, 2, 2)._asdict().items() if table.dtype.names]


@pytest.mark.parametrize("name", TABLES)
def test_no_field_is_hidden_by_an_attribute_of_numpy_s_records(name: str) -> None:
    """A field called ``base`` was: interpreted, no contact could be logged."""
    table = getattr(allocate(2, 2, 2), name)
    names = {part for field in fields_in(table.dtype) for part in field.split(".")}
    assert not names & (set(dir(np.record)) | set(dir(np.recarray)))
