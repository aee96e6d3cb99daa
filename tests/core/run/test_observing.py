"""Observables of a run: their samples, their arguments, and their averages and errors."""

import itertools
import math
from functools import partialmethod
from typing import Any, ClassVar

import numpy as np
import pytest

import kinetile as kt
from inside import engine_of
from kinetile import Collisions, Moment
from kinetile.errors import BadOption, PhaseError, UnknownName, ZenoError
from kinetile.records import Trajectory
from kinetile.statistics import Blocks
from lanes import first
from player_pages import SCENES
from registering import registered


class Watcher:
    axes: ClassVar = {}
    notes: ClassVar = []

    def __init__(self, needs: str = "velocities") -> None:
        self.needs = needs

    def prepare(self, scene):
        self.samples, self.collisions = [], []
        Watcher.notes.append(self)

    def collect(self, collisions):
        self.collisions.append(Collisions(*(None if each is None else np.array(each) for each in collisions)))

    def sample(self, moment):
        self.samples.append(moment.time)
        return {"time": moment.time}


class Broken(Watcher):
    def sample(self, moment):
        raise ZeroDivisionError("no bodies")


class Slow(Watcher):
    def sample(self, moment):
        self.samples.append(math.sin(1e6 * moment.time))
        slow = moment.time if self.needs == "samples" else 0.0
        return {"noise": self.samples[-1], "drift": slow, "curve": [self.samples[-1], 1.0], "one": 1.0}


class Bare(Watcher):
    def sample(self, moment):
        return 0.5


class Forgetful(Watcher):
    def sample(self):
        return {}


@pytest.fixture(autouse=True)
def watchers():
    Watcher.notes = []
    made = Watcher, Broken, Bare, Forgetful, Slow
    with registered(*(kt.ObservableSpec(each.__name__.lower(), each) for each in made)):
        yield Watcher.notes


def scene(**changes) -> kt.Scene:
    made = kt.make_scene("grid", bodies=9, density=0.5, seed=3)
    return made.replace(mass=np.linspace(1.0, 3.0, 9), **changes)


def simulation(of: kt.Scene | None = None) -> kt.Simulation:
    return kt.Simulation(scene() if of is None else of, "naive")


def test_observing_changes_nothing_and_stops_nothing():
    plain, observed = simulation(), simulation()
    plain.run(1.0)
    rows, seen = [], []
    plain_rows: list = []
    third = simulation()
    third.run(1.0, recorder=lambda r: plain_rows.append(r.copy()))
    observed.run(
        1.0,
        observe=["watcher", "watcher:needs=contacts,every=0.3"],
        recorder=lambda r: rows.append(r.copy()),
        progress=seen.append,
    )
    assert observed.fingerprint == plain.fingerprint
    assert observed.positions().tobytes() == plain.positions().tobytes()
    assert np.concatenate(rows).tobytes() == np.concatenate(plain_rows).tobytes()
    assert seen[-1].time == observed.time == 1.0
    assert seen[-1].contacts == len(observed.contacts)
    assert [each.events for each in seen] == sorted(each.events for each in seen)


def test_an_observable_was_given_the_simulation_and_could_turn_bodies(watchers, monkeypatch):
    seen = []
    monkeypatch.setattr(Watcher, "sample", lambda self, moment: seen.append(moment) or {})
    sim = simulation()
    sim.run(0.5, observe=["watcher:every=0.25"])
    assert {type(moment) for moment in seen} == {Moment}
    assert not hasattr(seen[0], "set_velocity")
    assert seen[0].positions().tobytes() == sim.positions().tobytes()
    assert (seen[0].time, seen[0].scene, seen[0].numbers) == (0.5, sim.scene, 9)


class Told:
    def __init__(self) -> None:
        self.notes: list = []

    def begin(self, moment, before):
        self.notes.append(("begin", moment.time, before))

    def __call__(self, rows):
        self.notes.append(("rows", len(rows)))

    def end(self, time):
        self.notes.append(("end", time))


def test_a_recorder_learns_of_each_run_and_a_function_of_its_rows_alone():
    sim, told, parts = simulation(), Told(), []
    sim.run(0.25, recorder=parts.append)
    before = sim.rows
    sim.set_velocity(0, (0.0, 0.0))
    with pytest.raises(UnknownName):
        sim.run(0.5, recorder=told, observe=["nothing"])
    sim.run(0.5, recorder=told)
    begin, *rows, end = told.notes
    assert (begin, rows[0], end) == (("begin", 0.25, before), ("rows", 1), ("end", 0.5))
    assert before + sum(count for _, count in rows) == sim.rows
    assert sum(map(len, parts)) == before


