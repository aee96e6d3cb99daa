"""Every function that exists twice, as Python and for compiled code, is one function."""

import ast
import importlib
import pkgutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kinetile.kernel
import kinetile_plugins
from capabilities import FOREIGN, Game
from kinetile.kernel.compiled import NOTHING_IS_COMPILED, compiled_by_default, python_of
from kinetile.kernel.compiled.backend import _Both, types
from kinetile.kernel.compiled.hooks import _ByRecord
from lanes import first
from registering import registered
from two_forms import both_ways

pytestmark = [
    pytest.mark.skipif(NOTHING_IS_COMPILED, reason="nothing is compiled"),
    pytest.mark.usefixtures("compiled_here"),
]


def all_of(kind: type) -> dict[str, Any]:
    """Returns all functions of a kind in kinetile's kernel and its plugins, by their names."""
    found = {}
    for package in (kinetile.kernel, kinetile_plugins):
        for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            for each in vars(importlib.import_module(module.name)).values():
                if type(each) is kind:
                    python = getattr(each, "python", None) or python_of(each)
                    found[f"{python.__module__.rpartition('.')[2]}.{python.__name__}"] = each
    return found


LOWERED, BY_RECORD = all_of(_Both), all_of(_ByRecord)
APART = {name: each for name, each in LOWERED.items() if hasattr(each, "known")}
SHARED = ["walls.reaches_edge", "discs.touch"]
"""Those that are in the loops which tests share."""

GAMES = (
    ("shapes", "gravity", "pass"),
    ("shapes", "rest", "obstacles"),
    ("rest", "radii of many sizes"),
    ("gravity", "pass", "commands, by hand"),
    ("shapes", "pass", "no arena"),
    ("pass", "commands, planned"),
)

LENT = {
    "discs.touch": ("discs.parting", lambda plans, one, two, since: (plans, one, two, 0, -1, since)),
    "shapes.leaves_surely": ("shapes.enters_surely", lambda *given: given),
    "shapes_exactly.farther_out": (
        "shapes_exactly.sign_exactly",
        lambda f, row, face, kind, order, plans, count: (f, row, face, face, plans, count),
    ),
    "quadratic.first_below": (
        "walls.reaches_edge",
        lambda far, near, *rest: (far - near, -0.5, 0.25, 0, *rest[3:]),
    ),
}
"""Functions that hardly any run calls, and the functions whose arguments they get."""


def plain(dtype: np.dtype) -> np.dtype:
    """Returns the type of a record without the properties that Python reads it by."""
    fields = {name: dtype.fields[name] for name in dtype.names}
    formats = [plain(each) if each.names else each for each, *_ in fields.values()]
    offsets = [offset for _, offset, *_ in fields.values()]
    return np.dtype({"names": [*fields], "formats": formats, "offsets": offsets, "itemsize": dtype.itemsize})


def taken(value: Any, kind: Any = None) -> Any:
    """Returns a copy of an argument as compiled code takes it: a record as a table of one."""
    if isinstance(kind, types.CPointer):
        return np.array(value, dtype=np.float64)
    if isinstance(kind, types.BaseTuple):
        return kind.instance_class(*map(taken, value, kind))
    if isinstance(value, np.void):
        return np.frombuffer(value.tobytes(), plain(value.dtype)).copy().view(np.recarray)
    return float(value) if kind is types.float64 or isinstance(value, float) else int(value)


@pytest.fixture(scope="module")
def calls():
    """Returns arguments of calls of each function, in runs as Python."""
    found: dict[int, list[Any]] = {}

    def noting(call: Any) -> Any:
        def noted(function: Any, *given: Any) -> Any:
            of = found.setdefault(id(function), [])
            if len(of) < 40:
                kinds = function.known.signature.args if hasattr(function, "known") else [None] * len(given)
                try:
                    of.append([*map(taken, given, kinds)])
                except TypeError:  # all tables, or a vector
                    of.append(None)
            return call(function, *given)

        return noted

    with pytest.MonkeyPatch.context() as patch, registered(*FOREIGN), compiled_by_default(False):
        for kind in (_Both, _ByRecord):
            patch.setattr(kind, "__call__", noting(kind.__call__))
        for names in GAMES:
            Game(*names).played("cells")
        Game("rest", "radii of many sizes").played("sweep-tiling")
    return found


@pytest.mark.parametrize("name", first(2, [*SHARED, *sorted({*APART} - {*SHARED})]))
def test_a_function_apart_is_the_python_one(name, calls):
    function = APART[name]
    pointed = isinstance(function.known.signature.args[0], types.CPointer)
    compared = both_ways(function, "pointer({})" if pointed else "{}")
    lender, lent = LENT.get(name, (name, lambda *given: given))
    assert calls[id(APART[lender])]
    for given in calls[id(APART[lender])]:
        compared(*lent(*given))


@pytest.mark.slow
def test_hooks_of_two_forms_are_the_python_ones(calls):
    """For records; functions that take all tables, or vectors, are in runs that turn."""
    compared = set()
    for name, function in BY_RECORD.items():
        of_record = both_ways(function, "{}[0]")
        for given in filter(None, calls.get(id(function), ())):
            of_record(*given)
            compared.add((name, function.field in given[0].dtype.names))
    assert {*BY_RECORD} - {name for name, _ in compared} == {
        "bookkeeping._pull_on",
        "certificates.edges",
        "disc._straight",
        "flight.note_pull",
        "images._straight",
        "skin.reach_to",
    }
    assert len(compared) > 10


def test_no_function_that_exists_twice_is_left_out():
    """The others are called by hooks of two files; the replay above takes pointers."""
    trees = [
        ast.parse(Path(__file__).with_name(f"test_{name}.py").read_text()) for name in ("vectors", "views")
    ]
    used = {getattr(node, "attr", getattr(node, "id", "")) for tree in trees for node in ast.walk(tree)}
    assert {name.partition(".")[2] for name in {*LOWERED} - {*APART}} - used == {"prefetch", "pointer"}
