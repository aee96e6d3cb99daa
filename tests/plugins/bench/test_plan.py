"""What a study file may say, what its tasks are, and what its mistakes are."""

from __future__ import annotations

import re

import hypothesis.strategies as hypothesis
import pytest
from hypothesis import given, settings

from kinetile import make_scene
from kinetile.errors import BadOption, KinetileError, StudyError, UnknownName
from kinetile.scene.by_name import Parameter, holds_several
from kinetile_bench import Study
from kinetile_bench.plan import SceneTable, StudyTable, read_plan, values_of
from kinetile_bench.task import tasks_of

GRID = {"recipe": "grid", "parameters": {"bodies": [9, 25]}}


SCALAR = hypothesis.one_of(
    hypothesis.none(),
    hypothesis.booleans(),
    hypothesis.integers(),
    hypothesis.floats(),
    hypothesis.text(max_size=5),
    hypothesis.sampled_from(["naive", "grid", "bodies", "a\0b", "log", 10**400, 1e-320, 1e308]),
)
KEYS = hypothesis.one_of(
    hypothesis.sampled_from(["from", "to", "step", "count", "scale", "name"]), hypothesis.text(max_size=3)
)
TABLE = hypothesis.recursive(
    SCALAR,
    lambda each: hypothesis.one_of(
        hypothesis.lists(each, max_size=3), hypothesis.dictionaries(KEYS, each, max_size=4)
    ),
    max_leaves=6,
)
"""Whatever may stand behind a key of a TOML file."""


def tables(**more):
    return {"phases": ["naive"], "contacts": 5, "scenes": [GRID], **more}


def mistakes(**more):
    with pytest.raises(StudyError) as caught:
        read_plan(tables(**more))
    return [str(mistake) for mistake in caught.value.mistakes]


def test_lists_are_combined_phase_by_phase_and_seed_by_seed():
    plan = read_plan(tables(phases=["naive", "sap-1d:axis=y"], seeds=[3, 1], repeats=2))
    tasks = list(tasks_of(plan))
    assert plan.size == len(tasks) == 16
    assert len({task.key for task in tasks}) == 16
    assert len({task.course for task in tasks}) == 4
    first = tasks[0]
    assert first.parameters == {"bodies": 9, "density": 0.5, "seed": 3, "speed": 1.0, "temperature": 0.0}
    assert [task.phase for task in tasks[:4]] == ["naive", "sap-1d:axis=y", "sap-1d:axis=y", "naive"]
    assert tasks[2].options == {"axis": "y"}


def test_lists_that_go_together_are_gone_through_side_by_side():
    scene = {
        "recipe": "grid",
        "parameters": {"bodies": [9, 25], "density": [0.5, 0.1], "speed": [1, 2]},
        "together": [["bodies", "density"]],
    }
    (scenes,) = read_plan(tables(scenes=[scene])).scenes
    found = [(each["bodies"], each["density"], each["speed"]) for each in scenes.combinations]
    assert found == [(9, 0.5, 1.0), (9, 0.5, 2.0), (25, 0.1, 1.0), (25, 0.1, 2.0)]


def test_several_numbers_are_one_value_and_in_rows_a_text():
    parameters = {"radii": [[1, 2], "1, 3"], "counts": "4, 5", "bodies": 9}
    (scenes,) = read_plan(tables(scenes=[{"recipe": "mixture", "parameters": parameters}])).scenes
    found = [(each["radii"], each["counts"], each["masses"]) for each in scenes.combinations]
    assert found == [("1.0, 2.0", "4, 5", ""), ("1.0, 3.0", "4, 5", "")]
    assert make_scene("mixture", **scenes.combinations[0]) == make_scene(
        "mixture", radii=(1.0, 2.0), counts=(4, 5), bodies=9
    )


@pytest.mark.parametrize("key", ["radii", "fractions", "counts", "masses"])
@pytest.mark.parametrize("value", [[0.5, 0.7], [1], ["1, 3", 2], [[1, 3], 2], [True, False]])
def test_a_flat_list_for_a_parameter_that_is_a_list_ran_several_scenes_of_one_number_each(key, value):
    said = mistakes(scenes=[{"recipe": "mixture", "parameters": {key: value}}])
    assert [line.partition(": found ")[0] for line in said] == [f"scenes[0].parameters.{key}"]
    assert "one list for a parameter whose value is a list itself; expected a list of lists" in said[0]


