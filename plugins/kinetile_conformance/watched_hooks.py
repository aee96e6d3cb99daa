"""An interpreted run in which every hook is watched: each index that it uses, and all that it changes.

It needs a process in which hooks are plain Python: with NUMBA_DISABLE_JIT=1.

**Indices.** Compiled, an index too large is other memory; one below zero counts from the end, which in a
phase's own state is the author's business, and in the kernel's tables a mistake; code that reads eight
numbers at once (``kernel.vectors``) takes an index as it is. ``guarded`` gives views of a named tuple's
arrays that raise ``Breach`` with the array, the index, and the author's line.

**Changes.** Before and after each hook, all that it may not change is compared, byte for byte. It may change
its state, ``k.near``, and what the functions of the toolbox change for it. ``schedule`` sets a certificate:
each time it counts it, and, but for the body whose hook is running, it leaves the body among the offers to be
settled. So a certificate that differs without such an offer was written by something else.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import wraps
from inspect import currentframe, unwrap
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np

from kinetile.errors import KinetileError, Refused
from kinetile.kernel import vectors
from kinetile.kernel.log import INSERTED, REMOVED, TURNED
from kinetile.kernel.tables import column, fields_in
from kinetile.plugin.calling import NOT_AUTHORS, line_of_author, place_of
from kinetile.run.advance import End, advance
from kinetile.run.arguments import read_insertion, read_removal, read_turns
from kinetile.run.compose import Commands, Composition
from kinetile.run.engine.engine import Engine
from kinetile.scene import Scene
from kinetile.toolbox import NOBODY, BroadPhaseParts, Kernel, positions_now
from kinetile_conformance.cases import Subject, horizon

NOT_AUTHORS.add(Path(__file__).parent)

Tables = TypeVar("Tables", bound=NamedTuple)

if TYPE_CHECKING:
    _Arrays = np.ndarray[Any, Any]  # the class that _Guarded is mixed into
else:
    _Arrays = object

EIGHT_AT_ONCE = str(Path(vectors.__file__).parent)


class Breach(Exception):
    """A hook does what it must not; the message names the hook, what it touched, and where."""


def _frames_above(frame: FrameType | None) -> Iterable[tuple[str, int]]:
    while frame is not None:
        yield frame.f_code.co_filename, frame.f_lineno
        frame = frame.f_back


class _Guarded(_Arrays):
    """The methods of an array that checks every index. ``called`` is its name in messages; None: it does not
    check, being the result of a computation."""

    called: str | None
    strict: bool

    def __array_finalize__(self, made_from: Any) -> None:
        super().__array_finalize__(made_from)
        self.called, self.strict = None, False

    def __getitem__(self, index: Any) -> Any:
        called = self.called
        if called is None:
            return super().__getitem__(index)
        if not isinstance(index, int | np.integer) or not 0 <= index < self.shape[0]:
            self._check(index, currentframe())
        found = super().__getitem__(index)
        if isinstance(found, _Guarded) and isinstance(index, int | np.integer):
            found.called, found.strict = f"{called}[{index}]", self.strict
        return found

    def __iter__(self) -> Iterator[Any]:
        return (self[index] for index in range(self.shape[0]))

    def __setitem__(self, index: Any, value: Any) -> None:
        if self.called is not None:
            self._check(index, currentframe())
        super().__setitem__(index, value)

    def _check(self, index: Any, here: FrameType | None) -> None:
        """Raise Breach where an index is outside that the caller of this frame has used."""
        frame = here.f_back if here is not None else None
        raw = frame is not None and frame.f_code.co_filename.startswith(EIGHT_AT_ONCE)
        for length, each in zip(self.shape, index if isinstance(index, tuple) else (index,), strict=False):
            if isinstance(each, bool | np.bool_):
                continue
            if isinstance(each, int | np.integer):
                low = high = int(each)
            elif isinstance(each, slice) and raw:
                low, high = int(each.start), int(each.stop) - 1
            elif isinstance(each, list) or (isinstance(each, np.ndarray) and each.dtype.kind in "iu"):
                many = np.asarray(each).ravel().tolist()
                low, high = min(many, default=0), max(many, default=-1)
            else:
                continue  # a slice is cut to the array's length, compiled too; NumPy raises for the rest
            if high >= length:
                self._breach(high, length, frame)
            if low < (0 if raw or self.strict else -length):
                self._breach(low, length, frame)

    def _breach(self, index: int, length: int, frame: FrameType | None) -> None:
        side = f"and it has {length}" if index >= 0 else "which is before its beginning"
        where = line_of_author(_frames_above(frame))
        raise Breach(f"used {self.called}[{index}], {side}{where}")


class _GuardedArray(_Guarded, np.ndarray[Any, Any]):
    """Numbers."""


class _GuardedRecords(_Guarded, np.recarray):
    """Records."""


def guarded(tables: Tables, called: str, strict: bool) -> Tables:
    """Return a named tuple of arrays, each as a view of the same memory that checks every index.

    Messages call an array ``called.field``. ``strict``: an index below zero is a breach too.
    """
    views = []
    for name, array in zip(type(tables)._fields, tables, strict=True):
        view = array.view(_GuardedRecords if isinstance(array, np.recarray) else _GuardedArray)
        view.called, view.strict = f"{called}.{name}", strict
        views.append(view)
    return type(tables)(*views)


FAULT = {"fault.code", "fault.a", "fault.b"}
EVERYTHING: set[str] = set()
"""Stands for all fields of a table."""

TOOLBOX = {
    "queue": {"own"},
    "offers": EVERYTHING,
    "pairs": EVERYTHING,
    "lookup": EVERYTHING,
    "firsts": EVERYTHING,
    "clock": {"lists.offered", "lists.pairs", "lists.free", "lists.wanted", *FAULT},
    "counts": {"updated", "pairs_max", "late"},
}
ONLY_NAMES = {"near": EVERYTHING, "clock": FAULT, "counts": {"late"}}

HOOKS = {
    "build": {**TOOLBOX, "near": EVERYTHING},
    "repair": {**TOOLBOX, "near": EVERYTHING},
    "replan": TOOLBOX,
    "enter": {**TOOLBOX, "near": EVERYTHING},
    "leave": {**TOOLBOX, "near": EVERYTHING},
    "near": ONLY_NAMES,
    "soon": {},
    "arrange": ONLY_NAMES,
    "audit": ONLY_NAMES,
}
"""What each hook may change of the kernel's tables; of none but the state it may change anything else."""

