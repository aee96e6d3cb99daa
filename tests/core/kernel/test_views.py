"""Indices: the reads and writes of the kernel's hooks, of foreign hooks, and numbers that are not indices."""

import re
import sys
from typing import Any, NamedTuple

import numpy as np
import pytest

import kinetile as kt
from kinetile.errors import Refused
from kinetile.kernel import compiled
from kinetile.kernel.compiled import (
    NOTHING_IS_COMPILED,
    composer,
    disowned,
    hook,
    numbers_from,
    unchecked,
    with_shadows,
    wrapping,
    zeros,
)
from kinetile.kernel.loop.checked import checked as as_checked
from kinetile.kernel.tables import BAD_COUNT, BAD_NAME, BAD_PARTNER, NOBODY, SPARE, Kernel, allocate
from lanes import BUILT_IN, first


@pytest.fixture(params=[False, not NOTHING_IS_COMPILED])
def way(request):
    """Runs a test as Python, and compiled."""
    with compiled.compiled_by_default(request.param):
        yield


class Tables(NamedTuple):
    numbers: Any
    records: Any
    square: Any
    bodies: Any
    shadows: Any
    places: Any
    shadow_places: Any


def tables() -> Tables:
    records = np.zeros(4, np.dtype([("x", "f8"), ("y", "i4")])).view(np.recarray)
    records.y = [1, 2, 3, 4]
    seen = [np.arange(2.0) + 10.0 * at for at in range(4)]
    return Tables(np.arange(8.0), records, np.arange(9).reshape(3, 3), *seen)


@hook
def from_the_end(t: Tables, place: int) -> float:
    return t.numbers[place] + t.records[place].y


@unchecked
@hook
def parts_of(t: Tables) -> tuple[float, int, float, float, int]:
    rest, seen, counts = numbers_from(t, 3), with_shadows(t), zeros(4)
    return rest.numbers[4], len(rest.numbers), seen.bodies[1], seen.places[1], counts[3]


def read_and_write(t, place):
    p = disowned(t)
    p.numbers[place] = 7.5
    p.records[place].y += 10
    inside = p.numbers[place] + p.records[place].y + len(p.numbers) + p.square[1, 2]
    return inside, from_the_end(wrapping(p), -1), from_the_end(wrapping((p, place))[0], -2), parts_of(p)


def test_views_are_read_and_written_as_any_and_for_others_they_count_from_the_end(way):
    t = tables()
    function = compiled.compose(read_and_write, {}, "views", Tables)
    assert function(t, np.int32(1)) == (7.5 + 12 + 8 + 5, 7.0 + 4, 6.0 + 3, (7.0, 5, 11.0, 31.0, 0))
    assert (t.numbers[1], t.records.y.tolist()) == (7.5, [1, 12, 3, 4])


@hook
def of_others(t: Tables, place: int) -> float:
    return t.numbers[place] + t.square[place, place]


def ask_with_owners(t, place):
    return of_others(t, place)


def test_a_hook_of_others_freed_tables_of_a_template_that_had_not_disowned_them(way):
    """A foreign ``collide`` and a missed contact ended the process: its tables were given back once too
    often."""
    t = tables()
    function = compiled.compose(ask_with_owners, {"of_others": of_others}, "owners", Tables)
    function(t, 1)
    held = [sys.getrefcount(array) for array in t]
    for _ in range(10):
        assert function(t, 1) == 1.0 + 4.0
    assert [sys.getrefcount(array) for array in t] == held


@unchecked
@hook
def shape_of(t: Tables) -> int:
    return t.numbers.shape[0]


@unchecked
@hook
def total_of(t: Tables) -> float:
    return t.numbers.sum()


@unchecked
@hook
def column_of(t: Tables) -> float:
    return t.records.x[0]


@unchecked
@hook
def more_than(t: Tables) -> float:
    return (t.numbers + 1.0)[0]


def ask_unchecked(t):
    return asked(disowned(t))  # noqa: F821 - a part


@pytest.mark.skipif(NOTHING_IS_COMPILED, reason="nothing is compiled")
@pytest.mark.parametrize("asked", [shape_of, total_of, column_of, more_than])
def test_what_an_unchecked_hook_s_array_has_not_ended_in_a_key_error_of_numba(asked):
    """It was raised while the place in the hook was looked for."""
    function = compiled.compose(ask_unchecked, {"asked": asked}, asked.py_func.__name__, Tables)
    line = asked.py_func.__code__.co_firstlineno + 3
    said = rf"^an array in an unchecked hook has .*: leave out .* \({re.escape(__file__)}, line {line}\)$"
    with pytest.raises(compiled.NotCompiled, match=said):
        compiled.make_ready(function, tables())


@hook
def near(k: Kernel, s: int, body: int) -> int:
    k.near[0] = 1
    k.near[1] = s
    k.near[2] = -7
    return len(k.near) if s > 90 else -1 if s < -90 else 2


@hook
def soonest(k: Kernel, body: int, count: int, barred: int, at: int) -> tuple[float, float, int]:
    return float(count), 3.0, barred


def ask(k, s, body):
    return near(disowned(k), s, body)


def bound(k, body, who):
    return soonest(disowned(k), body, 1, who, 0)


