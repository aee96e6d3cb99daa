"""Common engines on the same scenes: Chipmunk (through pymunk), and Box2D 2.3 with and without bullets, its
name for bodies with continuous detection of their contacts with each other. A timed run only calls the
engine's step (from Python: about a microsecond a call). Other, watched runs give the results."""

import math
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from typing import Any, Literal

import numpy as np

from kinetile import Scene
from kinetile.arrays import Floats, Rows
from kinetile.errors import Refused
from kinetile.lazy import needed
from kinetile.toolbox import BOTTOM, LEFT, RIGHT, TOP
from kinetile_accuracy.stepped import snapshots
from kinetile_accuracy.stepped.snapshots import STEPPED, SteppedRun

Point = tuple[float, float]
EngineName = Literal["chipmunk", "box2d", "box2d-bullets"]
Watched = Literal["not", "contacts", "depths"]
"""The records beside the processor time: nothing, contacts, or contacts and the deepest overlap."""

TITLES: dict[EngineName, str] = {
    "chipmunk": "Chipmunk",
    "box2d": "Box2D 2.3 without bullets",
    "box2d-bullets": "Box2D 2.3 with bullets",
}
ENGINES = tuple(TITLES)

_ITERATIONS = 10  # Chipmunk's default; 30 change nothing visible, 1 loses energy
_VELOCITY_ITERATIONS, _POSITION_ITERATIONS = 8, 3  # as Box2D's manual suggests
_LARGEST = 5.0  # metres: Box2D is made for moving bodies of .1 to 10 m
_FARTHEST = 2.0  # metres: Box2D slows down a body that would fly farther in a step
_FASTEST = 5.0  # times the root mean square of the speeds: in equilibrium, 1 disc in 10^10 is faster
_PACE = 1e4  # metres a second: that mean; Box2D lets no pair bounce that approaches at less than 1 m/s


@dataclass(frozen=True)
class _World:
    """A scene in an engine, with its lengths and its speeds multiplied by ``length`` and ``speed``."""

    step: Callable[[], object]
    bodies: list[Any]  # in the scene's order
    velocity: str = "velocity"  # the engine's name for the velocity of a body
    length: float = 1.0
    speed: float = 1.0
    owned: Any = None  # objects that must live as long as the engine, which does not own them

    def positions(self) -> Floats:
        return np.array([tuple(body.position) for body in self.bodies]).reshape(-1, 2) / self.length

    def velocities(self) -> Floats:
        found = [tuple(getattr(body, self.velocity)) for body in self.bodies]
        return np.array(found).reshape(-1, 2) / self.speed


OnContact = Callable[[int, int], None]
"""Called after an impulse with the numbers of two bodies, or of a wall and a body."""


def run_engine(
    name: EngineName, scene: Scene, dt: float, until: float, *, watched: Watched = "not"
) -> SteppedRun:
    """Runs a scene in steps of ``dt`` to ``until``, or the first step after it. Unwatched results are
    missing: contacts, or ``deepest``, the deepest overlap after a step, then NaN. Raises MissingExtra without
    the engine, Refused for turns, no arena or no bodies, and the errors of ``run_snapshots``."""
    if scene.commands or scene.arena is None or not len(scene):
        raise Refused("the engines are given scenes with bodies, an arena and no turns; this one is not such")
    steps = snapshots.steps_until(scene, dt, until)
    met: list[tuple[int, int]] = []
    on_contact = None if watched == "not" else lambda a, b: met.append((a, b))
    package = engine_module(name)
    if name == "chipmunk":
        world = _chipmunk(package, scene, dt, on_contact)
    else:
        world = _box2d(package, scene, dt, on_contact, bullets=name == "box2d-bullets")
    contacts = np.empty(0, STEPPED)
    deepest = math.nan
    step = world.step
    began = time.thread_time()
    if watched == "not":
        for _ in range(steps):
            step()
    else:
        contacts, deepest = _watch(world, scene.radius, steps, met, watched == "depths")
    cpu_seconds = time.thread_time() - began
    position, velocity = world.positions(), world.velocities()
    drift = snapshots.energy_drift(scene, velocity)
    return SteppedRun(dt, steps, position, velocity, contacts, deepest, drift, cpu_seconds)


def engine_module(name: EngineName) -> Any:
    """Returns the engine's module; raises MissingExtra without it."""
    return needed(f"Comparing with {TITLES[name].partition(' with')[0]}", _package(name), "peers")


def engine_settings(name: EngineName) -> str:
    """Returns the settings of an engine in words, and its version; raises MissingExtra without it."""
    engine_module(name)
    number = "of unknown version"
    with suppress(PackageNotFoundError):
        number = version(_package(name))
    return f"{_package(name)} {number}: {_SETTINGS[name]}"


def _package(name: EngineName) -> str:
    return "pymunk" if name == "chipmunk" else "Box2D"


