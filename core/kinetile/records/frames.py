"""Frames for other programs: extended XYZ (text), and GSD (by the package gsd). OVITO reads both, ASE and
HOOMD-blue one each.

In extended XYZ, numbers have all digits, so reading a frame again gives the same bits. Some columns have two
names: ASE reads ``momenta`` and ``masses``, OVITO ``velo`` and ``mass``. ``species`` are chemical symbols,
which ASE requires: one for each kind and shape, or for each radius if all bodies are of one kind with few
radii. ``kind`` is the place in the scene's list. ``map_shift`` is the number of periods between a body and
``pos``. z is 0, and ``Time`` is in the comment. A second file, NAME.shapes.json, has the shapes.

GSD has single precision, its origin is in the middle of the box, and ``log/time`` is the time. Its types are
the same species, by name. The recipe ``frame`` reads both.
"""

import json
import os
from collections.abc import Iterable, Iterator
from io import StringIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from kinetile.arrays import Array, Floats
from kinetile.errors import BadOption, RecordError, answering, one_of
from kinetile.lazy import needed
from kinetile.records.trajectory import Trajectory
from kinetile.run.simulation import Simulation
from kinetile.scene import Insert, Scene
from kinetile.scene.bodies import whole_periods
from kinetile.scene.scene import kinds_inserted
from kinetile.scene.shapes import Shape, disc
from kinetile.targets import replacing, write_file

_SYMBOLS = "H He Li Be B C N O F Ne Na Mg Al Si P S Cl Ar K Ca Sc Ti V Cr Mn Fe Co Ni Cu Zn Ga Ge As Se Br Kr"
_FEW = 16

FORMS = (".xyz", ".extxyz", ".gsd")
"""Endings of files of frames."""


class Frame(NamedTuple):
    """The bodies at one moment: positions, unwrapped positions and velocities are (n, 2), the others (n,).
    ``kinds`` are indices in the scene's kinds, and ``shapes`` objects; None in a scene of discs."""

    time: float
    bodies: Array
    kinds: Array
    positions: Floats
    unwrapped: Floats
    velocities: Floats
    radii: Floats
    masses: Floats
    shapes: Array

    def images(self, scene: Scene) -> Array:
        """Returns (n, 3) the number of periods between each body and its position; 0 along axes with walls.
        Raises RecordError for more than files of frames can hold."""
        found = np.zeros((len(self.bodies), 3), dtype=np.int64)
        away = whole_periods(self.unwrapped - self.positions, scene.periods)
        if not (np.abs(away) < 2.0**31).all():
            raise RecordError(
                f"at time {self.time!r} a body has flown 2**31 periods, which frames do not count"
            )
        found[:, :2] = away
        return found

    @property
    def momenta(self) -> Floats:
        """(n, 2) masses times velocities; 0 for immovable bodies at rest."""
        mass, v = self.masses[:, None], self.velocities
        return np.multiply(mass, v, out=np.zeros_like(v), where=v != 0.0)


class _Species:
    """Types of bodies for other programs, in the order of their appearance: one for each kind and shape, or
    for each radius if bodies are discs of one kind and few radii."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._by_radius = len(scene.kinds) == 1 and len(np.unique(scene.radius)) <= _FEW
        self._known: dict[tuple[Any, Any], int] = {}
        self.table = {shape: number for number, shape in enumerate(scene.shapes)}

    def of(self, frame: Frame) -> Array:
        by_radius = self._by_radius and not self.table
        sizes = frame.radii if by_radius else self.numbers(frame)
        both = zip(frame.kinds.tolist(), sizes.tolist(), strict=True)
        return np.array([self._known.setdefault(each, len(self._known)) for each in both], dtype=int)

    def numbers(self, frame: Frame) -> Array:
        """Returns the indices of shapes in the table, (n,); -1 for discs in a scene without shapes. Shapes
        inserted by hand follow the scene's shapes."""
        shapes = frame.shapes.tolist() if self.table else []
        found = [self.table.setdefault(each, len(self.table)) for each in shapes]
        return np.array(found or [-1] * len(frame.bodies), dtype=int)

    @property
    def names(self) -> list[str]:
        """The name of each type: its kind, and its radius or the number of its shape, if any."""
        kinds = self._scene.kinds
        return [f"{kinds[kind]}" if size == -1 else f"{kinds[kind]} {size!r}" for kind, size in self._known]

    @property
    def shapes(self) -> list[dict[str, Any]]:
        """The shape of each type as GSD describes it; {} for discs of any radius."""
        sizes, table = [size for _, size in self._known], [*self.table]
        if table:
            return [_described(table[size]) for size in sizes]
        return [{} if size == -1 else _described(disc(size)) for size in sizes]


