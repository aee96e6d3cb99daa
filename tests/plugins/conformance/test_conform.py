"""``kinetile conform`` and ``kinetile replay`` as people and scripts meet them."""

import json
import re
import signal
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace

import pytest

import kinetile as kt
import kinetile_conformance
from command_line import kinetile
from installing import install_blind, run
from kinetile_conformance import Report, Result
from kinetile_conformance.cases import Subject
from lanes import first
from test_docs import assert_shown

SCENES = Path(__file__).parents[2] / "scenes"
PAGE = (SCENES.parents[1] / "docs" / "conformance.md").read_text(encoding="utf-8")
CHECK = "its-structure-is-true"


@pytest.fixture(autouse=True)
def _folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize(
    "how", [pytest.param("--in-process", marks=pytest.mark.small), *first(0, ["--isolated"])]
)
def test_a_phase_that_conforms(how, tmp_path):
    checks = "--check same-contacts --check same-contacts-with-turns"
    result = kinetile(f"conform naive {how} --examples 2 {checks}", code=0)
    head, blank, first, second, *rest = result.stdout.splitlines()
    assert head.startswith("conformance kit ")
    assert head.endswith(f"broad phase 'naive', of kinetile {kt.__version__}")
    assert blank == ""
    assert first.split()[:4] == ["passed", "same-contacts", "2", "scenes"]
    assert second.split()[:4] == ["passed", "same-contacts-with-turns", "2", "scenes"]
    assert rest[-1].startswith("naive conforms (")
    assert result.stderr.startswith("judging naive on 2 scenes a check")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.small
def test_as_json():
    result = kinetile(
        "conform", "sweep-and-prune:axis=x", "--in-process", "--check", "its-features-are-known", "--json"
    )
    told, report = result.stdout.splitlines()
    assert json.loads(told)["result"]["status"] == "passed"
    found = json.loads(report)
    assert (found["status"], found["conforms"], found["reference_in_doubt"]) == ("complete", True, False)
    assert (found["broad_phase"], found["options"]) == ("sap-1d", {"axis": "x"})
    assert [check["status"] for check in found["checks"]] == ["passed"]
    assert found["versions"]["kinetile"] == kt.__version__


@pytest.mark.small
@pytest.mark.parametrize("folder", ["new", "new/and/deep", "old", "old/new"])
def test_a_folder_for_which_there_is_nothing_is_left_as_it_was(folder, tmp_path):
    (tmp_path / "old").mkdir()
    arguments = ("--in-process", "--check", "its-features-are-known", "--save-to", folder)
    kinetile("conform", "naive", *arguments, code=0)
    assert [path.name for path in tmp_path.rglob("*")] == ["old"]


def pretending(monkeypatch, *results: Result, error: type[BaseException] | None = None) -> None:
    """Puts a judge in place of the kit's that comes to these results, and is perhaps interrupted then."""

    def judge(name, *, on_result, **more):
        for result in results:
            on_result(result)
        if error is not None:
            raise error
        return Report(Subject(name, {}), "kinetile", results)

    monkeypatch.setattr(kinetile_conformance, "check_broad_phase", judge)


def test_after_an_interrupt_what_there_is_has_been_printed(monkeypatch):
    pretending(monkeypatch, Result("some-check", "b", "passed", 1, 0.0), error=KeyboardInterrupt)
    result = kinetile("conform", "naive", "--in-process", code=130)
    assert "some-check" in result.stdout
    assert "conforms" not in result.stdout
    *_, last = kinetile("conform", "naive", "--in-process", "--json").stdout.splitlines()
    found = json.loads(last)
    assert (found["status"], found["conforms"], len(found["checks"])) == ("interrupted", None, 1)


def test_a_signal_that_is_lost_in_a_callback_ends_it_at_the_next_scene(monkeypatch):
    def judge(name, *, on_scene, **more):
        with suppress(KeyboardInterrupt):  # as the garbage collector does
            signal.raise_signal(signal.SIGTERM)
        on_scene("some-check", 1)

    monkeypatch.setattr(kinetile_conformance, "check_engine", judge)
    kinetile("conform", "--command", "true", code=128 + signal.SIGTERM)


@pytest.fixture(scope="module")
def blind(tmp_path_factory):
    """A broad phase that misses contacts: its folder, how to run commands in it, and the page's reports, for
    which nothing is compiled."""
    folder = tmp_path_factory.mktemp("blind")
    paths = install_blind(folder)

    def command(*words: object):
        return run(*words, folder=folder, paths=paths, interpreted=False)

    on_page = re.findall(r"kinetile (conform blind.*?) +# exit code 1\n", PAGE)
    reports = [command(*words.split(), "--examples", 20) for words in on_page]
    return SimpleNamespace(folder=folder, run=command, reports=reports)


@pytest.mark.small
def test_a_phase_that_does_not_conform(blind):
    for done, check in zip(blind.reports, ("same-contacts", CHECK), strict=True):
        assert done.returncode == 1, done.stderr
        lines = [line.strip() for line in done.stdout.splitlines()]
        assert lines[0].endswith("broad phase 'blind', of kinetile-blind 0.1.0")
        # What Hypothesis draws, and so which scene is the smallest, differs between environments.
        (size,) = (line for line in lines if line.startswith("smallest scene found: "))
        assert size in ("smallest scene found: 2 bodies", "smallest scene found: 3 bodies")
        (verdict,) = (line for line in lines if line.startswith("verdict: only blind; cells, sap-1d, sap-2d"))
        assert verdict.endswith("agree with the reference")
        assert f"replay: kinetile replay blind conformance-failures/blind-{check}.toml" in lines
        assert any(line.startswith("begin with ") for line in lines)
        assert lines[-1] == f"blind does not conform: {check}"
        assert done.stderr.startswith("judging blind on 20 scenes a check")
    (first_on_page,) = re.findall(r"^```text\n(  failed .*?)```", PAGE, re.DOTALL | re.MULTILINE)
    assert_shown(first_on_page.splitlines(), blind.reports[0].stdout, "docs/conformance.md")
    found = {path.name for path in (blind.folder / "conformance-failures").iterdir()}
    assert found == {"blind-same-contacts.toml", f"blind-{CHECK}.toml"}


@pytest.mark.slow
def test_its_scene_fails_again_and_passes_under_another(blind):
    file = f"conformance-failures/blind-{CHECK}.toml"
    again = blind.run("replay", "blind", file)
    assert again.returncode == 1, again.stderr
    first, *rest = again.stdout.splitlines()
    assert first.startswith(f"still fails: blind, {CHECK}, {file} (")
    assert first.endswith(("(2 bodies)", "(3 bodies)"))
    assert re.search(r"contact \d+ is missing: body \d+ with body \d+", rest[1])
    assert any(line.startswith("  verdict: only blind; ") for line in rest)
    found = json.loads(kinetile("replay", "naive", blind.folder / file, "--json", code=0).stdout)
    assert (found["check"], found["fails"]) == (CHECK, False)


@pytest.mark.small
def test_any_scene_can_be_replayed():
    result = kinetile("replay", "naive", SCENES / "H05.toml", code=0)
    assert result.stdout.startswith("passes: naive, same-contacts, ")
