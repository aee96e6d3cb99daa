"""Words of other programs, in the place of a key or an argument: each is answered with what is written here,
or with the reason why it is not modelled."""

from __future__ import annotations

import pytest

import kinetile as kt
from command_line import refused
from kinetile.errors import BadOption, SceneError, UnknownName
from kinetile.scene.by_name import parse_parameters
from kinetile.scene.files import loads_scene

SENTENCES = {
    "acceleration": "write gravity = [gx, gy]",
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


def test_a_shape_of_another_name_is_answered():
    for word, name in {"circle": "disc", "rectangle": "box", "line": "segment"}.items():
        with pytest.raises(SceneError, match=f"for '{word}' write {name}"):
            loads_scene(f'[[shapes]]\nkind = "{word}"\n[[bodies]]\nposition = [0, 0]\nshape = 0')


def test_a_name_that_is_nearer_comes_first():
    assert "did you mean 'speed'?" in refused("run grid -s sped=2")
    assert "'force' is not modelled" in refused("run grid -s force=2")
    with pytest.raises(TypeError, match=r"has no argument 'raduis'; .*did you mean 'radius'"):
        kt.Scene([[0.0, 0.0]], [[0.0, 0.0]], raduis=1.0)


SCENE = kt.Scene([(1.0, 1.0)], [(1.0, 0.0)], 0.25, arena=(4.0, 4.0))
STEPS = "each event has its exact time, and there are no steps; run(until=sim.time + dt) runs for dt"
MOVED = "write instead: sim.remove(body), then sim.insert(position, velocity, radius)"
NUMBER = "is a whole number of {}, at least {}; found 2.5"
CALLS = {
    "step(0.1)": f"takes no arguments by position; found 0.1 as well: {STEPS}",
    "steps(1.0, 2)": "takes 1 argument by position; found 2 as well",
    "run(1.0, 5)": "takes 1 argument by position; found 5 as well, expected max_contacts=5",
    "run(dt=0.1)": f"'dt' is not modelled: {STEPS}",
    "run(duration=1.0)": "for 'duration' write until",
    "set_position(0, (2.0, 2.0))": MOVED,
    "set_mass(0, 2.0)": MOVED,
    "add((2.0, 2.0))": "write instead: sim.insert(",
    "bodys": "did you mean 'bodies'?",
    "scene.positions": "did you mean 'position'?",
    "scene.n": "write instead: len(scene)",
    "run(max_contacts=2.5)": NUMBER.format("contacts", 0),
    "run(max_events=2.5)": NUMBER.format("events", 0),
    "contacts_since(2.5)": NUMBER.format("contacts", 0),
    "bodies_near((1.0, 1.0), k=2.5)": NUMBER.format("bodies", 0),
    "__class__(sim.scene, audit=2.5)": NUMBER.format("contacts", 1),
    "__class__(sim.scene, room=2.5)": NUMBER.format("bodies", 0),
    "__class__(sim.scene, 'naive', ['disc'])": "found ['disc'] as well, expected narrow_phases=['disc']",
    "__class__(sim.scene, 'sap-1d', axis='y')": "an option of a phase is in options={'axis': ...}",
    "__class__(sim.scene, 'sap-1d', options={'sap-1d': {'axis': 'y'}})": "expected axis, without a table",
    "__class__(sim.scene, 'sap-1d', options='axis=y')": "expected a table of them, such as {'axis': 'y'}",
    "run(1.0, stop_at=kt.StopAt(kinds='ball'))": "no kind of this scene, which has none: kind=[...]",
    "run(1.0, observe=['pressure', 'after=5'])": "expected a name, and options behind a colon",
    "run(1.0, stop_at=kt.StopAt(body=0))": "StopAt has no argument 'body'; expected one of bodies, pairs",
    "__class__(kt.Turn(0, tiem=1.0, velocity=(1, 1)))": "Turn has no argument 'tiem'; expected one of",
    "__class__(kt.Remove(time=1.0))": "Remove needs body; expected (body, time, at)",
    "scene.replace(commands=[kt.Insert(0, (2, 2), (0, 0), shape=0)])": "shapes=[...] or [[shapes]]",
    "scene.replace(settings=kt.Settings('sap-1d:axis=y'))": "the name alone, 'sap-1d'",
    "scene.replace(settings=kt.Settings(options={'axis': 'y'}))": "such as {'sap-1d': {'axis': 'y'}}",
}


@pytest.mark.parametrize("call", CALLS)
def test_a_call_that_people_try_first_was_answered_in_words_of_python(call):
    with pytest.raises((AttributeError, TypeError, ValueError, LookupError)) as error:
        eval(f"sim.{call}", {"kt": kt, "sim": kt.Simulation(SCENE, "naive")})
    assert CALLS[call] in str(error.value)


def test_the_package_had_no_word_for_what_other_packages_call_load():
    for name, hint in {"load": "kinetile.load_scene", "World": "Simulation", "Simulaton": "mean"}.items():
        with pytest.raises(AttributeError, match=f"no attribute '{name}'; .*{hint}"):
            getattr(kt, name)
    with pytest.raises(UnknownName, match="load_scene"):
        kt.make_scene("mine.toml")


def test_an_attribute_error_of_a_property_stays_what_it_was(monkeypatch):
    monkeypatch.setattr(kt.Simulation, "readings", property(lambda sim: sim.scene.nothing_like_it))
    with pytest.raises(AttributeError, match=r"'Scene' object has no attribute 'nothing_like_it'$"):
        kt.Simulation(SCENE, "naive").readings  # noqa: B018
    assert not hasattr(SCENE, "__array__")


def test_a_name_with_options_was_read_on_the_command_line_alone(tmp_path):
    sim = kt.Simulation(SCENE, "sap-1d:axis=y", narrow_phases=["disc:general=true", "wall"])
    assert (sim.broad_phase, sim.options, sim.narrow_phases) == ("sap-1d", {"axis": "y"}, ("disc", "wall"))
    assert kt.Simulation(SCENE, "sap-1d:axis=y", options={"axis": "x"}).options == {"axis": "x"}
    sim.save(tmp_path / "run")
    assert kt.resume(tmp_path / "run", "sap-1d:axis=x").options == {"axis": "x"}
    with pytest.raises(BadOption, match="expected key=value"):
        kt.Simulation(SCENE, "sap-1d:axis")


SAP = 'broad-phase = "sap-1d"\n'
OPTIONS = "{}: found options of a phase; expected them in the table [options.sap-1d]"
FILES = {
    f"{BODY}arena = [4, 4]": "bodies[0].arena: found a key that is not known here; expected it before the "
    "first [[bodies]]: what stands below a header belongs to its table",
    f"{BODY}options = {{ sap-1d = {{ axis = 'y' }} }}": "it before the first [[bodies]]",
    f"{BODY}[[commands]]\ntime = 1\nremove = 0\nuntil = 3": "it before the first [[commands]]",
    f"{BODY}[[bodies.turns]]\ntime = 1\nvelocity = [1, 1]\nmass = 3": "it before the first [[bodies.turns]]",
    f"{BODY}[[commands]]\ntime = 1\nposition = [1, 1]": "expected it in insert = { ... }",
    BODY + COMMAND.format("time"): "expected it beside insert, not within",
    f"mass = 2\n{BODY}": "expected it in [[bodies]]",
    f"options = {{ axis = 'y' }}\n{SAP}{BODY}": "it in a table of the phase, [options.sap-1d]",
    f"axis = 'y'\n{SAP}{BODY}": OPTIONS.format("axis"),
    f"{SAP}[sap-1d]\naxis = 'y'\n{BODY}": OPTIONS.format("sap-1d"),
    f"{SAP}[options.broad-phase]\naxis = 'y'\n{BODY}": "power, disc, convex, wall; here [options.sap-1d]",
    f"{SAP}[options.sap-1d.options]\naxis = 'y'\n{BODY}": "expected axis, without a table around",
    f"broad-phase = {{ name = 'sap-1d' }}\n{BODY}": "options are in [options.NAME]",
    f"broad-phase = 'sap-1d:axis=y'\n{BODY}": "belongs in the table options.sap-1d",
    f"narrow-phases = ['disc:general=true']\n{BODY}": "belongs in the table options.disc",
    "recipe = 'grid:seed=3'": "belongs in the table parameters",
    "recipe = 'grid'\n[parameters.grid]\nseed = 3": "gravity, without a table around",
    f"{BODY}[[responses]]\nbetween = ['*', '*']\nresponse = 'restitution'\ne = 0.5": "options = { e = ... }",
    f"{BODY}[[commands]]\ntime = 1\ninsert = {{ position = [9, 9], shape = 0 }}": "list of shapes to count",
}


@pytest.mark.parametrize("text", FILES)
def test_a_key_in_the_wrong_table_was_only_said_to_be_unknown(text):
    with pytest.raises(SceneError) as error:
        loads_scene(text)
    said = str(error.value)
    assert FILES[text] in said
    assert said.count("\n") == 1 + said.count("found none of them")


def test_a_file_or_an_option_in_the_place_of_a_name_is_answered():
    sayings = {
        "study mine.toml": "expected kinetile study run mine.toml",
        "mine.toml": "expected kinetile run mine.toml",
        "run grid --observe pressure,after=5": "expected a colon before it, pressure:after=5",
        "run grid --observe presure": "did you mean 'pressure'?",
    }
    for command, said in sayings.items():
        assert said in " ".join(refused(command).split())


def test_an_error_within_a_call_stays_what_it_was():
    with pytest.raises(TypeError, match="Scene needs position and velocity; expected"):
        kt.Scene()
    with pytest.raises(TypeError, match="needs the radius"):
        kt.Simulation(kt.make_scene("two-discs"), "naive").insert((9.0, 9.0))
