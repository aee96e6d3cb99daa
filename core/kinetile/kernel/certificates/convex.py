"""When two convex bodies touch that do not rotate: the exact tick.

Seen from the first body, the place d of the second moves on a line, and the two touch where d is as far from
the difference M of their cores as the sum R of their radii (docs/specification.md, rule 5s). So a place
enters a convex polygon with a margin. ``enters`` finds the tick in double, with bounds of all rounding:

* In double, the place crosses the line of each face, moved out by R, at some time: inwards or outwards. It
  comes within all of them at the last crossing inwards, unless it has crossed one outwards before: then it
  never enters.
* If R > 0 and it is then beyond an end of that last face, it is in a tip, which the margin does not fill, and
  from there only the disc around this corner can be entered: a question about two discs (``contact``).
* Otherwise it enters across that face, and one step in compensated arithmetic says in which tick.

What any of these leaves open is decided in whole numbers (``convex_integers``).
"""

from __future__ import annotations

import math

from kinetile.kernel.certificates.contact import (
    LARGE,
    OPEN,
    SMALL,
    TINY,
    about,
    filtered,
    kept,
    look_closer,
    plus,
    seen_from,
    whole_path,
    whole_sum,
)
from kinetile.kernel.certificates.convex_integers import (
    COUNT,
    CX,
    CX_LOW,
    CY,
    CY_LOW,
    FAR_LOW,
    FAR_OUT,
    HEAD,
    NX,
    NY,
    OUT,
    RADIUS,
    RADIUS_LOW,
    SIZE,
    TX,
    TX_LOW,
    TY,
    TY_LOW,
    WIDE,
    enters_exactly,
)
from kinetile.kernel.certificates.faces import by_ticks, grain_of, tick_at_face
from kinetile.kernel.certificates.integers import as_count
from kinetile.kernel.compiled import Numbers, apart, hook, larger, smaller
from kinetile.kernel.tables import NEVER


@hook
def compared(a: float, b: float, c: float, d: float) -> tuple[float, bool]:
    """Return a b - c d, and whether its sign is right: that is so if both products are kept, too."""
    one = a * b
    two = c * d
    clear = abs(one - two) > 2.0**-50 * (abs(one) + abs(two)) + TINY
    return one - two, clear or (kept(a, b, one) and kept(c, d, two))


@hook
def exact_dot(a: float, b: float, c: float, d: float) -> tuple[float, bool]:
    """Return a b - c d, and whether nothing was rounded off."""
    one = a * b
    two = c * d
    return one - two, kept(a, b, one) and kept(c, d, two) and whole_sum(one, -two)


