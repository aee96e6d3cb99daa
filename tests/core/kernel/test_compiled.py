"""The fingerprint of a compiled loop, without which stale code would run, and the cache on the disk."""

import ast
import enum
import errno
import os
import pickle
import re
import shutil
import subprocess
import sys
import time
import tomllib
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

import numpy as np
import pytest
from _pytest.assertion.rewrite import rewrite_asserts
from llvmlite import binding

import kinetile
import kinetile_plugins
from kinetile.kernel import compiled
from kinetile.kernel.compiled import backend, composer
from kinetile.kernel.compiled.fingerprint import fingerprint

if not compiled.NOTHING_IS_COMPILED:
    from kinetile.kernel.compiled import cache
    from kinetile.kernel.compiled.cache import KeptHook

needs_compiler = pytest.mark.skipif(compiled.NOTHING_IS_COMPILED, reason="nothing is compiled")


class State(NamedTuple):
    first: object
    second: object


class Swapped(NamedTuple):
    second: object
    first: object


def module(name: str, source: str, **names: object) -> ModuleType:
    made = ModuleType(name)
    made.__dict__.update(names)
    exec(f"from __future__ import annotations\n{source}", made.__dict__)
    return made


def hook_of(source: str, **names: object):
    return module("phase", source, **names).hook


def prints(hook, state=State) -> str:
    return fingerprint(hook, state)[0]


def in_a_package(answer: int):
    package = ModuleType("pk")
    package.helpers = module("pk.helpers", f"def f():\n    return {answer}\n")
    return hook_of("def hook():\n    return pk.helpers.f()\n", pk=package)


def in_a_closure(answer: int, default: int = 0):
    def hook(x=default):
        return x + answer

    return hook


INTRINSIC = """
@intrinsic
def constant(typing_context, x):
    def codegen(context, builder, signature, arguments):
        return context.get_constant(types.int64, {})
    return types.int64(x), codegen

def hook(x):
    return constant(x)
"""


def in_an_intrinsic(answer: int):
    """Code within a function that makes code; only functions of two files of the kernel were seen."""
    from numba.core import types
    from numba.extending import intrinsic

    return hook_of(INTRINSIC.format(answer), intrinsic=intrinsic, types=types)


def made_apart(answer: int):
    source = f"def answer(x: float) -> int:\n    return int(x) + {answer}\n"
    return compiled.apart(module("other", source).answer)


def calling(function):
    return hook_of("def hook(x):\n    return answer(x)\n", answer=function)


@pytest.mark.parametrize(
    "made",
    [
        in_a_package,
        lambda n: hook_of("def hook():\n    return Kind.A\n", Kind=enum.IntEnum("Kind", {"A": n})),
        lambda n: hook_of(f'def hook(word="{n}"):\n    return word\n'),
        in_a_closure,
        lambda n: in_a_closure(1, n),
        pytest.param(in_an_intrinsic, marks=needs_compiler),
        pytest.param(lambda n: calling(made_apart(n)), marks=needs_compiler),
    ],
)
def test_what_a_hook_reaches_counts_wherever_it_is(made):
    assert prints(made(1)) == prints(made(1)) != prints(made(2))


def test_an_array_s_elements_counted_and_what_they_are_did_not():
    given = [np.array(each) for each in ([1, 2], [[1, 2]], [5e-324, 1e-323])]
    made = [hook_of("def hook():\n    return table[0]\n", table=each) for each in given]
    assert given[0].tobytes() == given[1].tobytes() == given[2].tobytes()
    assert len(set(map(prints, made))) == 3


def test_options_of_numba_did_not_count(monkeypatch):
    """What NUMBA_OPT=0 had compiled was loaded by every later process."""
    before = prints(calling(len))
    for name, counts in (("NUMBA_OPT", True), ("NUMBA_BOUNDSCHECK", True), ("NUMBA_CACHE_DIR", False)):
        with monkeypatch.context() as patch:
            patch.setenv(name, "0")
            assert (prints(calling(len)) != before) is counts


