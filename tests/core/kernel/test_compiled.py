"""The fingerprint of the composer loop: what is compiled into it must be in it, or stale code would run."""

from __future__ import annotations

import ast
import enum
import errno
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

import pytest
from _pytest.assertion.rewrite import rewrite_asserts

import kinetile
import kinetile_plugins
from kinetile.kernel import compiled
from kinetile.kernel.compiled import composer
from kinetile.kernel.compiled.fingerprint import fingerprint


class State(NamedTuple):
    """Two arrays."""

    first: object
    second: object


class Swapped(NamedTuple):
    """The same two, the other way round."""

    second: object
    first: object


def module(name: str, source: str, **names: object) -> ModuleType:
    made = ModuleType(name)
    made.__dict__.update(names)
    exec(source, made.__dict__)
    return made


def prints(hook, state=State) -> str:
    return fingerprint(hook, state)[0]


def test_a_hook_that_is_reached_through_a_package_and_a_module_counts():
    prints_of = []
    for answer in (1, 2):
        helpers = module("pk.helpers", f"def f():\n    return {answer}\n")
        package = ModuleType("pk")
        package.helpers = helpers
        phase = module("phase", "def hook():\n    return pk.helpers.f()\n", pk=package)
        prints_of.append(prints(phase.hook))
    assert prints_of[0] != prints_of[1]


def test_a_docstring_does_not_count_and_other_words_do():
    source = 'def hook(word="a"):\n    """{}"""\n    return word == "{}"\n'
    one, other, third = (prints(module("phase", source.format(*words)).hook) for words in ("ab", "cb", "ac"))
    assert one == other
    assert one != third


def test_the_members_of_an_enumeration_count():
    prints_of = []
    for value in (5, 7):
        kind = enum.IntEnum("Kind", {"A": value})
        prints_of.append(prints(module("phase", "def hook():\n    return Kind.A\n", Kind=kind).hook))
    assert prints_of[0] != prints_of[1]


def test_the_order_of_the_fields_of_the_state_counts():
    hook = module("phase", "def hook(s):\n    return s.first\n").hook
    Swapped.__qualname__ = State.__qualname__
    assert prints(hook, State) != prints(hook, Swapped)


def test_constants_closures_and_defaults_count():
    def make(value, default=0):
        def hook(x=default):
            return x + value

        return hook

    assert len({prints(make(1)), prints(make(2)), prints(make(1, 3))}) == 3
    assert prints(make(1)) == prints(make(1))


def test_modules_that_change_only_with_their_version_are_not_searched():
    hook = module("phase", "def hook(x):\n    return math.sqrt(x)\n", math=sys.modules["math"]).hook
    assert prints(hook) == prints(hook)


def test_an_assertion_that_pytest_rewrote_gave_a_new_name_to_each_process():
    """The name had addresses of pytest's objects in it, so every process compiled the loop anew."""
    tree = ast.parse("def hook(x):\n    assert x\n    return x\n")
    rewrite_asserts(tree, b"")
    names: dict[str, object] = {}
    exec(compile(tree, "phase", "exec"), names)
    before = prints(names["hook"])
    names["@pytest_ar"] = object()
    assert prints(names["hook"]) == before


def test_no_assertion_is_in_what_is_compiled():
    """Under pytest, which rewrites those of its plugins, loops would have other names than elsewhere."""
    kernel = Path(kinetile.__file__).parent / "kernel"
    folders = [
        Path(kinetile_plugins.__file__).parent,
        kernel / "vectors",
        kernel / "certificates",
        kernel / "loop",
    ]
    for source in (each for folder in folders for each in folder.rglob("*.py")):
        assert not any(isinstance(node, ast.Assert) for node in ast.walk(ast.parse(source.read_text()))), (
            source
        )


@pytest.mark.skipif(compiled.INTERPRETED, reason="nothing is compiled")
def test_without_a_folder_for_the_cache_it_compiles_all_the_same(monkeypatch):
    njit = composer._njit

    def nowhere(function, cache, called):
        if cache:
            raise RuntimeError("cannot cache function: no locator available")
        return njit(function, cache, called)

    monkeypatch.setattr(composer, "_njit", nowhere)
    template = module("phase", "def double(x):\n    return answer(x)\n").double
    answer = compiled.hook(module("other", "def answer(x):\n    return 2 * x\n").answer)
    function = compiled.compose(template, {"answer": answer}, "test", State)
    assert function(21) == 42


