"""The narrow phase of two discs: the tick of their contact, and the elastic exchange at it.

Contact means approach: a contact needs d.v < 0, with d the separation and v the relative velocity at the
later of the two anchors. A pair that touches or overlaps and approaches meets at once; tangency is no event.
The tick is exactly the one in which the discs' paths touch (``kinetile.kernel.certificates.discs``); lower
bounds for many partners at once are rounded, on the safe side. The thesis decides similarly, by a comparison
with the time of closest approach (section 5.2).

Why the bounds are early
========================

The narrow phase of discs computes for eight partners at once a tick before which no contact happens
(``soonest`` in ``disc.py``, with ``lower_bounds.py``). It works on the common clock: every body has a row
with its position x0 and velocity at one tick, the origin. The origin is moved before a body has flown further
than V W from there, and W is at most 4 X / V. Let L = X + 2 V W. Consider two discs at separation d with
relative velocity v, el the time since the origin and R the sum of the radii. The bound is the time of contact
of discs fattened by

    fat = 64 (u L + eta),  and the distance shortened by 2^-47 of itself

rounded down, less 4,096 ticks. It never is after the tick of ``meet``:

*Positions.* x0 is a plan's position at the origin: an elapsed time, a product, a sum. With the difference of
two rows, and v el added, each coordinate of d has at most 16 u L of rounding. So d is off by less than 24 u
L, now and as long as the two fly towards each other. *The quadratic.* d^2, R^2, d.v and v^2 are off by at
most four roundings of their terms. In gap = d^2 (1 - 2^-46) - (R + fat)^2 and in the discriminant (d.v)^2 -
v^2 gap this adds up to less than 32 u d^2 of gap, and 2^-46 d^2 is 128 u d^2. So the computed root is, up to
a factor 1 + 8 u for the last three operations, the exact time when the distance of rounded places is slightly
more than R + fat / 2. *The contact.* At the exact root the gap is 0, even for the shallowest graze. Then the
distance of the rounded places is at most R + 24 u L < R + fat / 2, so the fattened discs have touched
earlier, up to that factor. The factor is at most 8 u 2^62 = 4,096 ticks, since no prediction is further than
2^62 ticks. So the bound is not after the root, and its floor is not after the root's floor, the tick of
``meet``. If discs touch or overlap at the later anchor, the bound's gap is negative: it is now.

*Omitted pairs.* A pair is omitted if the discriminant is negative: by the same numbers the distance of its
discs stays larger than R. It is also omitted if its discs part: d.v > 0 and (d.v)^2 > fat^2 v^2. Then d.v is
positive in exact arithmetic too, since it is off by less than 47 u L |v|. A NaN, from squares that overflow,
counts as a contact now, to be computed exactly.

A bound may be arbitrarily early: that costs one exact computation. fat is 1e-12 of the scene for ordinary
speeds; if it is as large as the bodies, every contact is computed exactly, and the answer is the same.
``tests/plugins/test_disc.py`` compares bounds and exact times on generated and hard pairs.
"""

import math

from kinetile.scene import Scene, are_alike
from kinetile.toolbox import (
    NEVER,
    NOBODY,
    TOO_DEEP,
    Kernel,
    PairParts,
    Records,
    blame,
    closing_speed,
    give,
    hook,
    position_at,
    smaller,
    unchecked,
    with_constants,
)
from kinetile.toolbox.lanes import (
    LANES,
    Floats,
    choose,
    fill,
    numbered,
    numbers,
    pick,
    root,
    spread,
    spread_whole,
)
from kinetile.toolbox.ticks import (
    Plans,
    accelerated_touch_about,
    are_accelerated,
    counts_from,
    discs_overlap,
    discs_touch,
    first_image_of,
    have_just_met,
    parting,
    plans_of,
    plans_through,
    touch_about,
    turns_between,
    with_accelerations,
)
from kinetile_plugins.lower_bounds import (
    LEAST,
    NONE,
    PLACES,
    accelerated_motions,
    alone,
    before_other_images,
    chords,
    circles_meet,
    merged,
    motion_to,
    motions,
    nearest_image,
    two_least,
)

