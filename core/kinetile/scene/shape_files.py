"""Shapes in scene files: the tables [[shapes]], and the column ``shape`` of bodies."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from kinetile.errors import Mistake, SceneError, one_of
from kinetile.scene.checks import shown
from kinetile.scene.schema import Place, expected, written
from kinetile.scene.shape_table import Table, read_table
from kinetile.scene.shapes import Shape, box, capsule, disc, polygon, segment

_FORMS: dict[str, tuple[Callable[..., Shape], tuple[str, ...]]] = {
    "disc": (disc, ("radius",)),
    "box": (box, ("width", "height")),
    "capsule": (capsule, ("from", "to", "radius")),
    "segment": (segment, ("from", "to")),
    "polygon": (polygon, ("corners", "radius")),
}
"""The kinds of shapes: how each is made, and from which keys."""


def read_shapes(
    tables: Mapping[str, Any], rows: list[Any], faults: set[Place], mistakes: list[Mistake]
) -> Table | None:
    """Returns the shapes of the bodies, None if they have radii; appends all mistakes in them."""
    shaped = ["shape" in row for i, row in enumerate(rows) if ("bodies", i) not in faults]
    if "shapes" not in tables and not any(shaped):
        return None
    made = []
    for k, row in enumerate(() if ("shapes",) in faults else tables.get("shapes", ())):
        whole = not any(place[:2] == ("shapes", k) for place in faults)
        made.append(_shape_of(f"shapes[{k}]", row, mistakes) if whole else None)
    index, unknown = np.zeros(len(rows), dtype=np.int64), np.ones(len(rows), dtype=np.bool_)
    for i, row in enumerate(rows):
        place: Place = ("bodies", i, "shape")
        if faults & {place, place[:2]}:
            continue
        if "shape" not in row:
            mistakes.append(Mistake(written(place), "nothing", expected(place)))
        elif "radius" in row:
            mistakes.append(Mistake(f"bodies[{i}].radius", "a radius beside a shape", "one of the two"))
        else:
            index[i], unknown[i] = row["shape"], False
    if None in made or ("shapes",) in faults:
        return Table((), index, np.ones(len(rows), dtype=np.bool_))
    return read_table(index, made, len(rows), mistakes, unknown)


def _shape_of(where: str, row: Mapping[str, Any], mistakes: list[Mistake]) -> Shape | None:
    """Returns the shape of a table, or None if it has mistakes, which are appended."""
    kind = row["kind"]
    if kind not in _FORMS:
        mistakes.append(Mistake(f"{where}.kind", shown(kind), one_of(kind, _FORMS)))
        return None
    make, keys = _FORMS[kind]
    has = f"{', '.join(keys)}, which a {kind} has"
    wrong = [
        Mistake(f"{where}.{key}", "a key of other shapes", has)
        for key in row
        if key not in ("kind", *keys) and any(key in others for _, others in _FORMS.values())
    ]
    needed = keys[:1] if kind == "polygon" else keys
    wrong += [Mistake(f"{where}.{key}", "nothing", has) for key in needed if key not in row]
    if not wrong:
        try:
            return make(*(row[key] for key in keys if key in row))
        except SceneError as error:
            ends = {"a": "from", "b": "to"}
            wrong = [each._replace(where=ends.get(each.where, each.where)) for each in error.mistakes]
            wrong = [each._replace(where=f"{where}.{each.where}") for each in wrong]
    mistakes += wrong
    return None


def shape_row(shape: Shape) -> dict[str, Any]:
    """Returns the keys of a shape's table."""
    right, top = shape.core[-2 % len(shape.core)]
    values: dict[str, Any] = {"radius": shape.radius, "width": 2.0 * right, "height": 2.0 * top}
    values |= {"from": shape.core[0], "to": shape.core[-1], "corners": shape.core}
    return {key: values[key] for key in _FORMS[shape.kind][1]}
