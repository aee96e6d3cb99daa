"""The command line as people and scripts meet it: results on stdout, the rest on stderr, exit codes."""

import csv
import importlib
import io
import json
import os
import re
import signal
import subprocess
import sys
import textwrap
import time
from types import SimpleNamespace

import pytest
import typer

import kinetile as kt
from command_line import kinetile, printed, refused
from kinetile.cli import app
from kinetile.cli.options import read_numbers
from kinetile.cli.terminal import Bar, notice
from kinetile.errors import AuditError
from kinetile.plugin.choices import read_assignments, read_phase, read_phases, read_value
from kinetile.records import locks
from lanes import first
from registering import registered

FOUR = "run -s bodies=4 --broad-phase naive"


def test_run_gives_everything_as_json():
    result = printed("run grid -s bodies=25 -s seed=7 --broad-phase naive --until 0.5")
    sim = kt.Simulation(kt.make_scene("grid", bodies=25, seed=7), "naive")
    sim.run(0.5)
    assert result["readings"]["fingerprint"] == sim.fingerprint
    assert set(result["readings"]) == set(sim.readings.as_dict())
    assert result["scene"]["parameters"]["seed"] == 7
    assert result["scene"]["bodies"] == 25
    assert result["broad_phase"] == "naive"
    assert result["narrow_phases"] == {"disc": {}, "wall": {}}
    ended = {"until": 0.5, "max_contacts": None, "time": 0.5, "time_unit": 1.0, "status": "complete"}
    assert result["run"] == ended
    assert result["versions"]["kinetile"] == kt.__version__


def test_run_prints_a_table_with_units():
    result = kinetile(FOUR, code=0)
    for part in ("grid (bodies=4", "0 to 1: complete", "radii", "a CPU second", "fingerprint"):
        assert part in result.stdout
    assert "lateness" not in result.stdout
    assert "\nlateness            0 time units\n" in kinetile(FOUR, "--verbose").stdout


def test_the_cpu_time_of_a_run_was_an_eighth_of_what_it_took():
    (line,) = (each for each in kinetile(FOUR, code=0).stdout.splitlines() if each.startswith("CPU time"))
    loop, *_, ready, whole = map(float, re.findall(r"([0-9.e-]+) s", line))
    assert line.endswith(" s of this process")
    assert whole > loop + ready


def test_run_takes_options_of_the_phases():
    one = printed("run -s bodies=4 --broad-phase sap-1d:axis=y --narrow-phase disc --narrow-phase wall")
    two = printed("run -s bodies=4 --broad-phase sap-1d -o axis=y --narrow-phase disc --narrow-phase wall")
    assert one["options"] == two["options"] == {"axis": "y"}
    assert one["narrow_phases"] == {"disc": {}, "wall": {}}
    assert one["readings"]["contacts_wall"] > 0


def test_a_number_of_contacts_is_an_end_too():
    result = printed(FOUR, "--max-contacts", 50)
    assert result["readings"]["contacts_disc"] + result["readings"]["contacts_wall"] == 50
    assert result["run"]["until"] is None
    result = printed(FOUR, "--max-contacts", 10**20, "--until", 0.25)  # more than 64 bits count are no end
    assert (result["run"]["status"], result["run"]["time"]) == ("complete", 0.25)


def test_a_saved_scene_is_the_same_run_again(tmp_path):
    path = tmp_path / "saved.toml"
    first = printed("run -s bodies=9 --broad-phase sap-1d:axis=y --until 0.75 --save-scene", path)
    again = printed("run", path)
    assert again["readings"]["fingerprint"] == first["readings"]["fingerprint"]
    assert (again["broad_phase"], again["options"], again["run"]["time"]) == ("sap-1d", {"axis": "y"}, 0.75)
    assert again["scene"]["file"] == str(path)
    other = printed("run --broad-phase naive --until 0.25", path)
    assert (other["broad_phase"], other["options"], other["run"]["time"]) == ("naive", {}, 0.25)


