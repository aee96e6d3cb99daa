"""A view of a run: a page, to be saved, opened, or shown in a notebook."""

import html
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from kinetile.arrays import Array
from kinetile.comparison import describe_row, first_difference
from kinetile.errors import BadOption, answering
from kinetile.kernel.clock import TICKS, Clock
from kinetile.plugin.choices import write_phase
from kinetile.records.bounded import BoundedRows, TooManyRows
from kinetile.records.trajectory import Trajectory
from kinetile.run.simulation import Simulation, composition_of
from kinetile.scene import Scene, relabelled
from kinetile.scene.checks import is_finite, shown
from kinetile.scene.scene import in_words
from kinetile.show.picture import escape
from kinetile.show.player.page import Page
from kinetile.show.player.recording import MOST_ROWS, PlayedPlans, Recording, next_window, record, shown_up_to
from kinetile.targets import writing_new

_NO_STRUCTURE = (
    "An event file has no structural events and no structure: it holds the motion of the bodies, which is "
    "one under all broad phases. A view of the scene shows both (kinetile view SCENE --broad-phase NAME)."
)

ShownPhase = tuple[str | None, Mapping[str, Any]]
"""A broad phase by name (None: the scene's, or the default), and its options."""


@dataclass(frozen=True)
class View:
    """A page that plays a run; a notebook shows it. Its ``str`` is the page's HTML."""

    page: Page

    @property
    def notes(self) -> list[str]:
        """Sentences for the reader: the ends of runs, and the omitted parts."""
        return self.page.all_notes

    def __str__(self) -> str:
        return self.page.html()

    def __repr__(self) -> str:
        return f"<View {self.page.title}>"

    def save(self, path: str | os.PathLike[str], *, overwrite: bool = False) -> Path:
        """Writes the page, ending in .html if ``path`` has no ending, and returns its path. Replaces another
        page; raises BadOption for any other existing file (unless ``overwrite``)."""
        target = given if (given := Path(path)).suffix else Path(f"{given}.html")
        with writing_new(target, overwrite) as file:
            file.write(str(self).encode())
        return target

    def _repr_html_(self) -> str:
        page, title = html.escape(str(self)), escape(self.page.title)
        return (
            f'<iframe title="{title}" sandbox="allow-scripts allow-downloads" allow="clipboard-write" '
            f'srcdoc="{page}" style="width: 100%; height: 720px; border: 0"></iframe>'
        )


def view_scene(
    scene: Scene,
    choices: Sequence[ShownPhase] = ((None, {}),),
    *,
    begin: float | None = None,
    until: float | None = None,
    steps: bool = True,
    title: str | None = None,
    max_contacts: int | None = None,
    narrow_phases: Mapping[str, Mapping[str, Any]] | None = None,
    at: float | None = None,
    notes: Sequence[str] = (),
    pairs: bool | None = None,
    progress: Callable[[float, str], None] = lambda share, text: None,
) -> View:
    """Returns a view of a scene under one broad phase, or under several side by side. If these differ, a note
    names the first difference, and the page opens there.

    Args:
        choices: broad phases, each with its options.
        begin: the start of the window; None: the scene's start.
        until: its end; None: the scene's own ``until``, or one time unit after ``begin``.
        steps: True to step through the run too, for structural events.
        title: the title; None: the recipe, the bodies, the phases and the window.
        max_contacts: the window ends at this number of contacts, if not before; None: as many as fit.
        narrow_phases: names and options; None: the scene's, or the ones that it needs.
        at: the time that the page shows first; None: the first difference, or the beginning of the window.
        notes: sentences at the head of the page.
        pairs: True if lines between pairs of bodies are drawn; None: up to 400.
        progress: called with the finished share of the steps, and a text, under each phase.

    Raises UnknownName, BadOption and Refused as ``Simulation``.
    """
    begin, until = window(scene, begin, until)
    if at is not None and not begin <= at <= until:
        raise BadOption(f"the page is to open at {at!r}; expected a time from {begin!r} to {until!r}")

    def simulation(choice: ShownPhase) -> Simulation:
        options = dict(choice[1]) or None
        return Simulation(scene, choice[0], options=options, narrow_phases=narrow_phases, keep_contacts=False)

    recordings = []
    for choice in choices:
        first = simulation(choice)
        again = simulation(choice) if steps else None
        label = write_phase(first.broad_phase, first.options)
        recordings.append(record(scene, first, again, label, begin, until, max_contacts, pairs, progress))
    labels = [recording.label for recording in recordings]
    clock = Clock(scene.start, scene.time_unit)
    end = min(until, clock.moment(max(recording.end for recording in recordings))[0])
    phases = " and ".join(labels) if len(labels) < 3 else f"{len(labels)} broad phases"
    title = title or f"{_name(scene)} under {phases}, time {begin:.6g} to {end:.6g}"
    tick, body, sentences = _parting(recordings)
    if at is not None:
        tick, body = clock.ticks(at), None
    return View(Page(scene, recordings, title, [*notes, *sentences], tick, body))


