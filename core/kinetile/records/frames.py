"""Frames for other programs: extended XYZ, a text that OVITO and ASE read.

Numbers have all digits, so a frame that is read again has the same bits. Columns are id, type (1 for the
first kind), pos, velo (z is 0), radius and mass; ``Time`` is in the comment. The recipe ``frame`` reads it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from kinetile.errors import BadOption, RecordError, Refused
from kinetile.records.trajectory import Trajectory
from kinetile.run.simulation import Simulation
from kinetile.scene import Insert, Scene
from kinetile.scene.targets import replacing, writable_target

Floats = npt.NDArray[np.float64]

FORMS = (".xyz", ".extxyz")
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
    """Writes frames to a file that ends in .xyz or .extxyz, complete or not at all; returns their number.

    Raises OSError if the file cannot be written, and Refused for a scene with shapes: such files have radii
    alone.
    """
    check_form(path, scene)
    many = 0
    with replacing(writable_target(path)) as file:
        for frame in frames:
            file.write(_xyz(frame, scene).encode())
            many += 1
    return many


def check_form(path: Path, scene: Scene | None = None) -> None:
    """Raises BadOption for a file that does not end as one of frames, and Refused for a scene with other
    bodies than discs."""
    if scene is not None and scene.shapes:
        raise Refused(
            "a file of frames has a radius for each body, and this scene has bodies of other shapes: record "
            "the run in an event file (--events), which has them"
        )
    if path.suffix.lower() not in FORMS:
        raise BadOption(
            f"{str(path)!r} is no file of frames; expected a name that ends in {', '.join(FORMS)}"
        )


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
