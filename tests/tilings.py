"""Tilings by brute force, and simulations event by event: helpers of the tests of sweep-tiling.

Ports and ends are numbered as in ``kinetile_plugins.sweep_tiling.web``: port 0, 1, 2 is OUTER, UPPER, LOWER;
body b's bound L begins at 16 b, its R at 16 b + 8; n as an end is TOP, n + 1 BOTTOM.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import agreement
import kinetile as kt
from inside import engine_of
from kinetile.errors import ZenoError
from kinetile.kernel.flight import positions_now
from kinetile.kernel.loop import BUDGET_SPENT
from kinetile.kernel.tables import NEVER, STRUCTURAL
from kinetile.run.engine.engine import UNLIMITED
from lanes import SHARED

OUTER, UPPER, LOWER = 0, 1, 2
SCENES = Path(__file__).parent / "scenes"


class Tiling(NamedTuple):
    """A whole tiling: right ports by left ports, and (above, below) by bounds."""

    links: dict[int, int]
    ends: dict[int, tuple[int, int]]


def tiling_of(state: Any) -> Tiling:
    """Returns the tiling in the broad phase's state."""
    n = len(state.level)
    left = [16 * body + port for body in range(n) for port in (UPPER, LOWER, 8 + OUTER)] + [
        16 * n + 8 + OUTER
    ]
    web = state.web.tolist()
    bounds = range(0, 16 * n, 8)
    return Tiling(
        {p: web[p] for p in left}, {at: (web[at + 5 + UPPER], web[at + 5 + LOWER]) for at in bounds}
    )


def tiling_by_force(place: Any, reach: Any) -> Tiling:
    """Makes the tiling of discs straight from the geometry, O(n^2): the ends of the vertical lines from their
    leftmost and rightmost points, and the next bound to the right of each.

    Only for scenes in general position: no two bounds at one x, no disc touching another.
    """
    n = len(place)
    x, y = place[:, 0], place[:, 1]
    west, east = x - reach, x + reach

    def surfaces(at: Any) -> tuple[Any, Any]:
        """Returns the lowest and highest point of each disc on a vertical line; NaN without one."""
        with np.errstate(invalid="ignore"):
            half = np.sqrt(reach * reach - (at - x) ** 2)
        return y - half, y + half

    ends: dict[int, tuple[int, int]] = {}
    for body in range(n):
        for at, start in ((16 * body, west[body]), (16 * body + 8, east[body])):
            lowest, highest = surfaces(start)
            lowest[body] = highest[body] = np.nan
            over = np.where(lowest > y[body], lowest, np.inf)
            under = np.where(highest < y[body], highest, -np.inf)
            above = int(over.argmin()) if np.isfinite(over).any() else n
            below = int(under.argmax()) if np.isfinite(under).any() else n + 1
            ends[at] = above, below

    def next_bound(start: float, top: int, bottom: int) -> int:
        """Returns the right port of the tile that begins at an x between two ends."""
        found = [(np.inf, 16 * n + OUTER)]
        if top < n:
            found.append((east[top], 16 * top + 8 + LOWER))
        if bottom < n:
            found.append((east[bottom], 16 * bottom + 8 + UPPER))
        between = west > start
        if top < n:
            with np.errstate(invalid="ignore"):
                between &= y < y[top] - np.sqrt(reach[top] ** 2 - (west - x[top]) ** 2)
        if bottom < n:
            with np.errstate(invalid="ignore"):
                between &= y > y[bottom] + np.sqrt(reach[bottom] ** 2 - (west - x[bottom]) ** 2)
        found += [(west[c], 16 * c + OUTER) for c in np.flatnonzero(between).tolist()]
        return int(min(found)[1])

    links = {16 * n + 8 + OUTER: next_bound(-np.inf, n, n + 1)}
    for body in range(n):
        at = 16 * body
        links[at + UPPER] = next_bound(west[body], ends[at][0], body)
        links[at + LOWER] = next_bound(west[body], body, ends[at][1])
        links[at + 8 + OUTER] = next_bound(east[body], *ends[at + 8])
    return Tiling(links, ends)


