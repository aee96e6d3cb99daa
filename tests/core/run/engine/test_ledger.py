"""The ledger of contacts: where they are kept does not show."""

import numpy as np
import pytest

import kinetile as kt
from kinetile.run.engine import ledger


@pytest.mark.small
@pytest.mark.parametrize("at_once", [7, 20, 1000])
def test_contacts_on_large_pages_are_the_same(monkeypatch, at_once):
    scene = kt.make_scene("grid", bodies=16, density=0.5, seed=1)
    plain = kt.Simulation(scene, "cells")
    plain.run(max_contacts=60)
    monkeypatch.setattr(ledger, "LONG", 20)
    monkeypatch.setattr(ledger, "AT_ONCE", at_once)
    sim = kt.Simulation(scene, "cells")
    for part in (10, 10, 9, 1, 5, 5, 20):
        sim.run(max_contacts=part)
        if part == 5:
            early = sim.contacts.copy()
            assert np.array_equal(early, plain.contacts[: len(early)])
    assert np.array_equal(sim.contacts, plain.contacts)
    assert sim.fingerprint == plain.fingerprint
