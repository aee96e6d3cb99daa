"""Certificates of the edges: the ticks at which the triangulation stops being regular.

An edge ab with c on its left and d on its right has one certificate: the lifted d is less than theta below
the plane of a, b and c (docs/cells.md). Twice the area of the triangle times that depth is a determinant of
three rows. All is computed relative to a body, so a far point costs no digits: relative to a; or, if a body's
plan changed, to that body, which is an end of some edges and opposite to the others. The largest rounding
error is subtracted from the determinant, so each reported failure is real.

A certificate need not be computed to its root. ``first_rise`` gives a lower bound. At this bound, a site that
is less than half of theta below is watched again; otherwise the edge flips (``events``).

An edge is watched for the body that *owns* it: its end with the smaller number, hence never a far point. Its
tick is stored at the half-edge that begins at the owner, and the twin has ``NEVER``.
"""

from typing import NamedTuple

from kinetile.toolbox import (
    NEVER,
    NOBODY,
    Kernel,
    Plan,
    first_rise,
    hook,
    larger,
    position_after,
    schedule,
    since_origin,
    smaller,
    unchecked,
)
from kinetile.toolbox.lanes import (
    Floats,
    Ticks,
    append,
    choose,
    followed,
    lane,
    numbers,
    pick,
    places,
    some,
    spread,
    spread_whole,
)

from .web import PER_LENGTH, THETA, UNIT, State, around, pred, slots, succ

NOISE = 2.0**-47
"""The largest rounding error of a determinant, in products of the sizes of its rows; with a factor of more
than two to spare."""


class Spot(NamedTuple):
    """A site now, rounded as in ``eight_sites``, and its flight in this tick, by the scale."""

    x: float
    y: float
    flight_x: float
    flight_y: float
    weight: float


class Row(NamedTuple):
    """A row of eight determinants: place, velocity and height relative to a, as polynomials in time; and
    |x| + |y| of place and velocity."""

    x0: Floats
    x1: Floats
    y0: Floats
    y1: Floats
    h0: Floats
    h1: Floats
    h2: Floats
    size: Floats
    speed: Floats


class Sites(NamedTuple):
    """Eight sites now, by the scale; velocities are for a unit of the clock."""

    x: Floats
    y: Floats
    vx: Floats
    vy: Floats
    weight: Floats


@hook
def spot(k: Kernel, s: State, site: int) -> Spot:
    """Returns the position of a site, and its flight in this tick.

    The two are not added: the rounding of a place is more than a flight, and between close sites more than
    the rounding error of a determinant.
    """
    if site >= slots(s):
        return Spot(s.far_x[site], s.far_y[site], 0.0, 0.0, 0.0)
    place = k.places[site]
    elapsed = since_origin(k, k.clock[0].now)
    flown = s.scale[PER_LENGTH] * k.clock[0].per_tick
    x, y = position_after(place, elapsed)
    x *= s.scale[PER_LENGTH]
    y *= s.scale[PER_LENGTH]
    return Spot(x, y, place.vx * flown, place.vy * flown, s.weight[site])


@hook
def way(a: Spot, b: Spot) -> tuple[float, float]:
    """Returns the vector from a to b at the end of this tick."""
    return (b.x - a.x) + (b.flight_x - a.flight_x), (b.y - a.y) + (b.flight_y - a.flight_y)


@hook
def turn(a: Spot, b: Spot, c: Spot) -> float:
    """Returns twice the area of a triangle, above 0 if it is counter-clockwise."""
    bx, by = way(a, b)
    cx, cy = way(a, c)
    return bx * cy - by * cx


@hook
def sunk(o: Spot, a: Spot, b: Spot, c: Spot) -> float:
    """Returns the depth of o below the plane of a, b, c, counter-clockwise, times twice their area; less the
    rounding error."""
    ax, ay = way(o, a)
    bx, by = way(o, b)
    cx, cy = way(o, c)
    ah = ax * ax + ay * ay - a.weight + o.weight
    bh = bx * bx + by * by - b.weight + o.weight
    ch = cx * cx + cy * cy - c.weight + o.weight
    depth = ah * (bx * cy - cx * by) + bh * (cx * ay - ax * cy) + ch * (ax * by - bx * ay)
    one = abs(ax) + abs(ay)
    two = abs(bx) + abs(by)
    three = abs(cx) + abs(cy)
    return depth - 0.5 * NOISE * (one * two * three * (one + two + three))


@hook
def fails(k: Kernel, s: State, h: int, theta: float) -> bool:
    """Returns True if the site beyond an edge is surely more than theta below the plane of the triangle. The
    first or the last corner of the triangle is a body."""
    g = s.twin[h]
    if g < 0:
        return False
    e = h if s.org[h] < slots(s) else pred(h)
    a = spot(k, s, s.org[e])
    b = spot(k, s, s.org[succ(e)])
    c = spot(k, s, s.org[pred(e)])
    return bool(sunk(a, c, b, spot(k, s, s.org[pred(g)])) > theta * turn(a, b, c))


