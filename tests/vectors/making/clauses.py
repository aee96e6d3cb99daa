"""Runs for single clauses of the rules: each is told from another reading of its clause (``otherwise``)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import inf, ldexp, nextafter

from .draws import Draws
from .edges import barred
from .images import images
from .rules import Plan, are_closer, has_room, overlap_at_insertion, overlap_at_start
from .scenes import Asked
from .whole_runs import ANY, At, Body, Command, Insert, Remove, Restitution, Scene, Turned, events

__all__ = ["CLAUSES", "scenes"]

BALL, SENSOR, POST = "ball", "sensor", "post"
PASSES = (((BALL, SENSOR), "pass"),)
STILL = (0.0, 0.0)


def _ball(x: float, y: float, vx: float = 0.0, vy: float = 0.0, radius: float = 0.25) -> Body:
    return Body((x, y), (vx, vy), radius, kind=BALL)


def _sensor(x: float, y: float, vx: float = 0.0, vy: float = 0.0, radius: float = 0.25) -> Body:
    return Body((x, y), (vx, vy), radius, kind=SENSOR)


def bars() -> Iterator[Asked]:
    """Rule 7: barred until one of them gets a new plan."""
    d = Draws("bars and passings")
    otherwise = "a passing ends a bar"
    found = 0
    while found < 3:
        scene = barred(d)
        one, two = (body._replace(kind=BALL) for body in scene.bodies)
        (x, y), (vx, vy) = one.position, one.velocity
        sensor = _sensor(x + 2.0 * vx, y + 2.0 * vy, radius=0.0625)
        if vx * vx + vy * vy < 0.5:
            continue
        scene = Scene((one, two, sensor), responses=PASSES)
        if any(event.barred for event in events(scene, (8, 0, 0))):
            found += 1
            yield Asked("two that are barred pass through a third", scene, 8.0, otherwise=otherwise)


def units() -> Iterator[Asked]:
    """Rule 3: a scene may say its unit."""
    otherwise = "a given unit is ignored"
    there, back = Body((0.25, 0.5), (0.75, 0.3), 0.1), Body((0.7, 0.5), (-0.6, 0.1), 0.1)
    for unit in (0, 10):
        for speed in (1.0, 37.0):
            bodies = tuple(
                body._replace(velocity=(body.velocity[0] * speed, body.velocity[1] * speed))
                for body in (there, back)
            )
            if (unit == 0) != (speed == 1.0):
                scene = Scene(bodies, (1.0, 1.0), unit=unit)
                yield Asked(
                    f"a unit of 2^-{unit}, speeds about {speed}", scene, 8.0 / speed, otherwise=otherwise
                )


def orders() -> Iterator[Asked]:
    """Rules 2 and 8: of one tick commands come by k, then as they are written."""
    otherwise = "commands of a tick come as they are written, whatever their k"
    walls = (Body((1.25, 1.0), (-1.0, 0.0), 0.25), Body((1.25, 3.0), (-1.0, 0.0), 0.25))
    late = Turned(1.0, 1, (0.0, 0.5), (1, 0, 1))
    early = Turned(1.0, 0, (0.0, 0.5), (1, 0, 0))
    scene = Scene(walls, (4.0, 4.0), commands=(late, early))
    yield Asked("after one contact, and, written later, before all of them", scene, 4.0, otherwise=otherwise)
    scene = Scene(walls, (4.0, 4.0), commands=(late, Turned(1.0, 0, (0.0, 0.5))))
    yield Asked("the same, without at for the one that comes first", scene, 4.0, otherwise=otherwise)
    never = Turned(1.0, 0, (0.5, 0.5), (1, 0, 9))
    scene = Scene(walls, (4.0, 4.0), commands=(never, late))
    yield Asked(
        "after more contacts than its tick has: when nothing else is left", scene, 4.0, otherwise=otherwise
    )
    soon = ldexp(1.0, -10)
    turns = (Turned(soon + ldexp(1.0, -60), 0, (0.5, 0.25)), Turned(soon, 0, (-0.5, 0.5)))
    scene = Scene(walls, (4.0, 4.0), commands=(*turns, late))
    name = "two of one tick, as written and not by time, since a command has an at"
    yield Asked(name, scene, 8.0, otherwise="commands come by time, at or not")


def counts() -> Iterator[Asked]:
    """Rule 8: beginnings and ends of passings count among the contacts of a tick."""
    otherwise = "passings do not count"
    pairs = (_ball(1.0, 1.0, 0.5), _sensor(2.0, 1.0), _ball(1.0, 3.0, 0.5), _ball(2.0, 3.0))
    away = Remove(1.0, 3, (1, 0, 1))
    scene = Scene(pairs, (4.0, 4.0), responses=PASSES, commands=(away,))
    yield Asked("a passing begins, and then one of a pair is removed", scene, 8.0, otherwise=otherwise)
    start = (_ball(1.0, 1.0, 0.5), _sensor(1.25, 1.0), _ball(1.0, 3.0, 0.5), _ball(1.5, 3.0))
    away = Remove(0.0, 3, (0, 0, 1))
    scene = Scene(start, (4.0, 4.0), responses=PASSES, commands=(away,))
    yield Asked("a passing that there is at the start counts at tick 0", scene, 8.0, otherwise=otherwise)
    inside = (_ball(1.0, 1.0, 0.5), _sensor(1.0, 1.0), _ball(1.0, 3.0, 0.5), _sensor(1.0, 3.0))
    comes = Insert(1.0, _sensor(1.5, 3.0), (1, 0, 1))
    scene = Scene(inside, (4.0, 4.0), responses=PASSES, commands=(comes,))
    name = "two passings end, and between an insertion begins one"
    yield Asked(name, scene, 8.0, otherwise=otherwise)


def speeds() -> Iterator[Asked]:
    """Rule 3: insertions count in S, and not in L."""
    otherwise = "insertions count in L"
    pair = (Body((0.0, 0.0), (1.0, 0.0), 0.25), Body((1.7, 0.1), (-0.3, 0.0), 0.25))
    far = Insert(0.5, Body((1000.0, 0.0), (-300.0, 0.0), 0.25))
    yield Asked("who comes is fast, and far out", Scene(pair, commands=(far,)), 8.0, otherwise=otherwise)
    large = Insert(0.5, Body((0.0, 90.0), (0.0, -30.0), 60.0))
    yield Asked("who comes is large", Scene(pair, commands=(large,)), 8.0, otherwise=otherwise)
    for bodies in (pair, ()):
        near = Insert(0.5, Body((1.5, 0.5), (31.0, 7.0), 0.25))
        scene = Scene(
            tuple(body._replace(position=(body.position[0] + 0.5, 2.0)) for body in bodies), (4.0, 4.0)
        )
        name = f"who comes is fast, in an arena with {len(bodies)} bodies"
        yield Asked(name, scene._replace(commands=(near,)), 1.0, otherwise="insertions do not count in S")


def numbers() -> Iterator[Asked]:
    """Rule 2: who comes without a number has the next unused one, in the order of writing."""
    otherwise = "numbers in the order of time"
    one = Body((1.0, 1.0), (0.5, 0.25), 0.25)
    late, early = (Insert(time, Body((2.0, time), (0.5, -0.25), 0.25)) for time in (3.0, 1.0))
    scene = Scene((one,), (4.0, 4.0), commands=(late, early))
    yield Asked("two who come, the later one written first", scene, 12.0, otherwise=otherwise)
    named = Insert(2.0, Body((3.0, 3.0), (0.75, 0.0), 0.25), number=7)
    scene = scene._replace(commands=(late, named, early, Remove(4.0, 8)))
    yield Asked("a number is written: the others come after it", scene, 12.0, otherwise=otherwise)


def rooms() -> Iterator[Asked]:
    """Rule 9: where there is no room for a body the answer ends."""
    otherwise = "who has no room is left out"
    bodies = (Body((1.25, 1.0), (-1.0, 0.0), 0.25), Body((1.25, 3.0), (-1.0, 0.0), 0.25))
    for k in (0, 1, 2):
        comes = Insert(1.0, Body((0.5, 3.25), STILL, 0.25), (1, 0, k))
        scene = Scene(bodies, (4.0, 4.0), commands=(comes,))
        yield Asked(f"no room after {k} contacts of a tick", scene, 8.0, otherwise=otherwise)
    d = Draws("room at walls")
    room: dict[bool, Body] = {}
    while len(room) < 2:
        radius = d.uniform(0.1, 0.2)
        x = 4.0 - radius * (1.0 - 1e-12)
        there = has_room(Plan(x, 2.0, 0.0, 0.0, radius, 0), (4.0, 4.0), (), 0)
        room.setdefault(there, Body((x, 2.0), (-0.5, 0.0), radius))
    for there, body in sorted(room.items()):
        scene = Scene(bodies, (4.0, 4.0), commands=(Insert(1.0, body),))
        name = f"{'room' if there else 'no room'} at a wall, by a last bit"
        yield Asked(name, scene, 8.0, otherwise="" if there else otherwise)


Decides = Callable[[Plan, Plan], bool]


def _close(d: Draws, decides: Decides, says: bool) -> tuple[Body, Body]:
    """Return two bodies that part, whose distance is decided so by a rule, and otherwise exactly."""
    while True:
        x, y, r1, r2 = d.uniform(0.4, 0.6), d.uniform(0.4, 0.6), d.uniform(0.04, 0.1), d.uniform(0.04, 0.1)
        nx, ny = d.direction()
        reach = (r1 + r2) * (1.0 - 1e-12)
        one = Plan(x, y, 0.0, 0.0, r1, 0)
        two = Plan(x + reach * nx, y + reach * ny, nx / 4.0, ny / 4.0, r2, 0)
        two = two._replace(x=two.x + ldexp(d.whole(-4, 4), -54))
        if decides(two, one) == says and are_closer(two, one, 0) != says:
            return Body((x, y), STILL, r1, kind=BALL), Body((two.x, two.y), (two.vx, two.vy), r2, kind=SENSOR)


def distances() -> Iterator[Asked]:
    """Rules 9 and 11: distances at the start and at insertions are computed in doubles."""
    otherwise = "distances are exact"
    for says in (True, False):
        d = Draws(f"close at the start {says}")
        pair = _close(d, lambda one, two: overlap_at_start(one, two, 0), says)
        scene = Scene(pair, (1.0, 1.0), responses=PASSES)
        yield Asked(f"at the start they {'overlap' if says else 'do not'}", scene, 2.0, otherwise=otherwise)
        d = Draws(f"close at an insertion {says}")
        one, two = _close(d, lambda new, old: overlap_at_insertion(new, old, 0), says)
        scene = Scene((one,), (1.0, 1.0), responses=PASSES, commands=(Insert(0.5, two),))
        yield Asked(f"who comes {'overlaps' if says else 'does not'}", scene, 2.0, otherwise=otherwise)
        d = Draws(f"room {says}")
        one, two = _close(d, lambda new, old: not has_room(new, None, [old], 0), says)
        scene = Scene((one,), (1.0, 1.0), commands=(Insert(0.5, two._replace(kind=BALL)),))
        yield Asked(f"there is {'no room' if says else 'room'}", scene, 2.0, otherwise=otherwise)


def responses() -> Iterator[Asked]:
    """Rule 11: which response counts."""
    walls, general = "responses for any body are for walls as well", "the most general response counts first"
    post = Body((3.0, 3.0), (-0.75, 0.0), 0.25, kind=POST)
    scene = Scene((_ball(1.0, 1.0, 0.5), _ball(3.0, 1.0, -0.75), _ball(1.0, 3.0, 0.5), post), (4.0, 4.0))
    alone = scene._replace(bodies=(_ball(1.0, 1.0, 0.5, 0.25), post))
    for pair in ((ANY, ANY), (BALL, ANY)):
        name = f"{' and '.join(pair)} are bodies, not walls"
        yield Asked(name, alone._replace(responses=((pair, "stop"),)), 12.0, otherwise=walls)
    said = (((BALL, "wall"), "stop"), ((ANY, "wall"), "elastic"))
    name = "a kind and the walls, before any and the walls"
    yield Asked(name, scene._replace(responses=said), 12.0, otherwise=general)
    for special in (BALL, POST):
        said = (((BALL, special), "elastic"), ((BALL, ANY), "stop"))
        name = f"ball and {special}, before ball and any"
        yield Asked(name, scene._replace(responses=said), 12.0, otherwise=general)
    comes = Insert(0.5, Body((2.0, 1.0), STILL, 0.25))
    said = (((BALL, BALL), "stop"),)
    name = "who is inserted without a kind is of that of body 0"
    without = "who is inserted without a kind is of kind 0"
    yield Asked(name, scene._replace(responses=said, commands=(comes,)), 12.0, otherwise=without)
    said = (((BALL, ANY), "pass"), ((ANY, ANY), "stop"))
    yield Asked("ball and any, before any and any", scene._replace(responses=said), 12.0, otherwise=general)
    stop = (BALL, BALL), "stop"
    alone = Insert(0.0, Body((4.0, 1.0), STILL, 0.25))
    commands = Insert(1.0, _ball(1.0, 1.0, 1.0)), Insert(0.5, _sensor(6.0, 3.0)), alone
    scene = Scene((), (8.0, 4.0), responses=(stop,), commands=commands)
    name = "nobody is there at the start: who comes without a kind is of the first that is written"
    yield Asked(name, scene, 12.0, otherwise=without)
    scene = scene._replace(
        responses=(((SENSOR, SENSOR), "elastic"), stop),
        commands=(alone, Insert(1.0, Body((1.0, 1.0), (1.0, 0.0), 0.25))),
    )
    name = "nor has anybody who comes a kind: they are of the lowest that a response names"
    yield Asked(name, scene, 12.0, otherwise=without)


def ends() -> Iterator[Asked]:
    """Rule 8: an exact end."""
    otherwise = "an exact end is the end of its tick"
    four = tuple(Body((1.25, 0.5 + n), (-1.0, 0.0), 0.25) for n in range(3))
    struck = (Body((2.0, 3.5), (0.5, 0.0), 0.25), Body((3.0, 3.5), STILL, 0.25))
    scene = Scene((*four, *struck), (4.0, 4.0))
    for k in range(4):
        yield Asked(f"{k} contacts of the last tick", scene, end=(1, 0, k), otherwise=otherwise)
    turn = Turned(1.0, 1, (0.0, 0.5), (1, 0, 1))
    gone = Remove(1.0, 4, (1, 0, 3))
    for k in (1, 2):
        with_commands = scene._replace(commands=(turn, gone))
        name = f"{k} contacts of the last tick, and the commands among them"
        yield Asked(name, with_commands, end=(1, 0, k), otherwise=otherwise)
    inside = (_ball(1.0, 1.0, 0.5), _sensor(1.0, 1.0), _ball(1.25, 3.0, -1.0), _ball(1.25, 2.0, -1.0))
    gone = Remove(1.0, 1, (1, 0, 1))
    scene = Scene(inside, (4.0, 4.0), responses=PASSES, commands=(gone,))
    yield Asked("a removal there ends a passing", scene, end=(1, 0, 1), otherwise=otherwise)
    scene = Scene(inside[:2], (4.0, 4.0), responses=PASSES)
    yield Asked("the very start, at which two pass", scene, end=(0, 0, 0))


def immovable() -> Iterator[Asked]:
    """Rules 9 and 11: an immovable body is turned by walls, and by another that is immovable."""
    otherwise = "nothing turns an immovable body"
    heavy = Body((1.0, 1.0), (0.75, 0.5), 0.5, inf)
    light = (Body((3.0, 1.0), (-0.3, 0.1), 0.25), Body((2.0, 3.0), (0.2, -0.6), 0.25, 3.0))
    yield Asked(
        "one flies between walls and light ones",
        Scene((heavy, *light), (4.0, 4.0)),
        20.0,
        otherwise=otherwise,
    )
    other = Body((3.0, 3.0), (-0.5, -0.75), 0.5, inf)
    yield Asked("two fly, and meet", Scene((heavy, other, light[0]), (4.0, 4.0)), 20.0, otherwise=otherwise)
    kinds = Body((1.0, 1.0), (0.75, 0.5), 0.5, inf, kind=POST), *(body._replace(kind=BALL) for body in light)
    scene = Scene(kinds, (4.0, 4.0), responses=(((BALL, POST), "stop"),))
    yield Asked("who meets it stops beside it", scene, 3.0)
    scene = scene._replace(responses=(((ANY, "wall"), "stop"),))
    yield Asked("walls stop it", scene, 4.5, otherwise=otherwise)
    scene = Scene((heavy, other, light[0]), (4.0, 4.0), responses=(((ANY, ANY), "stop"),))
    otherwise = "the first immovable body does not stop"
    yield Asked("two fly, meet, and stop", scene, 20.0, otherwise=otherwise)


def losses() -> Iterator[Asked]:
    """Rule 11: restitution."""
    lossy = Restitution(0.75, 2.0**-10)
    bodies = _ball(1.0, 1.0, 0.5, 0.25), _ball(3.0, 1.2, -0.75), _ball(1.0, 3.0, 0.3, -0.7)
    bodies = (*bodies, Body((3.0, 3.0), (-0.2, -0.9), 0.5, 3.0, kind=BALL))
    scene = Scene(bodies, (4.0, 4.0), responses=(((ANY, ANY), lossy), ((ANY, "wall"), lossy)))
    yield Asked("bodies and walls give back a share", scene, 20.0)
    radius = 0.25 - ldexp(1.0, -53)  # from wall to wall it flies 2^53 + 1 ticks at speed 1
    ball = Body((radius, 1.0), (-2.0, 0.0), radius)
    walls = (((ANY, "wall"), Restitution(0.5, 2.0)),)
    scene = Scene((ball,), (2.5, 2.0), unit=0, responses=walls)
    name = "2^53 + 1 ticks are, rounded, within a contact time of 2^53"
    yield Asked(name, scene, 12.0, otherwise="ticks between contacts are exact")
    ball = Body((0.5, 1.0), (-ldexp(1.0, -9), 0.0), 0.5)
    walls = (((ANY, "wall"), Restitution(0.5, nextafter(1024.0, 0.0))),)
    for width in (2.0, nextafter(2.0, 0.0)):  # at half its speed it flies 2^62 ticks, or 1,024 less
        scene = Scene((ball,), (width, 2.0), unit=0, responses=walls)
        yield Asked(f"{'after' if width == 2.0 else 'within'} the longest contact time", scene, 8192.0)


def scenes() -> dict[str, list[Asked]]:
    """Rule 2: scenes, and what is none by its commands."""
    one, new = Body((1.0, 1.0), (0.5, 0.25), 0.25), Body((3.0, 3.0), STILL, 0.25)

    def first(time: float, number: int | None = 7, at: At | None = None) -> Insert:
        return Insert(time, new, at, number)

    turn, gone = Turned(2.0, 0, STILL), Remove(1.0, 0)
    numbers: dict[str, tuple[Command, ...]] = {
        "the next number": (first(1.0, 1),),
        "a number of the start": (first(1.0, 0),),
        "a number of the start, of one who has gone": (gone, first(2.0, 0)),
        "one number twice": (first(1.0), first(2.0)),
        "one number twice, of one who has gone": (first(1.0), Remove(2.0, 7), first(3.0)),
        "two numbers": (first(2.0, 8), Remove(3.0, 8), first(1.0), first(4.0, None)),
    }
    bodies: dict[str, tuple[Command, ...]] = {
        "who is there turns": (turn,),
        "who has gone turns": (gone, turn),
        "who has gone turns, written first": (turn, gone),
        "a turn and then a removal, written first": (gone, turn._replace(time=0.5)),
        "at one time a removal and then a turn": (gone, turn._replace(time=1.0)),
        "at one time a turn and then a removal": (turn._replace(time=1.0), gone),
        "at one tick, by k": (gone._replace(at=(1, 0, 1)), turn._replace(time=1.0, at=(1, 0, 0))),
        "at one tick, by k, gone": (gone._replace(at=(1, 0, 0)), turn._replace(time=1.0, at=(1, 0, 1))),
        "who has gone goes": (gone, gone._replace(time=2.0)),
        "who comes turns": (first(1.0), turn._replace(body=7)),
        "who is still to come turns": (first(3.0), turn._replace(body=7)),
        "nobody turns": (turn._replace(body=1),),
        "who comes without a number turns": (first(1.0, None), turn._replace(body=1)),
    }
    made = {
        family: [
            Asked(name, Scene((one,), (4.0, 4.0), commands=commands)) for name, commands in asked.items()
        ]
        for family, asked in (("numbers that are written", numbers), ("bodies that are there", bodies))
    }
    turns = one._replace(turns=((1.0, STILL),))
    name = "a turn that is written with its body, at the time at which it goes"
    made["bodies that are there"].append(Asked(name, Scene((turns,), (4.0, 4.0), commands=(gone,))))
    return made


CLAUSES: dict[str, tuple[str, Callable[[], Iterator[Asked]]]] = {
    "bars": ("Rule 7: a bar outlasts a passing.", bars),
    "counts": ("Rule 8: passings count among the contacts of a tick.", counts),
    "distances": (
        "Rules 9 and 11: distances are computed in doubles, at the start and at insertions.",
        distances,
    ),
    "ends": ("Rule 8: an exact end.", ends),
    "images": ("Rules 4p, 5p and 7p to 9p: images, and the clock of periodic axes.", images),
    "immovable": ("Rules 9 and 11: bodies of infinite mass.", immovable),
    "losses": ("Rule 11: restitution, and its contact time.", losses),
    "numbers": ("Rule 2: the numbers of bodies that come.", numbers),
    "orders": ("Rules 2 and 8: the order of commands of one tick.", orders),
    "responses": ("Rule 11: which response counts.", responses),
    "rooms": ("Rule 9: where there is no room for a body the answer ends.", rooms),
    "speeds": ("Rule 3: insertions count in S, and not in L.", speeds),
    "units": ("Rule 3: a unit that the scene says.", units),
}
