"""Readings of a run: its cost and accuracy, what it models, and both in words."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from kinetile.kernel.falling import falls, places_now
from kinetile.kernel.loop import idle
from kinetile.kernel.tables import COUNTS, Kernel
from kinetile.plugin.choices import called
from kinetile.run.compose import Commands, Composition
from kinetile.run.engine.bounds import Bounds, squares_of_bodies
from kinetile.run.engine.engine import Engine
from kinetile.scene import Scene
from kinetile.scene.commands import counted
from kinetile.scene.scene import in_words


@dataclass(frozen=True)
class Readings:
    """The instruments after a run; counts are totals since the start of the simulation.

    After ``resume`` or ``restore`` the structure of the broad phase is built again: structural events, and
    other counts of its work, may then differ from those of a run that was not interrupted. Contacts do not.

    The measures of a kinetic data structure (thesis, section 2.1) are among them. Responsiveness: events a
    CPU second. Efficiency: structural events for each contact. Compactness: the length of the queue, at
    most one entry a body. Locality: the number of rescheduled certificates. Candidate checks and exact
    times for each contact measure the quality of the broad phase; deepest overlap, energy drift and
    lateness the accuracy of the run.

    Attributes:
        contacts: number of contacts of all kinds, those of ``Simulation.contacts``.
        contacts_disc: contacts of two discs, beginnings and ends of passings among them.
        contacts_wall: contacts of a body with a wall.
        passings: times that two discs began to pass through each other.
        turns: changes of velocity by the user or the scene.
        inserted: inserted bodies.
        removed: removed bodies.
        structural_events: failures of the broad phase's own certificates.
        events: all of the above together.
        certificates_updated: number of times that the broad phase scheduled a body's certificate.
        newcomers: pairs that the broad phase reported as newly near, without the static construction.
        partners_asked: candidate checks: bodies that the broad phase named for another, by a bound if the
            narrow phase has one.
        contacts_computed: exact contact times.
        queue_max: most bodies queued at one time; a body has one entry, so it is at most their number.
        pairs_max: most pairs in the broad phase's pair set; 0 if it keeps none.
        deepest_overlap: deepest overlap found at a contact, in radii of the smaller body (``scene.radius``).
        energy_drift: relative change of kinetic energy, apart from what commands and responses change.
        lateness: how far in the past a structural event was found, in the scene's time.
        cpu_seconds: processor time inside the loop, compilation apart.
        compile_seconds: processor time to compile the loop, or to load it.
        audits: number of audits without a violation.
        events_per_cpu_second: events / cpu_seconds.
        contacts_per_cpu_second: contacts / cpu_seconds.
        fingerprint: digest of the list of contacts; equal under every broad phase.
    """

    contacts: int
    contacts_disc: int
    contacts_wall: int
    passings: int
    turns: int
    inserted: int
    removed: int
    structural_events: int
    events: int
    certificates_updated: int
    newcomers: int
    partners_asked: int
    contacts_computed: int
    queue_max: int
    pairs_max: int
    deepest_overlap: float
    energy_drift: float
    lateness: float
    cpu_seconds: float
    compile_seconds: float
    audits: int
    events_per_cpu_second: float
    contacts_per_cpu_second: float
    fingerprint: str

    def as_dict(self) -> dict[str, Any]:
        """Returns the readings by name, fit for JSON."""
        return asdict(self)


_COUNTS = [name for name in Readings.__annotations__ if name in (COUNTS.names or ())]


def readings_of(engine: Engine, start_energy: float) -> Readings:
    """Reads the instruments of an engine; ``start_energy`` is that of its bodies at the start."""
    k, counts, seconds = engine.k, engine.k.counts[0], engine.cpu_seconds
    expected = start_energy + float(counts.commanded_energy) + float(counts.answered_energy)
    scale = max(abs(start_energy), abs(expected))
    same: Any = {name: int(counts[name]) for name in _COUNTS}
    return Readings(
        **same,
        contacts=engine.contacts,
        structural_events=int(counts.structural),
        events=engine.events,
        certificates_updated=int(counts.updated),
        partners_asked=int(counts.asked),
        contacts_computed=int(counts.exact),
        deepest_overlap=max(float(counts.deepest), 0.0),
        energy_drift=abs(energy(k) - expected) / scale if scale > 0.0 else 0.0,
        lateness=float(counts.late) * float(k.clock[0].tick),
        cpu_seconds=seconds,
        compile_seconds=engine.compile_seconds,
        audits=engine.audits,
        events_per_cpu_second=engine.events / seconds if seconds > 0.0 else 0.0,
        contacts_per_cpu_second=engine.contacts / seconds if seconds > 0.0 else 0.0,
        fingerprint=engine.ledger.fingerprint,
    )


def energy(k: Kernel) -> float:
    """Returns the kinetic energy of all movable bodies, summed exactly, and with gravity that of their
    heights, 0 in the corner (0, 0)."""
    found = 0.5 * squares_of_bodies(k)
    if falls(k):
        there = np.flatnonzero(k.queue.number >= 0)
        pull = np.array([k.clock[0].fall.x, k.clock[0].fall.y])
        found -= math.fsum((k.mass[there] * (places_now(k, there) @ pull)).tolist())
    return found


def reading_lines(found: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yields readings (``Readings.as_dict``) line by line, each with its label."""
    contacts = found["contacts"]
    checked, exact = (found[name] / max(contacts, 1) for name in ("partners_asked", "contacts_computed"))
    yield (
        "contacts",
        f"{contacts:,} ({found['contacts_disc']:,} of bodies, {found['contacts_wall']:,} with walls)",
    )
    if found["passings"]:
        yield "passings", f"{found['passings']:,} begun; begin and end count as contacts of discs"
    turns = f", {found['turns']:,} turns" if found["turns"] else ""
    yield "events", f"{found['events']:,} ({found['structural_events']:,} structural{turns})"
    yield "certificates", f"{found['certificates_updated']:,} times set"
    yield "queue", f"at most {found['queue_max']:,} long"
    yield "candidate pairs", f"{found['newcomers']:,} new during the run"
    yield (
        "contact times",
        f"{found['partners_asked']:,} candidate checks, {found['contacts_computed']:,} exact solves"
        + (f" ({checked:.3g} and {exact:.3g} a contact)" if contacts else ""),
    )
    yield "deepest overlap", f"{found['deepest_overlap']:.2g} radii"
    yield "energy drift", f"{found['energy_drift']:.2g} (relative)"
    yield "lateness", f"{found['lateness']:.2g} time units"
    if found["audits"]:
        yield "audits", f"{found['audits']:,}: nothing was found"
    yield (
        "CPU time",
        f"{found['cpu_seconds']:.4g} s in the loop, {found['compile_seconds']:.3g} s to make it ready",
    )
    yield (
        "speed",
        f"{found['events_per_cpu_second'] / 1e6:.3g} million events, "
        f"{found['contacts_per_cpu_second'] / 1e3:,.4g} thousand contacts a CPU second",
    )
    yield "fingerprint", found["fingerprint"]