def test_the_default_end_is_one_unit_after_the_start(tmp_path):
    scene = kt.Scene([[1.0, 1.0]], [[0.0, 0.0]], 0.5, start=100.0)
    kt.save_scene(scene, tmp_path / "late.toml")
    assert printed("run --broad-phase naive", tmp_path / "late.toml")["run"]["time"] == 101.0


def test_a_planned_command_that_is_refused_loses_nothing_of_what_was_before(tmp_path):
    scene = kt.Scene(
        [(1.0, 1.0)], [(1.0, 0.25)], 0.5, arena=(4.0, 4.0), settings=kt.Settings(until=3.0),
        commands=[kt.Insert(2.75, (3.0, 1.5), (0.0, 0.0), 0.25)],
    )  # fmt: skip
    kt.save_scene(scene, tmp_path / "full.toml")
    ran = kinetile("run --json", tmp_path / "full.toml", "--contacts", tmp_path / "c.txt", code=1)
    assert "there is no room for body 1" in ran.stderr
    said = json.loads(ran.stdout)
    assert (said["run"]["status"], said["readings"]["contacts_wall"]) == ("fault: NoRoom", 1)
    assert (tmp_path / "c.txt").exists()


def test_explain_says_what_is_modelled_and_runs_nothing():
    result = kinetile(FOUR, "--explain", code=0)
    assert "modelled:" in result.stdout
    assert "left out:" in result.stdout
    assert "fingerprint" not in result.stdout
    sim = kt.Simulation(kt.make_scene("grid", bodies=4), "naive")
    assert printed(FOUR, "--explain") == sim.explain()


def test_events_are_written(tmp_path):
    pytest.importorskip("pyarrow")
    path = tmp_path / "events.parquet"
    result = printed("run -s bodies=25 -s seed=5 --broad-phase naive --events", path)
    rows, metadata = kt.read_events(path)
    assert result["events_file"] == {"path": str(path), "rows": len(rows), "status": "complete"}
    assert metadata["fingerprint"] == result["readings"]["fingerprint"]
    assert metadata["parameters"]["seed"] == 5
    assert (metadata["broad_phase"], metadata["until"], metadata["time"]) == ("naive", 1.0, 1.0)
    sim = kt.Simulation(kt.make_scene("grid", bodies=25, seed=5), "naive")
    sim.run(1.0)
    assert kt.Trajectory.read(path).positions(1.0).tobytes() == sim.positions().tobytes()


def jammed(tmp_path):
    scene = kt.Scene(
        [[x, y] for x in (0.25, 0.75) for y in (0.25, 0.75)],
        [[1.0, 0.3], [0.2, -1.0], [-1.0, 0.1], [0.4, 1.0]],
        0.25,
        arena=(1, 1),
    )
    kt.save_scene(scene, tmp_path / "jammed.toml")
    return tmp_path / "jammed.toml"


def audited(simulation, *arguments, of=kt.Simulation.run, **options):
    of(simulation, *arguments, **options)
    raise AuditError("at time 1.0 the queue is out of order")


@pytest.mark.compiled
@pytest.mark.parametrize("fault", ["ZenoError", "AuditError"])
def test_after_a_fault_what_was_done_is_printed_and_kept(fault, tmp_path, monkeypatch):
    pytest.importorskip("pyarrow")
    events, scene = tmp_path / "e.parquet", jammed(tmp_path)
    if fault == "AuditError":
        monkeypatch.setattr(kt.Simulation, "run", audited)
        kt.save_scene(kt.make_scene("grid", bodies=4), scene)
    result = kinetile("run --broad-phase naive --json", scene, "--events", events, code=1)
    assert ("jammed" if fault == "ZenoError" else "the queue is out of order") in result.stderr
    printed = json.loads(result.stdout)
    assert printed["run"]["status"] == f"fault: {fault}"
    contacts = printed["readings"]["contacts_disc"] + printed["readings"]["contacts_wall"]
    rows, metadata = kt.read_events(events)
    assert len(rows) == contacts > 0
    assert metadata["status"].startswith(f"fault: {fault}: ")


