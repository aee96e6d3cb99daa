"""Which broad phase for a scene: what is recommended, why, and whether the whole measurement agrees."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

import kinetile as kt
from kinetile.cli import app
from kinetile_bench.own.choose import CLOSE, Candidate, _recommendation, choose
from kinetile_bench.own.scene import SceneRow, bench_scene


def candidate(name: str, rate: float | None, memory: int | None = 1000, hopeless: bool = False) -> Candidate:
    return Candidate(SceneRow(name, contacts_per_cpu_second=rate), hopeless, memory)


def test_the_fastest_is_named_with_how_far_the_next_is_behind():
    found = [candidate("a", 300.0), candidate("b", 150.0, hopeless=True), candidate("c", None, None)]
    assert _recommendation(found) == ("a", "a has 2 times the contacts a CPU second of b, which comes next")


def test_of_those_that_do_not_differ_the_smallest_is_named():
    alike = 300.0 * (1.0 - CLOSE / 2.0)
    found = [candidate("a", 300.0, 2000), candidate("b", alike, 1000), candidate("c", 100.0, 10)]
    name, reason = _recommendation(found)
    assert name == "b"
    assert reason == "b and a differ by less than 5%; b takes the least memory"


def test_a_phase_alone_and_none_at_all_are_told():
    assert _recommendation([candidate("a", 3.0), candidate("b", None, None)]) == (
        "a",
        "a is the only one that can do this scene",
    )
    assert _recommendation([candidate("a", None, None)])[0] is None


def test_a_scene_without_walls_is_left_when_all_have_flown_apart():
    plane = kt.Scene([[0.0, 0.0], [2.0, 0.0]], [[1.0, 0.0], [-1.0, 0.0]], 0.25)
    found = choose(plane, ["naive", "cells", "sweep-tiling"])
    assert found.identical
    assert found.phase in ("naive", "cells")
    assert [each.row.contacts for each in found.candidates] == [1, 1, None]
    assert found.candidates[-1].memory is None
    assert "arena" in found.candidates[-1].row.ended_by


@pytest.mark.parametrize("position", [[], [[0.0, 0.0], [4.0, 0.0]]])
def test_where_nothing_collides_any_phase_will_do(position):
    found = choose(kt.Scene(position, [[0.0, 0.0]] * len(position), 0.5), ["naive", "cells"])
    assert found.phase in ("cells", "naive")
    assert "any phase that does the scene will do" in found.reason


def test_the_command_prints_the_candidates_and_what_to_take():
    said = CliRunner().invoke(app, ["choose", "grid", "-s", "bodies=16", "--phases", "naive,cells"])
    assert said.exit_code == 0
    *_, last = said.stdout.splitlines()
    assert last.startswith("take ")
    as_json = ["choose", "grid", "-s", "bodies=16", "--phases", "cells", "--json"]
    found = json.loads(CliRunner().invoke(app, as_json).stdout)
    assert found["phase"] == "cells"
    assert found["candidates"][0]["memory"] > 0


UNLIKE = {
    "dense": ("grid", {"bodies": 400, "density": 0.5}, 2.0),
    "thin": ("grid", {"bodies": 400, "density": 0.01}, 20.0),
    "few": ("grid", {"bodies": 9, "density": 0.25}, 50.0),
    "many": ("grid", {"bodies": 4096, "density": 0.25}, 0.2),
    "sizes": ("random", {"bodies": 500, "density": 0.3, "radius_ratio": 16.0, "seed": 2}, 2.0),
    "masses": ("random", {"bodies": 200, "density": 0.3, "mass_ratio": 100.0, "seed": 3}, 4.0),
    "ties": ("lattice", {"bodies": 36}, 60.0),
    "one axis": ("figure-10", {"bodies": 200}, 10.0),
    "boxes": ("figure-11", {"bodies": 100}, 10.0),
    "a giant": ("figure-16", {"bodies": 200}, 10.0),
}
"""Recipes, parameters, and until when they are measured whole."""


@pytest.mark.slow
@pytest.mark.compiled
def test_of_ten_unlike_scenes_at_most_one_is_wrong_by_more_than_a_fifth():
    wrong = {}
    for title, (recipe, parameters, until) in UNLIKE.items():
        scene = kt.make_scene(recipe, **parameters)
        chosen = choose(scene)
        able = [row.phase for row in (each.row for each in chosen.candidates) if row.cpu_seconds is not None]
        whole = bench_scene(scene, able, until, max_contacts=200_000)
        rates = {row.phase: row.contacts_per_cpu_second or 0.0 for row in whole.rows}
        lost = 1.0 - rates[chosen.phase] / max(rates.values())
        print(f"{title}: {chosen.phase}, {lost:.0%} behind {max(rates, key=rates.__getitem__)}")
        if lost > 0.2:
            wrong[title] = (chosen.phase, rates)
    assert len(wrong) <= 1, wrong
