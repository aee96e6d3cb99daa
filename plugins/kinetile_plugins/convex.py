"""The narrow phase of convex bodies: discs, capsules, boxes, polygons, rounded or not, and obstacles.

Bodies do not rotate. The tick of a contact is exact (``kinetile.kernel.certificates.shapes``;
docs/specification.md, rule 5s), by a table of the differences of shapes. At a contact (rule 9s) two bodies
exchange momentum across the face of the difference, or along the line from a corner. Lower bounds use the
same differences, fattened by more than all rounding.

Why the bounds of boxes are early
=================================

*Boxes* (``soonest``), for each partner. Along an axis a place d is within a reach, half of both widths and
the radii and fat, from -d/v - reach/|v| until -d/v + reach/|v|. These times are wrong by the flight over less
than 28 u L, with the 24 u L of d, and fat is 64. So the entry is computed early and the exit late. The later
entry is a bound, or there is no contact if it is after an exit. A disc may then be beside a corner of the
box: it touches nothing before it touches the corner, with fat, or is no longer beside it. This time is
computed up to 30 u L too late, and so near its border the fattened disc of the corner reaches further than
the face does.

A body's shape is inside the circle of its ``reach``, so every broad phase that is complete for discs of that
radius is complete for shapes. The shape is also inside the upright box of its reaches to the four sides, so a
phase that is complete for these boxes is complete as well: the intervals of two touching shapes touch, on x
and on y. A reach to a side is rounded twice, from the core and with the skin, which takes at most 2 u X from
a skin of more than 64 (n + 4) u X.
"""

import math

from kinetile.errors import Refused
from kinetile.scene import Scene
from kinetile.toolbox import (
    NEVER,
    NOBODY,
    Kernel,
    PairParts,
    hook,
    larger,
    since_origin,
    smaller,
    unchecked,
    with_constants,
)
from kinetile.toolbox.lanes import (
    LANES,
    Floats,
    bits,
    choose,
    fill,
    lane,
    lowest_bit,
    numbered,
    numbers,
    pick,
    places,
    spread,
    spread_whole,
)
from kinetile.toolbox.ticks import (
    CORNERS,
    CX,
    CY,
    FIRST_CORNER,
    FLUSH,
    NX,
    NY,
    OUT,
    PLAIN,
    RADIUS,
    RANK,
    WIDE,
    Numbers,
    Plans,
    are_accelerated,
    comes_nearer,
    counts_from,
    difference_table,
    enters,
    first_image_of,
    have_just_met,
    leaves,
    nearest_whole,
    plans_of,
    pointer,
    reaches_edge,
)
from kinetile_plugins import disc
from kinetile_plugins.lower_bounds import (
    LEAST,
    NONE,
    PLACES,
    accelerated_motions,
    before_other_images,
    chords,
    circles_meet,
    merged,
    motion_to,
    motions,
    nearest_image,
    two_least,
)

SLOWEST = 2.0**-900
"""Stands for no speed: in no relevant time does a body move any distance."""

Motion = tuple[float, float, float, float, float, float]
"""Place, velocity and acceleration, along x and y."""

ALL_PLAIN = BOXES = PERIODIC = False
"""True if all pairs that can meet are two boxes or two discs; True if all are two boxes, so that circles add
nothing; True if axes are periodic, and not all pairs are boxes."""


@hook
def row_of(k: Kernel, a: int, b: int) -> int:
    """Returns the beginning in ``k.numbers`` of the row for the difference of two bodies' shapes; or 0."""
    shapes = int(k.numbers[0])
    return int(k.numbers[1 + k.bodies[a].form * shapes + k.bodies[b].form])


@hook
def around(f: Numbers, corner: int, reach: float, x: float, y: float, vx: float, vy: float) -> float:
    """Returns a lower bound of the time until a place is nearer to a corner than a reach."""
    x -= f[corner + CX]
    y -= f[corner + CY]
    approach = x * vx + y * vy
    gap = (x * x + y * y) * (1.0 - 2.0**-40) - reach * reach
    inside = approach * approach - (vx * vx + vy * vy) * gap
    if gap <= 0.0:
        return 0.0
    if approach >= 0.0 or inside < 0.0:
        return math.inf
    return gap / (math.sqrt(inside) - approach) * (1.0 - 2.0**-40)


