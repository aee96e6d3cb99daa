"""When do two bodies meet? The families that are asked."""

from __future__ import annotations

from collections.abc import Callable
from math import ldexp, nextafter, sqrt

from .aiming import Question, aimed, anchors, exactly, flown_back, scaled, swapped
from .draws import TRIPLES, Draws
from .rules import FAR, Plan, meeting

__all__ = ["FAMILIES"]

Sampler = Callable[[Draws], Question]


def radii(d: Draws) -> tuple[float, float]:
    return d.uniform(0.005, 0.05), d.uniform(0.005, 0.05)


def gas(d: Draws, radius: float, free: float) -> Question:
    """Equal discs; how far they fly before they meet is about ``free``, and a quarter of them miss."""
    run = 2.0 * radius + free * d.uniform(0.0, 2.0)
    one, two = aimed(d, (radius, radius), run, 2.0 * radius * d.uniform(-1.3, 1.3), d.uniform(0.1, 2.0))
    return swapped(d, 0, *anchors(d, one, two))


def lattice(d: Draws) -> Question:
    """Small multiples of powers of two throughout, at rest or along an axis often; two of three meet."""

    def plan() -> Plan:
        x, y = d.below(64) / 64, d.below(64) / 64
        vx, vy = d.whole(-4, 4) / 4, d.whole(-4, 4) / 4
        if d.below(2):
            vx, vy = (vx, 0.0) if d.below(2) else (0.0, vy)
        return Plan(x, y, vx, vy, d.whole(1, 4) / 64, d.below(8) << 49)

    one, two = plan(), plan()
    if d.below(3):
        while meeting(one, two, 0) is None:
            one, two = plan(), plan()
    return Question(0, one, two)


def whole_root(d: Draws) -> Question:
    """A root at a whole tick exactly; half of them moved by one last bit."""
    e = d.pick((0, 0, 0, 1, 7, 20))
    ticks = d.below(1 << d.whole(1, 61))
    speed = d.whole(1, 7) * ldexp(1.0, d.whole(-4, 1))
    low = ticks % (1 << 30)
    a_tick = ldexp(speed, -52 - e)
    one, two = exactly(d, d.whole(1, 9) / 64, (ticks - low) * a_tick, speed, low * a_tick)
    if d.below(2):
        to = d.pick((-1.0, 1.0))
        one = one._replace(x=nextafter(one.x, to), y=nextafter(one.y, to))
    base = d.whole(-(1 << 60), 1 << 60)
    return swapped(d, e, one._replace(anchor=base), two._replace(anchor=base))


def horizon(d: Draws) -> Question:
    """A root about 2^62 ticks after the later anchor: a few ticks, or a part of one, before, at, after."""
    e = d.pick((0, 0, 3, 20))
    speed = d.whole(1, 7) * ldexp(1.0, d.whole(-9, 1))
    off = d.pick((-2.0, -1.0, -0.5, -(2.0**-30), 0.0, 2.0**-30, 0.5, 1.0, 3.0, 1e6, -1e6))
    a_tick = ldexp(speed, -52 - e)
    one, two = exactly(d, d.whole(1, 9) / 64, FAR * a_tick, speed, off * a_tick)
    base = d.whole(-(1 << 61), 1 << 61)
    one, two = one._replace(anchor=base), two._replace(anchor=base)
    if d.below(3) == 0:  # the one that does not move was there before, too
        one = one._replace(anchor=base - d.below(1 << 60))
    return swapped(d, e, one, two)


def at_tangent(d: Draws) -> tuple[Plan, Plan]:
    """Return two plans that only touch as they pass, exactly: along an axis, or in the direction of a
    triple. All numbers are short."""
    size = ldexp(1.0, -d.whole(4, 9))
    over, up, c = d.pick(TRIPLES)
    a, b = d.turned(over, up)
    wide = d.whole(1, 5)
    run = d.whole(1, 64)
    split = d.whole(1, 7) / 8
    x, y = d.whole(-8, 8) * size, d.whole(-8, 8) * size
    vx, vy = d.whole(-4, 4) / 4, d.whole(-4, 4) / 4
    speed = ldexp(d.whole(1, 3), -d.whole(2, 8))
    one = Plan(x, y, vx, vy, c * wide * split * size, 0)
    two = Plan(
        x - (b * wide + a * run) * size,
        y + (a * wide - b * run) * size,
        vx + a * speed,
        vy + b * speed,
        c * wide * (1.0 - split) * size,
        0,
    )
    return one, two


