"""New plugins: a complete package with a broad phase, a response, an observable or a recipe that works, as a
beginning for an author. ``templates/`` has the texts, with ``$name``, ``$package`` and others for the
plugin's names."""

import os
import re
from collections.abc import Mapping
from datetime import date
from importlib.metadata import distribution, version
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from shutil import rmtree
from string import Template

from kinetile.errors import BadOption, one_of
from kinetile.plugin.registry import registry
from kinetile.plugin.specs import PluginKind
from kinetile.targets import record_errors, write_file

_KINDS: dict[str, tuple[PluginKind, str, str]] = {
    "phase": ("broad phase", "bodies on leashes; near are those whose leashes meet", "conform {}"),
    "response": ("response", "elastic, but for a part of the speed", "conform naive --response {}"),
    "observable": ("observable", "the mean speed", "run grid --observe {}"),
    "recipe": ("scene", "discs in a row, the first of which moves", "run {}"),
}
"""The possible contents, by their modules: kind in the registry, summary, and a command that uses it."""

PLUGIN_KINDS = ("broad-phase", *[*_KINDS][1:])


def new_plugin(name: str, into: str | os.PathLike[str] = ".", kind: str = "broad-phase") -> Path:
    """Writes the package kinetile-NAME into an existing folder, and returns the package's own folder.
    ``name`` is the name of its content, of a ``kind`` of ``PLUGIN_KINDS``: letters, digits and dashes, others
    folded. Raises BadOption if one is invalid or taken, without the folder, or if its own exists already."""
    if kind not in PLUGIN_KINDS:
        raise BadOption(f"kind is {kind!r}; expected {one_of(str(kind), PLUGIN_KINDS)}")
    words, into = _words(name, kind.rpartition("-")[2]), Path(into)
    if not os.path.isdir(into):
        raise BadOption(f"there is no folder {str(into)!r} to write {words['distribution']} into")
    folder = into / words["distribution"]
    if os.path.exists(folder):
        raise BadOption(f"{str(folder)!r} is there already; nothing was written")
    contents = _contents(words)
    try:
        for path, text in contents.items():
            target = folder / path
            with record_errors(f"{str(target)!r} cannot be written", raised=BadOption):
                target.parent.mkdir(parents=True, exist_ok=True)
                write_file(target, text)
    except BaseException:
        rmtree(folder, ignore_errors=True)
        raise
    return folder


def _words(name: str, module: str) -> dict[str, str]:
    kind, summary, use = _KINDS[module]
    folded = re.sub(r"[-_]+", "-", name.strip().lower())
    stem = folded.replace("-", "_")
    if not (stem.isascii() and stem.isidentifier() and stem.strip("_") == stem):
        raise BadOption(
            f"{name!r} cannot be the name of a plugin; "
            "expected letters, digits and dashes, a letter first, such as sorted-cells"
        )
    for each in registry():
        if each.kind == kind and folded in (each.spec.name, *each.spec.aliases):
            raise BadOption(f"{each.source} already provides {kind} {folded!r}; choose another name")
    package = f"kinetile_{stem}"
    if find_spec(package) is not None:
        raise BadOption(f"there is a package {package} already; choose another name than {folded!r}")
    return {
        "name": folded,
        "distribution": f"kinetile-{folded}",
        "package": package,
        "a": "An" if kind == "observable" else "A",
        "what": "recipe" if kind == "scene" else kind,
        "module": module,
        "target": "recipe" if kind == "scene" else f"{stem.title().replace('_', '')}{module.capitalize()}",
        "summary": summary,
        "use": use.format(folded),
        "judged": f'"{folded}"' if module == "phase" else f'"naive", response="{folded}"',
        "scene": folded if kind == "scene" else "two-discs",
        "observable": folded if kind == "observable" else "energy",
        "hook": f"kinetile_{kind.replace(' ', '_')}s",
        "spec": f"{kind.title().replace(' ', '')}Spec",
        "key": stem,
        "version": version("kinetile"),
    }


def _contents(words: Mapping[str, str]) -> dict[str, str]:
    def text_of(template: str) -> str:
        return (files("kinetile.plugin") / "templates" / f"{template}.txt").read_text(encoding="utf-8")

    def filled(template: str) -> str:
        return Template(text_of(template)).substitute(words)

    package, module, ours = words["package"], words["module"], distribution("kinetile")
    owner = f"Copyright (c) {date.today().year} The authors of {words['distribution']}"
    test = "test_conformance" if module in ("phase", "response") else "test_run"
    return {
        "pyproject.toml": filled("pyproject"),
        "README.md": filled("readme"),
        "LICENSE": re.sub("Copyright .*", owner, ours.read_text("licenses/LICENSE") or "Copyright "),
        f"{package}/__init__.py": filled("init"),
        f"{package}/{module}.py": text_of(module).replace(f"Template{module.capitalize()}", words["target"]),
        f"{package}/py.typed": "",
        f"tests/{test}.py": filled(test),
    }
