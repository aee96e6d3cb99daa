"""The questions to an engine over a pipe: the contacts of a whole run, the candidate pairs of a sequence of
moments, or the time at which two bodies meet. A question makes cases of the kit's scenes, of one line or
several, each with an answer. All verdicts follow from the numbers as sent: no comparison has a tolerance that
the author did not choose."""

import json
import math
import tomllib
from abc import ABC, abstractmethod
from collections import defaultdict
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from itertools import combinations, islice, zip_longest
from typing import Annotated, Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, Field, ValidationError, create_model

from kinetile import Scene, Settings
from kinetile.arrays import Rows
from kinetile.errors import KinetileError, SceneError
from kinetile.instruments import dumps_scene
from kinetile.toolbox import WALLS, Plan, positions_after
from kinetile_accuracy.specification.arithmetic import UNIT_BITS, FlightPlan, Frame, Separation, unit_bits
from kinetile_accuracy.specification.certify import explain_difference
from kinetile_accuracy.specification.shapes import Difference
from kinetile_accuracy.specification.touching import touching_tick
from kinetile_conformance.cases import CONTACTS, REFERENCE, Subject, horizon, outcome, told
from kinetile_conformance.checks.check import JUDGED
from kinetile_conformance.drawing import leave_out, minimised, reduced
from kinetile_conformance.strategies.changes import ended_at, only_bodies
from kinetile_conformance.strategies.shapes import scaled

LEAST_SHARE = 0.01
"""The share of contacts that must be compared within a distance: with less a check is not judged."""

WITHOUT: dict[str, Any] = {"responses": {}, "commands": (), "turns": (), "mass": 1.0}
"""Keys that an engine may refuse by name, and their values in a scene without them."""

SHORTENINGS, MOMENTS = 20, 12
"""The most shortenings of a scene with too many contacts; moments of a scene for candidate pairs."""

FORESEEN = 1000.0
"""The most time units of a cast: a contact is foreseen up to 1,024 after the later anchor."""

VIEWS, NEARBY = ((1.0, 0.0), (2.0, 0.0), (1.0 + 2.0**-30, 1.0 / 3.0)), 1024.0
"""The factors of a body's size in a case; and the part of the largest body by which all are moved, if they
are at most so many radii from the origin. Twice as large they overlap; touching bodies overlap by 1e-9, which
is not visible in single precision."""

DISTURBED, CASTS, FAR = 1000.0, 20, 2
"""The distance over a disturbance of it; the numbers of cast pairs of a scene, and of far pairs."""

NOTHING = np.zeros((0, 4))
Row = tuple[float, ...]
"""A contact of an answer: epoch, tick, a, b, or, if times are compared, time, a, b."""

EXACT, TIMED = ["epoch", "tick", "a", "b"], ["time", "a", "b"]

Long = Annotated[int, Field(ge=-(2**62), lt=2**62)]
Body = Annotated[int, Field(ge=-(2**31), lt=2**31)]
Finite = Annotated[float, Field(allow_inf_nan=False)]


class Form:
    """The form of an answer: the key of its value, its notation, and its type."""

    def __init__(self, key: str, shown: str, kind: Any) -> None:
        self.key, self.shown = key, shown
        fields: dict[str, Any] = {key: (kind, None), "refused": (str | tuple[str, ...], "")}
        config = ConfigDict(extra="forbid", strict=True)
        self._model = create_model("Answer", __config__=config, **fields)

    def read(self, line: bytes) -> Any:
        """Returns the value of an answer, or its refusal: a string or a tuple; raises ValueError for none."""
        try:
            found = self._model.model_validate_json(line)
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            raise ValueError(": ".join([*(f"{at}" for at in first["loc"]), first["msg"]])) from None
        if len(found.model_fields_set) != 1:
            raise ValueError("it has no value, or both")
        return getattr(found, *found.model_fields_set)