@hook
def without_rounding(
    f: Numbers,
    row: int,
    dx: float,
    ux: float,
    dy: float,
    uy: float,
    tick: float,
    per_time: float,
) -> int:
    """Return what ``enters`` does where d and u are exact, and no operation on the way rounds anything off,
    as on a lattice in small dyadic numbers. ``OPEN`` where one does, where it is a corner that is met, and
    where the bodies overlap.

    Products say which of two quotients is larger, and what a division leaves says the floor.
    """
    faces = row + HEAD
    count = int(f[row + COUNT])
    into = 0.0
    into_rate = 0.0
    entered = -1
    out = 0.0
    out_rate = 0.0
    highest = -math.inf
    nearest = faces
    falls = False
    exact = True
    for k in range(count):
        face = faces + k * WIDE
        across, first = exact_dot(f[face + TY], dx, f[face + TX], dy)
        rate, second = exact_dot(f[face + TY], ux, f[face + TX], uy)
        gap = across - f[face + FAR_OUT]
        exact = exact and first and second and whole_sum(across, -f[face + FAR_OUT])
        exact = exact and f[face + TX_LOW] == 0.0 and f[face + TY_LOW] == 0.0 and f[face + FAR_LOW] == 0.0
        if exact and gap >= 0.0 and (rate == 0.0 or (gap > 0.0 and rate > 0.0)):
            return NEVER
        falls = rate < 0.0 and (falls or gap > highest) if gap >= highest else falls
        nearest = face if gap > highest else nearest
        highest = larger(highest, gap)
        if rate < 0.0:
            later, third = compared(into, rate, gap, into_rate)
            exact = exact and third
            if entered < 0 or later > 0.0:
                into = gap
                into_rate = rate
                entered = face
        elif rate > 0.0:
            sooner, third = compared(gap, out_rate, out, rate)
            exact = exact and third
            if out_rate == 0.0 or sooner > 0.0:
                out = gap
                out_rate = rate
    if not exact or highest < 0.0:
        return OPEN
    face = entered if highest > 0.0 else nearest
    if highest > 0.0 and out_rate > 0.0:
        stays, first = compared(out, into_rate, into, out_rate)
        if not first:
            return OPEN
        if stays <= 0.0:
            return NEVER
    if f[row + RADIUS] > 0.0:
        gap = into if highest > 0.0 else 0.0
        rate = into_rate if highest > 0.0 else -1.0
        for end in range(2):
            corner = face + end * WIDE
            corner = faces if corner == faces + count * WIDE else corner
            x = dx - f[corner + CX]
            y = dy - f[corner + CY]
            exact = exact and whole_sum(dx, -f[corner + CX]) and whole_sum(dy, -f[corner + CY])
            exact = exact and f[corner + CX_LOW] == 0.0 and f[corner + CY_LOW] == 0.0
            along, first = exact_dot(f[face + TX], x, -f[face + TY], y)
            pace, second = exact_dot(f[face + TX], ux, -f[face + TY], uy)
            beyond, third = compared(pace, gap, along, rate)
            if not (exact and first and second and third) or (beyond < 0.0 if end == 0 else beyond > 0.0):
                return OPEN
    if highest == 0.0:
        return 0 if falls else NEVER
    about_then = into / -into_rate * per_time
    if not about_then < 2.0**53:
        return OPEN
    ticks = float(math.floor(about_then))
    flown = into_rate * (ticks * tick)
    left = into + flown
    if not (kept(into_rate, ticks * tick, flown) and whole_sum(into, flown)):
        return OPEN
    more = -1 if left < 0.0 else 0
    if left + into_rate * tick >= 0.0:
        more = 1
    return int(ticks) + more


