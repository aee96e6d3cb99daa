"""What docs/thesis-figures.md says of each figure happens in its scene; the wrong meeting is caught."""

import json
import math
import re
from pathlib import Path
from typing import Any

import pytest

import kinetile as kt
from installing import install, run
from test_docs import assert_shown, commands, read_blocks

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGE = DOCS / "thesis-figures.md"
TEXT = PAGE.read_text(encoding="utf-8")
PACKAGE = DOCS / "examples" / "kinetile-thesis"
FIGURES = (1, *range(3, 17), 21, 22)
MEETINGS = ("naive", "sweep-tiling", "tiling-as-written", "tiling-as-written:rule=right")
BESIDE = ("figure-08:sap-1d", "figure-08:sap-1d:axis=y", "figure-16:sap-1d")
LIVE = re.compile(r"^kinetile view .*$", re.MULTILINE)

Moment = dict[str, Any]


@pytest.fixture(scope="module")
def known(tmp_path_factory):
    """What PYTHONPATH must have for a process that knows the package."""
    return [*install(PACKAGE, tmp_path_factory.mktemp("site")), str(ROOT / "tests")]


@pytest.fixture(scope="module")
def runs(known):
    """All moments of each scene, by its name; of some under another phase, by name:phase."""
    scenes = [f"figure-{number:02}" for number in FIGURES] + [f"meeting:{phase}" for phase in MEETINGS]
    done = run("runs", "thesis", *scenes, *BESIDE, folder=DOCS, paths=known, module="thesis_runs")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture
def moments(runs):
    def moments(name: str) -> list[Moment]:
        found: list[Moment] = runs[name]["moments"]
        return found

    return moments


def pairs(moment: Moment) -> set[tuple[int, int]]:
    return set(map(tuple, moment["pairs"]))


def events(moments: list[Moment]) -> list[tuple[str, float]]:
    """Kinds and times, the times to three places."""
    return [(moment["kind"], round(moment["time"], 3)) for moment in moments[1:]]


def tiles(moment: Moment) -> set[str]:
    """The tiles of a moment, by their corners."""
    return {json.dumps(shape["points"]) for shape in moment["shapes"] if shape["role"] == "tile"}


def bound(moment: Moment, body: int, side: str) -> list[Any]:
    """The ends of a bound, below and above: bodies, or heights of the border."""
    mine = [shape for shape in moment["shapes"] if shape["role"] == "bound" and shape["label"] == side]
    (found,) = [shape["points"] for shape in mine if shape["points"][0][0][0] == body]
    return [point[1][0] if isinstance(point[1], list) else point[1] for point in found]


def list_order(moment: Moment, label: str) -> list[int]:
    """Bodies in the order in which the bounds of a label are in the list, which is that of drawing."""
    mine = [shape for shape in moment["shapes"] if shape["role"] == "bound" and shape["label"] == label]
    return [shape["points"][0][0][0] for shape in mine]


@pytest.mark.parametrize("number", FIGURES)
def test_a_figure_has_its_pictures_and_its_page(number):
    name = f"figure-{number:02}"
    shown = {path.name for path in (DOCS / "thesis").glob(f"{name}*.svg")}
    assert shown == set(re.findall(rf"\(thesis/({name}[\w-]*\.svg)\)", TEXT))
    assert shown
    assert f"\nkinetile view thesis/{name}.toml" in TEXT
    assert f"## Figure {number}: " in TEXT


def test_every_scene_is_on_the_page():
    names = {path.stem for path in (DOCS / "thesis").glob("*.toml")}
    assert names == {"meeting", *(f"figure-{number:02}" for number in FIGURES)}
    assert {path.stem.split("-")[0] for path in (DOCS / "thesis").iterdir()} == {"figure", "meeting", "draw"}


@pytest.mark.slow
def test_the_pages_that_play_can_be_made(known, tmp_path):
    lines = [f"{line} --out {at}.html" for at, line in enumerate(LIVE.findall(TEXT))]
    assert len(lines) == len(FIGURES) + 2
    (tmp_path / "thesis").mkdir()
    for scene in (DOCS / "thesis").glob("*.toml"):
        (tmp_path / "thesis" / scene.name).write_bytes(scene.read_bytes())
    (tmp_path / "lines").write_text("\n".join(lines), encoding="utf-8")
    done = run("commands", "lines", folder=tmp_path, paths=known, module="thesis_runs")
    assert done.returncode == 0, done.stderr
    assert len(list(tmp_path.glob("*.html"))) == len(lines)


@pytest.mark.slow
def test_whatever_is_right_passes_every_audit(runs):
    for name, happened in runs.items():
        if name != "meeting:tiling-as-written":
            assert [moment["complaint"] for moment in happened["moments"] if moment["complaint"]] == [], name