def tangent(d: Draws) -> Question:
    """Exact tangency; or by one last bit of a radius or a coordinate not."""
    one, two = at_tangent(d)
    how = d.below(4)
    if how == 1:
        one = one._replace(radius=nextafter(one.radius, d.pick((0.0, 9.0))))
    if how == 2:
        two = two._replace(x=nextafter(two.x, d.sign() * 9.0))
    base = d.whole(-64, 64) << d.whole(40, 54)
    one, two = one._replace(anchor=base), two._replace(anchor=base)
    if d.below(2):  # 2^48 ticks of velocities that are multiples of 2^-10: still exact
        one = flown_back(one, d.below(16) << 48, 0)
    return swapped(d, 0, one, two)


def graze(d: Draws) -> Question:
    """Tangent but for 2^-10 to 2^-60 of the reach: in a radius of its own, or in a coordinate near 0."""
    depth = ldexp(d.sign() * d.uniform(0.5, 1.0), -d.whole(9, 59))
    one, two = at_tangent(d)
    reach = one.radius + two.radius
    if d.below(2):
        two = two._replace(x=two.x - one.x, y=two.y - one.y)
        one = one._replace(x=depth * reach, y=d.sign() * depth * reach)
    else:
        one, two = one._replace(radius=reach), two._replace(radius=abs(depth) * reach)
    return swapped(d, 0, one, two)


def aimed_graze(d: Draws) -> Question:
    """Aimed at a graze of 1e-17 to 1e-3 of the reach, at any angle: rounding decides the last of them."""
    both = radii(d)
    reach = both[0] + both[1]
    off = d.sign() * float(f"{d.whole(1, 9)}e-{d.whole(4, 17)}")
    one, two = aimed(d, both, reach * d.uniform(1.1, 20.0), reach * (1.0 + off), d.uniform(0.1, 2.0))
    return swapped(d, 0, *anchors(d, one, two))


def far(d: Draws) -> Question:
    """Some 1e6 from the origin."""
    both = radii(d)
    reach = both[0] + both[1]
    one, two = aimed(d, both, reach * d.uniform(1.1, 20.0), reach * d.uniform(-1.2, 1.2))
    x, y = d.sign() * d.uniform(5e5, 2e6), d.sign() * d.uniform(5e5, 2e6)
    one, two = (plan._replace(x=plan.x + x, y=plan.y + y) for plan in (one, two))
    return swapped(d, 0, *anchors(d, one, two))


def late(d: Draws) -> Question:
    """Anchors up to 2^61 ticks apart, where that has been flown."""
    both = radii(d)
    reach = both[0] + both[1]
    one, two = aimed(d, both, reach * d.uniform(1.1, 90.0), reach * d.uniform(-1.2, 1.2), d.power(-6, 0))
    ticks = d.whole(1 << 55, 1 << 61)
    base = d.whole(-(1 << 60), 1 << 61)
    one, two = flown_back(one._replace(anchor=base), ticks, 0), two._replace(anchor=base)
    return swapped(d, 0, one, two)


def ratio(d: Draws) -> Question:
    """Radii a million apart."""
    small = d.power(-22, -18)
    large = small * d.uniform(3e5, 2e6)
    both = d.pick(((small, large), (large, small)))
    one, two = aimed(d, both, large * d.uniform(1.0001, 3.0), large * d.uniform(-1.01, 1.01))
    return swapped(d, 0, *anchors(d, one, two, apart=40))