class Steps:
    """A simulation that runs event by event.

    Attributes:
        sim: the simulation.
        engine: its engine.
        events: the number of events so far.
    """

    def __init__(self, scene: kt.Scene, phase: str = "sweep-tiling", **options: Any) -> None:
        self.sim = kt.Simulation(scene, phase, options=options, narrow_phases=SHARED)
        self.engine = engine_of(self.sim)
        self.phase = phase
        self.events = 0
        self.engine.build()

    @property
    def state(self) -> Any:
        return self.engine.state

    def _head(self) -> tuple[int, int]:
        """Returns the body of the first entry of the queue, and its tick; guesses are resolved before."""
        self.engine.chunk(2**60, UNLIMITED, most=0)
        queue = self.engine.k.queue
        body = int(np.lexsort((np.arange(len(queue)), queue.kind, queue.key))[0])
        return body, int(queue.key[body])

    @property
    def next_tick(self) -> int:
        """Returns the tick of the next event."""
        return self._head()[1]

    @property
    def next_is_structural(self) -> bool:
        body, tick = self._head()
        return bool(tick != NEVER and self.engine.k.queue.kind[body] == STRUCTURAL)

    @property
    def next_bounds(self) -> tuple[int, int] | None:
        """Returns the two bounds (2 body for L, 2 body + 1 for R) that pass each other next; None: another
        event is next."""
        if not self.next_is_structural:
            return None
        p = self.next_tile
        if self.state.web[p + 3]:
            return None  # a flip
        return p >> 3, int(self.state.web[p]) >> 3

    @property
    def next_tile(self) -> int:
        body = self._head()[0]
        slot = int(np.argmin(self.state.due[4 * body : 4 * body + 3]))
        return 16 * body + (slot or 8 + OUTER)

    def step(self, until: int = 2**60, budget: int = 1) -> bool:
        """Runs the next event; returns whether there was one up to tick ``until``."""
        ran = self.engine.chunk(until, UNLIMITED, most=budget) == BUDGET_SPENT
        self.events += ran
        return ran

    def audit(self) -> None:
        self.engine.audit()

    def by_force(self) -> Tiling:
        return tiling_by_force(positions_now(self.engine.k), np.asarray(self.engine.k.bodies.reach))

    def to_the_middle(self) -> bool:
        """Lets time pass to the middle between now and the next event; returns whether there was a middle."""
        now, then = self.engine.now, self.next_tick
        middle = (now + min(then, now + 2**50)) // 2
        if then <= now + 2**12:
            return False
        assert not self.step(until=middle)
        return True


def audited_events(scene: kt.Scene, most: int) -> int:
    """Runs a scene event by event under sweep-tiling, with an audit after each, and returns the number of
    events; a jam ends it."""
    steps = Steps(scene)
    steps.audit()
    try:
        while steps.events < most and steps.step():
            steps.audit()
    except ZenoError:
        pass
    return steps.events


def hard_scenes() -> Iterator[tuple[str, kt.Scene]]:
    """Yields the scenes of tests/scenes that have an arena, by name."""
    for path in sorted(SCENES.glob("H*.toml")):
        scene = kt.load_scene(path)
        if scene.arena is not None:
            yield path.stem, scene


def lattice(seed: int, jitter: bool) -> kt.Scene:
    """Returns a lattice with exact ties, or a jittered one; every other one has turns."""
    return agreement.lattice(seed, jitter, 40 if seed % 4 >= 2 else 0)


def columns(seed: int) -> kt.Scene:
    """Returns columns of discs that slide past each other and graze, exactly or within 1e-11.

    A lattice has such pairs now and then, here all are: vertical orders change without a contact, and bounds
    are nearer to each other than a skin.
    """
    rng = np.random.default_rng(seed)
    gap = float(10.0 ** rng.uniform(-16, -11)) if seed % 2 else 0.0
    radius = 0.0625
    position, velocity, radii = [], [], []
    for column in range(int(rng.integers(2, 5))):
        for row in rng.permutation(7)[: rng.integers(1, 5)]:
            position.append([0.125 + column * 2 * radius + gap * rng.uniform(-0.5, 0.5), (row + 0.5) / 7])
            slow = float(rng.choice([-0.25, 0.125, 0.25]))
            velocity.append([0.0 if rng.random() < 0.7 else slow, float(rng.choice([-1, -0.5, 0, 0.5, 1]))])
            radii.append(radius if rng.random() < 0.7 else radius * float(rng.choice([0.5, 0.75])))
    place, size = np.array(position), np.array(radii)
    if seed % 3 == 0:  # edges in line instead of centres
        place[:, 0] += (radius - size) * rng.choice([-1, 1], len(size))
    return kt.Scene(place, np.array(velocity), size - (gap if gap > 1e-13 else 0.0), arena=(1.0, 1.0))


def random_scene(seed: int, bodies: int | None = None) -> kt.Scene:
    """Returns discs with a radius ratio of up to 1000, and a mass ratio of up to a million."""
    rng = np.random.default_rng(seed)
    return kt.make_scene(
        "random",
        bodies=bodies or int(rng.integers(2, 61)),
        density=float(rng.choice([0.02, 0.1, 0.2, 0.3])),
        radius_ratio=float(10.0 ** rng.uniform(0, 3)),
        mass_ratio=float(10.0 ** rng.uniform(0, 6)),
        seed=seed,
    )
