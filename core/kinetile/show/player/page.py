"""A complete page: style, script and recordings; it loads nothing from a network.

The script's files are modules. The page joins them: imports and the word ``export`` are removed, and each
file follows the files that it imports, so no two of them may use one name for two things. The bytes of a
column are ordered by significance, deflated, in base64: all first bytes, then all second bytes, and so on
compress well. The browser's ``DecompressionStream`` decodes them (``script/run/columns.mjs``).
"""

import base64
import json
import re
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np

from kinetile.arrays import Array
from kinetile.errors import legible
from kinetile.kernel.clock import TICKS
from kinetile.scene import Scene
from kinetile.scene.scene import kind_of_each
from kinetile.scene.shapes import Shape
from kinetile.show.picture import (
    FIXED,
    FRESH,
    KINDS,
    LOOKS,
    NEXT_LOOK,
    ROOM,
    SPEEDS,
    escape,
    outline_of,
    pace_of,
)
from kinetile.show.player.recording import PlayedPlans, Recording, kinds_of, residuals

_RUN = (
    *("doubles", "clock", "columns", "plan", "rows", "motion", "structure", "present", "events"),
    *("meetings", "proof", "sentences", "playback", "live", "stepped"),
)
_SEEN = (
    *("camera", "paper", "drawing", "matrix", "timeline", "spacetime", "tables", "race"),
    *("lens", "trial", "player", "link", "svg", "hands"),
)

MODULES = (*(f"run/{name}" for name in _RUN), *(f"page/{name}" for name in _SEEN))
"""The script's files, each after the files that it imports: the run, then its display."""

_SECONDS = 30.0
"""The initial duration of a whole recording."""


