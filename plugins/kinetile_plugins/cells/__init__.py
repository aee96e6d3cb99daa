"""Cells: a uniform grid as a kinetic data structure, with a level for each size of body where sizes differ.

The plane is divided into square cells, no narrower than the widest body. Two bodies that touch are then in
the same cell or in adjacent ones: a body is near those in its own cell and the eight around. Nothing else is
stored. The structure changes only when a body leaves its cell. The time at which its plan reaches an edge
takes one division. Then the certificate of the body fails: it moves to the next cell, and those in the
three cells beyond are newcomers.

The cell of a body depends on history, on its crossings, never on its rounded coordinates:
these are used once, when the structure is built. A body that has crossed an edge may be before it by a
rounding, or turn back at once; then its plan reaches that edge now, and it crosses again. The cells are wider
than the widest body by more than all rounding (docs/cells.md has the proof).

One grid of cells as wide as the widest body is bad if small bodies crowd around a few large ones. Then
there are levels, as in the hierarchical grids of computer graphics: the cells of a level are a power of two
times as wide as those of the level below. ``hierarchy.py`` then defines which bodies are near each other,
``layout.py`` how widths are chosen.

The cost: certificates n, one a body; a failure, O(1); candidates, those in nine cells. That is O(1) for
bodies of one size spread evenly, and at worst all of them: many in one cell, because they come together
there, because the cells are wide for one wide body among small ones, or by the option ``side``.
Then a contact costs O(n). No scene is refused, and none needs an arena.
"""

from __future__ import annotations

import math

from kinetile.errors import BadOption, Refused
from kinetile.scene import Scene
from kinetile.toolbox import BroadPhaseParts
from kinetile_plugins.cells import hierarchy, torus, uniform
from kinetile_plugins.cells.audit import audit, draw
from kinetile_plugins.cells.layout import arrange, empty, narrowest, sides_for


class Cells:
    """A uniform grid; where sizes differ much, grids of several widths.

    Args:
        side: the side of the finest cells, a length; None (default): chosen for the scene.
    """

    def __init__(self, *, side: float | None = None) -> None:
        if side is not None:
            number = isinstance(side, int | float) and not isinstance(side, bool)
            if not (number and 0.0 < side < math.inf):
                raise BadOption(f"cells have a side that is a length, above 0 and finite; side is {side!r}")
        self.side = None if side is None else float(side)

    def prepare(self, scene: Scene) -> BroadPhaseParts:
        """Returns the parts; refuses a side that is narrower than the smallest body."""
        if self.side is not None and len(scene) and self.side < (least := narrowest(scene)):
            raise Refused(
                f"cells of side {self.side!r} are narrower than the smallest body of this scene: the side "
                f"has to be at least {least!r}, or left to cells to choose"
            )
        sides = sides_for(scene, self.side)
        if scene.periodic:
            state, hooks = empty(scene, sides[-1:], torus.size), torus
        else:
            state, hooks = empty(scene, sides), uniform if len(sides) == 1 else hierarchy
        return BroadPhaseParts(
            near=hooks.near,
            state=state,
            enter=hooks.enter,
            leave=hierarchy.leave if hooks is hierarchy else uniform.leave,
            room=scene.capacity,
            build=torus.build if hooks is torus else uniform.build,
            repair=hooks.repair,
            replan=torus.watch if hooks is torus else uniform.watch,
            soon=hierarchy.soon if hooks is hierarchy else uniform.soon,
            arrange=torus.arrange if hooks is torus else arrange,
            audit=audit,
            draw=draw,
            periodic=hooks is torus,
        )
