"""What holds in a heap, how exactly and at what cost: ``python docs/figures/heaps.py [PART ...]``.

The recipe ``heap`` at several depths, after ten seconds in which it falls and settles: contacts, CPU time and
speeds of two seconds, the deepest overlap at forty moments, and the mean height compared with that of the
same heap, continued with a contact time four times shorter. Then 1,000 discs under each broad phase, and in
Chipmunk (pymunk, of ``kinetile[peers]``), in steps. Durations are the least of several runs.
"""

from __future__ import annotations

import math
import sys
import time
from typing import Any, NamedTuple

import numpy as np

import kinetile as kt

COLUMNS, ABREAST = 36, 40
"""Discs that start beside each other, and that lie so: bodies / ABREAST are the layers of a heap."""

PHASE, CONTACT_TIME = "sweep-tiling", 1e-3
PHASES = ("sweep-tiling", "cells", "sap-1d", "sap-2d", "power", "naive")
SETTLED, WATCHED, MOMENTS = 10.0, 2.0, 40
STEPS = ((60, 10), (60, 30), (240, 30), (960, 30))
"""Steps a second and iterations in Chipmunk."""


class Watched(NamedTuple):
    """What was seen in ``WATCHED`` seconds: durations in seconds, lengths in mean radii."""

    seconds: float
    contacts: int
    fastest: float
    mean_square_speed: float
    overlap: float
    height: float
    moved: float

    def line(self, bodies: int, contact_time: float, gravity: float) -> str:
        """Returns the values as text, speeds in least hops of rule 11h."""
        hop = 0.5 * contact_time * gravity
        return (
            f"{self.contacts * contact_time / (bodies * WATCHED):.2f} bodies / contact_time; "
            f"{self.seconds / WATCHED:.3f} CPU s a second; largest speed {self.fastest / hop:.0f} h, mean "
            f"{math.sqrt(self.mean_square_speed) / hop:.0f} h = {math.sqrt(self.mean_square_speed):.3f} m/s; "
            f"deepest overlap {self.overlap:.1e} r; moved {self.moved:.4f} r"
        )


def deepest(place: Any, scene: kt.Scene) -> float:
    """Returns the deepest overlap of two discs, or of one and a wall, in mean radii; 0 if there is none."""
    r = scene.radius
    width, _ = scene.arena or (0.0, 0.0)
    walls = max(r - place[:, 1]), max(r - place[:, 0]), max(place[:, 0] + r - width)
    order = np.argsort(place[:, 1])
    place, r = place[order], r[order]
    found = max(0.0, *walls)
    for each in range(len(r) - 1):
        last = np.searchsorted(place[:, 1], place[each, 1] + 2.0 * r.max())
        apart = np.hypot(*(place[each + 1 : last] - place[each]).T)
        found = max(found, float(np.max(r[each] + r[each + 1 : last] - apart, initial=0.0)))
    return found / float(np.mean(scene.radius))


def watch(scene: kt.Scene, phase: str, settled: float = SETTLED) -> tuple[Watched, kt.Simulation]:
    """Runs a scene until it has settled, and watches it."""
    sim = kt.Simulation(scene, phase, keep_contacts=False, compiled=True)
    sim.run(settled)
    begin, contacts, seconds = sim.positions(), sim.readings.contacts, 0.0
    squares, fastest, overlap, heights = [], 0.0, 0.0, []
    for moment in range(1, MOMENTS + 1):
        began = time.process_time()
        sim.run(settled + WATCHED * moment / MOMENTS)
        seconds += time.process_time() - began
        square = (sim.velocities() ** 2).sum(axis=1)
        squares.append(square.mean())
        fastest = max(fastest, math.sqrt(square.max()))
        overlap = max(overlap, deepest(sim.positions(), scene))
        heights.append(sim.positions()[:, 1].mean())
    moved = math.sqrt(((sim.positions() - begin) ** 2).sum(axis=1).mean())
    r = float(scene.radius.mean())
    return Watched(
        seconds,
        sim.readings.contacts - contacts,
        fastest,
        float(np.mean(squares)),
        overlap,
        float(np.mean(heights)) / r,
        moved / r,
    ), sim


def heap(layers: int, contact_time: float = CONTACT_TIME) -> kt.Scene:
    """Returns the scene."""
    return kt.make_scene("heap", bodies=ABREAST * layers, columns=COLUMNS, contact_time=contact_time)


