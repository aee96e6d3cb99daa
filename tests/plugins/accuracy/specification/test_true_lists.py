"""The certifier finds nothing wrong in true lists: of recipes, and of all scenes of the conformance kit."""

import contextlib

import pytest

import kinetile as kt
from kinetile.errors import Refused, ZenoError
from kinetile_accuracy import certify_log
from kinetile_conformance.cases import horizon
from kinetile_conformance.drawing import Drawing
from kinetile_conformance.runner import CHECKS
from lanes import first

RECIPES = [*sorted({*kt.registry().names("scene")} - {"frame", "grown"}), "grown"]
"""The last takes 20 CPU seconds to make its scene."""

COMPARING = [each for each in CHECKS if each.strategy and each.name.startswith("same-contacts")]
FEWER = {"figure-10": 40, "figure-11": 40, "figure-16": 40, "grid": 40, "grown": 40, "mixture": 40}


def is_certified(scene: kt.Scene, until: float, most: int) -> bool:
    """Returns True if the list of a run is right, to its end where it comes before these contacts."""
    sim = kt.Simulation(scene, "naive")
    ran = False
    with contextlib.suppress(ZenoError, Refused):
        sim.run(until=until, max_contacts=most)
        ran = True
    is_whole = ran and len(sim.contacts) < most
    found = certify_log(scene, sim.contacts, until if is_whole else None, fingerprint=sim.fingerprint)
    return found.right


@pytest.mark.small
@pytest.mark.parametrize("name", first(len(RECIPES) - 1, RECIPES))
def test_lists_of_recipes_are_right(name):
    scene = kt.make_scene(name, **({"bodies": FEWER[name]} if name in FEWER else {}))
    assert is_certified(scene, scene.settings.until or scene.start + 20.0, 60)


@pytest.mark.small
@pytest.mark.parametrize("each", first(2, COMPARING), ids=lambda each: each.name)
@pytest.mark.parametrize("examples", first(1, [1, 40], many=0))
def test_lists_of_scenes_of_the_kit_are_right(each, examples):
    drawing = Drawing(examples, seed=examples)
    assert all(is_certified(scene, horizon(scene), 60) for scene in drawing.scenes(each))
