"""The kernel's records read alike compiled and interpreted."""

from __future__ import annotations

import numpy as np
import pytest

from kinetile.kernel.tables import allocate


@pytest.mark.parametrize(
    "table", [name for name, array in allocate(1, 1, 1)._asdict().items() if array.dtype.names]
)
def test_a_field_was_hidden_by_what_numpys_records_have_by_that_name(table):
    """Interpreted, ``record.base`` was the array that the record views, and not the field."""
    names = getattr(allocate(1, 1, 1), table).dtype.names
    assert [name for name in names if hasattr(np.record, name)] == []