def touching(d: Draws) -> Question:
    """They touch exactly, or one last bit of a coordinate is other; at any angle, the tangent's often."""
    over, up, c = d.pick(TRIPLES)
    a, b = d.turned(over, up)
    size = ldexp(d.whole(1, 9), -d.whole(4, 9))
    split = d.whole(1, 7) / 8
    x, y = d.whole(-9, 9) * size, d.whole(-9, 9) * size
    vx, vy = d.uniform(-1.0, 1.0), d.uniform(-1.0, 1.0)
    across = d.sign() * ldexp(d.whole(1, 64), -6)
    along = d.sign() * ldexp(d.whole(0, 1), -d.whole(0, 60))
    if d.below(3) == 0:
        vx, vy = 0.0, 0.0
    wx, wy = along * a - across * b, along * b + across * a
    if d.below(2):
        wx, wy = d.direction()
    one = Plan(x, y, vx, vy, c * size * split, 0)
    two = Plan(x + a * size, y + b * size, vx + wx, vy + wy, c * size * (1.0 - split), 0)
    how = d.below(4)
    if how == 1:
        two = two._replace(x=nextafter(two.x, d.sign() * 99.0))
    if how == 2:
        two = two._replace(radius=nextafter(two.radius, d.pick((0.0, 99.0))))
    base = d.whole(-9, 9) << 48
    one, two = one._replace(anchor=base), two._replace(anchor=base)
    if d.below(3) == 0:
        one = one._replace(vx=0.0, vy=0.0, anchor=base - d.below(1 << 60))
    return swapped(d, 0, one, two)


def overlapping(d: Draws) -> Question:
    """They overlap, a little or altogether, and approach, part, or are at one place."""
    both = radii(d)
    reach = both[0] + both[1]
    depth = ldexp(1.0, -d.whole(0, 53)) if d.below(8) else 1.0
    one, two = aimed(d, both, reach * (1.0 - depth), 0.0, d.sign() * d.uniform(0.1, 2.0))
    if d.below(8) == 0:
        two = two._replace(x=one.x, y=one.y)
    return swapped(d, 0, *anchors(d, one, two, apart=20))


def slow(d: Draws) -> Question:
    """Almost equal velocities, 2^-40 to 2^-10 apart, and as near as they must be to meet in time."""
    both = radii(d)
    reach = both[0] + both[1]
    speed = d.power(-40, -10)
    miss = reach * d.uniform(-1.0, 1.0)
    free = speed * d.uniform(0.0, 900.0)
    drift = d.pick((0.0, 0.01, 0.7))
    one, two = aimed(d, both, sqrt(reach * reach - miss * miss) + free, miss, speed, drift)
    return swapped(d, 0, *anchors(d, one, two, apart=40))


def parting(d: Draws) -> Question:
    """Equal velocities, both at rest, or apart from each other: never, unless they still come nearer."""
    both = radii(d)
    reach = both[0] + both[1]
    one, two = aimed(d, both, reach * d.uniform(-9.0, 0.1), reach * d.uniform(-2.0, 2.0))
    how = d.below(3)
    if how == 1:
        two = two._replace(vx=one.vx, vy=one.vy)
    if how == 2:
        one, two = one._replace(vx=0.0, vy=0.0), two._replace(vx=0.0, vy=0.0)
    return swapped(d, 0, *anchors(d, one, two))


def at_scale(d: Draws) -> Question:
    """Ordinary pairs in lengths of 2^-150 to 2^150 and in times of their own."""
    both = radii(d)
    reach = both[0] + both[1]
    one, two = aimed(d, both, reach * d.uniform(1.1, 20.0), reach * d.uniform(-1.2, 1.2))
    one, two = anchors(d, one, two)
    length = d.sign() * d.whole(100, 150)
    time = d.whole(-2, 6)
    return swapped(d, 0, scaled(one, length, length - time), scaled(two, length, length - time))


