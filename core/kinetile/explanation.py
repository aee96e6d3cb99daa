"""A run in words: its model and the limits of it (``Simulation.explain()``), and its readings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from kinetile.kernel.loop import idle
from kinetile.plugin.choices import called
from kinetile.scene import Insert
from kinetile.scene.commands import counted
from kinetile.scene.scene import in_words

if TYPE_CHECKING:
    from kinetile.run.engine.engine import Engine

_UNITS = {
    "time_unit": "of the scene's time",
    "tick": "of the scene's time",
    "speed_bound": "length / time",
    "skin": "length",
    "skin_in_radii": "of the smallest radius",
    "structural_error": "length",
}


def explanation(engine: Engine) -> dict[str, Any]:
    """Returns {"modelled": sentences, "left out": sentences, "numbers": {name: value}}."""
    scene, bounds = engine.scene, engine.bounds
    certificates = len(scene) if engine.composition.broad.repair is not idle.repair else 0
    sentences = [*_sentences(engine, certificates)]
    return {
        "modelled": [sentence for modelled, sentence in sentences if modelled],
        "left out": [sentence for modelled, sentence in sentences if not modelled],
        "numbers": {
            "bodies": len(scene),
            "structural_certificates": certificates,
            "time_unit": scene.time_unit,
            "tick": scene.time_unit * 2.0**-52,
            "speed_bound": bounds.speed,
            "skin": bounds.skin.delta,
            "skin_in_radii": bounds.skin.delta / float(scene.radius.min()) if len(scene) else 0.0,
            "structural_error": bounds.skin.eta,
        },
    }


def _sentences(engine: Engine, certificates: int) -> Iterator[tuple[bool, str]]:
    """Yields sentences, each with True if it is about the model, False if it is about omissions."""
    scene, phases = engine.scene, engine.composition
    motion = "flying straight"
    if scene.accelerated:
        one = scene.acceleration[0].tolist() if len(scene) and scene.uniform else [0.0, 0.0]
        pulls = f"the acceleration {one!r}" if any(one) else f"accelerations up to {[*scene.pull]!r}"
        motion = f"flying with {pulls}, on chords for the broad phase,"
    yield True, f"{in_words(scene, len(scene))}, {motion} between contacts"
    left_out = ("" if scene.accelerated else "gravity, ") + "friction, rotation, growth"
    yield False, left_out + ("" if phases.rules is not None else " and any loss of energy")
    watched = "one structural certificate a body" if certificates else "no structural certificate"
    name = called(phases.broad_phase, phases.options)
    yield True, f"candidate pairs by the broad phase {name}, with {watched}"
    if phases.pair is None:
        yield False, "contacts of two bodies: no narrow phase for pairs is named"
    else:
        yield True, f"contacts of two bodies (narrow phases: {', '.join(phases.narrow_phases)})"
        coming = (each.mass for each in scene.commands if isinstance(each, Insert))
        masses = {*scene.mass.tolist(), *coming}
        if len(masses) < 2:
            yield False, "masses: all are equal"
        else:
            yield True, f"masses from {min(masses)!r} to {max(masses)!r}"
    if phases.rules is None:
        yield False, "responses by kind: every contact is elastic"
    else:
        kinds = f"{len(scene.kinds)} {'kind' if len(scene.kinds) == 1 else 'kinds'} of bodies"
        yield True, f"responses by kind: {', '.join(phases.rules.names)}, for {kinds} and the walls"
    if scene.periodic:
        periods = " and ".join(f"{scene.periods['xy'.index(axis)]!r} along {axis}" for axis in scene.periodic)
        yield True, f"images: the scene is periodic, {periods}; plans two units old are anchored again"
    if scene.arena is None:
        yield False, "walls: the scene has no arena"
    elif scene.periodic == "xy":
        yield False, "walls: both axes are periodic"
    elif phases.wall is None:
        yield False, "walls: the scene has an arena, but no narrow phase for walls is named"
    else:
        width, height = scene.arena
        walls = "two" if scene.periodic else "four"
        yield True, f"{walls} walls around {width!r} x {height!r}, one contact of each body awaited"
    if engine.commands:
        yield True, f"commands: {counted(scene.commands)} in the scene, and those given by hand"
    else:
        yield False, "commands (turns, insertions, removals): the scene has none"
    if engine.commands.name == "ALL" and not phases.living:
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


def reading_lines(found: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yields readings (``Readings.as_dict``) line by line, each with its label."""
    contacts = found["contacts"]
    checks, solves = found["partners_asked"], found["contacts_computed"]
    kinds = f"{found['contacts_disc']:,} of bodies, {found['contacts_wall']:,} with walls"
    yield "contacts", f"{contacts:,} ({kinds})"
    if found["passings"]:
        yield "passings", f"{found['passings']:,} begun; begin and end count as contacts of discs"
    turns = f", {found['turns']:,} turns" if found["turns"] else ""
    yield "events", f"{found['events']:,} ({found['structural_events']:,} structural{turns})"
    yield "certificates", f"{found['certificates_updated']:,} times set"
    yield "queue", f"at most {found['queue_max']:,} long"
    yield "candidate pairs", f"{found['newcomers']:,} new during the run"
    each = f" ({checks / contacts:.3g} and {solves / contacts:.3g} a contact)" if contacts else ""
    yield "contact times", f"{checks:,} candidate checks, {solves:,} exact solves{each}"
    yield "deepest overlap", f"{found['deepest_overlap']:.2g} radii"
    yield "unaccounted energy", f"{found['unaccounted_energy']:.2g} (relative; by no command or response)"
    yield "lateness", f"{found['lateness']:.2g} time units"
    if found["audits"]:
        yield "audits", f"{found['audits']:,}: nothing was found"
    loop, python, ready = (found[f"{name}_seconds"] for name in ("cpu", "python", "compile"))
    as_python = f" ({python:.3g} s as Python)" if python else ""
    yield "CPU time", f"{loop:.4g} s in the loop{as_python}, {ready:.3g} s to make it ready"
    events, rate = found["events_per_cpu_second"] / 1e6, found["contacts_per_cpu_second"] / 1e3
    yield "speed", f"{events:.3g} million events, {rate:,.4g} thousand contacts a CPU second"
    yield "fingerprint", found["fingerprint"]