class Full(Told):
    def __call__(self, rows):
        raise OSError("full")


def test_a_recorder_that_raises_is_told_of_the_end():
    full = Full()
    with pytest.raises(OSError, match="full"):
        simulation().run(1.0, recorder=full)
    assert [note[0] for note in full.notes] == ["begin", "end"]
    sim = simulation()
    with pytest.raises(OSError, match="full"):
        sim.run(1.0, recorder=full, observe=["pressure"])
    with pytest.raises(BadOption, match="cannot go on"):  # it has not seen all contacts
        sim.run(2.0, observe=sim.observed)


def test_samples_come_at_their_times_with_the_end(watchers):
    sim = simulation()
    sim.run(0.5)
    sim.run(0.8, observe=["watcher:every=0.1", "watcher", "watcher:after=0.7,every=0.05"])
    tenths, hundredth, late = (each.samples for each in watchers)
    assert tenths == [0.5, 0.6, 0.7, 0.8]  # 0.5 + 3 * 0.1 is above 0.8
    assert len(hundredth) == 101
    assert hundredth[-1] == 0.8
    assert late == [0.7, 0.75, 0.8]
    assert sim.observed["watcher:every=0.1"]["time"].mean == pytest.approx(0.65)
    assert set(sim.observed) == {"watcher:every=0.1", "watcher", "watcher:after=0.7,every=0.05"}
    sim.run(1.1, observe=["watcher:every=0.1,series=true"])  # a value for each sample, and no average
    (curve,) = sim.observed["watcher:every=0.1,series=true"].values()
    assert curve.mean.tolist() == curve.at.tolist() == watchers[-1].samples
    assert (curve.axis, len(curve.at), np.isnan(curve.error).all()) == ("time", 4, True)


def test_an_interval_longer_than_the_run_measured_nothing_without_a_word():
    sim, name = simulation(), "rates:every=0.75"
    sim.run(0.5, observe=[name])
    (row,) = sim.observed.rows()
    assert (row.observable, row.quantity, row.blocks) == (name, "", 0)
    assert row.reason == "no number in 1 samples, every 0.75 from 0 on"
    with pytest.raises(KeyError, match="'pairs' was not observed, but no number in 1 samples, every"):
        _ = sim.observed[name]["pairs"]
    sim.run(1.0, observe=sim.observed)
    assert sim.observed[name]["pairs"].mean > 0.0
    assert sim.observed[name]["pairs"].reason == "run too short: expected 50 times the time or more"


def test_a_run_for_contacts_is_sampled_a_hundred_times(watchers):
    sim = simulation()
    sim.run(max_contacts=500, observe=["watcher:needs=contacts"])
    (watcher,) = watchers
    assert 60 < len(watcher.samples) < 160
    assert len(set(np.diff(watcher.samples).round(9).tolist())) == 1
    assert sim.readings.contacts_disc + sim.readings.contacts_wall == 500


def test_contacts_come_with_velocities_before_and_after(watchers):
    """Energy and momentum of each contact are kept, and each body goes on as it left its last one."""
    made = scene(turns=[(2, 0.31, (1.0, 0.5))])
    sim = simulation(made)
    sim.run(1.0, observe=["watcher", "watcher:needs=contacts"])
    whole, short = (each.collisions for each in watchers)
    a, b = (np.concatenate([getattr(each, name) for each in whole]) for name in "ab")
    assert np.array_equal(np.stack([a, b]), np.stack([sim.contacts["a"], sim.contacts["b"]]))
    assert a.tolist() == np.concatenate([each.a for each in short]).tolist()
    last = dict(enumerate(made.velocity.tolist()))
    turned = False
    for part in whole:
        for k in range(len(part.a)):
            for body, before, after in zip(
                (part.a[k], part.b[k]), part.before[k], part.after[k], strict=True
            ):
                if body >= 0:
                    expected = before.tolist() == last[body]
                    turned |= not expected
                    assert expected or (body == 2 and before.tolist() == [1.0, 0.5])
                    last[body] = after.tolist()
            m, pair = made.mass, part.b[k] >= 0
            change = part.after[k] - part.before[k]
            given = -m[part.a[k]] * change[0]
            assert part.impulse[k] == pytest.approx(given)
            if pair:
                assert part.impulse[k] == pytest.approx(m[part.b[k]] * change[1])
                apart = part.position[k, 1] - part.position[k, 0]
                assert part.impulse[k] / np.hypot(*part.impulse[k]) == pytest.approx(apart / np.hypot(*apart))
    assert turned


