"""Observables of a run that is stopped, saved and resumed: the same estimates, bit for bit."""

import pickle
from collections.abc import Callable

import numpy as np
import pytest

import kinetile as kt
from command_line import kinetile, printed, refused
from kinetile import Observable
from kinetile.errors import BadOption, PhaseError, RecordError
from kinetile.kernel.compiled import NOTHING_IS_COMPILED
from kinetile.plugin.registry import registry
from lanes import first
from registering import registered

ALL = [
    *("pressure:by=counts", "pressure:by=impulses", "rates", "temperature:every=0.013", "energy", "momentum"),
    *("msd:lags=7,every=0.02", "vacf:lags=9", "g:bins=20", "S:modes=3", "psi6", "rates:after=0.3"),
    *("cells", "energy:every=0.1,series=true"),
]
LIVING = [each for each in ALL if "counts" not in each]
END = 1.0

Stops = Callable[[kt.Simulation, object], None]


def discs(**changes) -> kt.Scene:
    made = kt.make_scene("mixture", bodies=9, density=0.5, seed=5)
    return made.replace(mass=np.linspace(1.0, 3.0, 9), **changes)


def newton() -> kt.Scene:
    """Four ranks of discs, which meet in pairs, two pairs at each tick."""
    place = [(x, y) for y in (2.0, 5.0) for x in (2.0, 5.0)]
    return kt.Scene(place, [(1.0, 0.0), (-1.0, 0.0)] * 2, 1.0, arena=(7.0, 7.0))


def commands() -> kt.Scene:
    inserted = kt.Insert(0.45, (0.2, 0.2), (0.1, 0.3), 0.05)
    return discs(commands=[kt.Remove(3, 0.21), inserted, kt.Remove(5, 0.8), kt.Turn(2, 0.5, (1.0, 0.0))])


def boxes() -> kt.Scene:
    places = [(2.0, 2.0), (5.0, 2.5), (2.5, 5.0), (5.5, 5.5)]
    flies = [(3.0, 1.0), (-3.0, 1.0), (2.0, -3.0), (-2.0, -2.0)]
    shapes = [kt.box(1.0, 1.5), kt.box(2.0, 1.0), kt.disc(0.5), kt.disc(0.7)]
    return kt.Scene(places, flies, shapes=shapes, shape=range(4), arena=(8.0, 8.0), periodic="x")


SCENES: dict[str, tuple[Callable[[], kt.Scene], list[str]]] = {
    "discs": (discs, ALL),
    "alike": (newton, ALL),
    "periodic xy": (lambda: kt.make_scene("mixture", bodies=9, density=0.5, periodic="xy"), ALL),
    "commands": (commands, LIVING),
    "shapes, periodic x": (boxes, [each for each in LIVING if each not in ("psi6", "cells")]),
}


def by_contacts(many: int) -> Stops:
    """Stops between two contacts, also at one tick."""

    def run(sim, observe):
        sim.run(END, max_contacts=many, observe=observe)

    return run


def at_contact(sim, observe):
    sim.run(END, stop_at=kt.StopAt(bodies=[0, 1]), observe=observe)


def within(sim, observe):
    """Stops by an error of its own progress, as a signal does."""

    def progress(state):
        if state.time >= 0.35:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sim.run(END, observe=observe, progress=progress)


STOPS: dict[str, list[Stops]] = {
    "at the first contacts": [by_contacts(1), by_contacts(1), by_contacts(1)],
    "among contacts": [by_contacts(7)],
    "at a contact, then later": [at_contact, by_contacts(5)],
    "by an interrupt, then among contacts": [within, by_contacts(3)],
    "by events": [lambda sim, observe: sim.run(END, max_events=11, observe=observe)],
}


def whole(name: str) -> tuple[str, str]:
    make, observe = SCENES[name]
    sim = kt.Simulation(make(), "naive")
    sim.run(END, observe=observe)
    assert len(sim.observed) == len(observe)
    return sim.fingerprint, repr(sim.observed.rows())


@pytest.mark.parametrize("name", first(1, [*SCENES]))
def test_a_run_that_was_stopped_lost_its_averages(name, tmp_path):
    expected, make, observe = whole(name), *SCENES[name]
    for stops in [*STOPS.values()][:: 3 if NOTHING_IS_COMPILED else 1]:
        sim, goes_on = kt.Simulation(make(), "naive"), observe
        for number, stop in enumerate(stops):
            stop(sim, goes_on)
            sim.save(tmp_path / "stopped.kt")
            sim = kt.resume(tmp_path / "stopped.kt", ("cells", "sap-1d")[number % 2])
            goes_on = sim.observed
        sim.run(END, observe=goes_on)
        assert (sim.fingerprint, repr(sim.observed.rows())) == expected


