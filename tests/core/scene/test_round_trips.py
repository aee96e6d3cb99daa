"""A scene that is saved and loaded is the same scene: every field of it, and so the contacts of a run."""

import copy
import math
import pickle
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import kinetile as kt
from kinetile.kernel.clock import TICKS, Clock
from kinetile.scene.files import dumps_scene, loads_scene

ARRAYS = ("position", "velocity", "radius", "mass", "kind_numbers", "shape")
VALUES = ("arena", "commands", "turns", "start", "unit", "time_unit", "kind", "kinds")
VALUES += ("responses", "meets", "shapes", "settings", "_ruled", "capacity")


def everything(scene: kt.Scene) -> tuple[Any, ...]:
    """Returns all that a scene says, in a form in which -0.0 is not 0.0, 1 not 1.0, and NumPy's 1 not 1."""
    return (
        *(getattr(scene, name).tobytes() for name in ARRAYS),
        *(repr(getattr(scene, name)) for name in VALUES),
    )


def again(scene: kt.Scene) -> kt.Scene:
    return loads_scene(dumps_scene(scene))


def two(**more: Any) -> kt.Scene:
    return kt.Scene([[1.0, 1.0], [3.0, 1.0]], [[1.0, 0.0], [-1.0, 0.0]], 0.5, arena=(6.0, 6.0), **more)


ONE_KIND = two(kind="ball", responses={("ball", "ball"): "stop"})


B_AND_A = [kt.Insert(3.0 - k, (2.0 * k - 1.0, 1.0), (0.0, 0.0), 0.1, kind="-ba"[k]) for k in (1, 2)]
LOST = {
    "all bodies of one kind": ONE_KIND,
    "of one kind that is a number": two(kind=7, responses={(7, "wall"): "stop"}),
    "kinds from an array of text": two(kind=np.array(["a", "b"])),
    "kinds from an array of whole numbers": two(kind=np.array([3, 4], dtype=np.int8)),
    "turns of one time, in an order of their own": two(
        commands=[kt.Turn(1, 1.0, (0.0, 0.0)), kt.Turn(0, 1.0, (0.0, 0.0))]
    ),
    "a command's kind from an array": two(
        commands=[kt.Insert(1.0, (5.0, 5.0), (0.0, 0.0), 0.1, kind=np.int64(0))]
    ),
    "kinds that come in another order than they are given in": kt.Scene([], [], [], commands=B_AND_A),
    "options of a response with numbers of NumPy": two(
        responses=kt.Response("restitution", e=np.float64(0.5), contact_time=np.float32(0.25))
    ),
    "options of a phase with tuples": two(
        settings=kt.Settings(options={"naive": {"pair": (1, (2.5, True))}})
    ),
    "an origin that is written in several lines": two(
        origin={"recipe": "drawn", "parameters": {"shape": np.eye(3)}}
    ),
}


@pytest.mark.parametrize("scene", LOST.values(), ids=LOST)
def test_what_was_lost_or_came_back_as_something_else(scene, monkeypatch):
    monkeypatch.setattr("kinetile.scene.files.option_mistakes", lambda *given: [])
    assert everything(again(scene)) == everything(scene)
    assert again(scene) == scene
    assert pickle.loads(pickle.dumps(scene)) == copy.deepcopy(scene) == scene


KINDS = ("ball", "sensor", "7", 7, 0, 2**31 - 1, "ä \"quoted\"\n'kind'", "between", "a.b")
NUMBERS = (0.0, -0.0, 5e-324, -5e-324, 2.0**-1022, 0.1, 1 / 3, -2.5, 1e-300)
LARGE = (1e22, 1e16, 1e-7, 123456789.125, 2.0**53 + 2, -(2.0**200))
UNITS = (1.0, 2.0**-10, 2.0**-40)
LOSSY = ("restitution", {"e": 0.875, "contact_time": 2.0**-900})
numbers = st.sampled_from(NUMBERS) | st.floats(-8.0, 8.0)
masses = st.sampled_from([1.0, math.inf, 2.0**-50, 3.5, 2.0**40])
radii = st.sampled_from([0.1, 1 / 3, 2.0**-60]) | st.floats(2.0**-20, 0.4)
velocities = st.tuples(numbers, numbers)
anything = st.sampled_from(NUMBERS + LARGE) | st.floats(allow_nan=False, allow_infinity=False)
fast = st.sampled_from(NUMBERS + LARGE) | st.floats(-(2.0**200), 2.0**200)
flights = st.tuples(fast, fast)
"""Where the clock's unit follows from the speeds, and the start is 0."""

texts = st.text(st.characters(exclude_categories=["Cs"]))
odd_options = st.dictionaries(
    st.text("aä .\n\x7f\"'-", max_size=3), anything | st.booleans() | st.integers() | texts
)
places = st.tuples(st.floats(1.0, 99.0), st.floats(1.0, 99.0))
names = st.sampled_from(["elastic", "stop", "pass", LOSSY, ("restitution", {"e": 1.0})])


