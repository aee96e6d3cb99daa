"""A case: one scene under one phase, the limits of its run, its outcome, and its file: a scene in TOML whose
first line, a comment, names the check and the phases, in JSON.

A phase that changes a count, or a body's ``last``, can leave contacts and places correct, and do harm in
another scene. So an outcome also has all tables of the kernel that are a function of the scene alone: not
counts of candidate checks and structural events, the calendar, the pair set. Without walls the skin depends
on the time of a pair set's growth: there each body's reach is only compared with its radius plus skin.
"""

import contextlib
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar, cast

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict

import kinetile as kt
from kinetile import Scene, Simulation, registry
from kinetile.errors import KinetileError, Refused, SceneError, TooThick, UnknownName
from kinetile.instruments import (
    NOT_AUTHORS,
    Composition,
    Outcome,
    Provided,
    column,
    compared,
    compose_phases,
    composition_of,
    describe_row,
    dumps_scene,
    find_divergence,
    first_difference,
    outcome_of,
    read_text,
    slots_taken,
    write_file,
    write_phase,
)
from kinetile.toolbox import NOBODY, BroadPhaseParts, Kernel, NoState, hook, is_there, unchecked
from kinetile_conformance.deadline import begin_scene

NOT_AUTHORS.add(Path(__file__).parent)

REFERENCE = "naive"
"""The reference, as messages call it."""

LIVE_REFERENCE = "_naive-live"
"""The reference: ``naive`` with hooks for insertion and removal. Without them the kernel rebuilds a phase for
each command, which takes 2 ms; a living scene has hundreds of commands."""

CONTACTS = 150
"""The limit of contacts of a run of few bodies (of one in pieces, of each piece)."""

UNTIL = 8.0
"""The length of a case, in time units, if its scene has no end."""

GENERAL = {"general": True}
"""Options of ``disc`` and ``wall`` for the same parts in all scenes: so a phase needs fewer loops."""

Row = TypeVar("Row")
Tables = Mapping[str, npt.NDArray[np.generic]]

OF_THE_SCENE = (
    "per_tick",
    "per_time",
    "limits.width",
    "limits.height",
    "present",
    "epoch",
    "jam.window_size",
)
OF_THE_SKIN = ("limits.skin", "limits.theta", "limits.tolerance", "limits.span", "limits.fat")


@dataclass(frozen=True)
class Subject:
    """The phases under test: a broad phase with its options, alone or with narrow phases and a response. Each
    narrow phase replaces the usual one of its role (``disc``, ``convex`` for shapes, ``wall``); the response
    answers contacts without a response in the scene."""

    name: str
    options: Mapping[str, Any]
    narrow: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    response: kt.Response | None = None

    @property
    def label(self) -> str:
        """The broad phase and its options, as the command line takes them."""
        return write_phase(self.name, self.options)

    @property
    def beside(self) -> dict[str, str]:
        """The other parts under test, as on the command line, and the kind of each."""
        found = {write_phase(*each): "narrow phase" for each in self.narrow.items()}
        answer = self.response
        return found | ({write_phase(answer.name, answer.options): "response"} if answer else {})

    def dressed(self, scene: Scene) -> Scene:
        """Returns a scene with the response under test; raises Refused if the response refuses it."""
        if self.response is None:
            return scene
        try:
            return scene.replace(responses={**self.response.for_all, **dict(scene.responses)})
        except SceneError as error:
            raise Refused(str(error)) from error

    def simulation(self, scene: Scene, **more: Any) -> Simulation:
        """Returns a simulation of a scene under these phases. All share one loop for inserted and removed
        bodies; without such commands it has no spare slot, which would hide an index too large by one."""
        begin_scene()  # a check may run several, and a slow phase has time for each
        room = None if is_living(scene) else len(scene)
        chosen = {"narrow_phases": self.narrow_phases(scene), "room": room} | more
        return Simulation(scene, self.name, options=self.options, live=True, **chosen)

    def composition(self, scene: Scene) -> Composition:
        """Returns these phases, prepared for a scene."""
        return compose_phases(scene, self.name, self.narrow_phases(scene), self.options)

    def narrow_phases(self, scene: Scene) -> dict[str, Mapping[str, Any]] | None:
        """Returns the narrow phases for a scene; None if none is named here, and the scene has some."""
        if not self.narrow and scene.settings.narrow_phases is not None:
            return None
        pairs, walls = (self.of_role(role) for role in ("pair", "wall"))
        if not walls:
            walls = {"wall": GENERAL}  # it serves scenes without an arena as well
        elif scene.arena is None:
            walls = {}
        return (pairs or ({"convex": {}} if scene.shapes else {"disc": GENERAL})) | walls

    def of_role(self, role: str) -> dict[str, Mapping[str, Any]]:
        """Returns the named narrow phases of a role."""
        found = {name: registry().spec("narrow phase", name) for name in self.narrow}
        return {n: self.narrow[n] for n, spec in found.items() if cast(kt.NarrowPhaseSpec, spec).role == role}

    @property
    def pair(self) -> str | None:
        """The named narrow phase for pairs; None for the usual one."""
        return next(iter(self.of_role("pair")), None)

    def under(self, broad_phase: str) -> "Subject":
        """Returns another broad phase with the same narrow phases."""
        return Subject(broad_phase, {}, self.narrow, self.response)

    @property
    def reference(self) -> "Subject":
        """The reference, with the same narrow phases; registered here if necessary."""
        try:
            registry().spec("broad phase", LIVE_REFERENCE)
        except UnknownName:
            registry().add(PhasePlugin(kt.BroadPhaseSpec(LIVE_REFERENCE, NaiveLive)))
        return self.under(LIVE_REFERENCE)


