"""The columns of the matrix: the uses of a game of some capabilities, and their required results.

Each observation takes a game and a folder, and raises AssertionError for a wrong result. If the library
refuses, its own error is raised; ``Refused`` here stands for a refusal that is a sentence on a page or in a
row.
"""

import shutil
from collections.abc import Callable
from contextlib import nullcontext, suppress
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

import kinetile as kt
from by_the_rules import answer
from capabilities import BY_NAME, LASTS, Game, differs, moments_of, rows_of
from judged_games import game_tables, second_list
from kinetile.errors import KinetileError, Refused
from kinetile.kernel.clock import TICKS, Clock
from kinetile.records import EventRecorder, Trajectory, read_events, recover
from kinetile.scene.files import dumps_scene, load_scene, save_scene
from kinetile.show.html import as_svg
from kinetile.show.player import view_scene
from kinetile.show.space_time import space_time_svg, take_space_time
from kinetile_accuracy import certify_log
from kinetile_bench import Study
from kinetile_conformance.cases import Subject
from kinetile_conformance.checks import check_named
from kinetile_conformance.runner import CheckRun
from lanes import GENERAL
from player_pages import PLAYED, ask_node
from studies import run_here

MIDDLE = 2.0
"""A time between two commands: runs are stopped, saved and shown there."""


@cache
def truth(names: tuple[str, ...]) -> kt.Simulation:
    return Game(*names).played()


def same(game: Game, sim: kt.Simulation) -> None:
    """Asserts that a game has ended as under ``naive``, to the last bit."""
    assert differs(sim, truth(game.names)) == ""


def _under(phase: str, **options: Any) -> Callable[[Game, Path], None]:
    def observe(game: Game, folder: Path) -> None:
        same(game, game.played(phase, options=options or None, audit=7))

    return observe


def naive(game: Game, folder: Path) -> None:
    """Its tables keep their invariants between all events."""
    sim = game.played(audit=1)
    same(game, sim)


def pieces(game: Game, folder: Path) -> None:
    """In pieces of time and of contacts the run is the same."""
    sim = game.simulation("cells")
    for k in range(1, 17):
        game.play(sim, LASTS * k / 16)
    same(game, sim)
    sim = game.simulation("sap-1d")
    for time in (MIDDLE, LASTS):
        while sim.time < time and not game.by_hand:
            sim.run(until=time, max_contacts=3)
        game.play(sim, time)
    same(game, sim)


def step_by_step(game: Game, folder: Path) -> None:
    """Each row of ``contacts`` is one event of ``steps``, which says what a function called with it hears."""
    scene = truth(game.names).recorded()
    sim = kt.Simulation(scene, "cells", live=game.by_hand)
    found = [event for event in sim.steps(LASTS) if event.kind in ("wall", "disc", "pass", "part")]
    assert rows_of(sim) == rows_of(truth(game.names))
    assert moments_of(found) == moments_of(sim)
    told = list[kt.Event]()
    again = kt.Simulation(scene, "naive", live=game.by_hand)
    again.run(LASTS, on_contact=told.append, on_part=told.append)
    assert told == found
    assert all(event.normal for event in found if event.kind in ("wall", "disc"))


def stop_at(game: Game, folder: Path) -> None:
    """A run that stops at every contact of a body, before and after, is the same run; so is one that calls a
    function with every contact."""
    for before in (False, True):
        sim = game.simulation("cells")
        stop = kt.StopAt(bodies=[0, 1], before=before, parts=True)
        while not game.by_hand and not sim.run(until=LASTS, stop_at=stop):
            if before:
                sim.run(until=LASTS, max_contacts=1)
        same(game, game.play(sim))
    sim, told = game.simulation("cells"), list[kt.Event]()
    same(game, game.play(sim, on_contact=told.append, on_part=told.append))
    assert moments_of(told) == moments_of(sim)


def snapshot(game: Game, folder: Path) -> None:
    """A run continues from a snapshot, twice, in the same way."""
    sim = game.play(game.simulation("cells"), MIDDLE)
    taken = sim.snapshot()
    same(game, game.play(sim))
    for _ in range(2):
        sim.restore(taken)
        sim.audit()
        same(game, game.play(sim))


