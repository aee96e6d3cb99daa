"""Convex bodies under commands and responses: turns, removals, restitution, stops and obstacles."""

import math
import pickle
from dataclasses import replace

import pytest

import kinetile as kt
from kinetile.errors import Refused
from kinetile_accuracy import certify_log
from kinetile_plugins.convex import Convex
from registering import registered


def test_circles_that_overlap_are_no_passing():
    """Bodies of a scene with responses, whose circles overlap though they do not."""
    scene = kt.Scene(
        [(1.0, 1.0), (1.0, 2.0)],
        [(0.0, 0.0), (0.0, -1.0)],
        shape=kt.box(2.0, 0.5),
        arena=(4.0, 4.0),
        responses="stop",
    )
    sim = kt.Simulation(scene, "cells")
    sim.run(until=2.0)
    assert sim.contacts[["time", "a", "b"]].tolist() == [(0.5, 0, 1)]
    assert (sim.velocities() == 0.0).all()
    assert sim.readings.passings == 0


def test_losses_are_along_the_face_alone():
    back = kt.Response("restitution", e=0.5, contact_time=1e-6)
    scene = kt.Scene(
        [(1.0, 1.0), (4.0, 1.5)],
        [(1.0, 0.25), (0.0, 0.0)],
        mass=[1.0, math.inf],
        shape=kt.box(1.0, 1.0),
        responses=back,
    )
    sim = kt.Simulation(scene, "cells", audit=1)
    sim.run(until=4.0)
    assert sim.velocities().tolist() == [[-0.5, 0.25], [0.0, 0.0]]


def test_what_is_no_shape_of_the_scene_is_added_and_replays():
    """Shapes that the table has, that it does not have, and that obstacles alone had there so far."""
    scene = kt.Scene(
        [(1.0, 1.0), (5.0, 1.0)], [(1.0, 0.0), (-1.0, 0.5)], 0.5, arena=(8.0, 8.0), responses="elastic"
    )
    scene = kt.with_obstacles(
        scene.replace(shapes=[kt.box(1.0, 0.5)]), [kt.Obstacle(kt.box(2.0, 0.5), (4.0, 6.0))]
    )
    sims = [kt.Simulation(scene, phase, live=True, audit=5) for phase in ("cells", "sap-2d")]
    for sim in sims:
        sim.run(until=0.5)
        before = sim.snapshot()
        with pytest.raises(
            Refused, match=r"no room for body 3 at .*: it reaches into body 2; nothing has changed"
        ):
            sim.insert((4.5, 5.75), (0.0, 0.0), shape=kt.box(1.0, 0.25))
        assert sim.snapshot() == before
        bodies = [
            sim.insert((1.0, 4.0), (1.0, 0.25), shape=0),
            sim.insert((4.0, 4.0), (0.0, 0.5), shape=kt.box(2.0, 0.5)),
            sim.insert((6.5, 4.0), (-0.5, 0.0), shape=kt.capsule((0.0, -0.5), (0.0, 0.5), 0.25)),
            sim.insert((6.5, 6.5), (-0.5, -0.5), 0.125, mass=0.5),
        ]
        assert bodies == [3, 4, 5, 6]
        assert [each.kind for each in sim.shapes()] == [
            "disc",
            "disc",
            "box",
            "box",
            "box",
            "capsule",
            "disc",
        ]
        sim.run(until=6.0)
        sim.restore(pickle.loads(pickle.dumps(sim.snapshot())))
        sim.run(until=12.0)
        recorded = sim.recorded()
        again = kt.Simulation(recorded, "naive")
        again.run()
        assert again.fingerprint == sim.fingerprint
        assert certify_log(recorded, sim.contacts, fingerprint=sim.fingerprint).right
    assert len({sim.fingerprint for sim in sims}) == 1
    assert 4 in sims[0].contacts["b"]


class Gapless:
    def prepare(self, scene):
        return replace(Convex().prepare(scene), gap=None)


GAPLESS = kt.NarrowPhaseSpec("gapless", f"{__name__}:Gapless", "no gap", role="pair", shapes=("disc", "box"))


@pytest.mark.parametrize("phase", ["cells", "naive"])
def test_no_shape_comes_where_nothing_says_how_it_would_stand(phase):
    discs = kt.Simulation(kt.Scene([(1.0, 1.0)], [(0.0, 0.0)], 0.5), phase)
    with pytest.raises(
        ValueError, match=r"it is a box, and this run is made for discs alone; list the shape"
    ):
        discs.insert((5.0, 5.0), shape=kt.box(1.0, 1.0))
    boxes = kt.Scene([(1.0, 1.0), (4.0, 1.0)], [(1.0, 0.0), (0.0, 0.0)], shape=kt.box(1.0, 1.0))
    coming = boxes.replace(commands=[kt.Insert(1.0, (9.0, 9.0), (0.0, 0.0), shape=0)])
    with registered(GAPLESS):
        for narrow, said in (
            (["gapless"], "gapless do not say how far apart"),
            ([], "no narrow phase for pairs"),
        ):
            with pytest.raises(Refused, match=f"no body is inserted into this scene of shapes: {said}"):
                kt.Simulation(coming, phase, narrow_phases=narrow)
            with pytest.raises(ValueError, match=f"this body cannot come: {said}"):
                kt.Simulation(boxes, phase, narrow_phases=narrow).insert((9.0, 9.0), shape=0)
        passing = boxes.replace(kind=["ball", "wisp"], responses={("ball", "wisp"): "pass"})
        with pytest.raises(
            Refused, match=r"gapless.* how far apart two shapes are that may pass .* it has no gap"
        ):
            kt.Simulation(passing, phase, narrow_phases=["gapless"])