def provided(subject: Subject) -> tuple[Provided, ...]:
    """Returns the providers of the parts under test, the broad phase's first."""
    narrow = (registry().provided("narrow phase", name) for name in subject.narrow)
    response = [] if subject.response is None else [registry().provided("response", subject.response.name)]
    return registry().provided("broad phase", subject.name), *narrow, *response


HOOKS = {
    kt.BroadPhaseSpec: "kinetile_broad_phases",
    kt.NarrowPhaseSpec: "kinetile_narrow_phases",
    kt.ResponseSpec: "kinetile_responses",
}
"""The hook of a plugin that provides such a spec."""


class PhasePlugin:
    """A plugin that provides one phase or response, under its name, which exists in this process only."""

    def __init__(self, spec: kt.BroadPhaseSpec | kt.NarrowPhaseSpec | kt.ResponseSpec) -> None:
        self.__name__ = spec.name
        setattr(self, HOOKS[type(spec)], kt.hookimpl(lambda: [spec]))


@unchecked
@hook
def _near_live(k: Kernel, s: NoState, body: int) -> int:
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
        """Returns the parts; refuses as many bodies as ``naive``."""
        parts: BroadPhaseParts = registry().target("broad phase", REFERENCE)().prepare(scene)
        return replace(parts, near=_near_live, enter=_idle, leave=_idle, room=scene.capacity)


def is_living(scene: Scene) -> bool:
    """Returns True if a scene inserts or removes bodies."""
    return any(not isinstance(command, kt.Turn | kt.SetKind) for command in scene.commands)


@dataclass(frozen=True)
class RunOutcome(Outcome):
    """Everything that must be the same after a run under every phase; ``tables`` is empty after an error."""

    tables: Tables = field(default_factory=dict)

    @classmethod
    def of(cls, sim: Simulation, ended: str = "ran") -> "RunOutcome":
        """Returns the present outcome of a simulation."""
        return cls(**vars(outcome_of(sim, ended)), tables=tables_after(sim) if ended == "ran" else {})


def horizon(scene: Scene) -> float:
    """Returns the end time of a case."""
    return scene.settings.until if scene.settings.until is not None else scene.start + UNTIL


def ran(sim: Simulation, until: float, contacts: int) -> str:
    """Runs a simulation; returns its end in words."""
    try:
        sim.run(until=until, max_contacts=contacts)
    except KinetileError as error:
        return f"{type(error).__name__}: {error}"
    return "ran"


def run_summary(subject: Subject, scene: Scene, until: float | None = None) -> tuple[str, str]:
    """Runs a case; returns its end in words, and its fingerprint, without the number of events."""
    sim = subject.simulation(scene)
    ended = ran(sim, horizon(scene) if until is None else until, CONTACTS)
    return ended.partition(":")[0], sim.fingerprint


def outcome(subject: Subject, scene: Scene, contacts: int = CONTACTS) -> RunOutcome:
    """Runs a case; an error of the run is part of its outcome, ``Refused`` and ``BadOption`` are raised."""
    sim = subject.simulation(scene)
    return RunOutcome.of(sim, ran(sim, horizon(scene), contacts))


