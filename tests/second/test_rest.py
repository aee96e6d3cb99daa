"""Rest: settling bodies, by hand, in both implementations of docs/specification.md, and games."""

import math
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

import by_the_rules
import games
import kinetile as kt
from judged_games import game_tables, second_list
from lanes import first

pytestmark = [pytest.mark.needs("node"), pytest.mark.small]

W = 0.125
BOX, BALL, LEVEL = kt.box(0.5, 0.5), kt.disc(0.25), kt.box(2.0, 0.5)
STRIP = 2.0**-39 * 1.25
"""The difference of a box, or a ball, and LEVEL."""

SETTLES = kt.Response("restitution", e=0.5, contact_time=2.0**-20, settle=W)
HOPS = {"contact_time": 0.25}
"""A body that is pressed with acceleration 1 parts with at least w, and comes back after this time."""
HELD = {"fixed": [(LEVEL, (1.5, 1.0), (0.0, 0.0))]}


def room(
    *movers: Any, fixed: Any = (), until: float = 8.0, contact_time: float = 2.0**-20, **more: Any
) -> kt.Scene:
    """Returns bodies of mass 1, after bodies of infinite mass, (shape, place, velocity) each, as g is 1."""
    settles = kt.Response("restitution", **{**SETTLES.options, "contact_time": contact_time})
    shapes, places, velocities = zip(*fixed, *movers, strict=True)
    return kt.Scene(
        places,
        velocities,
        shapes=[*dict.fromkeys(shapes)],
        shape=[[*dict.fromkeys(shapes)].index(each) for each in shapes],
        mass=[math.inf] * len(fixed) + [1.0] * len(movers),
        unit=1.0,
        settings=kt.Settings(until=until),
        responses={("*", "*"): settles, ("*", "wall"): settles},
        **{"arena": (4.0, 4.0), "gravity": (0.0, -1.0), **more},
    )