def _parting(recordings: Sequence[Recording]) -> tuple[int | None, int | None, list[str]]:
    """Returns the tick of the first row that differs between recordings and the first recording, a body of
    that row, and sentences about it; None, None and a sentence if all rows are the same."""
    first, *others = recordings
    parted: list[tuple[int, int, str]] = []
    for other in others:
        at = first_difference(_exact(first.rows), _exact(other.rows))
        if at is None or any(at == len(each.rows) and not each.whole for each in (first, other)):
            continue  # omitted rows are not a difference
        rows = {each.label: each.rows[at] for each in (first, other) if at < len(each.rows)}
        plain = {label: {name: row[name].item() for name in _EXACT} for label, row in rows.items()}
        words = [f"under {label} it is {describe_row(row)}" for label, row in plain.items()]
        words += [f"under {each.label} there is none" for each in (first, other) if each.label not in rows]
        row = min(rows.values(), key=lambda row: (row["epoch"], row["tick"]))
        tick = int(row["epoch"]) * TICKS + int(row["tick"])
        parted.append((tick, int(row["a"]), f"They part at event {at}: {'; '.join(words)}."))
    if not parted:
        under = " and ".join(each.label for each in recordings)
        return None, None, [f"All {len(first.rows)} events are the same under {under}."] if others else []
    return (*min(parted)[:2], [sentence for *_, sentence in parted])


_EXACT = ("time", "epoch", "tick", "a", "b")


def _exact(rows: Array) -> Array:
    return np.rec.fromarrays([rows[name] for name in _EXACT])


def window(scene: Scene, begin: float | None, until: float | None) -> tuple[float, float]:
    """Returns the first and the last time of a window: by default the scene's start and its own ``until``,
    or one time unit. Raises BadOption unless they are in order."""
    begin = scene.start if begin is None else begin
    if not is_finite(begin):
        raise BadOption(f"begin is {shown(begin)}; expected a finite time")
    if isinstance(until, Simulation):
        several = "kinetile.show.player.view_scene(scene, [(name, options), ...]) shows several phases"
        raise BadOption(f"until is another simulation; expected a time, for one run: {several}")
    own, ended = scene.settings.until, scene.settings.end is not None  # as a recorded run has
    until = (own if own is not None and (ended or own > begin) else begin + 1.0) if until is None else until
    if not (is_finite(until) and scene.start <= begin <= until):
        raise BadOption(
            f"the window is begin={begin!r} to until={shown(until)}; expected two times from the start on, "
            f"{scene.start!r}, the first not after the second"
        )
    return float(begin), float(until)


def to_show(simulation: Simulation) -> Scene:
    """Returns the run of a simulation so far as a scene; before a run, the scene with its own end."""
    scene, own = simulation.recorded(), simulation.scene.settings
    return relabelled(scene, settings=own) if simulation.time == scene.start else scene


def view_file(path: str | os.PathLike[str]) -> View:
    """Returns a view of an event file, as far as it fits a page; RecordError as ``Trajectory.read``."""
    trajectory = Trajectory.read(path)
    scene, end, notes = trajectory.scene, trajectory.end, [_NO_STRUCTURE]
    kept = BoundedRows(MOST_ROWS, scene)
    try:
        kept(trajectory.rows)
    except TooManyRows:
        end = kept.end
        further = 'Views of its scene show the rest: read_events(FILE).metadata["scene"].'
        notes.append(f"{shown_up_to(kept, '')} {further} {next_window(end)}")
    rows = kept.rows
    plans, last = PlayedPlans.of(scene, rows), kept.clock.ticks(end)
    recording = Recording("as recorded", plans, rows, 0, last, None, tuple(notes))
    return View(Page(scene, [recording], f"{Path(path).name}: {_name(scene)}"))


@answering
def view(
    simulation: Simulation,
    until: float | None = None,
    *,
    begin: float | None = None,
    pairs: bool | None = None,
) -> View:
    """Returns a view of the run of a simulation so far, with its interactive commands; before a run, of its
    future; from ``begin`` on, or its start. The run is repeated from the start, and the simulation does not
    change. Lines between ``pairs`` of bodies are drawn if True; None: up to 400."""
    scene = to_show(simulation)
    choice = (simulation.broad_phase, simulation.options)
    narrow_phases = composition_of(simulation).narrow_phases
    return view_scene(scene, [choice], begin=begin, until=until, narrow_phases=narrow_phases, pairs=pairs)


def _name(scene: Scene) -> str:
    source = Path(scene.origin["file"]).name if "file" in scene.origin else scene.origin.get("recipe")
    return ": ".join(filter(None, (source, in_words(scene, len(scene)))))
