"""Encounters: passings as pairs with a begin, an end and a closest approach, from the rows of a run.

Between two rows of either body the relative plan of two that pass is a polynomial of degree 1, or of degree 2
where they are accelerated. So the closest approach in such a piece is at one of its ends, or where the
derivative of the square of the distance is zero: nothing is sampled.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinetile.kernel.plan import BentPlan, Plan, positions_after, velocities_after
from kinetile.records.trajectory import Trajectory
from kinetile.run.flights import Flights

ENCOUNTER = np.dtype(
    [(name, "i8") for name in ("a", "b", "mx", "my")]
    + [(name, "f8") for name in ("begin", "end", "duration", "closest", "closest_time")]
)
"""A passing: its bodies, a < b; through which image, in periods from where b is without wrapping; begin, end
and duration (NaN, both: it is under way when the run ends); the smallest distance of the places of the two,
and when that was."""

Vector = NDArray[np.float64]


def encounters(trajectory: Trajectory) -> NDArray[np.void]:
    """Returns the passings of a run (dtype ``ENCOUNTER``), in the order of their begins. A distance is that
    of places: two discs are at most the sum of their radii apart."""
    rows, now = trajectory.rows, dict[tuple[int, int], list[_Encounter]]()
    found, places = list[_Encounter](), _Places(trajectory)
    met = rows[(rows["b"] >= 0) & np.isnan(rows["ax"])]
    for a, b, time in met[["a", "b", "time"]].tolist():
        several = now.setdefault((min(a, b), max(a, b)), [])
        if a < b:
            found.append(_Encounter(places, a, b, time, [each.image for each in several]))
            several.append(found[-1])
        else:  # what parts through one image is nearer through the others
            ended = max(several, key=lambda each: each.distance(time))
            ended.end = time
            several.remove(ended)
    return np.array([each.row for each in found], dtype=ENCOUNTER)


class _Places:
    """Where bodies are, seen from one another, and when their plans change."""

    def __init__(self, trajectory: Trajectory) -> None:
        self.trajectory, self.periods = trajectory, np.array(trajectory.scene.periods)
        flights = Flights.of(trajectory.rows)
        self._body = flights.body[flights.by_body]
        self._time = trajectory.rows["time"][flights.row[flights.by_body]]

    def changes(self, body: int, begin: float, end: float) -> list[float]:
        """Returns the times of a body's new plans between two times."""
        first, last = np.searchsorted(self._body, [body, body + 1])
        times = self._time[first:last]
        return [*times[(times > begin) & (times < end)].tolist()]

    def apart(self, a: int, b: int, time: float) -> Plan | BentPlan:
        """Returns the plan of b seen from a, from a time on, without the periods of periodic axes."""
        plans = self.trajectory.flight_plans(time)
        two = np.searchsorted(plans.bodies, [a, b])
        place = np.diff(plans.places[two] + plans.images[two] * self.periods, axis=0)[0]
        velocity = np.diff(velocities_after(plans.plan, plans.elapsed)[two], axis=0)[0]
        return BentPlan(*place, *velocity, *np.diff(plans.acceleration[two], axis=0)[0])


class _Encounter:
    """Two bodies that pass, from ``begin`` on: through the nearest image through which they do not yet."""

    def __init__(self, places: _Places, a: int, b: int, begin: float, taken: list[Any]) -> None:
        self._places, self.a, self.b, self.begin, self.end = places, a, b, begin, math.nan
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

    def distance(self, time: float) -> float:
        """Returns how far they are apart at a time."""
        return math.hypot(*self._through(self._places.apart(self.a, self.b, time), self.image)[:2])

    @property
    def row(self) -> tuple[Any, ...]:
        """What ``ENCOUNTER`` has of it."""
        end = self._places.trajectory.end if math.isnan(self.end) else self.end
        changes = (time for body in (self.a, self.b) for time in self._places.changes(body, self.begin, end))
        times = [self.begin, *sorted(changes), end]
        closest = min(self._closest(*piece) for piece in pairwise(times))
        return self.a, self.b, *self.image, self.begin, self.end, self.end - self.begin, *closest

    def _closest(self, begin: float, end: float) -> tuple[float, float]:
        """Returns the smallest distance in a piece, and when it is."""
        plan = self._through(self._places.apart(self.a, self.b, begin), self.image)
        place, flies, pull = (np.array(plan[at : at + 2]) for at in (0, 2, 4))
        # Half the derivative of the square of |place + flies t + pull t^2/2|.
        derivative = [0.5 * pull @ pull, 1.5 * flies @ pull, flies @ flies + place @ pull, place @ flies]
        zeros = np.roots(np.trim_zeros(derivative, "f"))
        inner = zeros[np.isreal(zeros)].real
        after = np.array([0.0, end - begin, *inner[(inner > 0.0) & (inner < end - begin)]])
        distance = np.hypot(*positions_after(plan, after).T)
        at = int(np.argmin(distance))
        return float(distance[at]), float(begin + after[at])
