"""What a simulation is asked about the present moment: the questions, in the user's terms."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from kinetile.run.questions import meetings, places, rays
from kinetile.run.questions.asking import (
    read_box,
    read_count,
    read_direction,
    read_disc,
    read_kinds,
    read_length,
    read_point,
)
from kinetile.run.questions.meetings import CastHit, NextContact
from kinetile.run.questions.moment import Moment
from kinetile.run.questions.rays import RayHit
from kinetile.scene.arrays import Numbers
from kinetile.scene.checks import WALL
from kinetile.scene.responses import Kind

__all__ = ["Questions"]

Integers = npt.NDArray[np.int64]


class Questions(ABC):
    """Questions about the present moment, for whoever knows its flight plans and how bodies are numbered.

    Asking changes nothing, and the answers are the same under every broad phase: they follow from the flight
    plans at the present tick. Nobody has to have been simulated for it. Where a question has ``kinds``, one
    of the scene's or several, bodies of other kinds are left out as if they were not there.
    """

    @abstractmethod
    def _moment(self) -> Moment:
        """Return the present moment, with the slots of all bodies in the order of their numbers."""

    @abstractmethod
    def _slot_of(self, body: int) -> int:
        """Return a body's slot; raise where there is no such body."""

    @abstractmethod
    def _bodies_of(self, slots: Integers) -> Integers:
        """Return the numbers of the bodies in slots."""

    def _planned(self) -> Mapping[int, int]:
        """Return at which kernel's tick a command changes the plan of the body in a slot, where one does."""
        return {}

    # Who will meet whom

    def next_contact(self, a: int, b: int, *, scheduled: bool = False) -> NextContact | None:
        """Return when two bodies meet by their present flight plans; None where they do not.

        Nobody else is asked, no wall and no third body: this is what happens if nobody interferes. The answer
        is the row of ``contacts`` that it will be then, to the tick. A pair that has just met does not meet
        again until one of the two has a new plan.

        Args:
            a: a body.
            b: another.
            scheduled: only if nobody is to interfere: by the present plans it is the first contact of either
                body, walls included, and no command changes one of them before.

        Raises ValueError where a and b are one body.
        """
        one, other = self._slot_of(a), self._slot_of(b)
        if one == other:
            raise ValueError(f"a contact is one of two bodies; found body {a} twice")
        return self._named(
            meetings.next_contact(
                self._moment(), one, other, scheduled, self._planned() if scheduled else None
            )
        )

    def next_contact_of(
        self, body: int, *, scheduled: bool = False, kinds: Kind | Iterable[Kind] | None = None
    ) -> NextContact | None:
        """Return the first contact of a body, with another one or a wall, by the present flight plans.

        Of contacts at one tick the first is that which the run takes first. None where there is none.

        Args:
            body: whose.
            scheduled: None as well where something comes between: an earlier contact of either body, of
                whatever kind the other one is, or a command that changes the plan of one of them.
            kinds: only with bodies of these kinds; "wall" is one of them here, for the walls.
        """
        slot = self._slot_of(body)
        planned = self._planned() if scheduled else None
        moment, among, walls = self._moment(), None, True
        if kinds is not None:
            known = (*moment.composition.prepared.kinds, WALL)
            chosen = read_kinds(kinds, known, "kinds")
            among, walls = _of_kinds(moment, chosen).slots, WALL in chosen
        return self._named(meetings.next_contact_of(moment, slot, scheduled, planned, among, walls))

    def cast(
        self, disc: Numbers, velocity: Numbers, *, kinds: Kind | Iterable[Kind] | None = None
    ) -> CastHit | None:
        """Return whom a disc that starts here and now would meet first, and when, by the present plans.

        To the tick, as if the disc were a body that nobody has met before. None where it meets nobody; walls
        are not asked. Contact is approach: a body that the disc touches or overlaps at the start is met at
        once if they approach, and not at all if they part. Of several at one tick the first by number.

        Args:
            disc: (x, y, radius); a radius of 0 is a point.
            velocity: (vx, vy).
            kinds: only bodies of these kinds.

        Raises ValueError for what is no disc, or no velocity.
        """
        centre, radius = read_disc(disc)
        hit = meetings.cast(self._among(kinds), centre, radius, read_point(velocity, "a velocity"))
        return None if hit is None else hit._replace(body=self._body_of(hit.body))

    # Who is where

    def bodies_in(
        self, box: Numbers, *, whole: bool = False, kinds: Kind | Iterable[Kind] | None = None
    ) -> Integers:
        """Return the bodies in a box now, (m,), ascending.

        A body is a disc with its edge, about its place in ``positions()``; that, its radius and the box are
        taken at their word, and compared without any rounding.

        Args:
            box: (left, bottom, right, top), edges included; a box may be a line or a point.
            whole: only bodies that are in the box as a whole, touching it from within at most. Otherwise a
                point in common is enough.
            kinds: only bodies of these kinds.

        Raises ValueError for what is no box, or one that is upside down.
        """
        return self._bodies_of(places.bodies_in(self._among(kinds), read_box(box), whole))

    def bodies_near(
        self,
        point: Numbers,
        *,
        radius: float | None = None,
        k: int | None = None,
        kinds: Kind | Iterable[Kind] | None = None,
    ) -> Integers:
        """Return the bodies near a point now, (m,), the nearest first and equally near ones by number.

        A body's distance is that of its edge: to its place in ``positions()`` less its radius, below 0 where
        the point is within. Distances are compared without any rounding.

        Args:
            point: (x, y).
            radius: all that are not further than this.
            k: not more than so many.
            kinds: only bodies of these kinds.

        Raises ValueError where neither is given, or for what is no point, no length or no number of bodies.
        """
        if radius is None and k is None:
            raise ValueError("bodies_near needs to know how far or how many: radius=, k= or both")
        centre = read_point(point, "a point")
        length = None if radius is None else read_length(radius, "radius")
        count = None if k is None else read_count(k, "k")
        return self._bodies_of(places.bodies_near(self._among(kinds), centre, length, count))

    def ray(
        self,
        origin: Numbers,
        direction: Numbers,
        *,
        most: int | None = None,
        kinds: Kind | Iterable[Kind] | None = None,
    ) -> list[RayHit]:
        """Return the bodies that a ray meets now, the nearest first and equally near ones by number.

        A body is a disc with its edge, about its place in ``positions()``: a ray that grazes it meets it, and
        one that begins in it or at its edge meets it at once. Who is met, and in which order, is decided
        without any rounding.

        Args:
            origin: (x, y), where the ray begins.
            direction: (x, y), where it leads; its length does not matter.
            most: not more hits than so many; the first alone is found soonest.
            kinds: only bodies of these kinds.

        Raises ValueError for what is no point, no direction or no number of bodies.
        """
        start, towards = read_point(origin, "an origin"), read_direction(direction)
        count = None if most is None else read_count(most, "most")
        hits = rays.ray(self._among(kinds), start, towards, count)
        return [hit._replace(body=self._body_of(hit.body)) for hit in hits]

    def _among(self, kinds: Kind | Iterable[Kind] | None) -> Moment:
        """Return the present moment, with the bodies of these kinds alone; ValueError for what is none."""
        moment = self._moment()
        if kinds is None:
            return moment
        return _of_kinds(moment, read_kinds(kinds, moment.composition.prepared.kinds, "kinds"))

    # In the user's numbers

    def _body_of(self, slot: int) -> int:
        return int(self._bodies_of(np.array([slot]))[0])

    def _named(self, found: NextContact | None) -> NextContact | None:
        """Return a contact of slots with the numbers of its bodies."""
        if found is None:
            return None
        a = self._body_of(found.a)
        b = found.b if found.b < 0 else self._body_of(found.b)
        return found._replace(a=a, b=b) if b < 0 else found._replace(a=min(a, b), b=max(a, b))


def _of_kinds(moment: Moment, kinds: Iterable[Kind]) -> Moment:
    """Return a moment with those of its bodies that are of these kinds."""
    known = moment.composition.prepared.kinds
    wanted = [number for number, kind in enumerate(known) if kind in kinds]
    if not len(moment.k.rules):  # one kind for all
        return moment if wanted else replace(moment, slots=moment.slots[:0])
    return replace(moment, slots=moment.slots[np.isin(moment.k.traits.kind[moment.slots], wanted)])
