"""The files of whole runs, with their contacts and fingerprints."""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Iterator
from fractions import Fraction
from itertools import islice
from typing import NamedTuple

from .clauses import CLAUSES, scenes
from .edges import clocks, touches
from .images import boxes
from .rules import tick_of
from .scenes import Asked, gases, lattices, mixtures, turning
from .whole_runs import (
    BEGINNING,
    BY_CLOCK,
    CONTACTS,
    INSERTION,
    NO_ROOM,
    PAIR,
    PARTING,
    REMOVAL,
    TURN,
    WALL,
    Body,
    Command,
    Event,
    Insert,
    Remove,
    Response,
    Restitution,
    Scene,
    are_commands,
    digest,
    events,
    unit_of,
)
from .writing import number, numbers, table

__all__ = ["Answer", "answer", "files"]

FILES: dict[str, tuple[str, Callable[[], Iterator[Asked]]]] = {
    "lattices": ("Exact ties, touching starts, and almost.", lattices),
    "turns": ("Turns, several at one tick.", turning),
    "gases": ("Gases, dense, dilute, fast, of any scale, without walls.", gases),
    "mixtures": ("Unequal masses and sizes.", mixtures),
    "touches": ("Cradles, corners, touching starts.", touches),
    "periodic": ("Periodic axes.", boxes),
    "clocks": ("Several spans of the clock, its anchoring, and barred pairs.", clocks),
}

SHOWN = 100
"""How many contacts of a run are written down."""

KINDS = {"clock": BY_CLOCK, "turn": TURN, "wall": WALL, "pair": PAIR}


MORE_KINDS = KINDS | {"insertion": INSERTION, "removal": REMOVAL, "begin": BEGINNING, "end": PARTING}


def files() -> dict[str, str]:
    """Return the text of each file, by its path in this folder."""
    runs = {f"runs/{name}.json": _file(about, asked, KINDS) for name, (about, asked) in FILES.items()}
    asked = {
        family: [(each.name, json.loads(_scene(each, 4.0)), are_commands(each.scene)) for each in questions]
        for family, questions in scenes().items()
    }
    about = "Rule 2: whether something is a scene, by its commands."
    return runs | {
        "scenes.json": table(about, ("name", "scene", "whether it is one"), asked),
        **{f"rules/{name}.json": _file(told, made, MORE_KINDS) for name, (told, made) in CLAUSES.items()},
    }


def _file(about: str, runs: Callable[[], Iterator[Asked]], kinds: dict[str, int]) -> str:
    body = ",\n".join(_run(asked, kinds) for asked in runs())
    return f'{{\n "about": {json.dumps(about)},\n "runs": [\n{body}\n ]\n}}\n'


class Answer(NamedTuple):
    """What a run has: e, the end as a time and as a tick, and its events."""

    e: int
    until: float
    end: int
    happened: list[Event]

    @property
    def contacts(self) -> list[Event]:
        return [event for event in self.happened if event.kind in CONTACTS]


def answer(asked: Asked, otherwise: Collection[str] = ()) -> Answer:
    """Return what a run has, by the rules, or, for so many events, with other readings of them: to the letter
    some are endless."""
    scene, e = asked.scene, unit_of(asked.scene, otherwise)
    happened: list[Event] = []
    until, end, met = asked.until, 0, 0
    if asked.end is not None:
        end = (asked.end[0] << 52) + asked.end[1]
        until = _time(scene, end, e)
    elif until is not None:
        end = tick_of(until, scene.start, e)
    for event in islice(events(scene, asked.end, otherwise), 1000 if otherwise else None):
        if until is not None and event.tick > end:
            break
        happened.append(event)
        met += event.kind in CONTACTS
        if until is None and met == asked.contacts:
            until = _time(scene, event.tick, e)
            end = tick_of(until, scene.start, e)
    assert until is not None
    return Answer(e, until, end, [event for event in happened if event.tick <= end])


def _time(scene: Scene, tick: int, e: int) -> float:
    exact = Fraction(scene.start) + Fraction(tick, 1 << 52 + e)
    return exact.numerator / exact.denominator


def _run(asked: Asked, kinds: dict[str, int]) -> str:
    """Return a run as JSON: a line a body, and the contacts in one."""
    found = answer(asked)
    contacts = found.contacts
    first = [[*map(str, divmod(each.tick, 1 << 52)), each.a, each.b] for each in contacts[:SHOWN]]
    counts = {name: sum(each.kind == kind for each in found.happened) for name, kind in kinds.items()}
    told = {"otherwise": asked.otherwise} if asked.otherwise else {}
    told |= {"ended": "no room"} if any(each.kind == NO_ROOM for each in found.happened) else {}
    lines = [
        f'  {{"name": {json.dumps(asked.name)},'
        + "".join(f' "{key}": "{each}",' for key, each in told.items()),
        f'   "scene": {_scene(asked, found.until)},',
        f'   "e": {found.e}, "end": "{found.end}", "happened": {json.dumps(counts)},',
        f'   "count": {len(contacts)}, "fingerprint": "{digest(contacts)}",',
        f'   "contacts": {_json(first)}}}',
    ]
    return "\n".join(lines)


def _scene(asked: Asked, until: float) -> str:
    """Return a scene as JSON: a line a body."""
    bodies = ",\n".join(f"     {_json(_body(body))}" for body in asked.scene.bodies)
    return f'{{{_head(asked.scene, until)}{_more(asked)}, "bodies": [\n{bodies}]}}'


def _more(asked: Asked) -> str:
    """Return what only the scenes of ``rules`` have."""
    scene = asked.scene
    made: dict[str, object] = {}
    if asked.end is not None:
        made["end"] = asked.end
    if scene.unit is not None:
        made["unit"] = number(2.0**-scene.unit)
    if scene.responses:
        made["responses"] = [{"between": pair, **_response(response)} for pair, response in scene.responses]
    if scene.commands:
        made["commands"] = [_command(command) for command in scene.commands]
    return "".join(f', "{key}": {_json(value)}' for key, value in made.items())


def _response(response: Response) -> dict[str, object]:
    if not isinstance(response, Restitution):
        return {"response": response}
    options = {name: number(value) for name, value in response._asdict().items()}
    return {"response": "restitution", "options": options}


def _command(command: Command) -> dict[str, object]:
    made: dict[str, object] = {"time": number(command.time)}
    if command.at is not None:
        made["at"] = command.at
    if isinstance(command, Insert):
        named = {} if command.number is None else {"body": command.number}
        return made | {"insert": _body(command.body) | named}
    if isinstance(command, Remove):
        return made | {"remove": command.body}
    return made | {"turn": command.body, "velocity": numbers(*command.velocity)}


def _head(scene: Scene, until: float) -> str:
    arena = "" if scene.arena is None else f'"arena": {_json(numbers(*scene.arena))}, '
    arena += f'"periodic": "{scene.periodic}", ' if scene.periodic else ""
    return f'{arena}"start": "{number(scene.start)}", "until": "{number(until)}"'


def _body(body: Body) -> dict[str, object]:
    made: dict[str, object] = {
        "position": numbers(*body.position),
        "velocity": numbers(*body.velocity),
        "radius": number(body.radius),
        "mass": number(body.mass),
    }
    if body.kind is not None:
        made["kind"] = body.kind
    if body.turns:
        made["turns"] = [
            {"time": number(time), "velocity": numbers(*velocity)} for time, velocity in body.turns
        ]
    return made


def _json(value: object) -> str:
    return json.dumps(value, separators=(",", ":"))
