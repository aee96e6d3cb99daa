"""Every public call, with values of eighty sorts in the place of each argument: it answers, or refuses by a
sentence of kinetile's own that names the argument or the value, and what it was called on is as before."""

import inspect
import random
import traceback
from collections.abc import Callable, Iterator, Mapping
from copy import deepcopy
from dataclasses import dataclass, field
from datetime import date
from decimal import Decimal
from enum import Enum
from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import kinetile as kt
from kinetile.errors import KinetileError, MissingExtra
from kinetile.scene.checks import shown
from lanes import first

_Colour = Enum("_Colour", ["RED"])
_BOX, _TURN = kt.box(0.1, 0.1), kt.Turn(0, 1.0, (0.0, 0.0))

ODD: list[Any] = [
    *(None, True, False, 0, 1, -1, 3, 2**70, 10**5000, 0.5, -0.0, float("nan"), float("inf"), 1e300, 1j),
    *("", "x", "no", "*", "wall", b"x", "\ud800", "a\0b", [], [[]], [1], [1.0, 2.0], [[1.0]], [[1, 2], [3]]),
    *([1, [2]], [None], (0.5, 0.5), ("x", "y"), iter([1]), range(3), {}, {"x": 1}, {"disc": {"e": 1}}),
    *({(0, 1): 2}, {1, 2}, np.float64(0.5), np.int64(2), np.bool_(True), np.str_("x"), np.ma.masked),
    *(np.array(0.5), np.array([]), np.zeros((2, 2)), np.array(["a", "b"]), np.array([1, None], object)),
    *(np.datetime64("2000-01-01"), object(), int, lambda *_: None, _Colour.RED, Fraction(1, 2), Decimal(1)),
    *(date(2000, 1, 1), Path("x"), ValueError("x"), kt.disc(0.1), _BOX, [_BOX], _TURN, [_TURN]),
    *(-5, 2**31, 1e-320, b"", bytearray(b"x"), frozenset({"x"}), (1, 2, 3), [(0.5, 0.5)], [float("nan")] * 2),
    *(np.float32(0.1), np.complex128(1), np.array([[True]]), slice(1), ..., kt.Settings(), NotImplemented),
]

NOT_CALLED = {
    "CastHit",
    "Event",
    "Inserted",
    "NextContact",
    "Progress",
    "RayHit",
    "Snapshot",
    "hookimpl",
    "Moment",
    "Observable",
    "Recorder",
    "Collisions",
}
"""Results, which nobody makes, and a marker of pluggy."""

READ_BY = {
    **dict.fromkeys(("Turn", "Insert", "Remove", "Accelerate", "SetKind", "Move"), "commands"),
    "Settings": "settings",
    "Response": "responses",
}
"""Values that say nothing before a scene has them, with the argument that takes them."""

GIVEN = {
    "Scene": ("radius",),
    "Insert": ("radius",),
    "Simulation.insert": ("radius",),
    "Simulation.insert_many": ("radius",),
    "Simulation.bodies_near": ("k",),
    "Simulation.run": ("max_events",),
    "compare": ("broad_phases", "max_contacts"),
}
"""Arguments that are always given, though they have defaults."""

OTHER_WORDS = {
    **{"plugin": ["hook"], "plugins": ["hook"], "body": ["bod", "cast"], "bodies": ["body"]},
    **{"velocities": ["velocity"], "core": ["corner"], "observe": ["observable"], "position": ["room"]},
    **{"until": ["end"], "pairs": ["bod"]},
}
"""What messages say for some arguments."""

Call = Callable[..., Any]


def made_and_used(kind: Any, use: Call) -> Call:
    """Returns what makes a value and has it used, with the signature of its constructor."""

    def call(*args: Any, **values: Any) -> Any:
        return use(kind(*args, **values))

    return vars(call).setdefault("__signature__", inspect.signature(kind)) and call