CASES = {
    # 1/2 above the floor: half as fast after each bounce, until it is not faster than w. Then it slides: to
    # the right wall, at once to the floor, and to the left wall, slowly, but nothing presses it on that.
    "it settles on the floor": (
        room((BALL, (2.75, 0.75), (0.25, 0.0)), until=40.0),
        [
            (1, 0, -3),
            (2, 0, -3),
            (2.5, 0, -3),
            (2.75, 0, -3),
            (4, 0, -2),
            (4, 0, -3),
            (32, 0, -1),
            (32, 0, -3),
        ],
    ),
    "it leaves a platform behind its end": (
        room((BOX, (1.5, 2.25), (0.25, 0.0)), fixed=[(LEVEL, (1.5, 1.75), (0.0, 0.0))]),
        [(0, 0, 1), (5 + 4 * STRIP + 2, 1, -3)],
    ),
    # Q is, at t after it leaves, w^2 + w t/2 - 3 t^2/16, w being the strip
    "a ball that rolls over an edge meets it": (
        room((BALL, (1.5, 1.5), (0.25, 0.0)), **HELD, **HOPS, until=4.125),
        [(0, 0, 1), (4 + 8 * STRIP, 0, 1)],
    ),
    # with -3/4 and -1/4 after that, 3/8 and -1/4, -1/4 and 3/8, 1/4 and 3/8
    "what is hit moves at once": (
        room((BALL, (1.5, 1.5), (0.0, 0.0)), (BALL, (1.5, 2.5), (0.0, 0.0)), **HELD, until=1.25),
        [(0, 0, 1), *((1, *pair) for pair in ((1, 2), (0, 1), (1, 2), (0, 1)))],
    ),
    "a turn of a platform ends it, even to no velocity": (
        room((BOX, (1.5, 1.5), (0.0, 0.0)), **HELD, commands=[kt.Turn(0, 3.0, (0.0, 0.0))]),
        [(0, 0, 1), (3, 0, 1)],
    ),
    "the removal of a platform ends it": (
        room(
            (BOX, (1.5, 0.75), (0.0, 0.0)),
            fixed=[(LEVEL, (1.5, 0.25), (0.0, 0.0))],
            commands=[kt.Remove(0, 2.0)],
            until=3.0,
        ),
        [(0, 0, 1), (3, 1, -3)],
    ),
    "a platform that is hit holds on": (
        room((BOX, (1.0, 1.5), (0.0, 0.0)), (BALL, (2.0, 2.0), (0.0, 0.0)), **HELD, until=1.25),
        [(0, 0, 1), (1, 0, 2)],
    ),
    "a moving platform holds too, and leaves what it does not grip": (
        room((BOX, (1.5, 1.5), (0.0, 0.25)), fixed=[(LEVEL, (1.5, 1.0), (0.25, 0.25))], **HOPS, until=0.75),
        [(0, 0, 1)],
    ),
    "what is pressed on a round peg hops": (
        room((BALL, (1.5, 1.5), (0.0, 0.0)), fixed=[(BALL, (1.5, 1.0), (0.0, 0.0))], **HOPS, until=0.75),
        [(0, 0, 1), (0.25, 0, 1), (0.5, 0, 1), (0.75, 0, 1)],
    ),
    "and one that rests holds another": (
        room((BOX, (1.5, 1.5), (0.0, 0.0)), (BOX, (1.5, 2.0), (0.25, 0.0)), **HELD, **HOPS, until=0.1875),
        [(0, 0, 1), (0, 1, 2)],
    ),
    "two hold what each presses on the other": (
        room(
            (BALL, (3.75, 1.5), (0.0625, 0.0)), fixed=[(LEVEL, (3.0, 1.0), (0.0, 0.0))], gravity=(0.5, -1.0)
        ),
        [(0, 1, -2), (0, 0, 1)],
    ),
    "a level platform holds beside a periodic axis": (
        room(
            (BOX, (1.5, 1.5), (1.0, 0.0)),
            fixed=[(LEVEL, (x, 1.0), (0.0, 0.0)) for x in (1.5, 3.5, 5.5, 7.5)],
            periodic="x",
            arena=(8.0, 4.0),
        ),
        [(0, 0, 4), *((t + 1.25 + STRIP, t // 2 % 4 + 1 & 3, 4) for t in (0, 2, 4, 6))],
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_by_hand(name: str, tmp_path: Path) -> None:
    scene, wanted = CASES[name]
    rows = [(math.floor(time * 2.0**52), a, b) for time, a, b in wanted]
    assert by_the_rules.answer_of_game(scene, 30) == rows
    found = second_list(game_tables(scene, tmp_path), tmp_path, 30)[0]
    assert [((epoch << 52) + tick, a, b) for epoch, tick, a, b in found] == rows


def test_a_body_may_begin_at_rest_on_a_wall_where_it_settles(tmp_path: Path) -> None:
    """Rule 2r: it is met at once, and holds it; also by the one response of its scene."""
    rule = {"response": "restitution", "options": {**SETTLES.options}}
    body = {"position": [0.75, 0.25], "velocity": [0.25, 0.0], "radius": 0.25}
    tables = {"arena": [2.0, 2.0], "gravity": [0.0, -1.0], "unit": 1.0, "until": 4.5, "bodies": [body]}
    for one in ({**rule, "between": ["*", "wall"]}, rule):
        found = second_list({**tables, "responses": [one]}, tmp_path)[0]
        assert found == [(0, 0, 0, -3), (4, 0, 0, -2), (4, 0, 0, -3)]


@pytest.mark.parametrize("seeds", first(1, [range(2), *(range(i, i + 6) for i in range(2, 122, 6))]))
def test_a_resting_game_is_one_in_both(seeds: range, tmp_path: Path) -> None:
    counts = Counter[str]()
    for seed in seeds:
        game = games.draw_resting_game(seed)
        wanted = by_the_rules.answer_of_game(game, 60, counts)
        found = second_list(game_tables(game, tmp_path), tmp_path, 60)[0]
        assert [((epoch << 52) + tick, a, b) for epoch, tick, a, b in found] == wanted, seed
    print(counts)
    assert counts["settled"] >= len(seeds)
