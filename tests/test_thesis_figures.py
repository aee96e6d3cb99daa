"""What docs/thesis-figures.md says of each figure happens in its scene; the wrong meeting is caught."""

import json
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

LIVE = re.compile(r"^kinetile view .*$", re.MULTILINE)


@pytest.fixture(scope="module")
def known(tmp_path_factory):
    """What PYTHONPATH must have for a process that knows the package."""
    return [*install(PACKAGE, tmp_path_factory.mktemp("site")), str(ROOT / "tests")]


@pytest.fixture(scope="module")
def runs(known):
    """All moments of the scene of the meeting under some phases, by its name:phase."""
    scenes = [f"meeting:{phase}" for phase in MEETINGS]
    done = run("runs", "thesis", *scenes, folder=DOCS, paths=known, module="thesis_runs")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def events(moments: list[dict[str, Any]]) -> list[tuple[str, float]]:
    """Kinds and times, the times to three places."""
    return [(moment["kind"], round(moment["time"], 3)) for moment in moments[1:]]


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


@pytest.mark.small
def test_4_what_was_foreseen_does_not_happen_and_21_a_contact_that_has_been_is_not_to_come():
    """The other figures are pictures alone, which ``test_figures.py`` holds."""
    four, last = (
        kt.Simulation(kt.load_scene(DOCS / "thesis" / f"figure-{number}.toml"), "naive")
        for number in ("04", "21")
    )
    assert round(four.next_contact(0, 1).time, 2) == 3.46
    four.run()
    assert four.contacts[["time", "a", "b"]].tolist()[0] == (2.0, 1, 2)
    assert (0, 1) not in four.contacts[["a", "b"]].tolist()
    assert last.next_contact(0, 1) is None


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