@st.composite
def _commands(draw: st.DrawFn, bodies: int, start: float, unit: float, kinds: list[Any]) -> list[Any]:
    """Returns commands that can be carried out, commands of different ticks in any order."""
    ticks = st.tuples(st.integers(0, 3), st.sampled_from([0, 0, 1, TICKS - 1]), st.integers(0, 2))
    there, free, found = list(range(bodies)), bodies, []
    for key in sorted(draw(st.lists(ticks, max_size=6))):
        time = start + (key[0] + key[1] / TICKS) * unit
        at = key if any(key[1:]) or draw(st.booleans()) else None
        what = draw(st.sampled_from(["turn", "remove", "insert"] if there else ["insert"]))
        if what == "insert":
            number = draw(st.sampled_from([free, free, free + 3]))
            kind = draw(st.none() | st.sampled_from(kinds))
            body = (draw(radii), draw(masses), number, at, kind)
            found.append((key, kt.Insert(time, draw(places), draw(velocities), *body)))
            there.append(number)
            free = number + 1
            continue
        body = draw(st.sampled_from(there))
        if what == "remove":
            there.remove(body)
            found.append((key, kt.Remove(body, time, at)))
        else:
            found.append((key, kt.Turn(body, time, draw(velocities), at)))
    groups = [[each for _, each in group] for _, group in groupby(found, lambda pair: pair[0])]
    return [each for group in draw(st.permutations(groups)) for each in group]


@st.composite
def _responses(draw: st.DrawFn, kinds: list[Any]) -> Any:
    """Returns responses for these kinds, such that no two rules contradict each other."""
    one = st.sampled_from(kinds)
    pairs = draw(st.lists(st.tuples(one, one), max_size=4))
    pairs += draw(st.lists(st.sampled_from([("*", "*"), ("wall", "*"), ("*", kinds[0])]), max_size=3))
    pairs += [(draw(one), "wall")] if draw(st.booleans()) else []
    rules: dict[Any, Any] = {}
    for a, b in pairs:
        name = draw(names)
        if (b, a) not in rules and not (name == "pass" and "wall" in (a, b)):
            rules[a, b] = kt.Response(name[0], **name[1]) if isinstance(name, tuple) else name
    return rules


@st.composite
def scenes(draw: st.DrawFn) -> kt.Scene:
    """Scenes with everything that a scene can have; the clock's unit is given where its ticks are named."""
    bodies = draw(st.integers(0, 4))
    pool = draw(st.lists(st.sampled_from(KINDS), min_size=1, max_size=4, unique=True))
    unit = draw(st.sampled_from(UNITS))
    start = draw(st.sampled_from([0.0, -0.0, 0.5, -3.0, 1000.0]))
    kind = draw(
        st.none() | st.sampled_from(pool) | st.lists(st.sampled_from(pool), min_size=bodies, max_size=bodies)
    )
    commands = draw(_commands(bodies, start, unit, pool))
    each = [0] * bodies if kind is None else kind if isinstance(kind, list) else [kind] * bodies
    come = [command.kind for command in commands if isinstance(command, kt.Insert)]
    there = [*each, *(kind for kind in come if kind is not None)]
    declared = draw(st.none() | st.permutations(list(dict.fromkeys([*pool, *there]))))
    named = declared or list(dict.fromkeys(there)) or pool
    options = st.fixed_dictionaries({"sap-1d": st.fixed_dictionaries({"axis": st.sampled_from("xy")})})
    options |= st.fixed_dictionaries({"naive": odd_options})
    phases = st.none() | st.sampled_from(["cells", "sap-1d"])
    given_unit = draw(st.just(unit) | st.none()) if all(each.at is None for each in commands) else unit
    end = draw(
        st.none() | st.tuples(st.integers(0, 3), st.sampled_from([0, 1, TICKS // 3]), st.integers(0, 2))
    )
    until = draw(st.none() | st.sampled_from([1000.0, 1234.5]))
    if end is not None and given_unit is not None:
        until = Clock(start, unit).time(end[0] * TICKS + end[1])
    else:
        end = None
    return kt.Scene(
        [(10.0 * body + 5.0, draw(st.floats(1.0, 99.0))) for body in range(bodies)],
        [draw(velocities if start or given_unit else flights) for _ in range(bodies)],
        [draw(radii) for _ in range(bodies)],
        [draw(masses) for _ in range(bodies)],
        draw(st.none() | st.just((100.0, 100.0))),
        start=start,
        settings=kt.Settings(
            draw(phases),
            draw(st.none() | st.sampled_from([("disc", "wall"), ()])),
            draw(st.just({}) | options),
            until,
            end,
        ),
        commands=commands,
        unit=given_unit,
        kind=kind,
        responses=draw(_responses(named)),
        kinds=declared,
    )


@pytest.fixture(scope="module")
def path(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("saved") / "scene.toml"


@settings(deadline=None)
@example(ONE_KIND)
@given(scene=scenes())
def test_every_field_comes_back(path, scene):
    kt.save_scene(scene, path)
    with pytest.MonkeyPatch.context() as patch:  # as if every phase had every option
        patch.setattr("kinetile.scene.files.option_mistakes", lambda *given: [])
        loaded = kt.load_scene(path)
    assert everything(loaded) == everything(scene)
    assert loaded == scene
    assert hash(loaded) == hash(scene)
    assert dumps_scene(loaded).partition("\n\n")[2] == dumps_scene(scene).partition("\n\n")[2]
