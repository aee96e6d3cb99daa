"""Works out the answers of the test vectors of docs/specification.md.

    python tests/vectors/make.py            writes all files
    python tests/vectors/make.py --check    writes none; prints which differ, and ends with 1 if any does

The answers are from kinetile's certifier (``kinetile_accuracy.specification``), in exact numbers. The
questions stay as they are in the files: they were drawn once, in the families of README.md. A new question
is a new row with any answer, or a new scene with any contacts.
"""

import json
import re
import struct
import sys
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from math import ldexp, sqrt
from pathlib import Path
from typing import Any

import numpy as np

import kinetile as kt
from kinetile.kernel.log import INSERTED, MOVED, OF_KIND, REANCHORED, REMOVED, TURNED, Fingerprint
from kinetile.scene.files import loads_scene
from kinetile_accuracy.specification import shapes
from kinetile_accuracy.specification.arithmetic import (
    FlightPlan,
    Frame,
    Separation,
    anchored,
    exchanged_along,
    tick_of,
    unit_bits,
    wall_tick,
)
from kinetile_accuracy.specification.course import ACCELERATED, EVENTS, LEAVING, Course, CourseEvent
from kinetile_accuracy.specification.touching import touching_tick

HERE = Path(__file__).parent

KEPT = ("scenes.json", "shape_sizes.json")
"""Files whose answers are kept as well: the validity of a scene, and the r of a shape. The certifier reads
scenes and shapes as kinetile makes them, so it has no answer of its own (rules 2 and 3s)."""

SHOWN = 100
"""The number of written contacts of a run."""

Words = list[str]
Body = tuple[list[Words], str, Words]
"""A body of a shape: its core, radius and plan."""


def numbers(*values: float) -> Words:
    """Returns doubles as strings; there is one zero."""
    return [(value + 0.0).hex() for value in values]


def doubles(words: Iterable[str]) -> Any:
    return tuple(map(float.fromhex, words))


def contact(e: int, *plans: Words) -> str | None:
    """Rule 5: the tick, or None."""
    return _touching(None, e, plans)


def accelerated_contact(e: int, met: bool, *plans: Words) -> str | None:
    """Rules 5 and 7: the tick, or None."""
    return _touching(None, e, plans, met)


def shape_contact(e: int, *bodies: Body) -> str | None:
    """Rule 5s: the tick, or None."""
    plans = ([*plan[:4], "0x0p+0", plan[4]] for _, _, plan in bodies)
    return _touching(_difference(*bodies), e, plans)


def wall(e: int, sides: Words, plan: Words) -> list[Any] | None:
    """Rule 6: tick and wall, or None."""
    frame = Frame(doubles(sides), e)
    return _at_wall(wall_tick(_plan(plan, frame), frame))


def accelerated_place(e: int, plan: Words, tick: str) -> Words:
    """Rule 4a: x, y, vx and vy once the plan is anchored at the tick."""
    place, velocity = _plan(plan, Frame(None, e)).moved(int(tick), ldexp(1.0, -52 - e))
    return numbers(*place, *velocity)


def exchange(masses: Words | None, *bodies: Words) -> Words:
    """Rule 9: the velocities of both."""
    (xa, ya, *one), (xb, yb, *two) = map(doubles, bodies)
    dx, dy = xb - xa, yb - ya
    length = sqrt(dx * dx + dy * dy)
    along = dx / length, dy / length
    a, b = exchanged_along(along, (tuple(one), tuple(two)), masses and doubles(masses))
    return numbers(*a, *b)


def place(e: int, plan: Words, anchor: str, tick: str) -> Words:
    """Rule 4: x and y once the plan is anchored at the tick."""
    x, y, vx, vy = doubles(plan)
    ticks, length = int(tick) - int(anchor), ldexp(1.0, -52 - e)
    return numbers(anchored(x, vx, ticks, length)[0], anchored(y, vy, ticks, length)[0])


def unit(sides: Words | None, bodies: list[Words], turned: list[Words]) -> int:
    """Rule 3: the e of the unit of a scene; of any numbers, so it is not checked."""
    states = np.array([doubles(body) for body in bodies]).reshape(-1, 5)
    scene = kt.Scene.__new__(kt.Scene)
    scene.__dict__.update(
        position=states[:, :2],
        velocity=states[:, 2:4],
        radius=states[:, 4],
        arena=sides and doubles(sides),
        commands=tuple(kt.Turn(0, 0.0, doubles(velocity)) for velocity in turned),
        unit=None,
        acceleration=np.zeros((0, 2)),
        gravity=(0.0, 0.0),
    )
    return unit_bits(scene)