_BODIES = "restitution 1, friction 0, no damping, gravity or sleeping, fixed rotation"
_OF_BOX2D = (
    f"warm starting on; {_VELOCITY_ITERATIONS} velocity and {_POSITION_ITERATIONS} position iterations. The "
    f"scene is scaled: the largest disc has a radius of {_LARGEST:g} m, or as much as lets a disc at "
    f"{_FASTEST:g} times the mean speed fly the {_FARTHEST:g} m a step that the engine allows; time is "
    f"scaled so that the mean speed is {_PACE:,.0f} m/s, since pairs that approach at less than "
    "b2_velocityThreshold = 1 m/s, which cannot be set, do not bounce. b2_linearSlop = 0.005 m cannot be set "
    "either: continuous detection lets discs overlap by three of it. Numbers are in single precision."
)
_SETTINGS: dict[EngineName, str] = {
    "chipmunk": (
        "elasticity 1, friction 0, damping 1 (none), no gravity, infinite moments, no sleeping; "
        f"{_ITERATIONS} iterations; collision_slop 0 and collision_bias 1, so that nothing but the elastic "
        "impulse parts an overlap; its default tree of boxes; walls are segments half an arena thick. It "
        "has no continuous detection."
    ),
    "box2d": (
        f"{_BODIES}; no disc is a bullet, so that contacts with walls are detected continuously, and "
        f"contacts of discs after each step; {_OF_BOX2D}"
    ),
    "box2d-bullets": (
        f"{_BODIES}; every disc is a bullet, so that all contacts are detected continuously; {_OF_BOX2D}"
    ),
}


def _watch(
    world: _World, radius: Floats, steps: int, met: list[tuple[int, int]], depths: bool
) -> tuple[Rows, float]:
    rows: list[tuple[int, int, int]] = []
    deepest = 0.0 if depths else math.nan
    for step in range(1, steps + 1):
        world.step()
        if depths:
            deepest = max(deepest, snapshots.deepest_overlap(world.positions(), radius))
        for low, high in map(sorted, met):
            rows.append((step, low, high) if low >= 0 else (step, high, low))
        met.clear()
    return np.array(rows, STEPPED), deepest


def _walls(width: float, height: float, out: float) -> Iterator[tuple[int, Point, Point]]:
    """Yields each wall's number, and the ends of a line this far outside it."""
    yield LEFT, (-out, 0.0), (-out, height)
    yield RIGHT, (width + out, 0.0), (width + out, height)
    yield BOTTOM, (0.0, -out), (width, -out)
    yield TOP, (0.0, height + out), (width, height + out)


def _chipmunk(pymunk: Any, scene: Scene, dt: float, on_contact: OnContact | None) -> _World:
    assert scene.arena is not None
    space = pymunk.Space()
    space.gravity = (0.0, 0.0)
    space.damping = 1.0
    space.iterations = _ITERATIONS
    space.collision_slop = 0.0
    space.collision_bias = 1.0
    bodies: list[Any] = []
    shapes: list[tuple[Any, ...]] = []
    for k, (position, velocity) in enumerate(zip(scene.position, scene.velocity, strict=True)):
        body = pymunk.Body(float(scene.mass[k]), math.inf)
        body.position, body.velocity = position.tolist(), velocity.tolist()
        bodies.append(body)
        shapes.append((pymunk.Circle(body, float(scene.radius[k])), k, body))
    t = 0.5 * max(scene.arena)  # half the thickness of a wall
    for wall, start, end in _walls(*scene.arena, t):
        shapes.append((pymunk.Segment(space.static_body, start, end, t), wall))
    for shape, number, *its in shapes:
        shape.elasticity, shape.friction, shape.number = 1.0, 0.0, number
        space.add(*its, shape)

    def post_solve(arbiter: Any, *_: Any) -> None:
        if on_contact is not None and arbiter.total_impulse.length > 0.0:
            on_contact(*(shape.number for shape in arbiter.shapes))

    if on_contact is not None:
        space.on_collision(None, None, post_solve=post_solve)
    return _World(partial(space.step, dt), bodies)


def _box2d(box2d: Any, scene: Scene, dt: float, on_contact: OnContact | None, bullets: bool) -> _World:
    assert scene.arena is not None
    twice = 2.0 * snapshots.kinetic_energy(scene.mass, scene.velocity)
    mean = math.sqrt(twice / float(scene.mass.sum()) or 1.0)
    length = min(_LARGEST / float(scene.radius.max()), _FARTHEST / (_FASTEST * mean * dt))
    speed = _PACE / mean
    listener = None
    world = box2d.b2World(gravity=(0.0, 0.0), doSleep=False)
    if on_contact is not None:

        def post_solve(self: Any, contact: Any, impulse: Any) -> None:
            if any(normal > 0.0 for normal in impulse.normalImpulses):
                on_contact(contact.fixtureA.body.userData, contact.fixtureB.body.userData)

        listener = type("Listener", (box2d.b2ContactListener,), {"PostSolve": post_solve})()
        world.contactListener = listener
    world.continuousPhysics = world.warmStarting = True
    bodies = []
    for k, (position, velocity) in enumerate(zip(scene.position, scene.velocity, strict=True)):
        radius = float(scene.radius[k]) * length
        shape = box2d.b2CircleShape(radius=radius)
        density = float(scene.mass[k]) / (math.pi * radius**2)
        body = world.CreateDynamicBody(
            position=(position * length).tolist(),
            linearVelocity=(velocity * speed).tolist(),
            bullet=bullets,
            fixedRotation=True,
            allowSleep=False,
            linearDamping=0.0,
            angularDamping=0.0,
            fixtures=box2d.b2FixtureDef(shape=shape, density=density, friction=0.0, restitution=1.0),
            userData=k,
        )
        bodies.append(body)
    width, height = (side * length for side in scene.arena)
    for wall, start, end in _walls(width, height, 0.0):
        edge = world.CreateStaticBody(userData=wall)
        edge.CreateEdgeFixture(vertices=[start, end], friction=0.0, restitution=1.0)
    step = partial(world.Step, dt * length / speed, _VELOCITY_ITERATIONS, _POSITION_ITERATIONS)
    return _World(step, bodies, "linearVelocity", length, speed, (world, listener))
