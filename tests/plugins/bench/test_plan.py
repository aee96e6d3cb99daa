"""What a study file may say, what its tasks are, and what its mistakes are."""

from pathlib import Path

from kinetile import make_scene
from kinetile.plugin.parameters import Parameter
from kinetile.scene.by_name import holds_several
from kinetile_bench import Study
from kinetile_bench.study.plan import read_plan
from kinetile_bench.study.task import tasks_of
from messages import table

GRID = {"recipe": "grid", "parameters": {"bodies": [9, 25]}}
WIDE = {"recipe": "grid", "parameters": {"bodies": range(1, 1001), "seed": range(1000)}}


def tables(**more):
    return {"phases": ["naive"], "contacts": 5, "scenes": [GRID], **more}


def planned(**more):
    Path("bad.toml").write_text("arena = 3\nbodies = []\n")
    Path("fit.toml").write_text("bodies = []\n")
    return read_plan({key: value for key, value in tables(**more).items() if value is not None})


def written(content):
    Path("study.toml").write_bytes(content)
    return Study("study.toml")


test_message = table(globals())


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
    """A study of ``radii = [0.5, 0.7]`` had two scenes, each of discs of one size, and none of both. It is
    refused now, for a list of lists."""
    whole = {"recipe": "mixture", "parameters": {"radii": [[0.5, 0.7]]}}
    (scene,) = read_plan(tables(scenes=[whole])).scenes
    assert scene.parameters["radii"] == "0.5, 0.7"
    assert holds_several(Parameter("of a foreign recipe", "npt.NDArray[np.float64] | None", None))


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
