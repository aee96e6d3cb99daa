"""A narrow phase whose walls are not at the arena's edges: no part of the kernel takes them to be there."""

import kinetile as kt
from agreement import assert_one_answer
from kinetile.kernel.certificates.walls import reaches_edge
from kinetile.scene.scene import Settings
from kinetile.toolbox import BOTTOM, LEFT, NEVER, RIGHT, TOP, Kernel, Records, WallParts, hook
from registering import fixture

NEAR, FAR = 0.25, 0.75
"""Where the walls are, in an arena of 1 by 1."""


@hook
def after(k: Kernel, body: Records, place: float, speed: float) -> int:
    clock = k.clock[0]
    far = FAR if speed > 0.0 else place
    delay = NEVER
    if speed != 0.0:
        near = place if speed > 0.0 else NEAR
        delay = reaches_edge(far, near, body.radius, -abs(speed), 0.0, clock.per_tick, clock.per_time)
    return int(body.anchor + delay) if delay != NEVER else NEVER


@hook
def reach_wall(k: Kernel, body: Records) -> tuple[int, int]:
    x = after(k, body, body.x, body.vx)
    y = after(k, body, body.y, body.vy)
    if x <= y:
        return x, RIGHT if body.vx > 0.0 else LEFT
    return y, TOP if body.vy > 0.0 else BOTTOM


@hook
def bounce(k: Kernel, body: Records, wall: int) -> float:
    if wall == LEFT or wall == RIGHT:  # noqa: SIM109 - no tuple in a hook
        body.vx = -body.vx
    else:
        body.vy = -body.vy
    return 0.0


class Inset:
    def prepare(self, scene: kt.Scene) -> WallParts:
        return WallParts(reach_wall, bounce)


_inset = fixture(kt.NarrowPhaseSpec("inset", Inset, role="wall"), scope="module")


def within(position: list, velocity: list, **more: object) -> kt.Scene:
    phases = Settings(narrow_phases=("disc", "inset"))
    return kt.Scene(position, velocity, 2.0**-6, arena=(1.0, 1.0), **more).replace(settings=phases)


def test_a_wall_within_the_arena_was_flown_through():
    """A disc met another one beyond the wall; a wall was awaited only near the arena's edge."""
    scene = within([[0.5, 0.5], [0.875, 0.5]], [[1.0, 0.0], [0.0, 0.0]])
    sim = assert_one_answer(scene, until=2.0)
    rows = sim.contacts[["time", "a", "b"]].tolist()
    first = FAR - 2.0**-6 - 0.5
    period = FAR - NEAR - 2.0**-5
    assert rows == [(first + i * period, 0, (RIGHT, LEFT)[i % 2]) for i in range(4)]
    assert sim.next_contact_of(0)[-2:] == (0, RIGHT)


def test_empty_time_was_skipped_beyond_a_wall_within_the_arena():
    """Spans of the clock were passed in one step up to the arena's edge; so were they without an arena."""
    speed = 2.0**-15
    scene = within([[0.5, 0.5]], [[speed, 0.0]])
    for arena in ((1.0, 1.0), None):
        sim = kt.Simulation(scene.replace(arena=arena), "naive")
        sim.run(until=1.5 * (FAR - NEAR) / speed)
        assert sim.contacts[["time", "b"]].tolist()[:1] == [((FAR - 2.0**-6 - 0.5) / speed, RIGHT)]