def tick(e: int, start: str, time: str) -> str:
    """Rule 3: the tick of a time."""
    return str(tick_of(float.fromhex(time), float.fromhex(start), e))


def shape_wall(e: int, sides: Words, body: Body) -> list[Any] | None:
    """Rule 6s: tick and wall, or None."""
    frame, (*plan, anchor) = Frame(doubles(sides), e), body[2]
    return _at_wall(shapes.wall_tick(_shape(body), _plan([*plan, "0x0p+0", anchor], frame), frame))


def shape_exchange(masses: Words | None, *bodies: Body) -> Words:
    """Rule 9s: the velocities of both."""
    (xa, ya, *one), (xb, yb, *two) = (doubles(plan) for _, _, plan in bodies)
    plans = (_plan([*plan, "0x0p+0", "0"], Frame(None, 0)) for _, _, plan in bodies)
    along, _ = shapes.normal_and_face(_difference(*bodies), (xb - xa, yb - ya), Separation(*plans).ways[1])
    a, b = exchanged_along(along, (tuple(one), tuple(two)), masses and doubles(masses))
    return numbers(*a, *b)


def _touching(m: shapes.Difference | None, e: int, plans: Iterable[Words], met: bool = False) -> str | None:
    frame = Frame(None, e)
    tick = touching_tick(m, Separation(*(_plan(words, frame) for words in plans)), met)
    return None if tick is None else str(tick)


def _plan(words: Words, frame: Frame) -> FlightPlan:
    """Returns a plan of x, y, vx, vy, radius and anchor, and perhaps an acceleration."""
    *plan, radius = doubles(words[:5])
    return FlightPlan(*plan, int(words[5]), radius, frame, pull=doubles(words[6:]) or (0.0, 0.0))


def _at_wall(found: tuple[int, int] | None) -> list[Any] | None:
    return found and [str(found[0]), found[1]]


def _shape(body: Body) -> kt.Shape:
    return kt.Shape(tuple(map(doubles, body[0])), float.fromhex(body[1]))


def _difference(one: Body, two: Body) -> shapes.Difference:
    return shapes.Difference(_shape(one), _shape(two))


ANSWERS: dict[str, Callable[..., Any]] = {
    "contacts": contact,
    "walls": wall,
    "accelerated_contacts": accelerated_contact,
    "accelerated_places": accelerated_place,
    "exchanges": exchange,
    "places": place,
    "units": unit,
    "times": tick,
    "shapes": shape_contact,
    "shape_walls": shape_wall,
    "shape_exchanges": shape_exchange,
}
"""By the name of the file, or of its folder: a question is a row without its last field, the answer."""

_CLASSES = ("clock", "turn", "wall", "pair")
COUNTED = {"runs": _CLASSES, "rules": (*_CLASSES, "insertion", "removal", "begin", "end")}
"""The counted events in the runs of a folder."""

_OTHERS = {
    REANCHORED: "clock",
    TURNED: "turn",
    ACCELERATED: "acceleration",
    OF_KIND: "kind",
    MOVED: "move",
    INSERTED: "insertion",
    REMOVED: "removal",
    LEAVING: "leaving",
}


def scene_of(said: dict[str, Any]) -> kt.Scene:
    """Returns a scene of the vectors: a scene file, read by kinetile."""
    return loads_scene("".join(f"{key} = {_toml(value)}\n" for key, value in said.items()))