_UNITS = {
    "time_unit": "of the scene's time",
    "tick": "of the scene's time",
    "speed_bound": "length / time",
    "skin": "length",
    "skin_in_radii": "of the smallest radius",
    "structural_error": "length",
}


def explanation(
    scene: Scene, composition: Composition, commands: Commands, bounds: Bounds, time_unit: float
) -> dict[str, Any]:
    """Returns {"modelled": sentences, "left out": sentences, "numbers": {name: value}}."""
    certificates = 0 if composition.broad.repair is idle.repair else len(scene)
    said = [
        *_of_motion(scene, composition, certificates),
        *_of_contacts(scene, composition),
        *_of_walls(scene, composition),
        *_of_commands(scene, composition, commands),
    ]
    return {
        "modelled": [sentence for modelled, sentence in said if modelled],
        "left out": [sentence for modelled, sentence in said if not modelled],
        "numbers": {
            "bodies": len(scene),
            "structural_certificates": certificates,
            "time_unit": time_unit,
            "tick": time_unit * 2.0**-52,
            "speed_bound": bounds.speed,
            "skin": bounds.skin.delta,
            "skin_in_radii": bounds.skin.delta / float(scene.radius.min()) if len(scene) else 0.0,
            "structural_error": bounds.skin.eta,
        },
    }