def depths() -> None:
    """Compares heaps of several depths, and each with itself at a contact time four times shorter."""
    for layers in (6, 12, 25, 50, 100):
        scene = heap(layers)
        gravity = -scene.gravity[1]
        runs = [watch(scene, PHASE) for _ in range(max(1, 75 // layers))]
        found, sim = runs[0]
        found = found._replace(seconds=min(each.seconds for each, _ in runs))
        print(f"{layers} layers, {len(scene)} discs: {found.line(len(scene), CONTACT_TIME, gravity)}")
        if layers <= 50:
            rule = kt.Response("restitution", e=0.3, contact_time=CONTACT_TIME / 4)
            later = scene.replace(position=sim.positions(), velocity=sim.velocities(), responses=rule)
            finer, _ = watch(later, PHASE, 2.0)
            higher = found.height - finer.height
            print(f"    mean height {found.height:.4f} r, {higher:.4f} r above that at a quarter of the time")
            print(f"    which has {finer.line(len(scene), CONTACT_TIME / 4, gravity)}", flush=True)


def times() -> None:
    """Compares contact times on 1,000 discs."""
    for contact_time in (2e-3, 4e-3, 8e-3, 16e-3):
        found, _ = watch(heap(25, contact_time), PHASE)
        print(f"contact_time {contact_time:g}: {found.line(1000, contact_time, 9.8)}; {found.height:.3f} r")


def phases() -> None:
    """Compares the phases on 1,000 discs."""
    for phase in PHASES:
        seconds = min(watch(heap(25), phase)[0].seconds for _ in range(2))
        print(f"{phase}: {seconds / WATCHED:.2f} CPU s a second", flush=True)


def chipmunk(scene: kt.Scene, steps: int, iterations: int) -> tuple[float, float, float, float]:
    """Returns CPU seconds a second, the deepest overlaps while discs fall and later, and the mean height."""
    import pymunk

    space = pymunk.Space()
    space.gravity, space.iterations = scene.gravity, iterations
    space.collision_slop = 0.01 * float(scene.radius.mean())  # its default, 0.1, is for lengths in pixels
    bodies, shapes = [], []
    for place, r, mass in zip(
        scene.position.tolist(), scene.radius.tolist(), scene.mass.tolist(), strict=True
    ):
        bodies.append(pymunk.Body(mass, math.inf))
        bodies[-1].position = place
        shapes.append(pymunk.Circle(bodies[-1], r))
        space.add(bodies[-1], shapes[-1])
    width, height = scene.arena or (0.0, 0.0)
    for x, y, to_x, to_y in ((-5, 0, -5, height), (width + 5, 0, width + 5, height), (-5, -5, width + 5, -5)):
        shapes.append(pymunk.Segment(space.static_body, (x, y), (to_x, to_y), 5.0))
        space.add(shapes[-1])
    for shape in shapes:
        shape.elasticity, shape.friction = math.sqrt(0.3), 0.0  # of two shapes the product counts
    overlaps, seconds = [0.0, 0.0], 0.0
    for step in range(int((SETTLED + WATCHED) * steps)):
        lies = step >= SETTLED * steps
        began = time.process_time()
        space.step(1.0 / steps)
        seconds += (time.process_time() - began) * lies
        if step % max(1, steps // 20) == 0:
            place = np.array([tuple(body.position) for body in bodies])
            overlaps[lies] = max(overlaps[lies], deepest(place, scene))
    return seconds / WATCHED, *overlaps, place[:, 1].mean() / float(scene.radius.mean())


def peers() -> None:
    """Runs 1,000 discs in Chipmunk."""
    for steps, iterations in STEPS:
        runs = [chipmunk(heap(25), steps, iterations) for _ in range(3 if steps < 500 else 1)]
        _, falling, lying, height = runs[0]
        print(
            f"Chipmunk, {steps} steps a second, {iterations} iterations: {min(runs)[0]:.3f} CPU s a second; "
            f"deepest overlap {falling:.3f} r while falling, then {lying:.3f} r; mean height {height:.3f} r",
            flush=True,
        )


if __name__ == "__main__":
    for part in (peers, depths, times, phases):
        if part.__name__ in (sys.argv[1:] or [part.__name__]):
            part()