@hook
def faces_beside(row: int, count: int, face: int) -> tuple[int, int]:
    """Returns the faces of a difference before and after one of them."""
    first = row + FIRST_CORNER
    last = first + (count - 1) * WIDE
    return last if face == first else face - WIDE, first if face == last else face + WIDE


@hook
def until_corner(
    f: Numbers, row: int, face: int, x: float, y: float, vx: float, vy: float, fat: float
) -> float:
    """Returns a lower bound of the time until a place on the line of a face, moved out by R, enters a
    fattened difference: 0, unless it is beyond an end of that face; else the time until that corner.

    It must also be clearly within the line of the next face there: if two faces are in one line, or almost,
    rounding decides which of them is crossed last, and the place may be in front of the other.
    """
    before, after = faces_beside(row, int(f[row + CORNERS]), face)
    gap = (f[face + NX] * x + f[face + NY] * y) - f[face + OUT]
    corner = face
    beside = before
    beyond = f[face + NX] * (y - f[face + CY]) - f[face + NY] * (x - f[face + CX]) < -fat
    if f[face + NX] * (y - f[after + CY]) - f[face + NY] * (x - f[after + CX]) > fat:
        corner = after
        beside = after
        beyond = True
    if beyond and (f[beside + NX] * x + f[beside + NY] * y) - f[beside + OUT] < gap - fat:
        return around(f, corner, f[row + RADIUS] + 2.0 * fat, x, y, vx, vy)
    return 0.0


@hook
def not_before(f: Numbers, row: int, x: float, y: float, vx: float, vy: float, fat: float) -> float:
    """Returns a lower bound of the time until a place enters a fattened difference; infinite if it does not.

    The entry is not before the place is within the lines of all faces, moved out by R. If the place is then
    beyond an end of the last crossed face, the entry is not before the place has reached that corner.
    """
    count = int(f[row + CORNERS])
    faces = row + FIRST_CORNER
    reach = f[row + RADIUS]
    if count == 1:
        return around(f, faces, reach + fat, x, y, vx, vy)
    into = 0.0
    out = math.inf
    crossed = faces
    highest = -math.inf
    nearest = faces
    for k in range(count):
        face = faces + k * WIDE
        gap = (f[face + NX] * x + f[face + NY] * y) - (f[face + OUT] + fat)
        rate = f[face + NX] * vx + f[face + NY] * vy
        if gap > highest:
            highest = gap
            nearest = face
        if rate < 0.0:
            t = -gap / rate
            if t > into:
                into = t
                crossed = face
        elif gap > 0.0:
            return math.inf
        elif rate > 0.0:
            out = smaller(out, -gap / rate)
    if into > out:
        return math.inf
    if reach > 0.0:
        face = crossed if into > 0.0 else nearest
        return into + until_corner(f, row, face, x + vx * into, y + vy * into, vx, vy, fat)
    return into


@hook
def within(low: Floats, high: Floats, v: Floats) -> tuple[Floats, Floats]:
    """Returns the times at which coordinates with speeds v have grown by low and by high, in order."""
    zero = spread(0.0)
    still = choose((v >= zero) & (v <= zero), spread(SLOWEST), v)
    one = low / still
    other = high / still
    return choose(one < other, one, other), choose(one < other, other, one)


@hook
def until_others(k: Kernel, body: int, other: int, vx: float, vy: float, fat: float) -> float:
    """Returns a lower bound of a contact through another image than the nearest, half a period away."""
    torus = k.clock[0].torus
    reach = k.radii[body] + k.radii[other] + 2.0 * fat
    along = (torus.half_x - reach) / larger(abs(vx), SLOWEST)
    across = (torus.half_y - reach) / larger(abs(vy), SLOWEST)
    return float(larger(smaller(along, across), 0.0))