def test_a_number_of_contacts_does_not_go_beyond_the_scenes_own_end(tmp_path):
    path = tmp_path / "short.toml"
    path.write_text('recipe = "grid"\nuntil = 0.25\nbroad-phase = "naive"\n[parameters]\nbodies = 4\n')
    result = printed("run --max-contacts 1000000", path)
    assert (result["run"]["until"], result["run"]["time"]) == (0.25, 0.25)
    assert printed("compare --phases naive,cells --max-contacts 1000000", path)["phases"][0]["time"] == 0.25


def test_overwrite_replaces_a_file_of_events_and_a_scene(tmp_path):
    pytest.importorskip("pyarrow")
    events, scene = tmp_path / "e.parquet", tmp_path / "s.toml"
    events.write_text("old")
    assert kinetile(FOUR, "--events", events, "--explain").exit_code == 0  # which writes none
    kt.save_scene(kt.make_scene("two-discs"), scene)
    for given in (("-s", "bodies=4"), (scene,)):
        kinetile("run --overwrite --events", events, "--save-scene", scene, *given, code=0)
    assert kt.read_events(events).metadata["status"] == "complete"


def test_a_second_run_into_a_file_that_is_being_written_was_not_reported(tmp_path):
    pytest.importorskip("pyarrow")
    path = tmp_path / "e.parquet"
    with kt.EventRecorder(path, kt.make_scene("two-discs")):
        said = "is being written by another run" if locks.flock else "another run is writing it"
        assert said in refused("run -s bodies=4 --overwrite --events", path)
    assert len(kt.read_events(path).rows) == 0


def test_compare_shows_the_first_difference_with_exact_ticks(blind, tmp_path):
    path = tmp_path / "meet.toml"
    kt.save_scene(kt.Scene([[1.0, 1.0], [3.0, 1.0]], [[0.5, 0.0], [-0.5, 0.0]], 0.25), path)
    line = f"compare --phases naive,{blind} --until 4"
    result = kinetile(line, path, code=1)
    assert "blind differs from naive at contact 0:" in result.stdout
    assert "body 0 with body 1 at time 1.5 (epoch 1, tick 2251799813685248)" in result.stdout
    assert "identical: " not in result.stdout
    result = kinetile(line, path, "--json", code=1)
    assert json.loads(result.stdout)["first_divergence"]["expected"]["tick"] == 2**51


@pytest.mark.compiled
def test_phases_that_agree_on_a_fault_have_not_come_to_their_end(tmp_path):
    path = jammed(tmp_path)
    result = kinetile("compare --phases naive,cells", path, code=1)
    assert "identical: " in result.stdout
    assert "but every run ended in a fault: ZenoError: at time 0.0 the bodies are jammed" in result.stdout
    result = kinetile("compare --phases naive,cells --json", path, code=1)
    assert json.loads(result.stdout)["identical"] is True


def test_plugins_that_failed_are_listed_with_their_reason(monkeypatch):
    from kinetile.plugin.registry import Failure

    broken = Failure("shaky", "kinetile-shaky", ImportError("no module named 'wobble'"), "1.2")
    monkeypatch.setattr(kt.registry(), "failures", (broken,))
    (failure,) = printed("plugins")["failures"]
    found = [failure[name] for name in ("plugin", "distribution", "error")]
    assert found == ["shaky", "kinetile-shaky", "ImportError"]
    assert "not loaded: shaky (kinetile-shaky 1.2): " in kinetile("plugins").stdout
    assert "no module named 'wobble'" in kinetile("run --broad-phase shaky-phase").stderr


def test_scenes_are_listed_with_their_parameters():
    listing = printed("scenes")
    assert "grid" in [recipe["name"] for recipe in listing]
    grid = printed("scenes grid")
    bodies, *_, periodic, gravity = ({**each, "meaning": each["meaning"][:8]} for each in grid["parameters"])
    said = {"name": "bodies", "type": "int", "required": False, "default": 400, "meaning": "the numb"}
    assert bodies == said
    assert periodic == said | {"name": "periodic", "type": "str", "default": "", "meaning": "axes alo"}
    numbers = {"type": "tuple[float, ...]", "default": [], "meaning": "accelera"}
    assert gravity == said | numbers | {"name": "gravity"}
    assert re.search(r"periodic +str +\(empty\)", kinetile("scenes grid").stdout)
    assert "grid" in kinetile("scenes").stdout
    shown = kinetile("scenes grid").stdout
    assert "density" in shown
    assert "kinetile run grid -s bodies=400" in shown


