"""Words of other programs, in the place of a key or an argument: each gets the words written here,
or with the reason why it is not modelled."""

import pytest

import kinetile as kt
from kinetile.errors import BadOption, SceneError
from kinetile.scene.by_name import parse_parameters
from kinetile.scene.files import loads_scene
from lanes import SHARED

SENTENCES = {
    "force": "is not modelled: bodies are moved by gravity, contacts and commands alone",
    "angle rotation angular_velocity torque": "is not modelled: bodies do not rotate",
    "friction": "is not modelled: contacts act along their normal alone",
    "drag damping": "is not modelled: bodies keep their velocity",
    "joint spring": "is not modelled: bodies act on each other by contacts alone",
    "dt time_step": "is not modelled: each event has its exact time",
    "static fixed": "write mass = inf",
    "diameter": "write radius = half of it",
    "size": "write radius = half of it, or a shape with width and height",
    "bounce bounciness elasticity restitution": "write responses: for two kinds restitution",
    "rho": "write mass = density times area",
    "centre x": "write position = [x, y]",
    "direction vx": "write velocity = [vx, vy]",
    "sensor": "write responses: for two kinds pass",
    "layer": "write kind",
    "walls": "write arena = [width, height]",
    "pbc": 'write periodic = "x", "y" or "xy"',
}
BODY = "[[bodies]]\nposition = [0, 0]\nradius = 1\n"
COMMAND = "[[commands]]\ntime = 1\ninsert = {{ position = [9, 9], radius = 1, {} = 1 }}"


POINT = ([[0.0, 0.0]], [[0.0, 0.0]], 1.0)
ENTRANCES = {
    "body": lambda word: loads_scene(f"{BODY}{word} = 1"),
    "file": lambda word: loads_scene(f"{word} = 1\n{BODY}"),
    "shape": lambda word: loads_scene(f'[[shapes]]\nkind = "disc"\nradius = 1\n{word} = 1\n{BODY}'),
    "command": lambda word: loads_scene(BODY + COMMAND.format(word)),
    "recipe of a file": lambda word: loads_scene(f'recipe = "two-discs"\nparameters = {{ {word} = 1 }}'),
    "make_scene": lambda word: kt.make_scene("two-discs", **{word: 1}),
    "-s": lambda word: parse_parameters("two-discs", [f"{word}=1"]),
    "Scene": lambda word: kt.Scene(*POINT, **{word: 1}),
    "replace": lambda word: kt.Scene(*POINT).replace(**{word: 1}),
    "Simulation": lambda word: kt.Simulation(kt.Scene(*POINT), "naive", **{word: 1}),
    "insert": lambda word: kt.Simulation(kt.Scene(*POINT), "naive").insert((9.0, 9.0), **{word: 1}),
}


@pytest.mark.parametrize("entrance", ENTRANCES)
def test_a_word_of_other_programs_is_answered(entrance):
    for words, sentence in SENTENCES.items():
        for word in words.split():
            with pytest.raises((SceneError, BadOption)) as error:
                ENTRANCES[entrance](word)
            said = str(error.value)
            assert sentence in said.replace(" in a scene", ""), (word, said)
            assert repr(word) in said


def test_the_key_that_was_meant_is_not_missing_as_well():
    with pytest.raises(SceneError) as said:
        loads_scene("[[bodies]]\ncentre = [0, 0]\ndiameter = 2")
    assert [each.where for each in said.value.mistakes] == ["bodies[0].centre", "bodies[0].diameter"]


SCENE = kt.Scene([(1.0, 1.0)], [(1.0, 0.0)], 0.25, arena=(4.0, 4.0))


def test_an_attribute_error_of_a_property_stays_what_it_was(monkeypatch):
    monkeypatch.setattr(kt.Simulation, "readings", property(lambda sim: sim.scene.nothing_like_it))
    with pytest.raises(AttributeError, match=r"'Scene' object has no attribute 'nothing_like_it'$"):
        kt.Simulation(SCENE, "naive").readings  # noqa: B018
    assert not hasattr(SCENE, "__array__")


def test_a_name_with_options_was_read_on_the_command_line_alone(tmp_path):
    sim = kt.Simulation(SCENE, "sap-1d:axis=y", narrow_phases=SHARED)
    assert (sim.broad_phase, sim.options, sim.narrow_phases) == ("sap-1d", {"axis": "y"}, ("disc", "wall"))
    assert kt.Simulation(SCENE, "sap-1d:axis=y", options={"axis": "x"}).options == {"axis": "x"}
    sim.save(tmp_path / "run")
    assert kt.resume(tmp_path / "run", "sap-1d:axis=x").options == {"axis": "x"}