@hook
def bound_with(k: Kernel, body: int, other: int, at: int, fat: float, periodic: bool) -> float:
    """Returns a lower bound of the first contact with another body, as a delay after a tick."""
    row = row_of(k, body, other)
    if row == 0:
        return math.inf
    dx, dy, vx, vy = motion_to(k, body, other, at, periodic)
    delay = not_before(k.numbers, row, dx, dy, vx, vy, fat)
    if periodic:
        delay = smaller(delay, until_others(k, body, other, vx, vy, fat))
    return delay


@hook
def boxes_overlap(
    k: Kernel, body: int, start: int, wide: Floats, dx: Floats, dy: Floats, vx: Floats, vy: Floats
) -> tuple[Floats, Floats]:
    """Returns the beginning and the end of the overlaps of a body's upright box, widened, with the boxes of
    eight others, from a place in ``k.near`` on, at these separations and relative velocities."""
    mine = k.sides[body]
    left, right, down, up = places(k.sides, k.near, start)
    zero = spread(0.0)
    delay, ends = within(
        zero - (spread(mine.left) + wide + right) - dx, (spread(mine.right) + wide + left) - dx, vx
    )
    begins, parts = within(
        zero - (spread(mine.down) + wide + up) - dy, (spread(mine.up) + wide + down) - dy, vy
    )
    return choose(delay < begins, begins, delay), choose(ends < parts, ends, parts)


@hook
def boxes_meet(
    k: Kernel, body: int, start: int, at: int, fat: float, periodic: bool
) -> tuple[Floats, Floats, Floats, Floats, Floats, Floats]:
    """Returns the beginning and the end of the overlaps of a body's upright box with eight others, or with
    their nearest images, from a place in ``k.near`` on; and separations and velocities along x and y."""
    dx, dy, vx, vy = motions(k, body, start, at)
    if periodic:
        dx, dy = nearest_image(k, dx, dy)
    delay, ends = boxes_overlap(k, body, start, spread(fat), dx, dy, vx, vy)
    return delay, ends, dx, dy, vx, vy