def _described(shape: Shape) -> dict[str, Any]:
    """Returns a shape as GSD describes it: polygons have three vertices or more, some twice if needed."""
    if shape.is_disc:
        return {"type": "Sphere", "diameter": 2.0 * shape.radius}
    corners = [*shape.core, *[shape.core[0]] * (3 - len(shape.core))]
    return {"type": "Polygon", "vertices": corners, "rounding_radius": shape.radius}


def frames_of(source: Simulation | Trajectory, times: Iterable[float]) -> Iterator[Frame]:
    """Yields the frames of a simulation, which runs on to each of these times, or of a trajectory.
    RecordError for a body inserted by hand: a trajectory does not have its radius."""
    scene = source.scene
    kinds = {kind: number for number, kind in enumerate(scene.kinds)}
    if isinstance(source, Simulation):
        for time in times:
            source.run(time)
            numbers = np.array([kinds[kind] for kind in source.kinds], dtype=int)
            moving = source.positions(), source.unwrapped(), source.velocities()
            sizes = source.radii(), source.masses(), source.shapes()
            yield Frame(time, source.bodies, numbers, *moving, *sizes)
        return
    shapes = [scene.shapes[each] if each >= 0 else None for each in scene.shape.tolist()]
    coming = kinds_inserted(scene)
    known = dict(enumerate(zip(scene.kind_numbers, scene.radius, scene.mass, shapes, strict=True)))
    inserts = (each for each in scene.commands if isinstance(each, Insert))
    known |= {each.body: (coming[each.body], each.radius, each.mass, each.shape) for each in inserts}
    for time in times:
        bodies = source.bodies(time)
        for body in bodies.tolist():
            if body not in known:
                raise RecordError(
                    f"the radius of body {body} is not in the event file: it was inserted by hand: "
                    "the file of a run of Simulation.recorded()"
                )
        moving = source.positions(time), source.unwrapped(time), source.velocities(time)
        traits = np.array([known[body] for body in bodies.tolist()], dtype=object).reshape(-1, 4).T
        sizes = traits[1].astype(float), traits[2].astype(float), traits[3]
        yield Frame(time, bodies, traits[0].astype(int), *moving, *sizes)


@answering
def frames(source: Simulation | Trajectory, times: Iterable[float], form: str = "ase") -> Iterator[Any]:
    """Yields the bodies at these times as objects of another program, in memory: ``ase.Atoms`` (which
    ``ovito.io.ase.ase_to_ovito`` takes as well), or for "gsd" ``gsd.hoomd.Frame``.

    The columns are the same as in files (``kinetile export``). A simulation runs on to each time. Raises
    BadOption for another form, and MissingExtra without the package.
    """
    if form not in ("ase", "gsd"):
        raise BadOption(f"{form!r} is no form of frames in memory; expected {one_of(form, ('ase', 'gsd'))}")
    module = gsd_module() if form == "gsd" else needed("A frame as ase.Atoms", "ase", "ase", "ase.io")
    scene, species = source.scene, _Species(source.scene)
    for step, frame in enumerate(frames_of(source, times)):
        if form == "gsd":
            yield _gsd_frame(frame, scene, species, step)
        else:
            text = _xyz(frame, scene, species.of(frame), species.numbers(frame))
            yield module.read(StringIO(text), format="extxyz")


