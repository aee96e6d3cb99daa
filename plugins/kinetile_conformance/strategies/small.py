"""Drawn scenes of few bodies: likely failures of phases, rather than typical scenes.

With small dyadic numbers contacts, crossings and turns happen at exactly the same moment, bodies touch at the
start, graze, or move together. Wide floats, large ratios of size and places far from the origin add realism.
A body, of two or more, is drawn as a whole. Masses are equal except for large ratios of size.
"""

from typing import Any

from hypothesis import strategies as st

from kinetile import Scene, Settings, Turn
from kinetile_conformance.strategies.changes import viewed
from kinetile_conformance.strategies.strategy import Draw, drawn

Body = dict[str, Any]


FEWEST, MOST = 2, 6

SLOW = 2.0**11
"""The factor of slow scenes: between rare events, the base moves every 4,096 time units."""

speeds = st.integers(-4, 4).map(lambda i: i / 2)
untils = st.sampled_from([1.0, 2.0, 8.0, 8.0])


@st.composite
def _turns(draw: st.DrawFn, vertical: bool) -> list[tuple[float, tuple[float, float]]]:
    """Up to two turns, at moments with likely events."""
    moments = draw(st.lists(st.integers(0, 16), max_size=2, unique=True))
    return [(i / 4, (draw(speeds), draw(speeds) if vertical else 0.0)) for i in sorted(moments)]


def _body(place: Any, position: Any, velocity: Any, radius: float, turns: Any = ()) -> Body:
    return {"place": place, "position": position, "velocity": velocity, "radius": radius, "turns": turns}


@st.composite
def body_in_cell(draw: st.DrawFn, columns: int, rows: int, turns: bool) -> Body:
    """A body in a cell of a unit lattice, no larger than the cell."""
    x, y = draw(st.integers(0, columns - 1)), draw(st.integers(0, rows - 1))
    radius = draw(st.sampled_from([0.5, 0.25, 0.125]))
    aside = st.sampled_from([0.0, 0.5 - radius, radius - 0.5])
    position = x + 0.5 + draw(aside), y + 0.5 + (draw(aside) if rows > 1 else 0.0)
    velocity = draw(speeds), draw(speeds) if rows > 1 else 0.0
    return _body((x, y), position, velocity, radius, draw(_turns(rows > 1)) if turns else [])


def several(body: st.SearchStrategy[Body], most: int, least: int = FEWEST) -> st.SearchStrategy[list[Body]]:
    """Returns lists of bodies, each at another place."""
    return st.lists(body, min_size=least, max_size=most, unique_by=lambda one: one["place"])


def scene_of(
    bodies: list[Body], arena: tuple[float, float] | None, until: float, periodic: str = ""
) -> Scene:
    """Returns the scene of these bodies, and of their turns."""
    place, velocity, radius = ([b[key] for b in bodies] for key in ("position", "velocity", "radius"))
    mass = [b.get("mass", 1.0) for b in bodies]
    turns = [Turn(i, t, v) for i, b in enumerate(bodies) for t, v in b.get("turns", ())]
    more: Any = {"turns": turns, "settings": Settings(until=until)}
    return Scene(place, velocity, radius, mass, arena, periodic=periodic, **more)


@st.composite
def plane_scenes(draw: st.DrawFn, turns: bool = True) -> Scene:
    """Bodies on a small lattice in the plane, often narrow and crowded: then they all see each other. Or on
    one line: all contacts are head-on or from behind, and many come together."""
    columns, rows = draw(st.sampled_from([(2, 2), (2, 4), (4, 2), (3, 3), (4, 4), (8, 1), (8, 1)]))
    least = min(draw(st.sampled_from([FEWEST, 4])), columns * rows)
    arena = (float(columns), float(rows)) if draw(st.booleans()) else None
    return scene_of(draw(several(body_in_cell(columns, rows, turns), MOST, least)), arena, draw(untils))


@st.composite
def box_scenes(draw: st.DrawFn, turns: bool = True) -> Scene:
    """Many bodies in a small box for a long time: all meet each other, again and again."""
    columns, rows = draw(st.sampled_from([(3, 3), (2, 2), (3, 3), (4, 2), (2, 4)]))
    least = min(draw(st.sampled_from([FEWEST, 5])), columns * rows)
    bodies = draw(several(body_in_cell(columns, rows, turns), MOST, least))
    return scene_of(bodies, (float(columns), float(rows)), 8.0)


@st.composite
def _slider(draw: st.DrawFn, columns: int, rows: int, turns: bool) -> Body:
    """A body in a column of a unit lattice, mostly as wide as the column, which flies up or down in it."""
    x, y = draw(st.integers(0, columns - 1)), draw(st.integers(0, rows - 1))
    radius = draw(st.sampled_from([0.5, 0.5, 0.5, 0.25]))
    aside = draw(st.sampled_from([0.5 - radius, radius - 0.5]))
    position = x + 0.5 + aside, y + 0.5 + draw(st.sampled_from([0.0, aside]))
    velocity = draw(st.sampled_from([0.0, 0.0, 0.0, 0.5])), draw(speeds)
    return _body((x, y), position, velocity, radius, draw(_turns(True)) if turns else [])


