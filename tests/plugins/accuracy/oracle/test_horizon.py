"""The part of the report on agreement with the oracle: its arithmetic, its sentences, its picture."""

import pytest

from kinetile_accuracy.oracle import horizon
from kinetile_accuracy.oracle.horizon import REQUIREMENTS, Horizon, measure
from kinetile_accuracy.sections import Section

pytest.importorskip("flint", reason="the certified oracle needs python-flint")

CASE = REQUIREMENTS[2]
"""That runs at all densities agree for as long as is required is a test of ``test_agreement.py``."""


@pytest.fixture(scope="module")
def section() -> Section:
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(horizon.SEEDS, "quick", 1)
        patch.setattr(horizon, "REQUIREMENTS", (CASE,))
        return measure("quick", lambda what, done, total: None)


@pytest.mark.compiled
def test_a_run_has_a_horizon(section: Section) -> None:
    (whole,) = section.tables[0].rows
    assert isinstance(whole, Horizon)
    assert (whole.density, whole.bodies, whole.required) == CASE
    assert whole.contacts_per_disc >= whole.required
    assert 0.5 < whole.first_ticks < 32.0
    assert 2.0 < whole.growth < 8.0
    assert whole.differs.startswith(f"contact {whole.contacts}: ")
    assert [claim.holds for claim in section.claims] == [True]
    said, errors = section.findings
    assert "(4.5 required) at density 0.01" in said
    assert f"the error grows by {whole.growth:.1f} bits at density 0.01" in errors


@pytest.mark.compiled
def test_the_picture_is_drawn(section: Section) -> None:
    pytest.importorskip("matplotlib", reason="figures need matplotlib")
    (picture,) = section.pictures
    figure = picture.draw()
    (panel,) = figure.axes
    assert panel.get_yscale() == "log"
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels == ["density 0.5, 16 discs", "density 0.1, 16 discs", "density 0.01, 25 discs"]
