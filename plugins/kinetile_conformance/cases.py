"""A case: one scene under one phase, how far it is run, its outcome, and the file that keeps it.

Contacts and places are what a user sees. A phase that tampers with a count, or with a body's ``last``, can
leave both as they should be, and do its harm in another scene. So an outcome also has all of the kernel's
tables that is a function of the scene alone. Left out is what may differ between phases: numbers of candidate
checks and structural events, the calendar, the pair set. Without walls the skin is computed again whenever a
phase's pair set grows; there it is compared with the bodies' reach alone.

A saved case is a scene in TOML that replays exactly; comments at its head name the check and the phases.
"""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar, cast

import numpy as np
import numpy.typing as npt

from kinetile.errors import KinetileError, Refused, TooThick, UnknownName
from kinetile.kernel.tables import column, slots_taken
from kinetile.plugin.choices import write_phase
from kinetile.plugin.registry import Provided, registry
from kinetile.plugin.specs import BroadPhaseSpec, NarrowPhaseSpec, ResponseSpec, hookimpl
from kinetile.run.compare import Outcome, describe_row, find_divergence, first_difference, outcome_of
from kinetile.run.compose import Composition, compose_phases
from kinetile.run.simulation import Simulation
from kinetile.scene import Response, Scene, Turn
from kinetile.scene.files import dumps_scene, load_scene
from kinetile.scene.schema import read_bytes
from kinetile.toolbox import NOBODY, BroadPhaseParts, Kernel, NoState, hook, is_there, unchecked
from kinetile_conformance.deadline import begin_scene

REFERENCE = "naive"
"""The reference, as messages call it."""

LIVE_REFERENCE = "_naive-live"
"""The reference: ``naive`` with hooks for bodies that come and go. Without them the kernel rebuilds a phase
for each command, which takes 2 ms; a living scene has hundreds of commands."""

CONTACTS = 150
"""The limit of contacts of a run of few bodies (of one in pieces, of each piece)."""

UNTIL = 8.0
"""The length of a case, in time units, where its scene has no end."""

GENERAL = {"general": True}
"""Options of ``disc`` and ``wall``: without them scenes whose bodies are alike and scenes without an arena
have parts of their own, and a phase has a loop for each."""

Row = TypeVar("Row")
Tables = Mapping[str, npt.NDArray[np.generic]]

BODIES = ("x", "y", "vx", "vy", "anchor", "radius")
CLOCK = (
    *("now", "tick", "per_time", "limits.width", "limits.height", "present", "epoch"),
    *("jam.window", "jam.window_size", "jam.window_tick", "fault.code"),
)
OF_THE_SKIN = ("limits.skin", "limits.theta", "limits.tolerance", "limits.span", "limits.fat")
COUNTS = (
    *("contacts_disc", "contacts_wall", "turns", "inserted", "removed"),
    *("logged", "passings", "deepest", "commanded_energy", "answered_energy"),
)