def test_velocities_before_contacts_follow_each_body_s_own_acceleration(watchers):
    made, parts = SCENES["accelerated"], []
    sim = simulation(made)
    sim.run(0.25, observe=["watcher"], recorder=parts.append)
    sim.insert((0.3, 0.55), (0.2, -0.1), 0.05, acceleration=(0.25, -1.0))
    sim.run(2.0, observe=["watcher"], recorder=parts.append)
    trajectory, times = Trajectory(np.concatenate(parts), made), iter(sim.contacts["time"].tolist())
    met = set()
    for part in (part for watcher in watchers for part in watcher.collisions):
        for k, time in enumerate(itertools.islice(times, len(part.a))):
            for moment, velocities in ((time - 1e-9, part.before[k]), (time + 1e-9, part.after[k])):
                there = trajectory.bodies(moment).tolist()
                for body, velocity in zip((part.a[k], part.b[k]), velocities, strict=True):
                    if body >= 0:
                        flies = trajectory.velocities(moment)[there.index(body)]
                        assert velocity == pytest.approx(flies, abs=1e-7)
                        met.add(int(body))
    assert met == {*range(6)}


def test_where_nobody_observes_no_long_rows_are_written():
    sim = simulation()
    assert len(sim.tables.log) == 0
    sim.run(0.5, observe=["watcher:needs=contacts"])
    assert len(sim.tables.log) == 0
    sim.run(1.0, observe=["watcher"])
    assert sim.tables.clock[0].lists.rows > 0
    sim.run(1.5)
    assert sim.tables.clock[0].lists.rows == 0


def test_a_run_that_stops_early_has_what_it_has_measured(watchers):
    sim = simulation()
    _, event = sim.run(9.0, stop_at=kt.StopAt(bodies=[0]), observe=["watcher:every=0.01"])
    assert event is not None
    (watcher,) = watchers
    assert watcher.samples[-1] <= sim.time < watcher.samples[-1] + 0.01
    assert sim.observed["watcher:every=0.01"]["time"].mean == pytest.approx(np.mean(watcher.samples))


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("watcher:needs=all", "needs is 'all'; expected 'samples', 'contacts' or 'velocities'"),
        ("broken", "observable 'broken' of broken.*sample raised ZeroDivisionError: no bodies"),
        ("bare", r"'bare' of bare.*it returned 0.5; expected a dict of numbers .*test_observing\.py, line"),
        ("forgetful", r"of forgetful.*1 positional argument but 2 were given \(test_observing\.py, line"),
    ],
)
def test_an_observable_that_does_not_work_is_named(name, text):
    with pytest.raises(PhaseError, match=text):
        simulation().run(1.0, observe=[name])


def test_blocks_have_the_mean_of_all_and_the_error_of_their_means():
    blocks, values = Blocks(), np.random.default_rng(1).normal(5.0, 2.0, 1000)
    for value in values:
        blocks.add(np.array([value, math.nan, 1.0 + 2.0**-52 * (value > 5.0)]))
    mean, error, many, *_ = estimate = blocks.estimate()
    joined = 250 // many[0]  # of 250 blocks of 4
    means = values[(250 % joined) * 4 :].reshape(-1, joined * 4).mean(axis=1)
    assert many[0] == len(means) == 25
    assert mean[0] == pytest.approx(values.mean())
    square, apart = means.var(ddof=1) / len(means), means - means.mean()
    follow = (apart[1:] * apart[:-1]).sum() / (apart**2).sum()  # and what these blocks leave out is added:
    assert error[0] == pytest.approx(math.sqrt(square * (1.0 + 2.0 * max(follow + 1.0 / 25, 0.0))))
    assert np.isnan([mean[1], error[1]]).all()
    assert many[1] == 0
    assert (mean[2], error[2]) == (pytest.approx(1.0), 0.0)  # it was an error of kT, 1.6e-16
    assert estimate.interval[0] / error[0] == pytest.approx(2.06390, rel=1e-5)
    few = Blocks()
    few.add(3.0)
    assert few.estimate().mean == 3.0
    assert (few.estimate().blocks, math.isnan(few.estimate().error)) == (0, True)


def test_blocks_follow_the_time_that_values_depend_on_each_other():
    """The error of the mean of an autoregression is known; values in their own blocks have a fifth of it."""
    made, value, found = np.random.default_rng(4), 0.0, []
    for _ in range(6):
        blocks = Blocks()
        for _ in range(5_000):
            value = 0.96 * value + made.normal()
            blocks.add(np.array(value))
        found.append(blocks.estimate())
    assert {each.blocks > 8 for each in found} == {True}
    error = 1.0 / 0.04 / math.sqrt(5_000)
    assert np.sqrt(np.mean([each.error**2 for each in found])) == pytest.approx(error, rel=0.15)
    short = Blocks()
    for value in np.linspace(0.0, 1.0, 100):  # one half of a wave
        short.add(np.array(value))
    assert math.isnan(short.estimate().error)


