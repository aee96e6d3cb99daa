"""Encounters: passings as pairs with a begin, an end and a closest approach, from the rows of a run.

Between two rows of either body, the relative plan of two bodies is a polynomial of degree 1, or of degree 2
if they are accelerated. So the closest approach in such a piece is at one of its ends, or at a zero of the
derivative of the square of the distance: nothing is sampled.
"""

import math
from itertools import pairwise
from typing import Any

import numpy as np

from kinetile.arrays import Rows
from kinetile.errors import answering
from kinetile.kernel.plan import AcceleratedPlan, Plan, positions_after, velocities_after
from kinetile.records.trajectory import Trajectory, gap
from kinetile.run.flights import Flights

ENCOUNTER = np.dtype(
    [(name, "i8") for name in ("a", "b", "mx", "my")]
    + [(name, "f8") for name in ("begin", "end", "duration", "closest", "closest_time")]
)
"""A passing: its bodies, a < b; the image of b, in periods from its place without wrapping; begin, end and
duration (NaN, both: it is under way when the run ends); the smallest distance of the two places, and its
time."""


@answering
def encounters(trajectory: Trajectory) -> Rows:
    """Returns the passings of a run (dtype ``ENCOUNTER``), in the order of their begins. A distance is
    between places: for two discs, at most the sum of their radii."""
    rows, now = trajectory.rows, dict[tuple[int, int], list[_Encounter]]()
    found, places = list[_Encounter](), _Places(trajectory)
    met = np.flatnonzero((rows["b"] >= 0) & np.isnan(rows["ax"]))
    for row, a, b in zip(met.tolist(), rows["a"][met].tolist(), rows["b"][met].tolist(), strict=True):
        several = now.setdefault((min(a, b), max(a, b)), [])
        if (a > b and not several) or (a < b and several and not trajectory.scene.periodic):
            what = f"body {a} and body {b} begin or end to pass each other twice"
            raise gap(trajectory, several[0].begin if several else -1, row, what)
        if a < b:
            found.append(_Encounter(places, a, b, row, [each.image for each in several]))
            several.append(found[-1])
        else:  # two that part through one image are nearer through the others
            ended = max(several, key=lambda each: each.distance(row))
            ended.end = row
            several.remove(ended)
    return np.array([each.row for each in found], dtype=ENCOUNTER)


class _Places:
    """Places of bodies, seen from one another, and the rows that change their plans: the time of a row is
    rounded, and may be before its event."""

    def __init__(self, trajectory: Trajectory) -> None:
        self.trajectory, self.periods = trajectory, np.array(trajectory.scene.periods)
        flights = Flights.of(trajectory.rows)
        self._body, self._row = flights.body[flights.by_body], flights.row[flights.by_body]

    def changes(self, body: int, begin: int, end: int) -> list[int]:
        """Returns the rows of a body's new plans between two rows."""
        first, last = np.searchsorted(self._body, [body, body + 1])
        rows = self._row[first:last]
        return [*rows[(rows > begin) & (rows < end)].tolist()]

    def time(self, row: int) -> float:
        """Returns the time of a row; after the last one, the end of the run."""
        rows = self.trajectory.rows
        return float(rows["time"][row]) if row < len(rows) else self.trajectory.end

    def apart(self, a: int, b: int, row: int) -> Plan | AcceleratedPlan:
        """Returns the plan of b seen from a, from a row on, without the periods of periodic axes."""
        plans = self.trajectory.plans_after(row, (a, b))
        place = np.diff(plans.places + plans.images * self.periods, axis=0)[0]
        velocity = np.diff(velocities_after(plans.plan, plans.elapsed), axis=0)[0]
        return AcceleratedPlan(*place, *velocity, *np.diff(plans.acceleration, axis=0)[0])


class _Encounter:
    """Two bodies that pass, from the row ``begin`` to the row ``end``, if they part: through the nearest
    image that is not ``taken`` by another passing of the two."""

    end: int | None = None

    def __init__(self, places: _Places, a: int, b: int, begin: int, taken: list[Any]) -> None:
        self._places, self.a, self.b, self.begin = places, a, b, begin
        plan = places.apart(a, b, begin)
        ways = [
            [0] if period == 0.0 else [round(-at / period) + k for k in (-1, 0, 1)]
            for at, period in zip((plan.x, plan.y), places.periods, strict=True)
        ]
        free = [(m, n) for m in ways[0] for n in ways[1] if (m, n) not in taken]
        self.image = min(free, key=lambda image: math.hypot(*self._through(plan, image)[:2]))

    def _through(self, plan: Any, image: tuple[int, int]) -> Any:
        x, y = np.array(image) * self._places.periods
        return plan._replace(x=plan.x + x, y=plan.y + y)

    def distance(self, row: int) -> float:
        """Returns their distance right after a row."""
        return math.hypot(*self._through(self._places.apart(self.a, self.b, row), self.image)[:2])

    @property
    def row(self) -> tuple[Any, ...]:
        """Its values as a row of ``ENCOUNTER``."""
        places = self._places
        last = len(places.trajectory.rows) if self.end is None else self.end
        changes = (row for body in (self.a, self.b) for row in places.changes(body, self.begin, last))
        closest = min(self._closest(*piece) for piece in pairwise([self.begin, *sorted(changes), last]))
        begin, end = places.time(self.begin), math.nan if self.end is None else places.time(last)
        return self.a, self.b, *self.image, begin, end, end - begin, *closest

    def _closest(self, first: int, last: int) -> tuple[float, float]:
        """Returns the smallest distance between two rows, and its time."""
        begin, end = self._places.time(first), self._places.time(last)
        plan = self._through(self._places.apart(self.a, self.b, first), self.image)
        place, flies, pull = (np.array(plan[at : at + 2]) for at in (0, 2, 4))
        # Half the derivative of the square of |place + flies t + pull t^2/2|.
        derivative = [0.5 * pull @ pull, 1.5 * flies @ pull, flies @ flies + place @ pull, place @ flies]
        zeros = np.roots(np.trim_zeros(derivative, "f"))
        inner = zeros[np.isreal(zeros)].real
        after = np.array([0.0, end - begin, *inner[(inner > 0.0) & (inner < end - begin)]])
        distance = np.hypot(*positions_after(plan, after).T)
        at = int(np.argmin(distance))
        return float(distance[at]), float(begin + after[at])