Pair = tuple[Floats, Floats]

EQUAL = PERIODIC = False
"""True if all bodies have one radius; True if axes are periodic."""


@hook
def known_before(k: Kernel, since: int) -> int:
    """Returns a number of ticks after a tick; the contact is known not to be before it. Or -1."""
    about = k.clock[0].contact_guess
    return int(about - since) if since <= about and about != NEVER else -1


@hook
def _accelerated(one: Records, k: Kernel, early: int, late: int, plans: Plans) -> int:
    two = k.bodies[late]
    guess = known_before(k, two.anchor)
    met = have_just_met(k, early, late, plans)
    low = counts_from(k, early, late, two.anchor)
    return int(accelerated_touch_about(plans, one.radius, two.radius, int(met), guess, low))


@with_accelerations(_accelerated)
@hook
def _straight(one: Records, k: Kernel, early: int, late: int, plans: Plans) -> int:
    two = k.bodies[late]
    guess = known_before(k, two.anchor)
    return int(touch_about(plans, one.radius, two.radius, guess))


@hook
def touches(k: Kernel, early: int, late: int, plans: Plans) -> int:
    """Returns the ticks from the later anchor to the contact of two discs by their plans, or ``NEVER``."""
    return int(_straight(k.bodies[early], k, early, late, plans))


@unchecked
@hook
def meet(k: Kernel, a: int, b: int) -> int:
    """Returns the tick of the first contact of two bodies, or ``NEVER``; reports two bodies that overlap at
    the later anchor by more than rounding explains."""
    early = a if k.bodies[a].anchor < k.bodies[b].anchor else b
    late = a + b - early
    one = k.bodies[early]
    two = k.bodies[late]
    since = two.anchor
    delay = touches(k, early, late, plans_of(k, one, two))
    if delay == NEVER:
        return NEVER
    if delay == 0 and not (are_accelerated(one) and one.last == late and two.last == early):
        x, y = position_at(k, one, since)
        depth = discs_overlap(k, early, late, two.x - x, two.y - y)
        if depth > k.clock[0].limits.tolerance + 1e-9 * (one.radius + two.radius):
            blame(k, TOO_DEEP, a, b)
    return int(since + delay)


@hook
def touch_among_shapes(k: Kernel, early: int, late: int, plans: Plans) -> int:
    """Returns the value of ``discs_touch``; NEVER for two immovable bodies (rule 7s)."""
    immovable = math.isinf(k.mass[early]) and math.isinf(k.mass[late])
    return NEVER if immovable else discs_touch(k, early, late, plans)


meet_among_shapes = with_constants([meet], touches=touch_among_shapes)["meet"]
meet_images = first_image_of(touches, discs_overlap)
first_image_among_shapes = first_image_of(touch_among_shapes, discs_overlap)


@hook
def not_before(k: Kernel, body: int, other: int, at: int, reach: float, periodic: bool) -> float:
    """Returns the bound of ``soonest`` for one partner; ``reach`` is the sum of the fattened radii."""
    fat = k.clock[0].limits.fat
    torus = k.clock[0].torus
    dx, dy, vx, vy = motion_to(k, body, other, at, periodic)
    approach = dx * vx + dy * vy
    speed2 = vx * vx + vy * vy
    approach2 = approach * approach
    gap = (dx * dx + dy * dy) * (1.0 - 2.0**-46) - reach * reach
    inside = approach2 - speed2 * gap
    passes = ((approach > 0.0) & (approach2 > fat * fat * speed2)) | (inside < 0.0)
    delay = gap / (math.sqrt(inside) - approach) if inside >= 0.0 else math.nan
    delay = delay if delay > 0.0 else 0.0  # NaN: they may touch now
    delay = math.inf if passes else delay
    if periodic:
        x_delay = (torus.half_x - reach) / abs(vx)
        y_delay = (torus.half_y - reach) / abs(vy)
        delay = delay if x_delay >= delay else x_delay
        delay = delay if y_delay >= delay else y_delay
        delay = delay if delay > 0.0 else 0.0
    return delay


