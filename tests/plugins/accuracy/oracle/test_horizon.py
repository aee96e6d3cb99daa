"""The part of the report on agreement with the oracle: its arithmetic, its sentences, its picture."""

from __future__ import annotations

import numpy as np
import pytest

import kinetile as kt
from kinetile_accuracy.oracle import horizon as horizon
from kinetile_accuracy.oracle.agreement import certify
from kinetile_accuracy.oracle.horizon import (
    REQUIREMENTS,
    Horizon,
    collisions_in_common,
    measure,
    measure_horizon,
)
from kinetile_accuracy.oracle.oracle import oracle_contacts
from kinetile_accuracy.sections import Section

pytest.importorskip("flint", reason="the certified oracle needs python-flint")

CASE = REQUIREMENTS[2]
"""That all densities hold what is required is for ``test_agreement.py``."""


@pytest.fixture(scope="module")
def section() -> Section:
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(horizon.SEEDS, "quick", 1)
        patch.setattr(horizon, "REQUIREMENTS", (CASE,))
        return measure("quick", lambda what, done, total: None)


@pytest.fixture(scope="module")
def whole(section: Section) -> Horizon:
    (row,) = section.tables[0].rows
    assert isinstance(row, Horizon)
    return row


@pytest.mark.compiled
def test_a_run_has_a_horizon_and_so_have_its_twins(whole: Horizon, section: Section) -> None:
    assert (whole.density, whole.bodies, whole.required) == CASE
    assert whole.contacts_per_disc >= whole.required
    assert whole.collisions_per_disc < whole.contacts_per_disc
    assert 0.8 < whole.collisions_per_disc / whole.twin_collisions_per_disc < 1.25
    assert 0.5 < whole.first_ticks < 32.0
    assert 2.0 < whole.growth < 8.0
    assert whole.differs.startswith(f"contact {whole.contacts}: ")
    assert [claim.holds for claim in section.claims] == [True, True]
    said, discs, errors = section.findings
    assert "(4.5 required) at density 0.01" in said
    assert "(their twins " in discs
    assert f"the error grows by {whole.growth:.1f} bits at density 0.01" in errors


@pytest.mark.compiled
def test_twins_do_not_depend_on_how_far_the_run_agrees(
    whole: Horizon, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A run that agrees for a few contacts alone is told how few: its twins go on for as long as ever."""
    monkeypatch.setattr(horizon, "certify", lambda sim, max_contacts: certify(sim, max_contacts=3))
    found, short = measure_horizon(CASE, 0)
    assert found.contacts == short.contacts == 3
    assert short.twin_collisions_per_disc == whole.twin_collisions_per_disc
    assert short.collisions_per_disc < 0.1 * short.twin_collisions_per_disc


def test_a_twin_that_never_departs_is_left_in_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = kt.Scene([[0.5, 0.5], [0.5, 1.5]], [[1.0, 0.5], [0.75, -0.5]], 0.25, arena=(1.0, 2.0))
    monkeypatch.setattr(horizon, "LONG_ENOUGH", 50)
    (pace,) = collisions_in_common(scene, [scene])
    assert pace == sum(met.b >= 0 for met in oracle_contacts(scene, max_contacts=50).contacts) > 0


def test_a_run_that_is_off_from_the_start_has_a_shorter_horizon() -> None:
    """The horizon measures something: throw away twenty bits at the start, and it shrinks."""
    scene = kt.make_scene("grid", bodies=CASE.bodies, density=CASE.density, seed=0)
    rough = scene.replace(position=scene.position.astype("f4").astype("f8"))
    fine = horizon._moved(scene, np.random.default_rng(0))
    coarse, near = collisions_in_common(scene, [rough, fine])
    assert 0.0 < coarse < 0.8 * near


@pytest.mark.compiled
def test_the_picture_is_drawn(section: Section) -> None:
    pytest.importorskip("matplotlib", reason="figures need matplotlib")
    (picture,) = section.pictures
    figure = picture.draw()
    (panel,) = figure.axes
    assert panel.get_yscale() == "log"
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels == ["density 0.5, 16 discs", "density 0.1, 16 discs", "density 0.01, 25 discs"]
