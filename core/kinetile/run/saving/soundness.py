"""Tables of a saved run, checked before an engine continues from them.

The compiled loop reads indices without looking at them: one that is out of its table ends the process. A
checksum detects damage, and whoever changes a file can compute it anew. So of tables that another process has
written every index is compared with its table, every list is read in both directions, and every number that
follows from the scene is compared with it. What is left are plans, ticks and counts, which describe some
simulation. O(n).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from kinetile.kernel.clock import SPAN, TICKS
from kinetile.kernel.compiled import python_of
from kinetile.kernel.log import INSERTED, REANCHORED, REMOVED, TURNED
from kinetile.kernel.loop.commands import window_of
from kinetile.kernel.passings import MOST_IMAGES
from kinetile.kernel.skin import Skin
from kinetile.kernel.tables import JAMMED, NOBODY, PARTING, SPARE, Kernel
from kinetile.run.audit import columns_of, followed, of_calendar, of_entries, of_lists, of_lookup, of_places
from kinetile.run.engine import layout
from kinetile.run.engine.agenda import command_of
from kinetile.run.engine.engine import Parts
from kinetile.run.engine.layout import as_bytes
from kinetile.run.prepared import LEAST
from kinetile.scene import Scene
from kinetile.scene.checks import LARGEST

_PREPARED = ("position", "velocity", "radius", "mass", "kind_numbers", "shape")


def check_tables(parts: Parts, k: Kernel, scene: Scene, prepared: Scene) -> None:
    """Raises ValueError, or an exception of an index or of arithmetic, for tables that no engine has.

    ``k`` are tables of this scene, and ``prepared`` the scene for which the phases were prepared.
    """
    for said in _forms(parts, k, scene, prepared):
        raise ValueError(said)  # the tables of another form cannot be read further
    plain = {name: np.asarray(table) for name, table in parts.tables.items()}
    with np.errstate(all="ignore"):
        for said in _faults(parts, columns_of(k._replace(**plain)), columns_of(k), scene):
            raise ValueError(said)


def _forms(parts: Parts, k: Kernel, scene: Scene, prepared: Scene) -> Iterator[str]:
    """Each table has the elements that it has here, and as many as the others need."""
    tables = parts.tables
    for name, table in tables.items():
        mine = np.asarray(getattr(k, name)).dtype
        if table.ndim != 1 or table.dtype.descr != mine.descr or table.itemsize != mine.itemsize:
            yield f"the table {name} has other elements"
    slots, pairs, lookup = (len(tables[name]) for name in ("bodies", "pairs", "lookup"))
    slices, bodies = len(tables["links"]) - slots, len(prepared.radius)
    if slots not in (bodies, prepared.capacity) or prepared.capacity > max(slots, 2 * bodies, LEAST):
        yield f"there are {slots} slots for {bodies} bodies, and room for {prepared.capacity}"
    for name in _PREPARED:
        column = np.asarray(getattr(prepared, name))
        if len(column) != bodies or not np.isfinite(column[column != np.inf]).all():
            yield f"the phases were prepared for bodies without a {name}"
    wanted = dict.fromkeys(("bodies", "mass", "radii", "places", "queue"), slots)
    wanted |= {"sides": slots if scene.shapes else 0, "images": slots if scene.periodic else 0}
    wanted |= dict.fromkeys(("traits", "passers"), slots if len(k.rules) else 0)
    wanted |= {"marks": slices >> 6, "clock": 1, "counts": 1, "firsts": slots if lookup else 0}
    wanted |= {name: len(getattr(k, name)) for name in ("rules", "numbers", "offers")}
    wanted["lookup"] = 1 << max(4, (2 * pairs - 1).bit_length()) if pairs else lookup and 16
    wanted["watch"] = len(tables["slots"]) if len(tables["watch"]) else 0
    for name, length in wanted.items():
        if len(tables[name]) != length:
            yield f"the table {name} has {len(tables[name])} elements, and not {length}"
    if slices < 64 or slices & (slices - 1) or slices < 2 * slots:
        yield f"the calendar has {slices} slices for {slots} slots"
    if len(tables["near"]) < slots + SPARE or not 0 <= parts.numbers <= len(tables["slots"]):
        yield "there is no room for the bodies near one, or for the numbers of bodies"
    rows = (2 * MOST_IMAGES if scene.periodic else 2) * slots if len(k.rules) else 0
    for name in ("rules", "numbers"):
        if as_bytes(tables[name]).tobytes() != as_bytes(np.asarray(getattr(k, name))).tobytes():
            yield f"the table {name} is not that of the scene"
    limits, right = np.asarray(tables["clock"])["limits"][0], _limits(parts, k, prepared)
    odd = [
        name for name in limits.dtype.names if name not in ("least", "faster") and limits[name] != right[name]
    ]
    if odd or limits["least"] not in (np.inf, right["least"], prepared.radius.min(initial=np.inf)):
        yield f"the limits {', '.join(odd)} do not follow from the bounds"
    if parts.log_rows < max(rows, layout.LOG_ROWS):
        yield f"the log has room for {parts.log_rows} rows"


def _limits(parts: Parts, k: Kernel, prepared: Scene) -> Any:
    """Returns the limits that follow from the bounds, which themselves have the skin that follows."""
    slots, bounds, tick = len(parts.tables["bodies"]), parts.bounds, float(k.clock[0].tick)
    bounds = bounds._replace(skin=Skin.of(slots, bounds.extent, bounds.speed, tick))
    if bounds.skin != parts.bounds.skin:
        raise ValueError("the skin is not that of the bounds")
    own = k._replace(clock=k.clock.copy(), bodies=k.bodies.copy())
    layout.set_limits(own, bounds, prepared)
    return np.asarray(own.clock)["limits"][0]


def _faults(parts: Parts, k: Any, mine: Any, scene: Scene) -> Iterator[str]:
    """What the tables contain fits together; ``mine`` are those of an engine of this scene."""
    clock, slots = k.clock, len(k.bodies)
    yield from _of_the_clock(parts, k, mine)
    number, there = k.queue.number, np.flatnonzero(k.queue.number >= 0)
    named = np.flatnonzero(k.slots != NOBODY)
    right = np.array_equal(np.sort(number[there]), named) and bool((there < clock.bodies).all())
    if not right or not np.array_equal(k.slots[number[there]], there) or clock.present != len(there):
        yield "the numbers of bodies and their slots do not belong together"
        return
    queue, bodies = k.queue, k.bodies
    in_range = [
        ("partner", queue.partner, NOBODY, slots),
        ("kind", queue.kind, 0, PARTING + 1),
        ("exact", queue.exact, 0, 2),
        ("last", bodies.last, NOBODY, slots),
        ("firsts", k.firsts, NOBODY, len(k.pairs)),
        ("lookup", k.lookup, NOBODY, len(k.pairs)),
        ("passers", k.passers, NOBODY, len(k.passings)),
        ("offers", k.offers.a[: clock.lists.offered], 0, slots),
        ("offers", k.offers.b[: clock.lists.offered], NOBODY, slots),
        ("overlapping", parts.overlapping, 0, len(scene)),
    ]
    if scene.shapes:
        in_range.append(("form", bodies.form[there], 0, len(scene.shapes)))
    if len(k.traits):
        in_range += [("kind", k.traits.kind[there], 0, clock.kinds), ("inside", k.traits.inside, 0, 1 << 30)]
    for table in (k.pairs, k.passings):
        in_range += [(each, getattr(table, each), NOBODY, slots) for each in ("a", "b")]
        steps = ("next_a", "prev_a", "next_b", "prev_b")
        in_range += [(each, getattr(table, each)[table.a >= 0], NOBODY, len(table)) for each in steps]
        in_range.append(("free record", table.next_a, NOBODY, len(table)))
    for name, column, least, end in in_range:
        if ((column < least) | (column >= end)).any():
            yield f"a {name} is out of its range, {least} to {end - 1}"
            return
    if len(followed(bodies.last.tolist(), clock.lists.vacant, slots)) != clock.bodies - clock.present:
        yield "the list of empty slots is not that"
    if clock.calendar.filed:
        yield from of_calendar(k)
    lists = clock.lists
    yield from of_lookup(k)
    yield from of_lists(k.pairs, k.firsts, "the pair set", lists.pairs, lists.free)
    if len(k.passers):
        yield from of_lists(k.passings, k.passers, "the passings", lists.passings, lists.passable)
    yield from _of_plans(parts, k, there, scene)
    yield from _of_commands(parts, k, there)


def _of_the_clock(parts: Parts, k: Any, mine: Any) -> Iterator[str]:
    """Numbers of the clock follow from the scene, or are in their range."""
    clock, lists, slots = k.clock, k.clock.lists, len(k.bodies)
    for one, other, names in (
        (clock, mine.clock, ("tick", "per_time", "kinds")),
        (clock.torus, mine.clock.torus, ("x", "y", "per_x", "per_y", "half_x", "half_y")),
    ):
        for name in names:
            if getattr(one, name) != getattr(other, name):
                yield f"{name} of the clock is not that of the scene"
    jam = clock.jam
    in_range = [
        ("now", clock.now, -1, SPAN + 1),
        ("bodies", clock.bodies, 0, slots + 1),
        ("present", clock.present, 0, clock.bodies + 1),
        ("built", clock.built, 0, 2),
        ("filed", clock.calendar.filed, 0, 2),
        ("shift", clock.calendar.shift, 0, 63),
        ("slice", clock.calendar.slice, -(1 << 62), 1 << 62),
        ("offered", lists.offered, 0, len(k.offers) + 2),
        ("pairs", lists.pairs, 0, len(k.pairs) + 1),
        ("wanted", lists.wanted, 0, 1),
        ("passings", lists.passings, 0, len(k.passings) + 1),
        ("logged", lists.logged, 0, 1),
        ("written", lists.written, 0, 1),
        ("command", lists.command, 0, lists.commands + 1),
        ("commands", lists.commands, 0, len(k.commands) + 1),
        ("number", clock.torus.number, 0, len(k.slots) + 1),
        ("due", clock.stops.due, 0, 2 if len(k.watch) else 1),
        ("spins", jam.spins, 0, 1 << 62),
        ("window", jam.window, 0, 1 << 62),
        ("base", parts.base, 0, 1 << 200),
        ("epoch", clock.epoch, *((parts.base, parts.base + 1) if slots else (-(1 << 63), 1 << 63))),
    ]
    for name, value, least, end in in_range:
        if not least <= value < end:
            yield f"{name} is {value}"
    counts = vars(k.counts).values()
    if not all(0 <= each < 1 << 61 if isinstance(each, int) else np.isfinite(each) for each in counts):
        yield "a count is none"
    if clock.fault.code not in (0, JAMMED):
        yield f"the run had ended with fault {clock.fault.code}"
    if jam.spin_limit != layout.spin_limit(slots) or jam.window_size != python_of(window_of)(clock.present):
        yield "the limits of a jam are others"


def _of_plans(parts: Parts, k: Any, there: Any, scene: Scene) -> Iterator[str]:
    """Bodies are where they can be, no faster than the bound, of a mass and a size."""
    bodies, now = k.bodies, k.clock.now
    anchor = bodies.anchor[there]
    if (anchor > max(now, 0)).any() or (anchor < -(1 << 62) - SPAN).any():
        yield "a plan begins after the present"
    flown = (now - anchor) * k.clock.tick
    speed, bounds = np.hypot(bodies.vx[there], bodies.vy[there]), parts.bounds
    far = 2.0 * bounds.extent + 2.0 * speed * abs(flown)
    radius = bodies.radius[there]
    for place in (bodies.x[there], bodies.y[there]):
        if not (np.abs(place) <= far + radius).all():
            yield "a body is farther away than the run allows for"
    if not (speed <= bounds.speed * (1.0 + 2.0**-20)).all():
        yield "a body is faster than the run allows for"
    if not ((radius > 0.0) & (radius <= LARGEST) & (k.mass[there] > 0.0)).all():
        yield "a body has no radius or no mass"
    if not np.array_equal(k.radii[there], radius):
        yield "the radii of bodies do not belong together"
    if not np.array_equal(bodies.reach[there], radius + bounds.skin.delta):
        yield "the reach of a body is not its radius and the skin"
    if k.clock.built:
        yield from of_places(k)
    if not k.clock.stops.before:
        yield from of_entries(k)


def _of_commands(parts: Parts, k: Any, there: Any) -> Iterator[str]:
    """Each command is for a body that is there by then, or inserts one that is not, in the order of time."""
    lists, present = k.clock.lists, set(k.queue.number[there].tolist())
    rows = np.asarray(parts.tables["commands"])[lists.command : lists.commands]
    waiting = [command_of(row, parts.base) for row in rows]
    last = k.clock.now + parts.base * TICKS
    for each in (*waiting, *parts.later):
        new = each.code == INSERTED
        known = 0 <= each.body < len(k.slots) and (each.body in present) != new
        if each.code not in (TURNED, REANCHORED, INSERTED, REMOVED) or not known or each.ticks < last:
            yield f"a command for body {each.body} is none, or too late"
            return
        last = each.ticks
        if new:
            present.add(each.body)
        elif each.code == REMOVED:
            present.remove(each.body)
        right = not new or (0.0 < each.radius <= LARGEST and each.mass > 0.0)
        flies = all(abs(each[at]) <= LARGEST for at in range(3, 7))
        if not right or not flies or not 0 <= each.kind < max(k.clock.kinds, 1):
            yield f"a command for body {each.body} has values that no body has"
