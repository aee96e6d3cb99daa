"""The drawing of a phase is checked before anybody sees it: bodies by number, ticks since the start."""

from contextlib import ExitStack
from dataclasses import replace

import numpy as np
import pytest

import kinetile as kt
from kinetile.plugin.new_plugin import new_plugin
from kinetile.toolbox import NEVER, At, Box, Link, Polygon, Segment
from kinetile_plugins.naive import Naive
from messages import table
from registering import registered

SCENE = kt.Scene([(0.2, 0.2), (0.5, 0.5), (0.8, 0.8)], [(0.0, 0.0)] * 3, 0.05, arena=(1.0, 1.0))


@pytest.fixture
def drawing_of():
    with ExitStack() as stack:

        def simulation(draw):
            class Drawing(Naive):
                def prepare(self, scene):
                    return replace(super().prepare(scene), draw=draw)

            stack.enter_context(registered(kt.BroadPhaseSpec("drawing", Drawing)))
            return kt.Simulation(SCENE, "drawing")

        yield simulation


@pytest.mark.parametrize("draw", [None, lambda k, s: ()])
def test_a_phase_that_draws_nothing_shows_nothing(drawing_of, draw):
    assert drawing_of(draw).drawing() == ()


def test_shapes_come_back_with_the_numbers_of_bodies(drawing_of):
    def draw(k, s):
        last = len(k.bodies) - 1
        yield Segment("bound", (At(last, 0.25), 0.0), (At(last), 1), NEVER, "L")
        yield Box("cell", (0.0, 0.0), (At(0), At(last)), 5)
        yield Polygon("tile", ((0.0, 0.0), (1.0, 0.0), (At(0), 1.0)))
        yield Link("pair", 0, last)

    sim = drawing_of(draw)
    sim.remove(1)  # the phase is made again, and body 2 stands in slot 1
    assert sim.drawing() == (
        Segment("bound", (At(2, 0.25), 0.0), (At(2), 1.0), None, "L"),
        Box("cell", (0.0, 0.0), (At(0), At(2)), 5),
        Polygon("tile", ((0.0, 0.0), (1.0, 0.0), (At(0), 1.0))),
        Link("pair", 0, 2),
    )


def test_what_new_plugin_writes_draws_a_box_around_each_body(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(new_plugin("tethered", tmp_path))

    with registered(kt.BroadPhaseSpec("tethered", "kinetile_tethered.phase:TetheredPhase")):
        sim = kt.Simulation(SCENE, "tethered")
        boxes = sim.drawing()
        leash = float(sim.state.leash[1])
    assert [box.role for box in boxes] == ["bound"] * 3
    for box, place in zip(boxes, SCENE.position, strict=True):
        for half in (place - box.low, box.high - place):
            assert np.all(leash < half)  # there is room beside a chord
            assert np.all(half < leash + 1e-9)


test_message = table(globals())
