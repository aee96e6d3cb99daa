"""Observables: named measurements during a run; ``kinetile.statistics`` computes averages and errors.

An observable is a class whose constructor takes its options as keyword arguments. A run calls
``prepare(scene)`` once, then ``sample`` at equal intervals of time, and ``collect`` with the contacts between
two samples, if it ``needs`` them. Stops at samples change no contact. This module reads three options of
every observable: ``every``, the interval of samples, by default a hundredth of the observed time; ``after``,
the time at which it begins; and ``series``, True to keep every sample of a number instead of averages.
"""

import copy
import math
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from kinetile.arrays import Array, Floats, Rows
from kinetile.errors import BadOption, PhaseError, Refused
from kinetile.kernel.clock import TICKS
from kinetile.kernel.log import INSERTED, TURNED
from kinetile.plugin.calling import calling, described
from kinetile.plugin.choices import read_phase
from kinetile.plugin.registry import registry
from kinetile.run.advance import End, Ended
from kinetile.run.compose import check_options
from kinetile.run.engine.engine import UNLIMITED, Engine
from kinetile.run.engine.ledger import RowFunction
from kinetile.run.flights import Flights
from kinetile.run.moment import Moment
from kinetile.run.saving.files import to_plain
from kinetile.scene import Scene
from kinetile.scene.checks import is_finite, is_number, shown
from kinetile.statistics import Blocks, Estimate, Named, Observed, Series

_INTERVALS = 100


class Collisions(NamedTuple):
    """Contacts of a part of a run, in their order; m of them.

    ``a`` and ``b`` are numbers of bodies, (m,); ``b`` below 0 is a wall (-1 left, -2 right, -3 bottom, -4
    top). The others are None unless the observable needs "velocities". ``position``, ``before`` and ``after``
    (velocities) are (m, 2, 2): for each contact a row for ``a``, and a row for ``b``, which is NaN for a
    wall. Positions are as in ``kinetile.LOG``. ``impulse``, (m, 2), is the momentum that ``b``, or the wall,
    receives: it has the direction of the normal from ``a``. If two bodies pass through each other, all of
    these are NaN.
    """

    a: Array
    b: Array
    position: Any = None
    before: Any = None
    after: Any = None
    impulse: Any = None


class Observable:
    """An observable; its constructor takes the options. A class need not inherit from this one, if it has the
    same attributes, ``needs``, ``keeps``, ``axes`` and ``broad_phase``, and methods."""

    needs: Literal["samples", "contacts", "velocities"] = "samples"
    """The calls of ``collect``: "samples": no calls; "contacts": with the bodies of each contact;
    "velocities": also with velocities and impulses, which costs more. Read after ``prepare``."""

    keeps: Sequence[str] | None = None
    """The names of the attributes that ``collect`` and ``sample`` change, for snapshots and saved runs: their
    values are numbers, text, None, arrays of numbers, and lists, tuples or dicts of these. They are set again
    after ``prepare``, and the observable continues as if it had not been stopped: so the kept values may not
    depend on the division of contacts into calls of ``collect``. None: it cannot be saved."""

    axes: Mapping[str, tuple[str, npt.ArrayLike]] = MappingProxyType({})
    """For each quantity that is an array, the name and the values of its coordinate, after the run."""

    broad_phase: str = ""
    """The broad phase whose structure it measures: under another one, its run is refused."""

    def prepare(self, scene: Scene) -> None:
        """Prepares for a scene. Raises Refused if the observable has no meaning in it."""

    def collect(self, collisions: Collisions) -> None:
        """Receives the contacts of a part of the run, after the first sample."""

    def sample(self, moment: Moment) -> Mapping[str, float | Floats]:
        """Returns the quantities of this moment, or of the time since the last sample, for averaging:
        numbers, or arrays of one dimension. NaN elements do not count."""
        raise NotImplementedError


_TIMES = ("begin", "until", "interval", "taken")