@pytest.mark.slow
def test_1_a_disc_takes_another_along(moments):
    before, after = moments("figure-01")[:2]
    assert (after["kind"], round(after["time"], 3), after["bodies"]) == ("disc", 1.387, [0, 1])
    speed, slow = (math.hypot(*after["velocities"][body]) for body in (1, 0))
    assert before["velocities"][1] == [0.0, 0.0]
    assert speed > 4 * slow


@pytest.mark.slow
def test_3_discs_touch_where_the_equation_says(runs):
    after = runs["figure-03"]["moments"][1]
    assert (after["kind"], after["time"], runs["figure-03"]["coming"]) == ("disc", 2.0, 2.0)
    (ax, ay), (bx, by) = after["places"]
    assert (bx - ax, by - ay) == (1.5, 2.0)
    assert math.hypot(1.5, 2.0) == 1.5 + 1.0


def test_4_what_was_foreseen_does_not_happen(runs):
    assert round(runs["figure-04"]["coming"], 2) == 3.46
    happened = [(m["kind"], m["time"], m["bodies"]) for m in runs["figure-04"]["moments"][1:]]
    assert happened[0] == ("disc", 2.0, [1, 2])
    assert ("disc", [0, 1]) not in [(kind, bodies) for kind, _, bodies in happened]


def test_5_two_neighbours_change_places(moments):
    ranks = [
        [shape["points"][0][0][0] for shape in moment["shapes"] if shape["role"] == "bound"]
        for moment in moments("figure-05")[:2]
    ]
    assert ranks == [[0, 1, 2, 3], [0, 2, 1, 3]]
    assert events(moments("figure-05"))[0] == ("structural", 1.333)


def test_6_a_segment_begins_two_cross_one_ends(moments):
    found = moments("figure-06")
    kinds = events(found)
    assert kinds[0] == ("insert", 2.0)
    assert [time for kind, time in kinds[1:5] if kind == "structural"] == [3.875, 4.0, 4.0, 4.125]
    assert [list_order(found[at], "L") for at in (1, 5)] == [[0, 1, 2], [1, 0, 2]]
    assert ("remove", 6.0) in kinds


def test_7_intervals_that_overlap_are_a_pair(moments):
    assert pairs(moments("figure-07")[0]) == {(0, 1)}


def test_8_only_what_overlaps_on_both_axes_is_a_pair(moments):
    start, after = moments("figure-08")[:2]
    assert pairs(start) == {(0, 1)}
    assert pairs(moments("figure-08:sap-1d")[0]) == {(0, 1), (0, 2)}
    assert pairs(moments("figure-08:sap-1d:axis=y")[0]) == {(0, 1), (0, 3), (1, 3)}
    assert (round(after["time"], 3), pairs(after)) == (2.0, set())


def test_9_intervals_meet_pass_and_part_and_none_touch(moments):
    found = moments("figure-09")
    assert events(found) == [("structural", time) for time in (2.0, 4.0, 4.0, 6.0)]
    assert [len(moment["pairs"]) for moment in found] == [0, 1, 1, 1, 0]


def test_10_all_pairs_all_the_time(moments):
    found = moments("figure-10")
    assert {len(moment["pairs"]) for moment in found} == {28}
    assert {kind for kind, _ in events(found)} == {"disc", "wall"}


def test_11_all_boxes_overlap(moments):
    assert len(pairs(moments("figure-11")[0])) == 15


@pytest.mark.parametrize(("name", "bodies"), [("figure-12", 9), ("figure-14", 4), ("figure-16", 10)])
def test_12_there_are_three_tiles_a_body_and_one(name, bodies, moments):
    assert {len(tiles(moment)) for moment in moments(name)} == {3 * bodies + 1}


def test_13_a_tile_fails_by_its_pair_and_then_by_its_width(moments):
    start, contact, collapse = moments("figure-13")[:3]
    assert events([start, contact, collapse]) == [("disc", 1.4), ("structural", 2.127)]
    assert tiles(start) == tiles(contact)
    assert len(tiles(collapse) - tiles(contact)) == 3
    assert [pairs(moment) for moment in (start, contact, collapse)] == [{(0, 1)}, {(0, 1)}, set()]