def test_a_docstring_does_not_count():
    source = 'def hook():\n    """{}"""\n    return "word"\n'
    assert prints(hook_of(source.format("a"))) == prints(hook_of(source.format("b")))


def test_the_order_of_the_fields_of_the_state_counts():
    hook = hook_of("def hook(s):\n    return s.first\n")
    Swapped.__qualname__ = State.__qualname__
    assert prints(hook, State) != prints(hook, Swapped)


def test_an_assertion_that_pytest_rewrote_gave_a_new_name_to_each_process():
    """The name had addresses of pytest's objects in it, so every process compiled the loop again."""
    tree = ast.parse("def hook(x):\n    assert x\n    return x\n")
    rewrite_asserts(tree, b"")
    names: dict[str, object] = {}
    exec(compile(tree, "phase", "exec"), names)
    before = prints(names["hook"])
    names["@pytest_ar"] = object()
    assert prints(names["hook"]) == before


def test_no_assertion_is_in_what_is_compiled():
    """Under pytest, which rewrites its plugins' assertions, loops would have other names than elsewhere."""
    kernel = Path(kinetile.__file__).parent / "kernel"
    folders = [kernel / name for name in ("vectors", "certificates", "loop")]
    for folder in (Path(kinetile_plugins.__file__).parent, *folders):
        for source in folder.rglob("*.py"):
            tree = ast.parse(source.read_text())
            assert not any(isinstance(node, ast.Assert) for node in ast.walk(tree)), source


@needs_compiler
def test_a_function_that_was_called_apart_and_became_a_hook_was_called_at_no_address():
    answer = module("other", "def answer(x: float) -> int:\n    return int(x)\n").answer
    marks = (compiled.hook, compiled.subroutine, compiled.apart)
    assert len({prints(calling(mark(answer))) for mark in marks}) == 3


@needs_compiler
def test_a_global_was_changed_by_a_hook_for_as_long_as_it_ran_as_python():
    with pytest.raises(TypeError, match="hook assigns to a global variable; a hook keeps values in its"):
        hook_of("@mark\ndef hook():\n    global count\n    count = 1\n", mark=compiled.hook)


def test_a_constant_that_no_hook_names_is_refused():
    with pytest.raises(TypeError, match="no hook names PERIODC"):
        compiled.with_constants([compiled.larger], PERIODC=True)


OUTSIDE = False


@compiled.hook
def inner(one: int) -> int:
    return one if OUTSIDE else -one


@compiled.hook
def middle(one: int) -> int:
    return inner(one)


@compiled.hook
def outer(one: int) -> int:
    return middle(one) if OUTSIDE else 0


def test_a_hook_that_was_not_listed_kept_the_constants_of_its_module():
    with pytest.raises(TypeError, match="outer calls middle, which is not listed before it"):
        compiled.with_constants([inner, outer], OUTSIDE=True)
    assert compiled.with_constants([inner, middle, outer], OUTSIDE=True)["outer"](3) == 3


def test_what_is_called_apart_is_loaded_and_called():
    one, two = made_apart(1), made_apart(2)
    for function, found in ((one, 42), (two, 43)):
        assert compiled.compose(template, {"answer": function}, f"apart {found}", State)(41.5) == found


LOADED = """
import kinetile as kt
from kinetile.kernel.certificates.discs import straight_touch
sim = kt.Simulation(kt.make_scene("two-discs"), "naive", compiled=True)
assert sim.cached is {known}, sim.cached
assert straight_touch.known.address is None
sim.run(4.0, max_contacts=20)
assert straight_touch.known.address is not None
print(sim.fingerprint)
"""


PACKAGES = [Path(package.__file__).parent for package in (kinetile, kinetile_plugins)]


