"""A run begins as Python and goes over to machine code, or back, at any chunk: to the same bits."""

import random

import pytest

import kinetile as kt
from capabilities import BY_NAME, FOREIGN, LASTS, Game, outcome
from inside import engine_of
from kinetile.errors import KinetileError
from kinetile.kernel.compiled import compiled_by_default
from kinetile.run.engine import engine
from lanes import BUILT_IN, first
from registering import fixture

pytestmark = pytest.mark.compiled
_with_plugins = fixture(*FOREIGN, scope="module")


class Turning(engine.Engine):
    """An engine that begins as Python, and goes over, or back, before some chunks."""

    begins_as_python = True

    def chunk(self, *given, **more):
        if self.coin.random() < 0.3:
            self.begins_as_python, self._ready = not self.begins_as_python, False
        reason = super().chunk(*given, **more)
        self.ways.add(self.as_python)
        return reason


def turning(sim, coin, ways):
    engine_of(sim).__class__ = Turning
    engine_of(sim).coin, engine_of(sim).ways = coin, ways
    return sim


def result(game, sim):
    """Plays a game to its end, or to the command that is refused; returns all that must be the same."""
    try:
        game.play(sim)
        return sim.fingerprint, sim.state_fingerprint, outcome(sim)
    except KinetileError as error:
        return sim.fingerprint, str(error), outcome(sim)


def begun(game, phase, how, rng, ways, path):
    """Returns a run that turns, at any time; it may have been saved and resumed, or have gone back."""
    sim = turning(game.simulation(phase), rng, ways)
    try:
        game.play(sim, LASTS * rng.random())
        if how == "restored":
            snapshot = sim.snapshot()
            game.play(sim, min(sim.time + 1.0, LASTS))
            sim.restore(snapshot)
        if how == "resumed":
            sim.save(path)
            sim = turning(kt.resume(path), rng, ways)
    except KinetileError:  # a command by hand is refused: so it will be by the others
        sim = turning(game.simulation(phase), rng, ways)
    return sim


ALL = [*BY_NAME]


def drawn(seed):
    """Returns some capabilities that go together, and a phase that takes them."""
    rng = random.Random(seed)
    while True:
        names = [ALL[seed % len(ALL)], *rng.sample(ALL, rng.randrange(3))]
        phase = rng.choice([*BUILT_IN, "cells", "cells"])
        try:
            Game(*names).simulation(phase)
            return [*dict.fromkeys(names)], phase
        except KinetileError:
            continue


SHARED = [(("discs",), "cells"), (("radii of many sizes",), "naive")]
"""Those whose loops are shared."""


@pytest.mark.parametrize("case", first(2, [*SHARED, *range(25)]), ids=str)
def test_a_run_that_turns_at_any_chunks_has_the_contacts_of_others(case, tmp_path, monkeypatch):
    """Scenes of the same loop, with other velocities."""
    monkeypatch.setattr(engine, "FIRST_AS_PYTHON", 4)
    monkeypatch.setattr(engine, "FIRST_BUDGET", 4)
    names, phase = drawn(case) if isinstance(case, int) else case
    game, ways = Game(*names), set()
    velocity, rng = game.scene.velocity, random.Random(str(case))
    for at in range(8 if isinstance(case, int) else 2):
        pace = [[rng.randrange(4, 13) / 8.0] for _ in velocity]
        game.scene = game.scene.replace(velocity=velocity * pace)
        turned = begun(game, phase, ["", "resumed", "restored"][at % 3], rng, ways, tmp_path / f"{at}.kt")
        found = result(game, turned)
        with compiled_by_default(False):
            assert found == result(game, game.simulation(phase, compiled=False))
        assert found == result(game, game.simulation(phase, compiled=True))
    assert ways == {False, True}
