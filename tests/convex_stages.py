"""Questions to the certificate of convex bodies by the million: all its stages against the last one alone,
whole numbers, which ``convex_questions`` compares with rationals."""

import itertools
import math
import random
import sys

import numpy as np

import kinetile as kt
from kinetile.errors import SceneError
from kinetile.kernel.certificates.convex import enters, leaves
from kinetile.kernel.certificates.convex_integers import (
    COUNT,
    CX,
    CY,
    HEAD,
    NX,
    NY,
    RADIUS,
    WIDE,
    enters_exactly,
    leaves_exactly,
)
from kinetile.kernel.certificates.plans import Axis, Plans
from kinetile.kernel.compiled import compose, pointer
from kinetile.kernel.loop.idle import NoState
from kinetile.toolbox.differences import difference_row

KINDS = ("disc", "capsule", "segment", "box", "polygon")
PAIRS = [pair for pair in itertools.combinations_with_replacement(KINDS, 2) if pair != ("segment", "segment")]
LATTICES = (1, 2, 4, 16, 1 << 20, 0)
TICKS = 2.0**-52, 2.0**-52, 2.0**-30, 2.0**-10, 2.0**-3


def ask_both(numbers, plans, elapsed, tick, answers):
    """Write the answers of all stages, and of the last one, to each question: when they touch, and part."""
    for i in range(len(plans)):
        x, y, vx, vy, x2, y2, vx2, vy2 = plans[i]
        f = pointer(numbers)
        across, up = Axis(x, vx, x2, vx2, 0.0, 0.0), Axis(y, vy, y2, vy2, 0.0, 0.0)
        both = Plans(across, up, elapsed[i], tick, 1.0 / tick)
        answers[i, 0] = enters(f, 0, both)
        answers[i, 1] = enters_exactly(f, 0, both, 0)
        answers[i, 2] = leaves(f, 0, both)
        answers[i, 3] = leaves_exactly(f, 0, both, 0)


def shape(kind: str, rng: random.Random, lattice: int) -> kt.Shape:
    """Return a shape of a kind, mostly on a lattice."""

    def number(low: float, high: float) -> float:
        found = rng.uniform(low, high)
        return round(found * lattice) / lattice if lattice else found

    while True:
        radius = max(number(0.1, 1.5), 0.5)
        ends = (number(-1.5, 1.5), number(-1.5, 1.5)), (number(-1.5, 1.5), number(-1.5, 1.5))
        turns = sorted(rng.uniform(0.0, 2.0 * math.pi) for _ in range(rng.choice((3, 4, 5, 6, 8))))
        corners = [(number(x, x), number(y, y)) for x, y in ((math.cos(t), math.sin(t)) for t in turns)]
        margin = radius if rng.random() < 0.3 else 0.0
        try:
            if kind == "disc":
                made = kt.disc(radius)
            elif kind == "box":
                made = kt.box(radius, max(number(0.1, 2.0), 0.5))
            elif kind == "polygon":
                made = kt.polygon(corners, margin)
            else:
                made = kt.Shape(ends, radius if kind == "capsule" else 0.0)
        except SceneError:
            continue
        if made.kind == kind:
            return made


def questions(count: int, rng: np.random.Generator, lattice: int, tick: float, numbers):
    """Return (count, 8) two plans, and (count,) ticks from the earlier anchor to the later.

    Half of them meet the outline of the difference, or nearly: at a moment now or to come, at corners or on
    faces, at a whole tick or not.
    """
    plans = rng.uniform(-1.0, 1.0, (count, 8)) * [4, 4, 1, 1, 4, 4, 1, 1]
    if lattice:
        plans = np.round(plans * lattice) / lattice
    sliding = rng.integers(6, size=count)
    for axis in (0, 1):
        plans[sliding == axis, 6 + axis] = plans[sliding == axis, 2 + axis]
    elapsed = rng.integers(0, int(4 / tick), count)
    elapsed[rng.random(count) < 0.4] = 0
    third = rng.random(count) < 0.3  # as after a contact: where it flew to until a third of a unit
    plans[third, :2] += plans[third, 2:4] * (np.floor(1.0 / (3.0 * tick)) * tick)
    aimed = np.flatnonzero(rng.random(count) < 0.5)
    corners = numbers[HEAD:].reshape(-1, WIDE)[: int(numbers[COUNT])]
    one = rng.integers(len(corners), size=len(aimed))
    part = rng.choice([0.0, 0.0, 0.5, rng.random()], len(aimed))[:, None]
    place = (1 - part) * corners[one][:, [CX, CY]] + part * corners[(one + 1) % len(corners)][:, [CX, CY]]
    turn = np.arctan2(corners[one, NY], corners[one, NX]) + rng.choice([0.0, 0.0, 0.5, -1.5], len(aimed))
    place += numbers[RADIUS] * np.stack([np.cos(turn), np.sin(turn)], 1)
    then = rng.choice([0.0, 0.0, 1.0, 0.5, 1 / 3, 2 / 3, 7 / 3], len(aimed))[:, None]
    v, v2 = plans[aimed, 2:4], plans[aimed, 6:8]
    place += rng.choice([0.0, 0.0, 1e-16, 1e-13, 1e-11], (len(aimed), 2)) * rng.normal(size=(len(aimed), 2))
    plans[aimed, 4:6] = plans[aimed, :2] + v * (elapsed[aimed, None] * tick) + place - (v2 - v) * then
    return plans, elapsed


def disagreements(kinds: tuple[str, str], count: int, seed: int = 0) -> tuple[int, int]:
    """Return how many of a number of questions about two kinds have contacts, and how many two answers."""
    rng, draw = random.Random(f"{kinds} {seed}"), np.random.default_rng(seed)
    asking = compose(ask_both, {}, "both", NoState)
    contacts = wrong = 0
    for begin in range(0, count, 1000):
        lattice, tick = rng.choice(LATTICES), rng.choice(TICKS)
        shapes = [shape(kind, rng, lattice) for kind in kinds]
        numbers = np.array(difference_row(*((each.core, each.radius) for each in shapes)))
        plans, elapsed = questions(min(1000, count - begin), draw, lattice, tick, numbers)
        answers = np.zeros((len(plans), 4), np.int64)
        asking(numbers, plans, elapsed, tick, answers)
        contacts += int((answers[:, 1] < 2**62).sum())
        wrong += int((answers[:, ::2] != answers[:, 1::2]).sum())
    return contacts, wrong


if __name__ == "__main__":  # python tests/convex_stages.py 1000000
    for pair in PAIRS:
        found, off = disagreements(pair, int(sys.argv[1]))
        print(f"{pair[0]} and {pair[1]}: {sys.argv[1]} questions, {found} contacts, {off} wrong", flush=True)