class Exchange(NamedTuple):
    """A line for an engine, the form of its answer, and ``judge``, which returns the fault of a value in
    words. ``right`` is the reference's value, and ``case`` the case up to this line."""

    line: bytes
    form: Form
    judge: Callable[[Any], str | None]
    right: Any
    case: Any


class Question(ABC):
    """A question to an engine. ``within`` is the allowed distance of times, if any, and ``most`` the limit of
    contacts of a run. ``sums`` has the counts that ``told`` puts into words, first the number of comparisons;
    ``keys`` are the possible keys of a line, each a capability of an engine."""

    told = ""
    keys: tuple[str, ...] = ("shapes",)

    def __init__(self, within: float | None = None, most: int = CONTACTS) -> None:
        self.within = within
        self.most = most
        self.sums = [0, 0]

    @abstractmethod
    def cases(self, scene: Scene) -> Iterator[Any]:
        """Yields the cases of a scene."""

    @abstractmethod
    def exchanges(self, case: Any) -> Iterator[Exchange]:
        """Yields the lines of a case, in order."""

    def smaller(self, case: Any, fails: Callable[[Any], bool], seconds: float) -> Any:
        """Returns a minimised case."""
        return reduced(case, fails, seconds)

    def _count(self, one: int, other: int) -> None:
        self.sums = [self.sums[0] + one, self.sums[1] + other]


class Contacts(Question):
    """All contacts of a run, as ticks, or, ``within`` a distance, as times.

    The comparison within a distance ends when errors have grown too large: before the first contact that a
    disturbance of the scene by a thousandth of the distance moves by more than half of the distance; and
    before two contacts of one body within it, whose order decides the rest. Bodies are smaller by the
    distance than drawn: bodies that touch at the start, or slide along each other, could not be disturbed.
    """

    told = "{:,} of {:,} contacts compared ({:.0%}){}"
    keys = ("arena", "mass", "periodic", "gravity", "shapes", "turns", "commands", "responses")

    def cases(self, scene: Scene) -> Iterator[Scene]:
        """Yields the scene."""
        if self.within is not None:  # one tie ends the comparison of all: few lattices are sent
            scene = only_bodies(scene, np.arange(16)) if len(scene) > 400 else scene
            scene = resized(scene, 1.0 - self.within)
        yield scene

    def exchanges(self, case: Scene) -> Iterator[Exchange]:
        """Yields the scene, ended before it has too many contacts, if it can be, and can be disturbed."""
        judged = reference_contacts(case, self.most)
        with suppress(SceneError):
            if judged is not None:
                yield self.exchange(*judged)

    def exchange(self, scene: Scene, expected: Rows) -> Exchange:
        """Returns the line of a scene with these contacts."""
        right: list[Row] = expected[EXACT if self.within is None else TIMED].tolist()
        end = None if self.within is None else compared_until(scene, expected, self.within)

        def judge(rows: Sequence[Row]) -> str | None:
            if self.within is None or end is None:
                self._count(len(right), len(right))
                return difference(scene, rows, expected)
            self._count(sum(row[0] < end for row in right), len(right))
            near, until = partial(_near, scene, self.within), horizon(scene)
            for at, row in enumerate(rows):
                if row[0] > until and not near(row[0], until):
                    return f"contact {at} is {_contact(row)}, after the end at time {until!r}"
            parted = parting(rows, right, near, end)
            return parted and parted[1]

        form = EXACT_CONTACTS if self.within is None else TIMED_CONTACTS
        return Exchange(_line(_tables(scene)), form, judge, right, scene)


EXACT_CONTACTS = Form("contacts", "[[epoch, tick, a, b], ...]", list[tuple[Long, Long, Body, Body]])
TIMED_CONTACTS = Form("contacts", "[[time, a, b], ...]", list[tuple[Finite, Body, Body]])


