"""What is written on the command line: values, ``key=value``, and phases with options (``sap-1d:axis=y``)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kinetile.errors import BadOption

if TYPE_CHECKING:
    from kinetile.scene import Scene

__all__ = ["find_scene", "read_assignments", "read_numbers", "read_phase", "read_phases", "read_value"]

_WORDS = {"true": True, "false": False, "none": None}


def read_value(text: str) -> Any:
    """Return what a text stands for: a whole number, a number, true, false, none, a TOML array, or itself."""
    for reading in (int, float):
        try:
            return reading(text)
        except ValueError:
            pass
    if text.lower() in _WORDS:
        return _WORDS[text.lower()]
    if text[:1] in ("[", '"', "'"):
        import tomllib

        try:
            return tomllib.loads(f"value = {text}")["value"]
        except tomllib.TOMLDecodeError:
            return text
    return text


def read_assignments(texts: Iterable[str], where: str) -> dict[str, Any]:
    """Return ``key=value`` texts as a dictionary, dashes in keys as underscores; BadOption for others."""
    found: dict[str, Any] = {}
    for text in texts:
        key, equals, value = text.partition("=")
        key = key.strip().replace("-", "_")
        if not equals or not key:
            raise BadOption(f"{where} {text!r}: expected key=value, such as seed=7")
        if key in found:
            raise BadOption(f"{where} {text!r}: {key} is given twice")
        found[key] = read_value(value.strip())
    return found


def read_phase(text: str) -> tuple[str, dict[str, Any]]:
    """Return the name and the options of a phase: ``sap-1d`` or ``sap-1d:axis=y,other=2``."""
    name, _, options = text.strip().partition(":")
    if not name:
        raise BadOption(f"{text!r} names no phase; expected a name, such as sap-1d or sap-1d:axis=y")
    return name, read_assignments(filter(None, options.split(",")), f"phase {name!r}: option")


def read_phases(text: str) -> list[str]:
    """Return the phases of a list with commas; ``key=value`` after a phase with options is another option."""
    phases: list[str] = []
    for piece in filter(None, (piece.strip() for piece in text.split(","))):
        goes_on = "=" in piece and ":" not in piece.partition("=")[0]
        if goes_on and phases and ":" in phases[-1]:
            phases[-1] += f",{piece}"
        else:
            phases.append(piece)
    return phases


def read_numbers(text: str, kind: type, where: str) -> list[Any]:
    """Return the numbers of a list with commas, each of a kind (int or float) and greater than 0."""
    numbers = []
    for piece in filter(None, (piece.strip() for piece in text.split(","))):
        try:
            numbers.append(kind(piece))
        except ValueError:
            numbers.append(0)
        if not numbers[-1] > 0:
            what = "whole numbers" if kind is int else "numbers"
            raise BadOption(f"{where}: found {piece!r}; expected {what} greater than 0, with commas between")
    return numbers


def find_scene(name: str, parameters: Sequence[str]) -> Scene:
    """Return the scene of a TOML file (a name that ends in .toml, or has a slash in it) or of a recipe."""
    if name.lower().endswith(".toml") or "/" in name or "\\" in name:
        from kinetile.scene_files import load_scene

        if parameters:
            raise BadOption(
                f"a scene file takes no parameters (found {', '.join(parameters)}): they are for recipes, "
                "which `kinetile scenes` lists"
            )
        if not Path(name).is_file():
            raise BadOption(f"there is no scene file {name!r}")
        try:
            return load_scene(name)
        except OSError as error:
            raise BadOption(f"the scene file {name!r} cannot be read: {error.strerror}") from error
    from kinetile.recipes import make_scene, parse_parameters

    return make_scene(name, **parse_parameters(name, parameters))
