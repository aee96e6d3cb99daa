"""The certified oracle against closed forms, and against rational arithmetic that shares nothing with it."""

import ast
import math
from collections.abc import Iterable
from decimal import Decimal, localcontext
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kinetile as kt
from command_line import kinetile, printed
from kinetile.errors import Refused
from kinetile_accuracy import certify_log, cli
from kinetile_accuracy.oracle import oracle as oracle_module
from kinetile_accuracy.oracle.agreement import certify
from kinetile_accuracy.oracle.oracle import CertifiedRun, Enclosure, Oracle, oracle_contacts

flint = pytest.importorskip("flint", reason="the certified oracle needs python-flint")

from kinetile_accuracy.oracle.times import Root, same  # noqa: E402

SCENES = Path(__file__).parents[3] / "scenes"
LEFT, RIGHT, BOTTOM, TOP = -1, -2, -3, -4


def scene_of(name: str) -> kt.Scene:
    return kt.load_scene(SCENES / f"{name}.toml")


def listed(run: CertifiedRun) -> list[tuple[int, int]]:
    return [(contact.a, contact.b) for contact in run.contacts]


def surely(time: Enclosure, truth: Fraction) -> bool:
    return abs(time.middle - truth) <= time.radius <= Fraction(1, 2**80) * max(truth, Fraction(1, 2**20))


def test_head_on() -> None:
    scene = kt.Scene([[0.25, 0.5], [0.75, 0.5]], [[1.0, 0.0], [-0.5, 0.0]], 0.125, [1.0, 3.0], (1.0, 1.0))
    run = oracle_contacts(scene, 0.2)
    # The gap of 1/4 closes at speed 3/2; v0 = 1 - 2 * 3/4 * 3/2 = -5/4, v1 = -1/2 + 2 * 1/4 * 3/2 = 1/4.
    assert listed(run) == [(0, 1)]
    assert surely(run.contacts[0].time, Fraction(1, 6))
    assert run.contacts[0].head_on == 1.0
    after = oracle_contacts(scene, max_contacts=3)
    x0, x1 = Fraction(1, 4) + Fraction(1, 6), Fraction(3, 4) - Fraction(1, 12)
    expected = {
        (0, LEFT): Fraction(1, 6) + (x0 - Fraction(1, 8)) / Fraction(5, 4),
        (1, RIGHT): Fraction(1, 6) + (Fraction(7, 8) - x1) / Fraction(1, 4),
    }
    assert listed(after)[:2] == [(0, 1), (0, LEFT)]
    assert surely(after.contacts[1].time, expected[0, LEFT])


def test_an_oblique_contact_to_sixty_digits() -> None:
    ((time, a, b, tied, head_on),) = oracle_contacts(scene_of("H08a"), 0.5).contacts
    assert (a, b, tied) == (0, 1, False)
    with localcontext() as context:
        context.prec = 60
        dy = Decimal(float(scene_of("H08a").position[1, 1])) - Decimal("0.375")
        truth = (Decimal("0.5") - (Decimal("0.0625") - dy * dy).sqrt()) / 2
        assert abs(time.middle - Fraction(truth)) <= time.radius + Fraction(1, 10**58)
        assert head_on == pytest.approx(float((1 - (dy / Decimal("0.25")) ** 2).sqrt()), rel=1e-12)
    assert Decimal(time.decimal(20)) == round(truth, 20)
    assert time.nearest == float(truth)


def test_two_roots_are_compared_by_squaring() -> None:
    def root(p: Any, q: Any) -> Root:
        return Root(flint.fmpq(p), flint.fmpq(q))

    assert same(root(3, 4), root(2, 1))
    assert same(root(1, 0), root(2, 1))
    assert same(root(1, 2), root(1, 2))
    assert not same(root(0, 4), root(1, 1)), "the squares of both sides are equal, and their signs are not"
    assert not same(root(3, 4), root(0, 1)), "3 is the sum of the square roots, not their difference"
    assert not same(root(0, 2), root(flint.fmpq(1, 10**80), 2))
    assert not same(root(0, 2), root(0, 2 + flint.fmpq(1, 10**80)))
    assert root(3, flint.fmpq(4, 9)).rational == flint.fmpq(7, 3)
    assert root(3, 2).rational is None