class _Observation:
    """One observable of a run, with its times and its averages."""

    def __init__(self, text: str) -> None:
        if not isinstance(text, str):
            raise BadOption(f"an observable goes by its name; found {shown(text)}")
        self.text = text.strip()
        self.name, options = read_phase(text, "observable")
        made = registry().target("observable", self.name)
        check_options("observable", self.name, made, options, ("every", "after", "series"))
        every, after = options.pop("every", None), options.pop("after", -math.inf)
        self.is_series = options.pop("series", False)
        if not isinstance(self.is_series, bool):
            raise BadOption(f"observable {text!r}: series is {self.is_series!r}; expected true or false")
        if every is not None and not (is_finite(every) and every > 0.0):
            raise BadOption(f"observable {text!r}: every is {every!r}; expected a time greater than 0")
        if not is_number(after) or math.isnan(after):
            raise BadOption(f"observable {text!r}: after is {after!r}; expected a time")
        self.every = None if every is None else float(every)
        self.after = float(after)
        with calling("observable", self.name, "its constructor"):
            self.observable: Observable = made(**options)
        self.blocks: dict[str, Blocks] = {}
        self.taken = 0

    def prepare(self, scene: Scene) -> None:
        with calling("observable", self.name, "prepare"):
            self.observable.prepare(scene)
        self.needs = getattr(self.observable, "needs", None)
        if self.needs not in ("samples", "contacts", "velocities"):
            raise PhaseError(
                f"{described('observable', self.name)}: needs is {self.needs!r}; expected 'samples', "
                "'contacts' or 'velocities'"
            )

    def plan(self, now: float, until: float | None, interval: float | None = None) -> None:
        """Sets the times of a run's samples; without an end in time, ``interval`` is the default."""
        self.begin, self.until = max(now, self.after), until
        if until is not None:
            if self.begin >= until:
                span = f"from {self.begin!r} to {until!r}"
                raise BadOption(f"observable {self.text!r}: there is no time to observe, {span}")
            interval = (until - self.begin) / _INTERVALS
        self.interval = self.every or interval or math.inf
        if self.begin + self.interval == self.begin:
            raise BadOption(f"observable {self.text!r}: an interval of {self.interval!r} is lost in rounding")

    @property
    def unsaved(self) -> str:
        """The reason why a saved run cannot hold this observable, or ""."""
        if getattr(self.observable, "keeps", None) is not None:
            return ""
        return (
            f"{described('observable', self.name)} does not list in keeps the values for a saved run, "
            "so it cannot continue from one"
        )

    @property
    def state(self) -> dict[str, Any]:
        """The state for continuing, as copies; ``kept`` is None if it cannot be saved."""
        kept = None
        if not self.unsaved:
            with calling("observable", self.name, "keeps", may_refuse=False):
                names = self.observable.keeps or ()
                kept = {name: copy.deepcopy(getattr(self.observable, name)) for name in names}
            to_plain(kept, {}, described("observable", self.name))
        times = {name: getattr(self, name) for name in _TIMES}
        return times | {"blocks": {name: each.state for name, each in self.blocks.items()}, "kept": kept}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continues from a state; BadOption if it lacks the observable's."""
        if state["kept"] is None:
            raise BadOption(f"{self.unsaved}: expected observables by their names, to observe from here on")
        for name in _TIMES:
            setattr(self, name, state[name])
        for name, each in state["blocks"].items():
            kind = Series if self.is_series and np.ndim(each[0]) == 2 else Blocks
            self.blocks[name] = kind.of(each)
        with calling("observable", self.name, "keeps", may_refuse=False):
            for name in self.observable.keeps or ():
                setattr(self.observable, name, copy.deepcopy(state["kept"][name]))

    @property
    def next_time(self) -> float:
        """The time of the next sample; infinite if it lies beyond the end of the run."""
        time = self.begin + self.taken * self.interval
        if self.until is None or time < self.until - 1e-9 * self.interval:
            return time
        # 3 * 0.1 is above 0.3: that must not lose a sample at the end.
        return self.until if time < self.until + 1e-9 * self.interval else math.inf

    def collect(self, collisions: Collisions) -> None:
        if self.taken:
            with calling("observable", self.name, "collect", may_refuse=False):
                self.observable.collect(collisions)

    def sample(self, moment: Moment) -> None:
        with calling("observable", self.name, "sample", may_refuse=False):
            values = self.observable.sample(moment)
            if not isinstance(values, Mapping):
                raise TypeError(f"it returned {shown(values)}; expected a dict of numbers by their names")
            read = {quantity: self._read(quantity, value) for quantity, value in values.items()}
        if self.is_series and read and all(value.ndim for value in read.values()):
            raise BadOption(f"observable {self.text!r}: series is of numbers, and this has curves alone")
        for quantity, value in read.items():
            if quantity not in self.blocks:
                self.blocks[quantity] = Series() if self.is_series and not value.ndim else Blocks()
            self.blocks[quantity].add(value, moment.time)
        self.taken += 1

    def _read(self, quantity: Any, value: Any) -> Floats:
        """Returns a quantity of a sample; TypeError unless it has a name and is a number, or a
        one-dimensional array of numbers whose length never changes."""
        numbers = _numbers(value, f"quantity {quantity!r}")
        if not isinstance(quantity, str):
            raise TypeError(f"quantity {quantity!r} has no name; expected a str")
        length = self.blocks[quantity].shape if quantity in self.blocks else numbers.shape
        if numbers.shape != length:
            raise TypeError(f"quantity {quantity!r} has the shape {numbers.shape}, and had {length} before")
        return numbers

    def estimates(self) -> Named[Estimate]:
        found = Named[Estimate]()
        found.reason = f"no number in {self.taken} samples, every {self.interval:g} from {self.begin:g} on"
        with calling("observable", self.name, "axes", may_refuse=False):
            axes = self.observable.axes
            for name, blocks in self.blocks.items():
                has_axis = name in axes and blocks.shape
                found[name] = blocks.estimate(*_axis(axes[name], name, blocks.shape) if has_axis else ())
        return found


