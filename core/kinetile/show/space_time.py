"""A run in space and time: one coordinate of the bodies to the right, time upwards.

The extent of a body along the axis is a band between two lines, its *bounds*. The bands show the work of
sweep-and-prune: if two bounds cross, two entries of its sorted list change places; while two bands overlap,
the bodies are candidates along this axis. At a contact two bands have a kink. If a body is accelerated along
the axis, its parabola is drawn as ``PARTS`` straight pieces.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from kinetile.errors import BadOption
from kinetile.kernel.log import REMOVED
from kinetile.kernel.plan import AcceleratedPlan, Plan, positions_after
from kinetile.records.bounded import BoundedRows, TooManyRows
from kinetile.run.flights import Flights
from kinetile.run.simulation import Simulation
from kinetile.scene import Insert, Scene
from kinetile.show.picture import LOOKS, counted, round_below
from kinetile.show.svg import INSET, LENGTH, LINE_HEIGHT, document, number, paper_rules

MOST_PIECES = 20_000
"""The limit of pieces of bands: about 3 MB of SVG."""

PARTS = 16
"""Pieces between two events of an accelerated body."""

HEIGHT = 480.0
"""The height of the picture, in units of the file."""

LEFT_MARGIN, BELOW = 56.0, 28.0
"""The room for the names and the numbers of the axes."""


class Piece(NamedTuple):
    """A part of a body's band with one velocity: times and positions at its two ends."""

    body: int
    begin: float
    end: float
    place: float
    last: float


class Mark(NamedTuple):
    """A contact of two bodies: its time, the positions of the first and the second body, and the contact
    point between them as a part of the way: for discs by their radii, for other shapes the half."""

    time: float
    one: float
    other: float
    part: float


@dataclass(frozen=True)
class SpaceTime:
    """A run along one ``axis``, in the scene's units, from time ``begin`` to ``end`` and place ``low`` to
    ``high`` (the bounds of the arena, or of all bodies). ``period`` is the axis's; 0: it is not periodic.
    ``pieces`` are parts of the bands of bodies, ``marks`` the contacts of two bodies that change velocities,
    ``reaches`` the extents of each body below and above its position along the axis."""

    caption: str
    axis: str
    begin: float
    end: float
    low: float
    high: float
    period: float
    pieces: tuple[Piece, ...]
    marks: tuple[Mark, ...]
    reaches: tuple[tuple[float, float], ...]