@apart
def enters(
    f: Numbers,
    row: int,
    x: float,
    y: float,
    vx: float,
    vy: float,
    elapsed: int,
    x2: float,
    y2: float,
    vx2: float,
    vy2: float,
    tick: float,
    per_time: float,
) -> int:
    """Return how many ticks after the later anchor two convex bodies touch, rounded down exactly, or
    ``NEVER``.

    ``row`` is where the row of their difference begins in the table ``f``, other arguments are those of
    ``contact.first_touch``.
    """
    whole = float(elapsed)
    time = whole * tick
    rest = float(elapsed - int(whole)) * tick
    dx, x_low, x_size, ux, wx = seen_from(x, vx, x2, vx2, time, rest)
    dy, y_low, y_size, uy, wy = seen_from(y, vy, y2, vy2, time, rest)
    count = int(f[row + COUNT])
    faces = row + HEAD
    reach = f[row + RADIUS]
    size = (x_size + y_size) + f[row + SIZE]
    speed = abs(ux) + abs(uy)
    guess = 0
    if speed > SMALL and speed < LARGE and size < LARGE:
        doubt = 2.0**-48 * size
        slack = 2.0**-50 * speed
        into = -math.inf
        into_error = 0.0
        latest = -math.inf
        out = math.inf
        stays = math.inf
        highest = -math.inf
        known = True
        for k in range(count if count > 1 else 0):
            face = faces + k * WIDE
            nx = f[face + NX]
            ny = f[face + NY]
            gap = (nx * dx + ny * dy) - f[face + OUT]
            rate = nx * ux + ny * uy
            highest = larger(highest, gap)
            if abs(rate) <= slack:
                still = (nx == 0.0 or (ux == 0.0 and wx == 0.0)) and (ny == 0.0 or (uy == 0.0 and wy == 0.0))
                if still and gap > doubt:
                    return NEVER
                known = known and gap < (-doubt if still else -(2.0**-20) * size)
                continue
            t = -gap / rate
            error = (doubt + slack * abs(t)) / (abs(rate) - slack)
            if rate > 0.0:
                out = smaller(out, t + error)
                stays = smaller(stays, t - error)
            else:
                latest = larger(latest, t + error)
                if t > into:
                    into = t
                    into_error = error
        if into - into_error > out or out < 0.0:
            return NEVER
        comes = into - into_error
        known = known and into * speed < 2.0**20 * size and (comes > 0.0 or latest < 0.0)
        known = known and (reach > 0.0 or latest < stays)
        corner = faces if count == 1 else -1
        found = -1
        if count > 1 and comes > 0.0:
            guess = as_count(into * per_time)
        for k in range(count if known and count > 1 else 0):
            face = faces + k * WIDE
            nx = f[face + NX]
            ny = f[face + NY]
            gap = (nx * dx + ny * dy) - f[face + OUT]
            rate = nx * ux + ny * uy
            t = 0.0
            error = 0.0
            if comes > 0.0:
                t = -gap / rate
                error = (doubt + slack * abs(t)) / (abs(rate) - slack)
                if rate >= -slack or t + error < comes:
                    continue
            elif gap < highest - 2.0 * doubt:
                continue
            over = True
            if reach > 0.0:
                around = doubt + speed * error
                next_corner = face + WIDE
                next_corner = faces if next_corner == faces + count * WIDE else next_corner
                px = dx + ux * t
                py = dy + uy * t
                first = nx * (py - f[face + CY]) - ny * (px - f[face + CX])
                last = nx * (py - f[next_corner + CY]) - ny * (px - f[next_corner + CX])
                over = first > around and last < -around
                nearest = face if first < -around else next_corner
                if not over:
                    known = known and (first < -around or last > around) and (corner < 0 or corner == nearest)
                    corner = nearest
            if over:
                ticks = -1
                if comes > 0.0:
                    ticks = tick_at_face(
                        f, face, t, dx, x_low, x_size, ux, wx, dy, y_low, y_size, uy, wy, per_time, 0.0
                    )
                known = known and ticks >= 0
                if ticks >= 0 and reach > 0.0:
                    return ticks
                found = larger(found, ticks)
        if known and corner < 0:
            return found
        if not known:
            corner = -1
        if corner >= 0:
            ax, ax_low = plus(dx, -f[corner + CX])
            ay, ay_low = plus(dy, -f[corner + CY])
            found = filtered(
                ax,
                ax_low + (x_low - f[corner + CX_LOW]),
                x_size + abs(f[corner + CX]),
                ux,
                wx,
                ay,
                ay_low + (y_low - f[corner + CY_LOW]),
                y_size + abs(f[corner + CY]),
                uy,
                wy,
                reach,
                f[row + RADIUS_LOW],
                tick,
                per_time,
            )
            if found != OPEN:
                return found
            at_origin = f[corner + CX] == 0.0 and f[corner + CY] == 0.0
            if count == 1 and at_origin:  # two discs
                return look_closer(
                    x,
                    y,
                    vx,
                    vy,
                    elapsed,
                    x2,
                    y2,
                    vx2,
                    vy2,
                    reach,
                    f[row + RADIUS_LOW],
                    tick,
                    per_time,
                    0.0,
                    0.0,
                    0.0,
                    0.0,
                )
            guess = as_count(about(ax, ay, ux, uy, reach) * per_time)
        if count > 2 and reach == 0.0:
            grain = tick * smaller(smaller(grain_of(vx), grain_of(vy)), smaller(grain_of(vx2), grain_of(vy2)))
            grain = smaller(
                smaller(grain, smaller(grain_of(x), grain_of(y))), smaller(grain_of(x2), grain_of(y2))
            )
            found = by_ticks(f, row, dx, x_low, x_size, ux, wx, dy, y_low, y_size, uy, wy, per_time, grain)
            if found != OPEN:
                return found
        exact = whole_path(x, vx, x2, vx2, time, rest, 0.0, 0.0)
        if count > 1 and exact and whole_path(y, vy, y2, vy2, time, rest, 0.0, 0.0):
            found = without_rounding(f, row, dx, ux, dy, uy, tick, per_time)
            if found != OPEN:
                return found
    return enters_exactly(f, row, x, y, vx, vy, elapsed, x2, y2, vx2, vy2, tick, guess)