@hook
def by_scale(k: Kernel, s: State, x: Floats, y: Floats, vx: Floats, vy: Floats, weight: Floats) -> Sites:
    """Returns the present positions of eight bodies and their weights, by the scale, from rows of places."""
    length = spread(s.scale[PER_LENGTH])
    speed = length * spread(s.scale[UNIT])
    x, y = position_after(Plan(x, y, vx, vy), spread(since_origin(k, k.clock[0].now)))
    return Sites(x * length, y * length, vx * speed, vy * speed, weight)


@hook
def eight_sites(k: Kernel, s: State, at: int) -> Sites:
    """Returns eight of the named sites, from one place on."""
    weight = pick(s.weight, s.sites, at)
    x, y, vx, vy, _ = by_scale(k, s, *places(k.places, s.plans, at), weight)
    zero = spread(0.0)
    is_far = weight <= zero
    if some(is_far):
        x = choose(is_far, pick(s.far_x, s.sites, at), x)
        y = choose(is_far, pick(s.far_y, s.sites, at), y)
        vx = choose(is_far, zero, vx)
        vy = choose(is_far, zero, vy)
    return Sites(x, y, vx, vy, weight)


@hook
def size(value: Floats) -> Floats:
    """Returns absolute values."""
    zero = spread(0.0)
    return choose(value < zero, zero - value, value)


@hook
def row(a: Sites, b: Sites, lift: Floats) -> Row:
    """Returns the rows of eight sites, lifted."""
    x0 = b.x - a.x
    x1 = b.vx - a.vx
    y0 = b.y - a.y
    y1 = b.vy - a.vy
    h0 = x0 * x0 + y0 * y0 - b.weight + a.weight + lift
    h1 = x0 * x1 + y0 * y1
    return Row(x0, x1, y0, y1, h0, h1 + h1, x1 * x1 + y1 * y1, size(x0) + size(y0), size(x1) + size(y1))


@hook
def failures(k: Kernel, b: Row, c: Row, d: Row) -> Ticks:
    """Returns lower bounds of the ticks at which eight edges ab fail, by the rows b, c, d relative to a.

    Exchanging two sites only changes the determinant's sign, so a may be c, if b and c are then a and b.
    """
    # the minors of two rows, times the height of the third, in an order that gives the determinant the sign
    # of the depth, since all rows are relative to a
    cb0 = c.x0 * b.y0 - b.x0 * c.y0
    cb1 = c.x0 * b.y1 + c.x1 * b.y0 - b.x0 * c.y1 - b.x1 * c.y0
    cb2 = c.x1 * b.y1 - b.x1 * c.y1
    dc0 = d.x0 * c.y0 - c.x0 * d.y0
    dc1 = d.x0 * c.y1 + d.x1 * c.y0 - c.x0 * d.y1 - c.x1 * d.y0
    dc2 = d.x1 * c.y1 - c.x1 * d.y1
    bd0 = b.x0 * d.y0 - d.x0 * b.y0
    bd1 = b.x0 * d.y1 + b.x1 * d.y0 - d.x0 * b.y1 - d.x1 * b.y0
    bd2 = b.x1 * d.y1 - d.x1 * b.y1
    g0 = cb0 * d.h0 + dc0 * b.h0 + bd0 * c.h0
    g1 = cb0 * d.h1 + cb1 * d.h0 + dc0 * b.h1 + dc1 * b.h0 + bd0 * c.h1 + bd1 * c.h0
    g2 = cb0 * d.h2 + cb1 * d.h1 + cb2 * d.h0 + dc0 * b.h2 + dc1 * b.h1 + dc2 * b.h0
    g2 = g2 + bd0 * c.h2 + bd1 * c.h1 + bd2 * c.h0
    g3 = cb1 * d.h2 + cb2 * d.h1 + dc1 * b.h2 + dc2 * b.h1 + bd1 * c.h2 + bd2 * c.h1
    g4 = cb2 * d.h2 + dc2 * b.h2 + bd2 * c.h2
    sizes = b.size + c.size + d.size
    rounding = spread(NOISE) * (b.size * c.size * d.size * sizes)
    scale = sizes / (b.speed + c.speed + d.speed + spread(2.0**-400))
    return first_rise(k, g0 - rounding, g1, g2, g3, g4, scale)


@hook
def owned(s: State, h: int) -> int:
    """Returns the watched half-edge of an edge; NOBODY for an edge between two far points."""
    a = s.org[h]
    b = s.org[succ(h)]
    if smaller(a, b) >= slots(s):
        return NOBODY
    return h if a < b else int(s.twin[h])


@hook
def enlist(s: State, count: int, h: int) -> int:
    """Adds the edge of a half-edge to the list of edges to be watched; returns its new length."""
    own = owned(s, h)
    s.listed[count] = own
    return count + 1 if own >= 0 else count


@hook
def reschedule(k: Kernel, s: State, site: int) -> None:
    """Queues a body for the first failure of the edges that it owns."""
    if site >= slots(s):
        return
    least = NEVER
    h = int(s.first[site])
    for _ in range(len(s.first)):
        least = smaller(least, s.due[h])
        h = around(s, h)
        if h == s.first[site]:
            break
    schedule(k, site, least)


