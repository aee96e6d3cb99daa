"""What a simulation shows of itself now: who is there, where and how fast, and who is near whom."""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import numpy.typing as npt

import kinetile
from kinetile.kernel.flight import positions_now
from kinetile.kernel.tables import Kernel, read_only
from kinetile.plugin.drawing import Item
from kinetile.run.composition import Composition
from kinetile.run.engine import Engine, Given
from kinetile.run.questions.candidates import by_number, candidates, named_near
from kinetile.run.questions.drawn import drawn
from kinetile.scene import Insert, Scene
from kinetile.scene.checks import WALL, shown

if TYPE_CHECKING:
    from kinetile.show.player import View

__all__ = ["ReadsOut"]


class ReadsOut:
    """What of a simulation can be read off its tables."""

    scene: Scene
    _engine: Engine
    _given: Given
    _fault: str | None

    def _alone(self, what: str) -> AbstractContextManager[None]:
        raise NotImplementedError

    @property
    def composition(self) -> Composition:
        """The phases and their parts."""
        return self._engine.composition

    def build(self) -> None:
        """Build the broad phase's structure, where that is still to be done."""
        raise NotImplementedError

    @property
    def built(self) -> bool:
        """Whether the broad phase's structure stands: then reading it compiles and builds nothing."""
        return self._engine.built

    @property
    def fault(self) -> str | None:
        """The error with which the last run or step ended, in words; None where it ended well."""
        return self._fault

    @property
    def state(self) -> Any:
        """The broad phase's state, a NamedTuple of arrays that can only be read: its structure now."""
        self.build()
        return read_only(self._engine.state)

    @property
    def tables(self) -> Kernel:
        """The kernel's tables (``kinetile.kernel.tables``) now, to be read: bodies, certificates, queue."""
        self.build()
        return read_only(self._engine.k)

    @property
    def bodies(self) -> npt.NDArray[np.int32]:
        """The numbers of the bodies that are there now, (n,), ascending: whose the rows of ``positions``
        are."""
        engine = self._engine
        numbers: npt.NDArray[np.int32] = engine.k.queue.view(np.ndarray)["number"][engine.taken]
        return numbers

    def positions(self) -> npt.NDArray[np.float64]:
        """Return the positions now, (n, 2), in the order of ``bodies``."""
        found: npt.NDArray[np.float64] = positions_now(self._engine.k, self._engine.taken)
        return found

    def velocities(self) -> npt.NDArray[np.float64]:
        """Return the velocities now, (n, 2), in the order of ``bodies``."""
        bodies = self._engine.k.bodies.view(np.ndarray).take(self._engine.taken)
        return np.column_stack([bodies["vx"], bodies["vy"]])

    def radii(self) -> npt.NDArray[np.float64]:
        """Return the radii, (n,), in the order of ``bodies``."""
        found: npt.NDArray[np.float64] = self._engine.k.bodies.view(np.ndarray)["radius"][self._engine.taken]
        return found

    @property
    def kinds(self) -> npt.NDArray[Any]:
        """The kinds of the bodies that are there now, (n,) names or whole numbers as objects, in the order of
        ``bodies``."""
        return self.kinds_of(self.bodies)

    def kinds_of(self, bodies: npt.ArrayLike) -> npt.NDArray[Any]:
        """Return the kinds of bodies by their numbers, as an array of objects of the same shape.

        They may be there, have gone, or be still to come by the scene. "wall" stands for a number below 0, as
        column ``b`` of ``contacts`` has it. Raises IndexError for a number that no body has been given.
        """
        numbers = np.asarray(bodies)
        if numbers.dtype.kind not in "iu" and numbers.size:
            raise TypeError(f"bodies go by their numbers; found {shown(bodies)}")
        numbers = np.where(numbers < 0, -1, numbers).astype(np.int64)
        k, taken = self._engine.k, self._engine.taken
        bodies, kinds = self.bodies, np.array([*self.scene.kinds, WALL], dtype=object)
        at = np.searchsorted(bodies, numbers)
        there = np.append(bodies, -2)[at] == numbers
        which = np.full(numbers.shape, len(kinds) - 1)
        which[there] = k.traits.view(np.ndarray)["kind"][taken[at[there]]] if len(k.rules) else 0
        others = (numbers >= 0) & ~there
        if others.any():
            which[others] = self._kinds_by_number(numbers[others])
        found: npt.NDArray[Any] = kinds[which]
        return found

    def _kinds_by_number(self, numbers: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
        """Return which of the scene's kinds bodies are of that need not be there now; IndexError for a number
        that no body has been given."""
        scene, came = self.scene, self._given.inserted
        planned = [each for each in scene.commands if isinstance(each, Insert)]
        which = np.full(max(len(self._engine.k.slots), self._engine.numbers), -1, dtype=np.int64)
        which[: len(scene)] = scene.kind_numbers
        which[[each.body for each in planned]] = [
            0 if each.kind is None else scene.kinds.index(each.kind) for each in planned
        ]
        which[came[:, 0]] = came[:, 1]
        odd = numbers[(numbers >= len(which)) | (which[np.minimum(numbers, len(which) - 1)] < 0)]
        if len(odd):
            raise IndexError(f"there is no body {odd[0]}: no body has been given that number")
        return which[numbers]

    def candidate_pairs(self) -> npt.NDArray[np.int32]:
        """Return the candidate pairs now, (k, 2), a < b, sorted."""
        self.build()
        return candidates(self._engine.k, self.composition)

    def near(self) -> npt.NDArray[np.int32]:
        """Return who is near whom now: (a, b) wherever the broad phase names b as near a; (k, 2)."""
        self.build()
        return by_number(self._engine.k, named_near(self._engine.k, self.composition))

    def drawing(self) -> tuple[Item, ...]:
        """Return what there is to see of the broad phase's structure now, in the vocabulary of
        ``kinetile.plugin.drawing``; nothing where the phase draws nothing.

        Bodies go by their numbers, and ``fails`` counts ticks since the start: ``divmod(fails, 2**52)`` is
        (epoch, tick), as ``contacts`` and ``exact_time`` have them. It holds until the next event: what hangs
        on bodies moves with them. Raises PhaseError where the phase's ``draw`` is wrong, and BusyError while
        a chunk of a run is under way.
        """
        with self._alone("be drawn"):
            self.build()
            engine = self._engine
            return drawn(engine.k, self.composition, engine.clock)

    def view(self, until: float | None = None) -> View:
        """Return a page in which this run plays, from the scene's start to now, or until a time; of a run
        that has not begun, what it would do. A notebook shows it; ``save`` writes it to a file.

        The run is played again for it, commands given by hand among it, and stays as it is.
        """
        page: View = kinetile.view(cast(Any, self), until)  # made above this room: by its public name
        return page

    def _repr_html_(self) -> str:
        return kinetile.as_html(cast(Any, self))

    def _repr_svg_(self) -> str | None:
        return kinetile.as_svg(cast(Any, self))
