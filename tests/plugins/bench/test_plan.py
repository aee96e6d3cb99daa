"""What a study file may say, what its tasks are, and what its mistakes are."""

import re

import hypothesis.strategies as hypothesis
import pytest
from hypothesis import given, settings

from kinetile import make_scene
from kinetile.errors import BadOption, KinetileError, StudyError
from kinetile.plugin.parameters import Parameter
from kinetile.scene.by_name import holds_several
from kinetile_bench import Study
from kinetile_bench.study.plan import SCENE_KEYS, STUDY_KEYS, read_plan
from kinetile_bench.study.task import tasks_of

GRID = {"recipe": "grid", "parameters": {"bodies": [9, 25]}}
WIDE = {"recipe": "grid", "parameters": {"bodies": range(1, 1001), "seed": range(1000)}}

SCALAR = hypothesis.one_of(
    hypothesis.none(),
    hypothesis.booleans(),
    hypothesis.integers(),
    hypothesis.floats(),
    hypothesis.text(max_size=5),
    hypothesis.sampled_from(["naive", "grid", "bodies", "a\0b", 10**400, 1e-320, 1e308]),
)
TABLE = hypothesis.recursive(
    SCALAR,
    lambda each: hypothesis.one_of(
        hypothesis.lists(each, max_size=3),
        hypothesis.dictionaries(hypothesis.text(max_size=3), each, max_size=4),
    ),
    max_leaves=6,
)
"""Whatever may stand behind a key of a TOML file."""


def tables(**more):
    return {"phases": ["naive"], "contacts": 5, "scenes": [GRID], **more}


def mistakes(**more):
    with pytest.raises(StudyError) as caught:
        read_plan({key: value for key, value in tables(**more).items() if value is not None})
    return [str(mistake) for mistake in caught.value.mistakes]


def test_lists_are_combined_phase_by_phase_and_seed_by_seed():
    tasks = list(tasks_of(read_plan(tables(phases=["naive", "sap-1d:axis=y"], seeds=[3, 1], repeats=2))))
    assert len({task.key for task in tasks}) == len(tasks) == 16
    assert len({task.course for task in tasks}) == 4
    first = tasks[0]
    assert first.scene.parameters == {
        "bodies": 9,
        "density": 0.5,
        "seed": 3,
        "speed": 1.0,
        "temperature": 0.0,
    }
    assert [task.phase for task in tasks[:4]] == ["naive", "sap-1d:axis=y", "sap-1d:axis=y", "naive"]


def test_a_number_of_seeds_means_the_seeds_from_1_on():
    plan = read_plan(tables(seeds=3))
    assert plan == read_plan(tables(seeds=[1, 2, 3]))
    assert [each.parameters["seed"] for each in plan.scenes] == [1, 2, 3, 1, 2, 3]


def test_several_numbers_are_one_value_and_in_rows_a_text():
    parameters = {"radii": [[1, 2], "1, 3"], "fractions": "4, 5", "bodies": 9}
    scenes = read_plan(tables(scenes=[{"recipe": "mixture", "parameters": parameters}])).scenes
    found = [tuple(each.parameters[key] for key in ("radii", "fractions", "masses")) for each in scenes]
    assert found == [("1.0, 2.0", "4.0, 5.0", ""), ("1.0, 3.0", "4.0, 5.0", "")]
    assert make_scene("mixture", **scenes[0].parameters) == make_scene(
        "mixture", radii=(1.0, 2.0), fractions=(4, 5), bodies=9
    )


def test_a_flat_list_for_a_list_parameter_ran_other_scenes():
    """A study of ``radii = [0.5, 0.7]`` had two scenes, each of discs of one size, and none of both."""
    for flat in ([0.5, 0.7], [0.5], [[0.5, 0.7], 0.5], ["1, 3", 2], [True, False]):
        (said,) = mistakes(scenes=[{"recipe": "mixture", "parameters": {"radii": flat}}])
        assert said.startswith(f"scenes[0].parameters.radii: found {flat}; expected a list of lists")
    whole = {"recipe": "mixture", "parameters": {"radii": [[0.5, 0.7]]}}
    (scene,) = read_plan(tables(scenes=[whole])).scenes
    assert scene.parameters["radii"] == "0.5, 0.7"
    assert holds_several(Parameter("of a foreign recipe", "npt.NDArray[np.float64] | None", None))