def congruent(order: Iterable[int]) -> kt.Scene:
    """Returns two pairs, one a copy of the other farther up: they meet obliquely at one irrational time."""
    position = np.array([[0.25, 0.25], [0.75, 0.3125], [0.25, 1.25], [0.75, 1.3125]])
    velocity = np.array([[1.0, 0.0], [-1.0, 0.0]] * 2)
    chosen = list(order)
    return kt.Scene(position[chosen], velocity[chosen], 0.125)


@pytest.mark.parametrize(
    ("order", "expected"),
    [((0, 1, 2, 3), [(0, 1), (2, 3)]), ((2, 0, 1, 3), [(0, 3), (1, 2)]), ((3, 2, 1, 0), [(0, 1), (2, 3)])],
)
def test_a_tie_of_irrational_times_is_settled(
    order: tuple[int, ...], expected: list[tuple[int, int]]
) -> None:
    run = oracle_contacts(congruent(order), 1.0)
    assert listed(run) == expected
    assert [c.tied for c in run.contacts] == [False, True]
    assert run.bits == oracle_module.FIRST_BITS


def test_a_near_tie_is_no_tie() -> None:
    scene = congruent(range(4))
    position = scene.position.copy()
    position[3, 0] = np.nextafter(position[3, 0], 0.0)  # they meet 2^-54 earlier
    run = oracle_contacts(kt.Scene(position, scene.velocity, scene.radius), 1.0)
    assert listed(run) == [(2, 3), (0, 1)]
    assert not run.contacts[1].tied


def test_order_within_one_moment() -> None:
    """At time 1/4 disc 0 would meet disc 1, but turns; disc 2 meets a wall, and discs 3 and 4 each other."""
    position = [[1.25, 0.5], [1.75, 0.5], [0.375, 1.0], [1.0, 1.5], [1.5, 1.5]]
    velocity = [[0.5, 0.0], [-0.5, 0.0], [-1.0, 0.0], [0.5, 0.0], [-0.5, 0.0]]
    turns = [(0, 0.25, (0.0, 0.0)), (1, 0.25, (0.0, 0.0))]
    scene = kt.Scene(position, velocity, 0.125, arena=(4.0, 4.0), turns=turns)
    run = oracle_contacts(scene, 0.5)
    assert listed(run) == [(2, LEFT), (3, 4)]
    assert [c.time.middle for c in run.contacts] == [Fraction(1, 4)] * 2
    turns[1] = (1, 0.25, (-1.0, 0.0))
    run = oracle_contacts(kt.Scene(position, velocity, 0.125, arena=(4.0, 4.0), turns=turns), 0.25)
    assert listed(run) == [(2, LEFT), (0, 1), (3, 4)], "they touch and still approach"


@pytest.mark.parametrize(("speed", "expected"), [(-1.0, [(0, LEFT)]), (1.0, []), (0.0, [])])
@pytest.mark.parametrize("overlap", [0.0, 2.0**-45])
def test_a_wall_touched_at_the_start(speed: float, expected: list[Any], overlap: float) -> None:
    scene = kt.Scene([[0.125 - overlap, 0.5]], [[speed, 0.0]], 0.125, arena=(1.0, 1.0))
    run = oracle_contacts(scene, 0.5)
    assert listed(run) == expected
    assert all(c.time == (0, 0) for c in run.contacts)
    first = 0 if speed < 0.0 else (0.75 + overlap) / max(speed, 1e-9)
    then = oracle_contacts(scene, 1.0).contacts[len(expected) :]
    if speed < 0.0:  # back from where it was
        first = 0.75 + overlap
    assert [c.time.middle for c in then] == ([Fraction(first)] if speed else [])