@pytest.mark.parametrize("value", [{"from": 0.5, "to": 1.5}, 0.5, "0.5, 0.7", [[0.5, 0.7]], ["0.5", "0.7"]])
def test_a_range_texts_and_lists_of_lists_are_values_of_a_parameter_that_is_a_list(value):
    assert read_plan(tables(scenes=[{"recipe": "mixture", "parameters": {"radii": value}}])).size in (1, 2)


@pytest.mark.parametrize(
    ("written", "several"),
    [
        (tuple[float, ...], True),
        (list, True),
        ("Sequence[int]", True),
        ("npt.NDArray[np.float64] | None", True),
        (int, False),
        ("Listed", False),
    ],
)
def test_annotations_say_whether_a_value_is_a_list(written, several):
    name = written.__name__ if isinstance(written, type) else str(written)
    assert holds_several(Parameter("one", name, None)) is several


@pytest.mark.parametrize(
    ("given", "values"),
    [
        ({"from": 1, "to": 4}, [1, 2, 3, 4]),
        ({"from": 10, "to": 45, "step": 10}, [10, 20, 30, 40]),
        ({"from": 0.1, "to": 0.5, "step": 0.1}, [0.1, 0.2, 0.3, 0.4, 0.5]),
        ({"from": 0, "to": 1, "count": 3}, [0, 0.5, 1]),
        ({"from": 1, "to": 1000, "count": 4, "scale": "log"}, [1, 10, 100, 1000]),
        (7, [7]),
    ],
)
def test_a_range_has_the_numbers_that_it_says(given, values):
    found = []
    assert values_of(given, "here", found, whole=True) == values
    assert found == []


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"from": 1}, "here.to: found nothing"),
        ({"from": 3, "to": 1}, "here: found from 3 to 1"),
        ({"from": 0, "to": 1, "scale": "log", "count": 3}, "both above 0"),
        ({"from": 1, "to": 2, "step": 0}, "here.step: found 0"),
        ({"from": 1, "to": 2, "step": 1e-9}, "at most 100,000 steps"),
        ({"from": 1, "to": 2, "step": 1, "count": 2}, "step beside count"),
        ({"from": 1, "to": 2, "scale": "log"}, "here.count: found nothing"),
        ({"from": 1, "to": 2, "count": 1}, "here.count: found 1"),
        ({"from": "1", "to": 2}, "here.from: found '1'"),
        ([], "an empty list"),
        ([1, 1], "a value that is there twice"),
    ],
)
def test_a_range_that_is_none_is_told(given, said):
    found = []
    values_of(given, "here", found)
    assert said in " ".join(map(str, found))


def test_all_mistakes_are_told_at_once_with_where_they_stand():
    said = mistakes(
        phases=["naiv", "sap-1d:axis=q", "naive", "naive"],
        seeds={"from": 1, "to": 3, "stp": 1},
        measure=["timing"],
        repeats=0,
        more=1,
        scenes=[
            {"recipe": "gird"},
            {"recipe": "grid", "parameters": {"densty": 1, "bodies": ["x"]}, "together": [["speed"]]},
        ],
        figures=[{"name": "a/b"}, {"name": "c", "kind": "pie"}],
    )
    places = [each.partition(": found")[0] for each in said]
    assert places == [
        "repeats",
        "figures[1].kind",
        "more",
        "phases[0]",
        "phases[1]: options.sap-1d",
        "phases[3]",
        "measure[0]",
        "seeds.stp",
        "scenes[0].recipe",
        "scenes[1].parameters.densty",
        "scenes[1].parameters.bodies",
        "scenes[1].together[0]",
        "figures[0].name",
    ]


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"contacts": None}, "scenes[0].until: found nothing; expected until or contacts"),
        ({"measure": ["pairs"]}, "pairs are counted at moments up to it"),
        ({"seeds": [1], "scenes": [{"recipe": "cradle"}]}, "a recipe with a parameter 'seed'"),
        ({"seeds": [1.5]}, "seeds: found 1.5"),
        (
            {"observe": ["presure"]},
            "an observable (no observable is called 'presure'; did you mean 'pressure'?; available: pre",
        ),
        ({"observe": ["msd:lags=0"]}, "observe[0]: found 'msd:lags=0'; expected an observable (lags is 0"),
        ({"observe": ["msd", "msd"]}, "observe[1]: found 'msd', which is there already"),
        (
            {"observe": ["msd"], "measure": ["pairs"], "until": 1.0},
            "observe: found observables beside the measure pairs; expected one of the two",
        ),
        ({"seeds": [1], "scenes": [{"recipe": "grid", "parameters": {"seed": 1}}]}, "a seed beside seeds"),
        ({"until": float("nan")}, "until: found nan"),
        ({"scenes": []}, "scenes: found []"),
    ],
)
def test_what_makes_no_sense_is_a_mistake(more, said):
    given = {key: value for key, value in tables(**more).items() if value is not None}
    with pytest.raises(StudyError) as caught:
        read_plan(given)
    assert said in str(caught.value)


