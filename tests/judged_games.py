"""Games of ``games.py`` judged by two followers of docs/specification.md: ``certify-log`` to the end and the
second implementation; and forged lists of their contacts, which must be found.

``python tests/judged_games.py 500 [FIRST [accelerated]]`` prints the number of 500 games that agree, or of
games with accelerations."""

import json
import math
import random
import subprocess
import sys
import tempfile
import tomllib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

import games
import kinetile as kt
from kinetile.errors import Refused, ZenoError
from kinetile_accuracy import certify_log
from programs import program

SECOND = Path(__file__).parent / "second"
MOST = 300
"""The most contacts of a game in a quick test."""

JAMMED = 10_000
"""More contacts than a jam of so few bodies has before it is found."""

Rows = Any


# The certifier


def with_end(
    game: kt.Scene, broad_phase: str = "naive", most: int = MOST
) -> tuple[kt.Simulation, dict[str, Any]]:
    """Returns a played game, and the arguments of ``certify_log`` for its end."""
    sim = kt.Simulation(game, broad_phase)
    try:
        sim.run(max_contacts=most)
    except ZenoError:
        return sim, {}
    except Refused:  # there is no room
        return sim, {"until": game.settings.until}
    if len(sim.contacts) >= most:  # a command may end several passings at once
        return sim, {"max_contacts": len(sim.contacts)}
    return sim, {"until": game.settings.until}


def forgeries(sim: kt.Simulation, end: dict[str, Any], rng: random.Random) -> Iterator[tuple[str, Rows]]:
    """Yields forged lists of a game, by the kind of their forgery."""
    true, bodies = sim.contacts, len(sim.scene) + len(sim.scene.commands)
    if len(true) < 4:
        return
    at = rng.randrange(len(true) - 2)
    walls = np.flatnonzero(true["b"] < 0)

    def with_field(where: int, **fields: Any) -> Rows:
        forged = true.copy()
        for name, value in fields.items():
            forged[name][where] = value
        return forged

    later = rng.choice((-1000, -1, 1, 1000, 2**40))
    yield "another tick", with_field(at, tick=true["tick"][at] + later)
    order = [*range(at), at + 1, at, *range(at + 2, len(true))]
    if true[at] != true[at + 1]:  # in a jam a body may meet a wall twice at one tick
        yield "another order", true[order]
    yield "left out", np.delete(true, at)
    yield "twice", np.insert(true, at + 1, true[at : at + 1])
    a, b = sorted(rng.sample(range(bodies), 2))
    invented = with_field(at, a=a, b=b)[at : at + 1]
    if invented.tobytes() != true[at : at + 1].tobytes():
        yield "invented", np.insert(true, at, invented)
    other = rng.choice([body for body in range(bodies) if body not in (true["a"][at], true["b"][at])])
    yield "another body", with_field(at, a=other)
    if len(walls):
        where = int(rng.choice(walls.tolist()))
        wall = rng.choice([wall for wall in (-1, -2, -3, -4) if wall != true["b"][where]])
        yield "another wall", with_field(where, b=wall)
    yield "another time", with_field(at, time=np.nextafter(true["time"][at], rng.choice((-99.0, 99.0))))
    if "until" in end:
        yield "the last left out", true[:-1]


def first_change(true: Rows, forged: Rows) -> int:
    """Returns the first line that is changed, missing or added."""
    both = min(len(true), len(forged))
    other = np.flatnonzero([one != two for one, two in zip(true[:both], forged[:both], strict=True)])
    return int(other[0]) if len(other) else both


def forged_and_found(game: kt.Scene, seed: int) -> Iterator[tuple[str, bool]]:
    """Yields each forgery, and True if it is found at its first wrong line."""
    sim, end = with_end(game)
    for name, rows in forgeries(sim, end, random.Random(f"forgeries {seed}")):
        wrong = certify_log(game, rows, **end).wrong
        yield name, wrong is not None and wrong.index == first_change(sim.contacts, rows)
    false = ("f" if sim.fingerprint[0] == "0" else "0") + sim.fingerprint[1:]
    wrong = certify_log(game, sim.contacts, **end, fingerprint=false).wrong
    yield "another fingerprint", wrong is not None and wrong.index == len(sim.contacts)


