"""The checkers of the vectors: each holds with the function that it has, and finds one wrong answer."""

import json
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from programs import program

VECTORS = Path(__file__).parent
CHECKERS = VECTORS / "checkers"
DISCS = VECTORS / "discs.txt"

FILES = {"python": "check.py", "javascript": "check.mjs", "c": "check.c", "rust": "check.rs"}
OF_ALL_FILES = pytest.mark.parametrize("check", ["python", "javascript"], indirect=True)
"""The others read only ``discs.txt``."""

Check = Callable[..., tuple[int, str]]


def checker(language: str, into: Path) -> list[str]:
    """Returns the command of a checker, compiled if need be."""
    source, made = CHECKERS / FILES[language], str(into / "check")
    compiler, *options = {
        "python": [sys.executable],
        "javascript": ["node"],
        "c": ["cc", "-O2", "-Wall", "-Wextra", "-Werror", "-o", made, str(source), "-lm"],
        "rust": ["rustc", "-O", "--edition", "2021", "-D", "warnings", "-o", made, str(source)],
    }[language]
    found = compiler if language == "python" else program(compiler)
    if not options:
        return [found, str(source)]
    done = subprocess.run([found, *options], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return [made]


@pytest.fixture(scope="module", params=FILES)
def check(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Check:
    """Returns a function that runs a checker and returns its exit code and its output."""
    command = checker(request.param, tmp_path_factory.mktemp(request.param))

    def run(*words: object) -> tuple[int, str]:
        done = subprocess.run([*command, *map(str, words)], capture_output=True, text=True, check=False)
        assert done.stderr == ""
        return done.returncode, done.stdout

    return run


def changed(into: Path, grade: str, *, hit: bool, answer: Callable[[int], str]) -> Path:
    """Writes the discs with another answer to the first hit or miss of a grade."""
    lines = [line.split(" ") for line in DISCS.read_text().splitlines()]
    words = next(words for words in lines if words[0] == grade and (words[3] != "-") == hit)
    words[3] = answer(int(words[3]) if hit else 0)
    file = into / "discs.txt"
    file.write_text("".join(" ".join(words) + "\n" for words in lines))
    return file


def test_hits_misses_and_exact_ticks_hold(check: Check) -> None:
    code, told = check(DISCS)
    assert code == 0, told
    assert "exact: 265 right, 0 hits missed, 0 misses hit, 0 ticks wrong" in told
    assert re.search("clear: .* 0 hits missed, 0 misses hit", told)


@OF_ALL_FILES
def test_all_ticks_of_all_files_hold(check: Check) -> None:
    code, told = check("--exact")
    assert code == 0, told
    files = [*(VECTORS / "contacts").iterdir(), VECTORS / "shapes.json", DISCS]
    assert {line.split(",")[0] for line in told.splitlines()} == {file.name for file in files}
    assert sum(map(int, re.findall(r"(\d+) right", told))) == 6250 + 4560 + 1206


QUADRATICS = {
    "python": """
def my_engine(dx, dy, vx, vy, reach):
    approach, gap = dx * vx + dy * vy, dx * dx + dy * dy - reach * reach
    square = approach * approach - (vx * vx + vy * vy) * gap
    if approach >= 0 or (gap > 0 and square <= 0):
        return None
    return max(gap, 0.0) / (max(square, 0.0) ** 0.5 - approach)
""",
    "javascript": """
function myEngine(dx, dy, vx, vy, reach) {
  const [approach, gap] = [dx * vx + dy * vy, dx * dx + dy * dy - reach * reach];
  const square = approach * approach - (vx * vx + vy * vy) * gap;
  if (approach >= 0 || (gap > 0 && square <= 0)) return null;
  return Math.max(gap, 0) / (Math.sqrt(Math.max(square, 0)) - approach);
}
""",
}


@pytest.mark.parametrize(("language", "fence"), [("python", "python"), ("javascript", "js")])
def test_an_engine_in_doubles_is_put_in_as_the_readme_says(language: str, fence: str, tmp_path: Path) -> None:
    block = (VECTORS / "README.md").read_text().split(f"```{fence}\n")[1].split("```")[0]
    command = checker(language, tmp_path)
    text, count = re.subn("(?m)^.*(from exact import|exact.mjs).*$", "", Path(command[1]).read_text())
    assert count == 1
    file = tmp_path / FILES[language]
    first, second = re.split("(?m)(?=^HERE|^/\\*\\* A body)", text)
    file.write_text(first + QUADRATICS[language] + block + second)
    for words, code in (([], 0), (["--exact"], 1)):
        done = subprocess.run([command[0], str(file), *words, str(DISCS)], capture_output=True, text=True)
        assert (done.returncode, done.stderr) == (code, "")
        assert "exact: 265 right" in done.stdout


def test_the_version_is_said_alike() -> None:
    version = (VECTORS / "VERSION").read_text().strip()
    assert f"version: {version}\n" in (VECTORS / "CITATION.cff").read_text()
    assert f"It is version {version} " in (VECTORS / "README.md").read_text()


def test_one_changed_tick_is_found(check: Check, tmp_path: Path) -> None:
    file = changed(tmp_path, "exact", hit=True, answer=lambda tick: str(tick - 1))
    code, told = check(file)
    assert code == 1
    assert "exact: 264 right, 0 hits missed, 0 misses hit, 1 ticks wrong" in told


def test_a_clear_hit_that_is_missed_and_a_miss_that_is_hit_are_found(check: Check, tmp_path: Path) -> None:
    code, told = check(changed(tmp_path, "clear", hit=True, answer=lambda tick: "-"))
    assert code == 1
    assert "0 hits missed, 1 misses hit" in told
    code, told = check(changed(tmp_path, "clear", hit=False, answer=lambda tick: "7"))
    assert code == 1
    assert "1 hits missed, 0 misses hit" in told


def test_what_is_close_counts_when_all_has_to_be_exact(check: Check, tmp_path: Path) -> None:
    file = changed(tmp_path, "close", hit=False, answer=lambda tick: "7")
    assert check(file)[0] == 0
    assert check("--exact", file)[0] == 1


@OF_ALL_FILES
@pytest.mark.parametrize("name", ["contacts/gas", "shapes"])
def test_one_changed_tick_of_any_file_is_found(check: Check, name: str, tmp_path: Path) -> None:
    told = json.loads((VECTORS / f"{name}.json").read_text())
    rows = [row for rows in told["families"].values() for row in rows if row[-1] is not None]
    row = rows[len(rows) // 2]
    row[-1] = str(int(row[-1]) + 1)
    file = tmp_path / "changed.json"
    file.write_text(json.dumps(told))
    code, printed = check("--exact", file)
    assert code == 1
    assert "0 hits missed, 0 misses hit, 1 ticks wrong" in printed
