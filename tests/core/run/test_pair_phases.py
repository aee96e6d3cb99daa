"""Several narrow phases for pairs in one run: the first that takes two shapes decides."""

from dataclasses import replace

import numpy as np
import pytest

import convex_scenes
import kinetile as kt
from kinetile.run.simulation import composition_of
from kinetile.toolbox import Kernel, PairParts, hook
from kinetile_plugins import convex
from lanes import first
from messages import table
from registering import registered


@hook
def checked_meet(k: Kernel, a: int, b: int) -> int:
    return convex.meet(k, a, b)


@hook
def collide_and_stop(k: Kernel, a: int, b: int) -> float:
    for body in (k.bodies[a], k.bodies[b]):
        body.vx = 0.0
        body.vy = 0.0
    return convex.collide(k, a, b)


class Boxes(convex.Convex):
    def prepare(self, scene: kt.Scene) -> PairParts:
        assert any(each.kind == "box" for each in scene.shapes)
        return replace(super().prepare(scene), meet=checked_meet, soonest=None)


class Sticky(Boxes):
    def prepare(self, scene: kt.Scene) -> PairParts:
        return replace(super().prepare(scene), collide=collide_and_stop, touch=None)


PLUGINS = (
    kt.NarrowPhaseSpec("boxes", Boxes, role="pair", shapes=("box",)),
    kt.NarrowPhaseSpec("sticky", Sticky, role="pair", shapes=("box",)),
    kt.NarrowPhaseSpec(
        "no-discs", convex.Convex, role="pair", shapes=("box", "capsule", "polygon", "segment")
    ),
)


def room(kinds: tuple[kt.Shape, ...], seed: int = 0) -> kt.Scene:
    rng = np.random.default_rng(seed)
    place = np.stack(np.meshgrid(np.arange(5), np.arange(5)), -1).reshape(-1, 2) + 0.5
    speed = rng.integers(-4, 5, (25, 2)) / 4
    return kt.Scene(place, speed, shape=rng.integers(0, len(kinds), 25), shapes=kinds, arena=(5.0, 5.0))


MIXED = room((kt.disc(0.25), kt.box(0.5, 0.75), kt.capsule((-0.25, 0), (0.25, 0), 0.125), kt.box(0.5, 0.5)))


def run(scene: kt.Scene, *narrow: str, broad: str = "cells") -> kt.Simulation:
    sim = kt.Simulation(scene, broad, narrow_phases=narrow)
    sim.run(until=20.0, max_contacts=20)
    return sim


@pytest.mark.parametrize("broad", first(1, ["cells", "naive"]))
@pytest.mark.parametrize(
    "narrow",
    first(1, [["disc", "boxes", "convex", "wall"], ["disc", "convex", "wall"], ["boxes", "wall", "convex"]]),
    ids=",".join,
)
def test_phases_for_some_shapes_and_one_for_all_give_what_the_one_gives(narrow, broad):
    with registered(*PLUGINS):
        alone, together = run(MIXED, "convex", "wall"), run(MIXED, *narrow, broad=broad)
    assert len(alone.contacts) == 20
    assert together.fingerprint == alone.fingerprint
    together.audit()


@pytest.mark.slow
@pytest.mark.compiled
def test_compiled_phases_read_each_its_own_numbers():
    """Tables with other numbers lay on the stack of a hook that had returned."""
    alone, together = run(MIXED, "convex", "wall"), run(MIXED, "disc", "convex", "wall")
    assert together.fingerprint == alone.fingerprint


@pytest.mark.parametrize("periodic", first(1, ["xy", "x"]))
def test_discs_and_other_shapes_meet_through_images(periodic):
    walls = ("wall",) if periodic == "x" else ()
    scene = MIXED.replace(periodic=periodic, mass=[np.inf, *[1.0] * 23, np.inf])
    alone, together = run(scene, "convex", *walls), run(scene, "disc", "convex", *walls)
    assert len(alone.contacts) == 20
    assert together.fingerprint == alone.fingerprint
    together.audit()


@pytest.mark.parametrize("seed", [3, 5, 8])
def test_immovable_bodies_and_segments_are_somebody_s(seed):
    scene = convex_scenes.drawn(seed, (8,))
    with registered(*PLUGINS):
        one, other = (run(scene, *narrow, "wall") for narrow in (("boxes", "convex"), ("convex",)))
        assert one.fingerprint == other.fingerprint


def test_two_boxes_are_decided_by_the_phase_for_boxes_alone():
    with registered(*PLUGINS):
        sim = run(MIXED, "sticky", "convex", "wall")
        plain = run(MIXED, "convex", "wall")
    shape = np.array([MIXED.shapes[each].kind for each in MIXED.shape])
    contacts = sim.contacts[sim.contacts["b"] >= 0]
    boxes = (shape[contacts["a"]] == "box") & (shape[contacts["b"]] == "box")
    assert boxes.any()
    assert not boxes.all()
    assert np.square(sim.velocities()).sum() < 0.9 * np.square(plain.velocities()).sum()


def test_what_has_nothing_to_decide_in_a_scene_is_not_composed():
    boxes = room((kt.box(0.5, 0.5),))
    with registered(*PLUGINS):
        both, one = (
            kt.Simulation(boxes, narrow_phases=(*narrow, "wall"))
            for narrow in (("boxes", "convex"), ("boxes",))
        )
        assert composition_of(both).pair.meet is composition_of(one).pair.meet
        discs = kt.Simulation(kt.make_scene("two-discs"), narrow_phases=("disc", "convex", "wall"))
    assert composition_of(discs).pair.alike


def chosen(*narrow: str) -> None:
    with registered(*PLUGINS):
        kt.Simulation(MIXED, narrow_phases=(*narrow, "wall"))


test_message = table(globals())