@pytest.mark.skipif(compiled.INTERPRETED, reason="nothing is compiled")
def test_what_an_intrinsic_compiles_to_counts_wherever_it_is():
    """It is code within a function that makes code; only those of two files of the kernel were seen."""
    source = """
@intrinsic
def constant(typing_context, x):
    def codegen(context, builder, signature, arguments):
        return context.get_constant(types.int64, {})
    return types.int64(x), codegen

def hook(x):
    return constant(x)
"""
    from numba.core import types
    from numba.extending import intrinsic

    made = [module("phase", source.format(n), intrinsic=intrinsic, types=types).hook for n in (1, 1, 2)]
    one, again, other = map(prints, made)
    assert one == again
    assert one != other


def made_apart(answer: int):
    source = f"def answer(x: float) -> int:\n    return int(x) + {answer}\n"
    named = module("other", "from __future__ import annotations\n" + source)
    return compiled.apart(named.answer)


@pytest.mark.skipif(compiled.INTERPRETED, reason="nothing is compiled")
def test_a_function_that_was_called_apart_and_became_a_hook_was_called_at_no_address():
    source = "from __future__ import annotations\ndef answer(x: float) -> int:\n    return int(x)\n"
    answer = module("other", source).answer

    def asked(function):
        return module("phase", "def asked(x):\n    return answer(x)\n", answer=function).asked

    marks = (compiled.hook, compiled.subroutine, compiled.apart)
    assert len({prints(asked(mark(answer))) for mark in marks}) == 3


@pytest.mark.skipif(compiled.INTERPRETED, reason="nothing is compiled")
def test_what_is_called_apart_counts_and_is_called():
    def calling(function):
        return module("phase", "def asked(x):\n    return answer(x)\n", answer=function).asked

    one, two = made_apart(1), made_apart(2)
    assert prints(calling(one)) != prints(calling(two))
    assert fingerprint(calling(one), State)[2] == [one]
    for function, found in ((one, 42), (two, 43)):
        template = module("phase", "def asked(x):\n    return answer(x)\n").asked
        assert compiled.compose(template, {"answer": function}, f"apart {found}", State)(41.5) == found


LOADED = """
import kinetile as kt
from kinetile.kernel.certificates.contact import look_closer
sim = kt.Simulation(kt.make_scene("two-discs"), "naive")
assert sim.cached is {known}, sim.cached
assert look_closer.known.address is None
sim.run(4.0, max_contacts=20)
assert look_closer.known.address is not None
print(sim.fingerprint)
"""


PACKAGES = [Path(package.__file__).parent for package in (kinetile, kinetile_plugins)]


def run_loaded(cache: Path, known: bool, sources: list[str], extra: str = "") -> str:
    """Run the script in a process of its own with this cache; return what it prints."""
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
    """A cache that one process has filled from nothing, and what that process printed."""
    cache = tmp_path_factory.mktemp("cache")
    return cache, run_loaded(cache, False, [str(package.parent) for package in PACKAGES])


@pytest.mark.slow
@pytest.mark.skipif(compiled.INTERPRETED, reason="nothing is compiled")
def test_each_new_environment_compiled_everything_anew(compiled_once, tmp_path):
    """The same sources at another path, with other dates, load what was compiled for the first, and what
    that calls."""
    cache, printed = compiled_once
    files = written(cache)
    assert files
    for package in PACKAGES:
        shutil.copytree(package, tmp_path / package.name, copy_function=shutil.copyfile)
    there = f"\nassert kt.__file__.startswith({str(tmp_path)!r})\n"
    assert run_loaded(cache, True, [str(tmp_path)], there) == printed
    assert written(cache) == files


SHAPES = """
from kinetile import Scene, box
sim = kt.Simulation(Scene([(1, 1), (4, 1)], [(1, 0), (0, 0)], shape=box(1, 1)), "naive")
sim.run(4.0)
assert len(sim.contacts) == 1
"""


@pytest.mark.slow
@pytest.mark.skipif(compiled.INTERPRETED, reason="nothing is compiled")
def test_a_loop_of_shapes_after_one_of_discs_is_compiled_without_a_warning(tmp_path):
    """Numba warned that a body of a scene with shapes was taken for one of a scene without."""
    quiet = "\nimport warnings\nwarnings.simplefilter('error')\n" + SHAPES
    run_loaded(tmp_path, False, [str(package.parent) for package in PACKAGES], quiet)


@pytest.mark.slow
@pytest.mark.skipif(compiled.INTERPRETED, reason="nothing is compiled")
def test_a_loop_from_the_disk_cache_has_lost_what_it_calls(compiled_once):
    """It is compiled anew, and the loop is not."""
    cache, printed = compiled_once
    lost = [path for path in written(cache) if "look_closer" in path.name]
    assert lost
    for path in lost:
        path.unlink()
    assert run_loaded(cache, True, [str(package.parent) for package in PACKAGES]) == printed


