"""Picture of a moment of a run: bodies and shapes with plain coordinates, and their looks. A body has the
colour of its kind, or in a scene without kinds of its speed; a role of the structure has a colour, layer,
width and dashes. Colour-blind people can distinguish the colours (Okabe and Ito). The same picture gives the
same bytes, as SVG (``svg``) and as PNG or PDF (``printed``)."""

import html
import math
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import product
from pathlib import PurePath
from typing import NamedTuple, cast

import numpy as np

from kinetile.arrays import Array
from kinetile.errors import legible, printable
from kinetile.kernel.clock import TICKS
from kinetile.plugin.drawing import ROLES, At, Box, Entry, Item, Link, Point, points_of, with_points
from kinetile.run.simulation import Simulation
from kinetile.scene import Scene
from kinetile.scene.bodies import in_box, whole_periods
from kinetile.scene.responses import Kind
from kinetile.scene.scene import in_words
from kinetile.scene.shapes import Shape

PAIRS_DRAWN = 400
"""The most lines between two bodies that are drawn without ``pairs``: more would cover the picture."""

WITHOUT_PAIRS = ", without pairs (--pairs)"
"""The end of the caption of a picture without lines between pairs."""

Position = tuple[float, float]


def escape(text: str) -> str:
    """Returns a text for HTML and SVG, without control characters and marks of direction (harmful there)."""
    return html.escape(legible(text))


KINDS = "#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#56B4E9"
"""The colours of kinds; the seventh kind has the first again."""

SPEEDS = "#0072B2", "#6270B4", "#8D6DAF", "#B86591", "#CD5F6D", "#D35E31", "#DC7F00", "#E69F00"
"""The colours of speeds, from rest."""

ROOM = 2.2
"""A body shows its number if it is so many times as wide as the longest number."""

FIXED = "#767676"
"""The colour of immovable bodies in a scene without kinds."""


@dataclass(frozen=True)
class PlacedDisc:
    """A body: its position, velocity, radius, colour and number; its shape, if it is no disc."""

    number: int
    at: Position
    velocity: Position
    radius: float
    shape: Shape | None = None
    colour: str = FIXED

    @property
    def outline(self) -> list[Position]:
        """The corners of its drawn shape; empty for a disc."""
        return [] if self.shape is None else outline_of(self.shape, self.at)

    @property
    def reaches(self) -> tuple[float, float, float, float]:
        """Its extents to the left, right, bottom and top of its position."""
        return (self.radius,) * 4 if self.shape is None else self.shape.reaches

    @property
    def room(self) -> float:
        """The radius that its number may use around its position; 0 for a segment along an axis."""
        return min(self.reaches)


@dataclass(frozen=True)
class Picture:
    """A moment of a run.

    Attributes:
        caption, left_out: scene, broad phase and time, in words; its end, if pairs are left out.
        low, high: corners of the view: the ``arena``, or the bounds of axis and bodies, now and at the start.
        arrow_time: the time for which a body flies the length of its arrow; 0: no body moves.
        discs: the bodies, by number; then the images of bodies that reach over a periodic border.
        shapes: the shapes that the broad phase draws, with numbers as coordinates.
        next: the first failure of a shape's certificate, in ticks since the start; None: never.
        times: the failure times of certificates, in the scene's time, by their ticks.
        colours: the legend of bodies: a word and its colour, for each kind, or for slow and fast bodies.
    """

    caption: str
    low: Position
    high: Position
    arrow_time: float
    arena: bool
    discs: tuple[PlacedDisc, ...]
    shapes: tuple[Item, ...]
    next: int | None
    times: dict[int, float]
    left_out: str = ""
    colours: tuple[tuple[str, str], ...] = ()

    @property
    def roles(self) -> list[str]:
        """The roles of its shapes, the lowest layer first."""
        return [role for role in ORDER if any(shape.role == role for shape in self.shapes)]

    @property
    def looks(self) -> "list[tuple[str, Look]]":
        """The entries of a legend with their looks: the roles, and the certificate that fails next."""
        looks = [(role, LOOKS[role]) for role in self.roles]
        return [*looks, ("fails next", NEXT_LOOK)] if self.next is not None else looks

    def is_next(self, shape: Item) -> bool:
        """Returns True if a shape has the certificate that fails first."""
        return shape.fails is not None and shape.fails == self.next

    def described(self, shape: Item) -> str:
        """Returns a shape in words: its role, its label, its failure time."""
        words = [": ".join(filter(None, (shape.role, printable(shape.label))))]
        if shape.fails is not None:
            words.append(f"fails at {self.times[shape.fails]:.6g}")
        return ", ".join(words)


