"""A picture of the moment of disagreement, as an SVG of a few hundred bytes: bodies, flight, candidate
pairs."""

from __future__ import annotations

from html import escape
from typing import Any

import numpy as np

from kinetile.errors import KinetileError
from kinetile.kernel.loop.presence import slots_taken
from kinetile.run.simulation import Simulation
from kinetile.scene import Scene
from kinetile_conformance.cases import CONTACTS, REFERENCE, Subject, difference, horizon, outcome

__all__ = ["draw", "moment"]

SIZE = 480.0


def moment(subject: Subject, scene: Scene) -> Simulation:
    """Return a simulation under the reference, run to the first contact at which the subject parts from
    it."""
    found = outcome(subject, scene)
    reference = subject.under(REFERENCE)
    expected = outcome(reference, scene)
    rows = min(len(found.contacts), len(expected.contacts))
    parted = np.flatnonzero(found.contacts[:rows] != expected.contacts[:rows])
    agreed = int(parted[0]) if len(parted) else rows
    sim = reference.simulation(scene)
    try:
        if difference(found, expected, subject.name) is None:
            sim.run(until=horizon(scene), max_contacts=CONTACTS)
        else:
            sim.run(until=horizon(scene), max_contacts=agreed + 1)
    except KinetileError:
        pass
    return sim


def draw(subject: Subject, scene: Scene, said: str) -> str:
    """Return the picture as SVG: discs with their numbers, an arrow along each velocity, the arena."""
    try:
        sim = moment(subject, scene)
    except Exception:  # a phase that crashes leaves only the start to be drawn
        sim = Simulation(scene, REFERENCE)
    place, velocity = sim.positions(), sim.velocities()
    radius = np.asarray(sim.tables.radii[slots_taken(sim.tables)])
    if scene.arena is not None:
        low, high = np.zeros(2), np.array(scene.arena)
    elif len(place):
        low = (place - radius[:, None]).min(axis=0) - 1.0
        high = (place + radius[:, None]).max(axis=0) + 1.0
    else:
        low, high = np.zeros(2), np.ones(2)
    scale = SIZE / float((high - low).max())
    wide, tall = (high - low) * scale

    def at(point: Any) -> tuple[float, float]:
        x, y = (point - low) * scale
        return round(float(x), 2), round(tall - float(y), 2)

    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="-8 -8 {wide + 16:.0f} {tall + 64:.0f}" '
        'font-family="sans-serif" font-size="12">',
        '<defs><marker id="tip" orient="auto" markerWidth="6" markerHeight="6" refX="5" refY="3">'
        '<path d="M0 0 6 3 0 6z"/></marker></defs>',
        f'<rect width="{wide:.1f}" height="{tall:.1f}" fill="#fff" stroke="#888"/>',
    ]
    reach = 0.12 * float((high - low).max())
    fastest = max(float(np.abs(velocity).max(initial=0.0)), 1e-300)
    for row, body in enumerate(sim.bodies):
        x, y = at(place[row])
        tip_x, tip_y = at(place[row] + velocity[row] / fastest * reach)
        parts.append(
            f'<circle cx="{x}" cy="{y}" r="{max(radius[row] * scale, 1.0):.2f}" fill="#9cf4" stroke="#157"/>'
            f'<line x1="{x}" y1="{y}" x2="{tip_x}" y2="{tip_y}" stroke="#000" marker-end="url(#tip)"/>'
            f'<text x="{x + 3}" y="{y - 3}">{body}</text>'
        )
    lines = [f"{subject.name} at time {sim.time!r}", *said.splitlines()[:2]]
    for row, line in enumerate(lines):
        parts.append(f'<text x="0" y="{tall + 18 + 15 * row:.0f}">{escape(line[:110])}</text>')
    return "\n".join([*parts, "</svg>", ""])