@dataclass
class Stage:
    """What calls are made on."""

    folder: Path
    scene: kt.Scene = field(init=False)

    def __post_init__(self) -> None:
        flies = [(0.5, 0.25), (-0.25, 0.5), (0.0, 0.0)]
        about = {"kind": ["ball", "ball", "peg"], "names": ["first", None, None], "arena": (1, 1)}
        place, end = [(0.25, 0.25), (0.75, 0.75), (0.75, 0.25)], kt.Settings(until=1.0)
        self.scene = kt.Scene(place, flies, 0.1, settings=end, **about)
        self.still = kt.Simulation(kt.Scene([(0.5, 0.5)], [(0, 0)], 0.1, arena=(1, 1)), "naive")
        self.sim = kt.Simulation(self.scene, "naive", live=True)
        rows: list[Any] = []
        self.sim.run(0.5, recorder=lambda each: rows.append(each.copy()))
        self.trajectory = kt.Trajectory(np.concatenate(rows), self.scene)
        self.before = self.sim.snapshot()
        self.sim.save(self.folder / "run.kt")
        kt.save_scene(self.scene, self.folder / "scene.toml")
        self.calls = dict(self._calls())

    def _calls(self) -> Iterator[tuple[str, Call]]:
        owners = {"Simulation": self.sim, "Scene": self.scene, "Trajectory": self.trajectory}
        owners["Registry"] = kt.Registry()
        for name in kt.__all__:
            call = getattr(kt, name)
            if not callable(call) or name in NOT_CALLED:
                continue
            if name in READ_BY:
                call = made_and_used(call, lambda value, by=READ_BY[name]: self._in_scene(by, value))
            if name == "Obstacle":
                call = made_and_used(call, lambda each: kt.with_obstacles(self.scene, [each]))
            if name == "StopAt":
                call = made_and_used(call, lambda stop: self.sim.run(max_events=2, stop_at=stop))
            yield name, call
            for method, member in inspect.getmembers(owners.get(name, SimpleNamespace()), callable):
                if not method.startswith("_") and inspect.signature(member).parameters:
                    yield f"{name}.{method}", member

    def _in_scene(self, argument: str, value: Any) -> kt.Scene:
        return self.scene.replace(**{argument: [value] if argument == "commands" else value})

    def right(self, call: str, name: str) -> Any:
        """A right value for an argument that a call needs."""
        corners = ((0, 0), (1, 0), (0, 1))
        scene, sim, still, path = self.scene, self.sim, self.still, self.folder
        own: Mapping[str, Any] = {
            "Scene": {"position": scene.position, "velocity": scene.velocity},
            "Simulation.cast": {"body": (0.5, 0.5, 0.05)},
            "resume": {"path": path / "run.kt"},
            "load_scene": {"path": path / "scene.toml"},
            "Response": {"name": "pass"},
            "make_scene": {"name": "grid"},
            **{each: {"a": (0, 0), "b": (1, 0)} for each in ("capsule", "segment")},
        }
        if call.startswith("Registry"):
            own[call] = {"kind": "broad phase", "name": "naive"}
        usual = {
            **{"scene": scene, "sim": sim, "source": sim, "thing": sim, "simulation": still},
            **{"trajectory": self.trajectory, "rows": self.trajectory.rows, "snapshot": self.before},
            **{"body": 0, "bodies": [0], "a": 0, "b": 1, "name": "first", "kind": "ball", "role": "pair"},
            **dict.fromkeys(("position", "point", "origin"), (0.15, 0.85)),
            **dict.fromkeys(("velocity", "velocities", "acceleration", "accelerations"), (0.0, 0.0)),
            **{
                "positions": [(0.15, 0.85)],
                "box": (0, 0, 1, 1),
                "direction": (1, 0),
                "time": 0.75,
                "times": [1.0],
            },
            **dict.fromkeys(("width", "height", "radius"), 0.1),
            **{
                "shape": kt.disc(0.1),
                "core": corners,
                "corners": corners,
                "points": corners,
                "obstacles": [],
            },
            **{
                "path": path / "new.file",
                "plugin": object(),
                "target": "module:Class",
                "count": 0,
                "row": 0,
                "k": 1,
            },
            **{"max_events": 2, "max_contacts": 2, "broad_phases": ["naive", "cells"]},
        }
        return own.get(call, {}).get(name, usual.get(name))

    def try_one(self, label: str, name: str, odd: Any, key: str) -> None:
        """Calls with one odd argument; ``key`` is its name where a call takes any."""
        if (label, name) == ("view", "until") and isinstance(odd, float | int) and odd > 1e6:
            return  # a page of that much takes its time
        args, values = list[Any](), dict[str, Any]()
        for each in inspect.signature(self.calls[label]).parameters.values():
            if each.kind is each.VAR_KEYWORD:
                values |= {key: odd} if each.name == name else {}
            elif each.name == name or each.default is each.empty or each.name in GIVEN.get(label, ()):
                value = odd if each.name == name else self.right(label, each.name)
                args += [value] if each.kind is each.POSITIONAL_ONLY else []
                values |= {} if each.kind is each.POSITIONAL_ONLY else {each.name: value}
        result = self.calls[label](*args, **values)
        if isinstance(result, Iterator):
            next(result, None)


OF_NOBODY = "there is no body "
"""What an IndexError says."""


def is_a_sentence(error: BaseException, name: str, odd: Any) -> bool:
    """Whether an error was raised on purpose, and names an argument, or the value that was found there."""
    frame = traceback.extract_tb(error.__traceback__)[-1]
    ours = "kinetile" in frame.filename and str(frame.line).startswith("raise")
    ours = isinstance(error, KinetileError) or (
        ours and isinstance(error, TypeError | ValueError | IndexError)
    )
    if isinstance(error, MissingExtra) or (name == "path" and isinstance(error, OSError)):  # there is no file
        return True
    text, words = str(error).lower(), (name.rstrip("s"), name.rpartition("_")[2].rstrip("s"), shown(odd))
    said = any(word.lower() in text for word in (*words, *OTHER_WORDS.get(name, ()), "mistake", OF_NOBODY))
    return ours and said


@pytest.mark.small
@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize("share", first(1, [0.02, 1.0]))
def test_a_public_call_ended_in_an_error_of_python(share, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "agg")
    rng, stage, wrong, count = random.Random(1), Stage(tmp_path), list[str](), 0
    for label in stage.calls:
        with pytest.raises(TypeError, match=r"nothing_like_it|needs name|missing"):
            stage.calls[label](nothing_like_it=1)
        for name in inspect.signature(stage.calls[label]).parameters:
            for odd in deepcopy(rng.sample(ODD, max(1, round(share * len(ODD))))):
                key = rng.choice(["arena", "bodies", "density", "e", "kind", "velocity"])
                where, count = f"{label}({name}={shown(odd)})", count + 1
                try:
                    stage.try_one(label, name, odd, key)
                except Exception as error:
                    if not is_a_sentence(error, key if name in ("changes", "parameters") else name, odd):
                        wrong.append(f"{where}: {type(error).__name__}: {error}")
                    if stage.sim.snapshot() != stage.before:
                        wrong.append(f"{where}: it has changed")
                        stage = Stage(tmp_path)
                else:
                    stage = Stage(tmp_path) if stage.sim.snapshot() != stage.before else stage
    assert not wrong, f"{len(wrong)} of {count:,} calls:\n" + "\n".join(wrong)
