"""Images: places and contacts where an axis is periodic.

A border that bodies cross causes no event here: the law does not depend on where the box is cut. The *image*
(m, n) of a body is the body m periods further right and n further up, and a contact of two bodies is through
an image: with m and n periods added to their separation. So two bodies may meet through several images, even
at one tick. When a body crosses a border, nothing is rounded or logged, and no plan changes.

A plan's place stays near 0, so that rounding does not grow: whenever a plan is anchored, its place becomes
the remainder of IEEE 754, from -1/2 to 1/2 period, which is always a double: wrapping adds no rounding.
``k.images`` counts the periods taken off a body, so x + kx * period is its *unwrapped* place. Images are
counted between unwrapped places, from the elder of two bodies to the younger: wrapping does not change their
numbers.

For the same reason no plan grows old. At every *beat*, 2^53 ticks or two units of the clock, all plans that
are a beat old are anchored again, body by body. Then a body is at most four units away from its anchor, and
the search for the first image that another body meets ends.

Two bodies that have met through an image are barred from that image, not from each other.

Why the search and the bounds are right
=======================================

*The search* (``first_image`` in ``kernel/images.py``) visits columns of images as they come within reach in
x, and in each column the rows that are within reach while the body passes it. Both ranges are computed in
doubles and are wider than the reach by fat: places, a whole number of periods and the distance flown in 8
units are wrong by less than 32 u X, and fat is more than 1,000 u X (u = 2^-53; X bounds places,
docs/one-answer.md). So an image that is left out is met later than the best one found, by more than a tick,
or from s + 2^55 on, s the later anchor, when both plans have ended. Contacts with an image and their ticks
are decided exactly, and ties by whole numbers. A disc of ``cast`` may fly further than X: for it 2^-40 of its
flight in 8 units, 8,192 u of that, is added to fat, but no more than a period; so it is for questions.

*The bound* of ``soonest`` is the bound of the nearest image, or, if that is sooner, the time to fly W/2 less
the fattened reach along x, or H/2 less it along y, for periods W and H. Any other image differs from the
nearest one by a period along an axis, and is at least W/2 away along it, up to rounding; it cannot touch
before its distance there is down to the reach. N periods are N W, rounded, and the difference d is rounded:
with |N W| <= 2.8 L this adds less than 3.6 u L for each coordinate, giving 28 u L instead of 24 u L for d and
51 u L |v| instead of 47 for d.v; fat / 2 has 32 u L, and fat 64. If dx / W is so near a half that rounding
chooses the other image, that costs 4 u L, and fat includes it. A barred image stays in a bound, because it
may be a body's partner through another image; only the exact tick leaves it out.

*Shapes.* The search is the same, with the radii of the circles around the bodies; the certificate is the one
of rule 5s. The bound is that for the difference to the nearest image, or the time to fly W/2 less the two
radii. Two that have just met touch, so a bound of their nearest image would be 0: while that is the barred
image, by whole numbers, its bound is left out, and the bound of the other images stays.
"""

import math
from collections.abc import Callable
from typing import Any, cast

from kinetile.kernel.certificates.discs import straight_touch, touch
from kinetile.kernel.certificates.plans import Plans, are_accelerated, plans_through
from kinetile.kernel.compiled import (
    hook,
    larger,
    smaller,
    template,
    unchecked,
    with_accelerations,
    with_constants,
)
from kinetile.kernel.features import PERIODIC, only_with
from kinetile.kernel.flight import anchor_at, position_at, velocity_at
from kinetile.kernel.passings import counts_from, is_passing, passes
from kinetile.kernel.tables import NEVER, NOBODY, TOO_DEEP, Kernel, Records, blame, elder
from kinetile.kernel.vectors import product_error

BEAT = 1 << 53
"""Ticks between two beats."""

FORESEEN = 1 << 55
"""Ticks after the later anchor that limit a run's predictions: both plans are anchored before."""