def test_all_mistakes_are_reported_at_once_with_their_places():
    said = mistakes(
        phases=["naiv", "sap-1d:axis=q", "sap-1d:axs=y", "naive", "naive"],
        seeds={"from": 1, "to": 3},
        repeats=0,
        more=1,
        scenes=[
            {"recipe": "gird"},
            {"recipe": "grid", "parameters": {"densty": 1, "bodies": ["x"]}, "file": "scene.toml"},
            {"recipe": "grid", "parameters": {"densty": 1, "bodies": ["x", 9, 9], "speed": []}, "untill": 2},
            [],
        ],
        results="",
    )
    places = [each.partition(": found")[0] for each in said]
    assert places == [
        "seeds",
        "repeats",
        "more",
        "results",
        "phases[0]",
        "phases[1]",
        "phases[2]",
        "phases[4]",
        "scenes[0].recipe",
        "scenes[1]",
        "scenes[2].untill",
        "scenes[2].parameters.densty",
        "scenes[2].parameters.bodies",
        "scenes[2].parameters.bodies",
        "scenes[2].parameters.speed",
        "scenes[3]",
    ]
    assert "did you mean 'naive'? available: naive, " in said[4]


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"phases": None}, "phases: found nothing; expected a list of broad phases"),
        ({"contacts": None}, "scenes[0].until: found nothing; expected until or contacts"),
        ({"contacts": 0}, "contacts: found 0; expected a whole number, at least 1"),
        ({"until": float("nan")}, "until: found nan; expected a finite number"),
        ({"seeds": [1.5]}, "seeds: found [1.5]"),
        ({"seeds": [1, 1]}, "seeds: found [1, 1]; expected how many seeds from 1 on, or a list"),
        ({"seeds": 1, "scenes": [{"recipe": "cradle"}]}, "seeds: found seeds; expected a recipe with a"),
        ({"seeds": 1, "scenes": [{"recipe": "grid", "parameters": {"seed": 1}}]}, "a seed beside seeds"),
        (
            {"observe": ["presure"]},
            "observe[0]: found 'presure'; expected a registered observable: no observable is",
        ),
        ({"observe": ["msd", "msd"]}, "observe[1]: found 'msd', which is there already; expected each once"),
        (
            {"phases": ["sap-1d:axis=y", "sap-1d: axis=y"]},
            "phases[1]: found 'sap-1d: axis=y', which is there",
        ),
        ({"scenes": []}, "scenes: found []; expected [[scenes]] tables"),
        ({"repeats": 100_001}, "scenes: found 200,002 tasks in all; expected at most 200,000"),
        ({"scenes": [WIDE]}, "scenes[0]: found 1,000,000 scenes; expected at most 200,000"),
    ],
)
def test_what_makes_no_sense_is_the_one_mistake(more, said):
    (found,) = mistakes(**more)
    assert said in found


@pytest.mark.parametrize(
    ("scene", "said"),
    [
        ({"file": "none.toml"}, "scenes[0].file: found 'none.toml', which cannot be read (No such file"),
        ({"file": "a\0b"}, "scenes[0].file: found 'a\\x00b'; expected the name of a scene file"),
        ({"file": "bad.toml"}, "scenes[0].file: arena: found 3"),
        ({"file": "bad.toml", "recipe": "grid"}, "scenes[0]: found a recipe and a file; expected one of the"),
        ({"file": "fit.toml", "parameters": {}}, "scenes[0].parameters: found parameters of a file"),
        ({}, "scenes[0]: found neither recipe nor file; expected one of the two"),
    ],
)
def test_a_scene_file_that_cannot_be_used_is_a_mistake_with_its_place(tmp_path, monkeypatch, scene, said):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bad.toml").write_text("arena = 3\nbodies = []\n")
    (tmp_path / "fit.toml").write_text("bodies = []\n")
    assert mistakes(scenes=[scene])[0].startswith(said)


def test_every_part_of_a_task_is_in_its_key_and_only_what_decides_the_contacts_in_its_course():
    def task(**more):
        return next(tasks_of(read_plan(tables(**more))))

    base = task()
    assert task() == base
    changed = (
        {"phases": ["cells"]},
        {"phases": ["sap-1d"]},
        {"phases": ["sap-1d:axis=y"]},
        {"observe": ["msd"]},
    )
    others = [task(**each) for each in changed]
    assert {each.course for each in others} == {base.course}
    scenes = [task(contacts=6), task(until=1.0), task(seeds=[9]), task(scenes=[{"recipe": "cradle"}])]
    assert len({each.course for each in [base, *scenes]}) == 5
    assert len({each.key for each in [base, *others, *scenes]}) == 9


def test_a_file_is_read_and_its_results_lie_beside_it(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('phases = ["naive"]\ncontacts = 5\nscenes = [{ recipe = "cradle" }]\n')
    assert Study(path).results == tmp_path / "mine.sqlite"
    assert Study(path, tmp_path / "else").results == tmp_path / "else"
    path.write_text('results = "there/rows"\n' + path.read_text())
    assert Study(str(path)).results == tmp_path / "there" / "rows"
    path.write_text("phases = [")
    with pytest.raises(StudyError, match="line 1"):
        Study(path)
    path.write_bytes(b"\xff")
    with pytest.raises(StudyError, match="UTF-8"):
        Study(path)
    with pytest.raises(BadOption, match="needs results"):
        Study(tables())


@settings(max_examples=40, deadline=None)
@given(
    hypothesis.dictionaries(hypothesis.sampled_from([*STUDY_KEYS, "recipe", "a\0b"]), TABLE, max_size=4),
    hypothesis.dictionaries(hypothesis.sampled_from([*SCENE_KEYS, "a\x1b[2J"]), TABLE, max_size=3),
)
def test_whatever_stands_in_a_file_its_mistakes_are_sentences_without_control_characters(file, scene):
    given = tables(scenes=[GRID | scene]) | file
    said = ""
    try:
        list(zip(range(100), tasks_of(read_plan(given)), strict=False))
    except KinetileError as error:
        said = str(error)
    assert not re.search(r"[\x00-\x09\x0b-\x1f\x7f]", said)
