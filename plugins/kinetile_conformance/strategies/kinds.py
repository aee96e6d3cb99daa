"""Kinds of bodies, and rules for the contacts of each two. Every such scene also names the same responses for
kinds that no body has, so that one loop serves all scenes. A phase that does not accept passing bodies gets
the scenes without that rule (``acceptable``)."""

import math
from collections.abc import Iterable, Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from kinetile import Response, Scene, Settings
from kinetile_conformance.cases import Subject, is_living
from kinetile_conformance.deadline import begin_scene
from kinetile_conformance.strategies.changes import ended_at
from kinetile_conformance.strategies.strategy import numbered
from kinetile_conformance.strategies.swarms import anyhow, jitter, radii, slots, square

Rules = dict[Any, Any]

KINDS = ("ball", "wisp", "block")
ABSENT = ("nobody", "no one")
LOSSY = Response("restitution", e=0.5, contact_time=2.0**-10)
LEDGE = Response("restitution", e=0.5, contact_time=2.0**-10, grip=0.25, one_way=(0.5, 1.0))
SAME_LOOP: Rules = {("nobody", "nobody"): "stop", ("nobody", "no one"): LOSSY}
"""Rules for kinds that no body has: with them, scenes of any rules have one loop."""

NOBODY_PASSES: Rules = {("no one", "no one"): "pass"}
"""One more rule, refused by phases that need solid bodies."""

ANSWERS = ("elastic", "stop", LOSSY, Response("restitution", e=0.875, contact_time=2.0**-20))


def of_kinds(
    kinds: Sequence[int], mass: Iterable[float], random: np.random.Generator, passing: bool | None = None
) -> dict[str, Any]:
    """Returns the fields of a scene whose bodies have the kinds of these numbers, and masses: wisps pass
    through all others (None: in half of all scenes), blocks are immovable, and ledges where they are odd in
    number."""
    answers = [ANSWERS[int(random.choice([0, 0, 1, 2, 3]))] for _ in range(3)]
    pairs = (("*", "*"), ("*", "wall"), ("ball", "ball"))
    rules: Rules = dict(zip(pairs, answers, strict=True)) | SAME_LOOP | NOBODY_PASSES
    if passing if passing is not None else random.random() < 0.5:
        rules |= {("wisp", other): "pass" for other in KINDS}
    named = [KINDS[kind] for kind in kinds]
    if ("wisp", "block") in rules and named.count("block") % 2:
        rules["wisp", "block"] = LEDGE
    return {
        "kinds": (*KINDS, *ABSENT),
        "kind": named,
        "mass": [math.inf if k == "block" else float(m) for k, m in zip(named, mass, strict=True)],
        "responses": rules,
    }


def with_kinds(scene: Scene) -> Scene:
    """Returns a scene of elastic balls alone, with the loop of scenes with kinds."""
    rules: Rules = SAME_LOOP | NOBODY_PASSES
    return scene.replace(kinds=(*KINDS, *ABSENT), responses=rules, kind=["ball"] * len(scene))


BUILT = 80
"""The most commands of a living scene for a phase that each one rebuilds, in half a millisecond."""


def acceptable(subject: Subject, scene: Scene, known: dict[Any, tuple[int, bool]] | None = None) -> Scene:
    """Returns a scene that phases accept: with the response under test, without unused rules, on periodic
    axes without responses, only its beginning if commands are expensive; ``known`` keeps the answers."""
    scene, living, known = subject.dressed(scene), is_living(scene), {} if known is None else known
    choices: list[Rules] = [dict(scene.responses)]
    if NOBODY_PASSES.keys() & choices[0].keys():
        choices.append({pair: answer for pair, answer in scene.responses if pair not in NOBODY_PASSES})
        choices += [{}] if scene.periodic and not living else []
    long = living and len(scene.commands) > BUILT
    like = len(choices), long, scene.periodic, bool(scene.shapes)
    for at, rules in enumerate(choices if like not in known and (long or choices[1:]) else ()):
        begin_scene()
        with suppress(Exception):  # a foreign phase raises the same error in the check
            composition = subject.composition(scene.replace(responses=rules) if at else scene)
            known[like] = at, composition.living
            break
    at, keeps = known.get(like, (0, True))
    scene = scene.replace(responses=choices[at]) if at else scene
    return scene if keeps or not long else ended_at(scene, scene.commands[BUILT].time)


MANY = (9, 65, 256)


def of_many_kinds(number: int) -> Scene:
    """Returns bodies in a box, of up to 256 kinds with rules of their own; a quarter are immovable."""
    random = np.random.default_rng(number)
    bodies = int(random.integers(8, 80))
    kinds = [f"kind {each}" for each in range(MANY[number % len(MANY)])]
    side = square(bodies, 1.3)
    radius = radii(random, bodies, int(random.integers(8)))
    chosen = random.integers(0, len(kinds), bodies)
    chosen[: bodies // 4] = len(kinds) - 1 - np.arange(bodies // 4) % 3  # the last ones, each many times
    answers = [*ANSWERS, "pass"]
    two = chosen[random.integers(0, bodies, (4 * bodies, 2))].tolist()
    rules: Rules = {(kinds[a], kinds[b]): answers[int(random.integers(5))] for a, b in map(sorted, two)}
    return Scene(
        slots(random, bodies, side, side) + jitter(random, radius),
        anyhow(random, bodies),
        radius,
        mass=np.where(random.random(bodies) < 0.25, math.inf, 1.0),
        kind=[kinds[each] for each in chosen],
        kinds=(*ABSENT, *kinds),
        arena=(float(side), float(side)),
        responses=rules | SAME_LOOP | NOBODY_PASSES,
        settings=Settings(until=20.0),
    )


DRAWS = {"many kinds": numbered(of_many_kinds)}
