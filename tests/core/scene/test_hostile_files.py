"""A scene file may be anything: it becomes a scene or a sentence, soon, and nothing raw for a terminal."""

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from command_line import refused
from kinetile import load_scene
from kinetile.errors import SceneError
from kinetile.scene.files import loads_scene
from lanes import first

BODY = "[[bodies]]\nposition = [0.25, 0.5]\nradius = 0.125\n"


@contextmanager
def within(seconds: float) -> Iterator[None]:
    """Fails if the work within this context takes more processor time."""
    before = time.process_time()
    yield
    assert time.process_time() - before < seconds


def message(text: str) -> str:
    with pytest.raises(SceneError) as caught:
        loads_scene(text)
    return str(caught.value)


def check_message(error: Exception) -> None:
    """The message is not long, and would do nothing to a terminal."""
    lines = str(error).split("\n")
    assert all(line.isprintable() for line in lines)
    assert len(lines) <= 130
    assert max(map(len, lines)) <= 3100


@pytest.mark.parametrize("number", ["9" * 5000, "0x" + "f" * 5000, "-" + "1" * 4301, "0b1" + "0" * 9000])
@pytest.mark.parametrize(
    "text", ["until = {}\n" + BODY, BODY + "mass = {}", "recipe = 'grid'\n[parameters]\nseed = {}", "{} = 1"]
)
def test_whole_numbers_of_5000_digits_gave_a_traceback(text: str, number: str) -> None:
    sentence = message(text.format(number))
    assert any(part in sentence for part in ("a whole number of", "not known", "Expected '='", "TOML"))


@pytest.mark.parametrize("number", [2**63, -(2**63) - 1, 2**62 + 1])
@pytest.mark.parametrize(
    "line",
    [
        *("[[bodies]]\nposition = [0.5, 0.5]\nshape = {}", "[[commands]]\ntime = 0.5\nremove = {}"),
        *("[[commands]]\ntime = 0.5\nat = [0, 0, {}]\nremove = 0", "[[bodies]]\nkind = {}"),
    ],
)
def test_whole_numbers_beyond_64_bits_gave_a_traceback(line: str, number: int) -> None:
    shapes = '[[shapes]]\nkind = "disc"\nradius = 0.1\n' if "shape" in line else ""
    message(shapes + ("" if shapes else BODY) + line.format(number))


@pytest.mark.parametrize("parts", first(2, [33, 20_000, 3000, 200_000]))
@pytest.mark.parametrize(
    "text", ["{} = 1", "[{}]\nb = 1", "[[{}]]", "[options.naive]\n{} = 1", "x = [{{ {} = 1 }}]", " {} = 1"]
)
@pytest.mark.parametrize("part", ["a", '"a.b"', "'é'"])
def test_keys_of_thousands_of_parts_gave_a_traceback_or_never_ended(text: str, part: str, parts: int) -> None:
    with within(2.0):
        sentence = message(text.format(" . ".join([part] * parts)))
    assert "a key of more than 32 parts; expected the keys of a scene" in sentence


def test_keys_of_a_scene_and_dots_elsewhere_are_no_deep_keys() -> None:
    dots = ".a" * 1000
    assert len(loads_scene(f"# {dots}\n{BODY}mass = 1.5 # a{dots}\n")) == 1
    assert "'a.a.a" in message(f'broad-phase = "a{dots}"\n{BODY}')


@pytest.mark.parametrize("depth", [40, 5000])
@pytest.mark.parametrize(("begin", "end"), [("[", "]"), ("{a = ", "}")])
def test_tables_and_lists_in_each_other_gave_a_traceback(begin: str, end: str, depth: int) -> None:
    sentence = message(f"bodies = []\n[options.naive]\na = {begin * depth}1{end * depth}")
    assert "tables or lists in each other, more than 32 deep" in sentence


@pytest.mark.parametrize("recipe", ["grid", "random"])
@pytest.mark.parametrize("density", [5e-324, 1e-200])
def test_a_density_of_next_to_nothing_gave_a_traceback(recipe: str, density: float) -> None:
    sentence = message(f"recipe = '{recipe}'\n[parameters]\ndensity = {density!r}")
    assert "bodies[0].radius: found " in sentence


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no named pipes here")
def test_a_pipe_was_waited_for_without_end(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.toml"
    os.mkfifo(pipe)
    assert f"the scene file {str(pipe)!r} cannot be read: it is no regular file" in refused("run", pipe)
    with pytest.raises(OSError, match="no regular file, so it is not read"):
        load_scene(pipe)


def test_a_file_of_any_size_was_read(tmp_path: Path) -> None:
    path = tmp_path / "large.toml"
    path.write_text(BODY, encoding="utf-8")
    with path.open("r+b") as file:
        file.truncate(200 * 2**20)
    with (
        within(2.0),
        pytest.raises(SceneError, match="found more than 67,108,864 bytes; expected at most so"),
    ):
        load_scene(path)
    path.write_text(BODY, encoding="utf-8")
    assert len(load_scene(path, max_bytes=len(BODY))) == 1


def test_mistakes_of_many_kinds_are_reported_up_to_a_hundred() -> None:
    tables = "\n".join(f"[options.p{i}]" for i in range(90))
    names = ", ".join(f"'q{i}'" for i in range(90))
    sentence = message(f"narrow-phases = [{names}]\n{BODY}{tables}")
    assert "the scene: found 11 more mistakes of other kinds; expected none" in sentence


def test_names_without_end_are_neither_reported_nor_compared_in_full() -> None:
    name = "sap" * 100_000
    for text in (f"broad-phase = '{name}'\n{BODY}", f"{name} = 1\n{BODY}", f"{BODY}[options.{name}]",
                 f"recipe = '{name}'", f"recipe = 'grid'\n[parameters]\n{name} = 1", f"x = {name}",
                 f"{BODY}[options.sap-1d]\naxis = '{name}'", f"[{name}]\n[{name}]"):  # fmt: skip
        with within(2.0), pytest.raises(SceneError) as caught:
            loads_scene(text)
        check_message(caught.value)


@pytest.mark.parametrize(
    "text",
    [
        '"\\u001B[31m" = 1\n',
        'broad-phase = "\\u001B[2J\\u0007"\n',
        'narrow-phases = ["\\u009B31m"]\n',
        '[options."\\u001B]0;title\\u0007"]\n',
        '[options.sap-1d]\naxis = "\\u001B[31m"\n',
        '[options.sap-1d]\n"\\u202Eaxis" = 1\n',
        'recipe = "\\u001B[31m"\n',
        'recipe = "grid"\n[parameters]\n"\\u001B[31m\\u000D" = 1\n',
        'recipe = "lattice"\n[parameters]\nkind = "\\u001B[31m\\u000D"\n',
        "x = \x1b[31m\n",
        "# \x1b[31m\n",
        "[\x9b31m]\n",
    ],
)
def test_control_characters_of_a_file_reached_the_terminal(text: str, tmp_path: Path) -> None:
    path = tmp_path / "\x1b[31mred.toml"
    path.write_text(text + ("" if "recipe" in text else "bodies = 1\n"), encoding="utf-8")
    with pytest.raises(SceneError) as caught:
        load_scene(path)
    check_message(caught.value)
    assert "\\x1b[31mred.toml: " in str(caught.value)