class Takes:
    """Something with options, of whatever kind: nothing beside its signature says them."""

    def __init__(self, tightness: float, *, mode: str = "fast", extra: int | None = None) -> None:
        """Nothing here is run."""


class Plain:
    """Something without options."""


KINDS = {"broad phase": kt.BroadPhaseSpec, "response": kt.ResponseSpec, "observable": kt.ObservableSpec}
EVERYTHING = (
    *(make("springy", Takes) for make in (*KINDS.values(), kt.SceneSpec)),
    kt.NarrowPhaseSpec("springy", Takes, role="pair"),
    kt.BroadPhaseSpec("plain", Plain),
    kt.BroadPhaseSpec("absent", "no_such_module:Phase"),
    kt.SceneSpec("gone", "no_such_module:recipe", "is not there"),
)


def test_options_were_listed_nowhere_but_in_the_source_of_a_plugin():
    with registered(*EVERYTHING):
        rows = {(row["kind"], row["name"]): row for row in printed("plugins")["provided"]}
        table = kinetile("plugins").stdout
        recipes = {recipe["name"]: recipe for recipe in printed("scenes")}
        assert "does not import" in " ".join(kinetile("scenes").stdout.split())
        assert "must be given" in kinetile("scenes springy").stdout
    options = [
        {"name": "tightness", "type": "float", "required": True},
        {"name": "mode", "type": "str", "required": False, "default": "fast"},
        {"name": "extra", "type": "int | None", "required": False, "default": None},
    ]
    for kind in (*KINDS, "narrow phase"):
        assert rows[kind, "springy"]["options"] == options
        assert re.search(
            rf"{kind} +springy +tightness +float +\(none: must be given\)\n +mode +str +fast", table
        )
    assert rows["scene", "springy"]["options"] == recipes["springy"]["parameters"]
    assert recipes["springy"]["parameters"][:3] == options
    assert recipes["springy"]["parameters"][3]["name"] == "periodic"
    assert "no_such_module" in recipes["gone"]["error"]
    assert rows["broad phase", "plain"]["options"] == []
    assert not re.search(r"broad phase +plain +\S+ +\S+ +\S+$", table, re.MULTILINE)
    assert "no_such_module" in rows["broad phase", "absent"]["error"]
    assert "'no_such_module:Phase' does not import" in table


def test_help_and_version():
    assert kinetile("--version").stdout == f"kinetile {kt.__version__}\n"
    assert "compare" in kinetile("--help").stdout
    assert "--broad-phase" in kinetile("run --help").stdout


def test_values():
    numbers = {"7": 7, "1e-3": 0.001, ".5": 0.5, "[1, 2.5]": [1, 2.5]}
    words = {"true": True, "None": None, "y": "y", '"7"': "7", "[1,": "[1,", "": ""}
    for text, value in (numbers | words).items():
        assert read_value(text) == value
        assert type(read_value(text)) is type(value)


def test_assignments_and_phases():
    assert read_assignments(["a-b=1", "c = x=y"], "-o") == {"a_b": 1, "c": "x=y"}
    assert read_phase("cells:size=0.5,skin=2") == ("cells", {"size": 0.5, "skin": 2})
    assert read_phase("mine:fault=none,other=None") == ("mine", {"fault": "none", "other": None})
    assert read_phases("naive, sap-1d:axis=x,sap-1d:axis=y") == ["naive", "sap-1d:axis=x", "sap-1d:axis=y"]
    assert read_phases("cells:size=.5,skin=2,naive") == ["cells:size=.5,skin=2", "naive"]
    assert read_numbers("25, 100", int, "--bodies") == [25, 100]


class Display:
    def __init__(self):
        self.calls = []

    def __getattr__(self, name):
        return lambda *arguments, **values: self.calls.append((name, values))