ONLY_GROW = {"clock": ("lists.offered", "lists.wanted"), "counts": ("updated", "pairs_max", "late")}

OF_SCENE = ("position", "velocity", "radius", "mass")


class HookSnapshot(NamedTuple):
    """Copies from before a hook: of the tables that it may not change in whole, as far as they are in use, of
    the scene's arrays, and, where it may not change that either, of its state."""

    tables: dict[str, Any]
    scene: dict[str, bytes]
    state: dict[str, Any]

    @classmethod
    def of(cls, hook: str, k: Kernel, s: Any, scene: Scene) -> HookSnapshot:
        """Take one before a hook is called."""
        may = HOOKS[hook]
        tables = {name: _copy(t) for name, t in k._asdict().items() if may.get(name) is not EVERYTHING}
        for name, used in (("offers", "offered"), ("met", "logged"), ("log", "written")):
            tables[name] = _copy(getattr(k, name)[: int(k.clock[0].lists[used])])
        held = s._asdict() if hook in ("audit", "soon") else {}
        state = {name: array.copy() for name, array in held.items()}
        return cls(tables, bytes_of(scene), state)


def bytes_of(scene: Scene) -> dict[str, bytes]:
    """Return the arrays of a scene as they are now."""
    return {name: getattr(scene, name).tobytes() for name in OF_SCENE}


def breaches(hook: str, before: HookSnapshot, k: Kernel, s: Any, scene: Scene) -> Iterator[str]:
    """Yield what a hook has changed and may not, now that it has returned."""
    may = HOOKS[hook]
    for name, was in before.tables.items():
        table = _plain(getattr(k, name))[: len(was)]
        if was.tobytes() != table.tobytes():
            yield from _changed(name, was, table, may.get(name, set()) if name != "offers" else set())
    for name, fields in ONLY_GROW.items():
        was, is_now = before.tables[name], getattr(k, name)
        for field in fields:
            if column(is_now, field)[0] < column(was, field)[0]:
                yield f"{name}.{field} (it has become less)"
    if "queue" in may:
        yield from _not_scheduled(before, k)
    for name, held in bytes_of(scene).items():
        if held != before.scene[name]:
            yield f"the scene's {name}"
    for name, was in before.state.items():
        if was.tobytes() != getattr(s, name).tobytes():
            yield f"s.{name}"