def tables_after(sim: Simulation) -> Tables:
    """Returns copies of all table columns that are functions of the scene, by name: an array with a place for
    each body, or of one number. Empty if the tables cannot be read."""
    try:
        k = sim.tables
    except KinetileError:
        return {}
    clock = k.clock[0]
    walled = sim.scene.arena is not None and composition_of(sim).wall is not None
    lives = bool(k.counts[0].inserted + k.counts[0].removed)
    there = slots_taken(k)
    full = not lives and len(there) == len(k.bodies)  # a phase without `enter` has no slots to spare
    limited = sim.scene.accelerated and composition_of(sim).broad.skin_limit is not None
    same_skin = walled and full and not limited  # it depends on the slots, and chords on the phase's limit
    bodies, number = k.bodies[there], np.append(k.queue["number"], NOBODY)
    left = {f"bodies.{name}": np.array(bodies[name]) for name in compared(k.bodies)}
    met = bodies.last
    if lives:  # the new body of a slot does not name this one: no partner
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
    for name in (*compared(k.clock), *OF_THE_SCENE, *(OF_THE_SKIN if same_skin else ())):
        left[f"clock.{name}"] = column(k.clock, name).copy()
    return left | {f"counts.{name}": np.array([k.counts[0][name]]) for name in compared(k.counts)}


def difference(found: RunOutcome, expected: RunOutcome, name: str) -> str | None:
    """Returns the first difference of the outcome of phase ``name`` from the expected one, in a sentence;
    raises Refused for a skin that bodies needed later, if no contact was wrong before."""
    if found.ended.startswith(f"{TooThick.__name__}: "):
        met = len(found.contacts)
        missing = (expected.contacts["time"][met:] < found.time).any()
        if not missing and first_difference(found.contacts, expected.contacts[:met]) is None:
            raise Refused(found.ended)
    parted = find_divergence(REFERENCE, name, expected, found)
    if parted is None:
        return table_difference(found.tables, expected.tables)
    if parted.what == "end":
        ends = [describe_row({"time": each.time, "ended": each.ended}) for each in (found, expected)]
        return f"{name} {ends[0]}; {REFERENCE} {ends[1]}"
    return told(parted.place, parted.found, parted.expected, describe_row)


def told(place: str, found: Row | None, expected: Row | None, shown: Callable[[Row], str]) -> str:
    """Returns the difference between the found and the expected value at a place, in a sentence."""
    if found is None:
        return f"{place} is missing: {shown(cast(Row, expected))}"
    if expected is None:
        return f"{place} is one too many: {shown(found)}"
    return f"{place} is {shown(found)}, and should be {shown(expected)}"


def table_difference(found: Tables, expected: Tables) -> str | None:
    """Returns the first table entry that differs between two runs, in a sentence."""
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


class SavedCase(BaseModel):
    """A saved case: the scene, and the check, phases and options that its file names, if any."""

    model_config = ConfigDict(arbitrary_types_allowed=True)
    scene: Scene
    check: str | None = None
    name: str | None = None
    options: dict[str, Any] = {}
    narrow_phases: dict[str, dict[str, Any]] = {}
    response: tuple[str, dict[str, Any]] | None = None


def save_case(scene: Scene, path: Path, text: str, subject: Subject, check: str | None = None) -> None:
    """Writes a case as a scene file. Its head names the check that replays it, the phases and the failure."""
    answer = subject.response and (subject.response.name, subject.response.options)
    head = {"check": check, "name": subject.name, "options": subject.options, "response": answer}
    head |= {"narrow_phases": subject.narrow}
    lines = [json.dumps(head, default=repr), *text.splitlines()[:6]]
    path.parent.mkdir(parents=True, exist_ok=True)
    write_file(path, "".join(f"# {line}\n" for line in lines) + dumps_scene(scene))


def load_case(path: Path) -> SavedCase:
    """Reads a case; any other scene file is a case that names nothing."""
    scene = kt.load_scene(path)  # and so the file is one, in UTF-8
    head = read_text(path).partition("\n")[0].removeprefix("# ")
    with contextlib.suppress(ValueError, TypeError, RecursionError):
        return SavedCase(scene=scene, **json.loads(head))
    return SavedCase(scene=scene)
