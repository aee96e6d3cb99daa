"""The registry in fresh processes, with plugins that pip has really installed: good ones and broken ones.

A wheel is a zip file with a few files of metadata, so these are written on the spot: installing them needs
pip, but neither a build backend nor a network.
"""

import json
import os
import subprocess
import sys
import zipfile
from importlib.util import module_from_spec
from pathlib import Path
from textwrap import dedent
from typing import Any
from zipimport import zipimporter

import pytest

import kinetile as kt
from kinetile.errors import UnknownName
from kinetile.kernel import compiled

BUILT_IN = {
    "broad phase": ("naive", "cells", "sap-1d", "sap-2d", "sap-k", "sweep-tiling", "power"),
    "narrow phase": ("disc", "convex", "wall"),
    "response": ("elastic", "pass", "restitution", "stop"),
    "scene": (
        *("grid", "random", "lattice", "figure-10", "figure-11", "figure-16", "cradle", "break", "two-discs"),
        *("mixture", "grown", "hexagonal", "square", "galton", "heap", "frame"),
    ),
    "observable": (
        *("pressure", "rates", "energy", "momentum", "temperature", "msd", "vacf", "g", "S", "psi6"),
        *("cells", "flips"),
    ),
}


def python(code: str, *path: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    settings = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    settings |= {"PYTHONPATH": os.pathsep.join(map(str, path)), **environment}
    return subprocess.run(
        [sys.executable, "-c", dedent(code)], env=settings, capture_output=True, text=True, timeout=600
    )


def test_the_built_in_names_come_first() -> None:
    registry = kt.registry()
    assert registry is kt.registry()
    for kind, names in BUILT_IN.items():
        own = [each.spec.name for each in registry if each.kind == kind and each.distribution == "kinetile"]
        assert tuple(own) == names == registry.names(kind)[: len(names)]  # type: ignore[arg-type]
    assert registry.spec("narrow phase", "disc").role == "pair"  # type: ignore[union-attr]
    assert registry.spec("narrow phase", "wall").role == "wall"  # type: ignore[union-attr]
    assert registry.spec("broad phase", "sweep-and-prune").name == "sap-1d"
    assert all(provided.spec.summary for provided in registry if provided.distribution == "kinetile")


def test_kinetiles_own_plugin_cannot_be_removed() -> None:
    with pytest.raises(UnknownName):
        kt.registry().remove("kinetile:builtin")
    assert "naive" in kt.registry().names("broad phase")


PREAMBLE = "from kinetile import BroadPhaseSpec, SceneSpec, hookimpl\n"


def bringing(what: str, *specs: str) -> str:
    return f"@hookimpl\ndef kinetile_{what}():\n    return [{', '.join(specs)}]\n"


DISTRIBUTIONS: dict[str, tuple[str, str]] = {
    # distribution: (entry point, module); its name is its fault
    "kinetile-good": (
        "bands",
        bringing(
            "broad_phases",
            'BroadPhaseSpec("bands", "kinetile_good_phase:Bands", "bands", frozenset({"insert"}))',
        ),
    ),
    "kinetile-broken": ("broken", "import a_module_that_is_not_there"),
    "kinetile-leaves": ("leaves", "raise SystemExit(3)"),
    "a-thief": (
        "thief",  # its name sorts before "kinetile", and its first phase is nobody else's
        bringing(
            "broad_phases",
            'BroadPhaseSpec("fresh", "a_thief:Fresh")',
            'BroadPhaseSpec("sap-1d", "a_thief:Fresh")',
        ),
    ),
    "kinetile-raises": (
        "raises",
        bringing("broad_phases", 'BroadPhaseSpec("raised", "kinetile_raises:Raised")')
        + '@hookimpl\ndef kinetile_scenes():\n    raise RuntimeError("a bad day,\\nall day")\n',
    ),
    "kinetile-left": ("twin", bringing("scenes", 'SceneSpec("left", "kinetile_left:left")')),
    "kinetile-right": (
        "twin",  # the registry may be asked while it is being made
        "import kinetile\nKNOWN = kinetile.registry().names('scene')\ndef right():\n    return KNOWN\n"
        + bringing("scenes", 'SceneSpec("right", "kinetile_right:right")'),
    ),
}


def wheel(folder: Path, distribution: str, entry_point: str, code: str, **more_modules: str) -> Path:
    stem = distribution.replace("-", "_")
    info = f"{stem}-0.2.0.dist-info"
    files = {
        f"{stem}.py": PREAMBLE + code,
        **{f"{name}.py": dedent(text) for name, text in more_modules.items()},
        f"{info}/METADATA": f"Metadata-Version: 2.1\nName: {distribution}\nVersion: 0.2.0\n",
        f"{info}/WHEEL": "Wheel-Version: 1.0\nGenerator: tests\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
        f"{info}/entry_points.txt": f"[kinetile]\n{entry_point} = {stem}\n",
    }
    record = "".join(f"{name},,\n" for name in (*files, f"{info}/RECORD"))
    path = folder / f"{stem}-0.2.0-py3-none-any.whl"
    with zipfile.ZipFile(path, "w") as archive:
        for name, text in {**files, f"{info}/RECORD": record}.items():
            archive.writestr(name, text)
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("pip")
    made = tmp_path_factory.mktemp("wheels")
    good_phase = "class Bands:\n    pass\n"
    wheels = [
        wheel(made, name, *plugin, **({"kinetile_good_phase": good_phase} if name == "kinetile-good" else {}))
        for name, plugin in DISTRIBUTIONS.items()
    ]
    command = [sys.executable, "-m", "pip", "--disable-pip-version-check", "install", "--quiet", "--no-index"]
    target = tmp_path_factory.mktemp("site")
    subprocess.run([*command, "--no-deps", "--target", str(target), *map(str, wheels)], check=True)
    return target


@pytest.fixture(scope="module")
def seen(folder: Path) -> Any:
    done = python(
        """
        import json, sys
        import kinetile

        def told(call, *arguments):
            try:
                return repr(call(*arguments))
            except kinetile.errors.KinetileError as error:
                return f"{type(error).__name__}: {error}"

        registry = kinetile.registry()
        before = sorted(n for n in sys.modules if n.startswith(("kinetile_good", "kinetile_plugins")))
        print(json.dumps({
            "listing": registry.as_dicts(),
            "failures": [str(failure) for failure in registry.failures],
            "before": before,
            "bands": told(registry.target, "broad phase", "bands"),
            "unknown": told(registry.target, "broad phase", "Band"),
            "known to right": registry.target("scene", "right")(),
        }))
        """,
        folder,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_installed_plugins_are_found_beside_broken_ones(seen: Any) -> None:
    names: dict[str, list[str]] = {kind: [] for kind in BUILT_IN}
    for row in seen["listing"]["provided"]:
        if row["distribution"] in ("kinetile", *DISTRIBUTIONS):
            names[row["kind"]].append(row["name"])
    assert names == {
        "broad phase": [*BUILT_IN["broad phase"], "bands"],
        "narrow phase": [*BUILT_IN["narrow phase"]],
        "response": [*BUILT_IN["response"]],
        "scene": [*BUILT_IN["scene"], "left", "right"],
        "observable": [*BUILT_IN["observable"]],
    }
    rows = {row["name"]: row for row in seen["listing"]["provided"]}
    assert (rows["sap-1d"]["aliases"], rows["sap-1d"]["plugin"]) == (["sweep-and-prune"], "kinetile:builtin")
    assert rows["bands"] == {
        "kind": "broad phase",
        "name": "bands",
        "summary": "bands",
        "features": ["insert"],
        "aliases": [],
        "api": 2,
        "plugin": "kinetile-good:bands",
        "distribution": "kinetile-good",
        "version": "0.2.0",
    }


def test_two_distributions_have_one_entry_point_name_and_one_asks_for_the_registry(seen: Any) -> None:
    plugins = {row["name"]: row["plugin"] for row in seen["listing"]["provided"]}
    assert (plugins["left"], plugins["right"]) == ("kinetile-left:twin", "kinetile-right:twin")
    assert seen["known to right"][: len(BUILT_IN["scene"])] == list(BUILT_IN["scene"])
    assert ("left" in seen["known to right"], "right" in seen["known to right"]) == (True, False)


FAILURES = [
    "a-thief:thief (a-thief 0.2.0): DuplicateName: broad phase 'sap-1d' is already provided by "
    f"kinetile:builtin (kinetile {kt.__version__}); a-thief:thief (a-thief 0.2.0) cannot provide it as well",
    "kinetile-broken:broken (kinetile-broken 0.2.0): ModuleNotFoundError: "
    "No module named 'a_module_that_is_not_there'",
    "kinetile-leaves:leaves (kinetile-leaves 0.2.0): SystemExit: 3",
    "kinetile-raises:raises (kinetile-raises 0.2.0): BadPlugin: its hook kinetile_scenes raised "
    "RuntimeError: a bad day, all day (kinetile_raises.py, line 5)",
]


def test_failures_name_the_plugin_its_distribution_and_the_cause(seen: Any) -> None:
    assert [line for line in seen["failures"] if "0.2.0" in line] == FAILURES
    rows = {row["plugin"]: row for row in seen["listing"]["failures"]}
    assert rows["kinetile-broken:broken"] == {
        "plugin": "kinetile-broken:broken",
        "distribution": "kinetile-broken",
        "version": "0.2.0",
        "error": "ModuleNotFoundError",
        "message": "No module named 'a_module_that_is_not_there'",
    }


def test_an_unknown_name_is_answered_with_what_failed_to_load(seen: Any) -> None:
    first, second, *rest = seen["unknown"].splitlines()
    assert first == "UnknownName: no broad phase is called 'Band'; did you mean 'bands'?"
    assert second.startswith("available: naive, cells, sap-1d, sap-2d, ")
    assert "bands" in second.split(", ")
    assert [line.removeprefix("not loaded: ") for line in rest if "0.2.0" in line] == FAILURES


def test_targets_are_imported_when_they_are_selected(seen: Any) -> None:
    assert seen["before"] == ["kinetile_good", "kinetile_plugins"]
    assert seen["bands"] == "<class 'kinetile_good_phase.Bands'>"


def test_damaged_metadata_harms_nobody_else(tmp_path: Path) -> None:
    for name, text in {"ours": "[kinetile]\nno equals sign", "other": "[console_scripts]\nnone here"}.items():
        info = tmp_path / f"{name}-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
        (info / "entry_points.txt").write_text(text)
    done = python(
        """
        import kinetile
        print(kinetile.registry().names("broad phase"), *kinetile.registry().failures, sep="\\n")
        """,
        tmp_path,
    )
    assert done.returncode == 0, done.stderr
    names, *failures = done.stdout.splitlines()
    assert "naive" in names
    assert [f for f in failures if "its entry points cannot be read" in f and f.startswith("ours:")]
    assert not [f for f in failures if f.startswith("other")]


def test_from_a_zip_a_run_ended_with_the_name_of_a_file_that_is_no_directory(tmp_path):
    with zipfile.ZipFile(tmp_path / "kinetile.whl", "w") as wheel:
        wheel.write(compiled.__file__, "compiled/__init__.py")
    spec = zipimporter(str(tmp_path / "kinetile.whl")).find_spec("compiled")
    with pytest.raises(ImportError, match=r"within an archive \(.*kinetile\.whl.*\): unpack the wheel$"):
        spec.loader.exec_module(module_from_spec(spec))
