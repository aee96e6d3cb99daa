"""The layout of the code: what is above the engine uses public names only."""

import ast
import re
from functools import cache
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

ROOT = Path(__file__).parents[1]
CORE = ROOT / "core" / "kinetile"
PLUGINS = ROOT / "plugins"
USERS = (
    *(CORE / name for name in ("cli", "records", "show")),
    *(PLUGINS / f"kinetile_{name}" for name in ("accuracy", "bench", "conformance")),
)
"""Packages above ``run``, and the instruments: users of the public interface like anybody."""

NAMED_TUPLE = {"_replace", "_fields", "_asdict", "_make"}
"""Public names, whatever they look like."""


@cache
def parsed(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def private(name: str) -> bool:
    return name.startswith("_") and not name.startswith("__")


@pytest.mark.parametrize("package", USERS, ids=lambda path: path.name)
def test_what_judges_and_shows_uses_nothing_private(package):
    found = []
    for path in sorted(package.rglob("*.py")):
        tree = parsed(path)
        own = {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)} | NAMED_TUPLE
        for node in ast.walk(tree):
            if isinstance(node, ast.Attribute) and private(node.attr) and node.attr not in own:
                mine = isinstance(node.value, ast.Name) and node.value.id in ("self", "cls", "os")
                found += [] if mine else [f"{path.relative_to(ROOT)}:{node.lineno} {node.attr}"]
            if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("kinetile"):
                names = [*node.module.split("."), *(alias.name for alias in node.names)]
                found += [f"{path.relative_to(ROOT)}:{node.lineno} {name}" for name in names if private(name)]
    assert not found


INSTRUMENTS = tuple(PLUGINS / f"kinetile_{name}" for name in ("accuracy", "bench", "conformance"))


def imported(path: Path, module: str) -> set[str]:
    tree = ast.walk(parsed(path))
    found = [node for node in tree if isinstance(node, ast.ImportFrom) and node.module is not None]
    return {alias.name for node in found if node.module.startswith(module) for alias in node.names}


def test_a_name_for_instruments_is_on_their_page_and_of_use():
    page = (ROOT / "docs" / "api" / "instruments.md").read_text(encoding="utf-8")
    files = [path for package in INSTRUMENTS for path in package.rglob("*.py")]
    handed_on = imported(CORE / "instruments.py", "kinetile.") - {"lazy_names"}
    used = {name for path in files for name in imported(path, "kinetile.instruments")}
    assert handed_on == used
    commands = {name for path in files for name in imported(path, "kinetile.cli.")}
    named = re.compile(r"(?<!\.)\bcli\.(\w+)")
    commands |= {name for path in files for name in named.findall(path.read_text(encoding="utf-8"))}
    rows = "".join(line for line in page.splitlines() if line.startswith("| "))
    assert set(re.findall(r"`(\w+)`", rows)) == handed_on | commands


def test_nobody_imports_the_root_package():
    """Through it a lower package would reach all that is above. Instruments are users: they may."""
    for path in sorted(CORE.rglob("*.py")):
        for node in ast.walk(parsed(path)):
            if isinstance(node, ast.Import):
                assert all(alias.name != "kinetile" for alias in node.names), path
            if isinstance(node, ast.ImportFrom):
                assert node.module != "kinetile", path


def test_no_test_judges_how_long_it_takes():
    """A busy machine failed tests with "Input generation is slow". What a test itself suppresses takes the
    place of what all suppress, and a deadline of its own that of none."""
    assert settings.default.deadline is None
    assert HealthCheck.too_slow in settings.default.suppress_health_check
    names = ("suppress_health_check", "deadline")
    for path in sorted(Path(__file__).parent.rglob("*.py")):
        named = any(name in path.read_text(encoding="utf-8") for name in names)
        for node in ast.walk(parsed(path)) if named else ():
            if isinstance(node, ast.keyword) and node.arg in names:
                said = ast.unparse(node.value)
                assert said in ("None", "list(HealthCheck)") or path.name == "conftest.py", path


WRITES = {
    "write_bytes",
    "write_text",
    "savefig",
    "imsave",
    "save_all",
    "to_csv",
    "tofile",
    "savetxt",
    "savez",
}
"""Methods that write a file by its name; those that can open one for writing follow by their mode."""

OPENED = {
    ("core/kinetile/targets.py", "open(fresh, 'xb', opener=opened)"): "the one way",
    ("core/kinetile/targets.py", "fresh.replace(target)"): "the one way",
    ("core/kinetile/show/printed.py", "figure.savefig(written, format=form, **options)"): "bytes in memory",
    ("core/kinetile/records/log.py", "open(descriptor, 'wb', buffering=0)"): "a log that is locked",
    ("core/kinetile/records/recorder.py", "unfinished.replace(self.partial)"): "a log that is locked",
    ("core/kinetile/show/film.py", "av.open(file, 'w', format='mp4')"): "a file that will replace",
    ("core/kinetile/records/frames.py", "gsd_module().open(file.name, 'w')"): "a file that will replace",
    (
        "core/kinetile/run/saving/files.py",
        "archive.open(zipfile.ZipInfo(f'{name}.npy'), 'w', force_zip64=True)",
    ): ("a member of an archive"),
    ("core/kinetile/run/saving/files.py", "zipfile.ZipFile(hashed, 'w')"): "a file that will replace",
    ("plugins/kinetile_conformance/processes.py", "self._file.open('wb')"): "in a temporary folder",
    ("plugins/kinetile_conformance/processes.py", "os.fdopen(os.dup(1), 'wb')"): "a pipe",
}
"""Calls that may write otherwise than by ``kinetile.targets``, and what they write to."""