@hook
def bound_of_one(k: Kernel, body: int, barred: int, at: int) -> tuple[float, float, int]:
    """Returns the values of ``soonest`` for ``k.near[0]`` alone."""
    other = k.near[0]
    if other == body or other == barred:  # noqa: SIM109 - no tuple in a hook
        return math.inf, math.inf, NOBODY
    limits = k.clock[0].limits
    own = (limits.widest if EQUAL else k.radii[body]) + limits.fat
    soon = not_before(k, body, other, at, (limits.widest if EQUAL else k.radii[other]) + own, PERIODIC)
    return soon, math.inf, int(other) if soon < math.inf else NOBODY


@unchecked
@hook
def soonest(k: Kernel, body: int, count: int, barred: int, at: int) -> tuple[float, float, int]:
    """Returns lower bounds of the first two contacts with ``k.near[:count]``, and the first partner.

    The bounds are delays after tick ``at``, infinite without a contact; the proof is above. Up to eight
    places behind the first ``count`` are overwritten.
    """
    if count == 1:
        return bound_of_one(k, body, barred, at)
    limits = k.clock[0].limits
    radius = limits.widest if EQUAL else k.radii[body]
    fill(k.near, count, body)  # the rest of the last eight: the body itself is left out
    fat2 = spread(limits.fat * limits.fat)
    own_reach = spread(radius + limits.fat)
    reach = spread(radius + (radius + limits.fat))
    reach2 = reach * reach
    none = spread(NONE)
    never = spread(math.inf)
    myself = spread_whole(body)
    not_this = spread_whole(barred)
    soon = math.inf
    rest = math.inf
    who = NOBODY
    start = 0
    while True:  # at least once, and with one comparison a turn: a range in a range costs 45 instructions
        begin = start
        end = smaller(begin + PLACES, count)
        first = never
        second = never
        while True:
            dx, dy, vx, vy = motions(k, body, start, at)
            if not EQUAL:
                reach = pick(k.radii, k.near, start) + own_reach
                reach2 = reach * reach
            if PERIODIC:
                dx, dy = nearest_image(k, dx, dy)
            delay, left_out = circles_meet(dx, dy, vx, vy, reach2, fat2)
            if PERIODIC:
                delay = before_other_images(k, choose(left_out, never, delay), vx, vy, reach)
                left_out = delay > none
            other = numbers(k.near, start)
            left_out = left_out | (other == myself) | (other == not_this)
            delay = choose(left_out, never, numbered(delay, start - begin))
            first, second = two_least(first, second, delay)
            start += LANES
            if start >= end:
                break
        soon, rest, who = alone(k, begin, first, second, soon, rest, who)
        if start >= count:
            break
    return soon, rest, who


soonest_of_equals = with_constants([bound_of_one, soonest], EQUAL=True)["soonest"]
soonest_of_images = with_constants([bound_of_one, soonest], PERIODIC=True)["soonest"]


@hook
def until_chord(dx: Floats, dy: Floats, cx: Floats, cy: Floats, wide: Floats) -> Floats:
    """Returns the delay until discs touch on the chord of their relative way, fattened by its largest
    distance from the way, |b| h^2 / 8 with h the time until its end: a bound, ``LEAST`` or more."""
    zero = spread(0.0)
    least = spread(LEAST)
    approach = dx * cx + dy * cy
    gap = (dx * dx + dy * dy) * spread(1.0 - 2.0**-46) - wide * wide
    inside = approach * approach - (cx * cx + cy * cy) * gap
    delay = gap / (root(inside) - approach)
    delay = choose(delay > least, delay, least)
    return choose(((approach > zero) & (gap > zero)) | (inside < zero), spread(math.inf), delay)