HALVES = 1.5 * 2.0**52


@hook
def nearest_whole(value: float) -> float:
    """Returns the nearest whole number, at a tie the even one, for a number below 2^51 in size."""
    return (value + HALVES) - HALVES


@hook
def remainder(value: float, period: float, times: float) -> float:
    """Returns value - times * period, exactly, for the whole number that nearly minimises its size."""
    product = times * period
    return (value - product) - product_error(times, period, product)


@hook
def turns_of(place: float, period: float) -> float:
    """Returns the number of periods between a place and the box around 0: the quotient, rounded to nearest,
    at a tie to even; 0 for an axis with walls (period 0)."""
    half = 0.5 * period
    if abs(place) <= half or period == 0.0:
        return 0.0
    times = nearest_whole(place / period)
    rest = remainder(place, period, times)
    if rest > half:  # the quotient was rounded to a half
        times += 1.0
    elif rest < -half:
        times -= 1.0
    return times


@hook
def near_zero(place: float, period: float) -> float:
    """Returns a place, along an axis, without its periods; an axis with walls has period 0."""
    return remainder(place, period, turns_of(place, period))


@only_with(PERIODIC)
@hook
def wrap(k: Kernel, body: int) -> None:
    """Takes the periods off the place of a body whose plan has been anchored."""
    torus = k.clock[0].torus
    plan = k.bodies[body]
    image = k.images[body]
    if torus.x > 0.0:
        times = turns_of(plan.x, torus.x)
        if times != 0.0:
            plan.x = remainder(plan.x, torus.x, times)
            image.kx += int(times)
            if len(k.shadows) > 0:
                k.shadows[body].x -= times * torus.x
    if torus.y > 0.0:
        times = turns_of(plan.y, torus.y)
        if times != 0.0:
            plan.y = remainder(plan.y, torus.y, times)
            image.ky += int(times)
            if len(k.shadows) > 0:
                k.shadows[body].y -= times * torus.y


@template
def anchor(k: Kernel, body: int, tick: int) -> None:
    """Anchors a body's plan at a tick, without changing its motion."""
    anchor_at(k, k.bodies[body], tick)
    wrap(k, body)


@hook
def plan_of(k: Kernel, body: int) -> tuple[float, float, float, float, int, int, int, int, int]:
    """Returns a body's plan with its periods and its last image, for ``restore_plan``."""
    plan = k.bodies[body]
    kx = ky = m = n = 0
    if len(k.images) > 0:
        image = k.images[body]
        kx, ky, m, n = image.kx, image.ky, image.last_m, image.last_n
    return plan.x, plan.y, plan.vx, plan.vy, plan.anchor, kx, ky, m, n


@hook
def restore_plan(
    k: Kernel, body: int, kept: tuple[float, float, float, float, int, int, int, int, int]
) -> None:
    """Gives a body a former plan again, after it was anchored to be looked at."""
    plan = k.bodies[body]
    plan.x, plan.y, plan.vx, plan.vy, plan.anchor, kx, ky, m, n = kept
    if len(k.images) > 0:
        image = k.images[body]
        image.kx, image.ky, image.last_m, image.last_n = kx, ky, m, n


@hook
def discs_overlap(k: Kernel, early: int, late: int, dx: float, dy: float) -> float:
    """Returns the depth of the overlap of two discs at this distance."""
    return float(k.bodies[early].radius + k.bodies[late].radius - math.sqrt(dx * dx + dy * dy))


@hook
def image_of(k: Kernel, early: int, late: int, elder: int, plans: Plans) -> tuple[int, int]:
    """Returns the image of plans, counted from the elder of two bodies to the younger."""
    sense = 1 if early == elder else -1
    m = int(plans.x.turns) - (k.images[late].kx - k.images[early].kx)
    n = int(plans.y.turns) - (k.images[late].ky - k.images[early].ky)
    return sense * m, sense * n