def run_loaded(cache: Path, known: bool, sources: list[str], extra: str = "") -> str:
    where = {
        **os.environ,
        "NUMBA_CACHE_DIR": str(cache),
        "PYTHONPATH": os.pathsep.join([*sources, *sys.path]),
    }
    command = [sys.executable, "-c", LOADED.format(known=known) + extra]
    ended = subprocess.run(command, env=where, capture_output=True, text=True, timeout=600)
    assert ended.returncode == 0, ended.stderr
    return ended.stdout


def written(cache: Path) -> dict[Path, int]:
    return {path: path.stat().st_mtime_ns for path in cache.rglob("*.nb*")}


@pytest.fixture(scope="module")
def compiled_once(tmp_path_factory) -> tuple[Path, str]:
    cache = tmp_path_factory.mktemp("cache")
    return cache, run_loaded(cache, False, [str(package.parent) for package in PACKAGES])


@pytest.mark.slow
@needs_compiler
def test_each_new_environment_compiled_everything_anew(compiled_once, tmp_path):
    """The same sources at another path, with other dates, load the code compiled for the first, and what
    that calls."""
    cache, printed = compiled_once
    files = written(cache)
    assert files
    for package in PACKAGES:
        shutil.copytree(package, tmp_path / package.name, copy_function=shutil.copyfile)
    there = f"\nassert kt.__file__.startswith({str(tmp_path)!r})\n"
    assert run_loaded(cache, True, [str(tmp_path)], there) == printed
    assert written(cache) == files


def one_more(x: float) -> int:
    return int(x) + 1


def template(x):
    return answer(x)  # noqa: F821 - a part


def composed_again():
    """A hook that calls another function separately, as in a process with nothing in memory yet."""
    return composer._compose(template, {"answer": compiled.apart(one_more)}, "damaged", State)


@pytest.fixture
def folder(monkeypatch, tmp_path) -> Path:
    import numba

    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    return tmp_path


@needs_compiler
def test_machine_code_that_is_not_used_stayed_for_ever(folder):
    assert composed_again()(41.5) == 42
    used = sorted(folder.rglob("*.nb[ic]"))
    old = used[0].with_name("old.nbc")
    old.write_bytes(b"")
    past = time.time() - 31 * 86400
    for path in (*used, old):
        os.utime(path, (past, past))
    assert composed_again()(41.5) == 42  # is loaded, and counts as used
    for path in used:
        assert path.stat().st_atime > past + 86400
    used[0].unlink()
    assert composed_again()(41.5) == 42  # one is written
    assert sorted(folder.rglob("*.nb[ic]")) == used


@needs_compiler
def test_machine_code_that_was_used_filled_the_disk(folder, monkeypatch):
    """Only its age was limited: the entry that was not used for longest is removed first, hooks or loops."""
    names = [f"loop.{number}.nbi" if number % 2 else f"hook_{number}.nbh" for number in range(6)]
    for number, name in enumerate(names):
        (folder / name).write_bytes(bytes(100))
        used = time.time() - 1000 * (number * 5 % 6)
        os.utime(folder / name, (used, used - 5000))
    monkeypatch.setattr(cache, "_MOST_BYTES", 399)
    cache._remove_unused(folder)
    assert sorted(path.name for path in folder.iterdir()) == sorted(names[number] for number in (0, 5, 4))


def damages(content: bytes):
    """Files that are cut off, or have a flipped bit, at places all over it."""
    for number in (0, 5):
        place = number * len(content) // 8
        yield content[:place]
        yield content[:place] + bytes([content[place] ^ 1 << number]) + content[place + 1 :]