Sentences = Iterator[tuple[bool, str]]
"""Sentences, each with whether it says what is modelled, or what is left out."""


def _of_motion(scene: Scene, composition: Composition, certificates: int) -> Sentences:
    motion, lasts = "flying straight", f"{scene.frame * (scene.time_unit * 2.0**-52):.6g}"
    if scene.falls:
        motion = f"falling by gravity {list(scene.gravity)!r}, straight in frames that fall for {lasts} each,"
    yield True, f"{in_words(scene, len(scene))}, {motion} between contacts"
    left_out = ("" if scene.falls else "gravity, ") + "friction, rotation, growth"
    yield False, left_out + ("" if composition.rules is not None else " and any loss of energy")
    broad = called(composition.broad_phase, composition.options)
    watched = "one structural certificate a body" if certificates else "no structural certificate"
    yield True, f"candidate pairs by the broad phase {broad}, with {watched}"


def _of_contacts(scene: Scene, composition: Composition) -> Sentences:
    if composition.pair is None:
        yield False, "contacts of two bodies: no narrow phase for pairs is named"
    else:
        named = ", ".join(composition.narrow_phases) or "none"
        yield True, f"contacts of two bodies (narrow phases: {named})"
        if len(scene) == 0 or bool((scene.mass == scene.mass[0]).all()):
            yield False, "masses: all are equal"
        else:
            yield True, f"masses from {float(scene.mass.min())!r} to {float(scene.mass.max())!r}"
    rules = composition.rules
    if rules is None:
        yield False, "responses by kind: every contact is elastic"
    else:
        kinds = f"{rules.kinds} {'kind' if rules.kinds == 1 else 'kinds'} of bodies"
        yield True, f"responses by kind: {', '.join(rules.names)}, for {kinds} and the walls"


def _of_walls(scene: Scene, composition: Composition) -> Sentences:
    if scene.periodic:
        periods = " and ".join(
            f"{period!r} along {axis}" for axis, period in zip("xy", scene.periods, strict=True) if period
        )
        yield True, f"images: the scene is periodic, {periods}; plans two units old are anchored again"
    if scene.arena is None:
        yield False, "walls: the scene has no arena"
    elif scene.periodic == "xy":
        yield False, "walls: both axes are periodic"
    elif composition.wall is None:
        yield False, "walls: the scene has an arena, but no narrow phase for walls is named"
    else:
        width, height = scene.arena
        walls = "two" if scene.periodic else "four"
        yield True, f"{walls} walls around {width!r} x {height!r}, one contact of each body awaited"


def _of_commands(scene: Scene, composition: Composition, commands: Commands) -> Sentences:
    if not commands:
        yield False, "commands (turns, insertions, removals): the scene has none"
        return
    yield True, f"commands: {counted(scene.commands)} in the scene, and those given by hand"
    if commands == Commands.ALL and not composition.living:
        yield False, "inserting and removing bodies: for each the broad phase is built again"


def explanation_lines(found: Mapping[str, Any]) -> list[str]:
    """Returns ``Simulation.explain()`` as lines of text: each list under its heading, then the numbers."""
    lines: list[str] = []
    for heading, content in found.items():
        lines.append(f"{heading}:")
        if isinstance(content, Mapping):
            width = max(map(len, content), default=0)
            for name, value in content.items():
                shown = f"{value:.6g}" if isinstance(value, float) else f"{value:,}"
                label = name.replace("_", " ")
                lines.append(f"  {label:{width}}  {shown} {_UNITS.get(name, '')}".rstrip())
        else:
            lines += [f"  - {sentence}" for sentence in content]
    return lines