@hook
def note(k: Kernel, s: State, h: int, site: int, tick: int) -> None:
    """Notes the tick at which an edge fails, at its owner's half-edge, and queues the owner."""
    old = s.due[h]
    s.due[h] = tick
    if tick <= k.queue[site].certificate:
        schedule(k, site, tick)
    elif old == k.queue[site].certificate:
        reschedule(k, s, site)


@hook
def watch(k: Kernel, s: State, count: int) -> None:
    """Watches the listed edges, eight at a time; unused lanes of the last eight keep old values."""
    last = slots(s) - 1
    for begin in range(0, count, 8):
        many = smaller(8, count - begin)
        for i in range(many):
            h = s.listed[begin + i]
            s.sites[i] = s.org[h]
            s.sites[8 + i] = s.org[succ(h)]
            s.sites[16 + i] = s.org[pred(h)]
            s.sites[24 + i] = s.org[pred(s.twin[h])]
            for at in range(i, 32, 8):
                s.plans[at] = smaller(s.sites[at], last)
        a = eight_sites(k, s, 0)
        b = row(a, eight_sites(k, s, 8), spread(0.0))
        c = row(a, eight_sites(k, s, 16), spread(0.0))
        d = row(a, eight_sites(k, s, 24), spread(s.scale[THETA]))
        tick = failures(k, b, c, d)
        for i in range(many):
            note(k, s, s.listed[begin + i], s.sites[i], lane(tick, i))


@hook
def ring(s: State, body: int) -> int:
    """Lists the half-edges around a body, the sites at their ends, and the sites beyond the edges between
    these; then the first eight again. Returns their number, without the repeated ones."""
    far = len(s.sites) // 2
    last = slots(s) - 1
    h = int(s.first[body])
    degree = 0
    for _ in range(len(s.first)):
        e = succ(h)
        site = s.org[e]
        beyond = s.org[pred(larger(s.twin[e], 0))]  # without one, between two far points: any site
        s.spokes[degree] = h
        s.sites[degree] = site
        s.plans[degree] = smaller(site, last)
        s.sites[far + degree] = beyond
        s.plans[far + degree] = smaller(beyond, last)
        degree += 1
        h = around(s, h)
        if h == s.first[body]:
            break
    append(s.spokes, 0, s.spokes, degree)
    append(s.sites, 0, s.sites, degree)
    append(s.plans, 0, s.plans, degree)
    return degree


@hook
def lifted(one: Row, lift: Floats) -> Row:
    """Returns the rows of lifted sites."""
    return Row(one.x0, one.x1, one.y0, one.y1, one.h0 + lift, one.h1, one.h2, one.size, one.speed)


@hook
def ahead(one: Row) -> Row:
    """Returns the rows of the next sites, in a ring of eight."""
    return Row(
        followed(one.x0),
        followed(one.x1),
        followed(one.y0),
        followed(one.y1),
        followed(one.h0),
        followed(one.h1),
        followed(one.h2),
        followed(one.size),
        followed(one.speed),
    )


@unchecked
@hook
def watch_around(k: Kernel, s: State, body: int) -> None:
    """Watches the edges that end at a body or are opposite to it, all of them relative to the body.

    In the ring of sites around it, three sites in a row are an edge of the body, to the second site, and the
    sites on both sides of this edge. Two sites in a row and the site beyond are an edge of the ring. The
    lanes hold eight sites of the cyclic ring: enough for six edges of either kind, or for a ring of eight.
    """
    n = slots(s)
    degree = ring(s, body)
    far = len(s.sites) // 2
    place = k.places[body]
    a = by_scale(
        k, s, spread(place.x), spread(place.y), spread(place.vx), spread(place.vy), spread(s.weight[body])
    )
    zero = spread(0.0)
    theta = spread(s.scale[THETA])
    least = NEVER
    step = 8 if degree == 8 else 6
    for begin in range(0, degree, step):
        one = row(a, eight_sites(k, s, begin), zero)
        two = ahead(one)
        three = ahead(two)
        names = numbers(s.sites, begin)
        lift = choose(followed(names) < spread_whole(body), theta, zero)  # the other end owns the edge
        tick = failures(k, two, lifted(three, lift), lifted(one, theta - lift))
        lift = choose(names < followed(names), zero, theta)
        other = row(a, eight_sites(k, s, far + begin), theta - lift)
        lift = zero - lift
        beyond = failures(k, lifted(one, lift), lifted(two, lift), lifted(other, lift))
        for i in range(smaller(step, degree - begin)):
            at = begin + i
            here = s.sites[at]
            there = s.sites[at + 1]
            if smaller(here, there) < n:
                h = succ(s.spokes[at])
                note(k, s, h if here < there else int(s.twin[h]), smaller(here, there), lane(beyond, i))
            h = int(s.spokes[at + 1])
            if body < there:
                s.due[h] = lane(tick, i)
                least = smaller(least, lane(tick, i))
            else:
                note(k, s, int(s.twin[h]), there, lane(tick, i))
    schedule(k, body, least)
