"""Scenes that are drawn freshly, in the page against the library: places, events and structures are the same.

The seed is 0, unless KINETILE_SEED gives another one; KINETILE_SCENES is how many scenes are drawn.
"""

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kinetile as kt
from fresh_scenes import fresh, row_of
from kinetile.kernel.clock import Clock
from kinetile.records import Trajectory
from kinetile.run.compose import accepting
from kinetile.show.player import view_scene
from kinetile.show.player.recording import PLAYED_KINDS
from player_pages import ask_node, in_order, needs_node, plain

SEED, SCENES = int(os.environ.get("KINETILE_SEED", "0")), int(os.environ.get("KINETILE_SCENES", "50"))

SHOWN = """
    const shapes = (run) => run.structure?.at(run.done).map((shape) => run.structure.plain(shape)) ?? [];
    const there = (run) => [...run.motion.plans.there.keys()].filter((body) => run.motion.plans.there[body]);
    const shown = () => {
        const [run] = play.runs;
        return [there(run), placesOf(run.motion, play.moment), shapes(run)];
    };
    const told = [shown()];
    const { events: list } = play.runs[0];
    for (let event = 0; event < list.count; event += 1) {
        play.jump(0, event);
        const { kind, a, b } = list;
        told.push([kind[event], ...play.moment, a[event], b[event], play.runs[0].done, ...shown()]);
    }
    const moments = given.times.map((time) => {
        play.seek(clock.momentAt(time, held.start, held.unit));
        const [{ motion, events, done }] = play.runs;
        return [motion.done > (done && events.rows[done - 1]), ...shown()];
    });
    return [told, moments];
"""


def state(sim: kt.Simulation) -> list[Any]:
    return [sim.bodies.tolist(), sim.positions().tolist(), in_order([plain(item) for item in sim.drawing()])]


def between_events(shapes: list[dict[str, Any]], anchored: bool) -> list[dict[str, Any]]:
    """Shapes without what a page has as it was at the last event: the image to which a certificate leads,
    places of power cells, and ticks of failures where the clock has anchored a plan since."""
    found = [shape | {"fails": None} if anchored else dict(shape) for shape in shapes]
    for shape in found:
        if shape["role"] == "certificate":
            shape["coordinates"] = [each[:2] for each in shape["coordinates"]]
        if shape["role"] == "cell" and shape["shape"] == "segment":
            shape["coordinates"] = []
    return in_order(found)


@needs_node
@pytest.mark.parametrize("seed", range(SEED, SEED + SCENES))
def test_the_page_has_the_places_and_the_structure_of_the_library(seed, tmp_path):
    scene, until = fresh(seed)
    phases = [name for name, _ in accepting(scene)]
    assert_page_is_exact(scene, until, phases[seed // 2 % len(phases)], tmp_path, seed)  # each in turn


def test_shapes_at_one_place_have_one_order():
    home = {"role": "bound", "coordinates": [[-1, 0.5, 0]] * 4, "shape": "box", "label": ""}
    two = [home | {"fails": fails} for fails in ([0, 7], None)]
    assert in_order(two) == in_order(two[::-1])


ROOMS = Path(__file__).parents[4] / "docs" / "scenes"
PEGS = kt.Scene(
    [(4.0, 7.0), *((x + 0.5 * (y % 2), float(y)) for y in range(1, 6) for x in range(1, 7))],
    [(0.25, 0.0), *[(0.0, 0.0)] * 30],
    0.125,
    [1.0, *[np.inf] * 30],
    arena=(8.0, 8.0),
    gravity=(0.0, -1.0),
)


@needs_node
@pytest.mark.parametrize(
    ("name", "until", "phase"),
    [
        ("pegs", 2.0, "power:cells"),
        ("pinball", 2.0, "sweep-tiling"),
        ("brick-breaker", 1.0, "cells"),
        ("hopper", 0.125, "cells"),
        ("maze", 0.125, "cells"),
    ],
)
def test_a_line_between_two_immovable_bodies_was_drawn_by_the_library_alone(name, until, phase, tmp_path):
    scene = PEGS if name == "pegs" else kt.load_scene(ROOMS / f"{name}.toml")
    assert_page_is_exact(scene, until, phase, tmp_path)


def assert_page_is_exact(scene: kt.Scene, until: float, phase: str, tmp_path: Path, seed: int = 0) -> None:
    phase, _, option = phase.partition(":")
    options = {option: True} if option else {}
    view = view_scene(scene, [(phase, options)], until=until, pairs=True)
    assert not [note for note in view.notes if "chords" not in note]
    (recording,) = view.page.recordings
    clock, rng = Clock(scene.start, scene.time_unit), np.random.default_rng(seed)
    drawn = {*recording.rows["time"].tolist(), *rng.uniform(scene.start, until, 30).tolist()}
    times = sorted(time for time in drawn if 0 < clock.ticks(time) <= clock.ticks(until))
    told, moments = ask_node(tmp_path, view.page, SHOWN, times=times)

    now, *events = ([*each[:-1], in_order(each[-1])] for each in told)
    stepped = kt.Simulation(scene, phase, options=options)
    assert now == state(stepped)
    for done, (event, shown) in enumerate(zip(stepped.steps(until), events, strict=True), 1):
        if event.kind != "part" or set(event.bodies) <= set(stepped.bodies.tolist()):
            now = state(stepped)  # else its removal comes behind it
        assert shown == [PLAYED_KINDS.index(event.kind), *row_of(event), done, *now], event

    trajectory, sim = Trajectory(recording.rows, scene), kt.Simulation(scene, phase, options=options)
    for time, (anchored, *shown) in zip(times, moments, strict=True):
        for _ in sim.steps(time):  # structures of runs that are not stepped may be laid out at other moments
            pass
        bodies, places, shapes = state(sim)
        assert shown[:2] == [bodies, places]
        assert between_events(shown[2], anchored) == between_events(shapes, anchored)
        assert places == trajectory.positions(time).tolist()
