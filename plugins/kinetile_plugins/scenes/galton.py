"""Galton's board: balls fall among pegs, and count themselves below by the binomial law, nearly."""

import math

import numpy as np

from kinetile import Insert, Remove, Response, Scene, Settings
from kinetile_plugins.scenes.numerics import demand, demand_in_range, demand_number, draws

_PEG, _BALL = 0.15, 0.3
_ASIDE = 0.02
"""How far from the middle a ball starts at most: enough for it to fall to either side of the first peg."""

_LASTS = 4.0
"""For how long a ball is there, for each row and once more: of 10,000 at the default e all arrive."""


def galton(*, rows: int = 8, balls: int = 40, e: float = 0.42, interval: float = 2.0, seed: int = 1) -> Scene:
    """Galton's board: balls fall through rows of pegs, and each peg sends them half a place aside.

    Pegs are 1 apart, gravity is 1. A ball passes through the others, and is taken away at 4 (rows + 1) after
    it has come; a run ends with the last one. Where it first meets the floor is a sum of ``rows`` steps of
    1/2 to either side, nearly independent ones with e = 0.42 (docs/cookbook/gravity.py); with less balls
    roll, and remember from which side they came.

    Args:
        rows: of pegs, from 1 to 64
        balls: how many fall, 1 or more
        e: the share of its speed that a peg or a wall gives back, from 0 to 1
        interval: the time between two balls
        seed: of the places from which they fall
    """
    demand(1 <= rows <= 64, f"rows is {rows}; a board has from 1 to 64")
    demand_number("balls", balls, 1, "a board has 1 ball or more")
    demand(0.0 <= e <= 1.0, f"e is {e}; it is from 0 to 1")
    demand_in_range("interval", interval)
    (random,) = draws(seed, 1)
    width = rows + 3.0
    first = rows + 0.5  # a ball starts as far above the first row
    middle = 0.5 * width
    sites = [
        ((middle + 0.5 * (row % 2)) % 1.0 + at, rows - row) for row in range(rows) for at in range(rows + 3)
    ]
    pegs = [(x, y) for x, y in sites if 1.0 <= x <= width - 1.0]
    aside = _ASIDE * (2.0 * random.uniform(balls) - 1.0)
    commands: list[Insert | Remove] = []
    for ball, x in enumerate((middle + aside).tolist()):
        time = ball * interval
        until = time + _LASTS * (rows + 1)
        commands.append(Insert(time, (x, first), (0.0, 0.0), _BALL, kind="ball"))
        commands.append(Remove(len(pegs) + ball, until))
    return Scene(
        pegs,
        np.zeros((len(pegs), 2)),
        _PEG,
        math.inf,
        (width, first + 1.0),
        gravity=(0.0, -1.0),
        settings=Settings(until=until),
        commands=commands,
        kind="peg",
        responses={
            ("ball", "ball"): "pass",
            ("ball", "peg"): Response("restitution", e=e, contact_time=2.0**-6),
            ("ball", "wall"): Response("restitution", e=e, contact_time=0.5),
        },
    )