@needs_compiler
@pytest.mark.usefixtures("compiled_here")
def test_a_damaged_file_of_the_cache_ended_every_run_from_then_on(folder, caplog):
    """Cuts off, empty, with a flipped bit, in the machine code too, or copied from another, so that its own
    checksum is right: said once, and written again."""
    assert composed_again()(41.5) == 42
    files = sorted(folder.rglob("*.nb[ic]"))
    assert sorted(file.suffix for file in files) == [".nbc", ".nbc", ".nbi", ".nbi"]
    for file in files:
        copied = [other.read_bytes() for other in files if other != file]
        for damaged in (*damages(file.read_bytes()), *copied):
            file.write_bytes(damaged)
            assert compiled.is_cached(composed_again()) is ("one_more" in file.name)
            caplog.clear()
            assert composed_again()(41.5) == 42
            assert [record.name for record in caplog.records] == ["kinetile"]
            assert "it is dropped, and compiled again" in caplog.text
            assert ("that of another file" in caplog.text) or damaged not in copied
            caplog.clear()
            assert compiled.is_cached(composed_again())
            assert composed_again()(41.5) == 42
            assert not caplog.records
        file.unlink()
        os.mkfifo(file)  # to open it would wait for ever
        assert composed_again()(41.5) == 42
        assert file.is_file()
    assert sorted(folder.rglob("*.nb[ic]*")) == files


def hooks_again(answer: int = 1):
    """Two hooks; one of them calls a third with an answer in it, as in a process that has nothing yet."""
    made = module("hooked", "def least(x):\n    return int(x)\n")
    least = compiled.hook(made.least)
    source = f"def hook(x):\n    return least(x) + {answer}\n"
    edited = compiled.unchecked(compiled.hook(hook_of(source, least=least)))
    return composer._compose(template, {"answer": edited}, "hooked", State)


def kept(folder: Path) -> dict[str, Path]:
    return {path.name.partition("_")[0]: path for path in folder.rglob("*.nbh")}


@needs_compiler
@pytest.mark.usefixtures("compiled_here")
def test_one_line_of_a_hook_had_all_hooks_compiled_again(folder, monkeypatch):
    saved = []
    save = KeptHook.save
    monkeypatch.setattr(KeptHook, "save", lambda self, data: saved.append(self.name) or save(self, data))
    assert hooks_again()(41.5) == 42
    assert [name.partition("_")[0] for name in saved] == ["least", "hook"]
    assert hooks_again(2)(41.5) == 43
    assert [name.partition("_")[0] for name in saved[2:]] == ["hook"]
    for path in folder.rglob("*.nb[ic]"):
        path.unlink()
    assert hooks_again()(41.5) == 42
    assert len(saved) == 3


@needs_compiler
@pytest.mark.usefixtures("compiled_here")
def test_counts_of_references_had_names_of_each_hook_and_were_not_pruned(folder):
    """A loop of hooks with NumPy's arrays took seven times as long."""
    counted = compiled.hook(hook_of("def hook(s):\n    return s.first[1:][0]\n"))
    tables = State(np.arange(3), np.arange(3))
    assert composer._compose(template, {"answer": counted}, "counted", State)(tables) == 1
    modules = [binding.parse_bitcode(pickle.loads(path.read_bytes())[0]) for path in kept(folder).values()]
    linked = [each.linkage for module in modules for each in module.functions if each.name.startswith("NRT_")]
    assert linked
    assert binding.Linkage.internal not in linked


@needs_compiler
@pytest.mark.usefixtures("compiled_here")
def test_a_hook_on_disk_that_is_damaged_or_another_is_compiled_again(folder, caplog):
    assert hooks_again()(41.5) == 42
    file, other = (kept(folder)[name] for name in ("hook", "least"))
    whole = file.read_bytes()
    for damaged in (*damages(whole), other.read_bytes(), None):
        file.unlink()
        if damaged is None:
            os.mkfifo(file)  # to open it would wait for ever
        else:
            file.write_bytes(damaged)
        for said in (1, 0):
            for path in folder.rglob("*.nb[ic]"):
                path.unlink()
            caplog.clear()
            assert hooks_again()(41.5) == 42
            assert caplog.text.count("it is dropped, and compiled again") == len(caplog.records) == said


