"""Cells: a uniform grid as a kinetic data structure, with a level for each size of body where sizes differ.

docs/cells.md describes the stored tables, the width of cells, and the worst cases. A body is near the bodies
in its own cell and in the eight around. The structure changes only when a body leaves its cell; one division
gives the time of its plan at an edge. ``hierarchy.py`` defines which bodies are near each other if there are
levels, as in the hierarchical grids of computer graphics; ``layout.py`` chooses widths.

The cost: n certificates, one a body; O(1) for a failure; the candidates are the bodies in nine cells: O(1)
for bodies of one size spread evenly, and at worst all bodies.

Why the candidate pairs are complete
====================================

The cell of a body depends on history, its crossings; rounded coordinates are used once, when the structure is
built. So the proof must show that a body is never far outside its cell. As in docs/one-answer.md, let X bound
all coordinates, u = 2^-53, V the speed and q the length of a tick; eta = 16 u X + 2 V q, and the skin is
delta = 4 (n + 4) 16 u X + 4 V q, more than 2 eta.

The edges do not move. Edge number e of cells of side S is the double e S, rounded once. A body leaves its
cell at this edge plus or minus the slack, rounded once more. These doubles define the edges.

At any tick whose structural events have run, a body is outside its cell by at most the slack plus 7 u X + V
q, where 7 u X + V q < eta. Consider one axis, and an edge at E, the slack added. A body flies to it at speed
v, from x at its anchor.

- The time of crossing is (E - x) / v, with two roundings, so v times this time is wrong by at most
  2 u |E - x| <= 4 u X. It is converted to ticks, exactly, and rounded down. So at the crossing the body is at
  most 4 u X past the edge and at most 4 u X + V q before it. By its plan it is never further beyond the slack
  of its cell; it is inside the next cell, by twice the slack.
- A contact or a turn gives it a new plan. Its position is rounded three times, which moves it by at most
  3 u X. If it is outside its cell and flies further out, the division gives a time before now, and it crosses
  now, before the next contact of this tick. If it flies inwards or is at rest, it keeps its home, outside.
  New plans cannot move it further out: the rounded x + v t is not less than x if v is not negative, and not
  more than x if v is not positive.
- When the structure is built, places are rounded four more times before they are rounded down to a cell.

Crossings do not repeat without end: a body that crosses an edge flies away from it, a whole cell ahead.

So bodies in cells that are not adjacent do not touch. On one axis a whole cell is between them. The distance
of its edges is S, up to 2 u X, and each body is outside its own cell by less than the slack and eta. Cells
have S - 2 slack = 2 (r + 2 delta), up to 2 u X. Here r is the largest radius that the cells were prepared
for, including bodies inserted later (else the kernel prepares again; the present bodies alone would make r
too small). The reach of a body is its radius and delta. So the gap between two reaches is at least 2 delta -
2 eta - 4 u X > 0. Hence two touching bodies are near each other, as the contract says.

With shapes r is the farthest reach of any body to any of its four sides, not the radius of the circle around
it: for a square, .71 of that radius. The proof is the same, along the axis on which the cells are not
adjacent. If a is left of b there, only the reach of a to the right and of b to the left count, and neither is
more than r and delta; likewise below and above.
"""

from kinetile.errors import BadOption, Refused
from kinetile.scene import Scene
from kinetile.scene.checks import is_finite
from kinetile.toolbox import BroadPhaseParts
from kinetile_plugins.cells import hierarchy, torus, uniform
from kinetile_plugins.cells.audit import audit, draw
from kinetile_plugins.cells.layout import arrange, empty, narrowest, sides_for


class Cells:
    """A uniform grid; if sizes differ much, grids of several widths.

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