def take_space_time(sim: Simulation, until: float, axis: str = "x") -> SpaceTime:
    """Continues a simulation from now to a time, and returns the run along an axis, "x" or "y". Raises
    BadOption for another axis, or for more than ``MOST_PIECES`` pieces."""
    if axis not in ("x", "y"):
        raise BadOption(f"the axis of space and time is {axis!r}; expected x or y")
    which, begin, scene = "xy".index(axis), sim.time, sim.scene
    present = sim.bodies, np.column_stack([sim.positions(), sim.velocities(), sim.accelerations()])
    going = {int(body): (begin, AcceleratedPlan(*plan.tolist())) for body, plan in zip(*present, strict=True)}
    parts = PARTS if sim.pull[which] else 1
    rows = BoundedRows(MOST_PIECES // parts, scene)
    try:
        sim.run(until, recorder=rows)
    except TooManyRows as error:
        raise BadOption(f"too many events for a picture of space and time: {error} (--until)") from error
    log, flights = rows.rows, Flights.of(rows.rows)
    pieces: list[Piece] = []

    def close(body: int, time: float) -> None:
        since, plan = going.pop(body)
        many = parts if plan[4 + which] else 1
        elapsed = np.linspace(0.0, time - since, many + 1)
        places = positions_after(plan, elapsed)[:, which].tolist()
        times = [since, *(since + elapsed[1:-1]).tolist(), time]
        pieces.extend(map(Piece, [body] * many, times, times[1:], places, places[1:]))

    before = np.zeros((1 + int(max(flights.body.max(initial=0), sim.bodies.max(initial=0))), 2))
    before[present[0]] = present[1][:, 4:]
    plans = np.column_stack([flights.value(*Plan._fields), flights.accelerations(before)])
    columns = (flights.body, log["time"][flights.row], plans)
    ends = (log["b"][flights.row] == REMOVED).tolist()
    for body, time, numbers, is_end in zip(*(c.tolist() for c in columns), ends, strict=True):
        if body in going:
            close(body, time)
        if not is_end:
            going[body] = time, AcceleratedPlan(*numbers)
    for body in sorted(going):
        close(body, sim.time)
    reaches = _reaches(scene, which, 1 + max((piece.body for piece in pieces), default=-1))
    contacts = log[(log["b"] >= 0) & ~np.isnan(log["ax"])]
    marks = tuple(_mark(row, axis, reaches, scene) for row in contacts)
    period = scene.periods[which]
    low, high = _extent(scene, which, pieces, reaches)
    when = f"time upwards from {begin:.6g} to {sim.time:.6g}"
    caption = f"{counted(scene, len(sim.bodies))}, {axis} to the right, {when}"
    return SpaceTime(caption, axis, begin, sim.time, low, high, period, tuple(pieces), marks, reaches)


def _mark(row: np.void, axis: str, reaches: tuple[tuple[float, float], ...], scene: Scene) -> Mark:
    (one, _), (other, _) = reaches[row["a"]], reaches[row["b"]]
    part = 0.5 if scene.shapes or one + other == 0.0 else one / (one + other)
    return Mark(float(row["time"]), float(row[f"a{axis}"]), float(row[f"b{axis}"]), part)


def _reaches(scene: Scene, which: int, count: int) -> tuple[tuple[float, float], ...]:
    found = {each.body: (each.radius, each.radius) for each in scene.commands if isinstance(each, Insert)}
    found |= {body: (radius, radius) for body, radius in enumerate(scene.radius.tolist())}
    for body, shape in scene.shape_of.items():
        left, right, below, above = scene.shapes[shape].reaches
        found[body] = (below, above) if which else (left, right)
    return tuple(found.get(body, (0.0, 0.0)) for body in range(count))  # unknown for interactive bodies


def _extent(
    scene: Scene, which: int, pieces: list[Piece], reaches: tuple[tuple[float, float], ...]
) -> tuple[float, float]:
    if scene.arena is not None:
        return 0.0, scene.arena[which]
    low = min((min(each.place, each.last) - reaches[each.body][0] for each in pieces), default=0.0)
    high = max((max(each.place, each.last) + reaches[each.body][1] for each in pieces), default=1.0)
    return (low, high) if low < high else (low, low + 1.0)


def space_time_svg(run: SpaceTime) -> bytes:
    """Returns a run in space and time as an SVG file, with a light and a dark colour scheme."""
    across = LENGTH / (run.high - run.low)
    up = HEIGHT / (run.end - run.begin or 1.0)

    def at(place: float, time: float) -> str:
        x, y = (INSET + LEFT_MARGIN + (place - run.low) * across, INSET + (run.end - time) * up)
        return f"{number(x)} {number(y)}"

    bands: dict[int, str] = {}
    bounds = []
    for piece in run.pieces:
        below, above = run.reaches[piece.body]
        for turn in _turns(run, piece):
            ends = (piece.place + turn, piece.begin), (piece.last + turn, piece.end)
            (first, begin), (last, end) = ends
            corners = (first - below, begin), (first + above, begin), (last + above, end), (last - below, end)
            a, b, c, d = (at(*corner) for corner in corners)
            bands[piece.body] = bands.get(piece.body, "") + f"M{a}L{b}L{c}L{d}Z"
            bounds.append(f"M{a}L{d}M{b}L{c}")
    dots = [
        f'<circle cx="{x}" cy="{y}" r="2.5"/>'
        for mark in run.marks
        for x, y in [at(_between(run, mark), mark.time).split()]
    ]
    foot, edge = INSET + HEIGHT, INSET + LEFT_MARGIN
    frame = f'x="{number(edge)}" y="{number(INSET)}" width="{number(LENGTH)}" height="{number(HEIGHT)}"'
    axes = [
        f'<text class="low" x="{number(edge + LENGTH / 2)}" y="{number(foot + 32)}">{run.axis}</text>',
        f'<text class="low" transform="rotate(-90)" x="-{number(foot / 2)}" y="{number(INSET)}">time</text>',
    ]
    for place in _round_numbers(run.low, run.high):
        x, _ = at(place, run.begin).split()
        word = f'<text class="low" x="{x}" y="{number(foot + 17)}">{place:.12g}</text>'
        axes.append(f'<path class="arena" d="M{x} {number(foot)}v5"/>{word}')
    for time in _round_numbers(run.begin, run.end):
        _, y = at(run.low, time).split()
        word = f'<text class="side" x="{number(edge - 8)}" y="{y}">{time:.12g}</text>'
        axes.append(f'<path class="arena" d="M{number(edge)} {y}h-5"/>{word}')
    body = [
        f'<clipPath id="frame"><rect {frame}/></clipPath>',
        '<g clip-path="url(#frame)">',
        *(f'<path class="band" d="{band}"/>' for band in bands.values()),
        f'<path class="bound" d="{"".join(bounds)}"/>',
        f'<g class="contact">{"".join(dots)}</g>',
        "</g>",
        f'<rect class="arena" {frame}/>',
        *axes,
    ]
    return document((LEFT_MARGIN + LENGTH, HEIGHT + BELOW), run.caption, _style(), body, _legend(), 2)


def _round_numbers(low: float, high: float) -> list[float]:
    """Returns some five to ten round numbers of an interval, for its axis."""
    step = round_below((high - low or 1.0) / 4.0)
    return [k * step for k in range(math.ceil(low / step), math.floor(high / step) + 1)]


def _turns(run: SpaceTime, piece: Piece) -> Iterator[float]:
    if not run.period:
        yield 0.0
        return
    below, above = run.reaches[piece.body]
    low, high = min(piece.place, piece.last) - below, max(piece.place, piece.last) + above
    for turn in range(int((run.low - high) // run.period), int((run.high - low) // run.period) + 1):
        if low + turn * run.period < run.high and high + turn * run.period > run.low:
            yield turn * run.period


def _between(run: SpaceTime, mark: Mark) -> float:
    """Returns the place of a contact of two bodies, through the nearest image, within the picture."""
    apart = mark.other - mark.one
    if run.period:
        apart -= run.period * round(apart / run.period)
        return (mark.one + mark.part * apart - run.low) % run.period + run.low
    return mark.one + mark.part * apart


def _legend() -> Iterator[str]:
    signs = (
        '<rect class="band" x="{x}" y="{y}" width="18" height="10"/>',
        '<path class="bound" d="M{x} {y}l18 10"/>',
        '<g class="contact"><circle cx="{x}" cy="{middle}" r="2.5"/></g>',
    )
    words = "a body", "its bounds", "a contact"
    x, down = INSET, HEIGHT + BELOW + 2 * INSET + 1.6 * LINE_HEIGHT
    for sign, word in zip(signs, words, strict=True):
        yield sign.format(x=number(x), y=number(down - 9), middle=number(down - 4))
        yield f'<text x="{number(x + 24)}" y="{number(down)}">{word}</text>'
        x += 60.0 + 6.6 * len(word)


def _style() -> str:
    bound = LOOKS["bound"]
    rules = [
        "text{font:12px system-ui,sans-serif}.arena{fill:none;stroke-width:1.5}.low{text-anchor:middle}",
        ".side{text-anchor:end;dominant-baseline:central}",
        f".band{{fill:{LOOKS['tile'].colour};fill-opacity:.22}}",
        f".bound{{fill:none;stroke:{bound.colour};stroke-width:{number(bound.width)}}}",
        f".contact{{fill:{LOOKS['certificate'].colour}}}",
    ]
    return "".join([*rules, *paper_rules()])
