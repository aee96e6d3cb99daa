"""The hooks for one level of cells: the usual case, and the fastest."""

import math

from kinetile.toolbox import NEVER, Kernel, Records, hook, larger, prefetch, schedule, smaller, unchecked
from kinetile.toolbox.ticks import FAR
from kinetile_plugins.cells.layout import (
    BLOCK,
    PERIODIC,
    State,
    come_home,
    go_over,
    list_ahead,
    list_around,
    move_out,
    put_home,
)

FETCHED = 2
"""Bodies of a cell that are prefetched, present or not: reading their number would be a branch that is as
good as random."""


@hook
def edge(grid: Records, side: float, cell: float, speed: float) -> float:
    """Returns the coordinate at which a body leaves a column or row: beyond the edge ahead, by the slack."""
    slack = grid.slack
    return float((cell + (1.0 if speed > 0.0 else 0.0)) * side + (slack if speed > 0.0 else -slack))


@unchecked
@hook
def watch(k: Kernel, s: State, body: int) -> None:
    """Schedules the tick at which a body reaches an edge of its cell, not before now; notes the edge.

    If by its plan it is beyond the edge already, by a rounding, the tick is now. Edges that it flies away
    from, or along, do not count, whatever its coordinates are. Directions are as good as random, and a
    branch on one is mispredicted half of the time: so all cases are computed, and one is chosen.
    """
    plan = k.bodies[body]
    home = s.homes[body]
    clock = k.clock[0]
    grid = s.levels[home.level]
    x = home.x
    y = home.y
    if PERIODIC:
        x -= float(k.images[body].kx * grid.columns)
        y -= float(k.images[body].ky * grid.rows)
    right = 1 if plan.vx > 0.0 else 0
    up = 3 if plan.vy > 0.0 else 2
    across = edge(grid, grid.side, x, plan.vx) - plan.x
    along = edge(grid, grid.height if PERIODIC else grid.side, y, plan.vy) - plan.y
    across = across / plan.vx if plan.vx != 0.0 else math.inf
    along = along / plan.vy if plan.vy != 0.0 else math.inf
    if PERIODIC:
        across = across if grid.columns > 1 else math.inf
        along = along if grid.rows > 1 else math.inf
    home.way = right if across <= along else up
    ticks = larger(smaller(across, along), 0.0) * clock.per_time
    soon = ticks < FAR
    tick = larger(plan.anchor + int(ticks if soon else 0.0), clock.now)
    schedule(k, body, tick if soon else NEVER)


@unchecked
@hook
def build(k: Kernel, s: State) -> None:
    """Puts every body into its cell from ``arrange``, and watches it."""
    for body in range(k.clock[0].bodies):
        put_home(s, body)
        watch(k, s, body)


@unchecked
@hook
def near(k: Kernel, s: State, body: int) -> int:
    """Names the bodies in a body's cell and in the eight around it."""
    return list_around(k, s, 0, s.homes[body].cell, 0)


@unchecked
@hook
def repair(k: Kernel, s: State, body: int) -> int:
    """Moves a body to its next cell; names the bodies in the cells beyond that as newcomers."""
    right, up = go_over(s, body)
    watch(k, s, body)
    return int(list_ahead(k, s, 0, s.homes[body].cell, right, up, 0))


@unchecked
@hook
def enter(k: Kernel, s: State, body: int) -> None:
    """Inserts a body into its cell."""
    come_home(k, s, body, 0)
    watch(k, s, body)


@hook
def fetch_around(k: Kernel, s: State, level: int, cell: int, stage: int) -> None:
    """Prefetches the three rows of cells around one, two cache lines each; in stage 2 the bodies in them.
    Skips cells at an end of the table."""
    columns = s.levels[level].columns
    for row in range(-1, 2):
        left = cell + row * columns - 1
        if left >= 0 and left + 3 <= len(s.lists):
            if stage == 1:
                prefetch(s.blocks, left * BLOCK)
                prefetch(s.blocks, left * BLOCK + 2 * BLOCK)
            else:
                for block in range(left * BLOCK, (left + 3) * BLOCK, BLOCK):
                    for place in range(block, block + FETCHED):
                        prefetch(k.places, s.blocks[place])


@unchecked
@hook
def soon(k: Kernel, s: State, body: int, stage: int) -> None:
    """Prefetches a body's home; then the cells around it; then the bodies in them."""
    if stage == 0:
        prefetch(s.homes, body)
    else:
        fetch_around(k, s, 0, s.homes[body].cell, stage)


@unchecked
@hook
def leave(k: Kernel, s: State, body: int) -> None:
    """Removes a body from its cell."""
    move_out(s, body, s.homes[body].cell)