@dataclass(frozen=True)
class Subject:
    """The phases under test: a broad phase with its options, alone or with narrow phases and a response.

    ``response`` is the answer to all contacts for which a scene has no other. ``narrow`` has the options
    of each named narrow phase. It replaces the usual one of its role: ``disc`` for pairs, or ``convex``
    where the scene has shapes, and ``wall`` for walls.
    """

    name: str
    options: Mapping[str, Any]
    narrow: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    response: Response | None = None

    @property
    def beside(self) -> list[str]:
        """What is judged with the broad phase, as it is written."""
        response = [] if self.response is None else [(self.response.name, self.response.options)]
        return [write_phase(*each) for each in (*self.narrow.items(), *response)]

    def dressed(self, scene: Scene) -> Scene:
        """Return a scene with the response under test."""
        if self.response is None:
            return scene
        return scene.replace(responses={("*", "*"): self.response, **dict(scene.responses)})

    def simulation(self, scene: Scene, **more: Any) -> Simulation:
        """Return a simulation of a scene under these phases.

        All scenes share one compiled loop, in which bodies can come and go, and those in which none does have
        no slot to spare: a place too many would hide an index that is too large by one.
        """
        begin_scene()  # a check may run several, and a slow phase has time for each
        chosen = {
            "narrow_phases": self.narrow_phases(scene),
            "room": None if is_living(scene) else len(scene),
        } | more
        return Simulation(scene, self.name, options=self.options, live=True, **chosen)

    def composition(self, scene: Scene) -> Composition:
        """Return these phases, prepared for a scene."""
        return compose_phases(scene, self.name, self.narrow_phases(scene), self.options)

    def narrow_phases(self, scene: Scene) -> dict[str, Mapping[str, Any]] | None:
        """Return the narrow phases for a scene; None where none is named here, and some are in the scene."""
        if not self.narrow and scene.settings.narrow_phases is not None:
            return None
        pairs, walls = (self.of_role(role) for role in ("pair", "wall"))
        if not walls:
            walls = {"wall": GENERAL}  # it serves scenes without an arena as well
        elif scene.arena is None:
            walls = {}
        return (pairs or ({"convex": {}} if scene.shapes else {"disc": GENERAL})) | walls

    def of_role(self, role: str) -> dict[str, Mapping[str, Any]]:
        """Return the named narrow phases of a role."""
        found = {name: registry().spec("narrow phase", name) for name in self.narrow}
        return {n: self.narrow[n] for n, spec in found.items() if cast(NarrowPhaseSpec, spec).role == role}

    @property
    def pair(self) -> str | None:
        """The named narrow phase for pairs; None: it is the usual one."""
        return next(iter(self.of_role("pair")), None)

    def under(self, broad_phase: str) -> Subject:
        """Return another broad phase with the same narrow phases."""
        return Subject(broad_phase, {}, self.narrow, self.response)

    @property
    def reference(self) -> Subject:
        """The reference, with the same narrow phases; it is registered where it is not."""
        try:
            registry().spec("broad phase", LIVE_REFERENCE)
        except UnknownName:
            registry().add(PhasePlugin(BroadPhaseSpec(LIVE_REFERENCE, NaiveLive)))
        return self.under(LIVE_REFERENCE)


def provided(subject: Subject) -> tuple[Provided, ...]:
    """Return the providers of what is under test, the broad phase's first."""
    narrow = (registry().provided("narrow phase", name) for name in subject.narrow)
    response = [] if subject.response is None else [registry().provided("response", subject.response.name)]
    return registry().provided("broad phase", subject.name), *narrow, *response


class PhasePlugin:
    """A plugin that provides one phase, under the phase's name: for phases that exist in this process
    only."""

    def __init__(self, spec: BroadPhaseSpec | NarrowPhaseSpec | ResponseSpec) -> None:
        self.__name__ = spec.name
        self._spec = spec

    @hookimpl
    def kinetile_broad_phases(self) -> list[BroadPhaseSpec]:
        """Return the phase, if it is a broad phase."""
        return [self._spec] if isinstance(self._spec, BroadPhaseSpec) else []

    @hookimpl
    def kinetile_narrow_phases(self) -> list[NarrowPhaseSpec]:
        """Return the phase, if it is a narrow phase."""
        return [self._spec] if isinstance(self._spec, NarrowPhaseSpec) else []

    @hookimpl
    def kinetile_responses(self) -> list[ResponseSpec]:
        """Return the response, if it is one."""
        return [self._spec] if isinstance(self._spec, ResponseSpec) else []


@unchecked
@hook
def _near_live(k: Kernel, s: NoState, body: int) -> int:
    """Name all present bodies."""
    count = 0
    for other in range(len(k.bodies)):
        if is_there(k, other):
            k.near[count] = other
            count += 1
    return count


@hook
def _idle(k: Kernel, s: NoState, body: int) -> None:
    """Nothing to do: there is no structure."""