def writes(call: ast.Call) -> bool:
    """Whether a call writes or moves a file by a method of ``WRITES``, a mode, or ``Path.replace``."""
    name = call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")
    given = [*call.args, *(each.value for each in call.keywords if each.arg == "mode")]
    modes = [each.value for each in given if isinstance(each, ast.Constant)]
    module = getattr(getattr(call.func, "value", None), "id", "")
    moves = (name == "replace" and len(call.args) == 1 and not call.keywords) or (
        name in ("replace", "rename", "renames", "move", "copy", "copy2", "copyfile", "copytree")
        and module in ("os", "shutil")
    )
    opens = name in ("open", "fdopen", "ZipFile", "TarFile", "NamedTemporaryFile")
    return (
        name in WRITES
        or moves
        or (opens and any(re.fullmatch(r"[rbt]*[wax+][bt+]*", str(mode)) for mode in modes))
    )


def test_a_file_was_truncated_before_its_new_content_could_be_written():
    """On a full disk, --overwrite left nothing of the old file: all go through ``kinetile.targets``."""
    found = set()
    for path in sorted(file for root in (CORE, PLUGINS) for file in root.rglob("*.py")):
        for node in ast.walk(parsed(path)):
            if isinstance(node, ast.Call) and writes(node):
                found.add((path.relative_to(ROOT).as_posix(), ast.unparse(node)))
    assert found == set(OPENED)


EVALUATES = {
    "core/kinetile/kernel/plan.py": 4,  # the one place, without and with accelerations,
    "core/kinetile/show/player/script/run/plan.mjs": 2,  # and that of a page
    "plugins/kinetile_accuracy/oracle/times.py": 2,  # an implementation of its own, in rational numbers
    "plugins/kinetile_accuracy/specification/arithmetic.py": 1,  # another one, by the rules,
    "plugins/kinetile_accuracy/specification/bounds.py": 1,  # and what it leaves out
    "plugins/kinetile_accuracy/stepped/snapshots.py": 2,  # a step of what plans are compared with
    "plugins/kinetile_plugins/convex.py": 2,  # no plan: the way from one body to another
}
"""Files that have place + velocity * time, and how often."""

FIELD = r"[\w.\['\]]*?\b(?:{})(?:'\])?(?:\[[^]]*\])?"
"""A variable, an attribute or a column of one of these names, or some of its elements."""

PLACE = r"(?<![\w.\]'])(?<![-*] )" + FIELD.format("x|y|anchor|at|place|position|there")
"""Not the end of a difference, for what is between two bodies is no plan, nor of a product."""

SPEED = FIELD.format("vx|vy|speed|velocity|flies")
EVALUATION = re.compile(rf"{PLACE} [+-]=? \(?(?:{SPEED} \*|[\w.\[\]]+ \* {SPEED}(?!\w))")


def test_a_flight_plan_is_evaluated_in_one_place():
    for file in sorted(file for root in (CORE, PLUGINS) for file in root.rglob("*.*")):
        source = ast.unparse(parsed(file)) if file.suffix == ".py" else ""
        source = file.read_text(encoding="utf-8") if file.suffix in (".mjs", ".txt") else source
        path, found = file.relative_to(ROOT).as_posix(), EVALUATION.findall(source)
        assert len(found) == EVALUATES.get(path, 0), (
            f"{path} has {found}, a place + velocity * time: call position_after of kernel/plan.py "
            "(position_at in a hook, that of plan.mjs in a page), or change EVALUATES"
        )


ELSEWHERE = {"NUMBA_CACHE_DIR", "NUMBA_DISABLE_JIT", "FILE", "QUESTIONS"}
"""Variables of the environment, and arguments of commands."""


def test_a_docstring_named_what_had_another_name_by_then():
    """A name in capitals is a constant's; one with a module before it is one of that module."""
    source = {
        file: file.read_text(encoding="utf-8")
        for root in (CORE, PLUGINS)
        for file in sorted(root.rglob("*.py"))
    }
    code = {file: re.sub(r'"""(?:.|\n)*?"""', "", text) for file, text in source.items()}
    known = {name for text in code.values() for name in re.findall(r"\b[A-Z][A-Z_0-9]{2,}\b", text)}
    for file, text in source.items():
        for module, name in re.findall(r"``(?:([\w.]+)\.)?([A-Z][A-Z_0-9]{2,})``", text):
            path = module.replace(".", "/")
            where = [each for each in code if path in (each.with_suffix("").as_posix()[-len(path) :], "")]
            where += [each for each in code if each.as_posix().endswith(f"{path}/__init__.py")]
            there = any(re.search(rf"\b{name}\b", code[each]) for each in where)
            assert name in ELSEWHERE or (there if module else name in known), f"{file}: {module}.{name}"