@hook
def until_reach(d: Pair, v: Pair, b: Pair, reach: Floats, fat: Floats, pulls: Floats) -> Floats:
    """Returns the delay until n . (d + v t + b t^2 / 2), n = d / |d|, falls to the sum of the radii: a bound,
    for the distance is not less. For two bodies that have just met, it is a bound of their return."""
    zero = spread(0.0)
    less = spread(1.0 - 2.0**-40)
    dx, dy = d
    vx, vy = v
    bx, by = b
    distance = root(dx * dx + dy * dy)
    above = distance * less - reach
    rate = ((dx * vx + dy * vy) - fat * root(vx * vx + vy * vy)) / distance
    bend = ((dx * bx + dy * by) - fat * pulls) / distance
    inside = rate * rate - (bend + bend) * above
    parts = rate > zero
    later = (rate + root(inside)) / (zero - bend)
    later = choose(parts, later, (above + above) / (root(inside) - rate)) * less
    later = choose(later > spread(LEAST), later, spread(LEAST))
    away = (parts & (bend >= zero)) | ((inside < zero) & (above > zero))
    return choose(away, spread(math.inf), later)


@unchecked
@hook
def soonest_accelerated(k: Kernel, body: int, count: int, barred: int, at: int) -> tuple[float, float, int]:
    """Returns the values of ``soonest`` for bodies with accelerations, up to the first end of the chords of
    two bodies: then one of the two is computed again, so later contacts are omitted.

    Two bounds are before the contact, ``until_chord`` and ``until_reach``, and the later one counts.
    """
    limits = k.clock[0].limits
    fill(k.near, count, body)
    fat = spread(limits.fat)
    own = spread(k.radii[body] + limits.fat)
    never = spread(math.inf)
    more = spread(1.0 + 2.0**-40)
    room = spread(2.0**14 * k.clock[0].per_tick)
    myself = spread_whole(body)
    soon = math.inf
    rest = math.inf
    who = NOBODY
    second_of = NOBODY
    start = 0
    while True:
        begin = start
        stop = smaller(begin + PLACES, count)
        first = never
        second = never
        while True:
            dx, dy, vx, vy, bx, by, span = accelerated_motions(k, body, start, at)
            _, cx, cy, sagitta, pulls = chords(vx, vy, bx, by, span)
            reach = pick(k.radii, k.near, start) + own
            wide = reach + sagitta
            if PERIODIC:
                dx, dy = nearest_image(k, dx, dy)
            delay = until_chord(dx, dy, cx, cy, wide)
            later = until_reach((dx, dy), (vx, vy), (bx, by), reach, fat, pulls)
            delay = choose(later > delay, later, delay)
            if PERIODIC:
                delay = before_other_images(k, delay, vx, vy, reach)
            left_out = (delay > span * more + room) | (numbers(k.near, start) == myself)
            delay = choose(left_out, never, numbered(delay, start - begin))
            first, second = two_least(first, second, delay)
            start += LANES
            if start >= stop:
                break
        soon, rest, who, second_of = merged(k, begin, first, second, soon, rest, who, second_of)
        if start >= count:
            break
    if not soon < NONE:
        return math.inf, math.inf, NOBODY
    return soon, rest if rest < NONE else math.inf, who


soonest_of_accelerated_images = with_constants([soonest_accelerated], PERIODIC=True)["soonest_accelerated"]


@hook
def exchange(k: Kernel, a: int, b: int, nx: float, ny: float, share: float) -> None:
    """Exchanges momentum along a unit normal, by a share of the closing speed; 1: elastically (rule 9)."""
    give(k, a, b, nx, ny, share * closing_speed(k.bodies[a], k.bodies[b], nx, ny))


@hook
def line_of(k: Kernel, a: int, b: int, dx: float, dy: float) -> tuple[float, float, float]:
    """Returns the line of centres of two discs whose places differ by (dx, dy), and their overlap; NaN if
    their centres coincide, so that they could not exchange momentum."""
    distance = math.sqrt(dx * dx + dy * dy)
    reach = k.bodies[a].radius + k.bodies[b].radius
    return dx / distance, dy / distance, float(reach - distance) if distance > 0.0 else math.nan