@pytest.mark.skipif(compiled.INTERPRETED, reason="nothing is compiled")
def test_machine_code_that_nobody_uses_stayed_for_ever(monkeypatch, tmp_path):
    import numba

    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    assert composed_anew()(41.5) == 42
    used = sorted(tmp_path.rglob("*.nb[ic]"))
    old = used[0].with_name("old.nbc")
    old.write_bytes(b"")
    past = time.time() - 31 * 86400
    for path in (*used, old):
        os.utime(path, (past, past))
    assert composed_anew()(41.5) == 42  # is loaded, and counts as used
    for path in used:
        assert path.stat().st_atime > past + 86400
    used[0].unlink()
    assert composed_anew()(41.5) == 42  # one is written
    assert sorted(tmp_path.rglob("*.nb[ic]")) == used


# Files of the cache that are damaged


def one_more(x: float) -> int:
    return int(x) + 1


def template(x):
    return answer(x)  # noqa: F821 - a part


def composed_anew():
    """What calls another function apart, as in a process that has nothing in memory yet."""
    return composer._compose(template, {"answer": compiled.apart(one_more)}, "damaged", State)


def damages(content: bytes):
    """Files that are cut off, or have a flipped bit, at places all over it."""
    for number in range(0, 8, 2):
        place = number * len(content) // 8
        yield content[:place]
        yield content[:place] + bytes([content[place] ^ 1 << number]) + content[place + 1 :]


@pytest.mark.skipif(compiled.INTERPRETED, reason="nothing is compiled")
@pytest.mark.usefixtures("compiled_here")
def test_a_damaged_file_of_the_cache_ended_every_run_from_then_on(monkeypatch, tmp_path, caplog):
    """Cut off, empty or with a flipped bit, in the machine code too: said once, and written anew."""
    import numba

    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    assert composed_anew()(41.5) == 42
    files = sorted(tmp_path.rglob("*.nb[ic]"))
    assert sorted(file.suffix for file in files) == [".nbc", ".nbc", ".nbi", ".nbi"]
    for file in files:
        for damaged in damages(file.read_bytes()):
            file.write_bytes(damaged)
            assert compiled.is_cached(composed_anew()) is ("one_more" in file.name)
            caplog.clear()
            assert composed_anew()(41.5) == 42
            assert [record.name for record in caplog.records] == ["kinetile"]
            assert "it is dropped, and compiled anew" in caplog.text
            caplog.clear()
            assert compiled.is_cached(composed_anew())
            assert composed_anew()(41.5) == 42
            assert not caplog.records
    assert sorted(tmp_path.rglob("*.nb*")) == files


@pytest.mark.skipif(compiled.INTERPRETED, reason="nothing is compiled")
def test_a_cache_that_cannot_be_written_any_more_is_done_without(monkeypatch, tmp_path):
    import numba
    from numba.core.caching import IndexDataCacheFile

    def full(*arguments):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(IndexDataCacheFile, "_save_data", full)
    assert composed_anew()(41.5) == 42
    assert composed_anew()(41.5) == 42


@pytest.mark.skipif(compiled.INTERPRETED, reason="nothing is compiled")
@pytest.mark.usefixtures("compiled_here")
def test_a_file_of_the_cache_copied_over_another_was_loaded(monkeypatch, tmp_path, caplog):
    """Each file's checksum was right, so machine code ran under the name of another function."""
    import numba

    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    assert composed_anew()(41.5) == 42
    files = {file: file.read_bytes() for file in sorted(tmp_path.rglob("*.nb[ic]"))}
    for file in files:
        for other in files.values():
            if other != files[file]:
                file.write_bytes(other)
                assert compiled.is_cached(composed_anew()) is ("one_more" in file.name)
                caplog.clear()
                assert composed_anew()(41.5) == 42
                assert "that of another file" in caplog.text
        file.unlink()
        os.mkfifo(file)  # to open it would wait for ever
        assert composed_anew()(41.5) == 42
        assert file.is_file()
        files = {each: each.read_bytes() for each in files}


@pytest.mark.skipif(compiled.INTERPRETED, reason="nothing is compiled")
@pytest.mark.usefixtures("compiled_here")
def test_machine_code_for_other_arguments_is_not_loaded_under_a_name_of_its_own(
    monkeypatch, tmp_path, caplog
):
    """Two processes may number the machine code of two signatures differently."""
    import numba

    folders = tmp_path / "one", tmp_path / "other"
    for folder, given in zip(folders, (41.5, 41), strict=True):
        monkeypatch.setattr(numba.config, "CACHE_DIR", str(folder))
        assert composed_anew()(given) == 42
    mine, other = (next(folder.rglob("*damaged*.1.nbc")) for folder in folders)
    other.write_bytes(mine.read_bytes())
    assert composed_anew()(41) == 42
    assert "that of another file" in caplog.text