@needs_compiler
@pytest.mark.usefixtures("compiled_here")
def test_a_damaged_cache_had_a_line_for_each_hook(folder, caplog):
    assert hooks_again()(41.5) == 42
    for path in folder.rglob("*.nb[ih]"):
        path.write_bytes(b"")
    assert hooks_again()(41.5) == 42
    assert len(caplog.records) == 1
    assert "and 2 more functions in " in caplog.text


@needs_compiler
@pytest.mark.usefixtures("compiled_here")
def test_machine_code_for_other_arguments_is_not_loaded_under_a_name_of_its_own(folder, monkeypatch, caplog):
    """Two processes may number the machine code of two signatures differently."""
    import numba

    folders = folder / "one", folder / "other"
    for each, given in zip(folders, (41.5, 41), strict=True):
        monkeypatch.setattr(numba.config, "CACHE_DIR", str(each))
        assert composed_again()(given) == 42
    mine, other = (next(each.rglob("*damaged*.1.nbc")) for each in folders)
    other.write_bytes(mine.read_bytes())
    assert composed_again()(41) == 42
    assert "that of another file" in caplog.text


@needs_compiler
def test_a_long_compilation_is_told(folder, monkeypatch, caplog):
    monkeypatch.setattr(composer, "SLOW", 0.0)
    with caplog.at_level("INFO", "kinetile"):
        assert composed_again()(41.5) == 42
    assert re.search(r"compiled in [0-9.]+ CPU seconds", caplog.text)


@needs_compiler
@pytest.mark.usefixtures("compiled_here")
def test_a_cache_that_could_not_be_written_was_not_read_and_nothing_was_said(folder, monkeypatch, caplog):
    """A loop is kept; then nothing can be written, the disk is full, and there is no folder at all."""
    from numba.core.caching import IndexDataCacheFile

    def failing(number):
        def fails(*arguments, **named):
            raise OSError(number, os.strerror(number))

        return fails

    assert composed_again()(41.5) == 42
    monkeypatch.setattr(IndexDataCacheFile, "_open_for_write", failing(errno.EROFS))
    monkeypatch.setattr(cache.tempfile, "TemporaryFile", failing(errno.EROFS))
    assert compiled.is_cached(composed_again())
    assert composed_again()(41.5) == 42
    assert caplog.text == ""
    for number in (errno.EROFS, errno.ENOSPC, errno.ENOTDIR):
        monkeypatch.setattr(IndexDataCacheFile, "_open_for_write", failing(number))
        if number == errno.ENOTDIR:
            (folder / "file").touch()
            monkeypatch.setattr("numba.config.CACHE_DIR", str(folder / "file"))
        assert [hooks_again(number)(41.5) for _ in range(2)] == [41 + number] * 2
        (record,) = caplog.records
        assert (record.name, record.levelname) == ("kinetile", "WARNING")
        assert f"({os.strerror(number)}): each process compiles again what is not there" in record.message
        caplog.clear()


def test_the_versions_of_numba_are_those_of_the_package():
    project = tomllib.loads((Path(__file__).parents[3] / "pyproject.toml").read_text())["project"]
    assert f"numba{backend.VERSIONS}" in project["dependencies"]
    low, below = (tuple(map(int, each)) for each in re.findall(r"(\d+)\.(\d+)", backend.VERSIONS))
    assert low <= tuple(map(int, backend.numba.__version__.split(".")[:2])) < below


@pytest.mark.parametrize("part", backend.MEMBERS)
def test_a_member_that_a_later_numba_has_not_is_named_in_one_sentence(monkeypatch, part):
    """Each part: a class, of which some attributes are set in its methods alone, or a module."""
    backend.check()
    monkeypatch.setitem(backend.MEMBERS, part, f"{backend.MEMBERS[part]} _of_another_version")
    with pytest.raises(ImportError, match=r"_of_another_version; install numba>=[\d.]+,<[\d.]+$") as error:
        backend.check()
    assert "\n" not in str(error.value)
    assert f"{part.__name__} has no " in str(error.value)