def _plain(table: Any) -> Any:
    """Return a table without access to its columns by attribute, which is slow."""
    return table.view(np.ndarray)


def _copy(table: Any) -> Any:
    """Return a copy of a table, at once: NumPy would copy records with gaps field by field."""
    return np.frombuffer(table.tobytes(), table.view(np.ndarray).dtype)


def _changed(name: str, was: Any, table: Any, may: set[str]) -> Iterator[str]:
    """Yield, for each field that may not change and has, the first row in which it did."""
    for field in fields_in(table.dtype) or (None,):
        if field in may:
            continue
        old, new = (was, table) if field is None else (column(was, field), column(table, field))
        if old.tobytes() != new.tobytes():
            row = next(row for row in range(len(new)) if old[row].tobytes() != new[row].tobytes())
            which = name if name in ("clock", "counts") else f"{name}[{row}]"
            which += f".{field}" if field else ""
            yield f"{which} ({new[row].item()!r}, where {old[row].item()!r} stood)"


def _not_scheduled(before: HookSnapshot, k: Kernel) -> Iterator[str]:
    """Yield certificates that have changed, and not by ``schedule``."""
    clock = k.clock[0]
    first, last, hand = len(before.tables["offers"]), int(clock.lists.offered), int(clock.hand)
    if not first <= last <= len(k.offers):
        return  # the list overflowed: every body is settled again
    left = _plain(k.offers)[first:last]
    settled = left["a"][left["b"] == NOBODY].tolist()
    set_anew = int(k.counts[0].updated) - int(before.tables["counts"][0]["updated"])
    own, was = _plain(k.queue)["own"], before.tables["queue"]["own"]
    changed = np.flatnonzero(own != was).tolist()
    for body in changed:
        if body != hand and body not in settled:
            yield f"queue[{body}].own, the certificate of body {body}, other than by schedule"
    of_hand = set_anew - len(settled)
    if hand in changed and of_hand == 0:
        yield f"queue[{hand}].own, the certificate of body {hand}, other than by schedule"
    elif of_hand < 0 or (of_hand > 0 and hand < 0):
        yield f"counts.updated ({set_anew} more, where {len(settled)} certificates were scheduled)"


CONTACTS, EVENTS = 40, 60
"""The limits of a run, and of its continuation after a body has been turned."""

COMPILED = ("build", "repair", "replan", "near")
IF_THERE = ("enter", "leave", "soon")
"""Compiled too; a phase may be without."""


class Watch:
    """Watches the hooks of one phase on one scene.

    Attributes:
        said: what was seen first; None: nothing.
    """

    def __init__(self, scene: Scene) -> None:
        self.said: str | None = None
        self._scene = scene
        self._tables: dict[tuple[int, ...], tuple[Kernel, Kernel]] = {}

    def over(self, composition: Composition) -> Composition:
        """Return the phases with every hook of the broad phase watched."""
        fields = {field: getattr(composition, field) for field in Composition.__dataclass_fields__}
        return _Watched(**fields | {"broad": self._parts(composition.broad)}, watch=self)

    def _parts(self, parts: BroadPhaseParts) -> BroadPhaseParts:
        state = guarded(parts.state, "s", strict=False)
        there = [*COMPILED, *(name for name in IF_THERE if getattr(parts, name) is not None)]
        hooks: dict[str, Any] = {name: self._watched(name, getattr(parts, name), state) for name in there}
        if parts.arrange is not None:
            hooks["arrange"] = self._watched("arrange", parts.arrange)
        if parts.audit is not None:
            audit = parts.audit
            hooks["audit"] = self._watched("audit", wraps(audit)(lambda k, s: list(audit(k, s))))
        return replace(parts, **hooks)

    def _watched(self, name: str, hook: Callable[..., Any], state: Any = None) -> Callable[..., Any]:
        """Return a watched hook; with a state that checks every index, if it is given."""

        def watched(k: Kernel, s: Any, *body: int) -> Any:
            before = HookSnapshot.of(name, k, s, self._scene)
            try:
                found = hook(*(k, s) if state is None else (self._guarded(k), state), *body)
            except Breach as breach:
                raise self._tell(f"{name} {breach}") from breach
            except Exception as error:
                said = f"{name} raised {type(error).__name__}: {error}{place_of(error)}"
                raise self._tell(said) from error
            for field in breaches(name, before, k, s, self._scene):
                raise self._tell(f"{name} wrote {field}{_place(hook)}")
            return found

        return watched

    def _tell(self, said: str) -> Breach:
        self.said = self.said or said
        return Breach(said)

    def _guarded(self, k: Kernel) -> Kernel:
        """Return tables that check every index; made once for each set of tables."""
        key = tuple(map(id, k))
        if key not in self._tables:
            self._tables[key] = k, guarded(k, "k", strict=True)
        return self._tables[key][1]