@hook
def frames_meet(
    k: Kernel, body: int, start: int, at: int, fat: float, periodic: bool
) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Returns bounds, ``LEAST`` or more, by the upright boxes and the circles around a body and eight others,
    from a place in ``k.near`` on; and separations and velocities along x and y."""
    delay, ends, dx, dy, vx, vy = boxes_meet(k, body, start, at, fat, periodic)
    reach = spread(k.radii[body] + 2.0 * fat) + pick(k.radii, k.near, start)
    reach2 = reach * reach
    begins, passes = circles_meet(dx, dy, vx, vy, reach2, spread(fat * fat))
    begins = choose(passes, spread(math.inf), begins)
    begins = choose(dx * dx + dy * dy > reach2, begins, spread(LEAST))  # within the circles bodies may meet
    delay = choose(delay < begins, begins, delay)
    delay = choose(delay <= ends, delay, spread(math.inf))
    if periodic:
        delay = before_other_images(k, delay, vx, vy, reach)
    return delay, dx, dy, vx, vy


@hook
def soonest_of_shapes(
    k: Kernel,
    body: int,
    count: int,
    barred: int,
    at: int,
    fat: float,
    soon: float,
    who: int,
    two: int,
    periodic: bool,
) -> tuple[float, float, int]:
    """Returns the values of ``soonest``, by the differences of shapes: ``soon`` is by the difference for
    ``who``, and ``two`` is the next candidate."""
    one = who
    rest = bound_with(k, body, two, at, fat, periodic)
    if rest < soon:
        soon, rest = rest, soon
        who = two
    for start in range(0, count, LANES):
        delays, dx, dy, vx, vy = frames_meet(k, body, start, at, fat, periodic)
        sooner = bits(delays < spread(rest))
        while sooner != 0:
            i = lowest_bit(sooner)
            sooner &= sooner - 1
            delay = lane(delays, i)
            other = k.near[start + i]
            left_out = (other == body) | (other == barred) | (other == one) | (other == two)
            row = row_of(k, body, other)
            if delay < rest and row > 0 and not left_out:
                delay = not_before(k.numbers, row, lane(dx, i), lane(dy, i), lane(vx, i), lane(vy, i), fat)
                if periodic:
                    others = until_others(k, body, other, lane(vx, i), lane(vy, i), fat)
                    delay = smaller(delay, others)
                rest = smaller(rest, larger(soon, delay))
                who = int(other) if delay < soon else who
                soon = smaller(soon, delay)
    return soon, rest, who if soon < math.inf else NOBODY


@unchecked
@hook
def soonest(k: Kernel, body: int, count: int, barred: int, at: int) -> tuple[float, float, int]:
    """Returns lower bounds of the first two contacts of a body with ``k.near[:count]``, and the first
    partner. The bounds are delays after tick ``at``, infinite without a contact.

    Boxes and circles are compared first, eight at a time; mostly the difference of shapes is needed for
    the first partner alone. If its bound is then later than the second, it is needed for all partners
    that may be before the second. Up to eight places behind the first ``count`` are overwritten.
    """
    fat = k.clock[0].limits.fat
    never = math.inf
    if count == 1:
        alone = k.near[0]
        if alone == body or alone == barred:  # noqa: SIM109 - no tuple in a hook
            return never, never, NOBODY
        delay = bound_with(k, body, alone, at, fat, PERIODIC)
        return delay, never, int(alone) if delay < never else NOBODY
    fill(k.near, count, body)  # the rest of the last eight: the body itself is left out
    myself = spread_whole(body)
    not_this = spread_whole(barred)
    soon = NONE
    rest = NONE
    who = NOBODY
    other = NOBODY
    for begin in range(0, count, PLACES):
        first = spread(never)
        second = spread(never)
        for start in range(begin, smaller(begin + PLACES, count), LANES):
            if BOXES:
                delays, ends, _, _, _, _ = boxes_meet(k, body, start, at, fat, False)
                delays = choose(delays > spread(LEAST), delays, spread(LEAST))
                delays = choose(delays <= ends, delays, spread(never))
            else:
                delays, _, _, _, _ = frames_meet(k, body, start, at, fat, PERIODIC)
            names = numbers(k.near, start)
            left_out = (names == myself) | (names == not_this)
            delays = numbered(choose(left_out, spread(never), delays), start - begin)
            first, second = two_least(first, second, delays)
        soon, rest, who, other = merged(k, begin, first, second, soon, rest, who, other)
    if soon >= NONE:
        return never, never, NOBODY
    if not ALL_PLAIN and k.numbers[row_of(k, body, who) + PLAIN] == 0.0:
        soon = bound_with(k, body, who, at, fat, PERIODIC)
        if soon > rest and rest < NONE:
            return soonest_of_shapes(k, body, count, barred, at, fat, soon, who, other, PERIODIC)
    return soon, (rest if rest < NONE else never), who if soon < never else NOBODY


soonest_of_plain = with_constants([soonest], ALL_PLAIN=True)["soonest"]
soonest_of_boxes = with_constants([soonest], ALL_PLAIN=True, BOXES=True)["soonest"]
_among_images = with_constants([soonest], PERIODIC=True)["soonest"]


@hook
def barred_nearby(k: Kernel, body: int, at: int) -> int:
    """Returns the partner that a body is barred from, if through its nearest image at a tick; or NOBODY."""
    other = k.bodies[body].last
    if other < 0 or k.bodies[other].last != body:
        return NOBODY
    torus = k.clock[0].torus
    dx, dy, _, _ = motion_to(k, body, other, at, False)
    own = k.images[body]
    its = k.images[other]
    sense = 1 if k.queue[body].number < k.queue[other].number else -1
    m = nearest_whole(dx * torus.per_x)
    n = nearest_whole(dy * torus.per_y)
    is_barred = (
        int(m) + sense * own.last_m + its.kx == own.kx and int(n) + sense * own.last_n + its.ky == own.ky
    )
    return int(other) if is_barred else NOBODY


@unchecked
@hook
def soonest_of_images(k: Kernel, body: int, count: int, barred: int, at: int) -> tuple[float, float, int]:
    """Returns the values of ``soonest`` among images. Two bodies that have just met touch, and their bound
    would be now, so the barred image is left out."""
    met = barred_nearby(k, body, at)
    soon, rest, who = _among_images(k, body, count, met, at)
    if met != NOBODY:
        _, _, vx, vy = motion_to(k, body, met, at, False)
        delay = until_others(k, body, met, vx, vy, k.clock[0].limits.fat)
        if delay < soon:
            return delay, soon, met
        rest = smaller(rest, delay)
    return soon, rest, who


@hook
def end_of(f: Numbers, row: int, face: int, dx: float, dy: float) -> int:
    """Returns the corner at the end of a face if a place is beyond it, else -1; -1 without a radius (9s)."""
    faces = row + FIRST_CORNER
    after = face + WIDE
    after = faces if after == faces + int(f[row + CORNERS]) * WIDE else after
    nx = f[face + NX]
    ny = f[face + NY]
    if f[row + RADIUS] > 0.0 and nx * (dy - f[face + CY]) - ny * (dx - f[face + CX]) < 0.0:
        return face
    if f[row + RADIUS] > 0.0 and nx * (dy - f[after + CY]) - ny * (dx - f[after + CX]) > 0.0:
        return after
    return -1


@unchecked
@hook
def gap(k: Kernel, one: int, other: int, dx: float, dy: float) -> float:
    """Returns the distance between two shapes, below 0 if they overlap, if the place of the other is (dx, dy)
    from the place of the one: rounded, by rule 9s, for the room of an inserted body."""
    f = k.numbers
    row = int(f[1 + one * int(f[0]) + other])
    if row == 0:
        return math.inf
    faces = row + FIRST_CORNER
    corner = faces
    if f[row + CORNERS] > 1.0:
        found = faces
        highest = -math.inf
        for k_face in range(int(f[row + CORNERS])):
            face = faces + k_face * WIDE
            apart = f[face + NX] * (dx - f[face + CX]) + f[face + NY] * (dy - f[face + CY])
            if apart > highest or (apart == highest and f[face + RANK] < f[found + RANK]):
                found = face
                highest = apart
        corner = end_of(f, row, found, dx, dy)
        if corner < 0:
            return float(highest - f[row + RADIUS])
    x = dx - f[corner + CX]
    y = dy - f[corner + CY]
    return math.sqrt(x * x + y * y) - float(f[row + RADIUS])


@unchecked
@hook
def ledge(k: Kernel, body: int, support: int, mx: float, my: float, new: bool) -> int:
    """Returns the tick at which a body leaves its support (rule 8r), or its anchor less 1 without a face."""
    plan = k.bodies[body]
    other = k.bodies[support]
    sense = 1.0 if k.queue[support].number < k.queue[body].number else -1.0
    row = row_of(k, support if sense > 0.0 else body, body if sense > 0.0 else support)
    f = k.numbers
    nx = sense * mx
    ny = sense * my
    dx = sense * (plan.x - other.x)
    dy = sense * (plan.y - other.y)
    if len(k.images) > 0:
        dx += k.clock[0].torus.right
        dy += k.clock[0].torus.up
    count = int(f[row + CORNERS]) if row > 0 else 1
    for face in range(row + FIRST_CORNER, row + FIRST_CORNER + (count if count > 1 else 0) * WIDE, WIDE):
        if f[face + NX] == nx and f[face + NY] == ny:
            if new and end_of(f, row, face, dx, dy) >= 0:
                return int(plan.anchor - 1)
            after = face + WIDE if face < row + FIRST_CORNER + (count - 1) * WIDE else row + FIRST_CORNER
            begin = nx * (dy - f[face + CY]) - ny * (dx - f[face + CX])
            end = nx * (dy - f[after + CY]) - ny * (dx - f[after + CX])
            rate = sense * (nx * (plan.vy - other.vy) - ny * (plan.vx - other.vx))
            pull = sense * (nx * plan.ay - ny * plan.ax)
            strip = f[row + FLUSH]
            clock = k.clock[0]
            first = reaches_edge(begin, -strip, 0.0, rate, pull, clock.per_tick, clock.per_time)
            last = reaches_edge(strip, end, 0.0, -rate, -pull, clock.per_tick, clock.per_time)
            delay = smaller(first, last)
            return int(plan.anchor + delay) if delay != NEVER else NEVER
    return int(plan.anchor - 1)


@hook
def line_of(k: Kernel, a: int, b: int, dx: float, dy: float) -> tuple[float, float, float]:
    """Returns the unit normal from a to b at the contact of two bodies whose places differ by (dx, dy), and
    the depth of their overlap (rule 9s); NaN at a corner itself."""
    f = k.numbers
    row = row_of(k, a, b)
    count = int(f[row + CORNERS])
    faces = row + FIRST_CORNER
    reach = f[row + RADIUS]
    corner = faces
    if count > 1:
        plans = plans_of(k, k.bodies[a], k.bodies[b])
        found = faces
        highest = -math.inf
        closes = False
        for k_face in range(count):
            face = faces + k_face * WIDE
            gap = f[face + NX] * (dx - f[face + CX]) + f[face + NY] * (dy - f[face + CY])
            nearer = gap > highest or (gap == highest and f[face + RANK] < f[found + RANK])
            if reach == 0.0:
                closing = comes_nearer(pointer(f), row, face, plans) > 0
                nearer = (nearer and closing == closes) or (closing and not closes)
                closes = closes or closing
            if nearer:
                found = face
                highest = gap
        corner = end_of(f, row, found, dx, dy)
        if corner < 0:
            return f[found + NX], f[found + NY], reach - highest
    x = dx - f[corner + CX]
    y = dy - f[corner + CY]
    distance = math.sqrt(x * x + y * y)
    return x / distance, y / distance, reach - distance if distance > 0.0 else math.nan


@hook
def shapes_overlap(k: Kernel, early: int, late: int, dx: float, dy: float) -> float:
    """Returns the depth of overlap of two bodies whose places differ by (dx, dy)."""
    _, _, depth = line_of(k, early, late, dx, dy)
    return depth


_exchanged = with_constants([disc.touch, disc.collide], line_of=line_of)
collide, touch = _exchanged["collide"], _exchanged["touch"]


@hook
def shapes_touch(k: Kernel, early: int, late: int, plans: Plans) -> int:
    """Returns the ticks from the later anchor to the contact of two bodies by their plans, or ``NEVER``."""
    row = row_of(k, early, late)
    if row == 0 or (math.isinf(k.mass[early]) and math.isinf(k.mass[late])):
        return NEVER
    if not are_accelerated(k.bodies[early]):
        return int(enters(pointer(k.numbers), row, plans, 0, 0))
    met = have_just_met(k, early, late, plans)
    low = counts_from(k, early, late, k.bodies[late].anchor)
    return int(enters(pointer(k.numbers), row, plans, int(met), low))


meet = with_constants([disc.meet], touches=shapes_touch, discs_overlap=shapes_overlap)["meet"]
meet_images = first_image_of(shapes_touch, shapes_overlap)


@hook
def parts_after(k: Kernel, early: int, late: int, plans: Plans) -> int:
    """Returns the ticks from the later anchor until two bodies part by their plans, or ``NEVER``."""
    low = counts_from(k, early, late, k.bodies[late].anchor)
    return int(leaves(pointer(k.numbers), row_of(k, early, late), plans, low))


part = with_constants([disc.part], parts_after=parts_after)["part"]


@hook
def stays_above(above: float, rate: float, bend: float, near: float, most: float) -> float:
    """Returns a lower bound of the time until a height falls to 0 from above; or, if it is not lower than
    ``near`` and rises, of the time of its return, or ``most``."""
    inside = rate * rate - 2.0 * bend * above
    delay = math.inf
    if above <= 0.0 and (above < near or rate <= 0.0):
        delay = 0.0
    elif bend < 0.0 or rate < 0.0:
        root = math.sqrt(larger(inside, 0.0))
        if inside >= 0.0 or above <= 0.0:
            delay = (rate + root) / -bend if rate > 0.0 else 2.0 * above / (root - rate)
    return float(smaller(delay * (1.0 - 2.0**-40), most if above <= 0.0 else math.inf))


@hook
def time_along(distance: float, speed: float, pull: float) -> float:
    """Returns a lower bound of the time for a distance at a growing speed."""
    if distance <= 0.0:
        return 0.0
    root = math.sqrt(speed * speed + 2.0 * pull * distance)
    return 2.0 * distance / (speed + root) * (1.0 - 2.0**-40) if root > 0.0 else math.inf


@hook
def corner_stays(
    f: Numbers, corner: int, reach: float, fat: float, doubt: float, motion: Motion, most: float
) -> float:
    """Returns a lower bound of the time until an accelerated place is within reach of a corner, by the line
    across the vector from the corner; 0 if its distance is at most half of the reach."""
    dx, dy, vx, vy, bx, by = motion
    px = dx - f[corner + CX]
    py = dy - f[corner + CY]
    distance = math.sqrt(px * px + py * py)
    if distance <= 0.5 * reach:
        return 0.0
    above = distance * (1.0 - 2.0**-40) - (reach + fat)
    rate = ((px * vx + py * vy) - fat * (abs(vx) + abs(vy))) / distance - doubt
    bend = ((px * bx + py * by) - fat * (abs(bx) + abs(by))) / distance
    return stays_above(above, rate, bend, -2.0 * fat - 2.0**-39 * distance, most)


@hook
def not_before_accelerated(
    f: Numbers, row: int, fat: float, span: float, doubt: float, motion: Motion
) -> float:
    """Returns a lower bound of the time until an accelerated place enters a fattened difference, up to
    a span of time.

    The latest of these bounds counts. The way is at most |b| h^2 / 8 away from its chord, h being the span:
    the chord enters the difference that is fattened by that. The place has to pass the line of each face,
    moved out by R, and the line of the corner that it is beside, across the vector from there. A place that
    touches there, or is inside by a rounding, and leaves, has to return first: without a margin it would have
    to be inside by the strip, and with one that face or corner is nearest as long as the place is over it.
    """
    dx, dy, vx, vy, bx, by = motion
    pulls = abs(bx) + abs(by)
    speed = abs(vx) + abs(vy)
    reach = f[row + RADIUS]
    away = not_before(
        f, row, dx, dy, vx + 0.5 * bx * span, vy + 0.5 * by * span, fat + 0.125 * pulls * span * span
    )
    count = int(f[row + CORNERS])
    beside = row + FIRST_CORNER if count == 1 else -1
    ends = math.inf
    for face in range(row + FIRST_CORNER, row + FIRST_CORNER + count * WIDE if count > 1 else 0, WIDE):
        nx = f[face + NX]
        ny = f[face + NY]
        before, after = faces_beside(row, count, face)
        px = dx - f[face + CX]
        py = dy - f[face + CY]
        along = nx * py - ny * px
        most = math.inf
        near = -0.5 * fat - 0.75 * f[row + FLUSH]
        if reach > 0.0:
            near = -2.0 * fat
            beyond = ny * (dx - f[after + CX]) - nx * (dy - f[after + CY])
            most = time_along(smaller(along, beyond) - 2.0 * fat, speed, pulls)
            past = f[before + NX] * py - f[before + NY] * px
            if along < -2.0 * fat and past > 2.0 * fat:
                beside = face
                ends = time_along(smaller(-along, past) - 2.0 * fat, speed, pulls)
        above = (nx * dx + ny * dy) - (f[face + OUT] + fat)
        rate = (nx * vx + ny * vy) - doubt
        away = larger(away, stays_above(above, rate, (nx * bx + ny * by) - 2.0**-45 * pulls, near, most))
    if beside >= 0 and reach > 0.0:
        away = larger(away, corner_stays(f, beside, reach, fat, doubt, motion, ends))
    return away


@unchecked
@hook
def soonest_accelerated(k: Kernel, body: int, count: int, barred: int, at: int) -> tuple[float, float, int]:
    """Returns the values of ``soonest`` for accelerated bodies, up to the first end of the chords of two
    bodies, as in ``disc.soonest_accelerated``; later contacts are omitted. Compares upright boxes first,
    eight at a time, on the chords of relative ways."""
    limits = k.clock[0].limits
    fill(k.near, count, body)
    one = k.places[body]
    zero = spread(0.0)
    more = spread(1.0 + 2.0**-40)
    room = spread(2.0**14 * k.clock[0].per_tick)
    fat = limits.fat
    own_speed = abs(one.vx) + abs(one.vy)
    soon = math.inf
    rest = math.inf
    who = NOBODY
    for start in range(0, count, LANES):
        dx, dy, vx, vy, bx, by, span = accelerated_motions(k, body, start, at)
        h, cx, cy, sagitta, _ = chords(vx, vy, bx, by, span)
        delay, leaves = boxes_overlap(k, body, start, spread(fat) + sagitta, dx, dy, cx, cy)
        delay = choose(delay > zero, delay, zero)
        may = (delay <= leaves) & (delay <= span * more + room) & (delay < spread(rest))
        found = bits(may)
        while found != 0:
            i = lowest_bit(found)
            found &= found - 1
            other = k.near[start + i]
            row = row_of(k, body, other)
            if other != body and other != barred and row > 0 and lane(delay, i) < rest:
                two = k.places[other]
                bends = abs(lane(bx, i)) + abs(lane(by, i))
                until = lane(h, i)
                speeds = own_speed + abs(two.vx) + abs(two.vy)
                doubt = 2.0**-45 * (speeds + bends * (abs(since_origin(k, at)) + until))
                motion = (lane(dx, i), lane(dy, i), lane(vx, i), lane(vy, i), lane(bx, i), lane(by, i))
                wait = larger(
                    lane(delay, i), not_before_accelerated(k.numbers, row, fat, until, doubt, motion)
                )
                if wait <= lane(span * more + room, i):
                    rest = smaller(rest, larger(soon, wait))
                    who = int(other) if wait < soon else who
                    soon = smaller(soon, wait)
    return soon, rest, who


class Convex:
    """Elastic contact of convex bodies."""

    def prepare(self, scene: Scene) -> PairParts:
        """Returns the parts; refuses a scene of discs alone, and a scene with too many different shapes."""
        if not scene.shapes:
            raise Refused("convex is for scenes with shapes, and this one has discs alone: choose disc")
        every = range(len(scene.shapes))
        pairs = {pair for i in scene.movable_shapes for j in every for pair in ((i, j), (j, i))}
        numbers = difference_table(scene.shapes, pairs)
        rows = [int(row) for row in numbers[1 : 1 + len(scene.shapes) ** 2] if row]
        bounds = soonest
        if all(numbers[row + PLAIN] for row in rows):
            bounds = soonest_of_boxes if all(numbers[row + CORNERS] > 1 for row in rows) else soonest_of_plain
        periodic, accelerated = bool(scene.periodic), scene.accelerated
        bounds = bounds if scene.uniform else soonest_accelerated
        return PairParts(
            meet=meet_images if periodic else meet,
            collide=collide,
            soonest=bounds if not periodic else None if accelerated else soonest_of_images,
            touch=touch,
            part=part,
            gap=gap,
            ledge=ledge if accelerated else None,
            contact_distance="outlines",
            shapes=True,
            periodic=periodic,
            accelerated=accelerated,
            numbers=numbers,
        )
