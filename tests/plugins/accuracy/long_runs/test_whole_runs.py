"""The part of the report on runs that are certified to the end."""

import numpy as np
import pytest

import kinetile as kt
from kinetile_accuracy.long_runs import whole_runs as part
from kinetile_accuracy.long_runs.whole_runs import SCENES, measure


@pytest.fixture
def few(monkeypatch):
    monkeypatch.setitem(part.CONTACTS, "quick", 300)
    monkeypatch.setattr(part, "SCENES", {name: SCENES[name] for name in ("dense gas", "lattice of ties")})


@pytest.mark.compiled
def test_runs_are_right_to_the_end(few):
    told = []
    found = measure("quick", lambda *step: told.append(step))
    rows = found.tables[0].rows
    assert [row.scene for row in rows] == ["dense gas", "lattice of ties"]
    assert all(row.right and row.lines == row.contacts > 50 for row in rows)
    assert [claim.holds for claim in found.claims] == [True]
    assert len(told) == 2


@pytest.mark.compiled
def test_a_wrong_run_is_reported(few, monkeypatch):
    class Wrong(kt.Simulation):
        @property
        def contacts(self):
            found = np.array(super().contacts)
            found["tick"][7] += 1
            return found

    monkeypatch.setattr(kt, "Simulation", Wrong, raising=False)
    found = measure("quick", lambda *step: None)
    assert [claim.holds for claim in found.claims] == [False]
    assert "dense gas: line 8 is wrong" in found.findings[0]
    assert "its tick should be" in found.findings[0]