def _tables(scene: Scene) -> dict[str, Any]:
    """Returns the scene to be sent: without rules for kinds that no body has, which are for the kit's own
    loops, and without kinds if no rule is left."""
    tables = tomllib.loads(dumps_scene(scene))
    commands = tables.get("commands", ())
    rows = [*tables.get("bodies", ()), *(each["insert"] for each in commands if "insert" in each)]
    held = {each["kind"] for each in (*rows, *commands) if "kind" in each} | {"*", "wall"}
    rules = [rule for rule in tables.pop("responses", ()) if held.issuperset(rule.get("between", ()))]
    if rules:
        tables["responses"] = rules
    elif not any("set-kind" in each for each in commands):
        tables.pop("kinds", None)
        for row in rows:
            row.pop("kind", None)
    for row in rows:
        if row.get("mass") == math.inf:
            row["mass"] = "inf"
    return tables


def without(case: Any, keys: Collection[str]) -> Any:
    """Returns a case without the features that an engine has refused by these keys, if possible."""
    for key in WITHOUT.keys() & keys if isinstance(case, Scene) else ():
        with suppress(SceneError):
            case = case.replace(**{key: WITHOUT[key]})
    return case


def _line(value: object) -> bytes:
    return json.dumps(value, allow_nan=False).encode() + b"\n"


def reference_contacts(scene: Scene, most: int) -> tuple[Scene, Rows] | None:
    """Returns a scene with its contacts by the reference. A scene with ``most`` contacts and more, or that
    jams, is shortened; returns None if it has too many at its start."""
    scene = ended_at(scene, horizon(scene))
    for _ in range(SHORTENINGS):
        run = outcome(Subject(REFERENCE, {}).reference, scene, most)
        if run.ended == "ran" and len(run.contacts) < most:
            return scene, run.contacts
        last = float(run.contacts["time"][-1]) if len(run.contacts) else horizon(scene)
        scene = ended_at(scene, scene.start + (last - scene.start) / 2.0)
    return None


def difference(scene: Scene, found: Sequence[Row], expected: Rows) -> str | None:
    """Returns the first difference of an engine's contacts from the reference's, in a sentence, and the right
    contact by the specification, if that is decided quickly; None without a difference."""
    right = expected[EXACT]
    for at, (mine, theirs) in enumerate(zip_longest(found, right.tolist())):
        if mine != theirs:
            lists = {"the engine": np.array(found, right.dtype), REFERENCE: right}
            judged = explain_difference(scene, lists, at) if len(scene) <= JUDGED else ""
            text = told(f"contact {at}", mine, theirs, _contact)
            if mine and theirs and mine[2:] == theirs[2:]:
                ticks = (int(mine[0] - theirs[0]) << UNIT_BITS) + int(mine[1] - theirs[1])
                text += f", off by {math.ldexp(abs(ticks), -UNIT_BITS - unit_bits(scene)):.2g}"
            return f"{text}\n{judged}" if judged else text
    return None


def _contact(row: Row) -> str:
    *when, a, b = row
    partner = f"the {WALLS[int(b)]} wall" if b in WALLS else f"body {b}"
    moment = f"time {when[0]!r}" if len(when) == 1 else f"epoch {when[0]}, tick {when[1]}"
    return f"body {a} with {partner} at {moment}"


def _near(scene: Scene, within: float, one: float, other: float) -> bool:
    """Returns True if two times are within a distance, in units of the time since the start, or the unit."""
    return abs(one - other) <= within * max(abs(one - scene.start), abs(other - scene.start), scene.time_unit)


