"""The recipe ``frame``: a frame of another program's file, extended XYZ or GSD, as a scene."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np

from kinetile import Scene, Shape, disc, polygon
from kinetile.errors import BadOption
from kinetile.records.frames import check_form, gsd_module
from kinetile.sources import check_regular, open_regular


def frame(*, file: str, frame: int = -1, radius: float = 0.0, shrink: float = 0.0) -> Scene:
    """A frame of a file that ends in .xyz, .extxyz or .gsd: positions, velocities, radii, masses and arena.

    Bodies are numbered in the order of the file. If they have several types, these are their kinds; in files
    of kinetile, whole numbers. GSD's types define the shapes, for XYZ NAME.shapes.json. Without an entry in
    the file velocities are 0 and masses 1. The box gives the walls; for GSD, whose boxes are always periodic,
    too.

    Args:
        file: its name
        frame: counted from 0, or below 0 from the end
        radius: of discs without a radius in the file, a length
        shrink: the share to subtract from radii: in the single precision of GSD discs may overlap
    """
    try:
        found = (_from_gsd if check_form(Path(file)) == ".gsd" else _from_xyz)(Path(file), frame)
    except (LookupError, ValueError, TypeError, RuntimeError, OSError, ArithmeticError, MemoryError) as error:
        raise BadOption(f"file {file!r}: frame {frame} cannot be read: {error!r}") from error
    if "shape" in found:
        return Scene(**found | {"radius": None})
    if found["radius"] is None:
        if not radius > 0.0:
            raise BadOption(f"file {file!r} has no radii: expected one for all, as in -s radius=0.5")
        found["radius"] = radius
    found["radius"] = found["radius"] * (1.0 - shrink)
    return Scene(**found)


def _from_gsd(path: Path, index: int) -> dict[str, Any]:
    check_regular(path)
    with gsd_module().open(str(path), "r") as file:
        frame = file[index]
    sides, particles = frame.configuration.box[:2].astype(float), frame.particles
    typeid = particles.typeid.tolist()
    kinds = frame.log.get("particles/kind")
    names = [particles.types[each] for each in typeid] if kinds is None else kinds.tolist()
    shaped = any(each.get("type") == "Polygon" for each in particles.type_shapes)
    shapes = {"shapes": [*map(_shape, particles.type_shapes)], "shape": typeid} if shaped else {}
    return shapes | {
        "position": particles.position[:, :2].astype(float) + sides / 2,
        "velocity": particles.velocity[:, :2].astype(float),
        "radius": particles.diameter.astype(float) / 2,
        "mass": particles.mass.astype(float),
        "arena": tuple(sides.tolist()),
        "start": float(frame.log["time"][0]) if "time" in frame.log else 0.0,
        "kind": names if len(set(names)) > 1 else None,
    }


def _lines_of(path: Path, index: int) -> list[str]:
    """Returns the lines of a frame behind its count, the comment first; keeps no others."""
    starts: list[tuple[int, int]] = []
    with open_regular(path) as file:

        def line() -> bytes:
            found = file.readline(_LONGEST)
            if len(found) == _LONGEST:
                raise ValueError(f"a line has more than {_LONGEST:,} bytes")
            return found

        while count := line().strip():
            bodies = int(count)
            if bodies < 0:
                raise ValueError(f"frame {len(starts)} says {bodies} bodies; expected at least 0")
            starts.append((file.tell(), bodies))
            for _ in range(bodies + 1):
                if not line():
                    raise ValueError(
                        f"frame {len(starts) - 1} says {bodies} bodies, and the file ends before"
                    )
        place, bodies = starts[index]
        file.seek(place)
        return [line().decode("utf-8") for _ in range(bodies + 1)]


_LONGEST = 1 << 16
_PAIR = re.compile(r'(\w+)=(?:"([^"]*)"|(\S+))')


def _from_xyz(path: Path, index: int) -> dict[str, Any]:
    comment, *lines = _lines_of(path, index)
    head = {key: quoted or plain for key, quoted, plain in _PAIR.findall(comment)}
    words = [line.split() for line in lines]
    columns: dict[str, Any] = {}
    parts, place = head["Properties"].split(":"), 0
    for name, many in zip(parts[::3], map(int, parts[2::3]), strict=True):
        columns[name] = np.array([row[place : place + many] for row in words])
        place += many
    found: dict[str, Any] = {
        "position": columns["pos"][:, :2].astype(float),
        "velocity": columns["velo"][:, :2].astype(float) if "velo" in columns else np.zeros((len(words), 2)),
        "radius": columns["radius"][:, 0].astype(float) if "radius" in columns else None,
        "mass": columns["mass"][:, 0].astype(float) if "mass" in columns else 1.0,
        "start": float(head.get("Time", 0.0)),
    }
    if "Lattice" in head:
        lattice = np.array(head["Lattice"].split(), dtype=float).reshape(3, 3)
        if (lattice != np.diag(np.diag(lattice))).any():
            raise ValueError("its Lattice is no rectangle")
        found["arena"] = tuple(np.diag(lattice)[:2].tolist())
        found["position"] -= np.array(head.get("Origin", "0 0").split()[:2], dtype=float)
        closed = zip("xy", head.get("pbc", "").split(), strict=False)
        found["periodic"] = "".join(axis for axis, word in closed if word in "T1")
    if "shape" in columns:
        with open_regular(f"{path}.shapes.json") as file:
            found["shapes"] = [*map(_shape, json.load(file)["shapes"])]
        found["shape"] = columns["shape"][:, 0].astype(int)
    types = columns["kind"].astype(int) if "kind" in columns else columns.get("type", columns.get("species"))
    if types is not None and len(np.unique(types)) > 1:
        found["kind"] = types[:, 0].tolist()
    return found


def _shape(described: dict[str, Any]) -> Shape:
    if described["type"] == "Polygon":
        return polygon(dict.fromkeys(map(tuple, described["vertices"])), described["rounding_radius"])
    return disc(described["diameter"] / 2)
