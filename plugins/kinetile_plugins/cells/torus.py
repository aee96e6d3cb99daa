"""The hooks for a periodic axis: one level of cells, whose columns or rows are cyclic.

Along a periodic axis a whole number of cells fits into the period, so the width and the height of cells may
differ. A body keeps its *unwrapped* column and row: whole numbers that only a crossing changes, by one. So
the kernel may subtract a period from a place at any time: the column of the place is the unwrapped column
less ``kx`` rounds. In the table a column is at its remainder.

The neighbourhood of a cell is nine cells, or three with one column or one row. Up to three columns would all
adjoin, and a crossing between them would have no newcomers. Then the table has one column, which no body
leaves. (In a long, thin torus a body rounds the short axis thousands of times between two contacts.)

An axis that is not periodic has one more column than the arena, as in ``layout.py``: its ends do not adjoin.
"""

import math

import numpy as np

from kinetile.scene import Scene
from kinetile.toolbox import Kernel, positions_now, with_constants
from kinetile_plugins.cells import layout, uniform
from kinetile_plugins.cells.layout import State

_hooks = with_constants(
    (
        *(layout.beside, layout.list_around, layout.list_ahead, layout.put_home, layout.come_home),
        layout.go_over,
        *(uniform.watch, uniform.build, uniform.near, uniform.repair, uniform.enter),
    ),
    PERIODIC=True,
)
watch, build, near, repair, enter = (_hooks[name] for name in ("watch", "build", "near", "repair", "enter"))


def size(scene: Scene, side: float) -> tuple[int, int]:
    """Returns columns and rows of cells of about this side, in a scene with a periodic axis."""
    found = []
    for length, period in zip(scene.arena or (0.0, 0.0), scene.periods, strict=True):
        most = math.isqrt(layout.MOST * len(scene) + 9)
        cells = math.floor(length / side)
        found.append(useful(min(cells, most) if period else cells + 2))
    return found[0], found[1]


def useful(cells: int) -> int:
    """Returns the number of cells along an axis with room for ``cells``: one instead of up to three."""
    return cells if cells > 3 else 1


def arrange(k: Kernel, s: State) -> None:
    """Computes every body's present cell; sets the sides that the periods and the skin need."""
    grid, torus = s.levels[0], k.clock[0].torus
    least = float(layout.least_side(grid.widest, k.clock[0].limits.skin)) * layout.ABOVE
    wanted = max(float(grid.side), least)
    limits = k.clock[0].limits
    for name, cells, period, length in (
        ("side", "columns", float(torus.x), float(limits.width)),
        ("height", "rows", float(torus.y), float(limits.height)),
    ):
        if period:
            grid[cells] = useful(min(int(grid[cells]), math.floor(period / least)))
            grid[name] = period / int(grid[cells])
        else:
            grid[cells] = useful(min(int(grid[cells]), math.floor(length / wanted) + 2))
            grid[name] = wanted if int(grid[cells]) > 1 else max(wanted, length)
    grid.cells = grid.columns * grid.rows
    grid.slack = max(0.5 * (min(grid.side, grid.height) - least), 0.0)
    homes, images, places = s.homes[: len(k.bodies)], k.images[: len(k.bodies)], positions_now(k)
    homes.x = np.floor(places[:, 0] / grid.side) + images.kx * float(grid.columns)
    homes.y = np.floor(places[:, 1] / grid.height) + images.ky * float(grid.rows)
    layout.clear(s)