def write_frames(path: Path, scene: Scene, frames: Iterable[Frame]) -> int:
    """Writes frames to a file that ends in .xyz, .extxyz or .gsd, complete or not at all; returns the number
    of frames. GSD contains the shapes; for XYZ they are in NAME.shapes.json. Raises MissingExtra without gsd
    for .gsd, and OSError."""
    form = check_form(path)
    many, species = 0, _Species(scene)
    of_bodies: dict[int, int] = {}
    with replacing(path) as file:
        if form == ".gsd":
            with gsd_module().open(file.name, "w") as out:
                for many, frame in enumerate(frames, 1):
                    out.append(_gsd_frame(frame, scene, species, many - 1))
        else:
            for frame in frames:
                many += 1
                numbers = species.numbers(frame)
                file.write(_xyz(frame, scene, species.of(frame), numbers).encode())
                of_bodies |= zip(frame.bodies.tolist(), numbers.tolist(), strict=True)
    if scene.shapes and form != ".gsd":
        table = {"shapes": [*map(_described, species.table)], "bodies": of_bodies}
        write_file(f"{os.path.realpath(path)}.shapes.json", json.dumps(table))
    return many


def check_form(path: Path) -> str:
    """Returns a frames file's ending; BadOption for others and bad GSD names, MissingExtra without gsd."""
    form = path.suffix.lower()
    if form not in FORMS:
        raise BadOption(
            f"{str(path)!r} is no file of frames; expected a name that ends in {', '.join(FORMS)}"
        )
    if form == ".gsd":
        gsd_module()
        try:
            os.path.realpath(path).encode()
        except UnicodeEncodeError as error:
            raise BadOption(f"{str(path)!r}: a GSD file needs a name and folders in UTF-8") from error
    return form


def gsd_module() -> Any:
    """Returns the module of the package gsd. Raises MissingExtra without it."""
    return needed("A GSD file", "gsd", "export", "gsd.hoomd")


_COLUMNS = (
    "species:S:1:pos:R:3:velo:R:3:momenta:R:3:radius:R:1:mass:R:1:masses:R:1:map_shift:I:3:id:I:1:kind:I:1"
)


def _xyz(frame: Frame, scene: Scene, types: Array, shapes: Array) -> str:
    borders = " ".join("T" if axis in scene.periodic else "F" for axis in "xyz")
    box = ""
    if scene.arena is not None:
        width, height = scene.arena
        box = f'Lattice="{width!r} 0.0 0.0 0.0 {height!r} 0.0 0.0 0.0 1.0" pbc="{borders}" '
    symbols, shape = _SYMBOLS.split(), ":shape:I:1" if scene.shapes else ""
    lines = [str(len(frame.bodies)), f"{box}Properties={_COLUMNS}{shape} Time={frame.time!r}"]
    pairs = frame.positions, frame.velocities, frame.momenta
    columns: list[Any] = [types, *(column for pair in pairs for column in (*pair.T, np.zeros(len(types))))]
    columns += [frame.radii, frame.masses, frame.masses, *frame.images(scene).T, frame.bodies, frame.kinds]
    columns += [shapes] if scene.shapes else []
    for kind, *numbers in zip(*(each.tolist() for each in columns), strict=True):
        symbol = symbols[kind] if kind < len(symbols) else "X"
        lines.append(f"{symbol} {' '.join(map(repr, numbers))}")
    return "\n".join(lines) + "\n"


def _gsd_frame(frame: Frame, scene: Scene, species: _Species, step: int) -> Any:
    low, sides = np.zeros(2), np.array(scene.arena or (1.0, 1.0))
    if scene.arena is None:  # a box is required: the smallest around the bodies
        low = (frame.positions - frame.radii[:, None]).min(axis=0, initial=0.0)
        sides = (frame.positions + frame.radii[:, None]).max(axis=0, initial=1.0) - low
    made = gsd_module().Frame()
    made.configuration.step, made.configuration.dimensions = step, 2
    made.configuration.box = [*sides, 1.0, 0.0, 0.0, 0.0]
    n = made.particles.N = len(frame.bodies)
    made.particles.position = np.column_stack([frame.positions - low - sides / 2, np.zeros(n)])
    made.particles.velocity = np.column_stack([frame.velocities, np.zeros(n)])
    made.particles.image = frame.images(scene)
    made.particles.typeid = species.of(frame)
    made.particles.types, made.particles.type_shapes = species.names, species.shapes
    made.particles.diameter, made.particles.mass = 2.0 * frame.radii, frame.masses
    made.log = {"time": np.array([frame.time])}
    made.log |= {"particles/number": frame.bodies, "particles/kind": frame.kinds}
    return made