def saved(game: Game, folder: Path, phases: tuple[str | None, ...] = (None, "sap-1d")) -> None:
    """A run continues from a file, under its own phase and another one."""
    game.play(game.simulation("cells"), MIDDLE).save(folder / "saved.ktsim")
    for phase in phases:
        sim = kt.resume(folder / "saved.ktsim", phase)
        sim.audit()
        same(game, game.play(sim))


def history(game: Game, folder: Path) -> None:
    """The record of a run, with commands by hand, is a scene with the same contacts; also as a file."""
    scene = game.played("cells").recorded()
    save_scene(scene, folder / "recorded.toml")
    assert load_scene(folder / "recorded.toml") == scene
    sim = kt.Simulation(scene, "sap-1d")
    sim.run()
    same(game, sim)


def scene_file(game: Game, folder: Path) -> None:
    """A scene is the same scene after it was written and read."""
    save_scene(game.scene, folder / "scene.toml")
    read = load_scene(folder / "scene.toml")
    assert read == game.scene
    assert dumps_scene(read) == dumps_scene(game.scene)


def event_file(game: Game, folder: Path) -> None:
    """An event file has the contacts, and any moment of the trajectory; so has the file of a killed run."""
    path, killed = folder / "events.parquet", folder / "killed.parquet"
    sim = game.simulation("cells")
    with EventRecorder(path, game.scene) as recorder:
        game.play(sim, recorder=recorder)
        recorder.flush()
        shutil.copy(recorder.partial, f"{killed}.partial")
    recover(f"{killed}.partial")
    assert read_events(path).rows.tobytes() == read_events(killed).rows.tobytes()
    for each in (path, killed):
        assert read_events(each).metadata["fingerprint"] == sim.fingerprint
        trajectory = Trajectory.read(each)
        assert trajectory.bodies(LASTS).tolist() == sim.bodies.tolist()
        assert trajectory.positions(LASTS).tolist() == sim.positions().tolist()