def test_progress_is_shown_on_a_terminal_after_two_seconds(monkeypatch):
    now = [10.0]
    display = Display()
    monkeypatch.setattr("kinetile.cli.terminal._bar", lambda: display)
    monkeypatch.setattr("kinetile.cli.terminal.time.monotonic", lambda: now[0])
    monkeypatch.setattr("kinetile.cli.terminal.sys.stderr", SimpleNamespace(isatty=lambda: True))
    with Bar("running", start=1.0) as bar:
        state = kt.Progress(2.0, 5.0, 100, 1000, 0.5)
        bar(state)
        now[0] += 1.9
        bar(state)
        assert display.calls == []
        now[0] += 0.2
        bar(state)
        bar(state._replace(time=5.0))
    assert [name for name, _ in display.calls] == ["add_task", "start", "update", "stop"]
    assert [values.get("completed") for _, values in display.calls] == [0.25, None, 1.0, None]


@pytest.mark.parametrize("stderr", [sys.__stderr__, None], ids=["no terminal", "closed"])
def test_elsewhere_there_is_no_progress(monkeypatch, stderr):
    now = [10.0]
    monkeypatch.setattr("kinetile.cli.terminal._bar", lambda: pytest.fail("a bar on what is no terminal"))
    monkeypatch.setattr("kinetile.cli.terminal.time.monotonic", lambda: now[0])
    if stderr is None:
        monkeypatch.setattr("kinetile.cli.terminal.sys.stderr", None)
    with Bar("measuring") as bar:
        bar.count(1, 3)
        now[0] += 60.0
        bar.count(2, 3)
    notice("a line")


@pytest.mark.parametrize(
    "line",
    first(
        4,
        [
            "plugins",
            "scenes",
            "scenes grid",
            "compare cradle --phases naive,cells --until 1",
            "oracle cradle --until 3",
            "choose cradle --phases naive,cells --seconds 0.0001 --repeats 1",
            "bench scene cradle --phases naive,cells --until 1 --repeats 1",
            "bench events --phases naive,cells --bodies 4 --densities 0.5 --seconds 0.001 --repeats 1",
        ],
    ),
)
def test_tables_of_rows_are_printed_as_csv(line):
    result = kinetile(line, "--csv", code=0)
    rows = list(csv.DictReader(io.StringIO(result.stdout)))
    assert rows
    assert all(None not in row and None not in row.values() for row in rows)
    as_json = json.loads(kinetile(line, "--json").stdout)
    assert len(rows) == len(as_json if isinstance(as_json, list) else _longest(as_json))


def _longest(found):
    for name in ("parameters", "phases", "candidates", "rows", "provided", "contacts"):
        if isinstance(found.get(name), list):
            return found[name]
    return found["oracle"]["contacts"]


OPTIONS = {
    *("--phases", "--seconds", "--repeats", "--results", "--until", "--max-contacts", "--bodies"),
    *("--densities", "--seeds", "--set", "--narrow-phase", "--help", "--json", "--csv"),
    *("--out", "--workers", "--again", "--y", "--compiled"),  # of one command each
}


def test_an_option_of_benchmarks_has_one_name_in_all_commands():
    root = typer.main.get_command(app)
    root.list_commands(None)  # now the commands of plugins are there as well
    commands = [each for group in ("bench", "study") for each in root.commands[group].commands.values()]
    commands += [root.commands[name] for name in ("choose", "compare")]
    params = [each for command in commands for each in command.params]
    assert {each.opts[0] for each in params if each.param_type_name == "option"} <= OPTIONS


def test_help_named_an_extra_in_brackets_which_were_taken_for_markup():
    def texts(command):
        yield command.help or ""
        yield from (each.help or "" for each in command.params if hasattr(each, "help"))
        for name in command.list_commands(None) if hasattr(command, "commands") else []:
            yield from texts(command.get_command(None, name))

    found = list(texts(typer.main.get_command(app)))
    assert len(found) > 100
    assert not [text for text in found if re.search(r"\w\[\w", text)]


# real processes

UNPRINTED = "kinetile: the result cannot be printed"


