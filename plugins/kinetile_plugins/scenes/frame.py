"""The recipe ``frame``: a frame of another program's file, extended XYZ or GSD, as a scene."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from kinetile import Scene
from kinetile.errors import BadOption
from kinetile.records.frames import check_form, gsd_module


def frame(*, file: str, frame: int = -1, radius: float = 0.0, shrink: float = 0.0) -> Scene:
    """A frame of a file that ends in .xyz, .extxyz or .gsd: positions, velocities, radii, masses and arena.

    ``frame`` counts from 0, or from the end below 0. Bodies are numbered in the order of the file; those of
    several types have them as kinds. What the file does not have is 0 for velocities, 1 for masses and
    ``radius`` for radii. Radii become smaller by the share ``shrink``: in the single precision of GSD discs
    that touch may overlap. The walls are those of the box; for GSD, whose boxes are always periodic, too.
    """
    try:
        found = (_from_gsd if check_form(Path(file)) == ".gsd" else _from_xyz)(Path(file), frame)
    except (IndexError, KeyError, ValueError, TypeError, RuntimeError, OSError) as error:
        raise BadOption(f"file {file!r}: frame {frame} cannot be read: {error!r}") from error
    if found["radius"] is None:
        if not radius > 0.0:
            raise BadOption(f"file {file!r} has no radii: expected one for all, as in -s radius=0.5")
        found["radius"] = radius
    found["radius"] = found["radius"] * (1.0 - shrink)
    return Scene(**found)


def _from_gsd(path: Path, index: int) -> dict[str, Any]:
    with gsd_module().open(str(path), "r") as file:
        frame = file[index]
    sides, particles = frame.configuration.box[:2].astype(float), frame.particles
    typeid = particles.typeid.tolist()
    return {
        "position": particles.position[:, :2].astype(float) + sides / 2,
        "velocity": particles.velocity[:, :2].astype(float),
        "radius": particles.diameter.astype(float) / 2,
        "mass": particles.mass.astype(float),
        "arena": tuple(sides.tolist()),
        "start": float(frame.log["time"][0]) if "time" in frame.log else 0.0,
        "kind": [particles.types[each] for each in typeid] if len(set(typeid)) > 1 else None,
    }


_PAIR = re.compile(r'(\w+)=(?:"([^"]*)"|(\S+))')


def _from_xyz(path: Path, index: int) -> dict[str, Any]:
    lines = path.read_text(encoding="utf-8").splitlines()
    starts, at = [], 0
    while at < len(lines) and lines[at].strip():
        starts.append(at)
        at += int(lines[at]) + 2
    first = starts[index]
    head = {key: quoted or plain for key, quoted, plain in _PAIR.findall(lines[first + 1])}
    words = [line.split() for line in lines[first + 2 : first + 2 + int(lines[first])]]
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
        periodic = "".join(
            axis for axis, open_ in zip("xy", head.get("pbc", "").split(), strict=False) if open_ in "T1"
        )
        if periodic:
            found["periodic"] = periodic
    types = columns.get("type", columns.get("species"))
    if types is not None and len(np.unique(types)) > 1:
        found["kind"] = types[:, 0].tolist()
    return found
