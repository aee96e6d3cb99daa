"""Displays of a notebook: readable, escaped, small, and never an error."""

import math
import subprocess
import sys
import textwrap
import threading
from base64 import b64decode
from importlib import import_module
from xml.etree import ElementTree

import pytest

import broken_phases
import kinetile as kt
import lanes
from kinetile.errors import MissedContactError
from kinetile.plugin.drawing import ROLES
from kinetile.show import html
from kinetile.show.html import facts, grid, paragraph
from kinetile.show.notebook import TYPES, load_ipython_extension
from registering import registered

SVG = "{http://www.w3.org/2000/svg}"


class Read:
    def __init__(self, page: str) -> None:
        root = ElementTree.fromstring(f"<div>{page}</div>")  # every element is closed
        tags = {"table", "caption", "tr", "th", "td", "p", "div", "img"}
        assert {each.tag for each in root.iter()} <= tags
        assert not any("color" in each.get("style", "") for each in root.iter())  # the page's own
        images = [*root.iter("img")]
        self.lines = [["".join(cell.itertext()) for cell in row] for row in root.iter("tr")]
        self.pictures = [
            b64decode(each.get("src").removeprefix("data:image/svg+xml;base64,")) for each in images
        ]
        self.words = [each.get("alt") for each in images]
        self.said = ["".join(each.itertext()) for each in root.iter("p")]

    def __getitem__(self, label):
        return dict(line for line in self.lines if len(line) == 2)[label]


def shown(thing) -> Read:
    return Read(kt.as_html(thing))


def shapes(svg) -> int:
    groups = ElementTree.fromstring(svg).iter(f"{SVG}g")
    return sum(len(group) for group in groups if group.get("class") in ROLES)


def circles(svg) -> int:
    return len(ElementTree.fromstring(svg).findall(f".//{SVG}circle"))


def random(bodies=9, **more):
    return kt.make_scene("random", bodies=bodies, seed=4, **more)


def test_all_text_is_escaped():
    page = facts("a < b", [("<i>", "x & y")]) + grid("<c>", ["<h>"], [["<td>"]], [False]) + paragraph("<p>")
    found = Read(page)
    assert found.lines == [["<i>", "x & y"], ["<h>"], ["<td>"]]
    assert found.said == ["<p>"]
    scene = kt.Scene([[1.0, 1.0]], [[0.0, 0.0]], 0.5, kind="<script>", origin={"file": "<b>.toml"})
    assert shown(scene)["from"] == "<b>.toml"
    assert shown(scene)["kinds"] == "<script> (1)"


def test_a_scene_says_what_it_is_and_shows_its_bodies():
    scene = kt.Scene(
        [[1.0, 1.0], [3.0, 1.0], [5.0, 1.0]],
        [[0.5, 0.0], [0.0, 0.0], [0.0, 0.0]],
        [0.25, 0.5, 0.5],
        mass=[1.0, 2.0, math.inf],
        arena=(8.0, 2.0),
        kind=["ball", "sensor", "post"],
        responses={("ball", "sensor"): "pass"},
        commands=[
            kt.Insert(0.5, (2.0, 0.5), (0.0, 1.0), 0.125),
            kt.Turn(0, 0.75, (1.0, 0.0)),
            kt.Remove(1, 1.0),
        ],
        settings=kt.Settings("sap-1d", options={"sap-1d": {"axis": "y"}}, until=2.0),
    )
    found = shown(scene)
    assert dict(found.lines) == {
        "walls": "in 8 x 2",
        "radii": "0.25 to 0.5",
        "masses": "1 to 2; 1 disc that nothing can move",
        "speeds": "0 to 0.5",
        "kinds": "ball (1), sensor (1), post (1)",
        "responses": "ball and sensor: pass",
        "commands": "1 turn, 1 insertion, 1 removal",
        "time": "from 0 to 2",
        "broad phase": "sap-1d (axis=y)",
    }
    (picture,) = found.pictures
    assert circles(picture) == 3
    assert found.words == ["Picture: a scene: 3 discs at time 0"]
    assert kt.as_svg(scene).encode() == picture


def test_the_display_of_a_periodic_scene_did_not_say_so():
    scene = kt.Scene([[1.0, 1.0]], [[0.0, 0.0]], 0.25, arena=(8.0, 2.0), periodic="xy")
    assert shown(scene)["walls"] == "in 8 x 2, periodic along x and y"
    assert shown(kt.Simulation(scene))["scene"] == "in 8 x 2, periodic along x and y"


