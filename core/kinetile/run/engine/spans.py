"""Spans of the clock: moves of the base that ticks count from, and spans that cannot have an event.

A span costs about a tenth of a millisecond of Python. In a scene that is slow for its clock (for its size, or
because a faster body is planned), millions of spans pass between two contacts. So spans that provably have no
event pass in one step (``skip``). Their only work is to anchor plans, every second span for each body, or
every second beat on a torus, because the rounding of an anchor is part of the answer (docs/specification.md,
rule 8). All anchorings of a body in a step are a few operations (``flown``).
"""

import math
from collections.abc import Iterable
from itertools import product
from typing import Any

import numpy as np
import numpy.typing as npt

from kinetile.arrays import Integers
from kinetile.errors import Refused
from kinetile.kernel.certificates.walls import inside_arena
from kinetile.kernel.clock import SPAN, TICKS
from kinetile.kernel.compiled import compose, disowned, hook, smaller, template
from kinetile.kernel.features import PERIODIC
from kinetile.kernel.flight import plans_now, positions_now
from kinetile.kernel.images import BEAT, anchor, remainder, turns_of
from kinetile.kernel.plan import velocities_after
from kinetile.kernel.skin import box_gaps, reaches_of
from kinetile.kernel.tables import LONG_AGO, NEVER, NOBODY, NOT_ASKED, Kernel, Quantity
from kinetile.run.compose import CommandSupport
from kinetile.run.engine.commands import anchor_again
from kinetile.run.engine.engine import MOST_UNITS, Engine
from kinetile.run.engine.fields import ticks_of
from kinetile.run.engine.kept import unchanged_if
from kinetile.run.interrupts import Unbroken

FEWEST_SPANS = 4
"""The smallest number of spans that one step skips; the structure is built again after it."""

MOST_SPANS = 1 << 50
"""The largest number of spans in one step: their beats are counted in 64 bits."""

MOST_SPANS_OPEN = 1 << 40
"""The same without an arena: so far bodies fly in a step, and the rounding of their positions then counts."""

MOST_WORK = 1 << 22
"""The number of sums in one step on a torus, some 400 for each crossed period: more would delay signals."""

MOST_PAIRS = 1 << 18
"""The number of pairs that are compared together: it bounds memory."""


def count_from_next(k: Kernel, columns: Iterable[Integers]) -> None:
    """Counts all ticks, of the tables and of a phase, from the start of the next span."""
    k.bodies.anchor[k.queue.number == NOBODY] = 0
    for ticks in columns:
        none = (ticks == NEVER) | (ticks == NOT_ASKED)
        ticks[...] = np.where(none, ticks, np.maximum(ticks, LONG_AGO + SPAN) - SPAN)
    k.clock[0].calendar.filed = 0


