"""New plugins: a complete package with a working broad phase, to be changed into one's own. The texts are in
``templates/``, with ``$name``, ``$package`` and ``$distribution`` in place of the plugin's names."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from datetime import date
from importlib.metadata import version
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from shutil import rmtree
from string import Template

from kinetile.errors import BadOption
from kinetile.plugin.registry import registry
from kinetile.targets import write_file


def new_plugin(name: str, into: str | os.PathLike[str] = ".") -> Path:
    """Writes the package kinetile-NAME into an existing folder, and returns the package's own folder.
    ``name`` is that of the broad phase: letters, digits and dashes, others folded. Raises BadOption where it
    is invalid or taken, there is no such folder, or its own is there already."""
    words, into = _words(name), Path(into)
    if not os.path.isdir(into):
        raise BadOption(f"there is no folder {str(into)!r} to write {words['distribution']} into")
    folder = into / words["distribution"]
    if os.path.exists(folder):
        raise BadOption(f"{str(folder)!r} is there already; nothing was written")
    contents = _contents(words)
    try:
        for path, text in contents.items():
            target = folder / path
            target.parent.mkdir(parents=True, exist_ok=True)
            write_file(target, text)
    except BaseException as error:
        rmtree(folder, ignore_errors=True)
        if isinstance(error, OSError):
            raise BadOption(f"{str(target)!r} cannot be written: {error.strerror}") from error
        raise
    return folder


def _words(name: str) -> dict[str, str]:
    folded = re.sub(r"[-_]+", "-", name.strip().lower())
    stem = folded.replace("-", "_")
    if not (stem.isascii() and stem.isidentifier() and stem.strip("_") == stem):
        raise BadOption(
            f"{name!r} cannot be the name of a plugin; "
            "expected letters, digits and dashes, a letter first, such as sorted-cells"
        )
    for each in registry():
        if each.kind == "broad phase" and folded in (each.spec.name, *each.spec.aliases):
            raise BadOption(f"{each.source} already provides broad phase {folded!r}; choose another name")
    package = f"kinetile_{stem}"
    if find_spec(package) is not None:
        raise BadOption(f"there is a package {package} already; choose another name than {folded!r}")
    return {
        "name": folded,
        "distribution": f"kinetile-{folded}",
        "package": package,
        "class_name": "".join(word.capitalize() for word in stem.split("_")) + "Phase",
        "key": stem,
        "version": version("kinetile"),
        "year": str(date.today().year),
    }


def _contents(words: Mapping[str, str]) -> dict[str, str]:
    def text_of(template: str) -> str:
        return (files("kinetile.plugin") / "templates" / f"{template}.txt").read_text(encoding="utf-8")

    def filled(template: str) -> str:
        return Template(text_of(template)).substitute(words)

    return {
        "pyproject.toml": filled("pyproject"),
        "README.md": filled("readme"),
        "LICENSE": filled("license"),
        f"{words['package']}/__init__.py": filled("init"),
        f"{words['package']}/phase.py": text_of("phase").replace("TemplatePhase", words["class_name"]),
        f"{words['package']}/py.typed": "",
        "tests/test_conformance.py": filled("test_conformance"),
    }