def wants_pairs(pairs: bool | None, items: Iterable[Item]) -> bool:
    """Returns True if lines between two bodies are drawn; None: up to ``PAIRS_DRAWN`` lines."""
    return sum(isinstance(item, Link) for item in items) <= PAIRS_DRAWN if pairs is None else pairs


def arrow_time(discs: Sequence[PlacedDisc], start: Array) -> float:
    """Returns the time for which a body flies the length of its arrow, a round number. The fastest one of
    the ``start`` velocities has an arrow of two or three median radii, so pictures of one run share it."""
    moving = sorted((d.radius, v) for d in discs if 1e-200 < (v := math.hypot(*d.velocity)) < 1e200)
    if not moving:
        return 0.0
    radii, speeds = zip(*moving, strict=True)
    first, now = float(np.hypot(*start.T).max(initial=0.0)), max(speeds)
    return round_below(3.0 * radii[len(radii) // 2] / (first if now < 1.5 * first else now))


def round_below(value: float) -> float:
    """Returns the greatest of 1, 2 and 5 times a power of ten that is not above a positive number."""
    power = math.floor(math.log10(value))
    return max(each for each in (float(f"{k}e{power}") for k in (0.5, 1, 2, 5)) if each <= value)


def take_picture(
    sim: Simulation, roles: Collection[str] | None = None, structure: bool = True, pairs: bool | None = None
) -> Picture:
    """Returns the picture of a simulation now; with ``roles``, only shapes of these roles. Lines between
    ``pairs`` of bodies, one of them movable, are drawn up to 400 in number, or if a role is ``pair``; above
    that the caption says that they are left out. Without ``structure`` the picture has no shapes, and the
    broad phase is neither compiled nor built. Raises ValueError for an unknown role."""
    odd = sorted(set(roles or ()) - set(ROLES))
    if odd:
        raise ValueError(f"{odd[0]!r} is not a role; expected some of {', '.join(ROLES)}")
    positions = sim.positions()
    velocities = sim.velocities()
    colours = colours_of(sim.scene, sim.kinds, sim.masses(), velocities)
    discs = _discs(sim.bodies, positions, velocities, sim.radii(), sim.shapes(), colours)
    drawn = list(sim.drawing()) if structure else []
    asked = [each for each in drawn if not isinstance(each, Entry) and (roles is None or each.role in roles)]
    paired = wants_pairs(True if pairs is None and "pair" in (roles or ()) else pairs, asked)
    wanted = [item for item in asked if paired or not isinstance(item, Link)]
    left_out = WITHOUT_PAIRS if pairs is None and len(wanted) < len(asked) else ""
    places = {disc.number: disc.at for disc in discs}
    taken_off = whole_periods(sim.unwrapped() - positions, sim.scene.periods)
    turns = dict(zip(places, taken_off.tolist(), strict=True))
    shapes = tuple(shape for item in wanted for shape in _placed(item, places, turns, sim.scene))
    low, high = _extent(sim.scene, discs, shapes)
    ticks = {shape.fails for shape in shapes if shape.fails is not None}
    start, unit = Fraction(sim.scene.start), Fraction(sim.time_unit)
    times = {tick: float(start + Fraction(tick, TICKS) * unit) for tick in ticks}
    caption = f"{counted(sim.scene, len(discs))} under {sim.broad_phase} at time {sim.time:.6g}{left_out}"
    seen, arrows = (*discs, *_images(discs, sim.scene)), arrow_time(discs, sim.scene.velocity)
    view = caption, low, high, arrows, sim.scene.arena is not None
    legend = legend_of(sim.scene, velocities)
    return Picture(*view, seen, shapes, min(ticks, default=None), times, left_out, legend)


def picture_of_scene(scene: Scene) -> Picture:
    """Returns the picture of a scene at its start: its bodies and its arena, without a broad phase."""
    discs = _first_discs(scene)
    caption = f"{counted(scene, len(scene))} at time {scene.start:.6g}"
    seen, arrows = (*discs, *_images(discs, scene)), arrow_time(discs, scene.velocity)
    view = caption, *_extent(scene, discs, ()), arrows, scene.arena is not None
    return Picture(*view, seen, (), None, {}, colours=legend_of(scene, scene.velocity))


def _first_discs(scene: Scene) -> tuple[PlacedDisc, ...]:
    places = in_box(scene.position, scene.periods)
    forms = np.array([scene.shapes[each] if each >= 0 else None for each in scene.shape.tolist()])
    colours = colours_of(scene, scene.kind, scene.mass, scene.velocity)
    return _discs(np.arange(len(scene)), places, scene.velocity, scene.radius, forms, colours)


def _discs(
    numbers: Array, positions: Array, velocities: Array, radii: Array, shapes: Array, colours: list[str]
) -> tuple[PlacedDisc, ...]:
    columns = (column.tolist() for column in (numbers, positions, velocities, radii, shapes))
    return tuple(
        PlacedDisc(number, (x, y), (vx, vy), radius, shape, colour)
        for number, (x, y), (vx, vy), radius, shape, colour in zip(*columns, colours, strict=True)
    )


def pace_of(scene: Scene, velocities: Array) -> float:
    """Returns the speed of the last colour of ``SPEEDS``: 2.2 times the root mean square of movable bodies at
    the start, so that pictures of one run share it; where all start at rest, of these ``velocities``."""
    for each in (scene.velocity[np.isfinite(scene.mass)], velocities):
        size = float(np.abs(each).max(initial=0.0))
        if size > 0.0:
            return 2.2 * size * math.sqrt(float(np.square(each / size).sum()) / len(each))
    return 1.0


def legend_of(scene: Scene, velocities: Array) -> tuple[tuple[str, str], ...]:
    """Returns words for the colours of bodies: the kinds, or rest and the speed of the last colour."""
    if scene.kinds != (0,):
        return tuple((printable(str(kind)), KINDS[at % len(KINDS)]) for at, kind in enumerate(scene.kinds))
    fast = f"at speed {pace_of(scene, velocities):.2g} or more"
    return (("at rest", SPEEDS[0]), (fast, SPEEDS[-1])) if velocities.any() else ()


def colours_of(scene: Scene, kinds: Iterable[Kind], masses: Array, velocities: Array) -> list[str]:
    """Returns the colour of each body: of its kind; without kinds of its speed, or ``FIXED`` if immovable."""
    if scene.kinds != (0,):
        at = {kind: KINDS[number % len(KINDS)] for number, kind in enumerate(scene.kinds)}
        return [at[kind] for kind in kinds]
    shares = np.hypot(*(velocities / pace_of(scene, velocities)).T)
    steps = np.minimum(shares * len(SPEEDS), len(SPEEDS) - 1).astype(int)
    return [FIXED if mass == math.inf else SPEEDS[step] for step, mass in zip(steps, masses, strict=True)]


def outline_of(shape: Shape, at: Position) -> list[Position]:
    """Returns the corners of a shape at a place, anticlockwise, arcs in steps of at most 5 degrees."""
    points = []
    for k, (x, y) in enumerate(shape.core):
        (from_x, from_y), (to_x, to_y) = shape.core[k - 1], shape.core[(k + 1) % len(shape.core)]
        first, last = math.atan2(from_x - x, y - from_y), math.atan2(x - to_x, to_y - y)
        turn = (last - first) % math.tau if len(shape.core) > 1 else math.tau
        steps = math.ceil(turn / math.radians(5.0)) if shape.radius else 0
        for step in range(steps + 1):
            angle = first + (turn * step / steps if steps else 0.0)
            out_x, out_y = shape.radius * math.cos(angle), shape.radius * math.sin(angle)
            points.append((at[0] + x + out_x, at[1] + y + out_y))
    return points


def _images(discs: tuple[PlacedDisc, ...], scene: Scene) -> Iterator[PlacedDisc]:
    if not scene.periodic:
        return
    turns = [(0.0, -period, period) if period else (0.0,) for period in scene.periods]
    for disc, shift in product(discs, list(product(*turns))):
        at = disc.at[0] + shift[0], disc.at[1] + shift[1]
        seen = [-disc.radius < x < side + disc.radius for x, side in zip(at, scene.arena or at, strict=True)]
        if any(shift) and all(seen):
            yield replace(disc, at=at)


def counted(scene: Scene, count: int) -> str:
    """Returns the name of a scene, with a number of bodies."""
    name = scene.origin.get("recipe") or PurePath(scene.origin.get("file", "")).stem or "a scene"
    return f"{printable(str(name))}: {in_words(scene, count)}"


def corners_of(shape: Item) -> list[Position]:
    """Returns the corners of a shape with plain numbers, in their order; empty for a link."""
    points: tuple[Point, ...] = () if isinstance(shape, Link | Entry) else points_of(shape)
    if isinstance(shape, Box):
        (left, bottom), (right, top) = shape.low, shape.high
        points = ((left, bottom), (right, bottom), (right, top), (left, top))
    return cast("list[Position]", [*points])


def _placed(
    item: Item, places: dict[int, Position], turns: dict[int, list[float]], scene: Scene
) -> Iterator[Item]:
    """Yields all visible images of a shape; a link as a segment to the nearest image."""
    columns, moves = [], []
    axes = zip(zip(*points_of(item), strict=True), scene.periods, strict=True)
    for axis, (column, period) in enumerate(axes):
        at = [places[each.body][axis] + each.offset if isinstance(each, At) else each for each in column]
        shifts = [0.0]
        if period and all(isinstance(each, At) for each in column):
            first, *_ = hung = [each for each in column if isinstance(each, At)]
            taken_off = turns[first.body][axis]
            at = [
                x + (each.turns + turns[each.body][axis] - taken_off) * period
                for x, each in zip(at, hung, strict=True)
            ]
            if isinstance(item, Link):
                at[1] = at[0] + math.remainder(at[1] - at[0], period)
            turned = range(math.ceil(-max(at) / period), math.floor(1.0 - min(at) / period) + 1)
            shifts = [turn * period for turn in turned]
        columns.append(at)
        moves.append(shifts)
    for right, up in product(*moves):
        yield with_points(item, [(x + right, y + up) for x, y in zip(*columns, strict=True)], item.fails)


def _extent(
    scene: Scene, discs: tuple[PlacedDisc, ...], shapes: tuple[Item, ...]
) -> tuple[Position, Position]:
    if scene.arena is not None:
        return (0.0, 0.0), scene.arena
    points = [corner for shape in shapes if shape.role == "axis" for corner in corners_of(shape)]
    for disc in (*discs, *_first_discs(scene)):
        (x, y), (left, right, below, above) = disc.at, disc.reaches
        points += [(x - left, y - below), (x + right, y + above)]
    across, up = zip(*points or [(0.0, 0.0)], strict=True)
    low, high = (min(across), min(up)), (max(across), max(up))
    return (low, high) if low != high else (low, (low[0] + 1.0, low[1] + 1.0))


class Look(NamedTuple):
    """Look of a role: colour of line and filling, opacity of the filling, width and dashes of the line in
    points, whether it lies over the bodies, and the opacity of the line."""

    colour: str
    filled: float
    width: float
    dashes: tuple[float, ...] = ()
    over: bool = False
    strength: float = 1.0


LOOKS = {
    "cell": Look("#009E73", 0.10, 0.8, (4.0, 2.0)),
    "tile": Look("#56B4E9", 0.16, 0.5),
    "axis": Look("#808080", 0.0, 4.0),
    "bound": Look("#0072B2", 0.0, 1.1),
    "pair": Look("#CC79A7", 0.0, 1.4, (), True, 0.4),
    "certificate": Look("#D55E00", 0.0, 2.0, (), True),
}
"""The roles, the lowest layer first."""

ORDER = tuple(LOOKS)

NEXT_LOOK = Look("#D55E00", 0.12, 2.2)
"""The look of the next failure, of any role."""

FRESH = Look("#E69F00", 0.20, 2.2, (6.0, 3.0))
"""The look of shapes new with the last event: dashed, unlike the next failure."""


class Paper(NamedTuple):
    """Colours of a picture: the paper, what is written on it, and the edge of a body."""

    back: str
    ink: str
    edge: str


LIGHT = Paper("#ffffff", "#000000", "#404040")
DARK = Paper("#14181d", "#f0f0f0", "#c0c6cc")