@pytest.mark.skipif(sys.platform == "win32", reason="redirects as POSIX shells do")
@pytest.mark.parametrize(
    ("redirection", "code", "out", "err"),
    first(
        2,
        [
            ("2>&-", 0, "density", ""),
            (">&-", 1, "", f"{UNPRINTED}: stdout is closed\n"),
            ("--json >/dev/full", 1, "", f"{UNPRINTED}: No space left on device\n"),
            ("2>/dev/full", 0, "density", ""),
            (">/dev/full", 1, "", f"{UNPRINTED}: No space left on device\n"),
        ],
    ),
)
@pytest.mark.parametrize("unbuffered", ["", pytest.param("1", marks=pytest.mark.slow)])
def test_closed_or_full_outputs_are_one_sentence_at_most(redirection, code, out, err, unbuffered):
    if "/dev/full" in redirection and not os.path.exists("/dev/full"):
        pytest.skip("there is no /dev/full")
    command = f"{sys.executable} -m kinetile scenes grid {redirection}"
    environment = {**os.environ, "PYTHONUNBUFFERED": unbuffered}
    ended = subprocess.run(command, shell=True, env=environment, capture_output=True, text=True)
    assert (ended.returncode, ended.stderr) == (code, err)
    assert out in ended.stdout


@pytest.mark.slow
@pytest.mark.parametrize("module", ["numba", "typer", "kinetile.cli", "kinetile.cli.show", "numpy"])
def test_ctrl_c_while_modules_are_imported_was_a_traceback(module):
    script = f"""
        import importlib.abc, runpy, signal, sys

        class Finder(importlib.abc.MetaPathFinder):
            def find_spec(self, name, path, target=None):
                if name == {module!r}:
                    signal.raise_signal(signal.SIGINT)

        signal.signal(signal.SIGINT, signal.default_int_handler)
        sys.meta_path.insert(0, Finder())
        sys.argv = ["kinetile", "run", "-s", "bodies=4", "--broad-phase", "naive"]
        runpy.run_module("kinetile", run_name="__main__", alter_sys=True)
    """
    ended = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(script)],
        env={**os.environ, "NUMBA_DISABLE_JIT": "0"},
        capture_output=True,
        text=True,
    )
    # The signal waits until modules are there, which may be after the end of so short a run.
    assert ended.returncode in (0, 130)
    assert re.fullmatch(r"kinetile: interrupted.*\n" if ended.returncode else "", ended.stderr)


@pytest.mark.compiled
def test_a_run_imports_only_what_it_needs():
    script = """
        import sys
        import kinetile
        assert "pluggy" not in sys.modules
        assert len(kinetile.registry().as_dicts()["provided"]) >= 14
        assert not {"numba", "numpy", "pydantic", "typer", "rich", "pyarrow"} & set(sys.modules), sys.modules
        assert {n for n in sys.modules if n.startswith("kinetile_plugins")} == {"kinetile_plugins"}
        from kinetile.cli import app
        assert "numba" not in sys.modules
        try:
            app(["run", "-s", "bodies=4", "--broad-phase", "naive"])
        except SystemExit as end:
            assert not end.code
        unwanted = {"pyarrow", "rich", "kinetile.scene.files", "kinetile.records.recorder"}
        assert not unwanted & set(sys.modules), unwanted & set(sys.modules)
        kinetile.toolbox, kinetile.records.read_events  # a package was no attribute until something had it
    """
    subprocess.run([sys.executable, "-c", textwrap.dedent(script)], check=True, stdout=subprocess.DEVNULL)


def test_to_help_nothing_heavy_is_imported():
    script = """
        import sys
        from kinetile.cli import app
        heavy = {"numpy", "numba", "pyarrow", "hypothesis", "matplotlib", "flint", "pytest"}
        rooms = ("kinetile.kernel.",)
        for command in [], ["run"], ["oracle"], ["conform"], ["bench", "thesis"]:
            try:
                app([*command, "--help"])
            except SystemExit as end:
                assert not end.code
            unwanted = heavy & set(sys.modules) | {each for each in sys.modules if each.startswith(rooms)}
            assert not unwanted, (command, unwanted)
    """
    subprocess.run([sys.executable, "-c", textwrap.dedent(script)], check=True, stdout=subprocess.DEVNULL)


