"""Observables of power cells: free area, numbers of neighbours, and the rate of changes of neighbours.

The power of a point x over a disc of centre c and radius r is |x - c|^2 - r^2. The cell of a disc is the
region of least power over it: for equal discs the Voronoi cell, for others the cell of the radical
tessellation. Two discs are neighbours if their cells have a side in common.
"""

import math
from itertools import product
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from kinetile import Moment, Observable, Scene
from kinetile.arrays import Flags, Floats, Integers
from kinetile.errors import Refused
from kinetile_observables.geometry import axes_with_walls

_AT_ONCE, _LINES = 64, 24
"""The number of cells that are computed together, and of lines of each at first."""


class Cells(NamedTuple):
    """Cells of n discs, (n,) each: area, number of neighbours, True if a wall is one of the sides, and the
    mean of exp(6 i angle) over the directions to neighbours, 0 without neighbours."""

    area: Floats
    neighbours: Integers
    walled: Flags
    order: npt.NDArray[np.complex128]


def cells_of(scene: Scene, places: Floats, radii: Floats) -> Cells:
    """Returns the power cells of discs that do not overlap. A cell is bounded by walls, and by one line for
    each other disc and its images; lines up to the furthest corner of the cell are enough."""
    walls, sides = np.isin(["x", "y"], [*axes_with_walls(scene)]), np.array(scene.arena)
    images = np.array([*product(*((0.0,) if wall else (0.0, -1.0, 1.0) for wall in walls))]) * sides
    others, weights = (images[:, None] + places).reshape(-1, 2), np.tile(radii**2, len(images))
    ends = np.array([(-1.0, 0.0), (0.0, -1.0), (1.0, 0.0), (0.0, 1.0)])[np.tile(walls, 2)]
    w, most, n = len(ends), len(others) - 1, len(places)
    found = Cells(np.zeros(n), np.zeros(n, np.int64), np.zeros(n, bool), np.zeros(n, complex))
    lines = min(_LINES, most)
    # Discs that are computed together are close to each other, so that few others are near them.
    column, line = np.floor(places / sides * math.sqrt(n / _AT_ONCE)).T
    todo, reach = np.lexsort((column, line)), math.sqrt(max(lines, 1) * math.prod(sides) / max(n, 1)) / 2.0
    while len(todo):
        left = [todo[:0]]
        for rows in np.array_split(todo, -(-len(todo) // _AT_ONCE)):
            low, high = places[rows].min(axis=0) - reach, places[rows].max(axis=0) + reach
            some = np.flatnonzero(((others >= low) & (others <= high)).all(axis=1))
            some = some if len(some) > lines else np.arange(len(others))
            # A disc further away than reach has its line further away than this:
            beyond = (reach + (radii[rows] ** 2 - weights.max()) / reach) / 2.0
            apart = others[some] - places[rows, None]
            far = np.hypot(apart[..., 0], apart[..., 1])
            far[far == 0.0] = math.inf  # the disc itself
            away = far / 2 + (radii[rows, None] ** 2 - weights[some]) / (2.0 * far)
            near = np.argpartition(away, lines - 1)[:, :lines]
            to_walls = (ends * (sides * (ends > 0.0) - places[rows, None])).sum(axis=2)
            h = np.concatenate([to_walls, np.take_along_axis(away, near, 1)], axis=1)
            normal = np.take_along_axis(apart / far[..., None], near[..., None], 1)
            normal = np.concatenate([np.broadcast_to(ends, (len(rows), w, 2)), normal], axis=1)
            upper, lower = _pieces(h, normal[..., 0], normal[..., 1])
            length = np.maximum(upper - lower, 0.0)
            corners = np.hypot(h, np.maximum(np.abs(upper), np.abs(lower)))
            corner = np.where(length > 0.0, corners, 0.0).max(axis=1)
            side = length > 1e-9 * corner[:, None]  # four cells may share a corner, except for rounding
            found.area[rows] = (h * length).sum(axis=1) / 2
            found.neighbours[rows], found.walled[rows] = side[:, w:].sum(axis=1), side[:, :w].any(axis=1)
            turns = ((normal[:, w:, 0] + 1j * normal[:, w:, 1]) ** 6 * side[:, w:]).sum(axis=1)
            found.order[rows] = turns / np.maximum(found.neighbours[rows], 1)
            if lines < most:
                left.append(rows[corner > np.minimum(h[:, w:].max(axis=1), beyond)])
        todo, lines, reach = np.concatenate(left), min(2 * lines, most), 4.0 * reach
    return found


def _pieces(h: Floats, x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Returns the ends of the piece of each line, at h along its normal, on the near side of all others:
    upper, lower, from the foot of the normal. If the upper is not above the lower, there is no piece."""
    cos = x[:, :, None] * x[:, None] + y[:, :, None] * y[:, None]
    sin = x[:, :, None] * y[:, None] - y[:, :, None] * x[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        at = (h[:, None] - h[:, :, None] * cos) / sin
    upper = np.where(sin > 0.0, at, math.inf).min(axis=2)
    lower = np.where(sin < 0.0, at, -math.inf).max(axis=2)
    behind = ((sin == 0.0) & (cos > 0.0) & (h[:, None] < h[:, :, None])).any(axis=2)
    return np.where(behind, lower, upper), lower


class PowerCells(Observable):
    """Power cells: ``free``, the area of a cell less its disc, and its standard deviation ``free_spread``;
    for cells without a wall, the shares with 0, 1, ..., 15 ``neighbours``, and not with 6 (``defects``).
    """

    keeps = ()
    axes = {"neighbours": ("number", np.arange(16))}  # noqa: RUF012

    def prepare(self, scene: Scene) -> None:
        """Raises Refused in the open plane, and for bodies that are no discs or may overlap."""
        passes = any(response.passes for _, response in scene.responses)
        for found, what in (
            (scene.arena is None, "an arena: in the open plane cells have no end"),
            (bool(scene.shapes), "discs, and this scene has bodies of other shapes"),
            (passes, "discs that do not overlap, and in this scene some pass through each other"),
        ):
            if found:
                raise Refused(f"observable 'cells' needs {what}")

    def sample(self, moment: Moment) -> dict[str, float | Floats]:
        """Returns the averages of this moment."""
        radii = moment.radii()
        cells = cells_of(moment.scene, moment.positions(), radii)
        free, inside = cells.area - math.pi * radii**2, cells.neighbours[~cells.walled]
        found: dict[str, float | Floats] = {}
        if len(free):
            found |= {"free": float(free.mean()), "free_spread": float(free.std())}
        if len(inside):
            found["neighbours"] = np.bincount(np.minimum(inside, 15), minlength=16) / len(inside)
            found["defects"] = float((inside != 6).mean())
        return found


class Flips(Observable):
    """``flips``: changes in a unit of time: two discs become neighbours, and two others cease to be. They are
    counted in the triangulation of ``power``, with cells that do not end at the arena's walls."""

    broad_phase = "power"
    keeps = ("last",)
    last: tuple[float, int] | None = None

    def sample(self, moment: Moment) -> dict[str, float]:
        """Returns the rate since the last sample."""
        last, self.last = self.last, (moment.time, moment.newcomers)
        return {} if last is None else {"flips": (self.last[1] - last[1]) / (self.last[0] - last[0])}