@hook
def have_just_met(k: Kernel, early: int, late: int, plans: Plans) -> bool:
    """Returns True if two bodies have just met, through the image of their plans (rules 7 and 7p)."""
    met = k.bodies[early].last == late and k.bodies[late].last == early
    if met and len(k.images) > 0:
        m, n = image_of(k, early, late, elder(k, early, late), plans)
        met = m == k.images[early].last_m and n == k.images[early].last_n
    return bool(met)


@hook
def _accelerated(one: Records, k: Kernel, early: int, late: int, plans: Plans) -> int:
    two = k.bodies[late]
    met = have_just_met(k, early, late, plans)
    return int(touch(plans, one.radius, two.radius, int(met), -1, counts_from(k, early, late, two.anchor)))


@with_accelerations(_accelerated)
@hook
def _straight(one: Records, k: Kernel, early: int, late: int, plans: Plans) -> int:
    return int(straight_touch(plans, one.radius, k.bodies[late].radius, 0))


@hook
def discs_touch(k: Kernel, early: int, late: int, plans: Plans) -> int:
    """Returns the ticks after the later anchor until two discs touch by their plans, through the image of the
    plans, or ``NEVER``."""
    return int(_straight(k.bodies[early], k, early, late, plans))


@hook
def turns_between(k: Kernel, early: int, late: int, elder: int) -> tuple[float, float]:
    """Returns the image on the clock as whole numbers of periods to add to the place of ``late`` less the
    place of ``early``, as in their plans; images are counted from the elder of the two."""
    torus = k.clock[0].torus
    sense = 1 if early == elder else -1
    m = sense * torus.m + k.images[late].kx - k.images[early].kx
    n = sense * torus.n + k.images[late].ky - k.images[early].ky
    return float(m), float(n)


@hook
def flight_between(k: Kernel, one: Records, two: Records) -> tuple[float, float, float, float]:
    """Returns the separation from one to two by their plans, and its velocity, at the anchor of two."""
    x, y = position_at(k, one, two.anchor)
    vx, vy = velocity_at(k, one, two.anchor)
    return two.x - x, two.y - y, two.vx - vx, two.vy - vy


@hook
def time_within(place: float, speed: float, far: float, limit: float) -> tuple[float, float]:
    """Returns the first and last time, up to a limit, of a place that moves ahead within ``far`` of 0."""
    if not speed > 0.0:
        return math.inf if place < -far else 0.0, limit
    return (-far - place) / speed if place < -far else 0.0, smaller((far - place) / speed, limit)


@hook
def rows_within(
    dy: float, uy: float, enters: float, leaves: float, far: float, per_y: float
) -> tuple[float, float]:
    """Returns the first and the last row of images that are within ``far`` along y in a time."""
    from_y = dy + uy * enters
    to_y = dy + uy * leaves
    first = -float(math.floor((larger(from_y, to_y) + far) * per_y))
    return first, float(math.floor((far - smaller(from_y, to_y)) * per_y))


@hook
def is_left_out(k: Kernel, a: int, early: int, late: int, plans: Plans, passing: bool) -> bool:
    """Returns True if two bodies do not meet through the image of plans: they pass through each other there,
    or have just met there. For accelerated bodies the certificate decides the latter."""
    if passing:
        b = early + late - a
        m, n = image_of(k, early, late, a, plans)
        return bool(is_passing(k, a, b, m, n))
    return not are_accelerated(k.bodies[early]) and have_just_met(k, early, late, plans)