@hook
def parts_after(k: Kernel, early: int, late: int, plans: Plans) -> int:
    """Returns the ticks from the later anchor until two discs part by their plans, or ``NEVER``."""
    two = k.bodies[late]
    low = counts_from(k, early, late, two.anchor)
    return int(parting(plans, k.bodies[early].radius, two.radius, low))


@unchecked
@hook
def part(k: Kernel, a: int, b: int) -> int:
    """Returns the tick at which two passing bodies part, through the image on the clock, or NEVER."""
    early = a if k.bodies[a].anchor < k.bodies[b].anchor else b
    late = a + b - early
    two = k.bodies[late]
    right = 0.0
    up = 0.0
    if len(k.images) > 0:
        right, up = turns_between(k, early, late, a)
    delay = parts_after(k, early, late, plans_through(k, k.bodies[early], two, right, up))
    return int(two.anchor + delay) if delay != NEVER else NEVER


@unchecked
@hook
def touch(k: Kernel, a: int, b: int) -> tuple[float, float, float]:
    """Returns the normal from a to b at their contact, b as its image on the clock, and the depth of their
    overlap."""
    one = k.bodies[a]
    two = k.bodies[b]
    dx = two.x - one.x
    dy = two.y - one.y
    if len(k.images) > 0:
        torus = k.clock[0].torus
        dx += torus.right
        dy += torus.up
    return line_of(k, a, b, dx, dy)


@unchecked
@hook
def collide(k: Kernel, a: int, b: int) -> float:
    """Exchanges momentum along the normal, elastically; returns the depth of the overlap."""
    nx, ny, depth = touch(k, a, b)
    exchange(k, a, b, nx, ny, 1.0)
    return float(depth)


@unchecked
@hook
def gap(k: Kernel, one: int, other: int, dx: float, dy: float) -> float:
    """Returns the distance between two discs among other shapes, below 0 if they overlap."""
    return math.sqrt(dx * dx + dy * dy) - float(k.forms[one].right + k.forms[other].right)


@unchecked
@hook
def collide_equals(k: Kernel, a: int, b: int) -> float:
    """Exchanges the velocities of two bodies of one mass along the line of centres, as ``collide``."""
    nx, ny, depth = touch(k, a, b)
    one = k.bodies[a]
    two = k.bodies[b]
    speed = closing_speed(one, two, nx, ny)
    one.vx += speed * nx
    one.vy += speed * ny
    two.vx -= speed * nx
    two.vy -= speed * ny
    return float(depth)


MEETS = {(False, False): meet, (False, True): meet_among_shapes}
MEETS |= {(True, False): meet_images, (True, True): first_image_among_shapes}
"""``meet`` by two flags: axes are periodic, the scene has other shapes."""


class Disc:
    """Elastic contact of two discs.

    Args:
        general: True for the same parts in all scenes, so that they share one compiled loop; it is slower if
            bodies are alike.
    """

    def __init__(self, general: bool = False) -> None:
        self.general = general

    def prepare(self, scene: Scene) -> PairParts:
        """Returns the parts. If all masses and all radii are equal and stay so, the loop and the tables omit
        both; two loops instead of four, for they differ by a twentieth of the instructions.

        For equal masses both forms give the same velocities, to the bit: the share of each is exactly 1.
        """
        periodic, shapes = bool(scene.periodic), bool(scene.shapes)
        alike = are_alike(scene) and scene.uniform and not (self.general or periodic or shapes)
        bounds = soonest_of_equals if alike else soonest_of_images if periodic else soonest
        if not scene.uniform:
            bounds = soonest_of_accelerated_images if periodic else soonest_accelerated
        return PairParts(
            meet=MEETS[periodic, shapes],
            collide=collide_equals if alike else collide,
            soonest=None if shapes else bounds,
            touch=touch,
            part=part,
            gap=gap if shapes else None,
            contact_distance="closer" if shapes and not periodic else "sum of radii",
            alike=alike,
            periodic=periodic,
            shapes=shapes,
            accelerated=scene.accelerated,
        )
