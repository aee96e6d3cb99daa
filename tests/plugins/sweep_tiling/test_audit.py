"""The audit finds its faults: a state that is broken by hand, and the sentence about it."""

import re

import numpy as np
import pytest

import kinetile as kt
from kinetile.errors import AuditError
from kinetile.kernel.tables import NEVER
from kinetile.toolbox import schedule
from kinetile_plugins.sweep_tiling.audit import _sweep, audit
from messages import table
from tilings import LOWER, OUTER, UPPER, Steps

OTHER_SIDE = 5  # from a port UPPER or LOWER to the end that it looks at


def port(body: int, side: str, which: int) -> int:
    return 16 * body + (8 if side == "R" else 0) + which


@pytest.fixture
def steps() -> Steps:
    """A wide body (0), two small ones over it (1 left of 2), one under it (3), and one to its right (4)."""
    position = [[0.4, 0.5], [0.25, 0.85], [0.5, 0.9], [0.45, 0.15], [0.8, 0.55]]
    velocity = [[0.0, 0.0], [0.25, 0.0], [-0.25, 0.0], [0.0, 0.25], [-0.25, 0.0]]
    found = Steps(kt.Scene(position, velocity, [0.25, 0.05, 0.06, 0.07, 0.08], arena=(1.0, 1.0)))
    assert complaints(found) == ""
    return found


def complaints(steps: Steps) -> str:
    return "\n".join(audit(steps.engine.k, steps.state))


def join(steps: Steps, p: int, q: int) -> None:
    steps.state.web[p] = q
    steps.state.web[q] = p


def link_one_way(steps: Steps) -> None:
    steps.state.web[port(1, "R", OUTER)] = port(4, "L", OUTER)


def link_twice(steps: Steps) -> None:
    steps.state.web[port(1, "L", LOWER)] = steps.state.web[port(2, "L", LOWER)]


def end_elsewhere(steps: Steps) -> None:
    steps.state.web[port(1, "L", LOWER) + OTHER_SIDE] = 3


def move(body: int, x: float, y: float):
    def moved(steps: Steps) -> None:
        steps.engine.k.bodies[body].x += x
        steps.engine.k.bodies[body].y += y

    return moved


def close_to_a_ring(steps: Steps) -> None:
    """Cuts bodies 1 and 2 and the tile between them out of the row over body 0: all links and ends agree, but
    nothing leads there."""
    web = steps.state.web
    before, after = int(web[port(1, "L", OUTER)]), int(web[port(2, "R", OUTER)])
    join(steps, before, after)
    join(steps, port(2, "R", OUTER), port(1, "L", OUTER))


def forget_a_tile(steps: Steps) -> None:
    steps.state.due[int(np.flatnonzero(steps.state.due != NEVER)[0])] = NEVER


def turn_a_body(steps: Steps) -> None:
    steps.engine.k.bodies[1].vx = 0.5


def watch_a_quiet_tile(steps: Steps) -> None:
    quiet = int(np.flatnonzero(steps.state.due[:-4].reshape(-1, 4)[:, :3].ravel() == NEVER)[0])
    steps.state.due[4 * (quiet // 3) + quiet % 3] = 2**60


def take_width_for_order(steps: Steps) -> None:
    steps.state.web[port(1, "R", OUTER) + 3] ^= 1


def queue_for_another_tick(steps: Steps) -> None:
    schedule(steps.engine.k, int(np.argmin(steps.state.due)) // 4, 2**59)


def let_time_pass(steps: Steps) -> None:
    steps.engine.k.clock[0].now = steps.state.due.min() + 5


def broken(steps: Steps, change) -> str:
    change(steps)
    with pytest.raises(AuditError, match=r", after 0 events under broad phase 'sweep-tiling': "):
        steps.audit()
    return complaints(steps)


test_message = table(globals())


@pytest.mark.parametrize("odd", [port(1, "L", UPPER), 3, 16 * 6, 2**32 - 1, port(5, "L", UPPER)])
def test_a_link_joins_a_left_port_to_a_right_one(steps, odd):
    steps.state.web[port(0, "L", UPPER)] = odd
    assert re.search(r"the tile L\(0\).upper - .*: its right port is no right port", complaints(steps))


@pytest.mark.parametrize(
    ("named", "sentence"),
    [
        ([], "bodies 0 and 3 bound a tile, and 3 is not named as near 0"),
        ([0, 1, 2, 3, 4], "body 2 is named as near 3, and they bound no tile"),
    ],
)
def test_near_names_the_bodies_in_sight_and_no_others(steps, monkeypatch, named, sentence):
    def near(k, s, body):
        k.near[: len(named)] = named
        return len(named)

    monkeypatch.setitem(audit.__globals__, "near", near)
    assert sentence in complaints(steps)


@pytest.mark.parametrize(("bound", "words"), [("R", "but its ends are"), ("L", "in a gap between")])
def test_the_sweep_needs_the_ends(steps, bound, words):
    """Ends alone, which the links do not show to be wrong: found by the sweep itself."""
    steps.state.web[port(1, bound, 0) + OTHER_SIDE + LOWER] = 3
    (found,) = _sweep(steps.state, 5)
    assert found.startswith(f"the sweep comes to {bound}(1)")
    assert words in found


def test_the_sweep_needs_the_links(steps):
    web = steps.state.web
    one, two = int(web[port(1, "L", UPPER)]), int(web[port(2, "L", UPPER)])
    join(steps, port(1, "L", UPPER), two)
    join(steps, port(2, "L", UPPER), one)
    found, *_ = _sweep(steps.state, 5)
    assert found.endswith("where other tiles end than are linked to it") or "circle" in found
