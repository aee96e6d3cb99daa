"""Which modules are a phase's own, and that they do the same under another name."""

from __future__ import annotations

import importlib
import sys

import pytest

import kinetile as kt
from kinetile.errors import BadOption
from kinetile_conformance.mutation.importing import ChangedFinder
from kinetile_conformance.mutation.mutants import mutants_of, source_of
from registering import registered

PACKAGE = {
    "__init__.py": "from .inner.phase import It\nVALUE = 3\n",
    "shared.py": "def shared():\n    return 5\n\ndef unused():\n    return 7\n",
    "apart.py": "def apart():\n    return 11\n",
    "inner/__init__.py": "",
    "inner/deep.py": "from ..shared import shared\nfrom mine.apart import apart as other\nDEEP = 13\n",
    "inner/phase.py": (
        "from __future__ import annotations\n"
        "import math\n"
        "from typing import TYPE_CHECKING\n"
        "from ..shared import (\n    shared,\n)\n"
        "from . import deep\n"
        "from mine.inner.deep import DEEP as D\n"
        "if TYPE_CHECKING:\n    from .never import Never\n"
        "class It:\n"
        "    def prepare(self, scene):\n"
        "        return shared() + deep.other() + D + math.floor(1.5)\n"
    ),
    "inner/never.py": "NEVER = 17\n",
}


@pytest.fixture
def mine(tmp_path, monkeypatch):
    for name, text in PACKAGE.items():
        path = tmp_path / "mine" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)

    with registered(kt.BroadPhaseSpec("mine", "mine.inner.phase:It")):
        yield "mine"
    sys.meta_path[:] = [each for each in sys.meta_path if not isinstance(each, ChangedFinder)]
    for module in [name for name in sys.modules if name.partition(".")[0] in ("mine", "other")]:
        del sys.modules[module]


def test_the_modules_of_the_package_that_are_reached(mine):
    phase = source_of("mine")
    assert phase.target == "mine.inner.phase:It"
    assert [source.module for source in phase.reached] == ["mine.inner.phase", "mine.inner.deep"]


def test_the_built_in_ones():
    rooms = {
        name: {source.module.rpartition(".")[2] for source in source_of(name).reached}
        for name in ("naive", "sap-1d", "cells", "sweep-tiling")
    }
    assert rooms["naive"] == {"naive"}
    assert rooms["sap-1d"] == {"sweep_and_prune", "sorted_bounds"}
    assert rooms["cells"] == {"cells", "hierarchy", "uniform", "layout", "torus", "audit"}
    assert rooms["sweep-tiling"] == {"sweep_tiling", "certificates", "construction", "events", "web"}


def test_under_another_name_it_is_the_same_beside_the_original(mine):
    ChangedFinder("mine", "other", "", "")
    again = importlib.import_module("other.inner.phase")
    assert again.It().prepare(None) == 5 + 11 + 13 + 1
    assert again.deep.__name__ == "other.inner.deep"
    assert again is not importlib.import_module("mine.inner.phase")


def test_a_change_is_in_its_module_and_lines_stay_where_they_were(mine):
    (mutant,) = [each for each in mutants_of(source_of(mine)) if each.label.startswith("deep.py")]
    assert mutant.label == "deep.py:3 constant 13 -> 12"
    ChangedFinder("mine", "other", mutant.source.module, mutant.text)
    again = importlib.import_module("other.inner.phase")
    assert again.It().prepare(None) == 5 + 11 + 12 + 1
    assert again.It.prepare.__code__.co_firstlineno == 12
    assert importlib.import_module("mine.inner.phase").It().prepare(None) == 5 + 11 + 13 + 1


def test_a_class_without_a_file():
    class Nowhere:
        pass

    Nowhere.__module__ = "nowhere"

    class Plugin:
        @kt.hookimpl
        def kinetile_broad_phases(self) -> list[kt.BroadPhaseSpec]:
            return [kt.BroadPhaseSpec("nowhere", Nowhere)]

    plugin = Plugin()
    kt.registry().add(plugin)
    try:
        with pytest.raises(BadOption, match=r"'nowhere': the source of its class nowhere\..* is in no file"):
            source_of("nowhere")
    finally:
        kt.registry().remove(plugin)