def test_a_disc_at_rest_that_touches_is_hit_at_an_irrational_time() -> None:
    """Disc 1 rests against the wall and against disc 2 when disc 0 comes: both touches are still known."""
    position = np.array([[32.0, 48.0], [5.0, 40.0], [11.0, 32.0]]) / 64.0
    scene = kt.Scene(position, [[-1.0, -0.25], [0.0, 0.0], [0.0, 0.0]], 5.0 / 64.0, arena=(1.0, 1.0))
    run = oracle_contacts(scene, 0.5)
    assert run.ended == "until"
    assert listed(run) == [(0, 1), (1, LEFT), (0, 1), (1, 2), (1, LEFT)]
    assert [c.tied for c in run.contacts] == [False, True, True, True, True]
    assert run.bits == oracle_module.FIRST_BITS


@pytest.mark.parametrize(
    ("seed", "what"),
    [
        (11, "tie of disc 7 and the left wall and disc 7 and the top wall"),  # exact, but not in balls
        (13, "graze or contact at a standstill of discs 1 and 3"),
        (25, "disc 1 and the right wall meet"),
    ],
)
@pytest.mark.small
def test_what_is_undecidable_is_reported_and_never_guessed(seed: int, what: str) -> None:
    scene = kt.make_scene("lattice", bodies=9, seed=seed)
    run = oracle_contacts(scene, 3.0)
    assert (run.ended, run.complete) == ("undecidable", False)
    assert run.undecidable is not None
    assert what in run.undecidable.what
    assert all(f" {body}" in what for body in run.undecidable.bodies)
    assert run.undecidable.time >= run.contacts[-1].time.nearest * (1.0 - 2.0**-40)
    assert f"not decidable at {run.bits} bits" in str(run)
    assert run.bits >= 8 * oracle_module.FIRST_BITS
    sim = kt.Simulation(scene, "naive")
    sim.run(max_contacts=len(run.contacts))
    assert listed(run) == list(zip(sim.contacts["a"], sim.contacts["b"], strict=True))


def test_more_bits_give_more_contacts_and_the_same_ones() -> None:
    scene = kt.make_scene("grid", bodies=16, seed=0)
    short = oracle_contacts(scene, max_contacts=600, cap_bits=256)
    whole = oracle_contacts(scene, max_contacts=600)
    assert (short.ended, short.bits) == ("undecidable", 256)
    assert (whole.ended, whole.bits) == ("going on", 512)
    assert 200 < len(short.contacts) < 600
    assert listed(short) == listed(whole)[: len(short.contacts)]
    for one, two in zip(short.contacts, whole.contacts, strict=False):
        assert abs(one.time.middle - two.time.middle) <= one.time.radius + two.time.radius
        assert one.time.radius <= Fraction(1, 2**80) * one.time.middle


def test_endings() -> None:
    scene = kt.Scene([[0.0, 0.0], [1.0, 0.0]], [[1.0, 0.0], [-1.0, 0.0]], 0.25)
    assert oracle_contacts(scene, 5.0).ended == "until"
    assert oracle_contacts(scene, max_contacts=5).ended == "quiet"
    assert oracle_contacts(scene, max_contacts=1).ended == "going on"
    assert listed(oracle_contacts(scene, 0.25)) == [(0, 1)], "the end itself belongs to the run"
    assert listed(oracle_contacts(scene, np.nextafter(0.25, 0.0))) == []


def of_two(radius: Any = 0.25, **more: Any) -> kt.Scene:
    return kt.Scene([[1.0, 1.0], [3.0, 1.125]], [[1.0, 0.0], [-0.5, 0.0]], radius, arena=(4.0, 2.0), **more)


BEYOND = {
    "bodies of other shapes": of_two(None, shape=[0, 0], shapes=[kt.box(0.5, 0.25)]),
    "periodic axes": of_two(periodic="x"),
    "accelerations": of_two(gravity=(0.0, -1.0)),
    "immovable bodies": of_two(mass=[1.0, math.inf]),
    "the responses pass and stop": of_two(responses={(0, 0): "pass", (0, "wall"): "stop"}),
    "insertions or removals": of_two(commands=[kt.Remove(0, 0.25)]),
    "commands at exact ticks": of_two(commands=[kt.Turn(0, 0.25, (0.0, 1.0), at=(0, 1 << 50, 0))]),
    "an end at an exact tick": of_two(settings=kt.Settings(until=0.5, end=(0, 1 << 51, 0))),
    "the narrow phases wall": of_two(settings=kt.Settings(narrow_phases=("wall",))),
}