def test_a_mean_had_an_error_in_a_run_that_has_not_relaxed():
    """Whatever is observed beside what drifts has none, but for constants; few samples prove no drift."""
    names = {each: f"slow:{each}" for each in ("needs=contacts", "needs=samples", "needs=samples,every=0.1")}
    for chosen, drifts in ((["needs=contacts", "needs=samples"], True), ([*names][::2], False)):
        sim = simulation()
        sim.run(1.0, observe=[names[each] for each in chosen])
        found = sim.observed[names["needs=contacts"]]
        assert (found["one"].error, found["one"].blocks > 0, found["one"].reason) == (0.0, True, "")
        reason = (
            "drift of slow:needs=samples has not relaxed: run too short: expected 6.3 times the time or more"
        )
        for quantity in ("noise", "curve"):
            each = found[quantity]
            assert (np.isnan(each.error).any(), each.reason) == (drifts, reason if drifts else "")
            assert (np.max(each.blocks) == 0) == drifts
    few = sim.observed[names["needs=samples,every=0.1"]]["drift"]
    assert (few.relaxed, few.reason) == (True, "run too short: expected 4.6 times the time or more")


RETURNED: dict[str, Any] = {
    "text": {"q": "many"},
    "complex": {"q": 1j},
    "None": {"q": None},
    "ragged": {"q": [[1.0], [1.0, 2.0]]},
    "two dimensions": {"q": [[1.0, 2.0]]},
    "too large": {"q": 10**400},
    "a list": [1.0],
    "no name": {None: 1.0},
}
AXES: dict[str, Any] = {
    "no value": {"q": ("r",)},
    "too few": {"q": ("r", [1.0])},
    "text": {"q": ("r", ["a", "b", "c"])},
    "None": {"q": None},
    "no name": {"q": (None, np.arange(3))},
    "no mapping": 5,
}
RAISED = ValueError("no"), SystemExit(3), StopIteration(), BadOption("no")
RAISED += (ZenoError("no", time=0.0, bodies=(0,)),)


class Failing:
    """An observable whose hooks give a value, or raise it; ``sample`` one after the other."""

    def __init__(self, sample=(), axes=(), collect=None):
        self.needs = "samples" if collect is None else "contacts"
        self._sample, self._axes, self._collect = iter(sample), {} if axes == () else axes, collect

    def prepare(self, scene):
        pass

    def collect(self, collisions):
        give(self._collect)

    def sample(self, moment):
        return give(next(self._sample, {"q": np.zeros(3)}))

    @property
    def axes(self):
        return give(self._axes)


def give(value):
    if isinstance(value, BaseException):
        raise value
    return value


CASES = {
    **{f"sample: {name}": {"sample": [value]} for name, value in RETURNED.items()},
    **{f"axes: {name}": {"axes": value} for name, value in AXES.items()},
    **{
        f"{hook} raises {type(error).__name__}": {hook: [error] if hook == "sample" else error}
        for error in RAISED
        for hook in ("sample", "axes", "collect")
    },
    "sample: other lengths": {"sample": [{"q": [1.0, 2.0]}, {"q": 1.0}]},
}


def failing(**hooks):
    made = {"__init__": partialmethod(Failing.__init__, **hooks)}
    return kt.ObservableSpec("failing", type("Made", (Failing,), made))


@pytest.mark.parametrize("case", first(8, [*CASES]))
def test_an_observable_that_fails_locked_the_simulation_for_ever(case):
    sim, told = kt.Simulation(kt.make_scene("grid", bodies=4), "cells"), Told()
    fault = pytest.raises(PhaseError, match=r"observable 'failing' of failing")
    with registered(failing(**CASES[case])), fault:
        sim.run(1.0, observe=["failing:every=0.4"], recorder=told)
    assert told.notes[-1] == ("end", sim.time)
    assert engine_of(sim).ledger.reads is False
    assert len(engine_of(sim).k.watch) == 0
    sim.run(2.0)
    again = kt.Simulation(sim.scene, "cells")
    again.run(2.0)
    assert again.fingerprint == sim.fingerprint


def test_an_error_of_the_run_goes_before_one_of_its_observables():
    sim, error = kt.Simulation(kt.make_scene("grid", bodies=4), "cells"), ZeroDivisionError("of the user")
    with registered(failing(axes=ValueError("no"))), pytest.raises(ZeroDivisionError, match="of the user"):
        sim.run(1.0, observe=["failing"], progress=lambda _: give(error))
    sim.run(1.0)