def test_every_part_of_a_task_is_in_its_key_and_only_what_decides_the_contacts_in_its_course():
    def task(**more):
        return next(tasks_of(read_plan(tables(**more))))

    base = task()
    assert task() == base
    others = [
        task(phases=["cells"]),
        task(phases=["sap-1d"]),
        task(phases=["sap-1d:axis=y"]),
        task(measure=["certified"]),
        task(measure=["timings"]),
        task(measure=["timings"], seconds=1),
    ]
    assert {each.course for each in others} == {base.course}
    scenes = [task(contacts=6), task(until=1.0), task(seeds=[9]), task(scenes=[{"recipe": "cradle"}])]
    assert len({each.course for each in [base, *scenes]}) == 5
    assert len({each.key for each in [base, *others, *scenes]}) == 11


def test_a_file_is_read_and_its_results_lie_beside_it(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('phases = ["naive"]\ncontacts = 5\nscenes = [{ recipe = "cradle" }]\n')
    assert Study(path).results == tmp_path / "mine.results"
    assert Study(path, tmp_path / "else").results == tmp_path / "else"
    path.write_text('results = "there"\n' + path.read_text())
    assert Study(str(path)).results == tmp_path / "there"
    path.write_text("phases = [")
    with pytest.raises(StudyError, match="line 1"):
        Study(path)
    path.write_bytes(b"\xff")
    with pytest.raises(StudyError, match="UTF-8"):
        Study(path)


def test_the_studies_that_ship_can_be_read_by_name(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    study = Study("thesis")
    assert len(study.tasks) == 4 * 6 * 12 * 5
    assert str(study.results) == "thesis.results"
    with pytest.raises(UnknownName, match="thesis"):
        Study("thesi")


NESTED = ([], ["naive"], [["x"]], {}, 1, None, True, 1.5)


@pytest.mark.parametrize("entry", NESTED, ids=str)
@pytest.mark.parametrize("key", ["phases", "measure", "figures", "scenes"])
def test_a_list_with_an_entry_of_another_type_is_a_mistake_and_no_traceback(key, entry):
    (said,) = mistakes(**{key: [entry]})
    assert said.startswith(f"{key}: found [" if key in ("phases", "measure") else f"{key}[0]")


@pytest.mark.parametrize("name", ["a\0b", "a\x1b[31mb", "a\nb", "", "a/b\0"])
def test_a_name_of_a_file_has_no_control_characters(name):
    figure = f"figures[0].name: found {name!r}; expected a name for a file"
    assert mistakes(figures=[{"name": name}])[0].startswith(figure)
    assert mistakes(results=name) == [f"results: found {name!r}; expected the name of a folder"]
    with pytest.raises((BadOption, UnknownName)) as caught:
        Study(f"{name}.toml" if "\0" in name else name or "\0")
    assert name.encode("unicode_escape").decode() in str(caught.value)


def test_more_tasks_than_a_study_holds_in_memory_are_refused_with_their_number():
    assert mistakes(repeats=100_001) == ["scenes: found 200,002 tasks in all; expected at most 200,000"]
    assert mistakes(repeats=1_000_000) == ["scenes: found 2,000,000 tasks in all; expected at most 200,000"]
    wide = {"recipe": "grid", "parameters": {"bodies": {"from": 1, "to": 1000}, "seed": list(range(1000))}}
    assert "1,000,000 scenes; expected at most 200,000" in mistakes(scenes=[wide])[0]


@settings(max_examples=150, deadline=None)
@given(
    hypothesis.dictionaries(
        hypothesis.sampled_from([*StudyTable.model_fields, "recipe", "a\0b"]), TABLE, max_size=4
    ),
    hypothesis.dictionaries(
        hypothesis.sampled_from([*SceneTable.model_fields, "a\x1b[2J"]), TABLE, max_size=3
    ),
)
def test_whatever_stands_in_a_file_its_mistakes_are_sentences_without_control_characters(file, scene):
    given = tables(scenes=[GRID | scene]) | file
    said = ""
    try:
        list(zip(range(100), tasks_of(read_plan(given)), strict=False))
    except KinetileError as error:
        said = str(error)
    assert not re.search(r"[\x00-\x09\x0b-\x1f\x7f]", said)