@dataclass(frozen=True)
class Page:
    """Contents of a page: recordings of one window of one scene, side by side, with ``notes`` at the head. It
    opens at the tick ``open_at`` (None: its beginning), with a body in ``select`` or None."""

    scene: Scene
    recordings: Sequence[Recording]
    title: str
    notes: Sequence[str] = ()
    open_at: int | None = None
    select: int | None = None

    @property
    def held(self) -> dict[str, Any]:
        """Returns the content of the page, as plain data for JSON."""
        scene, (first, *_) = self.scene, self.recordings
        end = max(recording.end for recording in self.recordings)
        length = (end - first.begin) / TICKS * scene.time_unit
        runs = [self._run(recording, at) for at, recording in enumerate(self.recordings)]
        bodies, kinds, shapes = range(len(first.plans.x)), kind_of_each(scene), scene.shape_of
        # An interactive command may be the first that gives an acceleration.
        by_hand = (np.isfinite(each.rows["bx"][each.rows["b"] < 0]).any() for each in self.recordings)
        # If kinds change, a page has no responses and no kinds: it would show the initial ones.
        responses = scene.meets if scene.responses and not scene.changing else []
        names = [] if scene.changing or scene.kinds == (0,) else [legible(str(each)) for each in scene.kinds]
        return {
            "format": 1,
            "start": scene.start,
            "unit": scene.time_unit,
            "arena": scene.arena,
            "periods": scene.periods,
            "pull": scene.pull if scene.accelerated or any(by_hand) else None,
            "box": _box(scene, first.plans),
            "begin": divmod(first.begin, TICKS),
            "end": divmod(end, TICKS),
            "open": None if self.open_at is None else divmod(self.open_at, TICKS),
            "select": self.select,
            "pairs": first.pairs,
            "passing": first.passing,
            "speed": length / _SECONDS if length > 0 else 1.0,
            "bodies": encode(vars(first.plans)),
            "kinds": names,
            "kind": [kinds.get(body, 0) for body in bodies] if len(names) > 1 else [],
            "responses": [[each.name for each in row] for row in responses],
            "shapes": list(map(_drawn, scene.shapes)),
            "shape": [shapes.get(body, -1) for body in bodies] if scene.shapes else [],
            "runs": runs,
            "colours": {"kinds": KINDS, "speeds": SPEEDS, "fixed": FIXED},
            "pace": pace_of(scene, _velocities(first.rows)),
            "room": ROOM,
            "looks": {role: look._asdict() for role, look in LOOKS.items()},
            "next": NEXT_LOOK._asdict(),
            "fresh": FRESH._asdict(),
        }

    @property
    def all_notes(self) -> list[str]:
        """The notes of the page and of its recordings."""
        notes = [*self.notes]
        for recording in self.recordings:
            notes += [note for note in recording.notes if note not in notes]
        return notes

    def html(self) -> str:
        """Returns the page."""
        one = "body" if self.scene.shapes else "disc"
        name, _, rest = self.title.partition(": ")
        summary = f"{rest}. Drag to move the view, tap a {one} to select it, ? for the keys.".removeprefix(
            ". "
        )
        held = json.dumps(self.held, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
        parts = {
            "TITLE": escape(self.title),
            "NAME": escape(name),
            "SUMMARY": escape(summary),
            "NOTES": "\n".join(f'<p class="note">{escape(note)}</p>' for note in self.all_notes),
            "PANES": "\n".join(_pane(recording.label) for recording in self.recordings),
            "SHAPE": {1: "single", 2: "several"}.get(len(self.recordings), "several many"),
            "STYLE": _asset("page.css"),
            "SCRIPT": script(),
            "RECORDING": held,
        }
        return re.sub("@@([A-Z]+)@@", lambda found: parts[found[1]], _asset("page.html"))

    def _run(self, recording: Recording, at: int) -> dict[str, Any]:
        """Returns one recording for the page; its rows are None if they equal the rows of the first."""
        first, steps = self.recordings[0], recording.stepped
        same = at > 0 and first.rows.tobytes() == recording.rows.tobytes()
        coded = structure = None
        labels: list[str] = []
        if steps is not None:
            coded = {name: getattr(steps, name).astype(np.float64) for name in ("epoch", "tick")}
            coded |= {name: getattr(steps, name).astype(np.int32) for name in ("body", "after", "queue")}
            structure, labels = steps.structure.columns(), steps.structure.labels
        return {
            "label": legible(recording.label),
            "rows": None if same else encode(_rows(recording, first.plans, self.scene)),
            "steps": None if coded is None else encode(coded),
            "structure": None if structure is None else encode(structure),
            "labels": labels,
            "seen": 0 if steps is None else steps.structure.seen,
            "drawn_as": recording.drawn_as,
            "skin": recording.skin,
        }


def script() -> str:
    """Returns the script: its modules as one, without comments and with half of the indentation. So no text
    in it may have two slashes between blanks, and no line of a text may be indented."""
    lines = []
    for name in MODULES:
        for line in filter(None, _asset(f"script/{name}.mjs").splitlines()):
            code = line.lstrip()
            if not code.startswith(("import ", "//", "/**", "* ", "*/")):
                indent = " " * ((len(line) - len(code)) // 2)
                lines.append(indent + code.partition(" // ")[0].removeprefix("export "))
    return "\n".join(lines)


def _rows(recording: Recording, plans: PlayedPlans, scene: Scene) -> dict[str, Any]:
    rows = recording.rows
    columns: dict[str, Any] = {"kind": kinds_of(rows)}
    for name in ("epoch", "tick"):
        columns[name] = np.diff(rows[name].astype(np.float64), prepend=0.0)  # whole numbers: exact
    return columns | {"a": rows["a"], "b": rows["b"]} | residuals(plans, rows, scene)


def _velocities(rows: Array) -> Array:
    """Returns the velocities after the events of a recording, (m, 2)."""
    found = np.concatenate([np.stack([rows[f"{b}vx"], rows[f"{b}vy"]], axis=1) for b in "ab"])
    return np.asarray(found[np.isfinite(found).all(axis=1)])


def _box(scene: Scene, plans: PlayedPlans) -> Sequence[float]:
    if scene.arena is not None:
        return (0.0, 0.0, *scene.arena)
    there = plans.there > 0
    if not there.any():
        return (-1.0, -1.0, 1.0, 1.0)
    x, y = plans.x[there], plans.y[there]
    left, right, down, up = [np.nan_to_num(plans.radius[there])] * 4
    if scene.shapes:  # at first, the bodies of the scene are present
        here = np.flatnonzero(there)
        left, right, down, up = np.array([shape.reaches for shape in scene.shapes])[scene.shape[here]].T
    box = (float((x - left).min()), float((y - down).min()), float((x + right).max()), float((y + up).max()))
    wide, high = box[2] - box[0], box[3] - box[1]
    return (box[0] - 0.25 * wide, box[1] - 0.25 * high, box[2] + 0.25 * wide, box[3] + 0.25 * high)


def _drawn(shape: Shape) -> dict[str, Any]:
    left, right, down, up = shape.reaches
    words = f"{shape.kind} {left + right!r} x {down + up!r}"
    outline = None if shape.is_disc else outline_of(shape, (0.0, 0.0))
    return {"words": words, "outline": outline, "room": min(shape.reaches)}


def _pane(label: str) -> str:
    text = escape(label)
    return (
        f'<figure><figcaption>{text}</figcaption><div><canvas class="stage" tabindex="0" role="img" '
        f'aria-label="The bodies under {text}; the readings below say in words what happens"></canvas>'
        f'<canvas class="matrix" role="img" aria-label="The matrix of {text}: which two bodies overlap on x, '
        'on y, on both" hidden></canvas></div></figure>'
    )


@cache
def _asset(name: str) -> str:
    return files("kinetile.show.player").joinpath(name).read_text(encoding="utf-8")


_TYPES = ("f8", "u8", "i4", "u1")
"""Types of columns; all little-endian."""


def encode(columns: Mapping[str, Array]) -> dict[str, Any]:
    """Returns columns (one-dimensional, of types f8, u8, i4, u1) as plain data for JSON: ``columns``, a list
    of [name, type, length], and ``text``. Raises TypeError for another type."""
    table, parts = [], []
    for name, column in columns.items():
        kind = column.dtype.str[1:]
        if kind not in _TYPES or column.ndim != 1:
            raise TypeError(f"column {name!r} is {column.dtype} {column.shape}; expected one of {_TYPES}")
        table.append([name, kind, len(column)])
        plain = np.ascontiguousarray(column, f"<{kind}")
        parts.append(plain.view(np.uint8).reshape(len(column), int(kind[1:])).T.tobytes())
    return {"columns": table, "text": base64.b64encode(zlib.compress(b"".join(parts), 9)).decode()}