def test_14_a_meeting_and_the_parting_that_undoes_it(moments):
    start, met, *turned, parted = moments("figure-14")
    a, b, c, d = range(4)
    assert (met["kind"], round(met["time"], 3)) == ("structural", 1.0)
    assert bound(start, a, "R") == bound(start, b, "L") == [d, c]
    assert bound(met, a, "R") == [b, c]
    assert bound(met, b, "L") == [d, a]
    assert pairs(met) - pairs(start) == {(a, b)}
    assert pairs(start) - pairs(met) == {(c, d)}
    assert len(tiles(met) - tiles(start)) == len(tiles(start) - tiles(met)) == 3
    assert [moment["kind"] for moment in turned] == ["turn", "turn"]
    assert (parted["kind"], round(parted["time"], 3)) == ("structural", 3.0)
    assert (tiles(parted), pairs(parted)) == (tiles(start), pairs(start))


def test_15_a_passing_and_the_one_that_undoes_it(moments):
    start, passed, _, back = moments("figure-15")
    a, b, c, d = range(4)
    assert [round(moment["time"], 3) for moment in (passed, back)] == [1.0, 3.0]
    assert (bound(start, a, "L"), bound(start, b, "L")) == ([b, c], [d, c])
    assert (bound(passed, a, "L"), bound(passed, b, "L")) == ([d, c], [d, a])
    assert pairs(passed) - pairs(start) == {(a, d)}
    assert pairs(start) - pairs(passed) == {(b, c)}
    assert len(tiles(passed) - tiles(start)) == 3
    assert (tiles(back), pairs(back)) == (tiles(start), pairs(start))


def test_16_one_body_sees_all_others(moments):
    start = moments("figure-16")[0]
    assert pairs(start) >= {(0, other) for other in range(1, 10)}
    assert len(pairs(start)) == 17
    assert len(pairs(moments("figure-16:sap-1d")[0])) == 45


def test_21_a_contact_that_has_been_is_not_to_come(runs):
    assert runs["figure-21"]["coming"] is None
    assert [moment["kind"] for moment in runs["figure-21"]["moments"]] == ["start"]
    scene = kt.load_scene(DOCS / "thesis" / "figure-21.toml")
    (x, y), (vx, vy) = (rows[1] - rows[0] for rows in (scene.position, scene.velocity))
    assert math.hypot(x - 2 * vx, y - 2 * vy) == scene.radius.sum()
    assert (x - 2 * vx) * vx + (y - 2 * vy) * vy > 0.0


def test_22_three_swaps_at_one_tick(moments):
    found = moments("figure-22")
    ties = [moment for moment in found if moment["time"] == 2.0]
    assert [moment["kind"] for moment in ties] == ["structural"] * 3
    assert len({tuple(moment["tick"]) for moment in ties}) == 1
    assert [list_order(moment, "L") for moment in found[1:5]] == [[0, 1, 2], [1, 0, 2], [1, 2, 0], [2, 1, 0]]


def test_the_meeting_as_it_is_written_loses_a_tile_and_a_contact(runs):
    right, written = (runs[f"meeting:{phase}"] for phase in ("sweep-tiling", "tiling-as-written"))
    assert events(right["moments"])[:4] == [
        *[("structural", time) for time in (1.0, 1.25, 1.5)],
        ("disc", 1.569),
    ]
    assert [moment["complaint"] == "" for moment in written["moments"][:2]] == [True, False]
    assert (
        "R(1).outer - R(0).lower: its right port is linked to L(2).upper"
        in written["moments"][1]["complaint"]
    )
    assert ("structural", 1.25) not in events(written["moments"])
    assert "disc" not in {moment["kind"] for moment in written["moments"]}
    assert written["fingerprint"] != runs["meeting:naive"]["fingerprint"]


def test_with_the_right_rule_the_package_has_sweep_tilings_run(runs):
    assert runs["meeting:tiling-as-written:rule=right"] == runs["meeting:sweep-tiling"]
    assert runs["meeting:sweep-tiling"]["fingerprint"] == runs["meeting:naive"]["fingerprint"]


@pytest.mark.slow
def test_the_commands_about_the_wrong_rule_say_what_is_shown(known, tmp_path):
    (block,) = [b for b in read_blocks(PAGE) if b.language == "console" and b.mark == "not run"]
    (tmp_path / "thesis").mkdir()
    scene = DOCS / "thesis" / "meeting.toml"
    (tmp_path / "thesis" / scene.name).write_bytes(scene.read_bytes())
    for command, code, shown in commands(block):
        done = run(*command.split()[1:], folder=tmp_path, paths=known)
        assert done.returncode == code, f"{command}\n{done.stdout}{done.stderr}"
        assert_shown(shown, done.stdout, command)


def test_it_plays_at_the_contact_that_is_missed(known, tmp_path):
    done = run("view", DOCS / "thesis" / "meeting.toml", folder=tmp_path, paths=known)
    assert done.returncode == 0
    assert "under tiling-as-written there is none" in done.stderr
