"""Observations of claims: the declarations of a phase, and its independence of other runs before or beside
it, of its process or thread, of unrelated fields of a scene, and of the view of a scene: enlarged, moved,
slowed, or begun later, by powers of two and dyadic shifts, so that nothing is rounded."""

from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import replace
from inspect import signature
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, get_args

import numpy as np

import kinetile as kt
from kinetile import Scene, Settings, registry
from kinetile.errors import BadOption, KinetileError, Refused
from kinetile.instruments import composition_of, relabelled
from kinetile_conformance.cases import CONTACTS, Subject, horizon, outcome, run_summary
from kinetile_conformance.checks.check import Case, Disagreement, DoesNotApply, compare, observation
from kinetile_conformance.checks.side_effects import interpreted
from kinetile_conformance.processes import Died, in_a_child
from kinetile_conformance.strategies.bulk import lattices, marathon
from kinetile_conformance.strategies.changes import viewed
from kinetile_conformance.strategies.swarms import anyhow, jitter, slots, swarm, swarm_of

FINEST = 45
"""Halvings of a scene within its arena; then its bodies are no larger than the rounding of their places."""

THICK = 2.0**-44
"""The size of a cluster whose skin is some six times the radius of a body."""

EDGES = 6
"""Scenes at the limit of the skin."""


def _cluster(seed: int, size: float) -> Scene:
    """Returns twelve bodies in the far corner of a unit square, with size and speed in proportion."""
    random = np.random.default_rng(seed)
    radius = random.uniform(0.35, 0.45, 12)
    place = slots(random, 12, 4, 4) + 0.96 * jitter(random, radius)  # rounded, none overlap
    velocity = anyhow(random, 12) + 0.5
    return swarm_of(1.0 - size * place, size * velocity, size * radius, (1.0, 1.0), 30.0)


@observation(replayed_by="same-contacts")
def skin_limit_holds_at_its_edge(case: Case) -> None:
    """Just below the skin limit that it declares it gives the reference's contacts, and above, it refuses;
    without a limit it gives them where the skin is several times as thick as bodies are wide."""
    for seed in range(EDGES):
        size, how = THICK, "far thicker than bodies are wide"
        if case.subject.composition(_cluster(0, 2.0**-4)).broad.skin_limit is not None:
            size, how = _thickest(case.subject, seed), "just below its limit"
        edge = replace(case, scene=_cluster(seed, size))
        compare(edge, outcome(case.subject, edge.scene), f"with a skin {how}, ")


def _thickest(subject: Subject, seed: int) -> float:
    """Returns the smallest size of a cluster that a phase does not refuse, found by bisection."""
    accepted, refused = 2.0**-4, 2.0**-FINEST
    for _ in range(FINEST):
        size = float(np.sqrt(accepted * refused))
        try:
            sim = subject.simulation(_cluster(seed, size))
        except Refused:
            refused = size
            continue
        accepted = size
        limit, skin = composition_of(sim).broad.skin_limit, float(sim.tables.clock[0].limits.skin)
        if limit is not None and limit < skin:
            text = f"it declares a skin limit of {limit!r}, and runs with a skin of {skin!r}"
            raise Disagreement(text, _cluster(seed, size))
    return accepted


@observation(judges="broad")
def its_features_are_known(case: Case) -> None:
    """Every feature that it declares is one for which there is a check"""
    from kinetile_conformance.checks import CHECKS

    known = sorted({each.observation.feature for each in CHECKS if each.observation.feature is not None})
    declared = registry().spec("broad phase", case.subject.name).features
    for feature in sorted(declared.difference(known)):
        raise Disagreement(
            f"it declares the feature {feature!r}, which nothing can disprove; features that are put to the "
            f"test: {', '.join(known)}"
        )


VALUES: dict[Any, tuple[Any, ...]] = {bool: (False, True), int: (2, 5), float: (0.75, 3.0), str: ("x", "y")}
"""Values of options that are annotated so, an axis where it is a text; a ``Literal`` has its own."""


def _options(subject: Subject) -> Iterator[tuple[str, Any]]:
    """Yields each option of a broad phase with up to two values other than that under test."""
    with suppress(NameError, ValueError, TypeError):  # annotations without meaning here
        phase = registry().target("broad phase", subject.name)
        for name, each in signature(phase, eval_str=True).parameters.items():
            kinds = get_args(each.annotation) or (each.annotation,)
            values = [v for kind in kinds for v in VALUES.get(kind, (kind,) if isinstance(kind, str) else ())]
            others = [value for value in values if value != subject.options.get(name, each.default)]
            yield from ((name, value) for value in others[:2])


@observation(judges="broad")
def same_contacts_with_other_options(case: Case) -> None:
    """Where one of its options has another value, it gives the reference's contacts too"""
    if not any(_options(case.subject)):
        raise DoesNotApply("it has no options with values that are known")
    interpreted(_with_other_options, case.subject, _scenes())


def _with_other_options(subject: Subject, scenes: Sequence[Scene]) -> str | None:
    expected = [run_summary(subject.reference, scene) for scene in scenes]
    for name, value in _options(subject):
        other = replace(subject, options={**subject.options, name: value})
        for scene, right in zip(scenes, expected, strict=True):
            with suppress(Refused, BadOption):
                ended, fingerprint = run_summary(other, scene)
                if (ended, fingerprint) != right:
                    text = f"with {name} = {value!r} it {ended}, and the reference {right[0]}"
                    return text if ended != right[0] else f"with {name} = {value!r} the contacts are others"
    return None