@pytest.mark.parametrize("scene", [kt.Scene([], [], []), kt.Scene([[0.0, 0.0]], [[0.0, 0.0]], 1.0)])
def test_next_to_nothing_displays_too(scene):
    assert circles(shown(scene).pictures[0]) == len(scene)
    assert circles(shown(kt.Simulation(scene)).pictures[0]) == len(scene)


def test_a_simulation_shows_the_structure_that_is_built_and_builds_none():
    sim = kt.Simulation(random(), "sweep-tiling")
    before = shown(sim)
    assert before.said == ["Without the structure: it is not built yet; run() or build() does that."]
    assert (circles(before.pictures[0]), shapes(before.pictures[0])) == (9, 0)
    assert (sim.built, sim.cached in (False, True, None)) == (False, True)
    sim.run(until=0.25)
    after = shown(sim)
    assert after.said == []
    assert shapes(after.pictures[0]) > len(sim.drawing())  # and the legend
    assert after["broad phase"] == "sweep-tiling"
    assert after["time"] == "0 to 0.25"
    assert after["fingerprint"] == sim.fingerprint
    assert kt.as_svg(sim).encode() == after.pictures[0]


def test_to_be_shown_changes_nothing():
    one, two = (kt.Simulation(random(), "cells") for _ in range(2))
    for time in (0.0, 0.25, 0.5):
        one.run(until=time)
        two.run(until=time)
        shown(one)
    assert one.snapshot() == two.snapshot()


def test_inserted_bodies_are_in_the_picture_and_removed_ones_are_not():
    sim = kt.Simulation(
        kt.Scene([[1.0, 1.0], [3.0, 1.0]], [[0.0, 0.0]] * 2, 0.5, arena=(6.0, 2.0)), live=True
    )
    sim.run(until=0.25)
    sim.remove(0)
    sim.insert((5.0, 1.0), radius=0.25)
    found = shown(sim)
    radii = [float(c.get("r")) for c in ElementTree.fromstring(found.pictures[0]).findall(f".//{SVG}circle")]
    assert radii == pytest.approx([0.5 * 640 / 6, 0.25 * 640 / 6], abs=0.006)
    assert found["bodies"] == "2 now"


def test_readings_are_the_lines_of_the_command():
    sim = kt.Simulation(random())
    sim.run(until=0.25)
    found = shown(sim.readings)
    assert found["fingerprint"] == sim.fingerprint
    assert found["contacts"].startswith(f"{len(sim.contacts):,} (")


def test_what_was_observed_had_no_display():
    sim = kt.Simulation(kt.make_scene("grid", bodies=4), "naive")
    sim.run(until=0.5, observe=["energy", "msd:lags=3", "rates:every=0.75"])
    heads, energy, msd, rates = shown(sim.observed).lines
    assert heads == ["observable", "quantity", "mean", "standard error", "95 % within", "blocks"]
    assert (energy[:2], energy[3:5], msd[2]) == (["energy", "E"], ["0", "0"], "4 values over time")
    assert rates[5] == "0; no number in 1 samples, every 0.75 from 0 on"


@pytest.mark.parametrize(
    ("bodies", "text", "pictures"),
    [
        (html.MOST_STRUCTURE + 1, "Without the structure: it is drawn here for up to 250 bodies.", 1),
        (html.MOST_BODIES + 1, "No picture: more than 2,000 bodies are not drawn here.", 0),
    ],
)
def test_of_many_bodies_less_is_drawn_and_that_is_said(bodies, text, pictures):
    scene = kt.Scene([[4.0 * k, 0.0] for k in range(bodies)], [[0.0, 0.0]] * bodies, 1.0)
    sim = kt.Simulation(scene, "cells")
    if pictures:
        sim.build()
    found = shown(sim)
    assert (found.said, len(found.pictures)) == ([text], pictures)
    assert len(shown(scene).pictures) == pictures
    assert (kt.as_svg(scene) is None) == (pictures == 0)
    assert len(kt.as_html(sim)) < 60_000 * pictures + 4_000


def test_a_structure_of_many_shapes_is_left_out(monkeypatch):
    monkeypatch.setattr(html, "MOST_SHAPES", 100)
    sim = kt.Simulation(kt.make_scene("grid", bodies=16, density=0.2), "naive")
    sim.build()
    found = shown(sim)
    assert found.said == ["Without the structure: it has 120 shapes, and up to 100 are drawn here."]
    assert shapes(found.pictures[0]) == 0


