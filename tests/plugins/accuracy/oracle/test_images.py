"""The certified oracle on periodic axes: against runs, rational arithmetic, and other cuts of the box."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from typer.testing import CliRunner

import kinetile as kt
import torus_scenes
from kinetile.cli import app
from lanes import first

pytest.importorskip("flint", reason="the certified oracle needs python-flint")

from kinetile_accuracy.oracle import oracle as oracle_module
from kinetile_accuracy.oracle.agreement import certify
from kinetile_accuracy.oracle.oracle import CertifiedRun, oracle_contacts

NO_LINES = (339, 355)
"""Undecidable: an exact graze, and a tie of walls by symmetry, both after a contact at an irrational time."""

TANGENT = 368
"""Two discs pass by at a distance of no more and no less than their reach, and rounded plans make it less."""


def listed(run: CertifiedRun) -> list[tuple[int, int, tuple[int, int]]]:
    return [(met.a, met.b, image) for met, image in zip(run.contacts, run.images, strict=True)]


def drawn(seed: int) -> kt.Scene:
    """Return a drawn scene, every fourth one with turns, at whole eighths of its unit."""
    scene, random = torus_scenes.drawn(seed), np.random.default_rng(seed)
    if seed % 4 != 2:
        return scene
    bodies, others = random.integers(0, len(scene), (2, 6))
    times = random.integers(1, 60, 6) / 8.0 * scene.time_unit
    velocities = scene.velocity[others, ::-1]
    return scene.replace(turns=list(zip(bodies.tolist(), times.tolist(), velocities.tolist(), strict=True)))


@pytest.mark.parametrize("seed", first(24, range(600)))
@pytest.mark.compiled
def test_runs_agree_until_roundings_have_grown(seed: int) -> None:
    """A run that agrees is off by little, in times too; errors grow by less than 2^16 from one to the next.

    With two bodies the lists say nothing, and times all.
    """
    scene = drawn(seed)
    found = certify(kt.Simulation(scene, "naive"), until=1000 * scene.time_unit, max_contacts=40)
    off = np.abs(found.ticks)
    alike = int(np.argmax(off > 2.0**36)) if off.max(initial=0.0) > 2.0**36 else found.contacts
    if seed in NO_LINES:
        assert found.disagreement is None
        assert found.oracle.ended == "undecidable"
    elif seed == TANGENT:
        assert found.disagreement is not None
        assert found.disagreement.run is not None
        assert found.disagreement.run[1:] == (1, 2)
    elif alike < found.compared or not found.complete:
        assert off[:alike].max(initial=0.0) > 2.0**20, str(found)


# Rational arithmetic


def in_fractions(scene: kt.Scene, until: Fraction) -> list[tuple[Fraction, int, int, int]]:
    """Return the contacts of discs of one mass in rows along x, which is periodic, with their images."""
    width = Fraction(scene.periods[0])
    x, v, r = (
        list(map(Fraction, numbers.tolist()))
        for numbers in (scene.position[:, 0], scene.velocity[:, 0], scene.radius)
    )
    rows, now, found = scene.position[:, 1].tolist(), Fraction(0), []
    while True:
        events = []
        for a in range(len(x)):
            for b in range(a + 1, len(x)):
                here, speed = x[b] - x[a], v[b] - v[a]
                middle = -round(here / width)
                for image in range(middle - 3, middle + 4):
                    apart = here + image * width
                    if rows[a] == rows[b] and apart * speed < 0:
                        gap = abs(apart) - r[a] - r[b]
                        events.append((max(gap / abs(speed), Fraction(0)), a, b, image))
        if not events or now + min(events)[0] > until:
            return found
        wait, a, b, image = min(events)
        now += wait
        x = [place + speed * wait for place, speed in zip(x, v, strict=True)]
        v[a], v[b] = v[b], v[a]
        found.append((now, a, b, image))


def rows_around(seed: int) -> kt.Scene:
    """Return equal rows of discs that go round, in no order, some of them touching, some periods away."""
    random = np.random.default_rng(seed)
    per_row, rows = int(random.integers(2, 5)), int(random.integers(1, 4))
    gaps = random.integers(0, 5, per_row) / 64.0
    gaps[-1] += 1 / 64.0
    places = np.cumsum(gaps + 8 / 64.0)
    speeds = random.integers(-1, 2, per_row) / 2.0
    speeds[0] += not speeds.any()
    position = np.array([[place, 0.25 + row / 2.0] for row in range(rows) for place in places])
    position[:, 0] += random.integers(-2, 3, len(position)) * places[-1]
    velocity = np.array([[speed, 0.0] for _ in range(rows) for speed in speeds])
    order = random.permutation(len(position))
    axes = ("x", "xy")[seed % 2]
    return kt.Scene(position[order], velocity[order], 4 / 64.0, arena=(places[-1], 1.5), periodic=axes)


def exchanged(scene: kt.Scene) -> kt.Scene:
    """Return a scene with x for y."""
    return scene.replace(
        position=scene.position[:, ::-1],
        velocity=scene.velocity[:, ::-1],
        arena=scene.arena[::-1],
        periodic={"x": "y"}.get(scene.periodic, scene.periodic),
    )


@pytest.mark.parametrize("seed", range(12))
def test_rows_that_go_round_agree_with_fractions_ties_and_all(seed: int) -> None:
    scene = rows_around(seed)
    expected = in_fractions(scene, Fraction(2))
    times = [time for time, *_ in expected]
    for here, along in ((scene, 0), (exchanged(scene), 1)):
        run = oracle_contacts(here, 2.0)
        assert run.ended == "until"
        assert [(a, b, image[along]) for a, b, image in listed(run)] == [row[1:] for row in expected]
        assert all(image[1 - along] == 0 for image in run.images)
        assert [met.tied for met in run.contacts] == [
            k and times[k] == times[k - 1] for k in range(len(times))
        ]
        for met, time in zip(run.contacts, times, strict=True):
            assert abs(met.time.middle - time) <= met.time.radius
        assert certify(kt.Simulation(here, "naive"), until=2.0).complete, "all of the list, to the end"


# Several images at one time


@pytest.mark.parametrize("radius", [0.3125, 0.3])
@pytest.mark.parametrize("number", [0, 1])
def test_two_images_are_met_at_one_time_in_their_order(radius: float, number: int) -> None:
    """A disc flies up between another, at rest, and its image, to a rational or irrational time."""
    position, velocity = np.array([[0.0, 0.0], [0.5, -1.375]]), np.array([[0.0, 0.0], [0.0, 1.0]])
    order = [0, 1][:: 1 - 2 * number]
    scene = kt.Scene(position[order], velocity[order], radius, arena=(1.0, 4.0), periodic="xy")
    run = oracle_contacts(scene, max_contacts=2)
    assert (
        listed(run) == [(0, 1, (-1, 0)), (0, 1, (0, 0))] if not number else [(0, 1, (0, 0)), (0, 1, (1, 0))]
    )
    assert [met.tied for met in run.contacts] == [False, True]
    assert run.bits == oracle_module.FIRST_BITS
    height = Fraction(2 * radius) ** 2 - Fraction(1, 4)  # of the triangle between three centres, squared
    assert abs((Fraction(11, 8) - run.contacts[0].time.middle) ** 2 - height) < Fraction(1, 2**80)
    found = certify(kt.Simulation(scene, "naive"), max_contacts=5)
    assert found.complete
    assert found.worst_ticks < 2.0**20


def test_only_the_image_that_was_about_to_be_met_touches() -> None:
    """Disc 0 turns when they meet: they still do, and fly towards the image of disc 1 below as well."""
    turns = [(0, 1.0, (0.0, -1.0))]
    position, velocity = [[0.0, 0.0], [0.75, 0.0]], [[0.0, 0.0], [-0.5, 0.0]]
    scene = kt.Scene(position, velocity, 0.125, arena=(1.0, 0.3), turns=turns, periodic="xy")
    run = oracle_contacts(scene, max_contacts=2)
    assert listed(run)[0] == (0, 1, (0, 0))
    assert run.contacts[0].time.middle == 1
    assert not run.contacts[1].tied


def test_an_image_that_is_left_bars_itself_alone() -> None:
    """Two discs alone in a lane meet again and again, through two images in turn."""
    scene = kt.Scene(
        [[0.25, 0.5], [0.75, 0.5]], [[0.5, 0.0], [0.0, 0.0]], 0.125, arena=(1.0, 1.0), periodic="xy"
    )
    run = oracle_contacts(scene, 4.0)
    assert [image for _, _, image in listed(run)] == [(0, 0), (-1, 0)] * 2


# Where the box is cut


def moved(scene: kt.Scene, periods: np.ndarray) -> kt.Scene:
    return scene.replace(position=scene.position + periods * np.array(scene.periods))


@pytest.mark.parametrize("seed", [1, 5, 8, 12])
def test_bodies_written_periods_away_have_the_same_contacts_through_other_images(seed: int) -> None:
    scene = kt.make_scene("lattice", bodies=9, seed=seed).replace(periodic="xy")
    periods = np.random.default_rng(seed).integers(-3, 4, (9, 2))
    one, two = (oracle_contacts(each, max_contacts=30) for each in (scene, moved(scene, periods)))
    assert len(one.contacts) > 10
    assert one.contacts == two.contacts or [c.time.nearest for c in one.contacts] == [
        c.time.nearest for c in two.contacts
    ]
    for (a, b, image), (c, d, other) in zip(listed(one), listed(two), strict=True):
        assert (a, b) == (c, d)
        assert tuple(np.add(other, periods[b] - periods[a])) == image


@pytest.mark.parametrize("shift", [(0.0, 0.0), (0.875, 0.0), (0.875, 0.625)])
def test_a_disc_at_rest_that_touches_an_image_is_hit_at_an_irrational_time(
    shift: tuple[float, float],
) -> None:
    """Disc 1 rests against disc 2, here or across a border or a corner, when disc 0 comes."""
    position = np.array([[32.0, 48.0], [5.0, 40.0], [-1.0, 32.0]]) / 64.0
    places = (position + shift) % 1.0
    velocity = [[-1.0, -0.25], [0.0, 0.0], [0.0, 0.0]]
    scene = kt.Scene(places, velocity, 5.0 / 64.0, arena=(1.0, 1.0), periodic="xy")
    run = oracle_contacts(scene, max_contacts=3)
    assert [(met.a, met.b, met.tied) for met in run.contacts][:2] == [(0, 1, False), (1, 2, True)]
    assert run.bits == oracle_module.FIRST_BITS


# Ends


def test_who_meets_nobody_is_given_up_without_an_end(monkeypatch: pytest.MonkeyPatch) -> None:
    position, arena = [[0.125, 0.125], [0.125, 0.625]], (1.0, 1.0)
    alone = kt.Scene(position[:1], [[1.0, 0.5]], 0.125, arena=arena, periodic="xy")
    assert oracle_contacts(alone, max_contacts=3).ended == "quiet"
    beside = kt.Scene(position, [[1.0, 0.0], [1.0, 0.0]], 0.125, arena=arena, periodic="xy")
    assert oracle_contacts(beside, max_contacts=3).ended == "quiet"
    monkeypatch.setattr(oracle_module, "IDLE", 100)
    past = kt.Scene(position, [[1.0, 0.0], [0.5, 0.0]], 0.125, arena=arena, periodic="xy")
    run = oracle_contacts(past, max_contacts=3)
    assert (run.ended, run.complete) == ("idle", False)
    assert "give an end in time" in str(run)
    assert oracle_contacts(past, 1000.0).ended == "until"


def test_periods_that_pass_faster_than_a_double_can_say_are_undecidable() -> None:
    turns = [(0, 1.0, (2.0**60, 0.0))]
    scene = kt.Scene(
        [[0.25, 0.5], [0.75, 0.5]],
        [[0.0, 0.0], [0.0, 0.25]],
        0.125,
        arena=(1.0, 4.0),
        turns=turns,
        periodic="x",
    )
    run = oracle_contacts(scene, 2.0)
    assert run.ended == "undecidable"
    assert "the images that discs 0 and 1 reach next" in str(run)


def test_command_certifies_a_run_on_a_torus() -> None:
    words = ("oracle", "grid", "-s", "bodies=9", "-s", "periodic=xy", "--until", "0.3", "--against", "naive")
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0
    assert "contacts agree in order" in done.stdout