def certify(game: Game, folder: Path) -> None:
    """The certifier finds the list right, to its end, and a list without its fifth line wrong."""
    sim = truth(game.names)
    scene = sim.recorded()
    report = certify_log(scene, sim.contacts, until=LASTS, fingerprint=sim.fingerprint)
    assert report.right, report
    assert not certify_log(scene, np.delete(sim.contacts, len(sim.contacts) // 2), until=LASTS).right
    rules = answer(scene, len(sim.contacts), (sim.exact_time[0] << 52) + sim.exact_time[1])
    assert [((e << 52) + t, a, b) for e, t, a, b in rows_of(sim)] == rules.contacts


def second(game: Game, folder: Path) -> None:
    """The second implementation prints the same list."""
    sim = truth(game.names)
    try:
        rows, _, fingerprint = second_list(game_tables(sim.recorded(), folder), folder)
    except AssertionError as error:  # it ended with a sentence
        raise Refused(str(error)) from None
    assert rows == rows_of(sim)
    assert fingerprint == sim.fingerprint


def _check(name: str) -> Callable[[Game, Path], None]:
    def observe(game: Game, folder: Path) -> None:
        narrow = {} if game.draft.narrow is None else {game.draft.narrow: {}}
        run = CheckRun(check_named(name), Subject("cells", {}, narrow))
        assert run.holds(truth(game.names).recorded()), run.message
        if run.refused:
            raise Refused(run.refusal)

    return observe


def page_recorded(game: Game, folder: Path) -> None:
    """Places in the page are the run's at any moment; a recorded structure is there."""
    sim = truth(game.names)
    page = view_scene(sim.recorded(), [("cells", {})], until=LASTS).page
    times = np.linspace(0.0, LASTS, 49).tolist()
    asked = """return given.times.map((time) => {
        play.seek(clock.momentAt(time, held.start, held.unit));
        const { there } = play.runs[0].motion.plans;
        return [[...there.keys()].filter((body) => there[body]), placesOf(play.runs[0].motion, play.moment)];
    });"""
    found = ask_node(folder, page, asked, times=times)
    parts: list[Any] = []
    game.play(game.simulation("naive"), recorder=parts.append)
    trajectory = Trajectory(np.concatenate(parts), sim.recorded())
    for time, (bodies, places) in zip(times, found, strict=True):
        assert bodies == trajectory.bodies(time).tolist()
        assert places == trajectory.positions(time).tolist()


def page_computed(game: Game, folder: Path) -> None:
    """The contacts that a page computes are the run's; or it gives the reason for computing none."""
    sim = truth(game.names)
    page = view_scene(sim.recorded(), [("naive", {})], until=LASTS, steps=False).page
    said = _untried(page, folder)
    if said:
        raise Refused(said)
    moment = divmod(Clock(sim.scene.start, sim.time_unit).ticks(MIDDLE), TICKS)
    found = ask_node(folder, page, PLAYED, moment=moment, turns=[], inserts=[])
    assert [tuple(row) for row in found] == rows_of(sim)


def _untried(page: Any, folder: Path) -> str:
    """Returns the reason why a page computes nothing, in its words; "" if it computes."""
    commands = "[3, 4, 5, 9, 11, 12].some((kind) => play.runs[0].motion.rows.kind.includes(kind))"
    asked = f"return trial.reasonAgainst({{ held, bodies, commands: {commands} }}) ?? '';"
    return str(ask_node(folder, page, asked))


def pictures(game: Game, folder: Path) -> None:
    """A picture has every present body, under every phase that draws."""
    for phase in GENERAL:
        drawn = as_svg(game.play(game.simulation(phase), MIDDLE))
        assert "<svg" in (drawn or "")


def space_time(game: Game, folder: Path) -> None:
    """Bands in space and time are the run's."""
    scene = truth(game.names).recorded()
    for axis in "xy":
        run = take_space_time(kt.Simulation(scene, "cells"), LASTS, axis)
        assert {piece.body for piece in run.pieces} >= {0, 1, 2, 3, 4, 5, 6}
        assert space_time_svg(run).startswith(b"<")


OFTEN = ("energy", "momentum", "temperature", "msd", "vacf", "g", "S", "psi6", "cells")
OBSERVED = ("rates", "pressure", *(f"{name}:every=0.25" for name in OFTEN))


def observables(game: Game, folder: Path) -> None:
    """Each observable has the same estimates under two phases and in a run that is stopped, saved and resumed
    under a third, or refuses the scene by the same sentence."""
    found: list[dict[str, str]] = []
    measured = []
    for phase in ("naive", "cells"):
        said = {}
        for name in OBSERVED:
            sim = game.simulation(phase)
            try:
                sim.run(until=1.25, observe=[name])
                said[name] = repr(sim.observed.rows())
                measured += [name] if found else []
            except KinetileError as error:
                said[name] = str(error)
        found.append(said)
    assert found[0] == found[1]
    sim = game.simulation("cells")
    sim.run(until=1.25, max_contacts=3, observe=measured)
    sim.save(folder / "observed.kt")
    sim = kt.resume(folder / "observed.kt", "sap-1d")
    sim.run(until=1.25, observe=sim.observed)
    whole = game.simulation("naive")
    whole.run(until=1.25, observe=measured)
    assert repr(sim.observed.rows()) == repr(whole.observed.rows())


def queries(game: Game, folder: Path) -> None:
    """The event that is scheduled next happens next; boxes, rays and neighbours find the present bodies."""
    sim = game.play(game.simulation("cells"), MIDDLE)
    there = sim.bodies.tolist()
    nexts = [each for each in (sim.next_contact_of(body, scheduled=True) for body in there) if each]
    rows = rows_of(truth(game.names))[len(sim.contacts) :]
    first = min(((each.epoch, each.tick) for each in nexts), default=None)
    if not (game.draft.planned or game.by_hand) or (
        nexts and rows
    ):  # a command may end the scheduled event, or cause a contact
        assert first == rows[0][:2] if rows else first is None or first >= (int(LASTS), 0)
    assert sorted(sim.bodies_near((3.0, 3.0), k=99).tolist()) == sorted(sim.bodies.tolist())
    everywhere = (-99.0, -99.0, 99.0, 99.0)
    assert sim.bodies_in(everywhere).tolist() == sim.bodies.tolist()
    body = sim.bodies.tolist()[0]
    x, y = sim.positions()[0].tolist()
    hits = sim.ray((x, y), (1.0, 0.5), within=8.0)
    assert hits[0].body == body or hits[0].distance == 0.0
    sim.cast((x, y, 0.0625), (1.0, 0.25))
    if game.draft.shaped:
        sim.cast((x, y, kt.box(0.25, 0.125)), (1.0, 0.25))


def exports(game: Game, folder: Path) -> None:
    """Frames of the run as extended XYZ and GSD have the present bodies."""
    from kinetile.records.frames import frames_of, write_frames

    scene = truth(game.names).recorded()
    for form in ("xyz", "gsd") if find_spec("gsd") else ("xyz",):
        path = folder / f"frames.{form}"
        sim = kt.Simulation(scene, "cells")
        times = [0.0, 1.0, MIDDLE, LASTS]
        assert write_frames(path, scene, frames_of(sim, times)) == len(times)
        assert path.stat().st_size > 0


def study(game: Game, folder: Path) -> None:
    """A table of this scene under two phases has one fingerprint."""
    save_scene(truth(game.names).recorded(), folder / "mine.toml")
    tables = {"phases": ["naive", "cells"], "scenes": [{"file": str(folder / "mine.toml")}], "until": LASTS}
    done = run_here(Study(tables, folder / "rows.sqlite"))
    assert done.well
    assert done.statuses == {"done": 2}, done
    assert not done.disagreements


def compared(game: Game, folder: Path) -> None:
    """``compare`` finds all phases of one answer."""
    found = kt.compare(truth(game.names).recorded(), ["naive", "cells", "sap-1d"], until=LASTS)
    assert found.identical, found.divergences


def together(game: Game, folder: Path) -> None:
    """A scene of several capabilities has one answer: each of them has an effect, and every broad phase, the
    certifier, a saved run and its recorded commands agree. Phases may refuse the scene if they refuse one
    capability alone."""
    sim = truth(game.names)
    for name in game.names:
        assert BY_NAME[name].seen(game, sim), f"{name} does not come into play"
    for phase in ("cells", "sap-1d", "sap-2d", "sweep-tiling", "power"):
        with suppress(Refused) if phase in ("sweep-tiling", "power") else nullcontext():
            same(game, game.played(phase, audit=17 if phase == "cells" else None))
    saved(game, folder, ("sap-1d",))
    history(game, folder)
    if "foreign response" not in game.names:
        certify(game, folder)


@dataclass(frozen=True)
class Observation:
    """A column of the matrix."""

    name: str
    observe: Callable[[Game, Path], None]
    needs: str = ""


OBSERVATIONS = (
    Observation("under naive", naive),
    Observation("under cells", _under("cells")),
    Observation("under sap-1d", _under("sap-1d")),
    Observation("under sap-1d, axis y", _under("sap-1d", axis="y")),
    Observation("under sap-2d", _under("sap-2d")),
    Observation("under sap-k", _under("sap-k", directions=3)),
    Observation("under sweep-tiling", _under("sweep-tiling")),
    Observation("under power", _under("power")),
    Observation("run in pieces", pieces),
    Observation("step and steps", step_by_step),
    Observation("stop_at and on_contact", stop_at),
    Observation("snapshot", snapshot),
    Observation("save and resume", saved),
    Observation("recorded history", history),
    Observation("scene file", scene_file),
    Observation("event file and recover", event_file),
    Observation("compare", compared),
    Observation("certify-log", certify),
    Observation("second implementation", second, "node"),
    Observation("kit: contacts", _check("same-contacts")),
    Observation("kit: watched", _check("its-structure-is-true")),
    Observation("player, recorded", page_recorded, "node"),
    Observation("player, computed", page_computed, "node"),
    Observation("pictures", pictures),
    Observation("space-time", space_time),
    Observation("observables", observables),
    Observation("queries", queries),
    Observation("export", exports),
    Observation("studies", study),
)
COLUMNS = {each.name: each for each in OBSERVATIONS}

__all__ = ["COLUMNS", "OBSERVATIONS"]
