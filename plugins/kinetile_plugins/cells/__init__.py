"""Cells: a uniform grid as a kinetic data structure, with a level for each size of body where sizes differ.

docs/cells.md has what is stored, how wide cells are, and the worst cases. A body is near those in its own
cell and the eight around. The structure changes only when a body leaves its cell; the time at which its plan
reaches an edge takes one division. ``hierarchy.py`` defines which bodies are near each other where there are
levels, as in the hierarchical grids of computer graphics; ``layout.py`` how widths are chosen.

The cost: certificates n, one a body; a failure, O(1); candidates, those in nine cells: O(1) for bodies of one
size spread evenly, and at worst all of them.

Why the candidate pairs are complete
====================================

The cell of a body depends on history, its crossings; rounded coordinates are used once, when the structure is
built. So the proof must show that a body is never far outside its cell. In the terms of one answer, let X
bound all coordinates, u = 2^-53, V the speed and q a tick; eta = 16 u X + 2 V q, and the skin is delta = 4 (n
+ 4) 16 u X + 4 V q, more than 2 eta.

The edges do not move. Edge number e of cells of side S is the double e S, rounded once, and a body leaves at
that plus or minus the slack, rounded once more. These doubles define the edges.

A body is never further than the slack and 7 u X + V q, less than eta, outside its cell, at any tick whose
structural events have run. Consider one axis, and an edge at E, the slack added, that the body flies to at
speed v, from x at its anchor.

- The time of crossing is (E - x) / v, with two roundings, so that v times it is wrong by 2 u |E - x| <= 4 u
  X. It is taken as ticks, which is exact, and rounded down. So the body crosses when it is at most 4 u X past
  the edge and at most 4 u X + V q before it. That is the most by which it can be beyond the slack of its
  cell, by its plan; it is inside the next cell, by twice the slack.
- A contact or a turn gives it a new plan. Its position is rounded three times, which moves it by at most 3 u
  X. If it is outside its cell and flies further out, the division gives a time before now, and it crosses
  now, before the next contact of this tick. If it flies inwards or is at rest, it keeps its home, outside;
  new plans cannot take it further out, since x + v t is rounded to a number not less than x if v is not
  negative, and not more if it is not positive.
- When the structure is built, places are rounded four times more before they are rounded down to a cell.

Crossings do not repeat without end: a body that crosses an edge flies away from it, a whole cell ahead.

So bodies in cells that are not adjacent are apart. On one axis there is a whole cell between them, with edges
S apart up to 2 u X, and each is outside its own cell by less than the slack and eta. Cells have S - 2 slack =
2 (r + 2 delta), up to 2 u X, for the largest radius r of those that the cells were prepared for (including
bodies inserted later, or the kernel prepares again; the present bodies alone would make r too small). The
reach of a body is its radius and delta. So their gap, between their reaches, is at least 2 delta - 2 eta - 4
u X > 0. Hence two bodies that touch are near each other, as the contract demands.

With shapes r is the farthest that one of the bodies reaches to any of its four sides, not the radius of the
circle around it: .71 of that for a square. The proof is the same, along the axis on which the cells are not
adjacent. If a is left of b there, what counts is how far a reaches to the right and b to the left, and
neither is more than r and delta; likewise below and above.
"""

from kinetile.errors import BadOption, Refused
from kinetile.scene import Scene
from kinetile.scene.checks import is_finite
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
        if side is not None and not (is_finite(side) and side > 0.0):
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
            build=hooks.build,
            repair=hooks.repair,
            replan=torus.watch if hooks is torus else uniform.watch,
            soon=hierarchy.soon if hooks is hierarchy else uniform.soon,
            arrange=torus.arrange if hooks is torus else arrange,
            audit=audit,
            draw=draw,
            periodic=hooks is torus,
        )
