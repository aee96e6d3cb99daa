"""The hooks where an axis is periodic: one level of cells, whose columns or rows go round.

Along a periodic axis a whole number of cells fits into the period, so cells are wide and high as the two axes
want it. A body keeps its *unwrapped* column and row: whole numbers that only a crossing changes, by one. So
it does not matter to the cells where the kernel takes a period off a place: the column that belongs to the
place is the unwrapped one less ``kx`` rounds. In the table a column stands at its remainder.

Nine cells are around a cell, three where there is one column or one row. Up to three columns would all be
adjacent to each other, and crossing between them would bring nobody nearer: then there is one, which nobody
leaves. (In a long, thin torus a body goes round the short axis thousands of times between two contacts.)

An axis that is not periodic has a column more than the arena, as in ``layout.py``, and the ends are not
adjacent.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from kinetile.scene import Scene
from kinetile.toolbox import (
    NEVER,
    Box,
    Item,
    Kernel,
    Records,
    hook,
    larger,
    positions_now,
    schedule,
    smaller,
    unchecked,
)
from kinetile.toolbox.ticks import FAR
from kinetile_plugins.cells import layout
from kinetile_plugins.cells.audit import of_table
from kinetile_plugins.cells.layout import State, append_block, append_list, append_row, move_in, move_out

LISTED, INSIDE = layout.LISTED, layout.INSIDE

Floats = npt.NDArray[np.float64]
Whole = npt.NDArray[np.intp]


@hook
def wound(at: int, cells: int) -> int:
    """Return the place of a column or row less than a round off either end."""
    if at < 0:
        return int(at + cells)
    return int(at - cells if at >= cells else at)


@hook
def cell_at(grid: Records, x: float, y: float) -> int:
    """Return the number of the cell in an unwrapped column and row."""
    column = x - math.floor(x / grid.columns) * grid.columns
    row = y - math.floor(y / grid.rows) * grid.rows
    return int(int(column) + int(row) * grid.columns)


@hook
def delay_to(place: float, speed: float, cell: float, side: float, slack: float) -> float:
    """Return after what time a plan leaves its column, by the edge ahead and the slack beyond it."""
    if speed == 0.0:
        return math.inf
    ahead = (cell + 1.0) * side + slack if speed > 0.0 else cell * side - slack
    return float((ahead - place) / speed)


@unchecked
@hook
def watch(k: Kernel, s: State, body: int) -> None:
    """Schedule when a body reaches an edge of its cell, and note which; never before now."""
    plan = k.bodies[body]
    home = s.homes[body]
    clock = k.clock[0]
    grid = s.levels[0]
    image = k.images[body]
    column = home.x - float(image.kx * grid.columns)
    row = home.y - float(image.ky * grid.rows)
    across = delay_to(plan.x, plan.vx, column, grid.side, grid.slack) if grid.columns > 1 else math.inf
    along = delay_to(plan.y, plan.vy, row, grid.height, grid.slack) if grid.rows > 1 else math.inf
    home.way = (1 if plan.vx > 0.0 else 0) if across <= along else (3 if plan.vy > 0.0 else 2)
    ticks = larger(smaller(across, along), 0.0) * clock.per_time
    soon = ticks < FAR
    tick = larger(plan.anchor + int(ticks if soon else 0.0), clock.now)
    schedule(k, body, tick if soon else NEVER)


@unchecked
@hook
def build(k: Kernel, s: State) -> None:
    """Watch every body; ``arrange`` has put them into their cells."""
    for body in range(k.clock[0].bodies):
        watch(k, s, body)


@hook
def first_of(cells: int) -> int:
    """Return where the columns around one begin, seen from it, of so many in a round."""
    return -1 if cells > 1 else 0


@unchecked
@hook
def near(k: Kernel, s: State, body: int) -> int:
    """Name the bodies in the cell of a body and in those around it."""
    grid = s.levels[0]
    columns = grid.columns
    rows = grid.rows
    cell = s.homes[body].cell
    row = cell // columns
    column = cell - row * columns
    found = 0
    if column > 0 and column < columns - 1 and row > 0 and row < rows - 1:
        found = append_row(k, s, cell - columns - 1, 0, found)
        found = append_row(k, s, cell - 1, 0, found)
        found = append_row(k, s, cell + columns - 1, 0, found)
    else:
        for up in range(first_of(rows), smaller(2, rows)):
            for right in range(first_of(columns), smaller(2, columns)):
                there = wound(column + right, columns) + wound(row + up, rows) * columns
                found = append_block(k, s, there, 0, found)
    count = found & INSIDE
    if found >= LISTED:
        for up in range(first_of(rows), smaller(2, rows)):
            for right in range(first_of(columns), smaller(2, columns)):
                there = wound(column + right, columns) + wound(row + up, rows) * columns
                count = append_list(k, s, there, count)
    return count


@unchecked
@hook
def repair(k: Kernel, s: State, body: int) -> int:
    """A body reaches an edge of its cell: it is in the next one now, and those in the cells beyond are
    newcomers."""
    home = s.homes[body]
    grid = s.levels[0]
    columns = grid.columns
    rows = grid.rows
    step = 2 * (home.way & 1) - 1
    right = step * (1 - (home.way >> 1))
    up = step * (home.way >> 1)
    move_out(s, body, home.cell)
    home.x += right
    home.y += up
    row = home.cell // columns
    column = wound(home.cell - row * columns + right, columns)
    row = wound(row + up, rows)
    home.cell = column + row * columns
    move_in(s, body, home.cell)
    watch(k, s, body)
    count = 0
    for aside in range(
        first_of(rows if right != 0 else columns), smaller(2, rows if right != 0 else columns)
    ):
        beyond = wound(column + (right if right != 0 else aside), columns)
        beside = wound(row + (aside if right != 0 else up), rows)
        cell = beyond + beside * columns
        found = append_block(k, s, cell, count, 0)
        count += found & INSIDE
        if found >= LISTED:
            count = append_list(k, s, cell, count)
    return count


@unchecked
@hook
def enter(k: Kernel, s: State, body: int) -> None:
    """A body comes: it is at home in the cell where it stands."""
    plan = k.bodies[body]
    image = k.images[body]
    home = s.homes[body]
    grid = s.levels[0]
    home.x = math.floor(plan.x / grid.side) + float(image.kx * grid.columns)
    home.y = math.floor(plan.y / grid.height) + float(image.ky * grid.rows)
    home.cell = cell_at(grid, home.x, home.y)
    home.level = 0
    home.next = -1
    move_in(s, body, home.cell)
    watch(k, s, body)


def size(scene: Scene, side: float) -> tuple[int, int]:
    """Returns columns and rows of cells that are about so wide, in a scene with a periodic axis."""
    found = []
    for length, period in zip(scene.arena or (0.0, 0.0), scene.periods, strict=True):
        most = math.isqrt(layout.MOST * len(scene) + 9)
        cells = math.floor(length / side)
        found.append(useful(min(cells, most) if period else cells + 2))
    return found[0], found[1]


def useful(cells: int) -> int:
    """Returns the number of cells along an axis where so many would fit: one in the place of up to three."""
    return cells if cells > 3 else 1


def arrange(k: Kernel, s: State) -> None:
    """Puts every body into its present cell; cells are as wide as fits into the periods, and as the skin
    needs."""
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
    homes.cell = np.mod(homes.x, grid.columns) + np.mod(homes.y, grid.rows) * grid.columns
    layout.stand(s, homes)


def _local(k: Kernel, s: State, there: Whole) -> list[tuple[Floats, float, Floats, Floats]]:
    """Returns, for each axis, columns in the plans' frame, their width, and the plans' places and speeds."""
    grid, homes, images, bodies = s.levels[0], s.homes[there], k.images[there], k.bodies[there]
    return [
        (homes.x - images.kx * float(grid.columns), float(grid.side), bodies.x, bodies.vx),
        (homes.y - images.ky * float(grid.rows), float(grid.height), bodies.y, bodies.vy),
    ]


def audit(k: Kernel, s: State) -> Iterator[str]:
    """Yields a sentence for everything that does not hold, as ``cells.audit`` does."""
    there = np.flatnonzero(k.queue.number >= 0)
    grid, clock = s.levels[0], k.clock[0]
    least = float(layout.least_side(grid.widest, clock.limits.skin))
    for name, side, cells in (("columns", grid.side, grid.columns), ("rows", grid.height, grid.rows)):
        if cells > 3 and side < least + 2.0 * grid.slack:
            yield f"{name} are {side} wide: too narrow for a slack of {grid.slack}"
    slack = float(grid.slack) + 2.0 * float(clock.limits.skin)
    waiting = np.asarray(k.queue.own[there]) > clock.now
    delays = []
    for at, (cell, side, place, speed) in enumerate(_local(k, s, there)):
        if grid["columns" if at == 0 else "rows"] == 1:
            continue  # nobody leaves it
        now = positions_now(k)[there][:, at]
        outside = (now < cell * side - slack) | (now > (cell + 1.0) * side + slack)
        for body in np.flatnonzero(outside & waiting):
            yield f"body {there[body]} is at {'xy'[at]} = {now[body]}, outside column or row {cell[body]:.0f}"
        with np.errstate(all="ignore"):
            edge = np.where(speed > 0.0, (cell + 1.0) * side + grid.slack, cell * side - grid.slack)
            delays.append(np.where(speed != 0.0, (edge - place) / speed, np.inf))
    with np.errstate(over="ignore"):
        ticks = np.maximum(np.minimum.reduce([np.full(len(there), np.inf), *delays]), 0.0) * clock.per_time
    soon = ticks < FAR
    anchor = k.bodies.anchor[there]
    tick = np.maximum(anchor + np.where(soon, ticks, 0.0).astype(np.int64), clock.now)
    tick = np.where(soon, tick, NEVER)
    own = k.queue.own[there]
    for body in np.flatnonzero(tick != own):
        yield f"body {there[body]} reaches an edge at tick {tick[body]}, and is watched for {own[body]}"
    homes = s.homes[there]
    wanted = np.mod(homes.x, grid.columns) + np.mod(homes.y, grid.rows) * grid.columns
    for body in np.flatnonzero(homes.cell != wanted):
        yield f"body {there[body]} is in cell {homes.cell[body]}, and its column and row are another one"
    yield from of_table(s, there)


def draw(k: Kernel, s: State) -> Iterator[Item]:
    """Yields each cell with a body in it, where the arena has it, with the tick at which the first leaves."""
    fails: dict[tuple[int, int], int] = {}
    grid = s.levels[0]
    columns, side, height = int(grid.columns), float(grid.side), float(grid.height)
    for body in np.flatnonzero(k.queue.number >= 0).tolist():
        row, column = divmod(int(s.homes[body].cell), columns)
        fails[column, row] = min(int(k.queue.own[body]), fails.get((column, row), NEVER))
    for (column, row), tick in sorted(fails.items()):
        low, high = (column * side, row * height), ((column + 1) * side, (row + 1) * height)
        yield Box("cell", low, high, tick)