def _toml(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {_toml(each)}" for key, each in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    is_double = isinstance(value, str) and re.match("-?0x|inf$", value)
    return repr(float.fromhex(value)) if is_double else json.dumps(value)


def _end_of(scene: kt.Scene) -> tuple[int, int | None]:
    """Returns the tick of a scene's end, and the most contacts of this tick."""
    end, until = scene.settings.end, scene.settings.until
    if end is not None:
        return (end[0] << 52) + end[1], end[2]
    assert until is not None
    return tick_of(until, scene.start, unit_bits(scene)), None


def _events(scene: kt.Scene) -> Iterator[tuple[str, CourseEvent]]:
    """Yields the events of a scene up to its end, each with its kind; the last is ``"no room"`` if the answer
    ends before an insertion, or another kind."""
    end, most = _end_of(scene)
    course = Course(scene, None if most is None else (end, most))
    while (event := course.next(end)) is not None:
        course.carry_out()
        kind = _OTHERS.get(event.b, "wall")
        if event.b >= 0:
            passing = "begin" if event.a < event.b else "end"
            kind = "pair" if course.has_changed_plans(event) else passing
        yield kind, event
    for each in scene.commands:
        event = CourseEvent(course.now, each.body, EVENTS[type(each)])
        if course.is_planned(event) and (course.now, each.at[2] if each.at else 0) <= (end, most or 0):
            yield "no room", event


def _answered(run: dict[str, Any], folder: str) -> str:
    """Returns the text of a run with its answer: a line for each body, and one for the contacts."""
    scene = scene_of(run["scene"])
    happened = list(_events(scene))
    counted = Counter(kind for kind, _ in happened)
    events = [event for kind, event in happened if kind in ("wall", "pair", "begin", "end")]
    contacts = [(*divmod(tick, 1 << 52), a, b) for tick, a, b in events]
    fingerprint = Fingerprint()
    fingerprint.update(b"".join(struct.pack("<qqii", *each) for each in contacts))
    told = {key: run[key] for key in ("otherwise",) if key in run}
    told |= {"ended": "no room"} if counted["no room"] else {}
    *head, (_, bodies) = run["scene"].items()
    first = [[str(epoch), str(tick), a, b] for epoch, tick, a, b in contacts[:SHOWN]]
    more = [kind for kind in ("acceleration", "kind", "move", "leaving") if counted[kind]]
    counts = {kind: counted[kind] for kind in (*COUNTED[folder], *more)}
    return "\n".join(
        [
            f'  {{"name": {json.dumps(run["name"])},'
            + "".join(f' "{key}": {json.dumps(value)},' for key, value in told.items()),
            '   "scene": {' + ", ".join(f'"{key}": {_json(value)}' for key, value in head) + ', "bodies": [',
            ",\n".join(f"     {_json(body)}" for body in bodies) + "]},",
            f'   "e": {unit_bits(scene)}, "end": "{_end_of(scene)[0]}", "happened": {json.dumps(counts)},',
            f'   "count": {len(contacts)}, "fingerprint": "{fingerprint.hexdigest()}",',
            f'   "contacts": {_json(first)}}}',
        ]
    )


def _json(value: object) -> str:
    return json.dumps(value, separators=(",", ":"))


def names() -> list[str]:
    found = sorted(path.relative_to(HERE).as_posix() for path in HERE.rglob("*.json"))
    return [name for name in (*found, "discs.txt") if name not in KEPT]


def made(name: str, text: str) -> str:
    """Returns the text of a file with the answers of the rules in place of its present answers."""
    if name == "discs.txt":
        return "".join(_disc(*line.split(" ")) for line in text.splitlines())
    said, rule = json.loads(text), name.removesuffix(".json").partition("/")[0]
    about = f'{{\n "about": {json.dumps(said["about"])},\n'
    if rule in COUNTED:
        body = ",\n".join(_answered(run, rule) for run in said["runs"])
        return f'{about} "runs": [\n{body}\n ]\n}}\n'
    families = ",\n".join(
        f"  {json.dumps(family)}: [\n"
        + ",\n".join(_json([*q, ANSWERS[rule](*q)]) for *q, _ in rows)
        + "\n  ]"
        for family, rows in said["families"].items()
    )
    return f'{about} "fields": {json.dumps(said["fields"])},\n "families": {{\n{families}\n }}\n}}\n'


def _disc(grade: str, family: str, e: str, _: str, *words: str) -> str:
    """Returns a line of discs with its tick; the question has its difficulty in doubles."""
    found = contact(int(e), [*words[:5], "0"], [*words[5:], "0"])
    return " ".join([grade, family, e, found or "-", *words]) + "\n"


def main(arguments: list[str]) -> int:
    """Writes or compares all files; returns the exit code."""
    if arguments not in ([], ["--check"]):
        print(__doc__)
        return 2
    wrong = 0
    for name in names():
        path = HERE / name
        there = path.read_text(encoding="ascii")
        text = made(name, there)
        if not arguments:
            path.write_text(text, encoding="ascii", newline="\n")
        elif text != there:
            print(f"{name} is not what would be made")
            wrong += 1
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
