"""The files of whole runs, with their contacts and fingerprints."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from fractions import Fraction

from .edges import clocks, touches
from .rules import tick_of
from .scenes import Asked, gases, lattices, mixtures, turning
from .whole_runs import BY_CLOCK, PAIR, TURN, WALL, Body, Event, Scene, digest, events, unit_of
from .writing import number, numbers

__all__ = ["files"]

FILES: dict[str, tuple[str, Callable[[], Iterator[Asked]]]] = {
    "lattices": ("Exact ties, touching starts, and almost.", lattices),
    "turns": ("Turns, several at one tick.", turning),
    "gases": ("Gases, dense, dilute, fast, of any scale, without walls.", gases),
    "mixtures": ("Unequal masses and sizes.", mixtures),
    "touches": ("Cradles, corners, touching starts.", touches),
    "clocks": ("Several spans of the clock, its anchoring, and barred pairs.", clocks),
}

SHOWN = 100
"""How many contacts of a run are written down."""

KINDS = {"clock": BY_CLOCK, "turn": TURN, "wall": WALL, "pair": PAIR}


def files() -> dict[str, str]:
    """Return the text of each file, by its path in this folder."""
    return {f"runs/{name}.json": _file(about, asked) for name, (about, asked) in FILES.items()}


def _file(about: str, runs: Callable[[], Iterator[Asked]]) -> str:
    body = ",\n".join(_run(asked) for asked in runs())
    return f'{{\n "about": {json.dumps(about)},\n "runs": [\n{body}\n ]\n}}\n'


def _run(asked: Asked) -> str:
    """Return a run as JSON: a line a body, and the contacts in one."""
    scene, e = asked.scene, unit_of(asked.scene)
    happened: list[Event] = []
    until, end, met = asked.until, 0, 0
    if until is not None:
        end = tick_of(until, scene.start, e)
    for event in events(scene):
        if until is not None and event.tick > end:
            break
        happened.append(event)
        met += event.kind in (WALL, PAIR)
        if until is None and met == asked.contacts:
            exact = Fraction(scene.start) + Fraction(event.tick, 1 << 52 + e)
            until = exact.numerator / exact.denominator
            end = tick_of(until, scene.start, e)
    assert until is not None
    happened = [event for event in happened if event.tick <= end]
    contacts = [event for event in happened if event.kind in (WALL, PAIR)]
    first = [[*map(str, divmod(each.tick, 1 << 52)), each.a, each.b] for each in contacts[:SHOWN]]
    counts = {name: sum(each.kind == kind for each in happened) for name, kind in KINDS.items()}
    lines = [
        f'  {{"name": {json.dumps(asked.name)},',
        f'   "scene": {{{_head(scene, until)}, "bodies": [',
        ",\n".join(f"     {_json(_body(body))}" for body in scene.bodies) + "]},",
        f'   "e": {e}, "end": "{end}", "happened": {json.dumps(counts)},',
        f'   "count": {len(contacts)}, "fingerprint": "{digest(contacts)}",',
        f'   "contacts": {_json(first)}}}',
    ]
    return "\n".join(lines)


def _head(scene: Scene, until: float) -> str:
    arena = "" if scene.arena is None else f'"arena": {_json(numbers(*scene.arena))}, '
    return f'{arena}"start": "{number(scene.start)}", "until": "{number(until)}"'


def _body(body: Body) -> dict[str, object]:
    made: dict[str, object] = {
        "position": numbers(*body.position),
        "velocity": numbers(*body.velocity),
        "radius": number(body.radius),
        "mass": number(body.mass),
    }
    if body.turns:
        made["turns"] = [
            {"time": number(time), "velocity": numbers(*velocity)} for time, velocity in body.turns
        ]
    return made


def _json(value: object) -> str:
    return json.dumps(value, separators=(",", ":"))
