"""Galton's board: balls fall among pegs, and their numbers below follow nearly the binomial law."""

import math

import numpy as np

from kinetile import Insert, Remove, Response, Scene, Settings
from kinetile_plugins.scenes.numerics import demand, demand_in_range, demand_number, draws

_PEG, _BALL = 0.15, 0.3
_ASIDE = 0.02
"""The largest distance of a ball's start from the middle: it may fall to either side of the first peg."""

_LASTS = 4.0
"""The time of a ball in the scene, for each row and once more: all of 10,000 at the default e arrive."""


def galton(*, rows: int = 8, balls: int = 40, e: float = 0.42, interval: float = 2.0, seed: int = 1) -> Scene:
    """Galton's board: balls fall through rows of pegs, and each peg deflects them by half a place.

    The distance of pegs is 1, and gravity is 1. A ball passes through the others, and is removed at time 4
    (rows + 1) after its insertion; a run ends with the last removal. The place of a ball's first contact with
    the floor is a sum of ``rows`` steps of 1/2 to either side, nearly independent with e = 0.42
    (docs/cookbook/gravity.py). With a smaller e balls roll, and steps depend on the side of the last one.

    Args:
        rows: of pegs, from 1 to 64
        balls: the number of balls, 1 or more
        e: the share of its speed that a peg or a wall gives back, from 0 to 1
        interval: the time between two balls
        seed: of the starting places of balls
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