TURNS = 10
"""The number of alternate runs of each of two simulations."""


@observation()
def state_is_not_kept(case: Case) -> None:
    """It repeats itself after other simulations, one of bodies half as large among them, and beside one: it
    gives the same contacts"""
    subject, scene = case.subject, case.scene
    # No scene of this size has run before, so data cached for the first scene of a size has half radii.
    large = viewed(scene, larger=8.0)
    for each in (large.replace(radius=0.5 * large.radius), large):
        compare(replace(case, scene=each), outcome(subject, each, case.contacts), "after half radii, ")
    first = run_summary(subject, scene)
    run_summary(subject, swarm("gas" if scene.arena is not None else "cloud", 16))
    # As many bodies, flying the other way: state shared between two simulations would show.
    sims = [subject.simulation(each) for each in (scene, scene.replace(velocity=-scene.velocity))]
    ends = ["ran", "ran"]
    for _ in range(TURNS):
        for which, sim in enumerate(sims):
            if ends[which] == "ran":
                try:
                    sim.run(until=max(horizon(scene), sim.time), max_contacts=CONTACTS // TURNS)
                except KinetileError as error:
                    ends[which] = type(error).__name__
    beside, again = (ends[0], sims[0].fingerprint), run_summary(subject, scene)
    for how, found in (("side by side with another", beside), ("after others", again)):
        if found != first:
            raise Disagreement(
                f"{how} it {found[0]}; the first run {first[0]}"
                + ("" if found[1] == first[1] else ", and the contacts are others")
            )


@observation()
def same_contacts_after_a_change_of_view(case: Case) -> None:
    """The reference's contacts on the enlarged, moved, slowed or later scene"""
    for how, view in _views(case.scene):
        compare(replace(case, scene=view), outcome(case.subject, view, case.contacts), f"{how}, ")


def _views(scene: Scene) -> Iterator[tuple[str, Scene]]:
    yield "32 times as large", viewed(scene, larger=32.0)
    yield "2^40 times as small", viewed(scene, larger=2.0**-40)
    yield "256 times as slow", viewed(scene, slower=256.0)  # so long that the base of the clock moves
    yield "started at 2^40", viewed(scene, later=2.0**40)
    if scene.arena is None and len(scene):
        yield "moved", scene.replace(position=scene.position + np.array([2.0**12, -(2.0**9)]))
        aside = scene.position - np.ceil(scene.position.max(axis=0))
        yield "moved to where all coordinates are negative", scene.replace(position=aside)


OTHER_HASHES = {"PYTHONHASHSEED": "4711"}
"""The environment of the other process: the order of a set differs there."""


def _scenes() -> list[Scene]:
    """Returns scenes with arenas, which all phases accept; in the first each body meets each."""
    of_lattices = [lattices(count, seed, arena=True) for count, seed in ((1, 1), (1, 7), (9, 2))]
    return [marathon(5, 0), *of_lattices, swarm("gas", 30), swarm("shear", 40, variation=1)]


def _summaries(
    subject: Subject, started: Sequence[Scene | Path], ends: Iterable[float]
) -> list[tuple[str, str]]:
    """Runs scenes, and resumes saved simulations; returns the end of each, and its fingerprint."""
    return [_summary(subject, each, end) for each, end in zip(started, ends, strict=True)]


def _summary(subject: Subject, started: Scene | Path, end: float) -> tuple[str, str]:
    if isinstance(started, Scene):
        return run_summary(subject, started, end)
    try:
        sim = kt.resume(started)
        sim.run(until=end, max_contacts=CONTACTS - len(sim.contacts))
    except Exception as error:  # a foreign phase may raise any error; the verdict names it
        return f"{type(error).__name__}: {error}", ""
    return "ran", sim.fingerprint


def _saved(subject: Subject, scene: Scene, path: Path) -> Path:
    sim = subject.simulation(scene)
    sim.run(until=horizon(scene), max_contacts=CONTACTS // 3)
    sim.save(path)
    return path


@observation()
def does_not_see_who_asks(case: Case) -> None:
    """Contacts do not depend on process, thread, origin, or the end of the scene; a saved run goes
    on in another process"""
    subject, scenes = case.subject, _scenes()
    ends = [horizon(each) for each in scenes]
    plain = _summaries(subject, scenes, ends)
    later, endless = (
        [relabelled(each, settings=Settings(until=until), origin={"recipe": "production"}) for each in scenes]
        for until in (2.0**20, None)
    )
    with TemporaryDirectory() as folder, ThreadPoolExecutor(1, thread_name_prefix="worker-7") as thread:
        saved = [_saved(subject, each, Path(folder) / f"saved-{at}") for at, each in enumerate(scenes)]
        try:  # the first saved one, before any other run there
            there = in_a_child(
                _summaries, subject, [*saved, *scenes], [*ends, *ends], environment=OTHER_HASHES
            )
        except Died as died:
            raise Disagreement(f"in another process it does not run: {died}") from None
        views = {
            "with another origin and a later end": _summaries(subject, later, ends),
            "with another origin and no end": _summaries(subject, endless, ends),
            "in another thread": thread.submit(_summaries, subject, scenes, ends).result(),
            "in another process": there[len(saved) :],
            "saved, and resumed in another process": there[: len(saved)],
        }
    for how, summaries in views.items():
        for shown, one, other in zip(scenes, plain, summaries, strict=True):
            if one[0] != other[0]:
                raise Disagreement(f"{how}, the run {other[0]}; before it {one[0]}", shown)
            if one != other:
                raise Disagreement(f"{how}, the contacts are others", shown)