@unchecked
@hook
def first_image(k: Kernel, a: int, b: int) -> int:
    """Returns the tick of the first contact of two bodies, ``a`` the elder, through any image that is not
    left out, or ``NEVER``; writes the image to the clock. At equal ticks the least m counts, then the least
    n. Two that may pass do not meet in the past: that passing has begun and ended.

    Columns are ordered by their first time within reach: all behind the last are later than ``best``."""
    clock = k.clock[0]
    torus = clock.torus
    early = a if k.bodies[a].anchor < k.bodies[b].anchor else b
    late = a + b - early
    one = k.bodies[early]
    two = k.bodies[late]
    passing = len(k.rules) > 0 and passes(k, a, b)
    earliest = clock.now - two.anchor if passing else 0
    dx, dy, ux, uy = flight_between(k, one, two)
    reach = one.radius + two.radius
    far = reach * (1.0 + 2.0**-40) + clock.limits.fat
    way = 1.0 if ux > 0.0 else -1.0
    best = torus.foreseen
    column = float(math.floor((far - way * dx) * torus.per_x))
    while True:
        enters = 0.0
        leaves = limit = float(best + 2) * clock.per_tick
        if not are_accelerated(one) or torus.x > 0.0:  # else perhaps accelerated, and this is the only column
            enters, leaves = time_within(way * dx + column * torus.x, abs(ux), far, limit)
            if not enters <= limit:
                break
        row, last = rows_within(dy, uy, enters, leaves, far, torus.per_y)
        while leaves >= 0.0 and row <= last:
            plans = plans_through(k, one, two, way * column, row)
            if not is_left_out(k, a, early, late, plans, passing):
                delay = discs_touch(k, early, late, plans)
                m, n = image_of(k, early, late, a, plans)
                tie = delay == best and (m < torus.m or (m == torus.m and n < torus.n))
                if delay >= earliest and (delay < best or (tie and best < torus.foreseen)):
                    best = delay
                    torus.m = m
                    torus.n = n
            row += 1.0
        if torus.x == 0.0:
            break
        column -= 1.0
    if best >= torus.foreseen:
        return NEVER
    if best == 0:
        right, up = turns_between(k, early, late, a)
        depth = discs_overlap(k, early, late, dx + right * torus.x, dy + up * torus.y)
        if depth > clock.limits.tolerance + 1e-9 * reach:
            blame(k, TOO_DEEP, a, b)
    return int(two.anchor + best)


def first_image_of(
    touches: Callable[[Kernel, int, int, Any], int],
    overlap: Callable[[Kernel, int, int, float, float], float],
) -> Callable[[Kernel, int, int], int]:
    """Returns the hook ``meet`` for bodies with images, from counterparts of ``discs_touch`` and
    ``discs_overlap``: the second body is anchored as late as the first, or later. Each body is within its
    radius from its place, and may be accelerated along an axis with walls."""
    made = with_constants([first_image], discs_touch=touches, discs_overlap=overlap)
    return cast(Callable[[Kernel, int, int], int], made["first_image"])


@only_with(PERIODIC)
@hook
def await_through(k: Kernel, body: int) -> None:
    """Stores, beside a body's entry, the image of the last contact that was computed for it."""
    image = k.images[body]
    image.m = k.clock[0].torus.m
    image.n = k.clock[0].torus.n


@only_with(PERIODIC)
@hook
def come_together(k: Kernel, a: int, b: int, h: int) -> None:
    """Writes to the clock the addition to b - a at the contact that the entry of h awaits. Both are anchored.
    From now on the image is barred for them."""
    torus = k.clock[0].torus
    image = k.images[h]
    one = k.images[a]
    two = k.images[b]
    torus.right = float(image.m + two.kx - one.kx) * torus.x
    torus.up = float(image.n + two.ky - one.ky) * torus.y
    one.last_m = image.m
    one.last_n = image.n
    two.last_m = image.m
    two.last_n = image.n


@hook
def next_to_anchor(k: Kernel) -> int:
    """Returns the next body whose plan is a beat old at this beat; NOBODY, after setting the next beat, if
    none is left."""
    torus = k.clock[0].torus
    while torus.number < len(k.slots):
        body = k.slots[torus.number]
        torus.number += 1
        if body >= 0 and k.bodies[body].anchor < torus.beat - BEAT:
            return int(body)
    torus.number = 0
    torus.beat += BEAT
    return NOBODY