# The second implementation


def node(script: str, *words: str) -> subprocess.CompletedProcess[str]:
    """Returns the output of a script of the second implementation."""
    command = [program("node"), str(SECOND / script), *words]
    return subprocess.run(command, capture_output=True, text=True, timeout=1200, check=False)


def game_tables(game: kt.Scene, folder: Path) -> dict[str, Any]:
    """Returns the tables of a scene in the form of JSON."""
    kt.save_scene(game, folder / "scene.toml")
    tables = tomllib.loads((folder / "scene.toml").read_text())
    inserted = [each["insert"] for each in tables.get("commands", ()) if "insert" in each]
    for body in [*tables["bodies"], *inserted]:
        if body.get("mass") == math.inf:
            body["mass"] = "inf"  # JSON has no such number
    return tables


def second_list(
    tables: dict[str, Any], folder: Path, most: int | None = None
) -> tuple[list[tuple[int, ...]], str, str]:
    """Returns the contacts that `run.js` prints, the end of the answer, and the fingerprint."""
    (folder / "scene.json").write_text(json.dumps(tables, allow_nan=False))
    done = node("run.js", str(folder / "scene.json"), *(["--contacts", str(most)] if most else []))
    assert done.returncode == 0, done.stderr
    *lines, last = done.stdout.splitlines()
    end = lines.pop() if lines and lines[-1] in ("no room", "jam") else "end"
    return [tuple(map(int, line.split())) for line in lines], end, last.removeprefix("fingerprint ")


def second_agrees(game: kt.Scene, folder: Path, most: int = MOST) -> bool:
    """Returns True if the second implementation finds a game's contacts, up to ``most``, and its end."""
    wanted = games.play(game, most=most)
    most = max(most, len(wanted.contacts))  # a command may end several passings at once
    rows, end, fingerprint = second_list(game_tables(game, folder), folder, most)
    if "jam" in (wanted.end, end):  # kinetile's guard and this one stop at different contacts
        shorter = min(len(rows), len(wanted.contacts))
        both = wanted.end in ("jam", "contacts") and (end == "jam" or len(rows) == most)
        return both and rows[:shorter] == wanted.contacts[:shorter]
    same_end = wanted.end in (end, "contacts")
    return same_end and rows == wanted.contacts and fingerprint == wanted.fingerprint


def main(many: int, first: int = 0, kind: str = "") -> int:
    """Judges games, prints the results, and returns the number of failed games."""
    ends, caught, failed = Counter[str](), Counter[str](), Counter[str]()
    contacts, wrong = 0, set()
    for seed in range(first, first + many):
        game = games.draw_accelerated_game(seed) if kind == "accelerated" else games.draw_game(seed)
        sim, end = with_end(game, most=JAMMED)
        contacts += len(sim.contacts)
        ends[next(iter(end), "jam")] += 1
        with tempfile.TemporaryDirectory() as folder:
            judged = {
                "cells": with_end(game, "cells", JAMMED)[0].fingerprint == sim.fingerprint,
                "certify-log": certify_log(game, sim.contacts, **end, fingerprint=sim.fingerprint).right,
                "the second implementation": second_agrees(game, Path(folder), JAMMED),
            }
        for name, found in forged_and_found(game, seed):
            caught[name] += found
            judged[f"a forgery: {name}"] = found
        failed.update(name for name, right in judged.items() if not right)
        if not all(judged.values()):
            wrong.add(seed)
            print(f"game {seed}: {', '.join(name for name, right in judged.items() if not right)}")
    print(f"{many} games, {contacts:,} contacts; ended by {dict(ends)}")
    print(f"forgeries found: {dict(caught)}")
    print(f"failed: {dict(failed) or 'none'}")
    return len(wrong)


if __name__ == "__main__":
    sys.exit(min(main(*map(int, sys.argv[1:3]), *sys.argv[3:]), 1))