class NaiveLive:
    """Every present body is near every other."""

    def prepare(self, scene: Scene) -> BroadPhaseParts:
        """Return the parts; refuses as many bodies as ``naive``."""
        parts: BroadPhaseParts = registry().target("broad phase", REFERENCE)().prepare(scene)
        return replace(parts, near=_near_live, enter=_idle, leave=_idle, room=scene.capacity)


def is_living(scene: Scene) -> bool:
    """Whether bodies come or go in a scene."""
    return any(not isinstance(command, Turn) for command in scene.commands)


@dataclass(frozen=True)
class RunOutcome(Outcome):
    """Everything that must be the same after a run under every phase; ``tables`` is empty after an error."""

    tables: Tables = field(default_factory=dict)

    @classmethod
    def after(cls, sim: Simulation, run: Callable[[], object]) -> RunOutcome:
        """Return what is left of a simulation after a run; an error of the run is part of it."""
        ended = "ran"
        try:
            run()
        except KinetileError as error:
            ended = f"{type(error).__name__}: {error}"
        return cls.of(sim, ended)

    @classmethod
    def of(cls, sim: Simulation, ended: str = "ran") -> RunOutcome:
        """Return what a simulation holds now."""
        return cls(**vars(outcome_of(sim, ended)), tables=tables_after(sim) if ended == "ran" else {})


def horizon(scene: Scene) -> float:
    """Return the time at which a case ends."""
    return scene.settings.until if scene.settings.until is not None else scene.start + UNTIL


def run_summary(subject: Subject, scene: Scene, until: float | None = None) -> tuple[str, str]:
    """Run a case, by default to its horizon; return how it ended, and its fingerprint: what two runs of one
    phase have in common. How many events it took may differ."""
    sim = subject.simulation(scene)
    ended = "ran"
    try:
        sim.run(until=horizon(scene) if until is None else until, max_contacts=CONTACTS)
    except KinetileError as error:
        ended = type(error).__name__
    return ended, sim.fingerprint


def outcome(subject: Subject, scene: Scene, contacts: int = CONTACTS) -> RunOutcome:
    """Run a case; an error of the run is part of its outcome, but not one of preparing it: ``Refused`` and
    ``BadOption`` are raised."""
    sim = subject.simulation(scene)
    return RunOutcome.after(sim, lambda: sim.run(until=horizon(scene), max_contacts=contacts))


def tables_after(sim: Simulation) -> Tables:
    """Return copies of all table columns that are functions of the scene, by name: an array with a place for
    each body, or of one number. Empty where the tables cannot be read."""
    try:
        k = sim.tables
    except KinetileError:
        return {}
    clock = k.clock[0]
    walled = sim.scene.arena is not None and sim.composition.wall is not None
    lives = bool(k.counts[0].inserted + k.counts[0].removed)
    there = slots_taken(k)
    full = not lives and len(there) == len(k.bodies)  # a phase without `enter` has no slots to spare
    same_skin = walled and full  # the skin depends on the number of slots
    bodies, number = k.bodies[there], np.append(k.queue["number"], NOBODY)
    left = {f"bodies.{name}": np.array(bodies[name]) for name in BODIES}
    met = bodies.last
    if lives:  # a slot with a new body does not name back: it counts as none
        met = np.where((met >= 0) & (k.bodies.last[met] == there), met, NOBODY)
    left["bodies.last"] = number[met]
    left["mass"] = np.array(k.mass[there])
    left["radii"] = np.array(k.radii[there])
    left["bodies.reach is radius and skin"] = np.array(bodies.reach == bodies.radius + clock.limits.skin)
    if not lives:
        left["stamps"] = np.array(k.stamps[there])  # else it depends on the slot's former body
    if full:
        left["clock.jam.spin_limit"] = np.array([clock.jam.spin_limit])  # it depends on the number of slots
    if same_skin:
        left["bodies.reach"] = np.array(bodies.reach)
    for name in (*CLOCK, *(OF_THE_SKIN if same_skin else ())):
        left[f"clock.{name}"] = column(k.clock, name).copy()
    return left | {f"counts.{name}": np.array([k.counts[0][name]]) for name in COUNTS}