@pytest.mark.parametrize("what", BEYOND)
@pytest.mark.interpreted
def test_what_is_beyond_it_is_refused_by_a_sentence_and_judged_by_certify_log(what: str) -> None:
    scene = BEYOND[what]
    said = f"this scene has {what}: certify-log judges the contacts of such a scene"
    with pytest.raises(Refused, match=said) as caught:
        Oracle(scene)
    assert str(caught.value).startswith("the oracle judges elastic discs that can move, between walls or ")
    if scene.settings.narrow_phases is None:
        sim = kt.Simulation(scene, "naive")
        with pytest.raises(Refused, match=said):
            certify(sim, until=0.5)
        sim.run(6.0 if scene.settings.until is None else None)
        assert certify_log(scene, sim.contacts, until=sim.time).right


def test_what_was_certified_is_kept_while_it_goes_on_and_precision_is_given_back() -> None:
    scene = kt.make_scene("grid", bodies=16, seed=0)
    oracle = Oracle(scene, 1.0)
    for _ in range(96):
        next(iter(oracle))
        assert flint.ctx.prec == 53, "the precision of others is theirs between two contacts"
    assert oracle.certified.ended == "going on"
    assert listed(oracle.certified) == listed(oracle_contacts(scene, max_contacts=96))


def test_decimal_strings_have_only_digits_that_are_known() -> None:
    assert Enclosure(Fraction(1, 3), Fraction(0)).decimal(5) == "0.33333"
    assert Enclosure(Fraction(1, 3), Fraction(1, 10**4)).decimal() == "0.333"
    assert Enclosure(Fraction(3, 8), Fraction(0)).decimal() == "0.375"
    assert Enclosure(Fraction(10**6), Fraction(1, 2)).decimal() == "1.00000E+6"


def test_it_shares_no_code_with_the_kernel() -> None:
    allowed = {"kinetile.errors.Refused", "kinetile.Scene", "kinetile.Turn", "kinetile_accuracy.oracle.times"}
    own = {
        *("kinetile.lazy", "kinetile_accuracy.sections"),
        *(f"kinetile_accuracy.oracle.{name}" for name in ("attempt", "times")),
    }
    for name in ("oracle", "attempt", "times"):
        tree = ast.parse(Path(oracle_module.__file__).with_name(f"{name}.py").read_text("utf-8"))
        froms = [
            node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.module not in own
        ]
        names = {f"{node.module}.{each.name}" for node in froms for each in node.names}
        assert {each for each in names if each.startswith("kinetile")} <= allowed


def test_command_lists_contacts() -> None:
    done = kinetile("oracle", str(SCENES / "H12.toml"), code=0)
    assert done.stdout.count("same time") == 5
    assert "6 contacts certified" in done.stdout
    found = printed("oracle", SCENES / "H13.toml", "--max-contacts", "1")["oracle"]
    assert found["ended"] == "going on"
    (contact,) = found["contacts"]
    assert contact["time"].startswith("0.783493649053890338309")
    assert (contact["a"], contact["b"], contact["nearest"]) == (0, 1, 0.7834936490538903)


@pytest.mark.compiled
def test_command_fails_where_a_run_departs_or_it_cannot_decide() -> None:
    departs = kinetile(
        "oracle", "grid", "-s", "bodies=16", "-s", "density=0.01", "--until", "20", "--against", "naive"
    )
    assert departs.exit_code == 1
    assert "the run has" in departs.stdout
    assert "the oracle" in departs.stdout
    undecided = kinetile("oracle lattice -s bodies=9 -s seed=11 --until 3", code=1)
    assert "14 contacts certified" in undecided.stdout
    assert "not decidable" in undecided.stderr


def test_command_keeps_what_was_certified_at_an_interruption(monkeypatch: pytest.MonkeyPatch) -> None:
    def pressed(self: Any, share: float | None, text: str) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(cli.Bar, "show", pressed)
    done = kinetile("oracle grid -s bodies=16 --until 1", code=130)
    assert "16 contacts certified" in done.stdout
    assert "complete up to the last of them" in done.stdout
