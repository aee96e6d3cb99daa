"""The contacts of discs that an engine without ticks can be asked about, a line each, and how hard each is
in doubles."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from math import isqrt

from .contacts import FAMILIES
from .doubles import rounded
from .draws import TRIPLES, Draws
from .rules import Plan, meeting
from .writing import number

__all__ = ["files"]

MOST = 60
"""How many lines a family has at most."""

SLACK = Fraction(1, 1 << 20)

SIZES = 2.0**-200, 2.0**200
"""Numbers are between these, or 0: no product of four of them is beyond a double."""


def files() -> dict[str, str]:
    """Return the text of the file, by its path."""
    rows = []
    samplers = {family: each for families in FAMILIES.values() for family, each in families.items()}
    for family, (sampler, count) in (samplers | {"short numbers": (_short_numbers, 200)}).items():
        d = Draws("contacts, " + family)
        asked = [sampler(d) for _ in range(count)]
        found = [line for e, one, two in asked for line in _line(family, e, one, two)]
        rows += found if sampler is _short_numbers else found[:MOST]
    return {"discs.txt": "\n".join([*rows, ""])}


def _short_numbers(d: Draws) -> tuple[int, Plan, Plan]:
    """Along the direction of a triple, with a root of a few bits; some paths only touch."""
    (across, ahead, both), (a, b, c) = d.pick(TRIPLES), d.pick(TRIPLES)
    a, b = d.turned(a, b)
    size, speed = d.pick((1.0, 0.25, 2.0**-20)), 2.0 ** d.whole(-6, 3)
    reach = c * (both if d.below(4) else across)  # a path that only touches
    behind = ahead + d.pick((0, 1, d.whole(0, 9), d.whole(-9, 400)))
    x, y = (across * -b - behind * a) * size, (across * a - behind * b) * size
    vx, vy = a * size * speed, b * size * speed
    at_x, at_y, drift = d.whole(-99, 99) * size, d.whole(-99, 99) * size, d.whole(-4, 4) * size
    radius = d.whole(1, 4 * reach - 1) * size / 4 if reach else size
    one = Plan(at_x, at_y, drift, 0.0, radius, 0)
    return 0, one, Plan(at_x + x, at_y + y, vx + drift, vy, abs(reach * size - radius) or size, 0)


def _line(family: str, e: int, one: Plan, two: Plan) -> Iterator[str]:
    values = [*one[:5], *two[:5]]
    if one.anchor != two.anchor or not all(v == 0 or SIZES[0] < abs(v) < SIZES[1] for v in values):
        return
    tick = meeting(one, two, e)
    d, v, reach = _relative(one, two)
    if (tick is not None) == _meets(d, v, reach):  # not where the only reason is the horizon
        words = [_grade(d, v, reach), family.replace(", ", "-").replace(" ", "-"), str(e)]
        words.append("-" if tick is None else str(tick - one.anchor))
        yield " ".join([*words, *(_short(value) for value in values)])


def _short(value: float) -> str:
    digits, _, power = number(value).partition("p")
    return digits.rstrip("0").removesuffix(".") + "p" + power if value else "0x0p+0"


Pair = tuple[Fraction, Fraction]


def _relative(one: Plan, two: Plan) -> tuple[Pair, Pair, Fraction]:
    x, y, vx, vy = (Fraction(q) - Fraction(p) for p, q in zip(one[:4], two[:4], strict=True))
    return (x, y), (vx, vy), Fraction(one.radius) + Fraction(two.radius)


def _meets(d: Pair, v: Pair, reach: Fraction) -> bool:
    b, c = _dot(d, v), _dot(d, d) - reach * reach
    return b < 0 and (c <= 0 or b * b > _dot(v, v) * c)


def _grade(d: Pair, v: Pair, reach: Fraction) -> str:
    """Return "exact" where doubles hold every step of the quadratic, "clear" where another reach, by a
    millionth of what there is, and another approach would change nothing, and "close"."""
    if all(step is not None and rounded(step) == step for step in _steps(d, v, reach)):
        return "exact"
    slack = SLACK * (reach + abs(d[0]) + abs(d[1]))
    if _meets(d, v, reach - slack) != _meets(d, v, reach + slack):
        return "close"
    touch = _dot(d, d) <= (reach + slack) ** 2
    slides = _dot(d, v) ** 2 <= SLACK**2 * _dot(d, d) * _dot(v, v)
    return "close" if touch and slides else "clear"


def _steps(d: Pair, v: Pair, reach: Fraction) -> Iterator[Fraction | None]:
    """Yield the steps of the quadratic, None for a root that is no rational."""
    a, b, c = _dot(v, v), _dot(d, v), _dot(d, d) - reach * reach
    yield from (*d, *v, reach, d[0] * v[0], d[1] * v[1], b)
    yield from (d[0] * d[0], d[1] * d[1], _dot(d, d), reach * reach, c)
    if b < 0 < c:
        yield from (v[0] * v[0], v[1] * v[1], a, b * b, a * c, b * b - a * c)
        if b * b > a * c:
            root = _root(b * b - a * c)
            yield root
            if root is not None:
                yield from (root - b, -b - root, (-b - root) / a)


def _root(square: Fraction) -> Fraction | None:
    root = Fraction(isqrt(square.numerator), isqrt(square.denominator))
    return root if root * root == square else None


def _dot(one: Pair, other: Pair) -> Fraction:
    return one[0] * other[0] + one[1] * other[1]
