"""Frames for other programs: extended XYZ (text), and GSD (by the package gsd). OVITO reads both.

In extended XYZ numbers have all digits, so a frame that is read again has the same bits. Columns are id, type
(1 for the first kind), pos, velo (z is 0), radius and mass; ``Time`` is in the comment. GSD has single
precision, its origin is in the middle of the box, and ``log/time`` is the time. The recipe ``frame`` reads
both.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from kinetile.errors import BadOption, MissingExtra, RecordError, Refused
from kinetile.records.trajectory import Trajectory
from kinetile.run.simulation import Simulation
from kinetile.scene import Insert, Scene
from kinetile.scene.targets import replacing, writable_target

Floats = npt.NDArray[np.float64]

FORMS = (".xyz", ".extxyz", ".gsd")
"""Endings of files of frames."""


class Frame(NamedTuple):
    """The bodies at one moment: positions and velocities are (n, 2), the others (n,). ``types`` counts kinds
    from 0."""

    time: float
    bodies: npt.NDArray[Any]
    types: npt.NDArray[Any]
    positions: Floats
    velocities: Floats
    radii: Floats
    masses: Floats


def frames_of(source: Simulation | Trajectory, times: Iterable[float]) -> Iterator[Frame]:
    """Yields the frames of a simulation, which runs on to each of these times, or of a trajectory.

    Raises RecordError for a body of a trajectory whose radius is unknown: it was inserted by hand.
    """
    kinds = {kind: number for number, kind in enumerate(source.scene.kinds)}
    if isinstance(source, Simulation):
        for time in times:
            source.run(time)
            types = np.array([kinds[kind] for kind in source.kinds], dtype=int)
            moving = source.positions(), source.velocities()
            yield Frame(time, source.bodies, types, *moving, source.radii(), source.masses())
        return
    scene = source.scene
    known = dict(enumerate(zip(scene.kind_numbers, scene.radius, scene.mass, strict=True)))
    for each in scene.commands:
        if isinstance(each, Insert) and each.body is not None:
            known[each.body] = (
                kinds[scene.kinds[0] if each.kind is None else each.kind],
                each.radius,
                each.mass,
            )
    for time in times:
        bodies = source.bodies(time)
        unknown = [body for body in bodies.tolist() if body not in known]
        if unknown:
            raise RecordError(
                f"the radius of body {unknown[0]} is not in the event file: it was inserted by hand: "
                "the file of a run of Simulation.recorded()"
            )
        types, radii, masses = np.array([known[body] for body in bodies.tolist()]).reshape(-1, 3).T
        yield Frame(
            time, bodies, types.astype(int), source.positions(time), source.velocities(time), radii, masses
        )


def write_frames(path: Path, scene: Scene, frames: Iterable[Frame]) -> int:
    """Writes frames to a file that ends in .xyz, .extxyz or .gsd, complete or not at all; returns their
    number.

    Raises MissingExtra without gsd for .gsd, OSError if the file cannot be written, and Refused for a scene
    with shapes: such files have radii alone.
    """
    form = check_form(path, scene)
    target, many = writable_target(path), 0
    with replacing(target) as file:
        if form == ".gsd":
            names = [str(kind) for kind in scene.kinds]
            with gsd_module().open(file.name, "w") as out:
                for many, frame in enumerate(frames, 1):
                    out.append(_gsd_frame(frame, scene, names, many - 1))
        else:
            for frame in frames:
                many += 1
                file.write(_xyz(frame, scene).encode())
    return many


def check_form(path: Path, scene: Scene | None = None) -> str:
    """Returns the ending of a file of frames. Raises BadOption for another one, MissingExtra without gsd, and
    Refused for a scene with other bodies than discs."""
    if scene is not None and scene.shapes:
        raise Refused(
            "a file of frames has a radius for each body, and this scene has bodies of other shapes: record "
            "the run in an event file (--events), which has them"
        )
    form = path.suffix.lower()
    if form not in FORMS:
        raise BadOption(
            f"{str(path)!r} is no file of frames; expected a name that ends in {', '.join(FORMS)}"
        )
    if form == ".gsd":
        gsd_module()
    return form


def gsd_module() -> Any:
    """Returns the module of the package gsd. Raises MissingExtra without it."""
    try:
        return import_module("gsd.hoomd")
    except ImportError as error:
        raise MissingExtra("A GSD file", "gsd", "export") from error


def _xyz(frame: Frame, scene: Scene) -> str:
    borders = " ".join("T" if axis in scene.periodic else "F" for axis in "xyz")
    box = ""
    if scene.arena is not None:
        width, height = scene.arena
        box = f'Lattice="{width!r} 0.0 0.0 0.0 {height!r} 0.0 0.0 0.0 1.0" pbc="{borders}" '
    lines = [
        str(len(frame.bodies)),
        f"{box}Properties=id:I:1:type:I:1:pos:R:3:velo:R:3:radius:R:1:mass:R:1 Time={frame.time!r}",
    ]
    columns = (
        frame.bodies,
        frame.types + 1,
        *frame.positions.T,
        *frame.velocities.T,
        frame.radii,
        frame.masses,
    )
    for body, kind, x, y, vx, vy, radius, mass in zip(*(each.tolist() for each in columns), strict=True):
        lines.append(f"{body} {kind} {x!r} {y!r} 0.0 {vx!r} {vy!r} 0.0 {radius!r} {mass!r}")
    return "\n".join(lines) + "\n"


def _gsd_frame(frame: Frame, scene: Scene, names: list[str], step: int) -> Any:
    low, sides = np.zeros(2), np.array(scene.arena or (1.0, 1.0))
    if scene.arena is None:  # a box has to be there: the smallest around the bodies
        low = (frame.positions - frame.radii[:, None]).min(axis=0, initial=0.0)
        sides = (frame.positions + frame.radii[:, None]).max(axis=0, initial=1.0) - low
    made = gsd_module().Frame()
    made.configuration.step, made.configuration.dimensions = step, 2
    made.configuration.box = [*sides, 1.0, 0.0, 0.0, 0.0]
    n = made.particles.N = len(frame.bodies)
    made.particles.position = np.column_stack([frame.positions - low - sides / 2, np.zeros(n)])
    made.particles.velocity = np.column_stack([frame.velocities, np.zeros(n)])
    made.particles.types, made.particles.typeid = names, frame.types
    made.particles.diameter, made.particles.mass = 2.0 * frame.radii, frame.masses
    made.log = {"time": np.array([frame.time]), "particles/number": frame.bodies}
    return made