@st.composite
def sliding_scenes(draw: st.DrawFn, turns: bool = True) -> Scene:
    """Bodies that slide past each other in columns: their order changes at equal bounds."""
    columns, rows = draw(st.sampled_from([(2, 4), (3, 3), (3, 4), (2, 6), (4, 4)]))
    bodies = draw(several(_slider(columns, rows, turns), MOST, least=3))
    return scene_of(bodies, (float(columns), rows + draw(st.sampled_from([0.0, 1.0]))), 8.0)


@st.composite
def grazing_scenes(draw: st.DrawFn) -> Scene:
    """Two bodies that pass at just about the sum of their radii, or twice two, or with a third between."""
    upright, twice = draw(st.booleans()), draw(st.booleans())
    offsets = st.sampled_from([0.0, *(sign * 2.0**-size for size in (20, 40, 52) for sign in (1, -1, -1))])
    bodies: list[Body] = []
    for low in (1.0, 3.0) if twice else (1.0,):
        speed, slower = draw(st.sampled_from([1.0, 0.5, 2.0])), draw(st.sampled_from([1.0, 0.5, 0.0]))
        bodies.append({"position": (0.5, low), "velocity": (speed, 0.0)})
        bodies.append({"position": (3.5, low + 0.5 + draw(offsets)), "velocity": (-slower, 0.0)})
    if not twice and draw(st.booleans()):
        bodies.append({"position": (2.0, 3.0), "velocity": (0.0, draw(speeds))})
    for body in bodies:
        if upright:
            for key in ("position", "velocity"):
                body[key] = (body[key][1], body[key][0])
        body["radius"] = 0.25
    return scene_of(bodies, (4.0, 4.0), 8.0)


@st.composite
def _small_body(draw: st.DrawFn, ratio: float) -> Body:
    """A body at most 1/ratio large, in a row along the bottom."""
    place = draw(st.integers(0, 7))
    velocity = draw(speeds), draw(speeds)
    return _body(place, (0.25 + place / 2, 0.5), velocity, draw(st.sampled_from([1.0 / ratio, 0.5 / ratio])))


@st.composite
def sized_scenes(draw: st.DrawFn) -> Scene:
    """One large body and some that are up to a thousand times smaller."""
    ratio = draw(st.sampled_from([4.0, 32.0, 1024.0]))
    radius = draw(st.sampled_from([1.0, 1.375]))  # with the second, cells are as wide as this one
    large = {"position": (2.0, 2.5), "velocity": (draw(speeds), draw(speeds)), "radius": radius}
    bodies: list[Body] = [large, *draw(several(_small_body(ratio), MOST - 1, least=1))]
    for body in bodies:
        body["mass"] = body["radius"] ** 2
    return scene_of(bodies, (4.0, 4.0), draw(untils))


@st.composite
def _wide_body(draw: st.DrawFn, far: float) -> Body:
    """A body anywhere in its own column that flies to about the same place as the others."""
    column = draw(st.integers(0, MOST))
    x, y = 4.0 * column + draw(st.floats(-0.9, 0.9)), draw(st.floats(-20.0, 20.0))
    moment = draw(st.floats(0.125, 4.0))
    aim = draw(st.floats(11.0, 13.0)), draw(st.floats(-1.0, 1.0))
    velocity = (aim[0] - x) / moment, (aim[1] - y) / moment
    return _body(column, (far + x, far + y), velocity, draw(st.floats(1e-3, 1.0)))


@st.composite
def wide_scenes(draw: st.DrawFn) -> Scene:
    """Bodies in the open plane, without walls, perhaps far from the origin."""
    far = draw(st.sampled_from([0.0, 0.0, 2.0**20, -(2.0**30)]))
    return scene_of(draw(several(_wide_body(far), MOST)), None, draw(untils))


def scenes(turns: bool = True) -> st.SearchStrategy[Scene]:
    """Returns the mix that the kit draws from."""
    return st.one_of(
        *[plane_scenes(turns)] * 3,
        box_scenes(turns),
        box_scenes(turns),
        sliding_scenes(turns),
        grazing_scenes(),
        sized_scenes(),
        wide_scenes(),
    )


def _small(turns: bool) -> Draw:
    """Returns a function that draws from the mix; a quarter are so slow that the base of the clock moves."""
    return drawn(lambda: st.builds(viewed, scenes(turns), slower=st.sampled_from([1.0, 1.0, 1.0, SLOW])))


DRAWS = {"small scenes": _small(False), "small scenes with turns": _small(True)}
