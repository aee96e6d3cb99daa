"""The present moment of a run, for reading: its bodies, their positions, velocities, sizes and kinds.

Observables and recorders receive it. A simulation is a moment too, with methods that change it.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from kinetile.arrays import Array, Floats, Integers, Rows
from kinetile.errors import no_attribute
from kinetile.kernel.clock import TICKS
from kinetile.kernel.flight import plans_now, positions_now, whole_pulls
from kinetile.kernel.plan import AcceleratedPlan, velocities_after
from kinetile.kernel.tables import NEGATIVE_PARTNERS
from kinetile.run.engine.engine import Engine
from kinetile.run.engine.ledger import Ledger, RowFunction
from kinetile.scene import Scene, SetKind
from kinetile.scene.bodies import in_box
from kinetile.scene.checks import WALL_KIND
from kinetile.scene.scene import kinds_inserted
from kinetile.scene.values import body_numbers


class Moment:
    """The present moment of a run of a ``scene``; its results follow the run."""

    def __init__(self, scene: Scene, engine: Engine) -> None:
        self.scene = scene
        self._engine = engine

    if not TYPE_CHECKING:  # mypy finds attributes that are not there

        def __getattr__(self, name: str) -> Any:
            raise no_attribute(self, name)

    @property
    def time(self) -> float:
        """The present time: the requested end of ``run``, or the last event's time if it stopped before."""
        return self._engine.time

    @property
    def exact_time(self) -> tuple[int, int]:
        """The present tick of the simulation, as (epoch, tick): see ``Event``."""
        return divmod(self._engine.total, TICKS)

    @property
    def time_unit(self) -> float:
        """The power of two in which ``epoch`` and ``tick`` count, in the scene's time."""
        return self._engine.clock.unit

    @property
    def bodies(self) -> npt.NDArray[np.int32]:
        """The numbers of the present bodies, (n,), ascending: the order of the rows of ``positions``."""
        engine = self._engine
        return np.asarray(engine.k.queue.view(np.ndarray)["number"][engine.taken])

    @property
    def pull(self) -> tuple[float, float]:
        """The largest accelerations so far, along x and y: of the scene (``Scene.pull``), and by hand."""
        return self._engine.scene.pull

    @property
    def numbers(self) -> int:
        """The number of body numbers that are in use, also for planned insertions."""
        return self._engine.numbers

    @property
    def newcomers(self) -> int:
        """The number of pairs that the broad phase reported as newly near at its events (``Readings``)."""
        return int(self._engine.count.newcomers[0])

    def positions(self) -> Floats:
        """Returns the positions now, (n, 2), in the order of ``bodies``; along a periodic axis from 0 to less
        than the period."""
        places = positions_now(self._engine.k, self._engine.taken)
        return in_box(places, self.scene.periods) if self.scene.periodic else places

    def unwrapped(self) -> Floats:
        """Returns the positions now, (n, 2), as if no axis were periodic: each body's first position plus its
        whole flight. In a scene without a periodic axis these are ``positions``."""
        engine = self._engine
        places = positions_now(engine.k, engine.taken)
        if self.scene.periodic:
            image = engine.k.images.view(np.ndarray)[engine.taken]
            places += np.column_stack([image["kx"], image["ky"]]) * np.array(self.scene.periods)
        return places

    def velocities(self) -> Floats:
        """Returns the velocities now, (n, 2), in the order of ``bodies``."""
        return velocities_after(*plans_now(self._engine.k, self._engine.taken))

    def accelerations(self) -> Floats:
        """Returns the accelerations, (n, 2), in the order of ``bodies``: of a held body, the rest."""
        plans = plans_now(self._engine.k, self._engine.taken)[0]
        if isinstance(plans, AcceleratedPlan):
            return np.stack([plans.ax, plans.ay], axis=-1)
        return np.zeros((len(self.bodies), 2))

    def whole_accelerations(self) -> Floats:
        """Returns the accelerations as if no body were held."""
        return whole_pulls(self._engine.k, self._engine.taken)

    def supports(self) -> list[tuple[int, ...]]:
        """Returns the supports of each body, in the order of ``bodies``: up to two numbers of bodies, or of
        walls as in column ``b`` of ``contacts``."""
        engine = self._engine
        if not self.scene.resting:
            return [()] * len(engine.taken)
        bodies = engine.k.bodies.view(np.ndarray)[engine.taken]
        number = np.append(engine.k.queue.view(np.ndarray)["number"], NEGATIVE_PARTNERS)
        held = number.take(np.stack([bodies["support"], bodies["second"]], axis=-1), mode="wrap").tolist()
        return [tuple(two[:many]) for two, many in zip(held, bodies["supports"].tolist(), strict=True)]

    def radii(self) -> Floats:
        """Returns the radii, (n,), in the order of ``bodies``."""
        return np.asarray(self._engine.k.bodies.view(np.ndarray)["radius"][self._engine.taken])

    def masses(self) -> Floats:
        """Returns the masses, (n,), in the order of ``bodies``; ``math.inf`` for immovable ones."""
        return np.asarray(self._engine.k.mass)[self._engine.taken]

    def shapes(self) -> Array:
        """Returns the shapes (``kinetile.Shape``), (n,) objects, as in ``bodies``; None for each disc."""
        engine = self._engine
        table = np.array([*engine.scene.shapes, None], dtype=object)
        if not engine.scene.shapes:
            return table.repeat(len(engine.taken))
        return np.asarray(table[engine.k.bodies.view(np.ndarray)["form"][engine.taken]])

    @property
    def kinds(self) -> Array:
        """The kinds of the present bodies, (n,) names or numbers as objects, in the order of ``bodies``."""
        return self.kinds_of(self.bodies)

    def kinds_of(self, bodies: npt.ArrayLike) -> Array:
        """Returns the kinds of bodies by their numbers, as an array of objects of the same shape: the present
        kinds of present bodies, the last kinds of removed bodies, the first kinds of bodies to be inserted;
        "wall" for a number below 0, as in column ``b`` of ``contacts``. Raises IndexError for a number that
        no body has."""
        numbers = body_numbers(bodies)
        k, taken = self._engine.k, self._engine.taken
        bodies, kinds = self.bodies, np.array([*self.scene.kinds, WALL_KIND], dtype=object)
        at = np.searchsorted(bodies, numbers)
        there = np.append(bodies, -2)[at] == numbers
        which = np.full(numbers.shape, len(kinds) - 1)
        which[there] = k.traits.view(np.ndarray)["kind"][taken[at[there]]] if len(k.rules) else 0
        others = (numbers >= 0) & ~there
        if others.any():
            which[others] = self._kinds_by_number(numbers[others])
        return np.asarray(kinds[which])

    def _kinds_by_number(self, numbers: Integers) -> Integers:
        scene, engine = self.scene, self._engine
        told, coming = engine.history.told, kinds_inserted(scene)
        came, many = np.array(told.inserted, dtype=np.int64).reshape(-1, 2).T
        which = np.full(max(len(engine.k.slots), engine.numbers), -1, dtype=np.int64)
        which[: len(scene)] = scene.kind_numbers
        which[list(coming)] = list(coming.values())
        which[engine.numbers - many.sum() : engine.numbers] = np.repeat(came, many)  # as these are numbered
        odd = numbers[(numbers >= len(which)) | (which[np.minimum(numbers, len(which) - 1)] < 0)]
        if len(odd):
            raise IndexError(f"there is no body {odd[0]}: no body has been given that number")
        which[[*told.changed]] = [*told.changed.values()]
        for each in engine.history.played(scene, engine.clock) if scene.changing else ():
            if isinstance(each, SetKind) and each.body in numbers:
                still_comes = engine.agenda.brings(engine.k, engine.clock, each.body)
                which[each.body] = which[each.body] if still_comes else scene.kinds.index(each.kind)
        return which[numbers]


@runtime_checkable
class Recorder(Protocol):
    """Receives the rows of runs, chunk by chunk, with calls at the begin and the end of each run."""

    def begin(self, moment: Moment, before: int) -> None:
        """Called when a run begins, with its moment, which follows the run, and the number of rows that the
        simulation had before the first row of this run."""

    def __call__(self, rows: Rows) -> None:
        """Receives the next rows (dtype LOG)."""

    def end(self, time: float) -> None:
        """Called when a run has ended, in whichever way, at this time: all rows up to it have been passed."""


@contextmanager
def told(recorder: Recorder | RowFunction | None, moment: Moment, ledger: Ledger) -> Iterator[None]:
    """A context of a run: calls ``begin`` and ``end`` of a recorder that has them."""
    learns = recorder if isinstance(recorder, Recorder) else None
    try:
        if learns is not None:
            learns.begin(moment, ledger.rows - ledger.rows_that_wait)
        yield
    finally:
        if learns is not None:
            learns.end(moment.time)