def quiet_spans(
    k: Kernel,
    taken: npt.NDArray[np.intp],
    walls: tuple[float, float],
    periods: tuple[float, float],
    most: int,
) -> int:
    """Returns the number of spans from now, at most ``most``, without a contact of the bodies in some slots.

    No contact can precede the earliest time of a closed gap: between two bodies, through each image, and
    between a body and the wall ahead, with room for the rounding of new anchors. Two discs that part, or pass
    each other at more than that room, do not meet (rule 5: where B >= 0). ``walls`` and ``periods`` have, for
    both axes, the position of the far wall, and the period, or 0.
    """
    bodies = k.bodies.view(np.ndarray).take(taken)
    place, radius, reach = positions_now(k, taken), bodies["radius"], reaches_of(k)[taken]
    velocity = velocities_after(*plans_now(k, taken))
    span = float(SPAN) * float(k.clock[0].per_tick) * (1.0 + 1e-9)  # room for a tick, and for these roundings
    speed = np.abs(velocity).max()
    a_span = SPAN // BEAT if any(periods) else 1  # twice the anchorings of a body in a span
    if not any(walls) and not any(periods):
        most = min(most, MOST_SPANS_OPEN)
    far = summed = np.abs(place).max()
    for wall, period in zip(walls, periods, strict=True):
        flown = speed * span * (2.0 / a_span if period else most)
        if not wall:
            far += period + flown
            summed = max(summed, 0.5 * period) + flown
        far, summed = max(far, wall), max(summed, wall)
    if any(periods):
        work = min(a_span, 400.0 * sum(speed * span / period for period in periods if period))
        most = int(min(most, MOST_WORK / (len(taken) * work))) if work > 0.0 else most
    rounding = far * 2.0**-52  # the largest error of places and their differences
    drift = a_span * summed * 2.0**-52  # and of two bodies, by the rounded sums of a span
    quiet = float(most)

    def until(gap: Any, closing: Any) -> Any:
        return (gap - 4.0 * rounding) * (1.0 - 1e-9) / (closing * span + drift)

    # Bodies that hardly move have very many spans: an infinite chord leaves the bound by the gap.
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for axis, wall in enumerate(walls):
            there, flies = place[:, axis], velocity[:, axis]
            ahead = np.where(flies < 0.0, there - reach[:, 2 * axis], wall - there - reach[:, 2 * axis + 1])
            going = (flies != 0.0) & (wall > 0.0)
            quiet = float(until(ahead[going], np.abs(flies[going])).min(initial=quiet))
        rows = max(MOST_PAIRS // len(taken), 1)
        for first in range(0, len(taken), rows):
            a = np.arange(first, min(first + rows, len(taken)))
            flies, reaches = velocity - velocity[a, None], radius[a, None] + radius
            closing = np.hypot(flies[..., 0], flies[..., 1])
            pairs = (closing > 0.0) & (np.arange(len(taken)) > a[:, None])
            nearest = place - place[a, None]
            for axis, period in enumerate(periods):
                if period:
                    nearest[..., axis] -= np.rint(nearest[..., axis] / period) * period
            # The image nearest to 0, and those around.
            for image in product(*((-period, 0.0, period) if period else (0.0,) for period in periods)):
                apart = nearest + image
                gap = np.hypot(apart[..., 0], apart[..., 1]) - reaches
                if len(k.sides):  # circles around shapes are wide, and overlap before the shapes meet
                    gap = np.maximum(gap, box_gaps((-apart[..., 0], -apart[..., 1]), reach[a], reach))
                    found = until(gap, closing)
                else:
                    ahead = -(apart * flies).sum(axis=2) / closing  # until they are nearest
                    aside = np.abs(apart[..., 0] * flies[..., 1] - apart[..., 1] * flies[..., 0]) / closing
                    spans = 2.0 * (np.maximum(ahead, 0.0) + 8.0 * rounding) / (closing * span) + 1.0
                    wide = reaches + 8.0 * rounding + drift * spans
                    chord = np.sqrt(np.maximum(wide * wide - aside * aside, 0.0))
                    found = np.maximum(until(gap, closing), until(ahead - chord, closing))
                    misses = (ahead < -4.0 * rounding) | (aside > wide * (1.0 + 1e-12))
                    found[misses & (closing * span >= 2.0 * drift)] = math.inf
                quiet = float(found[pairs].min(initial=quiet))
            beyond = min((1.5 * period for period in periods if period), default=math.inf)
            quiet = float(until(beyond - reaches, closing)[pairs].min(initial=quiet))
    return max(int(quiet), 0)


@hook
def flown(place: float, step: float, times: int, period: float) -> tuple[float, int]:
    """Returns, bit for bit, the result of ``times`` rounded sums ``place += step``, each reduced by its
    periods (0: no period); and the number of subtracted periods.

    Between two powers of two, all doubles are multiples of one number, so each sum there is rounded by the
    same amount: a tie goes to an even multiple, and the next sum from there moves as far. So from the second
    sum on, a place moves by one length until it reaches a power of two, or half a period; the multiples of
    this length and their sums are exact.
    """
    turned = 0
    half = 0.5 * period if period > 0.0 else math.inf
    while times > 0:
        before = place
        place += step
        times -= 1
        turns = turns_of(place, period)
        if turns != 0.0:
            place = remainder(place, period, turns)
            turned += int(turns)
            continue
        moves = (place + step) - place
        if moves == 0.0:
            break
        power = math.frexp(place)[1]
        if power == math.frexp(before)[1]:
            least = math.ldexp(0.5, power)
            room = abs(place) - least
            if (moves > 0.0) == (place > 0.0):
                room = smaller(2.0 * least, half) - abs(place)
            many = smaller(times, int(room / abs(moves)) - 1)
            if many > 0:
                place += many * moves
                times -= many
    return place, turned


@template
def anchor_many(k: Kernel, body: int, spans: int) -> None:
    """Anchors a plan at each second beat from the first at which it is old, in ``spans`` spans from the end
    of this one, at least 4; counts its anchor from their end."""
    beat = BEAT if PERIODIC else SPAN
    plan = k.bodies[body]
    first = plan.anchor // beat + 2
    last = (spans + 1) * (SPAN // beat) - 1
    more = (last - first) // 2
    anchor(k, body, first * beat)
    elapsed = float((2 * beat) * k.clock[0].per_tick)
    torus = k.clock[0].torus
    period_x = torus.x if PERIODIC else 0.0
    period_y = torus.y if PERIODIC else 0.0
    plan.x, turned_x = flown(plan.x, plan.vx * elapsed, more, period_x)
    plan.y, turned_y = flown(plan.y, plan.vy * elapsed, more, period_y)
    if PERIODIC:
        k.images[body].kx += turned_x
        k.images[body].ky += turned_y
    plan.anchor = (first + 2 * more - spans * (SPAN // beat)) * beat
    plan.last = NOBODY


def pass_spans(k: Kernel, spans: int) -> None:
    """Template: anchors plans as in ``spans`` spans after this one, and counts their anchors from there."""
    k = disowned(k)
    for body in range(k.clock[0].bodies):
        if k.queue[body].number >= 0:
            anchor_many(k, body, spans)


def move_base(engine: Engine, end: int | None) -> None:
    """Moves the clock's base by a span, and anchors plans that are two spans old, under every phase.
    Without bodies it moves at once to the span of ``end``, in ticks since the start."""
    if not len(engine.k.bodies) and end is not None and engine.next_command is None:
        engine.clock.base += max(engine.clock.relative(end) // SPAN, 1) * (SPAN // TICKS)
        engine.k.clock[0].now = -1  # its epoch, which may be beyond 64 bits, is not needed by a contact
        return
    leaves = not engine.bounded and len(engine.k.bodies) > 0
    if leaves and engine.reach_of_flight(engine.speed, 2) > engine.bounds.extent:
        engine.lay_out(engine.speed)
    k = engine.k
    count_from_next(k, engine.ticks)
    engine.clock.base += SPAN // TICKS
    if len(k.bodies):
        k.clock[0].epoch = engine.clock.base
    engine.k = engine.agenda.load(k, engine.clock)
    old = k.queue.number[k.bodies.anchor < -SPAN]
    if len(old):
        engine.allow(CommandSupport.TURNS)
        anchor_again(engine, np.sort(old))


def skip(engine: Engine, end: int | None, most: int) -> int:
    """Skips spans without an event in one step, at most ``most``, up to ``end`` (in ticks since the start);
    returns their number. With a recorder it skips no spans: anchors are rows."""
    clock, scene, wall = engine.k.clock[0], engine.scene, engine.composition.wall
    elsewhere = wall is not None and wall.inside is not inside_arena  # its walls may be anywhere
    awaited = any((ticks != NEVER).any() for ticks in ticks_of([engine.k.clock], Quantity.DUE))
    if (
        scene.accelerated
        or elsewhere
        or awaited
        or engine.ledger.records
        or not len(engine.taken)
        or clock.lists.passings
    ):
        return 0
    for ticks in (end, None if engine.next_command is None else engine.next_command.ticks):
        if ticks is not None:
            most = min(most, engine.clock.relative(ticks) // SPAN - 1)
    width, height = scene.arena if scene.arena is not None and engine.walled else (0.0, 0.0)
    walls = 0.0 if "x" in scene.periodic else width, 0.0 if "y" in scene.periodic else height
    most = min(most, MOST_SPANS, (MOST_UNITS - engine.clock.base) // (SPAN // TICKS))
    quiet = 0
    if most >= FEWEST_SPANS:
        quiet = quiet_spans(engine.k, engine.taken, walls, scene.periods, most)
    if quiet < FEWEST_SPANS:
        return 0
    try:
        # Without an arena the skin grows, and may be refused.
        with Unbroken() if engine.bounded else unchanged_if(engine, Refused):
            engine.clock.base += quiet * (SPAN // TICKS)
            passing = compose(pass_spans, engine.composition.parts(), "pass_spans", Kernel)
            passing(engine.packed[0], quiet)
            for past in ticks_of(engine.k, Quantity.PAST):
                past[...] = LONG_AGO
            engine.lay_out(engine.speed)
    except Refused:  # in an open plane, the skin for distant bodies: the next spans will report it
        return 0
    return quiet
