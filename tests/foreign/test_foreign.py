"""Phases from packages of their own, installed like any other package, give the one answer too."""

import numpy as np
import pytest

import kinetile as kt
from agreement import agree, lattice_scene
from kinetile.errors import BadOption, Refused
from kinetile.kernel.compiled import NOTHING_IS_COMPILED
from kinetile_conformance import check_broad_phase

LESS = 20 if NOTHING_IS_COMPILED else 1
"""How many times shorter the runs are where the loop is interpreted."""

pytestmark = pytest.mark.skipif(
    not {"stripes", "squares"} <= {each.spec.name for each in kt.registry()},
    reason="they are not installed; install them with: "
    "pip install ./tests/foreign/kinetile-stripes ./tests/foreign/kinetile-squares",
)


@pytest.mark.parametrize(("name", "kind"), [("stripes", "broad phase"), ("squares", "narrow phase")])
def test_it_is_found_by_name_with_its_distribution(name, kind):
    (row,) = (each for each in kt.registry() if each.spec.name == name)
    assert (row.kind, row.distribution) == (kind, f"kinetile-{name}")


def test_stripes_conform():
    report = check_broad_phase("stripes", examples=5)
    assert report.ok, str(report)


@pytest.mark.parametrize("width", [0.25, 0.125])
def test_centres_on_borders_of_stripes(width):
    """On lattices with exact ties, with turns and a jitter, or without."""
    for seed in range(12):
        agree(lattice_scene(seed), "naive", f"stripes:width={width}", until=6.0, contacts=200 // LESS)


def test_bodies_a_whole_turn_of_the_table_apart_are_not_near_and_a_fast_one_widens_all_stripes():
    scene = kt.Scene([[-1e6, 0.5], [0.0, 0.5], [1e6, 0.5]], [[1.0, 0.0], [0.0, 0.0], [-1.0, 0.0]], 0.5)

    def play(sim):
        sim.run(until=0.3)
        assert len(sim.candidate_pairs()) == 0 or sim.broad_phase == "naive"
        sim.set_velocity(1, (4000.0, -3000.0))
        sim.run(until=0.301)

    sim = agree(scene, "naive", "stripes:width=1.0", play=play, audit=1)[1]
    assert sim.state.width[1] == 2.0 * (0.5 + sim.explain()["numbers"]["skin"])


@pytest.mark.parametrize("width", [-1.0, np.nan, np.inf])
def test_a_width_that_is_none(width):
    with pytest.raises(BadOption, match="width must be a finite number"):
        kt.Simulation(kt.make_scene("two-discs"), "stripes", options={"width": width})


def test_it_draws_its_stripes_and_the_next_certificate():
    sim = kt.Simulation(kt.make_scene("random", bodies=8, density=0.3, radius_ratio=2.0, seed=3), "stripes")
    sim.run(until=0.1)
    items, event = sim.drawing(), sim.next_event
    width, stripes = float(sim.state.width[1]), sim.state.stripe.tolist()
    borders = {item.a[0] for item in items if item.role == "cell"}
    assert borders == {(stripe + side) * width for stripe in stripes for side in (0, 1)}
    assert [item.a[0].body for item in items if item.role == "certificate"] == list(range(len(stripes)))
    if event.kind == "structural":
        assert min(item.fails for item in items if item.fails) == event.epoch * 2**52 + event.tick


def test_squares_conform():
    report = check_broad_phase("cells", narrow_phases=["squares"], examples=20)
    assert report.ok, str(report)
    assert [each.check for each in report.results if each.status == "passed"] == [
        "a-contact-depends-on-two-plans-alone-of-shapes",
        "a-contact-adds-no-energy-of-shapes",
        "same-contacts-as-convex",
    ]


def test_squares_refuse_what_is_no_square():
    scene = kt.Scene([(1.0, 1.0)], [(0.0, 0.0)], shape=kt.box(1.0, 0.5))
    with pytest.raises(Refused, match="all boxes are squares"):
        kt.Simulation(scene, narrow_phases=["squares"])
