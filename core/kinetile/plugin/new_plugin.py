"""New plugins: a complete package with a working broad phase, to be changed into one's own.

The texts are in ``templates/``, with ``$name``, ``$package`` and ``$distribution`` in place of the plugin's
names. ``phase.txt`` is a working broad phase; it is copied with the name of its class changed, and passes the
same checks as kinetile's own code.
"""

from __future__ import annotations

import os
import re
from datetime import date
from importlib.metadata import version
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from shutil import rmtree
from string import Template
from typing import NamedTuple

from kinetile.errors import BadOption
from kinetile.plugin.registry import registry
from kinetile.targets import write_file


class _Names(NamedTuple):
    """The names of a plugin's parts."""

    name: str
    distribution: str
    package: str
    class_name: str


def new_plugin(name: str, into: str | os.PathLike[str] = ".") -> Path:
    """Writes the package kinetile-NAME into a folder, and returns the package's own folder.

    Args:
        name: the name of the broad phase: letters, digits and dashes; upper case and underscores are
            folded.
        into: an existing folder.

    Raises:
        BadOption: the name is invalid or taken; there is no such folder; the package's own folder exists
            already.
    """
    names, into = _names(name), Path(into)
    if not os.path.isdir(into):
        raise BadOption(f"there is no folder {str(into)!r} to write {names.distribution} into")
    folder = into / names.distribution
    if os.path.exists(folder):
        raise BadOption(f"{str(folder)!r} is there already; nothing was written")
    contents = _contents(names)
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


def _names(name: str) -> _Names:
    """Folds a name, and derives the others from it; raises BadOption if it cannot be used."""
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
    class_name = "".join(word.capitalize() for word in stem.split("_")) + "Phase"
    return _Names(folded, f"kinetile-{folded}", package, class_name)


def _contents(names: _Names) -> dict[str, str]:
    words = names._asdict() | {
        "key": names.package.removeprefix("kinetile_"),
        "version": version("kinetile"),
        "year": str(date.today().year),
    }

    def filled(template: str) -> str:
        text = (files("kinetile.plugin") / "templates" / template).read_text(encoding="utf-8")
        return Template(text).substitute(words)

    phase = (files("kinetile.plugin") / "templates" / "phase.txt").read_text(encoding="utf-8")
    return {
        "pyproject.toml": filled("pyproject.txt"),
        "README.md": filled("readme.txt"),
        "LICENSE": filled("license.txt"),
        f"{names.package}/__init__.py": filled("init.txt"),
        f"{names.package}/phase.py": phase.replace("TemplatePhase", names.class_name),
        f"{names.package}/py.typed": "",
        "tests/test_conformance.py": filled("test_conformance.txt"),
    }
