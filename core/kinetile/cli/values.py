"""What is written on the command line: a scene, and lists of numbers."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kinetile.errors import BadOption

if TYPE_CHECKING:
    from kinetile.scene import Scene

__all__ = ["find_scene", "read_numbers"]


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
        from kinetile.plugin.by_name import load_scene

        if parameters:
            raise BadOption(
                f"a scene file takes no parameters (found {', '.join(parameters)}): they are for recipes, "
                "which `kinetile scenes` lists"
            )
        if not Path(name).exists():
            raise BadOption(f"there is no scene file {name!r}")
        try:
            return load_scene(name)
        except OSError as error:
            raise BadOption(f"the scene file {name!r} cannot be read: {error.strerror}") from error
    from kinetile.plugin.by_name import make_scene, parse_parameters

    return make_scene(name, **parse_parameters(name, parameters))