def difference(found: RunOutcome, expected: RunOutcome, name: str) -> str | None:
    """Return where the outcome of phase ``name`` first differs from the expected one, in a sentence; None:
    nowhere. Raises Refused where the phase took the scene, and not a skin that bodies needed later, and no
    contact was wrong before."""
    if found.ended.startswith(f"{TooThick.__name__}: "):
        met = len(found.contacts)
        missing = (expected.contacts["time"][met:] < found.time).any()
        if not missing and first_difference(found.contacts, expected.contacts[:met]) is None:
            raise Refused(found.ended)
    parted = find_divergence(REFERENCE, name, expected, found)
    if parted is None:
        return table_difference(found.tables, expected.tables)
    if parted.what == "end":
        ends = [f"{each.ended}, at time {each.time!r}" for each in (found, expected)]
        return f"{name} ended with {ends[0]}; {REFERENCE} with {ends[1]}"
    return told(parted.place, parted.found, parted.expected, describe_row)


def told(place: str, found: Row | None, expected: Row | None, shown: Callable[[Row], str]) -> str:
    """Return how what was found at a place differs from what should be there, in a sentence."""
    if found is None:
        return f"{place} is missing: {shown(cast(Row, expected))}"
    if expected is None:
        return f"{place} is one too many: {shown(found)}"
    return f"{place} is {shown(found)}, and should be {shown(expected)}"


def table_difference(found: Tables, expected: Tables) -> str | None:
    """Return the first table entry that one run left otherwise than another, in a sentence; None: there is
    none."""
    for name, right in expected.items():
        mine = found.get(name, right)
        at = first_difference(mine, right)
        if at is None:
            continue
        if at >= min(len(mine), len(right)):
            return f"at the end {name} has {len(mine)} entries, not {len(right)}"
        whose = f" of body {at}" if len(right) > 1 or not name.startswith(("clock", "counts")) else ""
        return f"at the end {name}{whose} is {mine[at].item()!r}, not {right[at].item()!r}"
    return None


@dataclass(frozen=True)
class SavedCase:
    """A case as it was saved: the scene, and the check, phases and options that its file names; None, where
    it names none."""

    scene: Scene
    check: str | None
    name: str | None
    options: Mapping[str, Any]
    narrow_phases: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)


def save_case(scene: Scene, path: Path, check: str, subject: Subject, said: str) -> None:
    """Write a case as a scene file; comments at its head name the check, the phases with their options, and
    the first lines of the failure."""
    head = [f"check: {check}", f"broad phase: {subject.name}"]
    if subject.options:
        head.append(f"options: {json.dumps(dict(subject.options), default=repr)}")
    if subject.narrow:
        head.append(f"narrow phases: {json.dumps(subject.narrow, default=repr)}")
    head += [f"said: {line}" for line in said.splitlines()[:6]]
    text = "".join(f"# {line}\n" for line in head)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text + dumps_scene(scene), encoding="utf-8")


def load_case(path: Path) -> SavedCase:
    """Read a case; any other scene file is a case that names nothing."""
    scene = load_scene(path)  # and so the file is one, in UTF-8
    head: dict[str, str] = {}
    for line in read_bytes(path).decode("utf-8", errors="replace").splitlines():
        if not line.startswith("# "):
            break
        key, _, value = line[2:].partition(":")
        head.setdefault(key, value.strip())
    check = head.get("check")
    said: dict[str, Any] = {"options": {}, "narrow phases": {}}
    for key in said if check else ():
        with contextlib.suppress(ValueError, RecursionError):
            said[key] = json.loads(head.get(key, "{}"))
    return SavedCase(scene, check, head.get("broad phase") if check else None, *said.values())