def test_a_fault_displays_until_it_is_left():
    head_on = kt.Scene(
        [[1.0, 1.0], [2.0, 1.0], [1.25, 1.8125]],
        [[1.0, 0.0], [-1.0, 0.0], [0.0, -1.0]],
        0.25,
        arena=(4.0, 4.0),
    )
    with registered(*broken_phases.SPECS):
        sim = kt.Simulation(head_on, "adds-when-deep")
        start = sim.snapshot()
        with pytest.raises(MissedContactError) as caught:
            sim.run(until=4.0)
        found = shown(sim)
        assert found["ended by"] == sim.fault == f"MissedContactError: {caught.value}"
        assert circles(found.pictures[0]) == 3
        sim.restore(start)
    assert sim.fault is None
    assert "ended by" not in dict(line for line in shown(sim).lines)


def test_a_draw_that_is_wrong_costs_the_structure_and_nothing_else(monkeypatch):
    sim = kt.Simulation(random())
    sim.run(until=0.25)

    def fail():
        raise RuntimeError("no <pen>")

    monkeypatch.setattr(sim, "drawing", fail)
    found = shown(sim)
    assert found.said == ["Without the structure: RuntimeError: no <pen>."]
    assert circles(found.pictures[0]) == 9


def test_whatever_goes_wrong_is_said_instead(monkeypatch):
    scene = random()
    monkeypatch.setattr(html, "picture_of_scene", lambda scene: 1 / 0)
    assert shown(scene).said == ["Scene: cannot be shown: ZeroDivisionError: division by zero"]
    assert kt.as_svg(scene) is None


def test_a_run_in_another_thread_is_not_drawn_in_the_middle_of_a_step():
    sim = kt.Simulation(random())
    sim.run(until=0.25)
    held, done = threading.Event(), threading.Event()

    def watch(progress):
        held.set()
        assert done.wait(60)

    run = threading.Thread(target=sim.run, args=(0.5,), kwargs={"progress": watch})
    run.start()
    assert held.wait(60)
    found = shown(sim)
    done.set()
    run.join()
    (text,) = found.said
    assert text.startswith("No picture: this simulation is running in another thread")
    assert found["broad phase"] == "cells"


def test_from_its_own_progress_a_run_is_drawn():
    sim = kt.Simulation(random(), "sap-2d")
    seen = []
    sim.run(until=0.25, progress=lambda progress: seen.append(shown(sim)))
    assert all(found.said == [] and shapes(found.pictures[0]) for found in seen)


IPYTHON = "displays are registered with IPython: pip install 'kinetile[notebooks]'"


def test_the_types_are_where_they_are_looked_up():
    for module, name in TYPES:
        assert getattr(import_module(module), name).__module__ == module


def test_a_shell_shows_scenes_simulations_and_readings():
    pytest.importorskip("IPython", reason=IPYTHON)
    from IPython.core.formatters import DisplayFormatter

    class Shell:
        display_formatter = DisplayFormatter()

    load_ipython_extension(Shell)
    scene = kt.make_scene("grid", bodies=4)
    sim = kt.Simulation(scene)
    sim.run(until=0.1)
    for thing in (scene, sim):
        shown, _ = Shell.display_formatter.format(thing)
        assert shown["text/html"] == kt.as_html(thing)
        assert shown["image/svg+xml"] == kt.as_svg(thing)
        assert shown["text/plain"] == repr(thing)
    for thing in (sim.readings, sim.observed):
        shown, _ = Shell.display_formatter.format(thing)
        assert shown["text/html"] == kt.as_html(thing)
        assert "image/svg+xml" not in shown


@pytest.mark.parametrize("first", lanes.first(1, ["IPython", "kinetile"]))
def test_registering_imports_nothing_that_is_shown(first):
    """Where IPython came after kinetile, ``%load_ext kinetile.show.notebook`` registers the displays."""
    pytest.importorskip("IPython", reason=IPYTHON)
    begin = "import kinetile" if first == "kinetile" else "import IPython"
    script = f"""
        import sys
        {begin}
        from IPython.core.interactiveshell import InteractiveShell
        shell = InteractiveShell.instance()
        import kinetile
        if {first == "kinetile"}:
            shell.run_line_magic("load_ext", "kinetile.show.notebook")
        assert not {{"numpy", "numba"}} & set(sys.modules)
        scene = kinetile.Scene([[0.0, 0.0]], [[0.0, 0.0]], 1.0)
        shown, _ = shell.display_formatter.format(scene)
        assert shown["text/html"] == kinetile.as_html(scene)
    """
    subprocess.run([sys.executable, "-c", textwrap.dedent(script)], check=True)
