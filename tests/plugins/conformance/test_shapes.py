"""The kit on bodies of other shapes: phases for them, right or wrong in one way."""

import pytest

import kinetile as kt
from kinetile.errors import Refused
from kinetile.toolbox import Kernel, PairParts, hook
from kinetile_conformance import check_broad_phase
from kinetile_conformance.strategies.shapes import DRAWS
from kinetile_plugins.convex import Convex, meet, soonest, touch
from kinetile_plugins.disc import exchange
from lanes import first
from registering import fixture, registered

OF_SHAPES = "same-contacts-of-shapes"
PLANS_ALONE = "a-contact-depends-on-two-plans-alone-of-shapes"
AS_CONVEX = "same-contacts-as-convex"


@hook
def collide_across(k: Kernel, a: int, b: int) -> float:
    """Wrong: the components of the normal are exchanged."""
    nx, ny, depth = touch(k, a, b)
    exchange(k, a, b, ny, nx, 1.0)
    return float(depth)


@hook
def meet_in_order(k: Kernel, a: int, b: int) -> int:
    """Wrong: a tick more where the left one of the two has the higher number."""
    tick = int(meet(k, a, b))
    return tick + 1 if tick < 1 << 62 and k.bodies[b].x < k.bodies[a].x else tick


@hook
def soonest_late(k: Kernel, body: int, count: int, barred: int, at: int) -> tuple[float, float, int]:
    """Wrong: bounds that are late."""
    first, second, who = soonest(k, body, count, barred, at)
    return 1.5 * first, 1.5 * second, who


class WrongConvex(Convex):
    def __init__(self, fault: str = "") -> None:
        self.fault = fault

    def prepare(self, scene: kt.Scene) -> PairParts:
        parts = super().prepare(scene)
        numbers = parts.numbers
        if self.fault == "a corner ignored":
            shapes = [kt.Shape(each.core[: max(3, len(each.core) - 1)], each.radius) for each in scene.shapes]
            numbers = super().prepare(scene.replace(shapes=shapes)).numbers
        return PairParts(
            meet_in_order if self.fault == "order" else meet,
            collide_across if self.fault == "the normal turned" else parts.collide,
            soonest_late if self.fault == "late bounds" else parts.soonest,
            shapes=True,
            numbers=numbers,
        )


KINDS = ("disc", "capsule", "box", "polygon", "segment")


_added = fixture(kt.NarrowPhaseSpec("wrong-convex", WrongConvex, role="pair", shapes=KINDS))


def drawn(squares: bool) -> list[kt.Scene]:
    draw = DRAWS["shapes, and squares alone" if squares else "shapes"]
    return [scene for seed in range(1 if squares else 2) for scene in draw(60, seed)]


@pytest.mark.slow
def test_what_is_drawn():
    """Walls that touch, gratings, sizes a thousand apart, turns; and one form of loop where it should be."""
    scenes = drawn(False)
    kinds = {scene.shapes[each].kind for scene in scenes for each in scene.shape}
    assert kinds == {"box", "capsule", "disc", "polygon", "segment"}
    assert all(scene.shapes[scene.shape[0]].kind == "capsule" for scene in scenes)
    assert all(scene.mass[0] < scene.mass.max() for scene in scenes)
    assert max(scene.radius.max() / scene.radius.min() for scene in scenes) > 800.0
    assert any(scene.commands for scene in scenes)
    assert {scene.arena is None for scene in scenes} == {True, False}
    squares = [each for each in drawn(True) if {shape.kind for shape in each.shapes} == {"box"}]
    assert len(squares) > 5


@pytest.mark.interpreted
def test_a_phase_and_a_narrow_phase_for_discs_say_that_they_take_no_shapes():
    chosen = {"examples": 24, "in_process": True}
    (result,) = check_broad_phase("power", checks=[OF_SHAPES], **chosen).results
    assert result.status == "skipped"
    assert result.reason.startswith("it refuses all scenes of this check: power ")
    (result,) = check_broad_phase("naive", narrow_phases=["disc"], checks=[AS_CONVEX], **chosen).results
    assert result.status == "skipped"
    assert "'disc' of kinetile:builtin (kinetile 0.1.0) does not take " in result.reason


@pytest.mark.interpreted
@pytest.mark.parametrize(
    ("fault", "check"),
    [
        ("the normal turned", AS_CONVEX),
        ("order", PLANS_ALONE),
        pytest.param("a corner ignored", AS_CONVEX, marks=pytest.mark.slow),
        pytest.param("late bounds", AS_CONVEX, marks=pytest.mark.slow),
    ],
)
def test_a_wrong_narrow_phase_of_shapes_is_found(fault, check):
    chosen = {"checks": [check], "examples": 40, "in_process": True, "shrink": False}
    (result,) = check_broad_phase("naive", narrow_phases={"wrong-convex": {"fault": fault}}, **chosen).results
    assert result.status == "failed"
    assert (
        result.verdict.endswith("suspect the narrow phase, wrong-convex:fault=" + fault) or not result.verdict
    )


@pytest.mark.interpreted
@pytest.mark.parametrize("check", first(1, [PLANS_ALONE, AS_CONVEX]))
def test_a_narrow_phase_of_shapes_without_a_fault_passes(check):
    chosen = {"checks": [check], "examples": 4, "in_process": True}
    (result,) = check_broad_phase("naive", narrow_phases=["wrong-convex"], **chosen).results
    assert result.status == "passed", result.said


@pytest.mark.small
def test_a_narrow_phase_of_shapes_alone_can_be_judged():
    """A scene of discs says nothing of it."""
    checks = ["same-contacts", "its-structure-is-true", AS_CONVEX]
    report = check_broad_phase("naive", narrow_phases=["convex"], checks=checks, examples=2, in_process=True)
    assert [result.status for result in report.results] == ["skipped", "skipped", "passed"]
    assert "this one has discs alone" in report.results[0].reason


class OfNothing:
    def prepare(self, scene: kt.Scene) -> PairParts:
        raise Refused("for no scene at all")


def test_a_narrow_phase_that_refuses_all_cannot_be_judged():
    with (
        registered(kt.NarrowPhaseSpec("nothing", OfNothing, role="pair")),
        pytest.raises(Refused, match="no scene"),
    ):
        check_broad_phase("naive", narrow_phases=["nothing"], in_process=True)
