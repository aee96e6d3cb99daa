"""Events in sentences: they say what the phase's drawings before and after an event differ in."""

import re

import pytest

import kinetile as kt
from kinetile.plugin.drawing import Link, Segment
from kinetile.show.player import view_scene
from player_pages import SCENES, ask_node, needs_node

SENTENCES = """
    const texts = new sentences.Sentences(runs[0], play.runs[0].events, bodies, held);
    return [...play.runs[0].events.kind].map((_, event) => texts.of(event));
"""

RANDOM = kt.make_scene("random", bodies=24, density=0.3, radius_ratio=4.0, seed=4)


@needs_node
@pytest.mark.parametrize("phase", ["sweep-tiling", "sap-2d", "cells"])
def test_pairs_begin_and_end_as_they_are_drawn(phase, tmp_path):
    texts = ask_node(tmp_path, view_scene(RANDOM, [(phase, {})], until=0.12).page, SENTENCES)
    sim = kt.Simulation(RANDOM, phase)

    def pairs() -> set[tuple[int, int]]:
        return {(item.a, item.b) for item in sim.drawing() if isinstance(item, Link)}

    before, changed = pairs(), 0
    for sentence, _ in zip(texts, sim.steps(until=0.12), strict=True):
        after = pairs()
        for verb, there in (("ends?", before - after), ("begins?", after - before)):
            named = re.search(rf"pairs? ([\d, -]+) {verb}", sentence)
            if named:
                found = {tuple(map(int, pair.split("-"))) for pair in named[1].split(", ")}
            assert found == there if named else len(there) > 3 or not there, sentence
            changed += len(there)
        before = after
    assert changed > 10


@needs_node
@pytest.mark.parametrize("phase", ["sweep-tiling", "sap-1d"])
def test_bounds_pass_each_other_by_the_names_that_the_phase_gives_them(phase, tmp_path):
    texts = ask_node(tmp_path, view_scene(RANDOM, [(phase, {})], until=0.12).page, SENTENCES)
    sim, found = kt.Simulation(RANDOM, phase), 0
    for sentence, event in zip(texts, sim.steps(until=0.12), strict=True):
        if event.kind != "structural":
            continue
        passes = re.match(r"([LR]) of (\d+) passes ([LR]) of (\d+)", sentence)
        assert passes, sentence
        at, radius, speed = sim.positions()[:, 0], RANDOM.radius, sim.velocities()[:, 0]
        one, a, other, b = passes[1], int(passes[2]), passes[3], int(passes[4])
        sign = {"L": -1.0, "R": 1.0}
        place = at[b] + sign[other] * radius[b]
        assert at[a] + sign[one] * radius[a] == pytest.approx(place, abs=1e-12)
        assert speed[a] > speed[b]
        assert event.certificate in (a, b)
        found += 1
    assert found > 10
    if phase == "sweep-tiling":
        changes = "three tiles replaced; two bounds replaced; pair 8-9 ends; pair 4-16 begins"
        assert texts[1] == f"L of 9 passes R of 8: {changes}"
    else:
        assert texts[0] == "R of 9 passes L of 5 (meet): two certificates rescheduled"


@needs_node
def test_a_phase_without_words_of_its_own_has_sentences(tmp_path, monkeypatch):
    """Shapes of one role, without labels: the least drawing of a foreign phase."""
    drawing = kt.Simulation.drawing

    def bare(sim: kt.Simulation) -> tuple[object, ...]:
        return tuple(
            Segment("certificate", i.a, i.b, i.fails) for i in drawing(sim) if i.role == "certificate"
        )

    monkeypatch.setattr(kt.Simulation, "drawing", bare)
    texts = ask_node(tmp_path, view_scene(RANDOM, [("sap-1d", {})], until=0.12).page, SENTENCES)
    assert texts[0] == "right side of 9 passes left side of 5"
    assert "bodies 0 and 18 meet" in texts
    monkeypatch.setattr(kt.Simulation, "drawing", lambda sim: ())
    texts = ask_node(tmp_path, view_scene(RANDOM, [("sap-1d", {})], until=0.12).page, SENTENCES)
    assert re.fullmatch(r"a certificate of body (5|9) fails", texts[0])


@needs_node
def test_kinds_and_responses_are_named(tmp_path):
    scene = kt.Scene(
        [(0.5, 1.0), (2.0, 1.0), (3.5, 1.0)],
        [(1.0, 0.0), (0.0, 0.0), (0.0, 0.0)],
        0.25,
        [1.0, 1.0, float("inf")],
        arena=(4.0, 2.0),
        kind=["ball", "sensor", "post"],
        responses={("ball", "sensor"): "pass", ("ball", "post"): "stop"},
    )
    texts = ask_node(tmp_path, view_scene(scene, [("cells", {})], until=4.0).page, SENTENCES)
    said = [sentence.split(":")[0] for sentence in texts]
    assert "ball 0 and sensor 1 begin to pass through each other" in said
    assert "ball 0 and sensor 1 end to pass through each other" in said
    assert "ball 0 and post 2 meet (stop)" in said


@needs_node
def test_who_comes_and_goes_changes_the_structure(tmp_path):
    texts = ask_node(tmp_path, view_scene(SCENES["come and go"], [("sap-1d", {})], until=1.5).page, SENTENCES)
    assert any(re.match(r"body \d+ comes: two bounds new", sentence) for sentence in texts)
    assert any(re.match(r"body \d+ goes: two bounds gone", sentence) for sentence in texts)
    assert any(re.match(r"body \d+ turns", sentence) for sentence in texts)


@needs_node
def test_an_acceleration_and_the_end_of_a_chord_are_named(tmp_path):
    texts = ask_node(tmp_path, view_scene(SCENES["accelerated"], [("naive", {})], until=1.0).page, SENTENCES)
    assert "body 1 gets another acceleration" in texts
    assert "a certificate of body 0 fails, or its chord ends" in texts


@needs_node
def test_another_kind_is_named(tmp_path):
    texts = ask_node(tmp_path, view_scene(SCENES["changes"], [("naive", {})], until=1.5).page, SENTENCES)
    assert "body 0 gets another kind" in texts
    assert "bodies 0 and 1 begin to pass through each other" in texts  # the page has no kinds of the moment