@pytest.mark.slow
def test_it_goes_on_in_the_same_simulation_and_from_a_snapshot():
    expected, observe = whole("discs"), ALL
    sim = kt.Simulation(discs(), "naive")
    saved = []
    sim.run(END, observe=observe, progress=lambda _: saved.append(sim.snapshot()))
    assert repr(sim.observed.rows()) == expected[1]
    for there in saved[:: max(len(saved) // 2, 1)]:
        sim.restore(pickle.loads(pickle.dumps(there)))
        sim.run(END, max_contacts=2, observe=sim.observed)
        sim.run(END, observe=sim.observed)
        assert (sim.fingerprint, repr(sim.observed.rows())) == expected


@pytest.mark.slow
def test_an_interval_by_contacts_is_found_by_a_run_that_goes_on():
    observe = ["pressure", "msd:lags=3,every=0.1", "g:bins=5"]
    one, parts = (kt.Simulation(discs(), "naive") for _ in range(2))
    one.run(max_contacts=30, observe=observe)
    there = []
    parts.run(max_contacts=30, observe=observe, progress=lambda _: there.append(parts.snapshot()))
    parts.restore(there[0])
    done = parts.readings.contacts_disc + parts.readings.contacts_wall
    parts.run(max_contacts=30 - done, observe=parts.observed)
    assert repr(parts.observed.rows()) == repr(one.observed.rows())


def test_names_begin_anew_and_an_unobserved_time_is_refused():
    sim = kt.Simulation(discs(), "naive")
    with pytest.raises(BadOption, match="continues the last observation, and there is none: expected obse"):
        sim.run(0.25, observe=sim.observed)
    assert sim.time == 0.0
    sim.run(0.5, observe=["energy:every=0.1"])
    first = sim.observed
    sim.run(1.0, observe=["energy:every=0.1"])
    assert repr(sim.observed.rows()) == repr(first.rows())  # six samples each, of the same energy
    with pytest.raises(BadOption, match="observe is the result of another run"):
        sim.run(1.5, observe=first)
    there = sim.snapshot()
    for unobserved in (lambda: sim.run(1.25), lambda: next(sim.steps(1.5)), sim.step):
        sim.restore(there)
        unobserved()
        with pytest.raises(BadOption, match="it has run since without being observed"):
            sim.run(2.0, observe=sim.observed)
    sim.restore(there)
    sim.run(2.0, observe=sim.observed)


class Jumps(Observable):
    needs = "contacts"

    def prepare(self, scene):
        self.many = 0

    def collect(self, collisions):
        self.many += len(collisions.a)

    def sample(self, moment):
        return {"many": float(self.many)}


class Saved(Jumps):
    keeps = ("many",)


class Odd(Jumps):
    keeps = ("many", "odd")
    odd = object()


class Plugin:
    @kt.hookimpl
    def kinetile_observables(self):
        made = {"jumps": Jumps, "saved": Saved, "odd": Odd}
        return [kt.ObservableSpec(name, each) for name, each in made.items()]


def test_a_foreign_observable_goes_on_if_it_says_what_it_keeps(tmp_path):
    with registered(Plugin()):
        sim = kt.Simulation(discs(), "naive")
        sim.run(0.5, observe=["jumps", "saved"])
        again = pickle.loads(pickle.dumps(sim))
        with pytest.raises(BadOption, match=r"'jumps' of Plugin.* does not list in keeps.*from here on"):
            _ = again.observed
        again.run(1.0)
        sim.run(1.0, observe=sim.observed)
        assert repr(sim.observed["jumps"]) == repr(sim.observed["saved"])
        odd = kt.Simulation(discs(), "naive")
        odd.run(0.5, observe=["odd"])
        with pytest.raises(RecordError, match=r"observable 'odd' of Plugin.* has .* which cannot be saved"):
            odd.snapshot()
        refusal = refused(f"run grid -s bodies=4 --until 1 --observe jumps --checkpoint {tmp_path}/a.kt")
        assert "expected no checkpoint, or other observables" in refusal


@pytest.mark.slow
def test_the_command_resumes_what_it_observed(tmp_path):
    file, listed = tmp_path / "run.kt", "pressure,msd:every=0.02,lags=3,g:bins=5"
    run = "grid -s bodies=9 --broad-phase naive --until 2"
    expected = printed(f"run {run} --observe {listed}")["observed"]
    stopped = kinetile(f"run {run} --max-contacts 9 --observe {listed} --checkpoint {file}")
    assert "run too short" in stopped.stdout
    for options in ("--max-contacts 7", f"--until 2 --observe {listed}"):
        resumed = printed(f"resume {file} {options} --broad-phase sap-1d")
    assert repr(resumed["observed"]) == repr(expected)
    other = kinetile(f"resume {file} --until 3 --observe energy --observe-to {tmp_path}/out.csv")
    assert "energy is observed from time 2 on, not before" in other.stderr
    assert (tmp_path / "out.csv").read_text().splitlines()[1].startswith("energy,E,")


def test_what_is_observed_of_nobody_is_left_out():
    """Bodies that go and come: samples of no body, and of one body, count for nothing."""
    goes = [kt.Remove(0, 0.2), kt.Remove(1, 0.3), kt.Insert(0.6, (3.0, 3.0), (1.0, 0.0), 1.0)]
    for periodic in ("", "x", "xy"):
        scene = kt.Scene(
            [(2.0, 2.0), (6.0, 6.0)],
            [(1.0, 0.0), (0.0, 2.0)],
            1.0,
            arena=(8.0, 8.0),
            commands=goes,
            periodic=periodic,
        )
        names = [f"{each}:every=0.05" for each in registry().names("observable") if each != "flips"]
        sim = kt.Simulation(scene, "naive")
        sim.run(1.0, observe=names)
        values = [row.mean for row in sim.observed.rows() if row.quantity in ("kT", "psi6", "E")]
        assert len(values) > 2
        assert np.isfinite(values).all()


def test_pressure_by_counts_of_a_body_inserted_by_hand_was_an_index_error():
    sim = kt.Simulation(discs(arena=(9.0, 9.0)), "naive", live=True)
    sim.insert((8.0, 8.0), (-1.0, -3.0), 0.5)
    with pytest.raises(PhaseError, match=r"inserted by hand.*expected pressure:by=impulses"):
        sim.run(4.0, observe=["pressure"])
    sim.run(5.0, observe=["pressure:by=impulses"])
