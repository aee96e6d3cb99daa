"""Questions about the present moment of a run: contacts to come, and positions.

A question changes nothing, and the answers are the same under every broad phase: they follow from the flight
plans at the present tick. ``kinds``, one or several of the scene's, excludes bodies of other kinds as if they
were absent.
"""

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from kinetile.arrays import Integers
from kinetile.errors import answering
from kinetile.kernel.clock import TICKS
from kinetile.kernel.images import FORESEEN
from kinetile.run import arguments
from kinetile.run.moment import Moment
from kinetile.run.questions import meetings, places
from kinetile.run.questions.meetings import CastHit, NextContact
from kinetile.run.questions.places import Query, RayHit
from kinetile.scene.bodies import Coordinates
from kinetile.scene.checks import WALL_KIND, read_count
from kinetile.scene.differences import core_difference
from kinetile.scene.responses import Kind
from kinetile.scene.shapes import Shape
from kinetile.scene.values import body_numbers

OfKinds = Kind | Iterable[Kind] | None
Placed = Coordinates | tuple[float, float, Shape]


class QueryableMoment(Moment):
    """A moment with questions."""

    @answering
    def next_contact(self, a: int, b: int, *, scheduled: bool = False) -> NextContact | None:
        """Returns the contact of two bodies by their present flight plans, as the future row of ``contacts``,
        to the tick; None if they do not meet.

        Walls and third bodies are ignored. A pair that has just met does not meet again until one of the two
        has a new plan. For two that pass through each other, the row is the end of the passing, with a > b.
        The search covers 1,024 units of the clock (``time_unit``) from the later of their last changes; if
        axes are periodic, 1,000 from now, or until a body has crossed 4,096 periods for another one.

        ``scheduled``: only without interference: by the present plans it is the first contact of both bodies,
        walls included, and no command changes one of them before. Raises ValueError if a and b are one body.
        """
        one, other = self._slot_of(a), self._slot_of(b)
        if one == other:
            raise ValueError(f"a contact is one of two bodies; found body {a} twice")
        planned = self._planned() if scheduled else None
        among = np.array([other], dtype=np.int64)
        return meetings.next_contact_of(self._query(), one, planned, among, walls=False)

    @answering
    def next_contact_of(
        self, body: int, *, scheduled: bool = False, kinds: OfKinds = None
    ) -> NextContact | None:
        """Returns the first contact of a body, with another one or a wall, by the present flight plans; None
        without one, if axes are periodic within the limit of ``next_contact``. The end of a passing is a
        contact, too. Ties are resolved as in the run.

        With ``scheduled``, also None if another event precedes it: an earlier contact of either body, with a
        body of any kind, or a command that changes the plan of one of them. ``kinds``: only with these, and
        "wall" for the walls.
        """
        slot = self._slot_of(body)
        planned = self._planned() if scheduled else None
        among, walls = self._among_and_walls(kinds)
        return meetings.next_contact_of(self._query(), slot, planned, among.slots, walls or kinds is None)

    def cast(
        self,
        body: Placed,
        velocity: Coordinates,
        *,
        acceleration: Coordinates | None = None,
        kinds: OfKinds = None,
        exclude: npt.ArrayLike = (),
    ) -> CastHit | None:
        """Returns the first hit of a cast body, which starts here and now, by the present plans.

        The hit is exact to the tick, as for a body that has not met others yet. None without a hit; walls are
        ignored, unless "wall" is one of the ``kinds``. The cast body meets at once a body that it overlaps at
        the start, or touches there if they approach, and a wall if it flies into it. If several hits share a
        tick, the first by number. The search covers the time of ``next_contact``, and all periodic images.

        Args:
            body: (x, y, radius), a disc, or (x, y, shape); a radius of 0 is a point, which passes through
                segments. If axes are periodic, it must be narrower than a period.
            velocity: (vx, vy); it may cross at most 4,096 periods in 8 units of the clock.
            acceleration: (ax, ay), 0 along periodic axes; by default gravity.
            kinds: only bodies of these kinds.
            exclude: not these bodies, by numbers, such as the body at the start of the cast.

        Raises ValueError for an invalid body or velocity.
        """
        horizon = float(FORESEEN // TICKS) * self.time_unit
        thrown = arguments.read_cast(body, velocity, acceleration, self.scene, horizon)
        query, walls = self._among_and_walls(kinds, exclude)
        hit = meetings.cast(query, *thrown, walls)
        return hit if hit is None or hit.body < 0 else hit._replace(body=self._body_of(hit.body))

    @answering
    def bodies_in(self, box: Placed | Shape, *, whole: bool = False, kinds: OfKinds = None) -> Integers:
        """Returns the bodies in a box now, (m,), ascending: all bodies with a point in common with it, or
        with ``whole`` all bodies inside of it, which may touch its edges; only of these ``kinds``.

        ``box`` is (left, bottom, right, top), edges included; it may be a line or a point. Or it is a shape,
        such as a polygon with corners in the scene's coordinates, or a shape at a place, (x, y, shape). A
        body is its outline around its position in ``positions()``. All is computed in doubles. Raises
        ValueError for an invalid box, or one that is upside down.
        """
        around, area = arguments.read_area(box)
        return self._bodies_of(places.bodies_in(self._among(kinds), around, whole, area))

    def bodies_near(
        self, point: Coordinates, *, radius: float | None = None, k: int | None = None, kinds: OfKinds = None
    ) -> Integers:
        """Returns the bodies near a point now, (m,), the nearest first and equally near ones by number: all
        within a ``radius``, at most ``k``, or both; with ``kinds`` only bodies of these kinds.

        A body's distance is the distance of its outline, below 0 if the point is inside. For a disc it is the
        distance to its place in ``positions()`` minus its radius; for another shape the distance to its core,
        or inside of the core the negated distance to the core's outline, minus its radius. All is computed in
        doubles. Raises ValueError without ``radius`` and ``k``, or for an invalid point, length or number.
        """
        if radius is None and k is None:
            raise ValueError("bodies_near needs a distance or a number: radius=, k= or both")
        centre = arguments.read_point(point, "a point")
        length = None if radius is None else arguments.read_length(radius, "radius")
        count = None if k is None else read_count(k, "k")
        return self._bodies_of(places.bodies_near(self._among(kinds), centre, length, count))

    def ray(
        self,
        origin: Coordinates,
        direction: Coordinates,
        *,
        within: float | None = None,
        most: int | None = None,
        kinds: OfKinds = None,
        exclude: npt.ArrayLike = (),
    ) -> list[RayHit]:
        """Returns the bodies that a ray meets now, the nearest first and equally near ones by number.

        A body is its outline around its position in ``positions()``: a grazing ray meets it, and a ray that
        begins in it or at its outline meets it at once. All is computed in doubles. Along a periodic axis a
        body has an image at every whole number of periods from that position; it is reported once, at the
        first image that the ray enters.

        Args:
            origin, direction: (x, y), the begin of the ray, and its direction, whose length does not matter.
            within: the largest distance of a hit, a length above 0 in the scene's unit. Needed if an axis is
                periodic; the ray may cross at most 4,096 of its periods.
            most: the largest number of hits; 1 is the fastest.
            kinds, exclude: only bodies of these kinds; not these bodies, as for ``cast``.

        Raises ValueError for invalid values, and without ``within`` if it is needed.
        """
        start, towards = arguments.read_point(origin, "an origin"), arguments.read_direction(direction)
        length = arguments.read_within(within, self.scene, towards)
        count = None if most is None else read_count(most, "most")
        hits = places.ray(self._among(kinds, exclude), start, towards, count, length)
        return [hit._replace(body=self._body_of(hit.body)) for hit in hits]

    # Within

    def _query(self) -> Query:
        engine = self._engine
        slots, shapes = engine.taken.astype(np.int64), engine.scene.shapes
        tables = engine.k, engine.packed[0]
        return Query(*tables, slots, engine.clock, engine.composition, shapes, engine.overlapping)

    def _among(self, kinds: OfKinds, exclude: npt.ArrayLike = ()) -> Query:
        return self._among_and_walls(kinds, exclude, ())[0]

    def _among_and_walls(
        self, kinds: OfKinds, exclude: npt.ArrayLike = (), more: tuple[Kind, ...] = (WALL_KIND,)
    ) -> tuple[Query, bool]:
        """Returns the bodies of some kinds, and True if "wall", which ``more`` allows, is a chosen kind."""
        query = self._query()
        if out := [self._slot_of(body) for body in body_numbers(exclude).ravel().tolist()]:
            query = replace(query, slots=query.slots[~np.isin(query.slots, out)])
        if kinds is None:
            return query, False
        known = query.composition.prepared.kinds
        chosen = arguments.read_kinds(kinds, (*known, *more), "kinds")
        wanted = [number for number, kind in enumerate(known) if kind in chosen]
        few = query.slots if wanted else query.slots[:0]
        if len(query.k.rules):  # else there is one kind for all
            few = few[np.isin(query.k.traits.kind[few], wanted)]
        return replace(query, slots=few), WALL_KIND in chosen

    def _slot_of(self, body: int) -> int:
        return int(self._engine.k.slots[arguments.read_body(self._engine, body)])

    def _bodies_of(self, slots: Integers) -> Integers:
        return np.asarray(self._engine.k.queue["number"][slots].astype(np.int64))

    def _body_of(self, slot: int) -> int:
        return int(self._bodies_of(np.array([slot]))[0])

    def _planned(self) -> Mapping[int, int]:
        engine = self._engine
        return engine.agenda.first_of_each(engine.k, engine.clock)


def distance(a: Placed, b: Placed) -> float:
    """Returns the distance of two outlines, each (x, y, radius) or (x, y, shape), in doubles: 0 if they
    touch, the negated depth if they overlap. Raises ValueError for an invalid outline."""
    (here, one), (there, other) = (arguments.read_outline(each, "an outline") for each in (a, b))
    core = np.array([core_difference(one[0], other[0])], dtype=np.float64)
    return float(places.gaps_to(core, np.array(one[1] + other[1]), np.array([there]) - here)[0])