@pytest.mark.parametrize(
    ("named", "fault", "wrong"),
    [
        (0, 0, 0),
        (4, 0, 0),
        (-1, BAD_NAME, -1),
        (5, BAD_NAME, 5),
        (99, BAD_COUNT, 6 + SPARE),
        (-99, BAD_COUNT, -1),
    ],
)
def test_a_number_that_is_no_body_s_is_a_fault_and_no_index(named, fault, wrong, way):
    """Numbers behind those that count are not looked at, and none where their count cannot be."""
    k = allocate(5, 6, 1)
    parts = {"near": as_checked("near", near)}
    assert compiled.compose(ask, parts, "names", Kernel)(k, named, 2) == (0 if fault else 2)
    fault_seen = k.clock[0].fault
    assert int(fault_seen.code) == fault
    assert not fault or (int(fault_seen.a), int(fault_seen.b)) == (2, wrong)


@pytest.mark.parametrize(("who", "right"), [(0, True), (4, True), (NOBODY, False), (5, False)])
def test_a_partner_that_is_no_body_is_a_fault(who, right, way):
    k = allocate(5, 6, 1)
    parts = {"soonest": as_checked("soonest", soonest)}
    found = compiled.compose(bound, parts, "partners", Kernel)(k, 2, who)
    assert found == ((1.0, 3.0, who) if right else (np.inf, np.inf, NOBODY))
    assert int(k.clock[0].fault.code) == (0 if right else BAD_PARTNER)


def test_the_same_hook_makes_the_same_loop():
    assert as_checked("near", near) is as_checked("near", near)


class Checked(np.recarray):
    """An array that refuses an index below 0."""

    def __getitem__(self, index: Any) -> Any:
        refuse(index)
        return super().__getitem__(index)

    def __setitem__(self, index: Any, value: Any) -> None:
        refuse(index)
        super().__setitem__(index, value)


def refuse(index: Any) -> None:
    assert not isinstance(index, int | np.integer) or index >= 0, "an index below 0"


views: list[Any] = []


def checked(given: Any) -> Any:
    views.append(type(given))
    return type(given)(*(array.view(Checked) for array in given))


SCENES = {
    "arena": lambda: kt.make_scene("random", bodies=12, density=0.3, seed=3),
    "sizes": lambda: kt.make_scene("random", bodies=30, density=0.3, radius_ratio=40.0, seed=4),
    "lattice": lambda: kt.make_scene("lattice", bodies=9, turns=6, seed=5),
}


@pytest.mark.interpreted
@pytest.mark.parametrize("phase", first(4, [*BUILT_IN[1:], "naive"]))
@pytest.mark.parametrize("scene", first(1, [*SCENES]))
def test_no_hook_of_kinetile_counts_from_the_end(monkeypatch, scene, phase):
    """Nor do loop, audit and questions: in views such an index would be another place of memory."""
    assert NOTHING_IS_COMPILED
    for module in [each for each in sys.modules.values() if getattr(each, "disowned", None) is disowned]:
        monkeypatch.setattr(module, "disowned", checked)
    monkeypatch.setattr(composer, "_composed", {})
    made = SCENES[scene]()
    if phase == "sweep-tiling" and scene == "sizes":
        made = kt.make_scene("random", bodies=30, density=0.3, radius_ratio=4.0, seed=4)
    sim = kt.Simulation(made, phase, live=phase != "sap-2d")
    sim.run(max_contacts=20)
    for number in (3, 0, 7):
        place = tuple(sim.positions()[int(np.flatnonzero(sim.bodies == number)[0])])
        sim.remove(number)
        sim.run(max_contacts=3)
        sim.set_velocity(int(sim.bodies[2]), (0.5, -0.25))
        try:
            sim.insert(place, (0.1, 0.2), float(made.radius.min()))
        except Refused:
            continue
    sim.run(max_contacts=5)
    assert len(sim.contacts) > 20
    sim.audit()
    sim.next_contact_of(int(sim.bodies[1]))
    first, second = sim.bodies[:2].tolist()
    sim.next_contact(first, second)
    assert len(sim.near())
    with pytest.raises(AssertionError, match="an index below 0"):
        checked(tables()).numbers[-1]
    assert views


@pytest.mark.interpreted
def test_quick_tables_have_the_fields_of_numpy_s_and_the_same_memory():
    plain = allocate(4, near=4, log_rows=4)
    quick = composer.Packed(plain).plain
    for name, table in plain._asdict().items():
        twin = getattr(quick, name)
        for field in table.dtype.names or ():
            assert getattr(twin, field).tobytes() == getattr(table, field).tobytes()
    quick.bodies[2].vx = 0.25
    quick.clock[0].calendar.filed = 3
    quick.queue.key[1:3] = 7
    assert plain.bodies.vx[2] == plain.bodies[2].vx == 0.25
    assert plain.clock[0].calendar.filed == quick.clock.calendar.filed[0] == 3
    assert plain.queue.key.tolist()[:4] == [*quick.queue.key[:1].tolist(), 7, 7, quick.queue[3].key]
    quick.queue.partner = -1
    assert set(plain.queue.partner.tolist()) == {-1}