def parting(
    found: Sequence[Row], right: Sequence[Row], near: Callable[[float, float], bool], end: float
) -> tuple[float, str] | None:
    """Returns the time of the first difference of contacts [time, a, b] from the right ones before ``end``,
    and its kind, or None. The order of near contacts is free; the k-th of each two bodies are compared."""
    latest = -math.inf
    for at, row in enumerate(found):
        if row[0] < min(latest, end) and not near(row[0], latest):
            return row[0], f"contact {at} is {_contact(row)}, after one at time {latest!r}"
        latest = max(latest, row[0])
    both: dict[tuple[float, ...], list[list[tuple[int, Row]]]] = defaultdict(lambda: [[], []])
    for side, rows in enumerate((found, right)):
        for at, row in enumerate(rows):
            both[row[1:]][side].append((at, row))
    wrong = []
    for mine, theirs in both.values():
        for (at, one), (k, other) in zip_longest(mine, theirs, fillvalue=(-1, None)):
            if one is None or other is None or not near(one[0], other[0]):
                first = min(row[0] for row in (one, other) if row is not None)
                text = told(f"contact {k if one is None else at}", one, other, _contact)
                text += f", off by {abs(one[0] - other[0]):.2g}" if one and other else ""
                wrong.append((first, text))
                break
    return min((each for each in wrong if each[0] < end), default=None)


def compared_until(scene: Scene, expected: Rows, within: float) -> float:
    """Returns the time until which contacts are expected within a distance of the reference's."""
    right: list[Row] = expected[TIMED].tolist()
    end = horizon(scene)
    last: dict[float, float] = {}
    for time, *bodies in right:
        before = [last[body] for body in bodies if body in last]
        end = min((each for each in before if _near(scene, 2.0 * within, time, each)), default=end)
        if end < horizon(scene):
            break
        last |= {body: time for body in bodies if body >= 0}
    near = partial(_near, scene, within / 2.0)
    for sign in (1.0, -1.0):
        other = disturbed(scene, sign * within / DISTURBED)
        run = outcome(Subject(REFERENCE, {}).reference, other, len(right) + 1)
        parted = parting(run.contacts[TIMED].tolist(), right, near, end)
        end = min(end, parted[0]) if parted else end
    return end - within * max(end - scene.start, scene.time_unit)


def disturbed(scene: Scene, by: float) -> Scene:
    """Returns a scene whose sizes are off by a factor, and whose places and velocities by up to as much at
    random: places relative to the farthest, like rounding, and equal velocities by the same amount."""
    random = np.random.default_rng(0)
    different, which = np.unique(scene.velocity, axis=0, return_inverse=True)
    velocity = (different * (1.0 + by * random.uniform(-1.0, 1.0, different.shape)))[which.reshape(-1)]
    off = by * np.abs(scene.position).max(initial=0.0) * random.uniform(-1.0, 1.0, scene.position.shape)
    return resized(scene, 1.0 + by).replace(velocity=velocity, position=scene.position + off)


def resized(scene: Scene, by: float) -> Scene:
    """Returns a scene with larger bodies at the start, by a factor."""
    if not scene.shapes:
        return scene.replace(radius=scene.radius * by)
    return scene.replace(shape=scene.shape, shapes=[scaled(shape, by) for shape in scene.shapes])


@dataclass(frozen=True)
class Moments:
    """Moments of a scene: (x, y, radius) of discs, or (left, bottom, right, top) of boxes, by the body."""

    key: str
    moments: tuple[Mapping[int, tuple[float, ...]], ...]

    def at(self, kept: NDArray[np.integer]) -> "Moments":
        """Returns some of the moments."""
        return replace(self, moments=tuple(self.moments[at] for at in np.sort(kept)))

    def only(self, kept: NDArray[np.integer]) -> "Moments":
        """Returns the moments with some of the bodies."""
        there = set(kept.tolist())
        return replace(self, moments=tuple({n: b[n] for n in b if n in there} for b in self.moments))

    def __len__(self) -> int:
        return len(set().union(*self.moments))


