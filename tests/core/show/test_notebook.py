"""Displays in IPython: registered by name when kinetile is imported there, and imported when one is shown."""

import subprocess
import sys
import textwrap
from importlib import import_module

import pytest

import kinetile as kt
from kinetile.show.notebook import TYPES, load_ipython_extension

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
    shown, _ = Shell.display_formatter.format(sim.readings)
    assert shown["text/html"] == kt.as_html(sim.readings)
    assert "image/svg+xml" not in shown


@pytest.mark.parametrize("first", ["kinetile", "IPython"])
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
