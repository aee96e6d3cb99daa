"""Cost of a frame of an interactive program: commands, a sixtieth of a unit of time, and reading the state.

Each frame turns some discs in one call, removes some, inserts as many, runs on, and reads all positions and
the new contacts. The discs and their new velocities are drawn from a seed; a disc is inserted where another
has just been removed, where there is room. So all phases get the same commands, and must give the same
contacts: whether they did is part of the result.

A frame's cost is the CPU time of this thread in all of these calls, of Python's part as well as the loop's.
The draws are a program's own and are not counted. The loop is compiled before the first frame; a frame that
compiles would show in ``compile_seconds``, and a program that gets slower as it plays in ``drift``.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from kinetile import Simulation, make_scene
from kinetile.errors import BadOption, Refused
from kinetile.kernel.compiled import compiling_seconds
from kinetile.plugin.choices import write_phase
from kinetile_accuracy.environment import environment
from kinetile_bench.benchmark import Choice, PhasesMeasured, phases_with_options

PARTS = ("turns", "goings", "comings", "run", "reading")
"""What a frame consists of: the columns of ``_frames``."""

FIRST = 3
"""Frames that are reported apart from the rest: they hold the first commands of each kind."""

_SHARE = 10  # of the frames, the first and the last such part are compared


class Play(NamedTuple):
    """The scene and the commands of a frame.

    Attributes:
        bodies: discs, a square number.
        density: their area, of the unit square.
        speed: root of their mean square speed, lengths a unit of time.
        rate: frames a unit of time.
        turned: discs that turn in each frame.
        exchanged: discs that are removed in each frame, and inserted.
        seed: of the scene and of all draws.
    """

    bodies: int = 1024
    density: float = 0.25
    speed: float = 1.0
    rate: int = 60
    turned: int = 50
    exchanged: int = 5
    seed: int = 1


@dataclass(frozen=True)
class FrameRow:
    """Cost of the frames under one phase; times are CPU milliseconds.

    Attributes:
        phase: the broad phase, with its options.
        refused: why the phase cannot do it; then there are no figures.
        median, p99, worst: of a whole frame, the first ``FIRST`` apart.
        first: the first frames, each.
        parts: the median of each part (``PARTS``).
        drift: the median of the last tenth of the frames, over that of the first tenth.
        compile_seconds: spent on compiling, or on loading compiled code, after the first frame began.
        contacts: in all frames.
        fingerprint: of these contacts.
    """

    phase: str
    refused: str | None = None
    median: float | None = None
    p99: float | None = None
    worst: float | None = None
    first: tuple[float, ...] = ()
    parts: Mapping[str, float] | None = None
    drift: float | None = None
    compile_seconds: float | None = None
    contacts: int | None = None
    fingerprint: str | None = None


@dataclass(frozen=True)
class FrameBench(PhasesMeasured):
    """All rows, and where and with what they were measured."""

    rows: tuple[FrameRow, ...]
    conditions: Mapping[str, Any]


def bench_frames(
    phases: Sequence[Choice],
    frames: int = 600,
    play: Play | None = None,
    *,
    start: Callable[[Any], Any] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Iterator[FrameBench]:
    """Measures a number of frames under each of the phases, one after the other; yields what there is after
    each.

    ``start`` is called with a simulation before its first frame, ``progress`` with the frames done and their
    total.

    Raises BadOption for fewer than twenty frames or more changes than discs, and what ``Simulation`` and
    ``make_scene`` raise, but for Refused, which is a row.
    """
    play = Play() if play is None else play
    if frames < 2 * _SHARE:
        raise BadOption(
            f"there are {frames} frames; expected at least {2 * _SHARE}, for a first and a last part"
        )
    if play.turned + play.exchanged > play.bodies:
        changes = f"{play.turned} that turn and {play.exchanged} that go"
        raise BadOption(f"of {play.bodies} discs there cannot be {changes} in a frame")
    scene = make_scene("grid", bodies=play.bodies, density=play.density, speed=play.speed, seed=play.seed)
    chosen = phases_with_options(phases)
    rows: list[FrameRow] = []
    for name, options in chosen:

        def count(frame: int) -> None:
            if progress is not None:
                progress(len(rows) * frames + frame, len(chosen) * frames)

        label = write_phase(name, options)
        try:
            sim = Simulation(scene, name, options=options, live=True)
            if start is not None:
                start(sim)
            rows.append(_row(label, sim, frames, play, count))
        except Refused as refused:
            rows.append(FrameRow(label, refused=str(refused)))
        yield FrameBench(tuple(rows), environment() | {"frames": frames} | play._asdict())


def _row(label: str, sim: Any, frames: int, play: Play, count: Callable[[int], None]) -> FrameRow:
    """Runs the frames, and returns their cost."""
    sim.compile()
    compiled = compiling_seconds()
    parts = 1e3 * _frames(sim, frames, play, count)
    compiled = compiling_seconds() - compiled
    whole = parts.sum(axis=1)
    later = slice(min(FIRST, frames - 1), None)
    tenth = frames // _SHARE
    return FrameRow(
        phase=label,
        median=float(np.median(whole[later])),
        p99=float(np.quantile(whole[later], 0.99)),
        worst=float(whole[later].max()),
        first=tuple(whole[:FIRST].tolist()),
        parts=dict(zip(PARTS, np.median(parts[later], axis=0).tolist(), strict=True)),
        drift=float(np.median(whole[-tenth:]) / np.median(whole[later][:tenth])),
        compile_seconds=compiled,
        contacts=len(sim.contacts),
        fingerprint=sim.fingerprint,
    )


def _frames(sim: Any, frames: int, play: Play, count: Callable[[int], None]) -> Any:
    """Returns the CPU seconds of each part of each frame, (frames, parts)."""
    rng = np.random.default_rng(play.seed)
    radius, spread = float(sim.scene.radius[0]), play.speed / np.sqrt(2.0)
    spent = np.zeros((frames, len(PARTS)))
    clock = time.thread_time
    bodies, places, seen = sim.bodies, sim.positions(), 0
    for frame in range(frames):
        drawn = rng.choice(len(bodies), play.turned + play.exchanged, replace=False)
        turned, gone = bodies[drawn[: play.turned]], bodies[drawn[play.turned :]].tolist()
        vacant = places[drawn[play.turned :]].tolist()
        flies = rng.normal(0.0, spread, (play.turned, 2))
        come = rng.normal(0.0, spread, (play.exchanged, 2)).tolist()
        began = clock()
        sim.set_velocities(turned, flies)
        turns = clock()
        for body in gone:
            sim.remove(body)
        goings = clock()
        for place, velocity in zip(vacant, come, strict=True):
            sim.insert(place, velocity, radius)
        comings = clock()
        sim.run(until=sim.scene.start + (frame + 1) / play.rate)
        ran = clock()
        bodies, places = sim.bodies, sim.positions()
        seen += len(sim.contacts_since(seen))
        read = clock()
        spent[frame] = np.diff((began, turns, goings, comings, ran, read))
        count(frame + 1)
    return spent