class Pairs(Question):
    """Candidate pairs at each of some moments: all touching pairs, each once, and only present bodies."""

    told = "{1:,} candidate pairs for {0:,} that touch"
    keys = ("discs", "boxes")

    def cases(self, scene: Scene) -> Iterator[Moments]:
        """Yields moments of the reference's run of a scene, in the form of ``VIEWS``: the start, times at
        equal distances, and the first contact after each, until the run ends."""
        sim = Subject(REFERENCE, {}).reference.simulation(scene)
        found: list[list[dict[int, tuple[float, ...]]]] = [[] for _ in VIEWS]
        size = scene.radius.max(initial=0.0)
        for part in range(MOMENTS + 1):
            end = scene.start + part / MOMENTS * (horizon(scene) - scene.start)
            with suppress(KinetileError):  # a jam ends the run
                sim.run(until=max(end, sim.time), max_contacts=CONTACTS if part % 2 == 0 else 1)
            far = np.abs(sim.positions()).max(initial=0.0) > NEARBY * size
            for (growth, aside), moments in zip(VIEWS, found, strict=True):
                x, y = (sim.positions() + (0.0 if far else aside * size)).T
                rows = np.column_stack([x, y, growth * sim.radii()])
                if scene.shapes:
                    reaches = growth * np.array([each.reaches for each in sim.shapes()] or NOTHING)
                    left, right, down, up = reaches.T
                    rows = np.column_stack([x - left, y - down, x + right, y + up])
                moments.append(dict(zip(sim.bodies.tolist(), map(tuple, rows.tolist()), strict=True)))
        for moments in found:
            yield Moments("boxes" if scene.shapes else "discs", tuple(moments))

    def exchanges(self, case: Moments) -> Iterator[Exchange]:
        """Yields a line for each moment, numbered from 0."""
        for at, bodies in enumerate(case.moments):
            right = touching(bodies)
            line = _line({"moment": at, case.key: [[number, *row] for number, row in bodies.items()]})
            judge = partial(self._judged, at, bodies, right)
            yield Exchange(line, PAIRS, judge, right, case.at(np.arange(at + 1)))

    def _judged(
        self, at: int, bodies: Mapping[int, tuple[float, ...]], right: list[tuple[int, int]], rows: Any
    ) -> str | None:
        seen: set[tuple[int, int]] = set()
        for a, b in rows:
            strange, pair = [body for body in (a, b) if body not in bodies], (min(a, b), max(a, b))
            if strange or a == b or pair in seen:
                why = "a body with itself" if a == b else "once more"
                why = f"and there is no body {strange[0]}" if strange else why
                return f"at moment {at} the engine names pair [{a}, {b}], {why}"
            seen.add(pair)
        self._count(len(right), len(seen))
        for a, b in right:
            if (a, b) not in seen:
                return f"at moment {at} bodies {a} and {b} touch, and are no pair: {bodies[a]}, {bodies[b]}"
        return None

    def smaller(self, case: Moments, fails: Callable[[Moments], bool], seconds: float) -> Moments:
        """Returns a minimised case: fewer moments, fewer bodies."""
        parts = (
            (lambda case: np.arange(len(case.moments)), Moments.at),
            (lambda case: np.array(sorted(set().union(*case.moments))), Moments.only),
        )
        steps = [partial(leave_out, order=order, only=only, least=1) for order, only in parts]
        return minimised(case, fails, seconds, steps)


PAIRS = Form("pairs", "[[a, b], ...]", list[tuple[Body, Body]])


def touching(bodies: Mapping[int, tuple[float, ...]]) -> list[tuple[int, int]]:
    """Returns the pairs of closed discs, or boxes, that have a point in common, exactly."""
    numbers = np.array(sorted(bodies), dtype=np.int64)
    rows = np.array([bodies[number] for number in numbers.tolist()] or NOTHING)
    a, b = np.triu_indices(len(rows), 1)
    if rows.shape[1] == 4:
        low, high = rows[:, :2], rows[:, 2:]
        touch = ((low[a] <= high[b]) & (low[b] <= high[a])).all(axis=1)
    else:
        apart, reach = np.hypot(*(rows[a, :2] - rows[b, :2]).T), rows[a, 2] + rows[b, 2]
        close = np.abs(apart - reach) <= 1e-12 * reach + 1e-300  # far more than the rounding of either
        touch = (apart < reach) & ~close
        for at in np.flatnonzero(close).tolist():
            (x, y, r), (z, w, s) = (map(Fraction, rows[i].tolist()) for i in (a[at], b[at]))
            touch[at] = (x - z) ** 2 + (y - w) ** 2 <= (r + s) ** 2
    return list(zip(numbers[a[touch]].tolist(), numbers[b[touch]].tolist(), strict=True))