def _numbers(value: Any, what: str) -> Floats:
    numbers = np.asarray(value)
    if numbers.dtype.kind not in "biuf" or numbers.ndim > 1:
        message = f"{what} is {shown(value)}"
        raise TypeError(f"{message}; expected a number, or an array of numbers with one dimension")
    return numbers.astype(np.float64)


def _axis(axis: Any, quantity: str, shape: tuple[int, ...]) -> tuple[str, Floats]:
    """Returns the name and the values of a quantity's coordinate; TypeError for anything else."""
    name, values = axis
    at = _numbers(values, f"what {quantity!r} depends on")
    if not isinstance(name, str) or at.shape != shape:
        raise TypeError(
            f"{quantity!r} depends on {shown(axis)}; expected a name, and as many values as the quantity "
            f"has: {shape[0]}"
        )
    return name, at


def check_observable(text: str, saved: bool = False) -> None:
    """Raises UnknownName, BadOption or PhaseError if a text is no observable, or it cannot be ``saved``."""
    found = _Observation(text)
    if saved and found.unsaved:
        raise BadOption(f"{found.unsaved}: expected no checkpoint, or other observables")


class Observers:
    """The observables of one run; UnknownName, BadOption, Refused or PhaseError for invalid ones."""

    def __init__(self, scene: Scene, observe: Sequence[str]) -> None:
        self._observations = [_Observation(text) for text in observe]
        names = [each.text for each in self._observations]
        for each in self._observations:
            if names.count(each.text) > 1:
                raise BadOption(f"observable {each.text!r} is there twice; expected each once")
            each.prepare(scene)
        self._first: tuple[float, int] | None = None
        self._fresh = self._running = False
        self._there: tuple[int, int] | None = None

    @classmethod
    def of(cls, state: Mapping[str, Any], scene: Scene) -> "Observers":
        """Returns the observables of a saved state."""
        observers = cls(scene, state["observe"])
        for each, its in zip(observers._observations, state["states"], strict=True):
            each.restore(its)
        observers._there, observers._first = state["there"], state["first"]
        return observers

    @property
    def state(self) -> dict[str, Any]:
        """The state for continuing, in values that a saved run can hold."""
        observed = self._observations
        return {
            "observe": [each.text for each in observed],
            "states": [each.state for each in observed],
            "there": _place(self._engine) if self._running else self._there,
            "first": self._first,
        }

    def begin(self, moment: Moment, engine: Engine, end: End) -> None:
        """Begins to observe at the present moment."""
        self._enter(moment, engine)
        self._fresh = True
        for each in self._observations:
            each.plan(moment.time, end.until)
            if each.interval == math.inf and end.contacts == UNLIMITED:
                raise BadOption(
                    f"observable {each.text!r}: how often it is sampled follows from the end of the run; "
                    f"expected until= or max_contacts=, or an interval, as in {each.name}:every=0.1"
                )
        if any(each.interval == math.inf for each in self._observations):
            # The end is a number of contacts: the time of the first hundredth is the interval of samples.
            part = max((end.contacts - engine.contacts) // _INTERVALS, 1)
            self._first = moment.time, min(engine.contacts + part, end.contacts)

    def go_on(self, moment: Moment, engine: Engine, end: End) -> None:
        """Continues to observe, to another end. Raises BadOption if an event since was not observed."""
        if self._there != _place(engine):
            raise BadOption(
                "what this simulation has observed cannot go on: it has run since without being observed, or "
                "an error came between. Expected observables by their names, to observe from here on"
            )
        self._enter(moment, engine)
        for each in self._observations:
            each.until = end.until

    def _enter(self, moment: Moment, engine: Engine) -> None:
        for each in self._observations:
            its, phase = getattr(each.observable, "broad_phase", ""), engine.composition.broad_phase
            if its not in ("", phase):
                raise Refused(
                    f"observable {each.name!r} is of the structure of broad phase {its}, and this run is "
                    f"under {phase}: run it under {its}, or leave {each.name} out"
                )
        self._moment, self._engine, self._running = moment, engine, True
        engine.ledger.complete = True

    def leave(self) -> None:
        """Notes the end of a run, unless an error lost contacts of it."""
        self._running = False
        self._there = _place(self._engine) if self._engine.ledger.complete else None

    def __len__(self) -> int:
        return len(self._observations)

    @property
    def readers(self) -> tuple[RowFunction | None, RowFunction | None]:
        """The functions that receive the short and the long rows of contacts; None if nobody needs them."""
        count = self._collecting("contacts", lambda: lambda rows: Collisions(rows["a"], rows["b"]))
        return count, self._collecting("velocities", lambda: _Plans(self._moment).collisions)

    def _collecting(
        self, needs: str, reader: Callable[[], Callable[[Rows], Collisions]]
    ) -> RowFunction | None:
        wanting = [each for each in self._observations if each.needs == needs]
        if not wanting:
            return None
        read = reader()

        def collect(rows: Rows) -> None:
            collisions = read(rows)
            for each in wanting:
                each.collect(collisions)

        return collect

    def advance(self, end: End, run_to: Callable[[End], Ended]) -> Ended:
        """Runs to an end by ``run_to``, with a stop at each sample; returns the last call's result."""
        moment, engine, observed = self._moment, self._engine, self._observations
        ended = None
        if self._first is not None:
            begin, contacts = self._first
            if engine.contacts < contacts:
                ended = run_to(end._replace(contacts=min(contacts, end.contacts)))
            interval = moment.time - begin
            spent = engine.contacts < contacts or engine.events >= end.events
            if ended is not None and (spent or ended.event):
                return ended
            if not interval:
                return run_to(end)
            self._first, self._fresh = None, True
            for each in observed:
                each.plan(moment.time, None, interval)
        while (time := min((each.next_time for each in observed), default=math.inf)) < math.inf:
            # A resumed run may have been stopped among the contacts of this time, before a sample.
            if time > moment.time or not self._fresh:
                stop = End(time, engine.clock.ticks(time), contacts=end.contacts, events=end.events)
                ended = run_to(end if time == end.until else stop)
                if not ended or engine.contacts >= end.contacts or engine.events >= end.events:
                    return ended if not ended or time == end.until else run_to(end)
            self._fresh = False
            engine.ledger.complete = False  # until all have taken their samples
            for each in observed:
                if each.next_time == time:
                    each.sample(moment)
            engine.ledger.complete = True
        return ended if ended is not None and moment.time == end.until else run_to(end)

    def results(self) -> Observed:
        """Returns the estimates so far."""
        found = Observed((each.text, each.estimates()) for each in self._observations)
        found.withhold()
        return found


def _place(engine: Engine) -> tuple[int, int]:
    return engine.total, engine.contacts


class _Plans:
    """The velocity of each body by its number, after its last row: the velocity before its next row."""

    def __init__(self, moment: Moment) -> None:
        self._moment = moment
        self._velocity, self._mass = np.zeros((0, 2)), np.zeros(0)
        self._since, self._acceleration = np.zeros((0, 2), np.int64), np.zeros((0, 2))
        self._take_in(moment.bodies)
        self._velocity[moment.bodies] = moment.velocities()
        self._since[moment.bodies] = moment.exact_time

    def _take_in(self, coming: Array) -> None:
        """Makes room for bodies, and reads the masses of all that are present."""
        present = self._moment.bodies
        more = int(max(coming.max(initial=-1), present.max(initial=-1))) + 1 - len(self._mass)
        if more > 0:
            self._mass = np.pad(self._mass, (0, more), constant_values=math.nan)
            self._velocity = np.pad(self._velocity, ((0, more), (0, 0)), constant_values=math.nan)
            self._since = np.pad(self._since, ((0, more), (0, 0)))
            self._acceleration = np.pad(self._acceleration, ((0, more), (0, 0)), constant_values=math.nan)
        self._mass[present] = self._moment.masses()
        new = np.isnan(self._acceleration[present, 0])
        self._acceleration[present[new]] = self._moment.accelerations()[new]

    def collisions(self, rows: Rows) -> Collisions:
        """Returns the contacts among the rows of a chunk, and keeps the last velocity of each body."""
        if (rows["b"] == INSERTED).any():
            self._take_in(rows["a"])
        flights, kept = Flights.of(rows), rows["b"] > TURNED
        order = flights.by_body  # each follows the flight before it
        body, flies = flights.body[order], flights.value("vx", "vy", which=order)
        first = np.append(True, body[1:] != body[:-1])[: len(body)]
        last, flew = np.roll(first, -1), np.roll(flies, 1, axis=0)
        flew[first] = self._velocity[body[first]]
        self._velocity[body[last]] = flies[last]
        if any(self._moment.pull):
            now = np.stack([rows["epoch"], rows["tick"]], axis=1)[flights.row[order]]
            since = np.roll(now, 1, axis=0)
            since[first] = self._since[body[first]]
            elapsed = (now - since) @ [TICKS, 1] * (self._moment.scene.time_unit / TICKS)
            pull = flights.accelerations(self._acceleration)[order]  # no contact changes it
            flew = flew + pull * elapsed[:, None]
            self._since[body[last]], self._acceleration[body[last]] = now[last], pull[last]
        before, after = (np.full((2 * len(rows), 2), math.nan) for _ in range(2))
        at = (2 * flights.row + flights.is_b)[order]
        before[at], after[at] = flew, flies
        before, after = before.reshape(-1, 2, 2)[kept], after.reshape(-1, 2, 2)[kept]
        bodies = np.stack([rows["a"], rows["b"]], axis=1)[kept]
        mass = self._mass[np.maximum(bodies, 0)][:, :, None]
        with np.errstate(invalid="ignore"):
            gained = mass * (after - before)  # for a wall, b has no velocity: unused
        impulse = np.where(np.isfinite(mass[:, 0]), -gained[:, 0], gained[:, 1])
        rows = rows[kept]
        position = np.stack([rows[name] for name in ("ax", "ay", "bx", "by")], axis=1).reshape(-1, 2, 2)
        return Collisions(rows["a"], rows["b"], position, before, after, impulse)