@dataclass(frozen=True)
class _Watched(Composition):
    """Phases that are watched, also when they are prepared again because bodies come and go."""

    watch: Watch | None = None

    @property
    def looks_ahead(self) -> bool:
        """Whether there is ``soon``: no scene here is large enough for it to be called otherwise."""
        return self.broad.soon is not None

    def prepared_for(self, scene: Scene) -> Composition:
        again = super().prepared_for(scene)
        return again if self.watch is None else self.watch.over(again)


def _place(hook: Callable[..., Any]) -> str:
    """Return where a hook begins, to be put behind a sentence."""
    code = getattr(unwrap(hook), "__code__", None)
    return f" (it begins in {Path(code.co_filename).name}, line {code.co_firstlineno})" if code else ""


def exchange(engine: Engine, body: int, velocity: tuple[float, float]) -> None:
    """Remove a body, and insert another of its size in its place, in the middle of a watched run: so
    ``leave`` and ``enter`` are watched too. Does nothing where the body has gone already; where the phase
    refuses the new body, it stays out."""
    if not 0 <= body < engine.numbers or engine.k.slots[body] < 0:
        return
    slot = engine.k.slots[body : body + 1]
    x, y = positions_now(engine.k, slot)[0].tolist()
    radius, mass = float(engine.k.bodies["radius"][slot[0]]), float(engine.k.mass[slot[0]])
    shape = int(engine.k.bodies["form"][slot[0]]) if engine.scene.shapes else None
    engine.carry_out(REMOVED, read_removal(engine, body))
    with contextlib.suppress(KinetileError, ValueError):
        rows, new = read_insertion(engine, (x, y), velocity, radius, mass, None, shape)
        engine.carry_out(INSERTED, rows, new)


def watch_hooks(subject: Subject, scene: Scene) -> str | None:
    """Run a phase on a scene with every hook watched; return what was seen first, None where nothing was.

    Whether the run gives the right answer, or comes to its end at all, is for other checks to say. Raises
    Refused where the phase cannot do the scene.
    """
    held = bytes_of(scene)
    composition = subject.composition(scene)
    for name, was in held.items():
        if bytes_of(scene)[name] != was:
            return f"prepare wrote the scene's {name}"
    watch = Watch(scene)
    try:
        engine = Engine(scene, watch.over(composition), keep_contacts=False, commands=Commands.TURNS)
        _run(engine, scene)
    except Refused:
        if watch.said is None:
            raise
    except KinetileError:
        pass
    except Exception as error:  # in arrange and audit, a breach itself
        if watch.said is None:
            return f"the run ended with {type(error).__name__}: {error}{place_of(error)}"
    return watch.said


def _run(engine: Engine, scene: Scene) -> None:
    """Run a while, turn a body to be fast, so that all is laid out again, run on, have bodies go and come,
    run on again, and run the phase's audit after each piece."""
    until = horizon(scene)
    _advance(engine, until)
    if len(scene):
        with contextlib.suppress(Refused):
            turns = read_turns(engine, [len(scene) - 1], [1.5 * engine.speed, 0.25 * engine.speed])
            engine.carry_out(TURNED, turns)
    _advance(engine, until + 1.0)
    for body in range(0, len(scene), 3 + len(scene) // 6):
        exchange(engine, body, (0.25 * engine.speed, -0.125 * engine.speed))
    _advance(engine, until + 2.0)


def _advance(engine: Engine, until: float) -> None:
    """Run on to a time, or for so many contacts or events; then call the phase's own audit, if it has one.
    What it says is for other checks."""
    contacts, events = engine.contacts + CONTACTS, engine.events + EVENTS
    end = End(until, engine.clock.ticks(until), contacts=contacts, events=events)
    advance(engine, end, None, lambda: None)
    engine.build()
    audit = engine.composition.broad.audit
    if audit is not None:
        audit(engine.k, engine.state)