def extreme(d: Draws) -> Question:
    """Any exponents, from subnormal numbers to 2^900; units down to 2^-900."""
    e = d.pick((0, 0, 0, 1, 100, 900))
    size = d.whole(-1060, 890)

    def number(about: int) -> float:
        return 0.0 if d.below(6) == 0 else d.sign() * d.power(max(about - 8, -1074), min(about + 8, 899))

    about = [d.whole(-1074, 899) if d.below(3) == 0 else size for _ in range(4)]
    speed = [min(max(each + e - d.whole(-9, 9), -1074), 899) for each in about]
    one = Plan(number(about[0]), number(about[0]), number(speed[0]), number(speed[0]), 0.0, d.below(1 << 54))
    two = Plan(number(about[1]), number(about[1]), number(speed[1]), number(speed[1]), 0.0, d.below(1 << 54))
    one = one._replace(radius=d.power(max(about[2] - 9, -1074), about[2]))
    two = two._replace(radius=d.power(max(about[3] - 9, -1074), about[3]))
    if d.below(3):  # towards each other, along each axis or one of them
        one = one._replace(vx=abs(one.vx) if one.x < two.x else -abs(one.vx))
        two = two._replace(vx=-abs(two.vx) if one.x < two.x else abs(two.vx))
        two = two._replace(y=one.y) if d.below(2) else two
    return Question(e, one, two)


def extreme_aimed(d: Draws) -> Question:
    """Ordinary pairs, but in lengths, times and units at the ends of what a double is."""
    both = radii(d)
    reach = both[0] + both[1]
    one, two = aimed(d, both, reach * d.uniform(1.1, 20.0), reach * d.uniform(-1.2, 1.2))
    e = d.pick((0, 100, 500, 900))
    length = d.whole(-1060 + min(e, 60), 890 - e)
    speed = min(max(length + e + d.whole(-8, 2), -1060), 890)
    base = d.whole(-(1 << 60), 1 << 60)
    one, two = one._replace(anchor=base), two._replace(anchor=base - d.below(1 << 48))
    return swapped(d, e, scaled(one, length, speed), scaled(two, length, speed))


def units(d: Draws) -> Question:
    """Units of 2^-1 to 2^-20, and 2^-900, with speeds to match."""
    e = d.whole(1, 20) if d.below(5) else 900
    both = radii(d)
    reach = both[0] + both[1]
    one, two = aimed(d, both, reach * d.uniform(1.1, 20.0), reach * d.uniform(-1.2, 1.2))
    length = -2 if e < 900 else d.pick((-2, 1, -300))
    speed = length + e - d.whole(-1, 8)
    return swapped(d, e, *anchors(d, scaled(one, length, speed), scaled(two, length, speed), e))


def anchored_anywhere(d: Draws) -> Question:
    """Anchors equal, the first later, the second later; negative, of any size."""
    both = radii(d)
    reach = both[0] + both[1]
    one, two = aimed(d, both, reach * d.uniform(1.1, 20.0), reach * d.uniform(-1.1, 1.1))
    one, two = (plan._replace(x=plan.x - 1.0, y=plan.y - 1.0) for plan in (one, two))
    return swapped(d, 0, *anchors(d, one, two, apart=d.pick((1, 8, 30, 52, 53, 54, 56)), base=d.whole(1, 61)))


def gas_dense(d: Draws) -> Question:
    return gas(d, 0.04, 0.03)


def gas_dilute(d: Draws) -> Question:
    return gas(d, 0.0018, 0.3)


FAMILIES: dict[str, dict[str, tuple[Sampler, int]]] = {
    "gas": {"gas, dense": (gas_dense, 350), "gas, dilute": (gas_dilute, 350)},
    "lattice": {"lattice": (lattice, 500), "roots at whole ticks": (whole_root, 400)},
    "tangent": {"tangent": (tangent, 400)},
    "graze": {"graze": (graze, 400), "graze, aimed": (aimed_graze, 400)},
    "far": {"far from the origin": (far, 250), "late clock": (late, 250)},
    "sizes": {"size ratio": (ratio, 250)},
    "touching": {"touching": (touching, 400), "overlapping": (overlapping, 250)},
    "slow": {"slow": (slow, 250), "parting or at rest": (parting, 150)},
    "scaled": {"scaled": (at_scale, 250)},
    "extreme": {"extreme": (extreme, 200), "extreme, aimed": (extreme_aimed, 300)},
    "horizon": {"about 2^62": (horizon, 300)},
    "units": {"units": (units, 300), "anchors": (anchored_anywhere, 300)},
}
"""File, family, how it is drawn, and how many."""