class Casts(Question):
    """The contact time of two bodies that fly from time 0 to an end, or None: right within the distance of
    the times for radii smaller, or larger, by the distance: a graze may be early, late or absent."""

    told = "{:,} of {:,} meet"

    def cases(self, scene: Scene) -> Iterator[Scene]:
        """Yields scenes of two bodies: pairs that meet, or would meet if larger, and a few others."""
        end = Settings(until=min(horizon(scene) - scene.start, FORESEEN * scene.time_unit))
        bare = scene.replace(commands=(), arena=None, start=0.0, settings=end)
        met = outcome(Subject(REFERENCE, {}).reference, scene, self.most).contacts[["a", "b"]].tolist()
        n = len(scene)
        pairs = dict.fromkeys((a, b) for a, b in met if 0 <= b < n > a)
        pairs |= dict.fromkeys(combinations(range(min(n, 6)), 2))
        far = 0
        for pair in islice(pairs, CASTS):
            case = only_bodies(bare, np.array(pair))
            is_far = meeting(case, 2.0, 0.0) is None
            far += is_far
            if not is_far or far <= FAR:
                yield case

    def exchanges(self, case: Scene) -> Iterator[Exchange]:
        """Yields the line of two bodies."""
        within, end = cast(float, self.within), horizon(case)
        exact = meeting(case, 1.0, 0.0)
        right = exact if exact is not None and exact <= end else None
        early = meeting(case, 1.0 + within, within * case.time_unit)
        late = meeting(case, 1.0 - within, 0.0)
        near = partial(_near, case, within)

        def judge(time: float | None) -> str | None:
            self._count(right is not None, 1)
            if time is None:
                is_right = late is None or late >= end or near(late, end)
            else:
                last = end if late is None else min(late, end)
                after = early is not None and (early <= time or near(time, early))
                is_right = after and (time <= last or near(time, last))
            by = "" if right is None or time is None else f", off by {abs(time - right):.2g}"
            return None if is_right else f"they meet {_when(right)}, and the engine says {_when(time)}{by}"

        tables = _tables(case)
        bodies = [{k: body[k] for k in body if k not in ("mass", "kind")} for body in tables["bodies"]]
        shapes = {"shapes": tables["shapes"]} if case.shapes else {}
        line = _line({"cast": bodies, "until": end} | shapes)
        yield Exchange(line, CAST, judge, right, case)


CAST = Form("time", "a number or null", Finite | None)


def _when(time: float | None) -> str:
    return "never, up to the end" if time is None else f"at time {time!r}"


def meeting(scene: Scene, by: float, before: float) -> float | None:
    """Returns the contact time of two bodies, larger by a factor, that begin ``before`` time 0; or None."""
    bits = unit_bits(scene)
    frame = Frame(None, bits)
    places = positions_after(Plan.of_vectors(scene.position, scene.velocity), -before)
    columns = np.column_stack([places, scene.velocity, by * scene.radius]).tolist()
    one, two = (FlightPlan(x, y, vx, vy, 0, radius, frame) for x, y, vx, vy, radius in columns)
    shapes = [scaled(scene.shapes[at], by) for at in scene.shape] if scene.shapes else []
    tick = touching_tick(Difference(*shapes) if shapes else None, Separation(one, two))
    return None if tick is None else math.ldexp(tick, -UNIT_BITS - bits) - before


QUESTIONS: dict[str, type[Question]] = {"contacts": Contacts, "pairs": Pairs, "casts": Casts}