def test_compiling_is_reported_on_stderr_and_stdout_stays_clean(monkeypatch):
    monkeypatch.setattr(kt.Simulation, "cached", False)
    monkeypatch.setattr(kt.Simulation, "compiled", True)
    result = kinetile(FOUR, "--json")
    lines = result.stderr.splitlines()
    assert lines[0].startswith("compiling the loop for naive, disc, wall (once for this choice of phases")
    assert re.fullmatch(r"compiled in \d+\.\d CPU s", lines[1])
    assert json.loads(result.stdout)["run"]["status"] == "complete"


@pytest.mark.skipif(sys.platform == "win32", reason="sends POSIX signals")
@pytest.mark.usefixtures("hanging_up")
@pytest.mark.parametrize("name", first(1, ["SIGTERM", "SIGHUP", "SIGINT"]))
@pytest.mark.parametrize(
    "line",
    first(
        2,
        [
            "export grid -s bodies=4 --to f.xyz",
            "draw grid --out d.svg",
            "view grid -s bodies=4 --until 0.1 --out v.html",
        ],
    ),
)
def test_a_signal_left_hidden_files_of_commands_other_than_run(line, name, tmp_path, monkeypatch):
    """It ended the process in the middle of ``replacing``."""
    number = getattr(signal, name)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(os, "fsync", lambda descriptor: signal.raise_signal(number))
    before = signal.signal(number, lambda *_: pytest.fail("the command leaves it to the system"))
    try:
        result = kinetile(line)
    finally:
        signal.signal(number, before)
    assert (result.exit_code, result.stdout) == (128 + number, "")
    assert result.stderr.endswith("kinetile: interrupted\n")
    assert list(tmp_path.iterdir()) == []


def test_ctrl_c_while_modules_are_imported_or_code_is_loaded_became_another_error(monkeypatch, tmp_path):
    """An import turns a KeyboardInterrupt of a class body into a RuntimeError, and a callback of the compiler
    loses it; the signal waits for their end."""
    from kinetile.run.interrupts import comes_later

    (tmp_path / "pressed.py").write_text(
        "import signal\nsignal.raise_signal(signal.SIGINT)\nloaded = True\n", encoding="utf-8"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    later = []

    def interrupt(number, frame):
        later.append(comes_later(number, frame))
        if not later[-1]:
            raise KeyboardInterrupt

    before = signal.signal(signal.SIGINT, interrupt)
    try:
        assert importlib.import_module("pressed").loaded
        with pytest.raises(KeyboardInterrupt):
            [time.sleep(0.05) for _ in range(200)]  # one long sleep would go on to its end
    finally:
        signal.signal(signal.SIGINT, before)
    assert later == [True, False]


@pytest.mark.parametrize("events", [False, True])
def test_encounters_are_written_with_and_without_an_event_file(tmp_path, events):
    if events:
        pytest.importorskip("pyarrow")
    scene = kt.Scene(
        [(1.0, 2.0), (3.0, 1.75)], [(1.0, 0.0), (-1.0, 0.0)], 0.25, kind="a", responses={("a", "a"): "pass"}
    )
    kt.save_scene(scene, tmp_path / "s.toml")
    out = tmp_path / "e.csv"
    more = ("--events", tmp_path / "e.parquet") if events else ()
    kinetile("run --until 2.5 --encounters", out, *more, tmp_path / "s.toml", code=0)
    names, line = out.read_text("utf-8").split()
    assert names == "a,b,mx,my,begin,end,duration,closest,closest_time"
    assert line.split(",")[:4] + line.split(",")[-2:] == ["0", "1", "0", "0", "0.25", "1.0"]
    again = kinetile("run --until 2.5 --encounters", out, tmp_path / "s.toml")
    assert "is there already" in again.stderr or "exists" in again.stderr
    refused = kinetile(
        "run --encounters", tmp_path / "f.csv", "--checkpoint", tmp_path / "c.kt", tmp_path / "s.toml"
    )
    assert "--encounters is of one whole run" in refused.stderr
